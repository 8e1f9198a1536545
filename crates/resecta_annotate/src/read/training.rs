//! A folder to learn from: images and what someone drew on them.

use std::fs;
use std::path::{Path, PathBuf};

use resecta_anatomy::import::{ImportError, MaskOptions, import};
use resecta_anatomy::{Case, CaseError};

use super::{Geometry, Heights, SIDECAR, StackError, lower_name, read_stack};
use crate::{Stack, TrainingCase};

/// Where the images of a folder to learn from lie, each a stack as [`read_stack`] reads it.
const IMAGES: &str = "images";
/// Where the outlines lie.
const LABELS: &str = "labels";

/// Why a folder gave no cases to learn from. Every text names the file.
#[derive(Debug, thiserror::Error)]
pub enum TrainingFolderError {
    /// It has no folder of images or none of labels, or one that cannot be read.
    #[error("{}: cannot be read: {source}; expected a folder with {IMAGES}/ and {LABELS}/", folder.display())]
    Folder {
        /// The folder.
        folder: PathBuf,
        /// Why.
        source: std::io::Error,
    },
    /// A stack without outlines, outlines without a stack, or two of either.
    #[error("{}: there are {found} of this name in {}, expected one", file.display(), folder.display())]
    Unpaired {
        /// The stack or the outlines.
        file: PathBuf,
        /// Where the other was looked for.
        folder: PathBuf,
        /// How many were found.
        found: usize,
    },
    /// The images cannot be read.
    #[error(transparent)]
    Stack(#[from] StackError),
    /// The mask or the contours cannot be read.
    #[error(transparent)]
    Import(#[from] ImportError),
    /// The case cannot be read.
    #[error(transparent)]
    Case(#[from] CaseError),
}

/// Reads cases to learn from: stacks in `folder/images` and outlines of the same names in `folder/labels`, as masks
/// (`.nii`, `.nii.gz`, in the voxels of the images), contours (`.json`) or cases (`.case.ron`). Names count up to the first
/// dot; those in `without` are left out. `given` says of all what their sidecars do not.
///
/// # Errors
///
/// Any [`TrainingFolderError`].
pub fn read_training_cases(
    folder: &Path,
    given: &Geometry,
    without: &[String],
) -> Result<Vec<TrainingCase>, TrainingFolderError> {
    let (images, labels) = (folder.join(IMAGES), folder.join(LABELS));
    let stacks = entries(&images, &[SIDECAR, ".md", ".txt"])?;
    let outlines = entries(&labels, &[".md", ".txt"])?;
    let named = |all: &[(String, PathBuf)], name: &str| all.iter().filter(|(other, _)| other == name).count();
    let pair = |file: &Path, folder: &Path, found: usize| match found {
        1 => Ok(()),
        _ => Err(TrainingFolderError::Unpaired {
            file: file.into(),
            folder: folder.into(),
            found,
        }),
    };
    for (name, file) in &outlines {
        pair(file, &images, named(&stacks, name))?;
    }
    let mut cases = Vec::new();
    for (name, file) in stacks {
        pair(&file, &labels, named(&outlines, &name))?;
        if without.contains(&name) {
            continue;
        }
        let Some((_, drawn)) = outlines.iter().find(|(other, _)| *other == name) else {
            continue;
        };
        let geometry = given.clone().or(Geometry::beside(&file)?);
        let stack = read_stack(&file, &geometry)?;
        cases.push(TrainingCase {
            outlines: read_outlines(drawn, &geometry, &stack)?,
            stack,
            name,
        });
    }
    Ok(cases)
}

/// Names up to the first dot and paths of what a folder holds, by name; hidden files and those with these endings left out.
fn entries(folder: &Path, left_out: &[&str]) -> Result<Vec<(String, PathBuf)>, TrainingFolderError> {
    let failed = |source| TrainingFolderError::Folder {
        folder: folder.into(),
        source,
    };
    let mut found = Vec::new();
    for entry in fs::read_dir(folder).map_err(failed)? {
        let path = entry.map_err(failed)?.path();
        let file = lower_name(&path);
        if file.starts_with('.') || left_out.iter().any(|ending| file.ends_with(ending)) {
            continue;
        }
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        found.push((name.split('.').next().unwrap_or_default().to_owned(), path));
    }
    found.sort();
    Ok(found)
}

/// Outlines of the capsule by rising height. Where the images' header is not believed, a mask's is not either, and the mask
/// has the voxels of the images.
fn read_outlines(
    file: &Path,
    geometry: &Geometry,
    stack: &Stack,
) -> Result<Vec<(f64, Vec<glam::DVec2>)>, TrainingFolderError> {
    let told = matches!(geometry.z, Some(Heights::Even { .. })) || geometry.spacing.is_some();
    let axes = geometry.axes.unwrap_or_default();
    let mask = MaskOptions {
        spacing_mm: told.then(|| axes.own(voxel_mm(stack))),
        axes,
        ..MaskOptions::default()
    };
    let lift = match geometry.z {
        Some(Heights::Even { first, .. }) => first,
        _ => 0.0,
    };
    let name = lower_name(file);
    let (case, lift) = if name.ends_with(".ron") {
        (Case::load(file)?, 0.0)
    } else {
        (import(file, &mask)?, if name.ends_with(".json") { 0.0 } else { lift })
    };
    Ok(case
        .slices
        .into_iter()
        .map(|slice| (slice.z + lift, slice.capsule))
        .collect())
}

/// Distances between pixels and between images, mm.
fn voxel_mm(stack: &Stack) -> [f64; 3] {
    let [x, y] = stack.slices()[0].image.spacing_mm();
    [x, y, stack.mean_distance_mm()]
}
