//! Mods: folders with a manifest, exercises and cases of others, found in the player's mods folder.
//!
//! ```text
//! my_mod/
//!   mod.ron                          id, title, version, what it needs: the manifest
//!   exercises/NAME.exercise.ron      addressed as my_mod/NAME
//!   cases/NAME.case.ron              addressed as NAME in the mod, as my_mod/NAME in mods that need it
//!   scripts/NAME.ron                 the way of an instrument, to show exercises or test them with
//!   curriculum.ron                   the order of its exercises, if it has levels
//! ```
//!
//! A mod with a fault of its own, in its manifest or its folder, or among the mods that it needs is put aside and told; one bad
//! exercise is left out alone. All else plays.
//!
//! | to find | look in |
//! |---|---|
//! | what a manifest says, and its rules | `manifest.rs` |
//! | what a mod may read, and how much | `fence.rs` |
//! | needs, conflicts, cycles between mods | `relations.rs` |

mod fence;
mod manifest;
mod relations;

use std::{
    collections::BTreeMap,
    fmt, fs, io,
    path::{Path, PathBuf},
    sync::{Arc, Mutex, PoisonError},
};

use resecta_anatomy::{Case, CaseError};
use resecta_text::nearest;
use thiserror::Error;

pub use fence::{FenceFault, MAX_MOD_BYTES, MAX_MOD_DEPTH, MAX_MOD_ENTRIES, MAX_MOD_EXERCISES, MAX_MOD_FILE_BYTES};
pub use manifest::{MANIFEST, MAX_MANIFEST_BYTES, Manifest};

pub(crate) use fence::Fence;
pub(crate) use manifest::ManifestText;

use crate::{
    errors::ExerciseError,
    library::{CASE_SUFFIX, EXERCISE_SUFFIX, names_in, read_text},
};

/// Mods in a mods folder.
pub const MAX_MODS: usize = 64;
/// Folder of a mod's exercises.
pub(crate) const EXERCISES: &str = "exercises";
/// Folder of a mod's cases.
pub(crate) const CASES: &str = "cases";
/// Folder of a mod's scripts, and of those that ship.
pub(crate) const SCRIPTS: &str = "scripts";

/// What is wrong with a mod as a whole.
#[derive(Debug, Error)]
pub enum ModError {
    /// Its manifest, by itself or beside those of other mods.
    #[error(transparent)]
    Manifest(#[from] ExerciseError),
    /// Its folder, or something in it.
    #[error("{}: {fault}", path.display())]
    Folder {
        /// Folder or file.
        path: PathBuf,
        /// What is wrong with it.
        fault: FenceFault,
    },
    /// The folder with all mods.
    #[error("{}: more than {MAX_MODS} mods, the most that are read: this one is not", folder.display())]
    TooMany {
        /// The first one too many.
        folder: PathBuf,
    },
}

/// A mod that can be used.
#[derive(Debug)]
pub struct Mod {
    /// What it says of itself.
    pub manifest: Manifest,
    /// Names of its exercises, sorted.
    pub exercises: Vec<String>,
    /// Names of its cases, sorted.
    pub cases: Vec<String>,
    pub(crate) fence: Fence,
    /// Text of the manifest, to find places in.
    text: String,
    /// Cases that were read, by their files: exercises share them.
    read: Mutex<BTreeMap<PathBuf, Arc<Case>>>,
}

/// A mod that cannot be used.
#[derive(Debug)]
pub struct ModAside {
    /// Its id; the name of its folder where that is not known.
    pub id: String,
    /// Its folder.
    pub folder: PathBuf,
    /// Why; at least one.
    pub faults: Vec<Arc<ModError>>,
}

impl fmt::Display for ModAside {
    /// One line for each fault.
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(formatter, "mod `{}` is put aside", self.id)?;
        self.faults.iter().try_for_each(|fault| write!(formatter, "\n{fault}"))
    }
}

/// The mods of a folder.
#[derive(Debug, Default)]
pub struct Mods {
    good: Vec<Mod>,
    aside: Vec<ModAside>,
}

impl Mods {
    /// Finds and reads the mods in a folder; none where there is no folder. Hidden folders and files are passed over.
    pub fn find(folder: &Path) -> Self {
        let mut folders = match folders_in(folder) {
            Ok(folders) => folders,
            Err(error) if error.kind() == io::ErrorKind::NotFound => return Self::default(),
            Err(error) => {
                let fault = ModError::Folder {
                    path: folder.into(),
                    fault: error.into(),
                };
                return Self {
                    good: Vec::new(),
                    aside: vec![aside_by_name(folder, vec![fault])],
                };
            }
        };
        let left = folders.split_off(folders.len().min(MAX_MODS));
        let mut mods = Self::of(folders);
        mods.aside.extend(left.into_iter().map(|folder| {
            let fault = ModError::TooMany { folder: folder.clone() };
            aside_by_name(&folder, vec![fault])
        }));
        mods
    }

    /// Reads the mods that these folders are.
    pub fn of(folders: impl IntoIterator<Item = PathBuf>) -> Self {
        let mut mods = Self::default();
        for folder in folders {
            match Mod::read(&folder) {
                Ok(found) => mods.good.push(found),
                Err(faults) => mods.aside.push(aside_by_name(&folder, faults)),
            }
        }
        relations::settle(&mut mods);
        mods.good.sort_by(|a, b| a.manifest.id.cmp(&b.manifest.id));
        mods
    }

