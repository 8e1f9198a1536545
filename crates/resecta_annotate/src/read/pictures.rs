//! Pictures to a stack: a folder of PNG or DICOM files, each an image, or the frames of one file.

use std::cmp::Ordering;
use std::fmt;
use std::fs;
use std::path::{Path, PathBuf};

use rayon::prelude::*;
use resecta_anatomy::Approximation;
use resecta_anatomy::import::{Axes, ImportError, Turn};

use super::picture::{Picture, read_png};
use super::{Geometry, Heights, StackError, Window, background, check_depth, dicom, lower_name, of_file};
use crate::stack::note;
use crate::{Image, ImageError, ImageSlice, MAX_IMAGES, MAX_STACK_PIXELS, Stack};

/// One picture with what its file says of it.
pub(super) struct Frame {
    /// Its file, for errors.
    pub file: PathBuf,
    pub picture: Picture,
    /// Height, mm, where the sidecar or the file tells one.
    pub z_mm: Option<f64>,
    /// What else the file tells.
    pub told: Told,
}

/// What a file says of the geometry of its pictures.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(super) struct Told {
    /// Distance between columns and between rows, mm.
    pub spacing_mm: Option<[f64; 2]>,
    /// The part that shows the patient.
    pub window: Option<Window>,
}

impl fmt::Display for Told {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.spacing_mm {
            Some([column, row]) => write!(f, "{column} x {row} mm")?,
            None => write!(f, "no spacing")?,
        }
        if let Some(window) = self.window {
            write!(
                f,
                " in {} x {} pixels from ({}, {})",
                window.width, window.height, window.left, window.top
            )?;
        }
        Ok(())
    }
}

/// Reads the pictures of a folder.
pub(super) fn read_folder(folder: &Path, geometry: &Geometry) -> Result<Stack, StackError> {
    let files = match &geometry.z {
        Some(Heights::Files(named)) => named
            .iter()
            .map(|(name, z_mm)| {
                let file = folder.join(name);
                // A name leads into the folder and nowhere else.
                if Path::new(name).file_name().is_none_or(|last| last != name.as_str()) || !file.is_file() {
                    return Err(StackError::NoSuchPicture {
                        folder: folder.into(),
                        name: name.clone(),
                    });
                }
                Ok((file, Some(*z_mm)))
            })
            .collect::<Result<Vec<_>, _>>()?,
        _ => pictures_in(folder)?.into_iter().map(|file| (file, None)).collect(),
    };
    if files.is_empty() {
        return Err(StackError::NoPictures { folder: folder.into() });
    }
    if files.len() > MAX_IMAGES {
        return Err(of_file(folder)(ImageError::Images {
            count: files.len(),
            most: MAX_IMAGES,
        }));
    }
    // The first tells how much memory the others will take.
    let first = read_picture(&files[0], geometry)?;
    check_pixels(folder, first.picture.grey.len(), files.len())?;
    let frames = files
        .par_iter()
        .map(|file| read_picture(file, geometry))
        // Of several errors the first file's is told, whatever the number of threads.
        .collect::<Vec<Result<_, StackError>>>()
        .into_iter()
        .collect::<Result<Vec<_>, _>>()?;
    stack_of(folder, frames, geometry)
}

/// Reads the frames of one DICOM file.
pub(super) fn read_multi_frame(file: &Path, geometry: &Geometry) -> Result<Stack, StackError> {
    if let Some(Heights::Files(_)) = geometry.z {
        return Err(StackError::Contradiction {
            file: file.into(),
            field: "z",
            one: "files are named".into(),
            other: "all images lie in one file".into(),
        });
    }
    stack_of(file, dicom::read_frames(file, geometry)?, geometry)
}

/// Reads one picture of a folder, and where the sidecar says it lies.
fn read_picture((file, z_mm): &(PathBuf, Option<f64>), geometry: &Geometry) -> Result<Frame, StackError> {
    if lower_name(file).ends_with(".png") {
        return Ok(Frame {
            file: file.clone(),
            picture: read_png(file)?,
            z_mm: *z_mm,
            told: Told::default(),
        });
    }
    let mut frames = dicom::read_frames(file, geometry)?;
    if frames.len() > 1 {
        return Err(StackError::Contradiction {
            file: file.clone(),
            field: "z",
            one: format!("it holds {} frames", frames.len()),
            other: "a folder holds one image a file; read this file alone".into(),
        });
    }
    let frame = frames.remove(0);
    Ok(Frame {
        z_mm: z_mm.or(frame.z_mm),
        ..frame
    })
}

/// Refuses more pixels than a stack may hold, before they are read.
pub(super) fn check_pixels(file: &Path, pixels: usize, images: usize) -> Result<(), StackError> {
    let count = pixels.saturating_mul(images);
    if count > MAX_STACK_PIXELS {
        return Err(of_file(file)(ImageError::Pixels {
            count,
            most: MAX_STACK_PIXELS,
        }));
    }
    Ok(())
}

