//! The file of a trained model: JSON, versioned, with a checksum, so that a damaged one is refused by name.

use std::io;
use std::path::{Path, PathBuf};

use resecta_anatomy::import::{self, ImportError};
use serde::{Deserialize, Serialize};

use crate::Model;
use crate::appearance::Appearance;
use crate::gland::LEVELS;
use crate::landmarks::LANDMARKS;
use crate::principal::Modes;

/// What a model's file says it is.
pub const MODEL_FORMAT: &str = "resecta prostate model";
/// The version that is written, and the only one that is read.
pub const MODEL_VERSION: u32 = 1;
/// Largest file that is read, bytes.
const MAX_FILE_BYTES: u64 = 64 << 20;
/// Most modes of a model.
const MAX_MODES: usize = 200;

/// Why a model's file cannot be used. Every text names the file.
#[derive(Debug, thiserror::Error)]
pub enum ModelError {
    /// The file cannot be read, or is larger than any model.
    #[error(transparent)]
    File(#[from] ImportError),
    /// Not JSON, or a wrong or missing field.
    #[error("{}:{line}:{column}: {field}: {message}", file.display())]
    Syntax {
        /// The file.
        file: PathBuf,
        /// Line, from 1.
        line: usize,
        /// Column, from 1.
        column: usize,
        /// Path of the field.
        field: String,
        /// What is wrong with it.
        message: String,
    },
    /// Another format, or a version that this program does not know.
    #[error("{}: is {found}, expected {MODEL_FORMAT:?} version {MODEL_VERSION}", file.display())]
    Format {
        /// The file.
        file: PathBuf,
        /// What it says it is.
        found: String,
    },
    /// A number was changed since it was written.
    #[error("{}: is damaged: its checksum is {found}, expected {stated}", file.display())]
    Damaged {
        /// The file.
        file: PathBuf,
        /// The checksum of what it holds.
        found: String,
        /// The checksum it states.
        stated: String,
    },
    /// Parts that do not fit together.
    #[error("{}: {field}: has {found} values, expected {expected}", file.display())]
    Shape {
        /// The file.
        file: PathBuf,
        /// The field.
        field: &'static str,
        /// What it has.
        found: usize,
        /// What it should have.
        expected: usize,
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

#[derive(Serialize, Deserialize)]
struct Header {
    format: String,
    version: u32,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct ModelFile {
    format: String,
    version: u32,
    /// BLAKE3 of the model as JSON without spaces.
    checksum: String,
    model: Model,
}

impl Model {
    /// Reads a model.
    ///
    /// # Errors
    ///
    /// Every [`ModelError`] but [`ModelError::Write`].
    pub fn load(path: &Path) -> Result<Model, ModelError> {
        let bytes = import::read(path, MAX_FILE_BYTES)?;
        Model::from_json(&String::from_utf8_lossy(&bytes), path)
    }

    /// As [`Model::load`], from text; `file` is named in errors.
    ///
    /// # Errors
    ///
    /// As [`Model::load`].
    pub fn from_json(text: &str, file: &Path) -> Result<Model, ModelError> {
        let header: Header = parse(text, file)?;
        if header.format != MODEL_FORMAT || header.version != MODEL_VERSION {
            let found = format!("{:?} version {}", header.format, header.version);
            return Err(ModelError::Format {
                file: file.into(),
                found,
            });
        }
        let parsed: ModelFile = parse(text, file)?;
        let found = parsed.model.checksum();
        if found != parsed.checksum {
            return Err(ModelError::Damaged {
                file: file.into(),
                found,
                stated: parsed.checksum,
            });
        }
        parsed.model.check(file)?;
        Ok(parsed.model)
    }

    /// The text of its file.
    pub fn to_json(&self) -> String {
        let file = ModelFile {
            format: MODEL_FORMAT.into(),
            version: MODEL_VERSION,
            checksum: self.checksum(),
            model: self.clone(),
        };
        serde_json::to_string(&file).expect("a model is plain data")
    }

    /// Writes the model.
    ///
    /// # Errors
    ///
    /// [`ModelError::Write`].
    pub fn save(&self, path: &Path) -> Result<(), ModelError> {
        resecta_text::write_whole(path, self.to_json().as_bytes()).map_err(|source| ModelError::Write {
            file: path.into(),
            source,
        })
    }

    fn checksum(&self) -> String {
        let text = serde_json::to_string(self).expect("a model is plain data");
        blake3::hash(text.as_bytes()).to_hex().to_string()
    }

    fn check(&self, file: &Path) -> Result<(), ModelError> {
        let shape = |field, found, expected| {
            if found == expected {
                Ok(())
            } else {
                Err(ModelError::Shape {
                    file: file.into(),
                    field,
                    found,
                    expected,
                })
            }
        };
        let modes = |field, modes: &Modes, length| {
            shape(field, modes.mean.len(), length)?;
            shape(field, modes.modes.len(), modes.modes.len().min(MAX_MODES))?;
            modes.modes.iter().try_for_each(|mode| shape(field, mode.len(), length))
        };
        modes("gland.shape", &self.gland.shape, 2 * LEVELS * LANDMARKS + 1)?;
        modes("section.shape", &self.section.shape, 2 * LANDMARKS)?;
        Appearance::parts(&self.appearance)
            .into_iter()
            .try_for_each(|(field, found, expected)| shape(field, found, expected))
    }
}

fn parse<'a, T: Deserialize<'a>>(text: &'a str, file: &Path) -> Result<T, ModelError> {
    let mut deserializer = serde_json::Deserializer::from_str(text);
    serde_path_to_error::deserialize(&mut deserializer).map_err(|error| {
        let field = error.path().to_string();
        let inner = error.into_inner();
        ModelError::Syntax {
            file: file.into(),
            line: inner.line(),
            column: inner.column(),
            field: if field == "." { "file".to_owned() } else { field },
            message: inner.to_string(),
        }
    })
}
