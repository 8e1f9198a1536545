//! Checks files and folders, and tells all that is wrong with them: what `resecta validate` does.
//!
//! An exercise is checked as if it were about to be played: text, rules, case, gland, marks, instrument. A case is checked as far
//! as a lattice. A folder with a manifest is checked as a mod, beside the mods of the library and those named with it: one that is put
//! aside for its manifest or folder is not looked into. Nothing is written and nothing is spawned.

use std::{
    fmt, fs, io,
    path::{Path, PathBuf},
    sync::Arc,
};

use resecta_anatomy::{Case, CaseError, Lattice, LatticeError, LatticeOptions};
use resecta_instrument::{InstrumentLimits, InstrumentScript, ScriptError};
use resecta_solver::Material;
use resecta_text::{nearest, place_of};
use thiserror::Error;

use crate::{
    curriculum,
    errors::{ExerciseError, RuleError},
    library::{CASE_SUFFIX, EXERCISE_SUFFIX, Library, MAX_FILE_BYTES, read_text},
    mods::{EXERCISES, MANIFEST, Mod, ModError, SCRIPTS},
};

/// Folders within folders that are looked into.
const DEEPEST: usize = 8;
/// Files and folders that are looked at below one named folder.
const MOST_ENTRIES: usize = 10_000;

