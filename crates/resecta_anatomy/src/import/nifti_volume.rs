//! NIfTI volumes: voxels read within stated limits and turned into the axes of a case.

use std::io::{self, BufReader, Read};
use std::path::Path;

use flate2::bufread::MultiGzDecoder;
use nifti::{InMemNiftiVolume, IntoNdArray, NiftiHeader};

use super::{Axes, ImportError, Turn, read};

/// Most voxels along one axis of a volume.
pub const MAX_VOXELS_PER_AXIS: u16 = 1024;
/// Most voxels of a volume, all channels together.
pub const MAX_VOXELS: u64 = 1 << 25;
/// Most bytes that are read of a file: that many voxels of the widest type.
pub const MAX_VOLUME_BYTES: u64 = 8 * MAX_VOXELS;
/// Spacings that can be those of a prostate, mm.
const SPACING_MM: std::ops::RangeInclusive<f64> = 0.01..=50.0;
/// A header takes 348 bytes, and four more say whether extensions follow.
const HEADER_BYTES: u64 = 348;

/// A volume turned so that x runs to the patient's left, y backwards and z towards the bladder.
#[derive(Debug, Clone, PartialEq)]
pub struct NiftiVolume {
    turn: Turn,
    /// Along x, y, z, mm: what is used, and what the header says.
    spacing: [f64; 3],
    stated_spacing: [f64; 3],
    channels: usize,
    has_bytes: bool,
    /// All channels as they lie in the file: first axis fastest, channels one after the other.
    voxels: Vec<f32>,
}

impl NiftiVolume {
    /// Reads a volume (`.nii`, or compressed, whatever its name).
    ///
    /// `spacing_mm`, along the volume's own axes, 0.01 to 50 mm each, stands in for the header's.
    ///
    /// # Errors
    ///
    /// [`ImportError::Read`], [`ImportError::TooLarge`], [`ImportError::Nifti`] or [`ImportError::Field`]. Before any memory
    /// is taken the header must state 3 to 7 dimensions, at most [`MAX_VOXELS_PER_AXIS`] voxels an axis and [`MAX_VOXELS`] in
    /// all, a plain number type and, where none are given, usable spacings.
    pub fn load(path: &Path, axes: Axes, spacing_mm: Option<[f64; 3]>) -> Result<NiftiVolume, ImportError> {
        NiftiVolume::from_bytes(&read(path, MAX_VOLUME_BYTES)?, path, axes, spacing_mm)
    }

    /// As [`NiftiVolume::load`], from the bytes of a file; `file` is named in errors.
    ///
    /// # Errors
    ///
    /// As [`NiftiVolume::load`].
    pub fn from_bytes(
        bytes: &[u8],
        file: &Path,
        axes: Axes,
        spacing_mm: Option<[f64; 3]>,
    ) -> Result<NiftiVolume, ImportError> {
        // The two bytes that every gzip stream begins with.
        if bytes.starts_with(&[0x1f, 0x8b]) {
            NiftiVolume::read(BufReader::new(MultiGzDecoder::new(bytes)), file, axes, spacing_mm)
        } else {
            NiftiVolume::read(bytes, file, axes, spacing_mm)
        }
    }

    fn read(
        mut source: impl Read,
        file: &Path,
        axes: Axes,
        given_mm: Option<[f64; 3]>,
    ) -> Result<NiftiVolume, ImportError> {
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
        let spacing = spacing_mm(&header, given_mm, &bad)?;
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
        let stated_spacing = [1, 2, 3].map(|axis| f64::from(header.pixdim[axis]));
        Ok(NiftiVolume {
            turn: Turn::new(axes, size),
            spacing: axes.turned(spacing),
            stated_spacing: axes.turned(stated_spacing),
            channels,
            has_bytes: header.datatype == 2,
            voxels,
        })
    }

    /// Voxels along x, y, z.
    pub fn size(&self) -> [usize; 3] {
        self.turn.size
    }

    /// Spacing along x, y, z, mm.
    pub fn spacing_mm(&self) -> [f64; 3] {
        self.spacing
    }

    /// Spacing along x, y, z as the header has it, in its unit and unchecked; differs from [`NiftiVolume::spacing_mm`] where
    /// that was given.
    pub fn stated_spacing(&self) -> [f64; 3] {
        self.stated_spacing
    }

    /// Volumes in one: the product of all dimensions from the fourth on.
    pub fn channels(&self) -> usize {
        self.channels
    }

    /// Whether the file holds bytes, 0 to 255.
    pub fn has_bytes(&self) -> bool {
        self.has_bytes
    }

    /// One channel of one slice across z, x fastest.
    ///
    /// # Errors
    ///
    /// [`ImportError::Field`] for a channel or a slice that is not in the file, and for voxels that are no numbers.
    pub fn slice(&self, channel: usize, level: usize, file: &Path) -> Result<Vec<f32>, ImportError> {
        let bad = |field, value: String, expected: String| ImportError::Field {
            file: file.into(),
            field,
            value,
            expected,
        };
        for (field, index, count) in [("channel", channel, self.channels), ("slice", level, self.size()[2])] {
            if index >= count {
                let expected = format!("one of the {count} in the file, from 0");
                return Err(bad(field, index.to_string(), expected));
            }
        }
        let start = channel * (self.voxels.len() / self.channels);
        let values: Vec<f32> = self.turn.slice(level).map(|voxel| self.voxels[start + voxel]).collect();
        match values.iter().find(|value| !value.is_finite()) {
            Some(value) => Err(bad("voxels", value.to_string(), "finite values".into())),
            None => Ok(values),
        }
    }
}

type Bad<'a> = &'a dyn Fn(&'static str, String, String) -> ImportError;

fn spacing_mm(header: &NiftiHeader, given_mm: Option<[f64; 3]>, bad: Bad) -> Result<[f64; 3], ImportError> {
    let usable = |spacing: &[f64; 3]| spacing.iter().all(|step| SPACING_MM.contains(step));
    let expected = || format!("{} to {} mm along each axis", SPACING_MM.start(), SPACING_MM.end());
    if let Some(spacing) = given_mm {
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
    if !(start >= HEADER_BYTES as f64 && start <= MAX_VOLUME_BYTES as f64) {
        return Err(bad(
            "vox_offset",
            start.to_string(),
            format!("{HEADER_BYTES} to {MAX_VOLUME_BYTES}; a header with its voxels in a second file is not read"),
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
