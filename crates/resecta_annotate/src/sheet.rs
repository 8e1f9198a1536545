//! The contact sheet: all images of a stack with what was drawn on them, side by side in one picture.

use std::io::Cursor;

use glam::DVec2;
use image::{ImageFormat, Rgb, RgbImage};
use resecta_anatomy::contour;

use crate::{Image, Stack};

/// A colour of a sheet: red, green and blue.
pub type Colour = [u8; 3];

/// What is drawn over one image of a sheet.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Overlay<'a> {
    /// Closed contours, mm, in their colours; later ones over earlier ones.
    pub contours: Vec<(&'a [DVec2], Colour)>,
    /// A frame around the image, for slices to look at.
    pub frame: Option<Colour>,
}

/// Columns of pixels of one image on a sheet.
const TILE_WIDTH: usize = 280;
/// Free pixels between images.
const GAP: usize = 6;
/// Height of the line with the image's z, and the size of a dot of its figures, pixels.
const CAPTION: usize = 18;
const DOT: usize = 2;
const INK: Colour = [235, 235, 235];
const PAPER: Colour = [24, 24, 28];
/// What an image does not show.
const HIDDEN: Colour = [44, 40, 60];

/// A sheet of a stack as a PNG file, `columns` images a row (at least 1) from the lowest at the upper left, each with its z in mm
/// over it. `overlays` go with the images in order; images beyond their number stay plain. Patient left is on the right
/// and posterior below.
pub fn contact_sheet(stack: &Stack, overlays: &[Overlay], columns: usize) -> Vec<u8> {
    let slices = stack.slices();
    let columns = columns.clamp(1, slices.len());
    let rows = slices.len().div_ceil(columns);
    // Images of a stack have one size, but each its own spacing; the first sets the shape of all places.
    let tile = tile_size(&slices[0].image);
    let step = [tile[0] + GAP, tile[1] + CAPTION + GAP];
    let size = [GAP + columns * step[0], GAP + rows * step[1]];
    let mut sheet = RgbImage::from_pixel(size[0] as u32, size[1] as u32, Rgb(PAPER));
    let plain = Overlay::default();
    for (index, slice) in slices.iter().enumerate() {
        let overlay = overlays.get(index).unwrap_or(&plain);
        let corner = [GAP + (index % columns) * step[0], GAP + (index / columns) * step[1]];
        write_text(&mut sheet, corner, &format!("z {:.1}", slice.z_mm));
        draw(
            &mut sheet,
            [corner[0], corner[1] + CAPTION],
            tile,
            &slice.image,
            overlay,
        );
    }
    let mut png = Cursor::new(Vec::new());
    // Memory takes all that is written, and a sheet's size is that of a picture.
    sheet
        .write_to(&mut png, ImageFormat::Png)
        .expect("a picture is written to memory");
    png.into_inner()
}

/// Pixels of an image on the sheet, square ones.
fn tile_size(image: &Image) -> [usize; 2] {
    let [x, y] = image.spacing_mm();
    let ratio = image.height() as f64 * y / (image.width() as f64 * x);
    let height = (TILE_WIDTH as f64 * ratio).round() as usize;
    [TILE_WIDTH, height.clamp(TILE_WIDTH / 4, 4 * TILE_WIDTH)]
}

