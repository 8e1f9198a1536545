//! Segmentation masks: the outline of a gland in a NIfTI volume, slice by slice.

use std::io::{self, BufReader, Read};
use std::path::Path;
use std::str::FromStr;

use flate2::bufread::MultiGzDecoder;
use glam::{DVec2, DVec3};
use nifti::{InMemNiftiVolume, IntoNdArray, NiftiHeader};

use super::outline::{Field, largest_outline};
use super::{ImportError, read, stem};
use crate::complete::{UrethraEnds, round};
use crate::{Case, CaseSource, Landmarks, Slice, Unit, case, contour};

/// Most voxels along one axis of a volume.
pub const MAX_VOXELS_PER_AXIS: u16 = 1024;
/// Most voxels of a volume, all channels together.
pub const MAX_VOXELS: u64 = 1 << 25;
/// Most bytes that are read of a file: that many voxels of the widest type.
pub const MAX_MASK_BYTES: u64 = 8 * MAX_VOXELS;
/// Outlines of fewer voxels than this are dropped at both ends of the gland.
const LEAST_AREA_VOXELS: f64 = 4.0;
/// Spacings that can be those of a prostate, mm.
const SPACING_MM: std::ops::RangeInclusive<f64> = 0.01..=50.0;
/// A header takes 348 bytes, and four more say whether extensions follow.
const HEADER_BYTES: u64 = 348;

const SMALL_RULE: &str = "dropped: at the end of the gland, with an outline of fewer than 4 voxels";

/// Which way the three axes of a volume run, as a code of three letters: one of R, L (right, left), one of A, P (anterior,
/// posterior), one of I, S (inferior, superior: apex, base), each naming the side towards which its axis rises.
///
/// The default, `PLS`, is that of the DeepReg ultrasound labels: anterior to posterior, right to left, apex to base.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Axes {
    /// For x (left), y (posterior), z (superior): the volume's axis, and whether it runs the other way.
    source: [(usize, bool); 3],
}

impl Axes {
    /// Anterior to posterior, right to left, apex to base.
    pub const PLS: Axes = Axes {
        source: [(1, false), (0, false), (2, false)],
    };
}

impl Default for Axes {
    fn default() -> Self {
        Self::PLS
    }
}

/// A code that names no three axes.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("axes: {code:?} is no axis code, expected three letters, one each of R/L, A/P and I/S, such as PLS")]
pub struct AxesError {
    /// The code.
    pub code: String,
}

impl FromStr for Axes {
    type Err = AxesError;

    fn from_str(code: &str) -> Result<Self, AxesError> {
        let mut source = [None; 3];
        for (axis, letter) in code.chars().enumerate() {
            let (world, reversed) = match letter.to_ascii_uppercase() {
                'L' => (0, false),
                'R' => (0, true),
                'P' => (1, false),
                'A' => (1, true),
                'S' => (2, false),
                'I' => (2, true),
                _ => return Err(AxesError { code: code.into() }),
            };
            if axis > 2 || source[world].replace((axis, reversed)).is_some() {
                return Err(AxesError { code: code.into() });
            }
        }
        match source {
            [Some(x), Some(y), Some(z)] => Ok(Self { source: [x, y, z] }),
            _ => Err(AxesError { code: code.into() }),
        }
    }
}

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
/// Every [`ImportError`] but [`ImportError::Syntax`]. Before any memory is taken the header must state 3 to 7 dimensions, at
/// most [`MAX_VOXELS_PER_AXIS`] voxels an axis and [`MAX_VOXELS`] in all, a plain number type and usable spacings.
pub fn nifti_mask(path: &Path, options: &MaskOptions) -> Result<Case, ImportError> {
    nifti_mask_bytes(&read(path, MAX_MASK_BYTES)?, path, options)
}

