//! Segmentation masks: the outline of a gland in a NIfTI volume, slice by slice.

use std::path::Path;

use glam::{DVec2, DVec3};

use super::outline::{Field, largest_outline};
use super::{Axes, ImportError, MAX_VOLUME_BYTES, NiftiVolume, read, stem};
use crate::complete::{UrethraEnds, round};
use crate::{Case, CaseSource, Landmarks, Slice, Unit, contour};

/// Outlines of fewer voxels than this are dropped at both ends of the gland.
const LEAST_AREA_VOXELS: f64 = 4.0;

const SMALL_RULE: &str = "dropped: at the end of the gland, with an outline of fewer than 4 voxels";

/// How to read a mask.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct MaskOptions {
    /// Voxel spacing along the volume's own axes, mm, 0.01 to 50 each; the header's where absent. Headers lie.
    pub spacing_mm: Option<[f64; 3]>,
    /// Which channel of a volume of four or more dimensions holds the gland; 0 for one of three.
    pub channel: usize,
    /// Which channels mark, by a blob each, where the urethra leaves the apex and where it enters the base. A channel that
    /// the file lacks or that is empty marks nothing.
    pub endpoint_channels: Option<[usize; 2]>,
    /// Which way the axes run.
    pub axes: Axes,
}

/// Makes a case from a mask (`.nii`, or compressed, whatever its name).
///
/// A voxel belongs to the gland from one half up. Each slice gives the outline of its largest part at the level one half,
/// between voxels by linear interpolation, in mm from the centre of the first voxel. Slices at the ends with fewer than four
/// voxels are dropped and listed in [`Case::approximated`], as is what [`Case::complete`] fills in.
///
/// # Errors
///
/// Every [`ImportError`] but [`ImportError::Syntax`]; limits as [`NiftiVolume::load`] states them.
pub fn nifti_mask(path: &Path, options: &MaskOptions) -> Result<Case, ImportError> {
    nifti_mask_bytes(&read(path, MAX_VOLUME_BYTES)?, path, options)
}

/// As [`nifti_mask`], from the bytes of a file; `file` is named in errors.
///
/// # Errors
///
/// As [`nifti_mask`].
pub fn nifti_mask_bytes(bytes: &[u8], file: &Path, options: &MaskOptions) -> Result<Case, ImportError> {
    let volume = NiftiVolume::from_bytes(bytes, file, options.axes, options.spacing_mm)?;
    let mut ends = UrethraEnds::default();
    if let Some([apex, base]) = options.endpoint_channels {
        ends = UrethraEnds {
            apex: blob_centre(&volume, apex, file)?,
            base: blob_centre(&volume, base, file)?,
        };
    }
    let (slices, dropped) = outlines(&volume, file, options.channel)?;
    let mut case = Case {
        name: stem(file),
        source: CaseSource {
            description: format!(
                "outline of the mask {}, channel {}",
                file.file_name().unwrap_or_default().to_string_lossy(),
                options.channel
            ),
            licence: "unknown".into(),
        },
        unit: Unit::Millimetre,
        material: Case::DEFAULT_MATERIAL.into(),
        landmarks: Landmarks::default(),
        approximated: Vec::new(),
        slices,
    };
    for z in dropped {
        case.note(format!("slice at z = {z} mm"), SMALL_RULE);
    }
    case.complete_with(ends).map_err(|rule| ImportError::Rule {
        file: file.into(),
        rule,
    })
}

/// The gland's slices, and the heights of those dropped.
fn outlines(volume: &NiftiVolume, file: &Path, channel: usize) -> Result<(Vec<Slice>, Vec<f64>), ImportError> {
    let spacing = volume.spacing_mm();
    let scale = DVec2::new(spacing[0], spacing[1]);
    let [_, _, levels] = volume.size();
    let mut found = Vec::with_capacity(levels);
    for level in 0..levels {
        let outline = largest_outline(&field(volume, channel, level, file)?);
        found.push((contour::signed_area(&outline), outline));
    }
    let large = |&(area, _): &(f64, Vec<DVec2>)| area >= LEAST_AREA_VOXELS;
    let widest = (0..levels)
        .max_by(|&a, &b| found[a].0.total_cmp(&found[b].0))
        .unwrap_or(0);
    let first = (0..widest)
        .rev()
        .take_while(|&level| large(&found[level]))
        .last()
        .unwrap_or(widest);
    let last = (widest..levels)
        .take_while(|&level| large(&found[level]))
        .last()
        .unwrap_or(widest);
    if !large(&found[widest]) || last - first < 2 {
        return Err(ImportError::Empty {
            file: file.into(),
            channel,
        });
    }
    let height = |level: usize| (level as f64 * spacing[2] * 1000.0).round() / 1000.0;
    let dropped = (0..levels)
        .filter(|&level| (level < first || level > last) && found[level].0 > 0.0)
        .map(height)
        .collect();
    let slices = (first..=last)
        .map(|level| Slice {
            z: height(level),
            capsule: found[level].1.iter().map(|&corner| round(corner * scale)).collect(),
            urethra: None,
            transition_zone: None,
        })
        .collect();
    Ok((slices, dropped))
}

/// One channel of one slice; values are held within 0..=1, so that labels beside 1 have the same outline.
fn field(volume: &NiftiVolume, channel: usize, level: usize, file: &Path) -> Result<Field, ImportError> {
    let [width, height, _] = volume.size();
    let mut values = volume.slice(channel, level, file)?;
    for value in &mut values {
        *value = value.clamp(0.0, 1.0);
    }
    Ok(Field { width, height, values })
}

/// Mean place of the voxels of a channel, mm; `None` where there are none.
fn blob_centre(volume: &NiftiVolume, channel: usize, file: &Path) -> Result<Option<DVec3>, ImportError> {
    if channel >= volume.channels() {
        return Ok(None);
    }
    let (mut sum, mut count) = (DVec3::ZERO, 0.0);
    for level in 0..volume.size()[2] {
        let field = field(volume, channel, level, file)?;
        for (voxel, _) in field.values.iter().enumerate().filter(|&(_, &value)| value >= 0.5) {
            sum += DVec3::new((voxel % field.width) as f64, (voxel / field.width) as f64, level as f64);
            count += 1.0;
        }
    }
    Ok((count > 0.0).then(|| sum / count * DVec3::from_array(volume.spacing_mm())))
}