/// What is wrong with a file, or with a path.
#[derive(Debug, Error)]
pub enum FileFault {
    /// An exercise, or a rule that a case shares with it.
    #[error(transparent)]
    Exercise(#[from] ExerciseError),
    /// A case.
    #[error(transparent)]
    Case(#[from] CaseError),
    /// A mod.
    #[error("{0}")]
    Mod(Arc<ModError>),
    /// A script of a mod.
    #[error(transparent)]
    Script(#[from] ScriptError),
    /// An exercise or a case in a mod where the game does not look.
    #[error("{}: is not found there; expected it in the mod's folder `{folder}`", file.display())]
    Misplaced {
        /// The file.
        file: PathBuf,
        /// Where it belongs.
        folder: &'static str,
    },
    /// A case that gives no lattice.
    #[error("{}: slices: no lattice can be built: {source}", file.display())]
    Lattice {
        /// The case file.
        file: PathBuf,
        /// What the lattice builder says.
        source: LatticeError,
    },
    /// Nothing is at a path.
    #[error("{}: no such file or folder{}", file.display(), resecta_text::did_you_mean(nearest))]
    Missing {
        /// The path.
        file: PathBuf,
        /// The nearest name beside it.
        nearest: Option<String>,
    },
    /// A file whose name does not say what it is.
    #[error("{}: unknown kind of file; expected {KINDS}{}", file.display(), meant(nearest))]
    Kind {
        /// The file.
        file: PathBuf,
        /// The name that may be meant.
        nearest: Option<String>,
    },
    /// A folder that cannot be read, or is too large.
    #[error("{}: {problem}", folder.display())]
    Folder {
        /// The folder.
        folder: PathBuf,
        /// What is wrong with it.
        problem: String,
    },
}

/// What the name of a file may end in.
const KINDS: &str = "a name that ends in .exercise.ron or .case.ron";

/// What may be meant by a file of no such name.
fn meant(nearest: &Option<String>) -> String {
    match nearest {
        Some(_) => resecta_text::did_you_mean(nearest),
        None => "; manifest, curriculum and scripts of a mod are checked with its folder".into(),
    }
}

/// What came of checking files.
#[derive(Debug, Default)]
pub struct Validation {
    /// Every file that was checked, and every path that could not be, with what is wrong with it.
    pub checked: Vec<(PathBuf, Vec<FileFault>)>,
    /// Files in folders that are neither exercise nor case.
    pub passed_over: Vec<PathBuf>,
}

impl Validation {
    /// The number of files with nothing wrong.
    pub fn good(&self) -> usize {
        self.checked.iter().filter(|(_, faults)| faults.is_empty()).count()
    }

    /// The number of faults.
    pub fn faults(&self) -> usize {
        self.checked.iter().map(|(_, faults)| faults.len()).sum()
    }

    fn push(&mut self, file: &Path, faults: Vec<FileFault>) {
        self.checked.push((file.into(), faults));
    }
}

impl fmt::Display for Validation {
    /// A line for each fault, for each good file and for each file passed over.
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (file, faults) in &self.checked {
            for fault in faults {
                writeln!(formatter, "{fault}")?;
            }
            if faults.is_empty() {
                writeln!(formatter, "{}: good", file.display())?;
            }
        }
        for file in &self.passed_over {
            writeln!(formatter, "{}: passed over: neither exercise nor case", file.display())?;
        }
        Ok(())
    }
}

impl Library {
    /// Checks files, and all exercises and cases in folders. Every fault is told but what hides behind a slip of syntax.
    pub fn validate<P: AsRef<Path>>(&self, paths: impl IntoIterator<Item = P>) -> Validation {
        let paths: Vec<P> = paths.into_iter().collect();
        let mut mods = Vec::new();
        for path in &paths {
            let mut left = MOST_ENTRIES;
            find_mods(path.as_ref(), DEEPEST, &mut left, &mut mods);
        }
        let library = self.clone().with_mods(self.mods().with(mods));
        library.validate_paths(paths.iter().map(AsRef::as_ref))
    }

    fn validate_paths<'a>(&self, paths: impl Iterator<Item = &'a Path>) -> Validation {
        let mut validation = Validation::default();
        for path in paths {
            if path.is_dir() {
                let mut left = MOST_ENTRIES;
                if let Err(fault) = self.validate_folder(path, DEEPEST, &mut left, &mut validation) {
                    validation.push(path, vec![fault]);
                }
            } else if !path.exists() {
                let file = path.into();
                validation.push(
                    path,
                    vec![FileFault::Missing {
                        file,
                        nearest: beside(path),
                    }],
                );
            } else if let Some(faults) = self.validate_file(path) {
                validation.push(path, faults);
            } else {
                let file = path.into();
                validation.push(
                    path,
                    vec![FileFault::Kind {
                        file,
                        nearest: intended(path),
                    }],
                );
            }
        }
        validation
    }

    fn validate_folder(
        &self,
        folder: &Path,
        depth: usize,
        left: &mut usize,
        validation: &mut Validation,
    ) -> Result<(), FileFault> {
        if folder.join(MANIFEST).is_file() {
            self.validate_mod(folder, validation);
            return Ok(());
        }
        let broken = |problem: String| FileFault::Folder {
            folder: folder.into(),
            problem,
        };
        let entries = entries(folder).map_err(|error| broken(format!("cannot be read: {error}")))?;
        for entry in entries {
            *left = left
                .checked_sub(1)
                .ok_or_else(|| broken(format!("more than {MOST_ENTRIES} files and folders: name fewer")))?;
            let is_link = entry.is_symlink();
            if entry.is_dir() && !is_link {
                if depth == 0 {
                    let folder = entry.clone();
                    let problem = format!("more than {DEEPEST} folders deep, and not looked into");
                    validation.push(&entry, vec![FileFault::Folder { folder, problem }]);
                } else {
                    self.validate_folder(&entry, depth - 1, left, validation)?;
                }
                continue;
            }
            match (self.validate_file(&entry), intended(&entry)) {
                (Some(faults), _) => validation.push(&entry, faults),
                // A slip in the end of a name would hide the file from the game.
                (None, nearest @ Some(_)) => {
                    let file = entry.clone();
                    validation.push(&entry, vec![FileFault::Kind { file, nearest }]);
                }
                (None, None) => validation.passed_over.push(entry),
            }
        }
        Ok(())
    }

    /// Checks a mod: what is put aside is told and not looked into.
    fn validate_mod(&self, folder: &Path, validation: &mut Validation) {
        let mut asides = self.mods().aside().iter().filter(|aside| aside.folder == folder);
        if let Some(aside) = asides.next() {
            let file = folder.join(MANIFEST);
            let faults = aside.faults.iter().map(|fault| FileFault::Mod(fault.clone()));
            validation.push(&file, faults.collect());
        } else if let Some(found) = self.mods().around(folder) {
            validation.push(&folder.join(MANIFEST), Vec::new());
            self.validate_in_mod(found, folder, validation);
        }
    }

    /// Checks the files in a folder of a mod, which keeps the limits of mods.
    fn validate_in_mod(&self, of: &Mod, folder: &Path, validation: &mut Validation) {
        let is = |name: &str| folder == of.folder().join(name);
        for entry in entries(folder).unwrap_or_default() {
            let name = entry.file_name().unwrap_or_default().to_string_lossy();
            let faults = if entry.is_dir() {
                if !entry.is_symlink() {
                    self.validate_in_mod(of, &entry, validation);
                }
                continue;
            } else if name.ends_with(EXERCISE_SUFFIX) {
                match is(EXERCISES) {
                    true => self.exercise_faults(&entry),
                    false => vec![misplaced(&entry, EXERCISES)],
                }
            } else if name.ends_with(CASE_SUFFIX) {
                case_faults(&entry)
            } else if is(SCRIPTS) && name.ends_with(".ron") {
                let script = InstrumentScript::load(&entry, &InstrumentLimits::default());
                script.err().into_iter().map(FileFault::from).collect()
            } else if is("") && name == curriculum::FILE {
                self.curriculum_faults(of, &entry)
            } else if is("") && name == MANIFEST {
                continue;
            } else if let nearest @ Some(_) = intended(&entry) {
                let file = entry.clone();
                vec![FileFault::Kind { file, nearest }]
            } else {
                validation.passed_over.push(entry);
                continue;
            };
            validation.push(&entry, faults);
        }
    }

    /// What is wrong with a file; none where its name says neither exercise nor case.
    fn validate_file(&self, file: &Path) -> Option<Vec<FileFault>> {
        let name = file.file_name()?.to_string_lossy();
        if name.ends_with(EXERCISE_SUFFIX) {
            Some(self.exercise_faults(file))
        } else if name.ends_with(CASE_SUFFIX) {
            Some(case_faults(file))
        } else {
            None
        }
    }

    /// What is wrong with the curriculum of a mod, levels that nobody can open included.
    fn curriculum_faults(&self, of: &Mod, file: &Path) -> Vec<FileFault> {
        let curriculum = match of.curriculum() {
            Ok(curriculum) => curriculum,
            Err(error) => return vec![error.into()],
        };
        // An exercise with a fault is told of that.
        let earns_medals = |name: &&String| {
            let loaded = self.load(&format!("{}/{name}", of.manifest.id));
            loaded.map_or(true, |loaded| loaded.exercise.total_pars.is_some())
        };
        let levels = (1..).zip(curriculum.levels.windows(2));
        let faults = levels.filter_map(|(number, levels)| {
            let [before, level] = levels else { return None };
            let needed = level.needs?.exercises;
            let most = before.exercises.iter().filter(earns_medals).count();
            let field = format!("levels[{number}].needs.exercises");
            let expected = format!("at most {most}, as many of the level before have `total_pars` and earn medals");
            (needed as usize > most).then(|| RuleError::new(field, needed, expected))
        });
        let text = read_text(file, MAX_FILE_BYTES).unwrap_or_default();
        let placed = faults.map(|rule| {
            let (file, rule) = (file.into(), rule.into());
            ExerciseError::Rule { file, rule }.placed(&text).into()
        });
        placed.collect()
    }

    fn exercise_faults(&self, file: &Path) -> Vec<FileFault> {
        let text = match read_text(file, MAX_FILE_BYTES) {
            Ok(text) => text,
            Err(source) => {
                let file = file.into();
                return vec![ExerciseError::Read { file, source }.into()];
            }
        };
        match self.examine(&text, file) {
            Ok(loaded) => match loaded.prepare() {
                Ok(_) => Vec::new(),
                Err(error) => vec![error.placed(&text).into()],
            },
            Err(faults) => faults.into_iter().map(FileFault::from).collect(),
        }
    }
}

fn misplaced(file: &Path, folder: &'static str) -> FileFault {
    let file = file.into();
    FileFault::Misplaced { file, folder }
}

/// The folders with a manifest in a folder, which may be one itself.
fn find_mods(folder: &Path, depth: usize, left: &mut usize, found: &mut Vec<PathBuf>) {
    if folder.join(MANIFEST).is_file() {
        found.push(folder.into());
        return;
    }
    for entry in entries(folder).unwrap_or_default() {
        // Who looks through all of it once more tells what is too much.
        *left = left.saturating_sub(1);
        if *left > 0 && depth > 0 && entry.is_dir() && !entry.is_symlink() {
            find_mods(&entry, depth - 1, left, found);
        }
    }
}

fn case_faults(file: &Path) -> Vec<FileFault> {
    let text = match read_text(file, resecta_anatomy::MAX_FILE_BYTES) {
        Ok(text) => text,
        Err(source) => {
            let file = file.into();
            return vec![CaseError::Read { file, source }.into()];
        }
    };
    let case = match Case::examine(&text, file) {
        Ok(case) => case,
        Err(errors) => return errors.into_iter().map(FileFault::from).collect(),
    };
    let mut faults = Vec::new();
    if Material::preset(&case.material).is_none() {
        let names: Vec<&str> = Material::preset_names().collect();
        let expected = format!("a material preset ({})", names.join(", "));
        let rule = RuleError {
            place: place_of(&text, "material"),
            ..RuleError::unknown_name("material", &case.material, expected, names)
        };
        let (file, rule) = (file.into(), rule.into());
        faults.push(ExerciseError::Rule { file, rule }.into());
    }
    if let Err(source) = Lattice::build(&case, &LatticeOptions::default()) {
        let file = file.into();
        faults.push(FileFault::Lattice { file, source });
    }
    faults
}

/// Files and folders in a folder, sorted by name; hidden ones are left out.
fn entries(folder: &Path) -> io::Result<Vec<PathBuf>> {
    let mut entries = Vec::new();
    for entry in fs::read_dir(folder)?.take(MOST_ENTRIES + 1) {
        let entry = entry?;
        if !entry.file_name().to_string_lossy().starts_with('.') {
            entries.push(entry.path());
        }
    }
    entries.sort();
    Ok(entries)
}

/// The name that a file's name may be meant as, where its end is a slip: `x.excercise.ron`, `x.case.ron.txt`.
fn intended(file: &Path) -> Option<String> {
    let name = file.file_name()?.to_str()?;
    let (stem, end) = name.split_at(name.find('.')?);
    let hidden = [EXERCISE_SUFFIX, CASE_SUFFIX]
        .into_iter()
        .find(|kind| end.starts_with(kind));
    let kind = match hidden {
        Some(kind) => kind.to_owned(),
        None if end.ends_with(".ron") && end != ".ron" => nearest(end, [EXERCISE_SUFFIX, CASE_SUFFIX])?,
        None => return None,
    };
    Some(format!("{stem}{kind}"))
}

/// The nearest name to a path's in the folder where it is looked for.
fn beside(path: &Path) -> Option<String> {
    let folder = path.parent()?;
    let folder = if folder.as_os_str().is_empty() {
        Path::new(".")
    } else {
        folder
    };
    let names: Vec<String> = (entries(folder).ok()?.iter())
        .filter_map(|entry| Some(entry.file_name()?.to_str()?.to_owned()))
        .collect();
    nearest(path.file_name()?.to_str()?, names.iter().map(String::as_str))
}
