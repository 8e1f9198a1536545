//! What can be wrong with a record.

use std::{io, path::PathBuf};

use resecta_anatomy::CaseError;
use resecta_scenario::ExerciseError;
use thiserror::Error;

use crate::{
    format::{FORMAT, MAX_FILE_BYTES},
    identity::Build,
};

/// Why a record was not read, written or played. Every text names the file.
#[derive(Debug, Error)]
pub enum RecordError {
    /// The file system said no.
    #[error("{}: cannot be read: {source}", file.display())]
    Read {
        /// The file.
        file: PathBuf,
        /// Why.
        source: io::Error,
    },
    /// The file could not be written; what was there before is as it was.
    #[error("{}: cannot be written: {source}", file.display())]
    Write {
        /// The file.
        file: PathBuf,
        /// Why.
        source: io::Error,
    },
    /// The file is no record, or no longer the one that was written.
    #[error("{}: {damage}", file.display())]
    Damaged {
        /// The file.
        file: PathBuf,
        /// What is wrong.
        damage: Damage,
    },
    /// The exercise in it cannot be played here.
    #[error("{}: the exercise in it is refused: {source}", file.display())]
    Exercise {
        /// The file.
        file: PathBuf,
        /// Why.
        source: Box<ExerciseError>,
    },
    /// The case in it cannot be used.
    #[error("{}: the case in it is refused: {source}", file.display())]
    Case {
        /// The file.
        file: PathBuf,
        /// Why.
        source: Box<CaseError>,
    },
    /// Another build played it.
    #[error("{}: was played by {recorded}; this is {this}, which may play it otherwise", file.display())]
    OtherBuild {
        /// The file.
        file: PathBuf,
        /// The build that played it.
        recorded: Box<Build>,
        /// This one.
        this: Box<Build>,
    },
}

/// What is wrong with the bytes of a record.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
pub enum Damage {
    /// It does not begin as a record does.
    #[error("is no record of a run: it does not begin as one")]
    Foreign,
    /// Made by another program, most likely a later one.
    #[error("is a record of version {version}; this program knows {FORMAT}")]
    Version {
        /// Its version.
        version: u32,
    },
    /// Larger than any record.
    #[error("is larger than {MAX_FILE_BYTES} bytes, the most that is read")]
    TooLarge,
    /// Its end is missing, or something follows it.
    #[error("is {bytes} bytes long where {expected} were written: it is cut short or continued")]
    Length {
        /// How long it is.
        bytes: u64,
        /// How long it says it is.
        expected: u64,
    },
    /// A byte changed.
    #[error("its checksum is not that of its contents: it is damaged")]
    Checksum,
    /// The exercise or case is not the one that was recorded.
    #[error("the hash of the {what} is not that of its text")]
    Hash {
        /// `exercise` or `case`.
        what: &'static str,
    },
    /// The checksum holds, and yet it is not what a record is: whoever wrote it was another program.
    #[error("its contents are not those of a record: {what}")]
    Contents {
        /// What is wrong.
        what: String,
    },
}
