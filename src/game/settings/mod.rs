//! The player's settings: kept in a file, changed on a page over the game.
//!
//! | to find | look in |
//! |---|---|
//! | what is kept, and how | `file.rs` |
//! | what the page shows | `page.rs`, `table.rs` |
//! | which inputs are the game's own | [`RESERVED`] |
//!
//! While [`SettingsPage::open`] the game holds still and the instrument gets no input. Runs without a window never read
//! the file.

mod file;
mod page;
mod table;

use bevy::prelude::*;
use bevy_egui::EguiPrimaryContextPass;
use resecta_instrument::{BoundInput, DeviceParams, Handedness, InputCapture, InstrumentAction, InstrumentBindings};
use resecta_scenario::RunState;

use super::{
    debrief,
    flow::{GameFlow, Phase, Wish},
    sound,
};

pub use file::{Loaded, Settings, SettingsError, SettingsFile, SoundSettings};

/// Opens and closes the page.
pub const KEY: KeyCode = KeyCode::F2;

/// Inputs that the game itself listens to, and what for.
pub const RESERVED: [(BoundInput, &str); 21] = {
    use BoundInput::{Button, Key, PadButton};
    [
        (Key(KeyCode::Enter), "begin, go on"),
        (Key(KeyCode::NumpadEnter), "begin, go on"),
        (Key(KeyCode::Escape), "pause"),
        (Key(KeyCode::KeyP), "pause"),
        (Key(KeyCode::KeyR), "restart"),
        (Key(KeyCode::Tab), "change the views"),
        (Key(KeyCode::KeyG), "guidance"),
        (Key(KeyCode::KeyH), "help"),
        (Key(KeyCode::F1), "help"),
        (Key(KEY), "settings"),
        (Key(sound::KEY), "sound on, off"),
        (Key(KeyCode::KeyJ), "turn the outside view"),
        (Key(KeyCode::KeyL), "turn the outside view"),
        (Key(KeyCode::KeyI), "turn the outside view"),
        (Key(KeyCode::KeyK), "turn the outside view"),
        (Key(KeyCode::KeyU), "zoom the outside view"),
        (Key(KeyCode::KeyO), "zoom the outside view"),
        (Button(MouseButton::Middle), "turn the outside view"),
        (PadButton(GamepadButton::Start), "begin, pause"),
        (PadButton(GamepadButton::Select), "change the views"),
        (PadButton(GamepadButton::North), "guidance"),
    ]
};

/// The page of settings.
#[derive(Resource, Debug, Default)]
pub struct SettingsPage {
    /// Whether it is shown. Anyone may open it.
    pub open: bool,
    /// Whether it was shown in the last frame.
    was_open: bool,
    /// Whether to set everything back was asked for once: it is done when asked for again.
    sets_back: bool,
    /// The binding that waits for an input.
    capture: Option<Capture>,
    /// A capture ended in this frame: its key must not press anything on the page.
    just_captured: Option<InstrumentAction>,
}

impl SettingsPage {
    /// Whether a binding waits for an input, or has just got one.
    pub fn awaits_input(&self) -> bool {
        self.capture.is_some() || self.just_captured.is_some()
    }
}

/// A binding that waits for an input.
#[derive(Debug)]
struct Capture {
    action: InstrumentAction,
    instead: Option<BoundInput>,
    input: InputCapture,
}

impl Capture {
    fn new(action: InstrumentAction, instead: Option<BoundInput>) -> Self {
        Capture {
            action,
            instead,
            input: InputCapture::new(action.movement().is_some()),
        }
    }
}

/// What is kept, and what is to be told about it.
#[derive(Resource, Debug, Default)]
pub struct KeptSettings {
    /// Which hand holds the mouse.
    pub hand: Handedness,
    /// How loud the game is.
    pub sound: SoundSettings,
    /// Whether every exercise is open, whatever was earned before it.
    pub all_open: bool,
    /// Whether the panel shows how fast the simulation is, and its error; that it is slower than real time, it always says.
    pub shows_speed: bool,
    /// What went wrong with the file, until the player has read it.
    pub trouble: Option<String>,
    file: Option<SettingsFile>,
    saved: Settings,
}

