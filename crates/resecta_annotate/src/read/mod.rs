//! Images in: folders of pictures, NIfTI volumes, DICOM ultrasound.
//!
//! Every way ends in a [`Stack`] in the axes of a case, mm from the centre of the file's first voxel (the one of lowest x, y
//! and z), or in an error that names file and field. Geometry comes from the file, from a sidecar in RON beside it
//! ([`Geometry::beside`]) and from the caller; who comes later in this list stands in for the earlier, and
//! [`Stack::notes`] says so.

mod background;
mod dicom;
mod error;
mod geometry;
mod nifti;
mod picture;
mod pictures;
mod structure;
mod training;

use std::path::{Path, PathBuf};

pub use dicom::MAX_DICOM_BYTES;
pub use error::StackError;
pub use geometry::{Geometry, Heights, SIDECAR, Window};
pub use picture::{MAX_COLOURED_PERCENT, MAX_PICTURE_BYTES};
pub use training::{TrainingFolderError, read_training_cases};

use crate::Stack;

/// Reads a stack of images from a folder of pictures (`.png`, or `.dcm` of one frame each), a NIfTI volume (`.nii`,
/// `.nii.gz`) or a DICOM file of several frames (`.dcm`, or any
/// other name), with the sidecar beside it if there is one. What `given` says goes before the sidecar and the files.
///
/// Pixels outside the convex hull of all that is not black in any image lie outside the scanner's sector and count as not
/// shown.
///
/// # Errors
///
/// Any [`StackError`].
pub fn read_stack(path: &Path, given: &Geometry) -> Result<Stack, StackError> {
    given.check().map_err(|(field, message)| StackError::Geometry {
        place: path.display().to_string(),
        field,
        message,
    })?;
    let geometry = given.clone().or(Geometry::beside(path)?);
    let name = lower_name(path);
    if path.is_dir() {
        pictures::read_folder(path, &geometry)
    } else if name.ends_with(".nii") || name.ends_with(".nii.gz") {
        nifti::read_volume(path, &geometry)
    } else if name.ends_with(".dcm") || structure::begins_as_dicom(path) {
        pictures::read_multi_frame(path, &geometry)
    } else {
        Err(StackError::Kind { file: path.into() })
    }
}

fn lower_name(path: &Path) -> String {
    path.file_name()
        .map(|name| name.to_string_lossy().to_lowercase())
        .unwrap_or_default()
}

/// Names the file in an error of its image.
fn of_file(file: &Path) -> impl Fn(crate::ImageError) -> StackError {
    let file = PathBuf::from(file);
    move |error| StackError::Image {
        file: file.clone(),
        error,
    }
}

/// Refuses a stated depth that rows of `extent_mm` together do not have.
fn check_depth(file: &Path, depth_mm: Option<f64>, extent_mm: f64) -> Result<(), StackError> {
    /// Scanners state whole millimetres or centimetres, and a row more or less may be counted.
    const TOLERANCE: f64 = 0.02;
    match depth_mm {
        Some(depth) if (depth / extent_mm - 1.0).abs() > TOLERANCE => Err(StackError::Contradiction {
            file: file.into(),
            field: "depth",
            one: format!("is {depth} mm"),
            other: format!("the rows span {extent_mm:.1} mm at the spacing told"),
        }),
        _ => Ok(()),
    }
}
