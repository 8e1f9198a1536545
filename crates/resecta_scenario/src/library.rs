//! Where exercises and cases are found: shipped ones by name among the assets, one's own by path.

use std::{
    fs,
    io::{self, Read},
    path::{Path, PathBuf},
};

use resecta_anatomy::Case;

use crate::{
    errors::{ExerciseError, RuleError, nearest},
    exercise::Exercise,
    extension::{ExtensionError, Extensions},
};

/// End of an exercise file's name.
pub const EXERCISE_SUFFIX: &str = ".exercise.ron";
/// End of a case file's name.
pub const CASE_SUFFIX: &str = ".case.ron";
/// Largest exercise file that is read, bytes: some hundred times the longest that anyone writes.
pub const MAX_FILE_BYTES: u64 = 1 << 20;

/// The folder of shipped assets, with `exercises/` and `cases/` in it, and the exercises of extensions.
#[derive(Debug, Clone)]
pub struct Library {
    assets: PathBuf,
    extensions: Extensions,
}

/// An exercise that keeps every rule, and its case.
#[derive(Debug, Clone, PartialEq)]
pub struct LoadedExercise {
    /// Name: the file's name without `.exercise.ron`.
    pub name: String,
    /// The file it came from.
    pub file: PathBuf,
    /// What the file says.
    pub exercise: Exercise,
    /// Its case, complete.
    pub case: Case,
}

impl Library {
    /// The library in this folder.
    pub fn new(assets: impl Into<PathBuf>) -> Self {
        Self {
            assets: assets.into(),
            extensions: Extensions::default(),
        }
    }

    /// The same with the exercises of extensions, and files that name their metrics and goals. An app has its own as the
    /// resource [`Extensions`].
    pub fn with_extensions(self, extensions: Extensions) -> Self {
        Self { extensions, ..self }
    }

    /// The exercises of extensions that are not found, for a shipped file has their name.
    pub(crate) fn shadowed(&self) -> impl Iterator<Item = ExtensionError> {
        let shipped = names_in(&self.assets.join("exercises"), EXERCISE_SUFFIX);
        let names = self.extensions.exercise_names();
        names.filter_map(move |name| {
            let is_shipped = shipped.iter().any(|file| file == name);
            is_shipped.then_some(ExtensionError::Shipped { name })
        })
    }

    /// The names of the exercises that are shipped or an extension's, sorted.
    pub fn exercise_names(&self) -> Vec<String> {
        let mut names = names_in(&self.assets.join("exercises"), EXERCISE_SUFFIX);
        names.extend(self.extensions.exercise_names().map(str::to_owned));
        names.sort();
        names.dedup();
        names
    }

    /// The names of the shipped cases, sorted.
    pub fn case_names(&self) -> Vec<String> {
        names_in(&self.assets.join("cases"), CASE_SUFFIX)
    }

    /// Loads an exercise by the name of a shipped one or an extension's, or the path of a file, and its case with it.
    ///
    /// # Errors
    /// [`ExerciseError`] names the file and the place in it.
    pub fn load(&self, name_or_path: &str) -> Result<LoadedExercise, ExerciseError> {
        let by_path = is_path(name_or_path, EXERCISE_SUFFIX);
        let file = if by_path {
            PathBuf::from(name_or_path)
        } else {
            self.assets
                .join("exercises")
                .join(format!("{name_or_path}{EXERCISE_SUFFIX}"))
        };
        if !file.is_file() {
            if !by_path && let Some(exercise) = self.extensions.exercise(name_or_path) {
                return self.load_value(name_or_path, exercise);
            }
            let names = self.exercise_names();
            let nearest = nearest(name_or_path, names.iter().map(String::as_str)).filter(|_| !by_path);
            return Err(ExerciseError::Missing { file, nearest });
        }
        let text = read_text(&file).map_err(|source| ExerciseError::Read {
            file: file.clone(),
            source,
        })?;
        self.load_text(&text, &file)
    }

