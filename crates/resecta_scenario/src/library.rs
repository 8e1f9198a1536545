//! Where exercises and cases are found: shipped ones by name among the assets, those of mods by `mod/name`, one's own by path.

use std::{
    fs,
    io::{self, Read},
    path::{Path, PathBuf},
    sync::Arc,
};

use resecta_anatomy::Case;

use crate::{
    errors::{ExerciseError, RuleError, nearest},
    exercise::Exercise,
    extension::{ExtensionError, Extensions},
    mods::{EXERCISES, MANIFEST, Mod, Mods},
    shown::Demonstration,
};

/// End of an exercise file's name.
pub const EXERCISE_SUFFIX: &str = ".exercise.ron";
/// End of a case file's name.
pub const CASE_SUFFIX: &str = ".case.ron";
/// Largest exercise file that is read, bytes: some hundred times the longest that anyone writes.
pub const MAX_FILE_BYTES: u64 = 1 << 20;

/// The folder of shipped assets, with `exercises/` and `cases/` in it, the exercises of extensions, and mods.
#[derive(Debug, Clone)]
pub struct Library {
    assets: PathBuf,
    extensions: Extensions,
    mods: Arc<Mods>,
}

/// An exercise that keeps every rule, and its case.
#[derive(Debug, Clone, PartialEq)]
pub struct LoadedExercise {
    /// Name: the file's name without `.exercise.ron`; of a mod, `mod/name`.
    pub name: String,
    /// The file it came from.
    pub file: PathBuf,
    /// What the file says.
    pub exercise: Exercise,
    /// Its case, complete.
    pub case: Arc<Case>,
    /// What shows how it is done, where something does.
    pub demonstration: Option<Demonstration>,
}

impl Library {
    /// The library in this folder.
    pub fn new(assets: impl Into<PathBuf>) -> Self {
        Self {
            assets: assets.into(),
            extensions: Extensions::default(),
            mods: Arc::default(),
        }
    }

    /// The same with the exercises of extensions, and files that name their metrics and goals. An app has its own as the
    /// resource [`Extensions`].
    pub fn with_extensions(self, extensions: Extensions) -> Self {
        Self { extensions, ..self }
    }

    /// The same with these mods, and no others.
    pub fn with_mods(self, mods: Mods) -> Self {
        Self {
            mods: mods.into(),
            ..self
        }
    }

