//! Import: cases from contour files and from segmentation masks, and the volumes that masks and images are read from.
//!
//! Both ways to a case end in [`Case::complete`], so an imported case is ready for the lattice and lists what was approximated.

mod axes;
mod contours;
mod nifti_mask;
mod nifti_volume;
mod outline;

use std::io;
use std::path::{Path, PathBuf};

pub use axes::{Axes, AxesError, Turn};
pub use contours::{contours_json, contours_json_str};
pub use nifti_mask::{MaskOptions, nifti_mask, nifti_mask_bytes};
pub use nifti_volume::{MAX_VOLUME_BYTES, MAX_VOXELS, MAX_VOXELS_PER_AXIS, NiftiVolume};

use crate::case_file::read_limited;
use crate::{Case, CaseRuleError};

/// Why a file gave no case. Every text names the file.
#[derive(Debug, thiserror::Error)]
pub enum ImportError {
    /// The file system said no, or the compressed stream is damaged.
    #[error("{}: cannot be read: {source}", file.display())]
    Read {
        /// The file.
        file: PathBuf,
        /// Why.
        source: io::Error,
    },
    /// More than is read of such a file.
    #[error("{}: holds more than {limit} bytes, the most that is read", file.display())]
    TooLarge {
        /// The file.
        file: PathBuf,
        /// The most that is read, bytes.
        limit: u64,
    },
    /// Not JSON, a wrong or missing field, or an unknown unit.
    #[error("{}:{line}:{column}: {field}: {message}", file.display())]
    Syntax {
        /// The file.
        file: PathBuf,
        /// Line, from 1.
        line: usize,
        /// Column, from 1.
        column: usize,
        /// Path of the field, for example `slices[3].capsule[17]`.
        field: String,
        /// What is wrong with it.
        message: String,
    },
    /// Not a NIfTI file, or one whose data do not fit its header.
    #[error("{}: no usable NIfTI volume: {message}", file.display())]
    Nifti {
        /// The file.
        file: PathBuf,
        /// What is wrong.
        message: String,
    },
    /// A field of the header, an option or a voxel has a value that cannot be used.
    #[error("{}: {field}: is {value}, expected {expected}", file.display())]
    Field {
        /// The file.
        file: PathBuf,
        /// The field of the NIfTI header, or the option.
        field: &'static str,
        /// Its value.
        value: String,
        /// What would do.
        expected: String,
    },
    /// The mask has no gland.
    #[error("{}: channel {channel} has no outline of at least 4 voxels in 3 slices, expected a gland", file.display())]
    Empty {
        /// The file.
        file: PathBuf,
        /// The channel.
        channel: usize,
    },
    /// Well formed, but no case.
    #[error("{}: {rule}", file.display())]
    Rule {
        /// The file.
        file: PathBuf,
        /// The rule that the contours break.
        #[source]
        rule: CaseRuleError,
    },
}

/// Reads a contour file (`.json`) or a mask (`.nii`, `.nii.gz`), by the file's name.
///
/// # Errors
///
/// Those of [`contours_json`] and [`nifti_mask`]; any other ending is [`ImportError::Field`].
pub fn import(path: &Path, mask: &MaskOptions) -> Result<Case, ImportError> {
    let name = path
        .file_name()
        .map(|name| name.to_string_lossy().to_lowercase())
        .unwrap_or_default();
    if name.ends_with(".json") {
        contours_json(path)
    } else if name.ends_with(".nii") || name.ends_with(".nii.gz") {
        nifti_mask(path, mask)
    } else {
        Err(ImportError::Field {
            file: path.into(),
            field: "file name",
            value: name,
            expected: "one that ends in .json, .nii or .nii.gz".into(),
        })
    }
}

/// Reads a whole file of at most `limit` bytes.
///
/// # Errors
///
/// [`ImportError::Read`] or [`ImportError::TooLarge`].
pub fn read(path: &Path, limit: u64) -> Result<Vec<u8>, ImportError> {
    read_limited(path, limit)
        .map_err(|source| ImportError::Read {
            file: path.into(),
            source,
        })?
        .ok_or_else(|| ImportError::TooLarge {
            file: path.into(),
            limit,
        })
}

/// The file's name up to its first dot.
fn stem(path: &Path) -> String {
    let name = path
        .file_name()
        .map(|name| name.to_string_lossy().into_owned())
        .unwrap_or_default();
    name.split('.').next().unwrap_or_default().to_owned()
}
