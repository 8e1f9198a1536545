//! Reading a folder of annotated volumes: volumes in `images` and masks of the same names in `labels` (NIfTI, channel 0,
//! axes as DeepReg has them), spacing of the voxels in mm.

use std::path::Path;

use resecta_anatomy::import::Axes;
use resecta_annotate::{Geometry, Heights, TrainingCase, TrainingFolderError, read_training_cases};

pub fn cases(folder: &Path, spacing: f64) -> Result<Vec<TrainingCase>, TrainingFolderError> {
    let geometry = Geometry {
        spacing: Some([spacing; 2]),
        z: Some(Heights::Even {
            first: 0.0,
            distance: spacing,
        }),
        axes: Some(Axes::PLS),
        ..Geometry::default()
    };
    read_training_cases(folder, &geometry, &[])
}