    /// Its mods.
    pub fn mods(&self) -> &Mods {
        &self.mods
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

    /// Whether an exercise is one of the shipped ones, not one's own of the same name.
    pub fn is_shipped(&self, loaded: &LoadedExercise) -> bool {
        loaded.file == self.file_of(&loaded.name)
    }

    fn file_of(&self, name: &str) -> PathBuf {
        let exercises = self.assets.join("exercises");
        exercises.join(format!("{name}{EXERCISE_SUFFIX}"))
    }

    /// The folder of what ships.
    pub fn assets(&self) -> &Path {
        &self.assets
    }

    /// The names of the shipped cases, sorted.
    pub fn case_names(&self) -> Vec<String> {
        names_in(&self.assets.join("cases"), CASE_SUFFIX)
    }

    /// The names of the exercises of mods, `mod/name`, sorted.
    pub fn mod_exercise_names(&self) -> Vec<String> {
        let of = |found: &Mod| {
            let id = found.manifest.id.clone();
            let names = found.exercises.clone().into_iter();
            names.map(move |name| format!("{id}/{name}"))
        };
        self.mods.good().iter().flat_map(of).collect()
    }

    /// Loads an exercise and its case: by the name of a shipped one or an extension's, by `mod/name` (or the name alone, where
    /// only one mod has it), or by the path of a file.
    ///
    /// # Errors
    /// [`ExerciseError`] names the file and the place in it.
    pub fn load(&self, name_or_path: &str) -> Result<LoadedExercise, ExerciseError> {
        if let Some((id, name)) = qualified(name_or_path) {
            if let Some(found) = self.mods.get(id) {
                return self.load_of_mod(found, name);
            }
            if let Some(aside) = self.mods.aside().iter().find(|aside| aside.id == id) {
                return Err(ExerciseError::Aside {
                    name: name_or_path.into(),
                    why: aside.to_string(),
                });
            }
        }
        let by_path = is_path(name_or_path, EXERCISE_SUFFIX);
        let file = if by_path {
            PathBuf::from(name_or_path)
        } else {
            self.file_of(name_or_path)
        };
        if !file.is_file() {
            if !by_path && let Some(exercise) = self.extensions.exercise(name_or_path) {
                return self.load_value(name_or_path, exercise);
            }
            return self.load_missing(name_or_path, file);
        }
        let text = read_text(&file, MAX_FILE_BYTES).map_err(|source| ExerciseError::Read {
            file: file.clone(),
            source,
        })?;
        self.load_text(&text, &file)
    }

    /// Loads the exercise of a mod.
    fn load_of_mod(&self, found: &Mod, name: &str) -> Result<LoadedExercise, ExerciseError> {
        let file = found.exercise_file(name);
        if !found.exercises.iter().any(|exercise| exercise == name) {
            let nearest = nearest(name, found.exercises.iter().map(String::as_str));
            let id = &found.manifest.id;
            return Err(ExerciseError::Missing {
                file,
                nearest: nearest.map(|name| format!("{id}/{name}")),
            });
        }
        let text = read_text(&file, MAX_FILE_BYTES).map_err(|source| ExerciseError::Read {
            file: file.clone(),
            source,
        })?;
        let loaded = self.examine_of(&text, &file, Some(found));
        loaded.map_err(|mut faults| faults.swap_remove(0))
    }

    /// What a name stands for that no shipped exercise has: the exercise of the only mod that has one of that name.
    fn load_missing(&self, name: &str, file: PathBuf) -> Result<LoadedExercise, ExerciseError> {
        let has = |found: &&Mod| found.exercises.iter().any(|exercise| exercise == name);
        let having: Vec<&Mod> = self.mods.good().iter().filter(has).collect();
        match having[..] {
            [only] => self.load_of_mod(only, name),
            [] => {
                let (shipped, of_mods) = (self.exercise_names(), self.mod_exercise_names());
                let names = shipped.iter().chain(&of_mods).map(String::as_str);
                // What is no name is a path, and there is no nearest one.
                let is_name = !is_path(name, EXERCISE_SUFFIX) || qualified(name).is_some();
                let nearest = nearest(name, names).filter(|_| is_name);
                Err(ExerciseError::Missing { file, nearest })
            }
            _ => Err(ExerciseError::Ambiguous {
                name: name.into(),
                found: having
                    .iter()
                    .map(|found| format!("{}/{name}", found.manifest.id))
                    .collect(),
            }),
        }
    }

    /// Loads an exercise from its text as if it stood in `file`, and its case with it.
    ///
    /// # Errors
    /// The first of [`Library::examine`].
    pub fn load_text(&self, text: &str, file: &Path) -> Result<LoadedExercise, ExerciseError> {
        self.examine(text, file).map_err(|mut faults| faults.swap_remove(0))
    }

    /// Loads an exercise from its text as if it stood in `file`, and its case with it, and tells all that is wrong.
    ///
    /// # Errors
    /// At least one [`ExerciseError`]; each names the file and the place in it.
    pub fn examine(&self, text: &str, file: &Path) -> Result<LoadedExercise, Vec<ExerciseError>> {
        match mod_folder(file) {
            None => self.examine_of(text, file, None),
            Some(folder) => match self.mods.around(file) {
                Some(found) => self.examine_of(text, file, Some(found)),
                // A mod that is being written, elsewhere than where the game looks.
                None => {
                    let mods = self.mods.with([folder.to_owned()]);
                    if let Some(aside) = mods.aside().iter().find(|aside| aside.folder == folder) {
                        let (name, why) = (file.display().to_string(), aside.to_string());
                        return Err(vec![ExerciseError::Aside { name, why }]);
                    }
                    let library = self.clone().with_mods(mods);
                    library.examine_of(text, file, library.mods.around(file))
                }
            },
        }
    }

    /// As [`Library::examine`], of this mod.
    pub(crate) fn examine_of(
        &self,
        text: &str,
        file: &Path,
        of: Option<&Mod>,
    ) -> Result<LoadedExercise, Vec<ExerciseError>> {
        let read = Exercise::examine(text, file, &self.extensions);
        let (exercise, faults) = read.map_err(|slip| vec![slip])?;
        self.with_files(exercise, file, of, faults, |error| error.placed(text))
    }

    /// Checks an exercise that was made in Rust as if it were a file of that name, and loads its case with it. A path of a case is
    /// relative to the working directory.
    ///
    /// # Errors
    /// [`ExerciseError`] names the exercise and the field.
    pub fn load_value(&self, name: &str, exercise: Exercise) -> Result<LoadedExercise, ExerciseError> {
        let file = PathBuf::from(format!("{name}{EXERCISE_SUFFIX}"));
        let mut rules = exercise.faults();
        rules.extend(self.extensions.check(&exercise).err());
        let faults = rules.into_iter().map(|rule| ExerciseError::Rule {
            file: file.clone(),
            rule: rule.into(),
        });
        let faults = faults.collect();
        (self.with_files(exercise, &file, None, faults, |error| error)).map_err(|mut faults| faults.swap_remove(0))
    }

    /// Loads what else an exercise needs, whose faults are these: its case and who shows it. `placed` tells where in the text a
    /// fault stands.
    fn with_files(
        &self,
        exercise: Exercise,
        file: &Path,
        of: Option<&Mod>,
        mut faults: Vec<ExerciseError>,
        placed: impl Fn(ExerciseError) -> ExerciseError,
    ) -> Result<LoadedExercise, Vec<ExerciseError>> {
        // A case without a name has been told.
        let case = if exercise.case.trim().is_empty() {
            None
        } else {
            let found = match of {
                Some(of) => self.case_of_mod(&exercise.case, file, of),
                None => self.case_file(&exercise.case, file).map(|file| (file, None)),
            };
            let case = found.and_then(|(case_file, owner)| {
                let case = match owner {
                    Some(owner) => owner.case(&case_file),
                    None => Case::load(&case_file).map(Arc::new),
                };
                case.map_err(|source| ExerciseError::Case {
                    file: file.into(),
                    place: None,
                    source: source.into(),
                })
            });
            case.map_err(|error| faults.push(placed(error))).ok()
        };
        let demonstration = self.demonstration(&exercise, file, of).map_err(placed);
        let demonstration = demonstration.unwrap_or_else(|error| {
            faults.push(error);
            None
        });
        match case {
            Some(case) if faults.is_empty() => Ok(LoadedExercise {
                name: match of {
                    Some(of) => format!("{}/{}", of.manifest.id, stem(file, EXERCISE_SUFFIX)),
                    None => stem(file, EXERCISE_SUFFIX),
                },
                file: file.into(),
                exercise,
                case,
                demonstration,
            }),
            _ => Err(faults),
        }
    }

    fn case_file(&self, case: &str, exercise_file: &Path) -> Result<PathBuf, ExerciseError> {
        let missing = |rule: RuleError| ExerciseError::Rule {
            file: exercise_file.into(),
            rule: rule.into(),
        };
        if is_path(case, CASE_SUFFIX) {
            let path = exercise_file.parent().unwrap_or(Path::new("")).join(case);
            return if path.is_file() {
                Ok(path)
            } else {
                let expected = format!("a case file, but there is none at {}", path.display());
                let name = stem(&path, CASE_SUFFIX);
                let beside = names_in(path.parent().unwrap_or(Path::new("")), CASE_SUFFIX);
                let nearest = nearest(&name, beside.iter().map(String::as_str));
                Err(missing(RuleError {
                    nearest: nearest.map(|name| format!("{name}{CASE_SUFFIX}")),
                    ..RuleError::new("case", format_args!("\"{case}\""), expected)
                }))
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

impl Library {
    /// The file of the case that an exercise of a mod names, and the mod that has it, if one does.
    fn case_of_mod<'a>(
        &'a self,
        case: &str,
        exercise_file: &Path,
        of: &'a Mod,
    ) -> Result<(PathBuf, Option<&'a Mod>), ExerciseError> {
        let id = &of.manifest.id;
        let broken = |rule: RuleError| ExerciseError::Rule {
            file: exercise_file.into(),
            rule: rule.into(),
        };
        let quoted = format!("\"{case}\"");
        if let Some((owner, name)) = qualified(case) {
            let needs = of.manifest.needs.iter().map(|(need, _)| need);
            let allowed: Vec<&str> = needs.chain([id]).map(String::as_str).collect();
            let Some(owner) = self.mods.get(owner).filter(|_| allowed.contains(&owner)) else {
                let expected = format!("the case of this mod or one that it needs ({})", allowed.join(", "));
                // A folder is no mod: its own cases go by their names alone.
                let own = of.cases.iter().find(|own| *own == name).cloned();
                let nearest = own.or_else(|| nearest(owner, allowed).map(|owner| format!("{owner}/{name}")));
                let rule = RuleError::new("case", quoted, expected);
                return Err(broken(RuleError { nearest, ..rule }));
            };
            if owner.cases.iter().any(|case| case == name) {
                return Ok((owner.case_file(name), Some(owner)));
            }
            let names: Vec<String> = owner
                .cases
                .iter()
                .map(|case| format!("{}/{case}", owner.manifest.id))
                .collect();
            let expected = format!("a case of the mod `{}` ({})", owner.manifest.id, names.join(", "));
            let names = names.iter().map(String::as_str);
            return Err(broken(RuleError::unknown_name("case", case, expected, names)));
        }
        if is_path(case, CASE_SUFFIX) {
            let folder = exercise_file.parent().unwrap_or(of.folder());
            let path = of.fence.path(folder, case);
            let path = path.map_err(|expected| broken(RuleError::new("case", &quoted, expected)))?;
            if path.is_file() {
                return Ok((path, Some(of)));
            }
            let expected = format!("a case file of the mod, but there is none at {}", path.display());
            // By its name alone it is found where the mod's cases lie.
            let name = stem(&path, CASE_SUFFIX);
            let nearest = of.cases.contains(&name).then_some(name);
            let rule = RuleError::new("case", quoted, expected);
            return Err(broken(RuleError { nearest, ..rule }));
        }
        if of.cases.iter().any(|own| own == case) {
            return Ok((of.case_file(case), Some(of)));
        }
        let shipped = self.assets.join("cases").join(format!("{case}{CASE_SUFFIX}"));
        if shipped.is_file() {
            return Ok((shipped, None));
        }
        let names = self.case_names();
        let own = match of.cases.join(", ") {
            none if none.is_empty() => "a case of the mod (it has none)".into(),
            own => format!("a case of the mod ({own})"),
        };
        let expected = format!("{own} or a shipped one ({})", names.join(", "));
        let names = of.cases.iter().chain(&names).map(String::as_str);
        Err(broken(RuleError::unknown_name("case", case, expected, names)))
    }
}

/// The folder of the mod that an exercise file stands in, by the names of folders.
pub(crate) fn mod_folder(file: &Path) -> Option<&Path> {
    let exercises = file.parent().filter(|folder| folder.ends_with(EXERCISES))?;
    let folder = exercises.parent()?;
    folder.join(MANIFEST).is_file().then_some(folder)
}

/// The two parts of `mod/name`; none of what is a name alone or a path.
fn qualified(reference: &str) -> Option<(&str, &str)> {
    let (id, name) = reference.split_once('/')?;
    let is_name = |part: &str| !part.is_empty() && !part.contains(['/', '\\', '.']);
    (is_name(id) && is_name(name)).then_some((id, name))
}

/// Whether a reference is meant as a path rather than a name.
pub(crate) fn is_path(reference: &str, suffix: &str) -> bool {
    reference.ends_with(suffix) || reference.contains(['/', '\\'])
}

/// A file's name without its end.
pub(crate) fn stem(file: &Path, suffix: &str) -> String {
    let name = file.file_name().unwrap_or_default().to_string_lossy();
    name.strip_suffix(suffix).unwrap_or(&name).to_owned()
}

/// Names of the files with this end in a folder, without it, sorted.
pub(crate) fn names_in(folder: &Path, suffix: &str) -> Vec<String> {
    // A path of a file alone has an empty parent.
    let folder = if folder.as_os_str().is_empty() {
        Path::new(".")
    } else {
        folder
    };
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

/// The text of a file of at most so many bytes.
pub(crate) fn read_text(file: &Path, most_bytes: u64) -> io::Result<String> {
    let mut bytes = Vec::new();
    fs::File::open(file)?.take(most_bytes + 1).read_to_end(&mut bytes)?;
    if bytes.len() as u64 > most_bytes {
        let problem = format!("larger than {most_bytes} bytes, the most that is read");
        return Err(io::Error::other(problem));
    }
    String::from_utf8(bytes).map_err(|error| {
        let good = &error.as_bytes()[..error.utf8_error().valid_up_to()];
        let line = good.iter().filter(|&&byte| byte == b'\n').count() + 1;
        io::Error::other(format!("no UTF-8 text in line {line}: save it with that encoding"))
    })
}
