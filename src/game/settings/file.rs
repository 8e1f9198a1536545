//! The player's settings as a file in the folder of their configuration: read once, written whole or not at all.
//!
//! A file that cannot be used is set aside under another name, never overwritten, and the defaults stand in for it.

use std::{
    collections::BTreeMap,
    fs, io,
    path::{Path, PathBuf},
};

use resecta_instrument::{BoundInput, FeelError, Handedness, InstrumentAction, InstrumentBindings, LiveFeel};
use resecta_text::{Slip, write_whole};
use serde::{Deserialize, Serialize};
use thiserror::Error;

/// Names a folder for the settings in place of the usual one.
const FOLDER_VARIABLE: &str = "RESECTA_CONFIG_DIR";

const FILE: &str = "settings.ron";

/// What is kept of a player's choices.
#[derive(Serialize, Deserialize, Debug, Clone, PartialEq, Default)]
#[serde(deny_unknown_fields, default)]
pub struct Settings {
    /// Which hand holds the mouse: what a reset goes back to.
    pub hand: Handedness,
    /// Sensitivities, inverted axes, dead zone, pedals.
    pub feel: LiveFeel,
    /// How loud the game is.
    pub sound: SoundSettings,
    /// Whether every exercise is open, whatever was earned before it.
    pub all_open: bool,
    /// Whether the panel shows how fast the simulation is, and its error.
    pub shows_speed: bool,
    /// What does each action. An action that is not named is bound as at first; one with an empty list by nothing.
    pub bindings: BTreeMap<InstrumentAction, Vec<BoundInput>>,
}

/// How loud the game is.
#[derive(Serialize, Deserialize, Debug, Clone, Copy, PartialEq)]
#[serde(deny_unknown_fields, default)]
pub struct SoundSettings {
    /// 0 (silent) to 1.
    pub volume: f32,
    /// Silent whatever the volume is.
    pub muted: bool,
}

impl Default for SoundSettings {
    fn default() -> Self {
        Self {
            volume: 0.7,
            muted: false,
        }
    }
}

impl SoundSettings {
    /// The volume that is to be heard, 0 to 1.
    pub fn loudness(&self) -> f32 {
        if self.muted { 0.0 } else { self.volume }
    }
}

/// Why settings were not read or written.
#[derive(Error, Debug)]
pub enum SettingsError {
    /// The file cannot be read.
    #[error("{}: cannot be read: {source}", file.display())]
    Read {
        /// The file.
        file: PathBuf,
        /// Why.
        source: io::Error,
    },
    /// The file is not what it should be: bad RON, an unknown name or a value of the wrong type.
    #[error("{}:{slip}", file.display())]
    Syntax {
        /// The file.
        file: PathBuf,
        /// Where in it, what is wrong there, and what was expected.
        slip: Box<Slip>,
    },
    /// A number is out of its range.
    #[error("{}: feel.{value}", file.display())]
    Value {
        /// The file.
        file: PathBuf,
        /// The field, its value and its range.
        value: FeelError,
    },
    /// The volume is out of its range.
    #[error("{}: sound.volume is {value}, expected 0 to 1", file.display())]
    Volume {
        /// The file.
        file: PathBuf,
        /// The volume.
        value: f32,
    },
    /// The file cannot be written; one that was there before is as it was.
    #[error("{}: cannot be written: {source}", file.display())]
    Write {
        /// The file.
        file: PathBuf,
        /// Why.
        source: io::Error,
    },
}

impl Settings {
    /// What these bindings keep, with all else as at first.
    pub fn of(hand: Handedness, bindings: &InstrumentBindings) -> Self {
        let rows = bindings.rows.iter();
        Settings {
            hand,
            feel: bindings.feel,
            sound: SoundSettings::default(),
            all_open: false,
            shows_speed: false,
            bindings: rows.map(|row| (row.action, row.inputs.clone())).collect(),
        }
    }

    /// The bindings that they stand for.
    pub fn bindings(&self) -> InstrumentBindings {
        let mut bindings = InstrumentBindings::of_hand(self.hand);
        bindings.feel = self.feel;
        for row in &mut bindings.rows {
            if let Some(inputs) = self.bindings.get(&row.action) {
                row.inputs.clone_from(inputs);
            }
        }
        bindings
    }

