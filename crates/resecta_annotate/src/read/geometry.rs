//! What a sidecar or a caller says of the geometry of images: all that the files themselves do not say, or say wrongly.

use std::path::{Path, PathBuf};

use resecta_anatomy::Unit;
use resecta_anatomy::import::{self, Axes};
use resecta_text::place_of;
use serde::Deserialize;

use super::StackError;
use crate::image::PIXEL_SPACING_MM;

/// Name of the sidecar in a folder of pictures, and ending of the one beside a file (`gland.nii.gz`: `gland.stack.ron`).
pub const SIDECAR: &str = "stack.ron";
/// Largest sidecar that is read, bytes.
const MAX_SIDECAR_BYTES: u64 = 1 << 20;

/// Geometry of a stack of images, as a sidecar has it in RON. What is absent is taken from the image files.
///
/// ```
/// # let text = r#"
/// (
///     unit: mm,
///     spacing: (0.3, 0.3),
///     z: Even(first: 0.0, distance: 5.0),
///     axes: "LPS",
///     depth: 144.0,
/// )
/// # "#;
/// # resecta_text::read::<resecta_annotate::Geometry>(text).unwrap();
/// ```
#[derive(Debug, Clone, PartialEq, Default, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Geometry {
    /// Unit of every length.
    pub unit: Unit,
    /// Distance between pixels from right to left and from anterior to posterior, [`PIXEL_SPACING_MM`]. Stands in for that
    /// of the files, which is noted in [`Stack::notes`](crate::Stack::notes).
    pub spacing: Option<[f64; 2]>,
    /// Where the images lie along the axis.
    pub z: Option<Heights>,
    /// Which way columns, rows and the order of images run, or a volume's three axes, as a code of three letters
    /// ([`Axes`]). Without it pictures are taken as `LPS`; a volume must be told.
    pub axes: Option<Axes>,
    /// Anterior-posterior extent of what is seen (of the window, if there is one), mm, as scanners state it. Gives the
    /// spacing where none is known; where one is, both must agree to 2 %.
    pub depth: Option<f64>,
    /// The part of each picture that shows the patient, where the rest is a scanner's screen.
    pub window: Option<Window>,
}

/// Heights of the images of a stack.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub enum Heights {
    /// At even distances: pictures in the order of their names, in which numbers count by value (`f2` before `f10`).
    Even {
        /// Height of the lowest image, mm.
        #[serde(default)]
        first: f64,
        /// Distance between images, mm, above 0.
        distance: f64,
    },
    /// Name and height in mm of each picture of a folder; those not named are left out.
    Files(Vec<(String, f64)>),
}

/// A part of a picture, pixels of the file from its upper left corner.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Window {
    /// First column.
    pub left: usize,
    /// First row.
    pub top: usize,
    /// Columns.
    pub width: usize,
    /// Rows.
    pub height: usize,
}

/// Farthest image from the origin and deepest image, mm.
const MAX_LENGTH_MM: f64 = resecta_anatomy::MAX_COORDINATE_MM;

impl Geometry {
    /// The sidecar of a folder or of a file, or nothing said where there is none.
    ///
    /// # Errors
    ///
    /// [`StackError::File`], [`StackError::Syntax`] or [`StackError::Geometry`], which name the sidecar and the field.
    pub fn beside(path: &Path) -> Result<Geometry, StackError> {
        let sidecar = sidecar_of(path);
        if !sidecar.is_file() {
            return Ok(Geometry::default());
        }
        let bytes = import::read(&sidecar, MAX_SIDECAR_BYTES)?;
        Geometry::from_ron(&String::from_utf8_lossy(&bytes), &sidecar)
    }

    /// Parses and checks a sidecar; `file` is named in errors.
    ///
    /// # Errors
    ///
    /// [`StackError::Syntax`] or [`StackError::Geometry`].
    pub fn from_ron(text: &str, file: &Path) -> Result<Geometry, StackError> {
        let geometry: Geometry = resecta_text::read(text).map_err(|slip| StackError::Syntax {
            file: file.into(),
            slip: slip.into(),
        })?;
        geometry.check().map_err(|(field, message)| StackError::Geometry {
            place: format!(
                "{}:{}",
                file.display(),
                place_of(text, &field)
                    .or_else(|| place_of(text, "."))
                    .unwrap_or_default()
            ),
            field,
            message,
        })?;
        Ok(geometry)
    }

    /// What the caller says, and where it says nothing, what the sidecar says.
    pub(super) fn or(self, sidecar: Geometry) -> Geometry {
        Geometry {
            unit: self.unit,
            spacing: self.spacing.or(sidecar.spacing),
            z: self.z.or(sidecar.z),
            axes: self.axes.or(sidecar.axes),
            depth: self.depth.or(sidecar.depth),
            window: self.window.or(sidecar.window),
        }
    }

    /// The first field with a value that cannot be, and what was expected of it.
    pub(super) fn check(&self) -> Result<(), (String, String)> {
        let length = |field: String, value: f64, least: f64, most: f64| {
            if (least..=most).contains(&value) {
                Ok(())
            } else {
                Err((field, format!("is {value}, expected {least} to {most} mm")))
            }
        };
        let (least, most) = (*PIXEL_SPACING_MM.start(), *PIXEL_SPACING_MM.end());
        for (axis, &step) in self.spacing.iter().flatten().enumerate() {
            length(format!("spacing[{axis}]"), step, least, most)?;
        }
        if let Some(depth) = self.depth {
            length("depth".into(), depth, 1.0, 1000.0)?;
        }
        match &self.z {
            None => {}
            Some(Heights::Even { first, distance }) => {
                length("z.first".into(), *first, -MAX_LENGTH_MM, MAX_LENGTH_MM)?;
                length("z.distance".into(), *distance, 0.01, 50.0)?;
            }
            Some(Heights::Files(files)) => {
                for (index, (name, height)) in files.iter().enumerate() {
                    length(format!("z[{index}][1]"), *height, -MAX_LENGTH_MM, MAX_LENGTH_MM)?;
                    for (earlier, (other, other_height)) in files[..index].iter().enumerate() {
                        if name == other || height == other_height {
                            return Err((
                                format!("z[{index}]"),
                                format!("{name} at {height} mm, but z[{earlier}] is {other} at {other_height} mm"),
                            ));
                        }
                    }
                }
            }
        }
        if let Some(Window { width, height, .. }) = self.window
            && (width < 2 || height < 2)
        {
            return Err((
                "window".into(),
                format!("is {width} x {height} pixels, expected 2 each way or more"),
            ));
        }
        Ok(())
    }
}

/// Where the sidecar of a folder or a file is looked for.
fn sidecar_of(path: &Path) -> PathBuf {
    if path.is_dir() {
        return path.join(SIDECAR);
    }
    let name = path
        .file_name()
        .map(|name| name.to_string_lossy().into_owned())
        .unwrap_or_default();
    let stem = [".nii.gz", ".nii", ".dcm"]
        .iter()
        .find_map(|ending| name.strip_suffix(ending))
        .unwrap_or(&name);
    path.with_file_name(format!("{stem}.{SIDECAR}"))
}