fn draw(sheet: &mut RgbImage, corner: [usize; 2], tile: [usize; 2], image: &Image, overlay: &Overlay) {
    // From the sheet's pixels to the image's millimetres, the outer edges of the outermost pixels on those of the tile.
    let spacing = DVec2::from_array(image.spacing_mm());
    let extent = spacing * DVec2::new(image.width() as f64, image.height() as f64);
    let low = DVec2::from_array(image.origin_mm()) - 0.5 * spacing;
    let per_pixel = extent / DVec2::new(tile[0] as f64, tile[1] as f64);
    let last = image.place(image.width() - 1, image.height() - 1);
    for y in 0..tile[1] {
        for x in 0..tile[0] {
            let point = low + (DVec2::new(x as f64, y as f64) + 0.5) * per_pixel;
            let point = point.clamp(DVec2::from_array(image.origin_mm()), last);
            let colour = image
                .grey_at(point)
                .map_or(HIDDEN, |grey| [(255.0 * grey).round() as u8; 3]);
            put(sheet, [corner[0] + x, corner[1] + y], colour);
        }
    }
    for (contour, colour) in &overlay.contours {
        for [a, b] in contour::edges(contour) {
            let (a, b) = ((a - low) / per_pixel, (b - low) / per_pixel);
            // A line wholly elsewhere, or one of no end, takes no time.
            let outer = DVec2::new(tile[0] as f64, tile[1] as f64);
            if !(a.is_finite() && b.is_finite()) || a.max(b).cmplt(DVec2::ZERO).any() || a.min(b).cmpgt(outer).any() {
                continue;
            }
            let steps = (2.0 * a.distance(b)).ceil().clamp(1.0, 1e5);
            for step in 0..=steps as usize {
                let point = a.lerp(b, step as f64 / steps);
                if point.cmpge(DVec2::ZERO).all() && point.cmplt(outer).all() {
                    put(
                        sheet,
                        [corner[0] + point.x as usize, corner[1] + point.y as usize],
                        *colour,
                    );
                }
            }
        }
    }
    if let Some(colour) = overlay.frame {
        for x in 0..tile[0] {
            for y in 0..tile[1] {
                if x.min(tile[0] - 1 - x).min(y.min(tile[1] - 1 - y)) < 2 {
                    put(sheet, [corner[0] + x, corner[1] + y], colour);
                }
            }
        }
    }
}

fn put(sheet: &mut RgbImage, [x, y]: [usize; 2], colour: Colour) {
    if let Some(pixel) = sheet.get_pixel_mut_checked(x as u32, y as u32) {
        *pixel = Rgb(colour);
    }
}

/// Letters of captions, five rows of dots each, the left dot in the highest of three bits.
const LETTERS: [(char, [u8; 5]); 13] = [
    ('0', [0b111, 0b101, 0b101, 0b101, 0b111]),
    ('1', [0b010, 0b110, 0b010, 0b010, 0b111]),
    ('2', [0b111, 0b001, 0b111, 0b100, 0b111]),
    ('3', [0b111, 0b001, 0b111, 0b001, 0b111]),
    ('4', [0b101, 0b101, 0b111, 0b001, 0b001]),
    ('5', [0b111, 0b100, 0b111, 0b001, 0b111]),
    ('6', [0b111, 0b100, 0b111, 0b101, 0b111]),
    ('7', [0b111, 0b001, 0b001, 0b001, 0b001]),
    ('8', [0b111, 0b101, 0b111, 0b101, 0b111]),
    ('9', [0b111, 0b101, 0b111, 0b001, 0b111]),
    ('.', [0b000, 0b000, 0b000, 0b000, 0b010]),
    ('-', [0b000, 0b000, 0b111, 0b000, 0b000]),
    ('z', [0b000, 0b111, 0b011, 0b110, 0b111]),
];

