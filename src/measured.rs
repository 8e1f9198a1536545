//! Pages of measurements: why one could not be made, and its files.

use std::{
    fs, io,
    path::{Path, PathBuf},
};

use resecta_instrument::ScriptError;
use resecta_methods::ReportError;
use resecta_scenario::{ExerciseError, LoadCaseError};

/// Why a page of measurements could not be made.
#[derive(Debug, thiserror::Error)]
pub enum MeasuredError {
    /// The exercise is at fault.
    #[error(transparent)]
    Exercise(#[from] ExerciseError),
    /// A gland is at fault.
    #[error(transparent)]
    Case(#[from] LoadCaseError),
    /// The script that moves the instrument is at fault.
    #[error(transparent)]
    Script(#[from] ScriptError),
    /// A chart could not be drawn.
    #[error(transparent)]
    Chart(#[from] ReportError),
    /// A file or folder could not be written.
    #[error("cannot write {}: {source}", path.display())]
    Write {
        /// The file or folder.
        path: PathBuf,
        /// What the system says.
        source: io::Error,
    },
    /// The raw results could not be written as JSON.
    #[error("cannot write the results as JSON: {0}")]
    Json(#[from] serde_json::Error),
}

/// Writes `NAME.md` and `NAME.json` into a folder, which is made if it is missing.
///
/// # Errors
///
/// [`MeasuredError::Write`] names the file or folder, [`MeasuredError::Json`] the value that JSON cannot hold.
pub(crate) fn write_page(
    out: &Path,
    name: &str,
    page: String,
    results: &impl serde::Serialize,
) -> Result<(), MeasuredError> {
    fs::create_dir_all(out).map_err(|source| MeasuredError::Write {
        path: out.into(),
        source,
    })?;
    let json = serde_json::to_string_pretty(results)? + "\n";
    for (file, text) in [(format!("{name}.md"), page), (format!("{name}.json"), json)] {
        let path = out.join(file);
        fs::write(&path, text).map_err(|source| MeasuredError::Write { path, source })?;
    }
    Ok(())
}
