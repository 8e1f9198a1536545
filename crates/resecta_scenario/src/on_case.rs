//! An exercise on another gland than its own.

use std::{path::Path, sync::Arc};

use resecta_anatomy::{Case, CaseError};
use resecta_text::did_you_mean;
use thiserror::Error;

use crate::{
    errors::nearest,
    library::{CASE_SUFFIX, Library, LoadedExercise, is_path, stem},
};

/// Why a case that was asked for by name or path was not loaded.
#[derive(Debug, Error)]
pub enum LoadCaseError {
    /// What is wrong with its file.
    #[error(transparent)]
    Case(#[from] CaseError),
    /// None ships under this name.
    #[error(
        "{name}: no such case; expected the path of a {CASE_SUFFIX} file or a shipped case ({}){}",
        shipped.join(", "),
        did_you_mean(nearest)
    )]
    Missing {
        /// What was asked for.
        name: String,
        /// The shipped cases.
        shipped: Vec<String>,
        /// The nearest of their names.
        nearest: Option<String>,
    },
}

impl Library {
    /// Loads a case by the name of a shipped one or by the path of a file.
    ///
    /// # Errors
    /// [`LoadCaseError`] names the file and the place in it, or the cases that there are.
    pub fn load_case(&self, name_or_path: &str) -> Result<Case, LoadCaseError> {
        let path = Path::new(name_or_path);
        if is_path(name_or_path, CASE_SUFFIX) || path.is_file() {
            return Ok(Case::load(path)?);
        }
        let file = self.assets().join("cases").join(format!("{name_or_path}{CASE_SUFFIX}"));
        if file.is_file() {
            return Ok(Case::load(&file)?);
        }
        let shipped = self.case_names();
        Err(LoadCaseError::Missing {
            name: name_or_path.into(),
            nearest: nearest(name_or_path, shipped.iter().map(String::as_str)),
            shipped,
        })
    }
}

impl LoadedExercise {
    /// The same exercise on another gland, which was loaded by this name or path. It is an exercise of its own, `exercise_on_case`:
    /// runs on one gland say little of runs on another.
    pub fn on_case(mut self, name_or_path: &str, case: Case) -> Self {
        self.name = format!("{}_on_{}", self.name, stem(Path::new(name_or_path), CASE_SUFFIX));
        self.exercise.title = format!("{}: {}", self.exercise.title, case.name);
        self.exercise.case = name_or_path.into();
        self.case = Arc::new(case);
        self
    }
}
