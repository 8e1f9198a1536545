//! What can go wrong with the database, and with what is brought into it.

use std::{io, path::PathBuf};

use thiserror::Error;

use super::MAX_NAME;
use crate::error::RecordError;

/// Why progress was not read or kept. What was kept before stays.
#[derive(Debug, Error)]
pub enum ProgressError {
    /// Nowhere to keep it.
    #[error("no folder for your own data is known here: nothing is kept; RESECTA_DATA_DIR may name one")]
    NoFolder,
    /// The folder cannot be made.
    #[error("{}: the folder cannot be made: {source}", folder.display())]
    Folder {
        /// The folder.
        folder: PathBuf,
        /// Why.
        source: io::Error,
    },
    /// The database said no.
    #[error("{}: {source}", file.display())]
    Database {
        /// The file.
        file: PathBuf,
        /// Why.
        source: rusqlite::Error,
    },
    /// A later program made it.
    #[error("{}: is a database of version {version}; this program knows {known}", file.display())]
    LaterVersion {
        /// The file.
        file: PathBuf,
        /// Its version.
        version: u32,
        /// The one that is known.
        known: u32,
    },
    /// No trainee can have this name.
    #[error("\"{}\" is no name: expected 1 to {MAX_NAME} letters", name.escape_debug())]
    Name {
        /// The name.
        name: String,
    },
    /// A run that none can be.
    #[error("run {identity}: {what}")]
    Run {
        /// Its identity.
        identity: String,
        /// What is wrong.
        what: String,
    },
    /// A record that cannot be imported.
    #[error(transparent)]
    Record(#[from] RecordError),
    /// A file that cannot be imported.
    #[error("{}: cannot be imported: {what}", file.display())]
    Import {
        /// The file.
        file: PathBuf,
        /// Why.
        what: String,
    },
}

impl ProgressError {
    pub(super) fn database(file: &std::path::Path, source: rusqlite::Error) -> Self {
        Self::Database {
            file: file.into(),
            source,
        }
    }
}
