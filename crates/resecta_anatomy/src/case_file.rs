//! Case files: reading, checking, writing.

use std::fs::File;
use std::io::{self, Read};
use std::path::{Path, PathBuf};

use resecta_text::{Place, Slip, place_of, write_whole};

use crate::{Case, CaseRuleError, complete::UrethraEnds, validate::drop_repeated_corners};

/// Largest case or contour file that is read, bytes.
pub const MAX_FILE_BYTES: u64 = 64 << 20;

/// Why a case file could not be read or written. Every text names the file.
#[derive(Debug, thiserror::Error)]
pub enum CaseError {
    /// The file system said no.
    #[error("{}: cannot be read: {source}", file.display())]
    Read {
        /// The file.
        file: PathBuf,
        /// Why.
        source: io::Error,
    },
    /// Larger than any case.
    #[error("{}: is larger than {MAX_FILE_BYTES} bytes, the most that is read", file.display())]
    TooLarge {
        /// The file.
        file: PathBuf,
    },
    /// Not RON, a wrong, unknown or missing field, or an unknown unit.
    #[error("{}:{slip}", file.display())]
    Syntax {
        /// The file.
        file: PathBuf,
        /// Where in it, what is wrong there, and what was expected.
        slip: Box<Slip>,
    },
    /// Well formed, but no case.
    #[error("{}:{place}: {rule}", file.display())]
    Rule {
        /// The file.
        file: PathBuf,
        /// Where the field stands, or what should hold it.
        place: Place,
        /// The rule it breaks.
        #[source]
        rule: CaseRuleError,
    },
    /// The file could not be written; what was there before is untouched.
    #[error("{}: cannot be written: {source}", file.display())]
    Write {
        /// The file.
        file: PathBuf,
        /// Why.
        source: io::Error,
    },
}

impl Case {
    /// Reads a `*.case.ron` file, checks it and completes it.
    ///
    /// # Errors
    ///
    /// Every [`CaseError`] but [`CaseError::Write`]; each names the file and what is wrong in it.
    pub fn load(path: &Path) -> Result<Case, CaseError> {
        let bytes = read_limited(path, MAX_FILE_BYTES)
            .map_err(|source| CaseError::Read {
                file: path.into(),
                source,
            })?
            .ok_or_else(|| CaseError::TooLarge { file: path.into() })?;
        let text = String::from_utf8(bytes).map_err(|error| CaseError::Read {
            file: path.into(),
            source: io::Error::new(io::ErrorKind::InvalidData, error.utf8_error()),
        })?;
        Case::from_ron(&text, path)
    }

    /// Parses, checks and completes a case; `file` is named in errors.
    ///
    /// See [`Case::complete`] for what is filled in.
    ///
    /// # Errors
    ///
    /// [`CaseError::Syntax`] or [`CaseError::Rule`], the first of [`Case::examine`].
    pub fn from_ron(text: &str, file: &Path) -> Result<Case, CaseError> {
        Case::examine(text, file).map_err(|mut errors| errors.swap_remove(0))
    }

    /// Parses, checks and completes a case, and tells all that is wrong with it.
    ///
    /// # Errors
    ///
    /// At least one: a [`CaseError::Syntax`] alone, or every [`CaseError::Rule`].
    pub fn examine(text: &str, file: &Path) -> Result<Case, Vec<CaseError>> {
        let broken = |rule: CaseRuleError| CaseError::Rule {
            file: file.into(),
            place: place_of(text, &rule.field())
                .or_else(|| place_of(text, "."))
                .unwrap_or_default(),
            rule,
        };
        let mut case: Case = resecta_text::read(text).map_err(|slip| {
            vec![CaseError::Syntax {
                file: file.into(),
                slip: slip.into(),
            }]
        })?;
        drop_repeated_corners(&mut case);
        let rules = case.faults();
        if !rules.is_empty() {
            return Err(rules.into_iter().map(broken).collect());
        }
        case.fill_in(UrethraEnds::default()).map_err(|rule| vec![broken(rule)])
    }

    /// The text of a `*.case.ron` file, one contour a line.
    pub fn to_ron(&self) -> String {
        let pretty = ron::ser::PrettyConfig::new().depth_limit(3).new_line("\n");
        // A case is plain data: numbers, strings, sequences. RON writes all of them.
        let mut text = ron::ser::to_string_pretty(self, pretty).expect("a case is plain data");
        text.push('\n');
        text
    }

    /// Writes a `*.case.ron` file in one step: the file is either the old one or the new one, never a part.
    ///
    /// # Errors
    ///
    /// [`CaseError::Write`].
    pub fn save(&self, path: &Path) -> Result<(), CaseError> {
        write_whole(path, self.to_ron().as_bytes()).map_err(|source| CaseError::Write {
            file: path.into(),
            source,
        })
    }
}

/// Reads a whole file, or `None` if it holds more than `limit` bytes.
pub(crate) fn read_limited(path: &Path, limit: u64) -> io::Result<Option<Vec<u8>>> {
    let mut bytes = Vec::new();
    File::open(path)?.take(limit + 1).read_to_end(&mut bytes)?;
    Ok((bytes.len() as u64 <= limit).then_some(bytes))
}