/// The page, the keys that open it, and the file, if there is one.
pub struct SettingsPlugin {
    /// Where settings are kept; none where the user has no folder for them.
    pub file: Option<SettingsFile>,
}

impl Plugin for SettingsPlugin {
    fn build(&self, app: &mut App) {
        let (kept, bindings) = KeptSettings::load(self.file.clone());
        app.insert_resource(bindings)
            .insert_resource(kept)
            .init_resource::<SettingsPage>()
            .init_resource::<sound::SoundOutput>()
            .add_systems(Update, (capture, save).chain())
            .add_systems(EguiPrimaryContextPass, (page::show, page::tell_trouble));
    }
}

impl KeptSettings {
    fn load(file: Option<SettingsFile>) -> (Self, InstrumentBindings) {
        let Loaded {
            settings,
            trouble,
            set_aside,
        } = file.as_ref().map(SettingsFile::load).unwrap_or_default();
        let told = trouble.as_ref().map(|trouble| match &set_aside {
            Some(kept) => format!("{trouble}\nThe file was kept as {}. Defaults are used.", kept.display()),
            None => format!("{trouble}\nThe file is left as it is. Defaults are used, and changes are not kept."),
        });
        let may_write = trouble.is_none() || set_aside.is_some();
        let bindings = settings.bindings();
        let kept = KeptSettings {
            hand: settings.hand,
            sound: settings.sound,
            all_open: settings.all_open,
            shows_speed: settings.shows_speed,
            trouble: told,
            file: file.filter(|_| may_write),
            saved: Settings {
                sound: settings.sound,
                all_open: settings.all_open,
                shows_speed: settings.shows_speed,
                ..Settings::of(settings.hand, &bindings)
            },
        };
        (kept, bindings)
    }
}

/// Whether the page is closed: a condition for what listens to keys.
pub fn is_closed(page: Res<SettingsPage>) -> bool {
    !page.open
}

/// Opens and closes the page by key, and lets a gamepad begin, pause and change the views. Runs after the game has read its
/// keys, so that the key that closes the page does nothing else.
pub(super) fn keys(
    keys: Res<ButtonInput<KeyCode>>,
    pads: Query<&Gamepad>,
    state: Res<RunState>,
    mut page: ResMut<SettingsPage>,
    mut flow: ResMut<GameFlow>,
) {
    let pad = |button| pads.iter().any(|pad| pad.just_pressed(button));
    if page.awaits_input() {
        return;
    }
    if page.open {
        if keys.any_just_pressed([KEY, KeyCode::Escape]) || pad(GamepadButton::East) || pad(GamepadButton::Start) {
            page.open = false;
        }
        return;
    }
    if keys.just_pressed(KEY) {
        page.open = true;
        if flow.phase == Phase::Playing {
            flow.wish(Wish::Pause);
        }
    }
    if pad(GamepadButton::Start) {
        match flow.phase {
            Phase::Playing => flow.wish(Wish::Pause),
            Phase::Briefing | Phase::Paused => flow.wish(Wish::Play),
            Phase::Result => {
                if let RunState::Ended(reason) = *state {
                    flow.wish(debrief::after(reason));
                }
            }
            Phase::Title | Phase::Choosing | Phase::Progress | Phase::Outlines | Phase::Preparing => {}
        }
    }
    if pad(GamepadButton::Select) {
        flow.wish(Wish::NextLayout);
    }
}