/// Writes a caption; what has no letter is left blank.
fn write_text(sheet: &mut RgbImage, [left, top]: [usize; 2], text: &str) {
    for (place, letter) in text.chars().enumerate() {
        let Some((_, rows)) = LETTERS.iter().find(|(known, _)| *known == letter) else {
            continue;
        };
        for (row, dots) in rows.iter().enumerate() {
            for column in (0..3).filter(|column| dots >> (2 - column) & 1 == 1) {
                for dot in 0..DOT * DOT {
                    let x = left + DOT * (4 * place + column) + dot % DOT;
                    put(sheet, [x, top + 2 + DOT * row + dot / DOT], INK);
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ImageSlice;

    const RED: Colour = [255, 0, 0];
    const GREEN: Colour = [0, 255, 0];

    fn stack(count: usize) -> Stack {
        let slice = |index: usize| ImageSlice {
            z_mm: 5.0 * index as f64 - 5.0,
            image: Image::new(
                [40, 30],
                [1.0, 0.5],
                [-20.0, 3.0],
                (0..1200).map(|pixel| (pixel % 40) as f32 / 200.0).collect(),
            )
            .unwrap(),
        };
        Stack::new((0..count).map(slice).collect()).unwrap()
    }

    fn decoded(png: &[u8]) -> RgbImage {
        image::load_from_memory(png).unwrap().into_rgb8()
    }

    fn count(sheet: &RgbImage, colour: Colour) -> usize {
        sheet.pixels().filter(|pixel| pixel.0 == colour).count()
    }

    #[test]
    fn images_stand_in_rows_at_their_true_proportions() {
        let sheet = |count, columns| decoded(&contact_sheet(&stack(count), &[], columns)).dimensions();
        // 40 x 15 mm.
        let (width, height) = (TILE_WIDTH + GAP, TILE_WIDTH * 15 / 40 + CAPTION + GAP);
        for (count, columns, expected) in [(5, 3, [3, 2]), (5, 9, [5, 1]), (5, 0, [1, 5]), (1, 1, [1, 1])] {
            let (x, y) = sheet(count, columns);
            assert_eq!(
                [x as usize - GAP, y as usize - GAP],
                [width * expected[0], height * expected[1]]
            );
        }
    }

    #[test]
    fn contours_are_drawn_where_they_lie_and_only_on_their_image() {
        let square = [(-10.0, 5.0), (0.0, 5.0), (0.0, 10.0), (-10.0, 10.0)].map(DVec2::from);
        let overlay = Overlay {
            contours: vec![(&square, RED)],
            frame: None,
        };
        let sheet = decoded(&contact_sheet(&stack(2), std::slice::from_ref(&overlay), 2));
        let per_mm = TILE_WIDTH as f64 / 40.0;
        let red: Vec<(u32, u32)> = sheet
            .enumerate_pixels()
            .filter(|(_, _, pixel)| pixel.0 == RED)
            .map(|(x, y, _)| (x, y))
            .collect();
        let bound = |of: fn(&(u32, u32)) -> u32| {
            let values = || red.iter().map(of);
            [values().min().unwrap() as f64, values().max().unwrap() as f64]
        };
        // The image's upper left edge is (-20.5, 2.75) mm.
        let (x, y) = (bound(|pixel| pixel.0), bound(|pixel| pixel.1));
        let expected_x = [10.5, 20.5].map(|mm| GAP as f64 + mm * per_mm);
        let expected_y = [2.25, 7.25].map(|mm| (GAP + CAPTION) as f64 + mm * per_mm);
        for (found, expected) in x.into_iter().zip(expected_x).chain(y.into_iter().zip(expected_y)) {
            assert!((found - expected).abs() <= 1.0, "{found}, expected {expected}");
        }
        assert!((red.len() as f64 - 30.0 * per_mm).abs() < 12.0, "{}", red.len());
    }

    #[test]
    fn frames_and_contours_that_leave_the_image_stay_on_it() {
        let wide = [(-1e9, 5.0), (1e9, 6.0), (f64::NAN, 0.0)].map(DVec2::from);
        let overlay = Overlay {
            contours: vec![(&wide, RED), (&[], RED)],
            frame: Some(GREEN),
        };
        let sheet = decoded(&contact_sheet(&stack(3), &[Overlay::default(), overlay], 3));
        let tile = [TILE_WIDTH, TILE_WIDTH * 15 / 40];
        assert_eq!(count(&sheet, GREEN), 4 * (tile[0] + tile[1]) - 16);
        let left = (GAP + TILE_WIDTH + GAP) as u32;
        let within = |x: u32| (left..left + TILE_WIDTH as u32).contains(&x);
        assert!(
            sheet
                .enumerate_pixels()
                .all(|(x, _, pixel)| pixel.0 != RED || within(x))
        );
    }

    #[test]
    fn every_caption_can_be_told_from_the_others() {
        let captions: Vec<RgbImage> = ["0", "1", "2", "3", "4", "5", "6", "7", "8", "9", "-1", "1.0", "z"]
            .iter()
            .map(|text| {
                let mut picture = RgbImage::new(40, 18);
                write_text(&mut picture, [0, 0], text);
                picture
            })
            .collect();
        for (index, one) in captions.iter().enumerate() {
            assert!(count(one, INK) > 0 && !captions[..index].contains(one));
        }
    }
}
