//! The order in which exercises are best taken: levels of exercises, the file `curriculum.ron` among the assets or in a mod.

use std::path::Path;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::{
    errors::{ExerciseError, RuleError},
    library::{Library, MAX_FILE_BYTES, read_text},
    mods::Mod,
    pars::Medal,
};

/// File of a curriculum.
pub(crate) const FILE: &str = "curriculum.ron";

/// Levels of exercises, the first to be taken first.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Curriculum {
    /// The levels, in order.
    pub levels: Vec<Level>,
}

/// Exercises of about one difficulty.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Level {
    /// Name shown to the player.
    pub title: String,
    /// Names of exercises of the library or the mod, the first to be taken first.
    pub exercises: Vec<String>,
    /// What opens the level to a trainee; without it the level is open to everybody.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub needs: Option<Needs>,
}

/// What a trainee earns in the level before to open a level.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Needs {
    /// The least medal that counts.
    pub medal: Medal,
    /// In how many exercises of the level before, 1 or more.
    pub exercises: u32,
}

impl Curriculum {
    /// The level of an exercise and its place in it, from 0; none for one that is in none.
    pub fn place(&self, exercise: &str) -> Option<(usize, usize)> {
        let in_level = |level: &Level| level.exercises.iter().position(|name| name == exercise);
        let mut levels = self.levels.iter().enumerate();
        levels.find_map(|(number, level)| Some((number, in_level(level)?)))
    }

    /// Checks that a level has a name, and that each of its exercises is there and in no level before.
    fn check(&self, names: &[String]) -> Result<(), RuleError> {
        for (number, level) in self.levels.iter().enumerate() {
            if level.title.trim().is_empty() {
                return Err(RuleError::new(format!("levels[{number}].title"), "empty", "some text"));
            }
            for (at, name) in level.exercises.iter().enumerate() {
                let field = format!("levels[{number}].exercises[{at}]");
                if !names.contains(name) {
                    let names = names.iter().map(String::as_str);
                    return Err(RuleError::unknown_name(field, name, "an exercise that is there", names));
                }
                if self.place(name) != Some((number, at)) {
                    let expected = "an exercise that is not named before";
                    return Err(RuleError::new(field, format_args!("\"{name}\""), expected));
                }
            }
            let Some(needs) = level.needs else { continue };
            let Some(before) = number.checked_sub(1).map(|before| &self.levels[before]) else {
                let expected = "none: no level comes before the first";
                return Err(RuleError::new(format!("levels[{number}].needs"), "given", expected));
            };
            let most = before.exercises.len();
            if !(1..=most).contains(&(needs.exercises as usize)) {
                let field = format!("levels[{number}].needs.exercises");
                let expected = match most {
                    0 => "a level before that has exercises".to_owned(),
                    _ => format!("1 to {most}, as many as the level before has"),
                };
                return Err(RuleError::new(field, needs.exercises, expected));
            }
        }
        Ok(())
    }
}

impl Library {
    /// The curriculum of the shipped exercises; without levels where the assets have none.
    ///
    /// # Errors
    /// [`ExerciseError`] names the file and the place in it.
    pub fn curriculum(&self) -> Result<Curriculum, ExerciseError> {
        read_curriculum(self.assets(), &self.exercise_names())
    }
}

impl Mod {
    /// Its curriculum, which names its own exercises alone; without levels where it has none.
    ///
    /// # Errors
    /// [`ExerciseError`] names the file and the place in it.
    pub fn curriculum(&self) -> Result<Curriculum, ExerciseError> {
        read_curriculum(self.folder(), &self.exercises)
    }
}

