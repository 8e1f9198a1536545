//! The exercises that can be chosen, each with its sketch, read when they are first looked at.

use bevy::prelude::*;
use resecta_scenario::{Curriculum, ExerciseError, Library, LoadedExercise, Mod};

use super::sketch::Sketch;

/// The shipped exercises, those of mods, and one's own that the game was opened with.
#[derive(Resource, Debug)]
pub struct Catalogue {
    /// In the order of the curriculum; those that it does not name last, by name; then mods, each in its own order.
    pub entries: Vec<Entry>,
    /// Files that could not be read and mods that are put aside, and why.
    pub refused: Vec<String>,
    /// The one that is looked at.
    pub selected: usize,
}

/// One exercise.
#[derive(Debug)]
pub struct Entry {
    /// What its file says.
    pub loaded: LoadedExercise,
    /// Title of its level, or of its mod; none for one that the curriculum does not name.
    pub level: Option<String>,
    /// Title and version of its mod.
    pub of_mod: Option<String>,
    sketch: Option<Sketch>,
}

impl Catalogue {
    /// Reads all exercises of a library. One with a fault is left out and told.
    pub fn of(library: &Library, own: Option<LoadedExercise>) -> Self {
        let mut refused = Vec::new();
        let mut note = |result: Result<LoadedExercise, ExerciseError>| {
            result.map_err(|error| refused.push(error.to_string())).ok()
        };
        let mut loaded: Vec<LoadedExercise> = (library.exercise_names().iter())
            .filter_map(|name| note(library.load(name)))
            .collect();
        if let Some(own) = own
            && !loaded
                .iter()
                .any(|shipped| shipped.name == own.name && shipped.file == own.file)
        {
            loaded.push(own);
        }
        let curriculum = library.curriculum().unwrap_or_else(|error| {
            refused.push(error.to_string());
            Curriculum::default()
        });
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
            loaded,
            of_mod: None,
            sketch: None,
        });
        let mut entries: Vec<Entry> = entries.collect();
        for found in library.mods().good() {
            entries.extend(of_mod(library, found, &mut refused));
        }
        refused.extend(library.mods().aside().iter().map(ToString::to_string));
        Self {
            entries,
            refused,
            selected: 0,
        }
    }

    /// Looks at the exercise of this name.
    pub fn select(&mut self, name: &str) {
        let place = self.entries.iter().position(|entry| entry.loaded.name == name);
        self.selected = place.unwrap_or(self.selected);
    }
}

/// The exercises of a mod in its own order; what is wrong with them goes to `refused`.
fn of_mod(library: &Library, found: &Mod, refused: &mut Vec<String>) -> Vec<Entry> {
    let manifest = &found.manifest;
    let curriculum = found.curriculum().unwrap_or_else(|error| {
        refused.push(error.to_string());
        Curriculum::default()
    });
    let mut names: Vec<&String> = found.exercises.iter().collect();
    names.sort_by_key(|name| {
        let place = curriculum.place(name);
        (place.is_none(), place)
    });
    let entry = |name: &String| {
        let loaded = library.load(&format!("{}/{name}", manifest.id));
        let level = curriculum.place(name).map(|(level, _)| &curriculum.levels[level].title);
        Some(Entry {
            loaded: loaded.map_err(|error| refused.push(error.to_string())).ok()?,
            level: Some(match level {
                Some(level) => format!("{}: {level}", manifest.title),
                None => manifest.title.clone(),
            }),
            of_mod: Some(format!("{} {}", manifest.title, manifest.version)),
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
