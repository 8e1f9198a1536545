//! What a scanner's sector leaves black.

use resecta_anatomy::Approximation;

use crate::stack::note;

/// Which pixels of images of `width` columns are shown: all but those that are black (0) in every image and joined to the
/// edge through such pixels. Empty where that leaves all pixels, or none.
pub(super) fn shown<'a>(width: usize, mut images: impl Iterator<Item = &'a [f32]>) -> Vec<bool> {
    let Some(first) = images.next() else {
        return Vec::new();
    };
    let mut black: Vec<bool> = first.iter().map(|&grey| grey == 0.0).collect();
    for image in images {
        for (black, &grey) in black.iter_mut().zip(image) {
            *black &= grey == 0.0;
        }
    }
    let height = black.len() / width;
    let mut shown = vec![true; black.len()];
    let rim = (0..width)
        .flat_map(|x| [x, (height - 1) * width + x])
        .chain((0..height).flat_map(|y| [y * width, y * width + width - 1]));
    let mut open: Vec<usize> = rim.collect();
    while let Some(pixel) = open.pop() {
        if !(black[pixel] && shown[pixel]) {
            continue;
        }
        shown[pixel] = false;
        let (x, y) = (pixel % width, pixel / width);
        if x > 0 {
            open.push(pixel - 1);
        }
        if x + 1 < width {
            open.push(pixel + 1);
        }
        if y > 0 {
            open.push(pixel - width);
        }
        if y + 1 < height {
            open.push(pixel + width);
        }
    }
    if shown.iter().any(|&pixel| pixel != shown[0]) {
        shown
    } else {
        Vec::new()
    }
}

/// Tells of the pixels that are not shown.
pub(super) fn noted(shown: &[bool]) -> Approximation {
    let hidden = shown.iter().filter(|&&shown| !shown).count();
    note(
        "sector",
        format!(
            "{:.0} % of the pixels are black in every image and joined to the edge: taken to lie outside the sector",
            100.0 * hidden as f64 / shown.len() as f64
        ),
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    fn image(rows: &[&str]) -> Vec<f32> {
        rows.iter()
            .flat_map(|row| row.bytes().map(|byte| if byte == b'.' { 0.0 } else { 0.5 }))
            .collect()
    }

    #[test]
    fn only_what_is_black_in_all_images_and_joined_to_the_edge_is_outside() {
        let one = image(&["..#..", ".#.#.", "#...#", "#####"]);
        let other = image(&[".....", "#####", "#...#", "#...#"]);
        let shown = shown(5, [&one[..], &other[..]].into_iter());
        let expected = image(&["..#..", "#####", "#####", "#####"]);
        assert_eq!(shown, expected.iter().map(|&grey| grey > 0.0).collect::<Vec<_>>());
    }

    #[test]
    fn images_all_black_or_without_black_are_left_to_other_rules() {
        assert!(shown(2, [&[0.0; 4][..]].into_iter()).is_empty());
        assert!(shown(2, [&[0.1; 4][..]].into_iter()).is_empty());
        assert!(shown(2, std::iter::empty()).is_empty());
    }
}
