//! DICOM ultrasound: frames of a file, with their spacing from its calibrated regions.
//!
//! Read are native pixels (little-endian, explicit or implicit), RLE and JPEG, 8 or 16 bits, grey, RGB or YBR_FULL, one frame
//! or many. A scanner's file tells the spacing by a region of the screen with physical units (Sequence of Ultrasound
//! Regions, 0018,6011; DICOM PS3.3, C.8.5.5); what lies outside the region is no patient.

use std::io::Cursor;
use std::path::Path;

use dicom_object::{DefaultDicomObject, InMemDicomObject, OpenFileOptions, Tag};
use dicom_pixeldata::PixelDecoder;
use resecta_anatomy::import;

use super::picture::Picture;
use super::pictures::{Frame, Told, check_pixels};
use super::{Geometry, StackError, Window, of_file, structure};
use crate::image::{PIXEL_SPACING_MM, check_spacing};
use crate::{ImageError, MAX_IMAGES, MAX_PIXELS_PER_AXIS};

/// Largest DICOM file that is read, bytes.
pub const MAX_DICOM_BYTES: u64 = 1 << 28;

const REGIONS: Tag = Tag(0x0018, 0x6011);
const REGION_SPATIAL_FORMAT: Tag = Tag(0x0018, 0x6012);
const REGION_DATA_TYPE: Tag = Tag(0x0018, 0x6014);
/// First column, first row, last column, last row.
const REGION_LOCATION: [Tag; 4] = [
    Tag(0x0018, 0x6018),
    Tag(0x0018, 0x601a),
    Tag(0x0018, 0x601c),
    Tag(0x0018, 0x601e),
];
const PHYSICAL_UNITS: [Tag; 2] = [Tag(0x0018, 0x6024), Tag(0x0018, 0x6026)];
const PHYSICAL_DELTA: [Tag; 2] = [Tag(0x0018, 0x602c), Tag(0x0018, 0x602e)];
const SLICE_DISTANCE: Tag = Tag(0x0018, 0x0088);
const SLICE_LOCATION: Tag = Tag(0x0020, 0x1041);
const SAMPLES: Tag = Tag(0x0028, 0x0002);
const PHOTOMETRIC: Tag = Tag(0x0028, 0x0004);
const PLANAR: Tag = Tag(0x0028, 0x0006);
const FRAMES: Tag = Tag(0x0028, 0x0008);
const ROWS: Tag = Tag(0x0028, 0x0010);
const COLUMNS: Tag = Tag(0x0028, 0x0011);
const PIXEL_SPACING: Tag = Tag(0x0028, 0x0030);
const BITS_ALLOCATED: Tag = Tag(0x0028, 0x0100);
const BITS_STORED: Tag = Tag(0x0028, 0x0101);
const SIGNED: Tag = Tag(0x0028, 0x0103);
/// Value of units, spatial formats and data types of regions.
const CENTIMETRE: u32 = 3;
const TWO_DIMENSIONAL: u32 = 1;
const TISSUE: u32 = 1;
const RLE: &str = "1.2.840.10008.1.2.5";
const JPEG: &str = "1.2.840.10008.1.2.4.";

/// Reads the frames of a file. Of the geometry that is told beside it, a window picks the region that holds it, and a spacing
/// makes that of the file no matter.
pub(super) fn read_frames(file: &Path, geometry: &Geometry) -> Result<Vec<Frame>, StackError> {
    frames(&import::read(file, MAX_DICOM_BYTES)?, file, geometry)
}