/// The pictures of a folder in the order of their names.
fn pictures_in(folder: &Path) -> Result<Vec<PathBuf>, StackError> {
    let unread = |source| ImportError::Read {
        file: folder.into(),
        source,
    };
    let mut files = Vec::new();
    for entry in fs::read_dir(folder).map_err(unread)? {
        let path = entry.map_err(unread)?.path();
        let name = lower_name(&path);
        if (name.ends_with(".png") || name.ends_with(".dcm")) && path.is_file() {
            files.push(path);
        }
    }
    files.sort_by(|one, other| by_name(&lower_name(one), &lower_name(other)).then_with(|| one.cmp(other)));
    Ok(files)
}

/// Orders names as people count: digits in a row by their value.
fn by_name(one: &str, other: &str) -> Ordering {
    let (mut one, mut other) = (one, other);
    let digits = |text: &str| text.bytes().take_while(u8::is_ascii_digit).count();
    loop {
        let (n, m) = (digits(one), digits(other));
        let order = if n > 0 && m > 0 {
            let (value, other_value) = (one[..n].trim_start_matches('0'), other[..m].trim_start_matches('0'));
            let order = value.len().cmp(&other_value.len()).then_with(|| value.cmp(other_value));
            (one, other) = (&one[n..], &other[m..]);
            order
        } else {
            let (mut letters, mut other_letters) = (one.chars(), other.chars());
            let (letter, other_letter) = (letters.next(), other_letters.next());
            if letter.is_none() && other_letter.is_none() {
                return Ordering::Equal;
            }
            (one, other) = (letters.as_str(), other_letters.as_str());
            letter.cmp(&other_letter)
        };
        if order.is_ne() {
            return order;
        }
    }
}

/// Puts pictures in the order of the files (by height where each has one) into a stack. `source` is named in errors.
pub(super) fn stack_of(source: &Path, frames: Vec<Frame>, geometry: &Geometry) -> Result<Stack, StackError> {
    let mut notes = Vec::new();
    let axes = geometry.axes.unwrap_or(Axes::LPS);
    if geometry.axes.is_none() {
        notes.push(note(
            "axes",
            "not told: columns taken to run to the patient's left, rows backwards, images from apex to base",
        ));
    }
    if axes.own([0, 1, 2])[2] != 2 {
        return Err(StackError::Contradiction {
            file: source.into(),
            field: "axes",
            one: "the order of the pictures is said to run to a side or backwards".into(),
            other: "pictures are transverse: their code ends in S or I".into(),
        });
    }
    same_size(&frames)?;
    let told = same_told(&frames)?;
    let whole = [frames[0].picture.width, frames[0].picture.height];
    let window = geometry.window.or(told.window).unwrap_or(Window {
        left: 0,
        top: 0,
        width: whole[0],
        height: whole[1],
    });
    let frames = frames
        .into_iter()
        .map(|frame| {
            Ok(Frame {
                picture: frame.picture.cropped(window, &frame.file)?,
                ..frame
            })
        })
        .collect::<Result<Vec<_>, StackError>>()?;
    let size = [frames[0].picture.width, frames[0].picture.height];
    check_pixels(source, size[0] * size[1], frames.len())?;
    // Which place in memory each pixel of the turned image comes from; the order of images is dealt with below.
    let turn = Turn::new(axes, [size[0], size[1], 1]);
    let [width, height, _] = turn.size;
    let places: Vec<usize> = turn.slice(0).collect();

    let file_spacing = told.spacing_mm.map(|[column, row]| {
        let [x, y, _] = axes.turned([column, row, 0.0]);
        [x, y]
    });
    let spacing_mm = match (geometry.spacing, file_spacing, geometry.depth) {
        (Some(given), Some(file), _) => {
            notes.push(note(
                "spacing",
                format!(
                    "{} x {} mm were given in place of the file's {} x {}",
                    given[0], given[1], file[0], file[1]
                ),
            ));
            given
        }
        (Some(known), None, _) | (None, Some(known), _) => known,
        (None, None, Some(depth)) => {
            notes.push(note(
                "spacing",
                format!("{height} rows span the depth of {depth} mm; pixels taken to be square"),
            ));
            [depth / height as f64; 2]
        }
        (None, None, None) => {
            return Err(StackError::Missing {
                file: source.into(),
                field: "spacing",
                expected: "the distance between pixels in mm, or a depth",
            });
        }
    };
    check_depth(source, geometry.depth, height as f64 * spacing_mm[1])?;

    let frames = at_heights(source, frames, geometry, axes.reversed()[2], &mut notes)?;
    let grey: Vec<Vec<f32>> = frames
        .iter()
        .map(|(_, frame)| places.iter().map(|&place| frame.picture.grey[place]).collect())
        .collect();
    let shown = background::shown(width, grey.iter().map(Vec::as_slice));
    if !shown.is_empty() {
        notes.push(background::noted(&shown));
    }
    let marks: usize = frames
        .iter()
        .map(|(_, frame)| frame.picture.hidden.iter().filter(|&&hidden| hidden).count())
        .sum();
    if marks > 0 {
        notes.push(note(
            "pixels",
            format!("{marks} coloured or transparent ones left out as marks of the scanner"),
        ));
    }
    // Millimetres from the centre of the first pixel of the whole picture as it was turned.
    let start = window_start(axes, whole, window);
    let origin_mm = [0, 1].map(|axis| start[axis] as f64 * spacing_mm[axis]);
    let mut slices = Vec::with_capacity(frames.len());
    for ((z_mm, frame), grey) in frames.into_iter().zip(grey) {
        let is_shown =
            |(pixel, &place): (usize, &usize)| !frame.picture.hidden[place] && (shown.is_empty() || shown[pixel]);
        let image = Image::new([width, height], spacing_mm, origin_mm, grey)
            .and_then(|image| image.with_shown(places.iter().enumerate().map(is_shown).collect()))
            .and_then(|image| image.check_contrast().map(|()| image))
            .map_err(of_file(&frame.file))?;
        slices.push(ImageSlice { z_mm, image });
    }
    Ok(Stack::new(slices).map_err(of_file(source))?.with_notes(notes))
}

