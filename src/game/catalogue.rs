//! The exercises that can be chosen, each with its sketch, read when they are first looked at.

use std::path::PathBuf;

use bevy::prelude::*;
use resecta_scenario::{Curriculum, ExerciseError, Library, LoadedExercise, Mod, Mods};

use super::{sketch::Sketch, unlock::Opens};

/// Where exercises come from, to read them from anew.
#[derive(Resource, Debug, Clone)]
pub struct Sources {
    /// What ships, and extensions.
    pub library: Library,
    /// The folder of the player's mods, if they have one.
    pub mods: Option<PathBuf>,
    /// The exercise that the game was opened with: a name or a path.
    pub own: Option<String>,
}

impl Sources {
    /// The library with the mods as they are now.
    pub fn library(&self) -> Library {
        let mods = self.mods.as_ref().map(|folder| Mods::find(folder));
        self.library.clone().with_mods(mods.unwrap_or_default())
    }

    /// Reads all of it. What has a fault is left out and told.
    pub fn read(&self) -> Catalogue {
        Catalogue::of(&self.library(), self.own.as_deref())
    }
}

/// The shipped exercises, those of mods, and one's own that the game was opened with.
#[derive(Resource, Debug, Default)]
pub struct Catalogue {
    /// In the order of the curriculum; those that it does not name last, by name; then mods, each in its own order.
    pub entries: Vec<Entry>,
    /// What could not be read.
    pub refused: Vec<Refused>,
    /// The one that is looked at.
    pub selected: usize,
}

/// One exercise.
#[derive(Debug)]
pub struct Entry {
    /// What its file says, or said when it was last without a fault.
    pub loaded: LoadedExercise,
    /// Title of its level, or of its mod; none for one that the curriculum does not name.
    pub level: Option<String>,
    /// Title and version of its mod.
    pub of_mod: Option<String>,
    /// What opens it; none if it is open to everybody.
    pub opens: Option<Opens>,
    /// What is wrong with its file by now.
    pub fault: Option<String>,
    sketch: Option<Sketch>,
}

/// Something that could not be read.
#[derive(Debug, Clone, PartialEq)]
pub struct Refused {
    /// What it is.
    pub what: What,
    /// What is wrong with it, with file and place.
    pub told: String,
}

/// What could not be read.
#[derive(Debug, Clone, PartialEq)]
pub enum What {
    /// The exercise of this name.
    Exercise(String),
    /// The mod of this id.
    Mod(String),
    /// A curriculum.
    Curriculum,
}

impl What {
    /// Whether an exercise is lost with it.
    fn holds(&self, exercise: &str) -> bool {
        match self {
            Self::Exercise(name) => name == exercise,
            Self::Mod(id) => exercise
                .strip_prefix(id.as_str())
                .is_some_and(|rest| rest.starts_with('/')),
            Self::Curriculum => false,
        }
    }
}

impl Catalogue {
    /// Reads all exercises of a library, and one's own. One with a fault is left out and told.
    fn of(library: &Library, own: Option<&str>) -> Self {
        let mut refused = Vec::new();
        let mut loaded: Vec<LoadedExercise> = (library.exercise_names().iter())
            .filter_map(|name| note(&mut refused, name, library.load(name)))
            .collect();
        let curriculum = library.curriculum();
        let curriculum = note_curriculum(&mut refused, curriculum);
        let of_mods: Vec<Entry> = (library.mods().good().iter())
            .flat_map(|found| of_mod(library, found, &mut refused))
            .collect();
        if let Some(own) = own {
            let name = own
                .rsplit(['/', '\\'])
                .next()
                .unwrap_or(own)
                .trim_end_matches(resecta_scenario::EXERCISE_SUFFIX);
            if let Some(own) = note(&mut refused, name, library.load(own)) {
                let is_shipped = loaded
                    .iter()
                    .any(|shipped| shipped.name == own.name && shipped.file == own.file);
                let is_of_mod = of_mods
                    .iter()
                    .any(|entry| entry.loaded.name == own.name && entry.loaded.file == own.file);
                if !is_shipped && !is_of_mod {
                    loaded.push(own);
                }
            }
        }
        // One's own is in no level, whatever it is called.
        let place = |loaded: &LoadedExercise| {
            let place = curriculum.place(&loaded.name);
            place.filter(|_| library.is_shipped(loaded))
        };
        loaded.sort_by_key(|loaded| {
            let place = place(loaded);
            (place.is_none(), place)
        });
        let entries = loaded.into_iter().map(|loaded| Entry {
            level: place(&loaded).map(|(level, _)| curriculum.levels[level].title.clone()),
            opens: place(&loaded).and_then(|(level, _)| Opens::of(&curriculum, level, str::to_owned)),
            loaded,
            of_mod: None,
            fault: None,
            sketch: None,
        });
        let entries = entries.chain(of_mods).collect();
        refused.extend(library.mods().aside().iter().map(|aside| Refused {
            what: What::Mod(aside.id.clone()),
            told: aside.to_string(),
        }));
        Self {
            entries,
            refused,
            selected: 0,
        }
    }