/// Takes the input that a binding waits for.
fn capture(
    devices: DeviceParams,
    keys: Res<ButtonInput<KeyCode>>,
    mut page: ResMut<SettingsPage>,
    mut bindings: ResMut<InstrumentBindings>,
) {
    if page.just_captured.is_some() {
        page.just_captured = None;
    }
    if !page.open {
        if page.capture.is_some() {
            page.capture = None;
        }
        return;
    }
    let Some(waiting) = &mut page.capture else { return };
    let (action, instead) = (waiting.action, waiting.instead);
    let is_over = if keys.just_pressed(KeyCode::Escape) {
        true
    } else if keys.just_pressed(KeyCode::Backspace) {
        if let Some(old) = instead {
            bindings.unbind(action, old);
        }
        true
    } else if let Some(input) = waiting.input.add_frame(&devices.devices()) {
        bindings.bind(action, input, instead);
        true
    } else {
        false
    };
    if is_over {
        page.capture = None;
        page.just_captured = Some(action);
    }
}

/// Keeps what was changed, once the mouse lets go.
fn save(
    bindings: Res<InstrumentBindings>,
    buttons: Option<Res<ButtonInput<MouseButton>>>,
    mut kept: ResMut<KeptSettings>,
) {
    if buttons.is_some_and(|buttons| buttons.any_pressed([MouseButton::Left])) {
        return;
    }
    let KeptSettings {
        saved,
        hand,
        sound,
        all_open,
        shows_speed,
        ..
    } = &*kept;
    let is_kept = saved.hand == *hand
        && saved.sound == *sound
        && saved.all_open == *all_open
        && saved.shows_speed == *shows_speed
        && saved.feel == bindings.feel
        && (bindings.rows.iter()).all(|row| saved.bindings.get(&row.action) == Some(&row.inputs));
    let Some(file) = kept.file.clone().filter(|_| !is_kept) else {
        return;
    };
    let settings = Settings {
        sound: kept.sound,
        all_open: kept.all_open,
        shows_speed: kept.shows_speed,
        ..Settings::of(kept.hand, &bindings)
    };
    if let Err(error) = file.save(&settings) {
        kept.trouble = Some(error.to_string());
    }
    // A file that cannot be written is told once, not in every frame.
    kept.saved = settings;
}

/// What else an input does: other actions of the instrument, or something of the game.
fn conflicts(bindings: &InstrumentBindings, action: InstrumentAction, input: BoundInput) -> Vec<String> {
    let others = bindings.uses(input).filter(|&other| other != action);
    let game = RESERVED.iter().filter(|(reserved, _)| *reserved == input);
    others
        .map(|other| other.label().to_owned())
        .chain(game.map(|(_, what)| format!("the game's {what}")))
        .collect()
}