fn frames(bytes: &[u8], file: &Path, geometry: &Geometry) -> Result<Vec<Frame>, StackError> {
    let bad = |message: String| StackError::Picture {
        file: file.into(),
        message,
    };
    let syntax = structure::check(bytes).map_err(bad)?;
    let object = OpenFileOptions::new()
        .from_reader(Cursor::new(bytes))
        .map_err(|error| bad(chain(&error)))?;
    let layout = Layout::of(&object, &syntax, file)?;
    let told = told(&object, file, geometry)?;
    let decoded = object.decode_pixel_data().map_err(|error| bad(chain(&error)))?;
    let length = layout.frame_bytes();
    // A byte may pad the whole to an even length.
    if decoded.data().len() / length < layout.frames || decoded.data().len() > length * layout.frames + 1 {
        return Err(bad(format!(
            "it has {} bytes of pixels, expected {length} for each of {} frames",
            decoded.data().len(),
            layout.frames
        )));
    }
    let heights = heights(&object, layout.frames);
    decoded
        .data()
        .chunks_exact(length)
        .take(layout.frames)
        .enumerate()
        .map(|(frame, bytes)| {
            Ok(Frame {
                file: file.into(),
                picture: layout.picture(bytes, told.window, file)?,
                z_mm: heights.as_ref().map(|heights| heights[frame]),
                told,
            })
        })
        .collect()
}

/// An error with what caused it.
fn chain(error: &dyn std::error::Error) -> String {
    let mut message = error.to_string();
    let mut cause = error.source();
    while let Some(error) = cause {
        message.push_str(": ");
        message.push_str(&error.to_string());
        cause = error.source();
    }
    message
}

fn number(object: &InMemDicomObject, tag: Tag) -> Option<u32> {
    object.get(tag)?.to_int().ok()
}

fn real(object: &InMemDicomObject, tag: Tag) -> Option<f64> {
    object.get(tag)?.to_float64().ok()
}

/// How pixels lie in a frame.
struct Layout {
    width: usize,
    height: usize,
    frames: usize,
    colours: Colours,
    is_planar: bool,
    bits_allocated: u32,
    bits_stored: u32,
}

#[derive(Clone, Copy, PartialEq)]
enum Colours {
    /// Black at 0, or white at 0.
    Grey {
        inverted: bool,
    },
    Rgb,
    /// Luminance and two differences of colour, none at half of white.
    Ybr,
}

impl Layout {
    fn of(object: &DefaultDicomObject, syntax: &str, file: &Path) -> Result<Layout, StackError> {
        let bad = |message: String| StackError::Picture {
            file: file.into(),
            message,
        };
        let needed = |tag, name: &str| number(object, tag).ok_or_else(|| bad(format!("{name} {tag} is missing")));
        let [width, height] = [needed(COLUMNS, "Columns")? as usize, needed(ROWS, "Rows")? as usize];
        if [width, height]
            .iter()
            .any(|pixels| !(2..=MAX_PIXELS_PER_AXIS).contains(pixels))
        {
            return Err(of_file(file)(ImageError::Size {
                width,
                height,
                most: MAX_PIXELS_PER_AXIS,
            }));
        }
        let frames = number(object, FRAMES).unwrap_or(1) as usize;
        if !(1..=MAX_IMAGES).contains(&frames) {
            return Err(of_file(file)(ImageError::Images {
                count: frames,
                most: MAX_IMAGES,
            }));
        }
        check_pixels(file, width * height, frames)?;
        let samples = needed(SAMPLES, "Samples per Pixel")?;
        let photometric = object
            .get(PHOTOMETRIC)
            .and_then(|element| element.to_str().ok())
            .map(|text| text.trim_end_matches(['\0', ' ']).to_owned())
            .ok_or_else(|| bad(format!("Photometric Interpretation {PHOTOMETRIC} is missing")))?;
        // The decoder of JPEG turns colours to RGB, whatever they were.
        let is_jpeg = syntax.starts_with(JPEG);
        let colours = match (samples, photometric.as_str()) {
            (1, "MONOCHROME2") => Colours::Grey { inverted: false },
            (1, "MONOCHROME1") => Colours::Grey { inverted: true },
            (3, "RGB") => Colours::Rgb,
            (3, "YBR_FULL" | "YBR_FULL_422") if is_jpeg => Colours::Rgb,
            (3, "YBR_FULL") => Colours::Ybr,
            _ => {
                return Err(bad(format!(
                    "its pixels are {photometric} with {samples} samples, expected MONOCHROME1, MONOCHROME2, RGB or YBR_FULL"
                )));
            }
        };
        let (bits_allocated, bits_stored) = (
            needed(BITS_ALLOCATED, "Bits Allocated")?,
            needed(BITS_STORED, "Bits Stored")?,
        );
        if ![8, 16].contains(&bits_allocated) || !(1..=bits_allocated).contains(&bits_stored) {
            return Err(bad(format!(
                "a sample has {bits_stored} bits stored in {bits_allocated}, expected 8 or 16"
            )));
        }
        if number(object, SIGNED).unwrap_or(0) != 0 {
            return Err(bad("its grey levels have a sign".into()));
        }
        Ok(Layout {
            width,
            height,
            frames,
            colours,
            // Decoders hand out pixel by pixel.
            is_planar: number(object, PLANAR) == Some(1) && !is_jpeg && syntax != RLE,
            bits_allocated,
            bits_stored,
        })
    }