    fn from_ron(text: &str, file: &Path) -> Result<Self, SettingsError> {
        let settings: Settings = resecta_text::read(text).map_err(|slip| SettingsError::Syntax {
            file: file.into(),
            slip: slip.into(),
        })?;
        settings.feel.checked().map_err(|value| SettingsError::Value {
            file: file.into(),
            value,
        })?;
        match settings.sound.volume {
            volume if (0.0..=1.0).contains(&volume) => Ok(settings),
            value => Err(SettingsError::Volume {
                file: file.into(),
                value,
            }),
        }
    }
}

/// What came of reading the settings.
#[derive(Debug, Default)]
pub struct Loaded {
    /// The settings, or the defaults.
    pub settings: Settings,
    /// Why they are the defaults, where a file was there.
    pub trouble: Option<SettingsError>,
    /// Where the file that could not be used is now; none where it could not be moved. Then nothing may be written over it.
    pub set_aside: Option<PathBuf>,
}

/// Where settings are kept.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct SettingsFile(PathBuf);

impl SettingsFile {
    /// In this folder, which is made when it is first written.
    pub fn in_folder(folder: &Path) -> Self {
        SettingsFile(folder.join(FILE))
    }

    /// In the folder that `RESECTA_CONFIG_DIR` names, else in `resecta` in the user's folder of configuration
    /// (`$XDG_CONFIG_HOME` or `~/.config` on Linux). None for a user who has no such folder.
    pub fn of_user() -> Option<Self> {
        let named = std::env::var_os(FOLDER_VARIABLE).filter(|folder| !folder.is_empty());
        let folder = named.map(PathBuf::from);
        let folder = folder.or_else(|| Some(dirs::config_dir()?.join("resecta")))?;
        Some(Self::in_folder(&folder))
    }

    /// The file.
    pub fn path(&self) -> &Path {
        &self.0
    }

    /// Reads the settings: those of the file, or the defaults where there is none or none that can be used.
    pub fn load(&self) -> Loaded {
        let text = match fs::read_to_string(&self.0) {
            Ok(text) => text,
            Err(error) if error.kind() == io::ErrorKind::NotFound => return Loaded::default(),
            Err(source) => {
                let file = self.0.clone();
                return self.set_aside(SettingsError::Read { file, source });
            }
        };
        match Settings::from_ron(&text, &self.0) {
            Ok(settings) => Loaded {
                settings,
                ..Loaded::default()
            },
            Err(error) => self.set_aside(error),
        }
    }

    fn set_aside(&self, trouble: SettingsError) -> Loaded {
        let names = std::iter::once("settings.broken.ron".to_owned())
            .chain((2..100).map(|number| format!("settings.broken-{number}.ron")));
        let mut free = names
            .map(|name| self.0.with_file_name(name))
            .filter(|file| !file.exists());
        let set_aside = free.next().filter(|file| fs::rename(&self.0, file).is_ok());
        Loaded {
            settings: Settings::default(),
            trouble: Some(trouble),
            set_aside,
        }
    }

    /// Writes the settings, all of them or nothing.
    ///
    /// # Errors
    /// [`SettingsError::Write`].
    pub fn save(&self, settings: &Settings) -> Result<(), SettingsError> {
        let write = || {
            let pretty = ron::ser::PrettyConfig::new().depth_limit(2);
            let text = ron::ser::to_string_pretty(settings, pretty).map_err(io::Error::other)?;
            if let Some(folder) = self.0.parent() {
                fs::create_dir_all(folder)?;
            }
            write_whole(&self.0, text.as_bytes())
        };
        write().map_err(|source| SettingsError::Write {
            file: self.0.clone(),
            source,
        })
    }
}

#[cfg(test)]
mod tests {
    use bevy::prelude::*;
    use resecta_instrument::PedalMode;

    use super::*;

    fn broken(text: &str) -> (String, String, usize) {
        let folder = tempfile::tempdir().unwrap();
        let file = SettingsFile::in_folder(folder.path());
        fs::write(file.path(), text).unwrap();
        let loaded = file.load();
        assert_eq!(loaded.settings, Settings::default(), "defaults stand in");
        let kept = fs::read_to_string(loaded.set_aside.expect("kept aside")).unwrap();
        let error = loaded.trouble.expect("told").to_string();
        let (_, place) = error.split_once(FILE).expect("the file is named");
        (place.to_owned(), kept, fs::read_dir(folder.path()).unwrap().count())
    }