fn same_size(frames: &[Frame]) -> Result<(), StackError> {
    let size = |frame: &Frame| [frame.picture.width, frame.picture.height];
    let first = &frames[0];
    match frames.iter().find(|&frame| size(frame) != size(first)) {
        Some(frame) => Err(StackError::Sizes {
            file: frame.file.clone(),
            size: size(frame),
            first: first.file.clone(),
            first_size: size(first),
        }),
        None => Ok(()),
    }
}

/// What all files tell of the spacing and the window.
fn same_told(frames: &[Frame]) -> Result<Told, StackError> {
    let first = &frames[0];
    match frames.iter().find(|frame| frame.told != first.told) {
        Some(frame) => Err(StackError::Contradiction {
            file: frame.file.clone(),
            field: "spacing",
            one: frame.told.to_string(),
            other: format!("{} has {}", first.file.display(), first.told),
        }),
        None => Ok(first.told),
    }
}

/// The first pixel of a window along x and y of the turned picture.
fn window_start(axes: Axes, [width, height]: [usize; 2], window: Window) -> [usize; 2] {
    let starts = axes.turned([window.left, window.top, 0]);
    let lengths = axes.turned([window.width, window.height, 1]);
    let wholes = axes.turned([width, height, 1]);
    let reversed = axes.reversed();
    [0, 1].map(|axis| {
        if reversed[axis] {
            wholes[axis] - lengths[axis] - starts[axis]
        } else {
            starts[axis]
        }
    })
}

/// Pictures with their heights, from the lowest.
fn at_heights(
    source: &Path,
    mut frames: Vec<Frame>,
    geometry: &Geometry,
    from_base: bool,
    notes: &mut Vec<Approximation>,
) -> Result<Vec<(f64, Frame)>, StackError> {
    if let Some(Heights::Even { first, distance }) = geometry.z {
        if frames.iter().any(|frame| frame.z_mm.is_some()) {
            notes.push(note(
                "z",
                format!("from {first} mm every {distance} mm, given in place of the file's"),
            ));
        }
        if from_base {
            frames.reverse();
        }
        let height = |index: usize| first + index as f64 * distance;
        return Ok(frames
            .into_iter()
            .enumerate()
            .map(|(index, frame)| (height(index), frame))
            .collect());
    }
    let mut placed = frames
        .into_iter()
        .map(|frame| {
            let z_mm = frame.z_mm.ok_or_else(|| StackError::Missing {
                file: source.into(),
                field: "z",
                expected: "where the images lie, such as z: Even(first: 0.0, distance: 5.0)",
            })?;
            Ok((z_mm, frame))
        })
        .collect::<Result<Vec<_>, StackError>>()?;
    placed.sort_by(|(one, _), (other, _)| one.total_cmp(other));
    if let Some([(_, one), (z_mm, other)]) = placed.array_windows().find(|[(one, _), (other, _)]| one == other) {
        return Err(StackError::SameHeight {
            file: other.file.clone(),
            other: one.file.clone(),
            z_mm: *z_mm,
        });
    }
    Ok(placed)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_ordered_as_people_count() {
        let mut names = ["f10", "f9", "f09b", "f", "f1", "a2", "f010a", "f2x10", "f2x9"];
        names.sort_by(|one, other| by_name(one, other));
        assert_eq!(names, ["a2", "f", "f1", "f2x9", "f2x10", "f9", "f09b", "f10", "f010a"]);
    }
}