    fn samples(&self) -> usize {
        if matches!(self.colours, Colours::Grey { .. }) {
            1
        } else {
            3
        }
    }

    fn frame_bytes(&self) -> usize {
        self.width * self.height * self.samples() * self.bits_allocated as usize / 8
    }

    /// The picture of one frame; colour is judged within the window.
    fn picture(&self, bytes: &[u8], window: Option<Window>, file: &Path) -> Result<Picture, StackError> {
        let white = ((1_u32 << self.bits_stored) - 1) as f32;
        let wide = self.bits_allocated == 16;
        let level = |sample: usize| {
            let value = if wide {
                u16::from_le_bytes([bytes[2 * sample], bytes[2 * sample + 1]])
            } else {
                u16::from(bytes[sample])
            };
            (f32::from(value) / white).min(1.0)
        };
        let count = self.width * self.height;
        let colour = |pixel: usize, channel: usize| {
            level(if self.is_planar {
                channel * count + pixel
            } else {
                3 * pixel + channel
            })
        };
        let size = [self.width, self.height];
        let picture = match self.colours {
            Colours::Grey { inverted } => Picture {
                width: self.width,
                height: self.height,
                grey: (0..count)
                    .map(|pixel| if inverted { 1.0 - level(pixel) } else { level(pixel) })
                    .collect(),
                hidden: vec![false; count],
            },
            Colours::Rgb => Picture::from_colours(size, (0..count).map(|pixel| [0, 1, 2].map(|c| colour(pixel, c)))),
            // ITU-R BT.601, full range.
            Colours::Ybr => Picture::from_colours(
                size,
                (0..count).map(|pixel| {
                    let [y, blue, red] = [colour(pixel, 0), colour(pixel, 1) - 0.5, colour(pixel, 2) - 0.5];
                    [
                        y + 1.402 * red,
                        y - 0.344_136 * blue - 0.714_136 * red,
                        y + 1.772 * blue,
                    ]
                    .map(|level| level.clamp(0.0, 1.0))
                }),
            ),
        };
        if picture.hidden.contains(&true) {
            let seen = match window {
                Some(window) => picture.clone().cropped(window, file)?,
                None => picture.clone(),
            };
            seen.check_colour(seen.hidden.iter().filter(|&&coloured| coloured).count(), file)?;
        }
        Ok(picture)
    }
}

/// Heights of the frames, where the file tells a distance between them or the place of its one slice, mm.
fn heights(object: &DefaultDicomObject, frames: usize) -> Option<Vec<f64>> {
    if frames == 1 {
        return Some(vec![real(object, SLICE_LOCATION)?]);
    }
    let distance = real(object, SLICE_DISTANCE).filter(|&distance| distance > 0.0)?;
    Some((0..frames).map(|frame| frame as f64 * distance).collect())
}

