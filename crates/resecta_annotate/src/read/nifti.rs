//! Images in a NIfTI volume.

use std::ops::Range;
use std::path::Path;

use resecta_anatomy::import::NiftiVolume;

use super::{Geometry, Heights, StackError, background, check_depth, of_file};
use crate::stack::note;
use crate::{Image, ImageSlice, Stack};

/// Reads a volume: its first channel, slices across the axis of the gland.
pub(super) fn read_volume(file: &Path, geometry: &Geometry) -> Result<Stack, StackError> {
    let axes = geometry.axes.ok_or_else(|| StackError::Missing {
        file: file.into(),
        field: "axes",
        expected: "a code of three letters such as PLS; the orientation in NIfTI headers is not trusted",
    })?;
    if geometry.window.is_some() {
        return Err(StackError::Contradiction {
            file: file.into(),
            field: "window",
            one: "one is given".into(),
            other: "a volume has no scanner's screen around it".into(),
        });
    }
    let (first_mm, distance_mm) = match &geometry.z {
        None => (0.0, None),
        Some(Heights::Even { first, distance }) => (*first, Some(*distance)),
        Some(Heights::Files(_)) => {
            return Err(StackError::Contradiction {
                file: file.into(),
                field: "z",
                one: "files are named".into(),
                other: "all images lie in one volume".into(),
            });
        }
    };
    // With all three given, a header that makes no sense is no matter.
    let given = match (geometry.spacing, distance_mm) {
        (Some([x, y]), Some(z)) => Some(axes.own([x, y, z])),
        _ => None,
    };
    let volume = NiftiVolume::load(file, axes, given)?;
    let [width, height, levels] = volume.size();
    let header = volume.spacing_mm();
    let [x, y] = geometry.spacing.unwrap_or([header[0], header[1]]);
    let spacing = [x, y, distance_mm.unwrap_or(header[2])];
    check_depth(file, geometry.depth, height as f64 * spacing[1])?;

    let slices = (0..levels)
        .map(|level| volume.slice(0, level, file))
        .collect::<Result<Vec<_>, _>>()?;
    let mut notes = Vec::new();
    if geometry.spacing.is_some() || distance_mm.is_some() {
        notes.push(note(
            "spacing",
            format!(
                "{} mm were given in place of the header's {}",
                times(spacing),
                times(volume.stated_spacing())
            ),
        ));
    }
    let (least, most) = slices
        .iter()
        .flatten()
        .fold((f32::INFINITY, f32::NEG_INFINITY), |(least, most), &value| {
            (least.min(value), most.max(value))
        });
    let (black, white) = if volume.has_bytes() && least >= 0.0 && most <= 255.0 {
        (0.0, 255.0)
    } else {
        notes.push(note(
            "grey levels",
            format!("from {least} (black) to {most} (white), as found"),
        ));
        (least, most)
    };
    // One level throughout is told by the stack.
    let range = if white > black { white - black } else { 1.0 };
    let grey: Vec<Vec<f32>> = slices
        .into_iter()
        .map(|slice| {
            slice
                .into_iter()
                .map(|value| ((value - black) / range).clamp(0.0, 1.0))
                .collect()
        })
        .collect();
    let shown = background::shown(width, grey.iter().map(Vec::as_slice));
    if !shown.is_empty() {
        notes.push(background::noted(&shown));
    }
    let seen = seen(&grey);
    if seen.len() < levels {
        let rule = format!(
            "{} at the ends have one grey level throughout: left out",
            levels - seen.len()
        );
        notes.push(note("images", rule));
    }
    let slices = grey
        .into_iter()
        .enumerate()
        .take(seen.end)
        .skip(seen.start)
        .map(|(level, grey)| {
            let image = Image::new([width, height], [spacing[0], spacing[1]], [0.0; 2], grey)?;
            Ok(ImageSlice {
                // Rounded as heights of outlines are, so that those of a mask fall together with these.
                z_mm: ((first_mm + level as f64 * spacing[2]) * 1000.0).round() / 1000.0,
                image: if shown.is_empty() {
                    image
                } else {
                    image.with_shown(shown.clone())?
                },
            })
        })
        .collect::<Result<Vec<_>, _>>()
        .map_err(of_file(file))?;
    Ok(Stack::new(slices).map_err(of_file(file))?.with_notes(notes))
}

/// The slices between the first and the last that has more than one grey level; all where none has, for the stack to refuse.
fn seen(slices: &[Vec<f32>]) -> Range<usize> {
    let varies = |slice: &Vec<f32>| slice.iter().any(|&grey| grey != slice[0]);
    match (slices.iter().position(varies), slices.iter().rposition(varies)) {
        (Some(first), Some(last)) => first..last + 1,
        _ => 0..slices.len(),
    }
}

fn times([x, y, z]: [f64; 3]) -> String {
    // A header holds single precision; 0.4 is to read so.
    let [x, y, z] = [x, y, z].map(|step| (step * 1e6).round() / 1e6);
    format!("{x} x {y} x {z}")
}