    /// Loads an exercise from its text as if it stood in `file`, and its case with it.
    ///
    /// # Errors
    /// [`ExerciseError`] names the file and the place in it.
    pub fn load_text(&self, text: &str, file: &Path) -> Result<LoadedExercise, ExerciseError> {
        let exercise = Exercise::from_ron_with(text, file, &self.extensions)?;
        self.with_case(exercise, file)
    }

    /// Checks an exercise that was made in Rust as if it were a file of that name, and loads its case with it. A path of a case is
    /// relative to the working directory.
    ///
    /// # Errors
    /// [`ExerciseError`] names the exercise and the field.
    pub fn load_value(&self, name: &str, exercise: Exercise) -> Result<LoadedExercise, ExerciseError> {
        let file = PathBuf::from(format!("{name}{EXERCISE_SUFFIX}"));
        let checked = exercise.validate().and_then(|()| self.extensions.check(&exercise));
        match checked {
            Ok(()) => self.with_case(exercise, &file),
            Err(rule) => Err(ExerciseError::Rule { file, rule }),
        }
    }

    fn with_case(&self, exercise: Exercise, file: &Path) -> Result<LoadedExercise, ExerciseError> {
        let case_file = self.case_file(&exercise.case, file)?;
        let case = Case::load(&case_file).map_err(|source| ExerciseError::Case {
            file: file.into(),
            source,
        })?;
        let file_name = file
            .file_name()
            .map(|name| name.to_string_lossy().into_owned())
            .unwrap_or_default();
        Ok(LoadedExercise {
            name: file_name.strip_suffix(EXERCISE_SUFFIX).unwrap_or(&file_name).to_owned(),
            file: file.into(),
            exercise,
            case,
        })
    }

    fn case_file(&self, case: &str, exercise_file: &Path) -> Result<PathBuf, ExerciseError> {
        let missing = |rule| ExerciseError::Rule {
            file: exercise_file.into(),
            rule,
        };
        if is_path(case, CASE_SUFFIX) {
            let path = exercise_file.parent().unwrap_or(Path::new("")).join(case);
            return if path.is_file() {
                Ok(path)
            } else {
                let expected = format!("a case file, but there is none at {}", path.display());
                Err(missing(RuleError::new("case", format_args!("\"{case}\""), expected)))
            };
        }
        let path = self.assets.join("cases").join(format!("{case}{CASE_SUFFIX}"));
        if path.is_file() {
            return Ok(path);
        }
        let names = self.case_names();
        let expected = format!(
            "the path of a {CASE_SUFFIX} file or a shipped case ({})",
            names.join(", ")
        );
        Err(missing(RuleError::unknown_name(
            "case",
            case,
            expected,
            names.iter().map(String::as_str),
        )))
    }
}

/// Whether a reference is meant as a path rather than a name.
fn is_path(reference: &str, suffix: &str) -> bool {
    reference.ends_with(suffix) || reference.contains(['/', '\\'])
}

fn names_in(folder: &Path, suffix: &str) -> Vec<String> {
    let Ok(entries) = fs::read_dir(folder) else {
        return Vec::new();
    };
    let file_names = entries
        .flatten()
        .map(|entry| entry.file_name().to_string_lossy().into_owned());
    let mut names: Vec<String> = file_names
        .filter_map(|name| Some(name.strip_suffix(suffix)?.to_owned()))
        .collect();
    names.sort();
    names
}

fn read_text(file: &Path) -> io::Result<String> {
    let mut text = String::new();
    fs::File::open(file)?
        .take(MAX_FILE_BYTES + 1)
        .read_to_string(&mut text)?;
    if text.len() as u64 > MAX_FILE_BYTES {
        return Err(io::Error::other(format!(
            "larger than {MAX_FILE_BYTES} bytes, the most that is read"
        )));
    }
    Ok(text)
}