/// Every input that does more than one thing, with what it does.
fn twice(bindings: &InstrumentBindings) -> Vec<String> {
    let mut seen = Vec::new();
    let mut found = Vec::new();
    for row in &bindings.rows {
        for &input in &row.inputs {
            let others = conflicts(bindings, row.action, input);
            if !others.is_empty() && !seen.contains(&input) {
                seen.push(input);
                found.push(format!("{input}: {} and {}", row.action.label(), others.join(" and ")));
            }
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use bevy::input::{
        ButtonState, InputPlugin,
        keyboard::{Key, KeyboardInput},
    };

    use super::*;

    #[test]
    fn no_input_does_two_things_at_first() {
        for hand in [Handedness::Right, Handedness::Left] {
            let bindings = InstrumentBindings::of_hand(hand);
            for row in &bindings.rows {
                for &input in &row.inputs {
                    let found = conflicts(&bindings, row.action, input);
                    assert!(found.is_empty(), "{hand:?}: {input} also does {found:?}");
                }
            }
        }
    }

    #[test]
    fn conflicts_name_the_other_action_and_the_game() {
        let mut bindings = InstrumentBindings::default();
        bindings.bind(InstrumentAction::Cut, BoundInput::Key(KeyCode::Space), None);
        bindings.bind(InstrumentAction::Cut, BoundInput::Key(KeyCode::Tab), None);
        let of = |input| conflicts(&bindings, InstrumentAction::Cut, BoundInput::Key(input));
        assert_eq!(of(KeyCode::Space), ["Loop out"]);
        assert_eq!(of(KeyCode::Tab), ["the game's change the views"]);
        assert!(of(KeyCode::KeyF).is_empty());
        assert_eq!(
            twice(&bindings),
            [
                "Space: Loop out and Cutting pedal",
                "Tab: Cutting pedal and the game's change the views"
            ]
        );
    }

    /// An app with the page's systems but for what draws.
    fn app(file: &SettingsFile) -> App {
        let mut app = App::new();
        let (kept, bindings) = KeptSettings::load(Some(file.clone()));
        app.add_plugins((MinimalPlugins, InputPlugin))
            .insert_resource(bindings)
            .insert_resource(kept)
            .init_resource::<SettingsPage>()
            .init_resource::<RunState>()
            .init_resource::<GameFlow>()
            .add_systems(Update, (keys, capture, save).chain());
        app.update();
        app
    }

    fn press(app: &mut App, key_code: KeyCode) {
        for state in [ButtonState::Pressed, ButtonState::Released] {
            app.world_mut().write_message(KeyboardInput {
                key_code,
                logical_key: Key::F35,
                state,
                text: None,
                repeat: false,
                window: Entity::PLACEHOLDER,
            });
            app.update();
        }
    }

    fn wait_for(app: &mut App, action: InstrumentAction, instead: Option<BoundInput>) {
        app.world_mut().resource_mut::<SettingsPage>().capture = Some(Capture::new(action, instead));
    }

    #[test]
    fn what_is_rebound_on_the_page_is_kept_for_the_next_game() {
        let folder = tempfile::tempdir().unwrap();
        let file = SettingsFile::in_folder(folder.path());
        let mut first = app(&file);
        assert!(!file.path().exists(), "nothing was changed yet");
        press(&mut first, KEY);
        assert!(first.world().resource::<SettingsPage>().open);
        let old = BoundInput::Key(KeyCode::KeyF);
        wait_for(&mut first, InstrumentAction::Cut, Some(old));
        press(&mut first, KeyCode::KeyX);
        wait_for(&mut first, InstrumentAction::Cut, None);
        press(&mut first, KeyCode::Escape);
        assert!(
            first.world().resource::<SettingsPage>().open,
            "that ended the waiting alone"
        );
        press(&mut first, KeyCode::Escape);
        assert!(!first.world().resource::<SettingsPage>().open);
        first.world_mut().resource_mut::<KeptSettings>().shows_speed = true;
        first.update();

        let second = app(&file);
        let bindings = second.world().resource::<InstrumentBindings>();
        assert_eq!(bindings.uses(old).count(), 0);
        let uses: Vec<_> = bindings.uses(BoundInput::Key(KeyCode::KeyX)).collect();
        assert_eq!(uses, [InstrumentAction::Cut]);
        let kept = second.world().resource::<KeptSettings>();
        assert_eq!((kept.shows_speed, kept.all_open), (true, false));
        assert_eq!(kept.trouble, None);
    }

    #[test]
    fn a_broken_file_is_told_and_does_not_stop_the_next_change_from_being_kept() {
        let folder = tempfile::tempdir().unwrap();
        let file = SettingsFile::in_folder(folder.path());
        std::fs::write(file.path(), "no settings").unwrap();
        let mut app = app(&file);
        let told = app.world().resource::<KeptSettings>().trouble.clone().expect("told");
        assert!(
            told.contains("settings.ron:1:") && told.contains("settings.broken.ron"),
            "{told}"
        );
        assert_eq!(
            *app.world().resource::<InstrumentBindings>(),
            InstrumentBindings::default()
        );
        app.world_mut().resource_mut::<InstrumentBindings>().feel.mouse = 2.0;
        app.update();
        assert_eq!(file.load().settings.feel.mouse, 2.0);
    }

    #[test]
    fn the_key_pauses_a_game_in_play() {
        let folder = tempfile::tempdir().unwrap();
        let mut app = app(&SettingsFile::in_folder(folder.path()));
        app.world_mut().resource_mut::<GameFlow>().phase = Phase::Playing;
        press(&mut app, KEY);
        assert!(app.world().resource::<SettingsPage>().open);
        assert!(app.world().resource::<GameFlow>().is_asked(Wish::Pause));
    }
}
