//! Reading a folder of annotated volumes: volumes in `images` and masks of the same names in `labels` (NIfTI, channel 0,
//! axes as DeepReg has them), spacing of the voxels in mm.

use std::path::Path;

use resecta_anatomy::import::{Axes, MaskOptions, nifti_mask};
use resecta_annotate::{Geometry, Heights, TrainingCase, read_stack};

pub fn cases(folder: &Path, spacing: f64) -> Result<Vec<TrainingCase>, Box<dyn std::error::Error>> {
    let mut names: Vec<_> = std::fs::read_dir(folder.join("images"))?
        .map(|entry| entry.map(|entry| entry.file_name()))
        .collect::<Result<_, _>>()?;
    names.sort();
    let mut cases = Vec::new();
    for name in names {
        let geometry = Geometry {
            spacing: Some([spacing; 2]),
            z: Some(Heights::Even {
                first: 0.0,
                distance: spacing,
            }),
            axes: Some(Axes::PLS),
            ..Geometry::default()
        };
        let stack = read_stack(&folder.join("images").join(&name), &geometry)?;
        let mask = MaskOptions {
            spacing_mm: Some([spacing; 3]),
            ..MaskOptions::default()
        };
        let case = nifti_mask(&folder.join("labels").join(&name), &mask)?;
        let outlines = case.slices.into_iter().map(|slice| (slice.z, slice.capsule)).collect();
        cases.push(TrainingCase {
            name: case.name,
            stack,
            outlines,
        });
    }
    Ok(cases)
}