/// The curriculum in a folder, which may name these exercises.
fn read_curriculum(folder: &Path, exercises: &[String]) -> Result<Curriculum, ExerciseError> {
    let file = folder.join(FILE);
    if !file.exists() {
        return Ok(Curriculum::default());
    }
    let text = read_text(&file, MAX_FILE_BYTES).map_err(|source| ExerciseError::Read {
        file: file.clone(),
        source,
    })?;
    let read = resecta_text::read(&text);
    let curriculum: Curriculum = read.map_err(|slip| ExerciseError::of_slip(&file, slip))?;
    let checked = curriculum.check(exercises);
    checked.map_err(|rule| {
        let rule = rule.into();
        ExerciseError::Rule { file, rule }.placed(&text)
    })?;
    Ok(curriculum)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(levels: &[(&str, &[&str])]) -> Curriculum {
        let level = |(title, exercises): &(&str, &[&str])| Level {
            title: (*title).into(),
            exercises: exercises.iter().map(|&name| name.into()).collect(),
            needs: None,
        };
        Curriculum {
            levels: levels.iter().map(level).collect(),
        }
    }

    #[test]
    fn the_shipped_one_has_every_shipped_exercise_in_it() {
        let library = Library::new("../../assets");
        let curriculum = library.curriculum().unwrap();
        assert_eq!(curriculum.place("tutorial"), Some((0, 0)));
        for name in library.exercise_names() {
            assert!(curriculum.place(&name).is_some(), "{name}");
        }
    }

    #[test]
    fn what_is_unknown_or_named_twice_is_told_with_its_place() {
        let names = ["apex".to_owned(), "lobe".to_owned()];
        let told = |curriculum: Curriculum| curriculum.check(&names).unwrap_err().to_string();
        let unknown = told(of(&[("First", &["apex", "lobes"])]));
        assert_eq!(
            unknown,
            "levels[0].exercises[1] is \"lobes\"; expected an exercise that is there; did you mean `lobe`?"
        );
        let twice = told(of(&[("First", &["apex"]), ("Second", &["lobe", "apex"])]));
        assert_eq!(
            twice,
            "levels[1].exercises[1] is \"apex\"; expected an exercise that is not named before"
        );
        assert!(told(of(&[(" ", &[])])).starts_with("levels[0].title"));
        let with_needs = |level: usize, exercises| {
            let mut curriculum = of(&[("First", &["apex"]), ("Second", &["lobe"])]);
            let medal = Medal::Bronze;
            curriculum.levels[level].needs = Some(Needs { medal, exercises });
            curriculum
        };
        assert_eq!(
            told(with_needs(0, 1)),
            "levels[0].needs is given; expected none: no level comes before the first"
        );
        for exercises in [0, 2] {
            assert_eq!(
                told(with_needs(1, exercises)),
                format!("levels[1].needs.exercises is {exercises}; expected 1 to 1, as many as the level before has")
            );
        }
        let mut after_nothing = with_needs(1, 1);
        after_nothing.levels[0].exercises.clear();
        assert_eq!(
            told(after_nothing),
            "levels[1].needs.exercises is 1; expected a level before that has exercises"
        );
        assert!(with_needs(1, 1).check(&names).is_ok());
        assert!(of(&[("First", &["apex"]), ("Second", &["lobe"])]).check(&names).is_ok());
    }

    #[test]
    fn a_library_without_one_has_no_levels() {
        let folder = tempfile::tempdir().unwrap();
        let curriculum = Library::new(folder.path()).curriculum().unwrap();
        assert_eq!(curriculum, Curriculum::default());
        assert_eq!(curriculum.place("apex"), None);
        let file = folder.path().join(FILE);
        std::fs::write(&file, "(levels: [(title: \"First\", exercises: [\"apex\"])])").unwrap();
        let told = Library::new(folder.path()).curriculum().unwrap_err().to_string();
        assert!(told.contains("curriculum.ron:1:"), "{told}");
        std::fs::write(&file, "(levels: [(titel: \"First\")])").unwrap();
        let told = Library::new(folder.path()).curriculum().unwrap_err().to_string();
        assert!(told.contains("did you mean `title`?"), "{told}");
    }
}