    #[test]
    fn settings_read_back_as_they_were_written() {
        let folder = tempfile::tempdir().unwrap();
        let file = SettingsFile::in_folder(&folder.path().join("made/when needed"));
        assert_eq!(file.load().settings, Settings::default(), "no file, no trouble");
        assert!(file.load().trouble.is_none());
        let mut bindings = InstrumentBindings::of_hand(Handedness::Left);
        bindings.feel.mouse = 1.7;
        bindings.feel.inverted.wheel = true;
        bindings.feel.pedals = PedalMode::Toggle;
        let extra = BoundInput::PadNegative(GamepadAxis::LeftZ);
        bindings.bind(InstrumentAction::Cut, extra, None);
        bindings.rows[InstrumentAction::RollLeft.index()].inputs.clear();
        let mut settings = Settings::of(Handedness::Left, &bindings);
        settings.sound = SoundSettings {
            volume: 0.25,
            muted: true,
        };
        file.save(&settings).unwrap();
        file.save(&settings).unwrap();
        let read = file.load();
        assert!(read.trouble.is_none(), "{:?}", read.trouble);
        assert_eq!(read.settings.bindings(), bindings);
        assert_eq!(read.settings.sound, settings.sound);
        let files = fs::read_dir(file.path().parent().unwrap()).unwrap().count();
        assert_eq!(files, 1, "nothing unfinished is left");
    }

    #[test]
    fn actions_that_a_file_does_not_name_are_bound_as_at_first() {
        let text = "(hand: Left, bindings: {Cut: [\"KeyX\"]})";
        let bindings = Settings::from_ron(text, Path::new(FILE)).unwrap().bindings();
        let mut expected = InstrumentBindings::of_hand(Handedness::Left);
        expected.rows[InstrumentAction::Cut.index()].inputs = vec![BoundInput::Key(KeyCode::KeyX)];
        assert_eq!(bindings, expected);
    }

    #[test]
    fn a_broken_file_is_told_by_its_place_kept_aside_and_replaced_by_defaults() {
        for (text, at, says) in [
            ("(hand: Left", ":1:12: ", "expected `,` or a closing bracket"),
            ("(\n  hand: Both)", ":2:9: hand: ", "Both"),
            (
                "(bindings: {Cut: [\"KeyÄ\"]})",
                ":1:25: bindings.",
                "`KeyÄ` is no input, expected",
            ),
            ("(feel: (mouse: 9))", ": feel.mouse is 9", "expected 0.1 to 5"),
            ("(sound: (volume: 2))", ": sound.volume is 2", "expected 0 to 1"),
            ("(sound: (volume: NaN))", ": sound.volume is NaN", "expected 0 to 1"),
        ] {
            let (place, kept, files) = broken(text);
            assert!(place.starts_with(at) && place.contains(says), "{text} says {place}");
            assert_eq!((kept.as_str(), files), (text, 1));
        }
    }

    #[test]
    fn a_second_broken_file_does_not_take_the_place_of_the_first() {
        let folder = tempfile::tempdir().unwrap();
        let file = SettingsFile::in_folder(folder.path());
        for text in ["one", "two"] {
            fs::write(file.path(), text).unwrap();
            assert!(file.load().set_aside.is_some());
        }
        let read = |name: &str| fs::read_to_string(folder.path().join(name)).unwrap();
        assert_eq!(read("settings.broken.ron"), "one");
        assert_eq!(read("settings.broken-2.ron"), "two");
    }

    #[test]
    fn settings_that_cannot_be_written_say_where() {
        let folder = tempfile::tempdir().unwrap();
        let in_the_way = folder.path().join("a file");
        fs::write(&in_the_way, "").unwrap();
        let file = SettingsFile::in_folder(&in_the_way);
        let error = file.save(&Settings::default()).expect_err("a file is no folder");
        assert!(error.to_string().contains("settings.ron: cannot be written"), "{error}");
    }
}