/// As [`nifti_mask`], from the bytes of a file; `file` is named in errors.
///
/// # Errors
///
/// As [`nifti_mask`].
pub fn nifti_mask_bytes(bytes: &[u8], file: &Path, options: &MaskOptions) -> Result<Case, ImportError> {
    // The two bytes that every gzip stream begins with.
    let volume = if bytes.starts_with(&[0x1f, 0x8b]) {
        Volume::read(BufReader::new(MultiGzDecoder::new(bytes)), file, options)?
    } else {
        Volume::read(bytes, file, options)?
    };
    let mut ends = UrethraEnds::default();
    if let Some([apex, base]) = options.endpoint_channels {
        ends = UrethraEnds {
            apex: volume.blob_centre(apex, file)?,
            base: volume.blob_centre(base, file)?,
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
        material: case::default_material(),
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
fn outlines(volume: &Volume, file: &Path, channel: usize) -> Result<(Vec<Slice>, Vec<f64>), ImportError> {
    let scale = DVec2::new(volume.spacing[0], volume.spacing[1]);
    let [_, _, levels] = volume.size;
    let mut found = Vec::with_capacity(levels);
    for level in 0..levels {
        let outline = largest_outline(&volume.field(channel, level, file)?);
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
    let height = |level: usize| (level as f64 * volume.spacing[2] * 1000.0).round() / 1000.0;
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

/// A volume turned so that x runs to the patient's left, y backwards and z towards the bladder.
struct Volume {
    /// Voxels along x, y, z.
    size: [usize; 3],
    /// Spacing along x, y, z, mm.
    spacing: [f64; 3],
    /// Distance in `voxels` between neighbours along x, y, z, and the voxel that has the lowest x, y and z.
    stride: [isize; 3],
    origin: isize,
    channels: usize,
    /// All channels as they lie in the file: first axis fastest, channels one after the other.
    voxels: Vec<f32>,
}

impl Volume {
    fn read(mut source: impl Read, file: &Path, options: &MaskOptions) -> Result<Volume, ImportError> {
        let bad = |field, value: String, expected: String| ImportError::Field {
            file: file.into(),
            field,
            value,
            expected,
        };
        let damaged = |message: String| ImportError::Nifti {
            file: file.into(),
            message,
        };
        let header = NiftiHeader::from_reader(&mut source).map_err(|error| damaged(error.to_string()))?;
        let dimensions = header.dim().map_err(|error| damaged(error.to_string()))?;
        if dimensions.len() < 3 || dimensions[..3].iter().any(|&count| count > MAX_VOXELS_PER_AXIS) {
            return Err(bad(
                "dim",
                format!("{dimensions:?}"),
                format!("at least three axes of at most {MAX_VOXELS_PER_AXIS} voxels"),
            ));
        }
        let bytes_per_voxel: u64 = match header.datatype {
            2 | 256 => 1,
            4 | 512 => 2,
            8 | 16 | 768 => 4,
            64 | 1024 | 1280 => 8,
            other => {
                return Err(bad(
                    "datatype",
                    other.to_string(),
                    "a plain integer or floating point type".into(),
                ));
            }
        };
        if i64::from(header.bitpix) != 8 * bytes_per_voxel as i64 {
            return Err(bad(
                "bitpix",
                header.bitpix.to_string(),
                format!("{} as for datatype {}", 8 * bytes_per_voxel, header.datatype),
            ));
        }
        let count = dimensions
            .iter()
            .try_fold(1_u64, |product, &count| product.checked_mul(count.into()));
        if count.is_none_or(|count| count > MAX_VOXELS) {
            return Err(bad(
                "dim",
                format!("{dimensions:?}"),
                format!("at most {MAX_VOXELS} voxels"),
            ));
        }
        let size: [usize; 3] = std::array::from_fn(|axis| usize::from(dimensions[axis]));
        let channels = dimensions[3..].iter().map(|&count| usize::from(count)).product();
        let spacing = spacing_mm(&header, options, &bad)?;
        skip_to_voxels(&mut source, &header, &bad)?.map_err(|source| ImportError::Read {
            file: file.into(),
            source,
        })?;
        let voxels = InMemNiftiVolume::from_reader(source, &header)
            .and_then(|volume| volume.into_ndarray::<f32>())
            .map_err(|error| damaged(error.to_string()))?;
        // Column-major as read, so this is the order of the file.
        let (voxels, _) = voxels.into_raw_vec_and_offset();
        if voxels.len() != size.iter().product::<usize>() * channels {
            return Err(damaged("the voxels do not fill the dimensions".into()));
        }
        let strides = [1, size[0], size[0] * size[1]];
        let mut origin = 0;
        let stride = options.axes.source.map(|(axis, reversed)| {
            let stride = strides[axis] as isize;
            if reversed {
                origin += stride * (size[axis] as isize - 1);
                -stride
            } else {
                stride
            }
        });
        Ok(Volume {
            size: options.axes.source.map(|(axis, _)| size[axis]),
            spacing: options.axes.source.map(|(axis, _)| spacing[axis]),
            stride,
            origin,
            channels,
            voxels,
        })
    }

    /// One channel of one slice; values are held within 0..=1, so that labels beside 1 have the same outline.
    fn field(&self, channel: usize, level: usize, file: &Path) -> Result<Field, ImportError> {
        let bad = |field, value: String, expected: String| ImportError::Field {
            file: file.into(),
            field,
            value,
            expected,
        };
        if channel >= self.channels {
            return Err(bad(
                "channel",
                channel.to_string(),
                format!("one of the {} in the file, from 0", self.channels),
            ));
        }
        let [width, height, _] = self.size;
        let channel_start = (channel * self.voxels.len() / self.channels) as isize;
        let start = channel_start + self.origin + level as isize * self.stride[2];
        let mut values = Vec::with_capacity(width * height);
        for y in 0..height as isize {
            for x in 0..width as isize {
                let value = self.voxels[(start + y * self.stride[1] + x * self.stride[0]) as usize];
                if !value.is_finite() {
                    return Err(bad("voxels", value.to_string(), "finite values".into()));
                }
                values.push(value.clamp(0.0, 1.0));
            }
        }
        Ok(Field { width, height, values })
    }

    /// Mean place of the voxels of a channel, mm; `None` where there are none.
    fn blob_centre(&self, channel: usize, file: &Path) -> Result<Option<DVec3>, ImportError> {
        if channel >= self.channels {
            return Ok(None);
        }
        let (mut sum, mut count) = (DVec3::ZERO, 0.0);
        for level in 0..self.size[2] {
            let field = self.field(channel, level, file)?;
            for (voxel, _) in field.values.iter().enumerate().filter(|&(_, &value)| value >= 0.5) {
                sum += DVec3::new((voxel % field.width) as f64, (voxel / field.width) as f64, level as f64);
                count += 1.0;
            }
        }
        Ok((count > 0.0).then(|| sum / count * DVec3::from_array(self.spacing)))
    }
}

type Bad<'a> = &'a dyn Fn(&'static str, String, String) -> ImportError;

fn spacing_mm(header: &NiftiHeader, options: &MaskOptions, bad: Bad) -> Result<[f64; 3], ImportError> {
    let usable = |spacing: &[f64; 3]| spacing.iter().all(|step| SPACING_MM.contains(step));
    let expected = || format!("{} to {} mm along each axis", SPACING_MM.start(), SPACING_MM.end());
    if let Some(spacing) = options.spacing_mm {
        return if usable(&spacing) {
            Ok(spacing)
        } else {
            Err(bad("spacing", format!("{spacing:?}"), expected()))
        };
    }
    // Lowest three bits of the unit field: unknown (taken as mm), m, mm, µm.
    let unit_mm = match header.xyzt_units & 7 {
        0 | 2 => 1.0,
        1 => 1000.0,
        3 => 0.001,
        other => {
            return Err(bad(
                "xyzt_units",
                other.to_string(),
                "metre, millimetre or micrometre".into(),
            ));
        }
    };
    let spacing = [1, 2, 3].map(|axis| f64::from(header.pixdim[axis]) * unit_mm);
    if usable(&spacing) {
        Ok(spacing)
    } else {
        Err(bad("pixdim", format!("{spacing:?}"), expected()))
    }
}

/// Passes over header extensions. The outer result is a header that makes no sense, the inner one a stream that ends.
fn skip_to_voxels(source: &mut impl Read, header: &NiftiHeader, bad: Bad) -> Result<io::Result<()>, ImportError> {
    let start = f64::from(header.vox_offset);
    if !(start >= HEADER_BYTES as f64 && start <= MAX_MASK_BYTES as f64) {
        return Err(bad(
            "vox_offset",
            start.to_string(),
            format!("{HEADER_BYTES} to {MAX_MASK_BYTES}; a header with its voxels in a second file is not read"),
        ));
    }
    let gap = start as u64 - HEADER_BYTES;
    Ok(io::copy(&mut source.take(gap), &mut io::sink()).and_then(|copied| {
        if copied == gap {
            Ok(())
        } else {
            Err(io::ErrorKind::UnexpectedEof.into())
        }
    }))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_default_axes_are_those_of_their_code() {
        assert_eq!("PLS".parse(), Ok(Axes::default()));
        assert_eq!("pls".parse(), Ok(Axes::default()));
    }

    #[test]
    fn a_code_names_each_direction_once() {
        for code in ["", "PL", "PLSS", "PLA", "XYZ", "LLS", "ß"] {
            let error = code.parse::<Axes>().unwrap_err();
            assert!(error.to_string().contains("R/L"), "{error}");
        }
    }
}
