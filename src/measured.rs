//! Pages of measurements: why one could not be made, and its files.

use std::{
    fs, io,
    path::{Path, PathBuf},
};

use resecta_instrument::ScriptError;
use resecta_methods::ReportError;
use resecta_scenario::{EndReason, ExerciseError, LoadCaseError};

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
    /// A run was over before what was to be measured in it.
    #[error("scene {scene}: the run ended early: {}", reason.words())]
    Ended {
        /// The scene.
        scene: &'static str,
        /// Why the run ended.
        reason: EndReason,
    },
    /// The tissue or the instrument went, or the tissue cannot be cut so finely.
    #[error("scene {scene}: there is no fine surface to look at")]
    Lost {
        /// The scene.
        scene: &'static str,
    },
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

/// Writes files by name and text into a folder, which is made if it is missing.
///
/// # Errors
///
/// [`MeasuredError::Write`] names the file or folder.
pub(crate) fn write_files(out: &Path, files: &[(String, String)]) -> Result<(), MeasuredError> {
    fs::create_dir_all(out).map_err(|source| MeasuredError::Write {
        path: out.into(),
        source,
    })?;
    for (name, text) in files {
        let path = out.join(name);
        fs::write(&path, text).map_err(|source| MeasuredError::Write { path, source })?;
    }
    Ok(())
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
    let json = serde_json::to_string_pretty(results)? + "\n";
    write_files(out, &[(format!("{name}.md"), page), (format!("{name}.json"), json)])
}