/// Spacing and window: those of the one calibrated region that shows tissue, or the spacing alone.
fn told(object: &DefaultDicomObject, file: &Path, geometry: &Geometry) -> Result<Told, StackError> {
    let mut regions = Vec::new();
    for item in object
        .get(REGIONS)
        .and_then(|element| element.items())
        .unwrap_or_default()
    {
        if number(item, REGION_SPATIAL_FORMAT) == Some(TWO_DIMENSIONAL)
            && number(item, REGION_DATA_TYPE) == Some(TISSUE)
            && PHYSICAL_UNITS.iter().all(|&tag| number(item, tag) == Some(CENTIMETRE))
        {
            regions.push(region(item, file)?);
        }
    }
    let window = geometry.window;
    if let Some(window) = window {
        regions.retain(|(_, region)| holds(region, &window));
    }
    let pixel_spacing = object
        .get(PIXEL_SPACING)
        .and_then(|element| element.to_multi_float64().ok())
        .filter(|spacing| spacing.len() == 2)
        .map(|spacing| [spacing[1], spacing[0]]);
    match (regions.as_slice(), pixel_spacing) {
        ([], spacing_mm) => Ok(Told { spacing_mm, window }),
        ([(spacing_mm, region)], other) => {
            if geometry.spacing.is_none() {
                check_spacings(*spacing_mm, other, file)?;
            }
            Ok(Told {
                spacing_mm: Some(*spacing_mm)
                    .filter(|spacing| spacing.iter().all(|step| PIXEL_SPACING_MM.contains(step))),
                window: window.or(Some(*region)),
            })
        }
        (several, _) => Err(StackError::Contradiction {
            file: file.into(),
            field: "window",
            one: format!("it shows {} calibrated regions of tissue side by side", several.len()),
            other: "no window within one of them was given".into(),
        }),
    }
}

/// Refuses a region's spacing that cannot be, or that Pixel Spacing contradicts.
fn check_spacings(spacing_mm: [f64; 2], pixel_spacing_mm: Option<[f64; 2]>, file: &Path) -> Result<(), StackError> {
    /// Both are often written with few digits.
    const TOLERANCE: f64 = 0.02;
    for (along, step) in ["along a row", "along a column"].into_iter().zip(spacing_mm) {
        check_spacing(along, step).map_err(of_file(file))?;
    }
    match pixel_spacing_mm {
        Some(other) if (0..2).any(|axis| (other[axis] / spacing_mm[axis] - 1.0).abs() > TOLERANCE) => {
            Err(StackError::Contradiction {
                file: file.into(),
                field: "spacing",
                one: format!(
                    "its calibrated region (0018,6011) has {} x {} mm",
                    spacing_mm[0], spacing_mm[1]
                ),
                other: format!("Pixel Spacing (0028,0030) is {} x {} mm", other[0], other[1]),
            })
        }
        _ => Ok(()),
    }
}

fn holds(region: &Window, window: &Window) -> bool {
    let within = |start: usize, length: usize, outer: usize, outer_length: usize| {
        start >= outer && start.saturating_add(length) <= outer.saturating_add(outer_length)
    };
    within(window.left, window.width, region.left, region.width)
        && within(window.top, window.height, region.top, region.height)
}

/// Spacing in mm and place of a calibrated region.
fn region(item: &InMemDicomObject, file: &Path) -> Result<([f64; 2], Window), StackError> {
    let missing = |tag: Tag| StackError::Picture {
        file: file.into(),
        message: format!("its calibrated region (0018,6011) lacks {tag}"),
    };
    let mut spacing_mm = [0.0; 2];
    for (spacing, tag) in spacing_mm.iter_mut().zip(PHYSICAL_DELTA) {
        // The sign says which way the physical axis runs; rows and columns run as they are shown.
        *spacing = 10.0 * real(item, tag).ok_or_else(|| missing(tag))?.abs();
    }
    let mut place = [0; 4];
    for (number_of, tag) in place.iter_mut().zip(REGION_LOCATION) {
        *number_of = number(item, tag).ok_or_else(|| missing(tag))? as usize;
    }
    let [left, top, right, bottom] = place;
    if right <= left || bottom <= top {
        return Err(StackError::Contradiction {
            file: file.into(),
            field: "window",
            one: format!("its calibrated region begins at ({left}, {top})"),
            other: format!("it ends at ({right}, {bottom})"),
        });
    }
    Ok((
        spacing_mm,
        Window {
            left,
            top,
            width: right - left + 1,
            height: bottom - top + 1,
        },
    ))
}