    /// The exercise of this name.
    pub fn get(&self, name: &str) -> Option<&Entry> {
        self.entries.iter().find(|entry| entry.loaded.name == name)
    }

    /// Looks at the exercise of this name.
    pub fn select(&mut self, name: &str) {
        let place = self.entries.iter().position(|entry| entry.loaded.name == name);
        self.selected = place.unwrap_or(self.selected);
    }

    /// The one that follows the one of this name in the curriculum or in its mod.
    pub fn after(&self, name: &str) -> Option<&Entry> {
        let place = self.entries.iter().position(|entry| entry.loaded.name == name)?;
        let (present, next) = (self.entries.get(place)?, self.entries.get(place + 1)?);
        (next.level.is_some() && next.of_mod == present.of_mod).then_some(next)
    }

    /// Looks at the one that follows the one of this name; at that one itself where none does.
    pub fn select_after(&mut self, name: &str) {
        let next = self.after(name).map(|next| next.loaded.name.clone());
        self.select(next.as_deref().unwrap_or(name));
    }

    /// Puts what was read anew in the place of what was there: what has a fault now stays as it was when it had none.
    /// Returns the names of exercises that say something else than before, are new or gone.
    pub fn renew(&mut self, read: Catalogue) -> Vec<String> {
        let before = std::mem::replace(self, read);
        let selected = before
            .entries
            .get(before.selected)
            .map(|entry| entry.loaded.name.clone());
        let order: Vec<String> = before.entries.iter().map(|entry| entry.loaded.name.clone()).collect();
        let place = |name: &str| order.iter().position(|other| other == name).unwrap_or(usize::MAX);
        let keeps_order = self.refused.iter().any(|refused| refused.what == What::Curriculum);
        let mut changed = Vec::new();
        for (index, old) in before.entries.into_iter().enumerate() {
            let name = &old.loaded.name;
            if let Some(new) = self.entries.iter_mut().find(|entry| entry.loaded.name == *name) {
                if keeps_order {
                    (new.level, new.opens) = (old.level, old.opens);
                }
                if new.loaded == old.loaded {
                    new.sketch = old.sketch;
                } else {
                    changed.push(name.clone());
                }
            } else if let Some(refused) = self.refused.iter().find(|refused| refused.what.holds(name)) {
                let fault = Some(refused.told.clone());
                let behind = self.entries.iter().position(|entry| place(&entry.loaded.name) > index);
                let at = behind.unwrap_or(self.entries.len());
                self.entries.insert(at, Entry { fault, ..old });
            } else {
                changed.push(name.clone());
            }
        }
        let new = self.entries.iter().map(|entry| &entry.loaded.name);
        changed.extend(new.filter(|name| !order.contains(name)).cloned());
        if keeps_order {
            self.entries.sort_by_key(|entry| place(&entry.loaded.name));
        }
        self.selected = self.selected.min(self.entries.len().saturating_sub(1));
        if let Some(selected) = selected {
            self.select(&selected);
        }
        changed
    }
}

/// What was read; what is wrong with it goes to `refused`.
fn note(refused: &mut Vec<Refused>, name: &str, read: Result<LoadedExercise, ExerciseError>) -> Option<LoadedExercise> {
    let what = || What::Exercise(name.into());
    read.map_err(|error| {
        let told = error.to_string();
        // One's own may be a mod's, too.
        if refused.iter().all(|other| other.told != told) {
            refused.push(Refused { what: what(), told });
        }
    })
    .ok()
}

fn note_curriculum(refused: &mut Vec<Refused>, read: Result<Curriculum, ExerciseError>) -> Curriculum {
    read.unwrap_or_else(|error| {
        refused.push(Refused {
            what: What::Curriculum,
            told: error.to_string(),
        });
        Curriculum::default()
    })
}

/// The exercises of a mod in its own order; what is wrong with them goes to `refused`.
fn of_mod(library: &Library, found: &Mod, refused: &mut Vec<Refused>) -> Vec<Entry> {
    let manifest = &found.manifest;
    let curriculum = note_curriculum(refused, found.curriculum());
    let mut names: Vec<&String> = found.exercises.iter().collect();
    names.sort_by_key(|name| {
        let place = curriculum.place(name);
        (place.is_none(), place)
    });
    let entry = |name: &String| {
        let full_name = |name: &str| format!("{}/{name}", manifest.id);
        let full = full_name(name);
        let number = curriculum.place(name).map(|(level, _)| level);
        let level = number.map(|number| &curriculum.levels[number].title);
        Some(Entry {
            loaded: note(refused, &full, library.load(&full))?,
            level: Some(match level {
                Some(level) => format!("{}: {level}", manifest.title),
                None => manifest.title.clone(),
            }),
            opens: number.and_then(|number| Opens::of(&curriculum, number, full_name)),
            of_mod: Some(format!("{} {}", manifest.title, manifest.version)),
            fault: None,
            sketch: None,
        })
    };
    names.into_iter().filter_map(entry).collect()
}

impl Entry {
    /// The sketch of its case, made at first sight.
    pub fn sketch(&mut self) -> &Sketch {
        self.sketch.get_or_insert_with(|| Sketch::of(&self.loaded))
    }
}