    /// These mods and those in the folders named, which stand in for others of their ids.
    pub fn with(&self, folders: impl IntoIterator<Item = PathBuf>) -> Self {
        let folders: Vec<PathBuf> = folders.into_iter().collect();
        let ids: Vec<String> = (folders.iter())
            .filter_map(|folder| Some(Mod::read(folder).ok()?.manifest.id))
            .collect();
        let others = self.good.iter().filter(|other| !ids.contains(&other.manifest.id));
        Self::of(others.map(|other| other.folder().to_owned()).chain(folders))
    }

    /// Those that can be used, sorted by id.
    pub fn good(&self) -> &[Mod] {
        &self.good
    }

    /// Those that cannot, and why.
    pub fn aside(&self) -> &[ModAside] {
        &self.aside
    }

    /// The usable one of this id.
    pub fn get(&self, id: &str) -> Option<&Mod> {
        self.good.iter().find(|found| found.manifest.id == id)
    }

    /// The usable one whose folder a file is in.
    pub(crate) fn around(&self, file: &Path) -> Option<&Mod> {
        self.good.iter().find(|found| found.fence.holds(file))
    }
}

impl Mod {
    /// Reads the manifest of a mod, and lists what is in its folder.
    fn read(folder: &Path) -> Result<Self, Vec<ModError>> {
        let at = |path: PathBuf| move |fault: FenceFault| vec![ModError::Folder { path, fault }];
        let file = folder.join(MANIFEST);
        if !file.exists() {
            let nearest = meant_for_manifest(folder);
            return Err(at(folder.into())(FenceFault::NoManifest { nearest }));
        }
        let fence = Fence::around(folder).map_err(|(path, fault)| at(path)(fault))?;
        let text = read_text(&file, MAX_MANIFEST_BYTES).map_err(|error| at(file.clone())(error.into()))?;
        let manifest = Manifest::examine(&text, &file);
        let manifest = manifest.map_err(|faults| faults.into_iter().map(ModError::from).collect::<Vec<_>>())?;
        let exercises = names_in(&folder.join(EXERCISES), EXERCISE_SUFFIX);
        let found = exercises.len();
        if found > MAX_MOD_EXERCISES {
            return Err(at(folder.join(EXERCISES))(FenceFault::TooManyExercises { found }));
        }
        Ok(Self {
            manifest,
            exercises,
            cases: names_in(&folder.join(CASES), CASE_SUFFIX),
            fence,
            text,
            read: Mutex::default(),
        })
    }

    /// Its folder.
    pub fn folder(&self) -> &Path {
        self.fence.root()
    }

    /// The file of its exercise of this name.
    pub(crate) fn exercise_file(&self, name: &str) -> PathBuf {
        self.folder().join(EXERCISES).join(format!("{name}{EXERCISE_SUFFIX}"))
    }

    /// The file of its case of this name.
    pub(crate) fn case_file(&self, name: &str) -> PathBuf {
        self.folder().join(CASES).join(format!("{name}{CASE_SUFFIX}"))
    }

    /// Reads a case, once for all exercises that have it.
    pub(crate) fn case(&self, file: &Path) -> Result<Arc<Case>, CaseError> {
        // A map of what was read is whole at any moment.
        let known = |read: &Mutex<BTreeMap<PathBuf, Arc<Case>>>| {
            let read = read.lock().unwrap_or_else(PoisonError::into_inner);
            read.get(file).cloned()
        };
        if let Some(case) = known(&self.read) {
            return Ok(case);
        }
        let text = read_text(file, MAX_MOD_FILE_BYTES).map_err(|source| CaseError::Read {
            file: file.into(),
            source,
        })?;
        let case = Arc::new(Case::from_ron(&text, file)?);
        let mut read = self.read.lock().unwrap_or_else(PoisonError::into_inner);
        read.insert(file.into(), case.clone());
        Ok(case)
    }
}

/// A mod of which no id is known.
fn aside_by_name(folder: &Path, faults: Vec<ModError>) -> ModAside {
    let name = folder.file_name().unwrap_or(folder.as_os_str());
    ModAside {
        id: name.to_string_lossy().into_owned(),
        folder: folder.into(),
        faults: faults.into_iter().map(Arc::new).collect(),
    }
}

/// Folders in a folder, sorted by name, hidden ones left out; one more than is read at most.
fn folders_in(folder: &Path) -> io::Result<Vec<PathBuf>> {
    /// Entries that are looked at.
    const MOST: usize = 10_000;
    let mut folders = Vec::new();
    for entry in fs::read_dir(folder)?.take(MOST) {
        let entry = entry?;
        if entry.path().is_dir() && !entry.file_name().to_string_lossy().starts_with('.') {
            folders.push(entry.path());
        }
    }
    folders.sort();
    Ok(folders)
}

/// What of a folder without a manifest may be meant for one: a slip in its name, or a folder with one in this folder.
fn meant_for_manifest(folder: &Path) -> Option<String> {
    /// Names that are looked at.
    const MOST: usize = 100;
    let entries = fs::read_dir(folder).ok()?.take(MOST).flatten();
    let mut names: Vec<String> = (entries.map(|entry| entry.file_name().to_string_lossy().into_owned()))
        .filter(|name| !name.starts_with('.'))
        .collect();
    names.sort();
    let inner = names.iter().find(|name| folder.join(name).join(MANIFEST).is_file());
    match inner {
        Some(inner) => Some(format!("{inner}/{MANIFEST}")),
        None => nearest(
            MANIFEST,
            names
                .iter()
                .filter(|name| name.ends_with(".ron") || name.contains(".ron."))
                .map(String::as_str),
        ),
    }
}
