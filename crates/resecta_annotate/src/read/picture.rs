//! One picture: samples of a file to grey levels.

use std::io::Cursor;
use std::path::Path;

use image::{ColorType, DynamicImage, ImageDecoder, ImageReader, Limits};
use resecta_anatomy::import;

use super::{StackError, Window};
use crate::MAX_PIXELS_PER_AXIS;

/// Largest picture file that is read, bytes.
pub const MAX_PICTURE_BYTES: u64 = 1 << 28;
/// Largest share of coloured pixels that is taken for a scanner's marks, %; more is no ultrasound image.
pub const MAX_COLOURED_PERCENT: f64 = 5.0;
/// Channels of one pixel that differ by more than this share of white are a colour; lossy files differ by less.
const COLOUR: f32 = 0.1;

/// Grey levels of a picture, 0 to 1 row by row, and which pixels are a scanner's marks or transparent.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Picture {
    pub width: usize,
    pub height: usize,
    pub grey: Vec<f32>,
    pub hidden: Vec<bool>,
}

impl Picture {
    /// From pixels of red, green and blue, 0 to 1.
    pub fn from_colours(size: [usize; 2], pixels: impl Iterator<Item = [f32; 3]>) -> Picture {
        let (grey, hidden) = pixels
            .map(|[red, green, blue]| {
                let (least, most) = (red.min(green).min(blue), red.max(green).max(blue));
                ((red + green + blue) / 3.0, most - least > COLOUR)
            })
            .unzip();
        Picture {
            width: size[0],
            height: size[1],
            grey,
            hidden,
        }
    }

    /// Refuses a picture with more colour than a scanner's marks.
    pub fn check_colour(&self, coloured: usize, file: &Path) -> Result<(), StackError> {
        let percent = 100.0 * coloured as f64 / self.hidden.len().max(1) as f64;
        if percent > MAX_COLOURED_PERCENT {
            return Err(StackError::Coloured {
                file: file.into(),
                percent,
                most_percent: MAX_COLOURED_PERCENT,
            });
        }
        Ok(())
    }

    /// The part within a window.
    pub fn cropped(self, window: Window, file: &Path) -> Result<Picture, StackError> {
        let Window {
            left,
            top,
            width,
            height,
        } = window;
        let fits = |start: usize, length: usize, all: usize| start.checked_add(length).is_some_and(|end| end <= all);
        if !fits(left, width, self.width) || !fits(top, height, self.height) {
            return Err(StackError::Contradiction {
                file: file.into(),
                field: "window",
                one: format!("{width} x {height} pixels from ({left}, {top})"),
                other: format!("the picture has {} x {}", self.width, self.height),
            });
        }
        let places = || (top..top + height).flat_map(|y| (left..left + width).map(move |x| y * self.width + x));
        Ok(Picture {
            width,
            height,
            grey: places().map(|pixel| self.grey[pixel]).collect(),
            hidden: places().map(|pixel| self.hidden[pixel]).collect(),
        })
    }
}

/// Reads a PNG picture of at most [`MAX_PIXELS_PER_AXIS`] pixels each way and [`MAX_PICTURE_BYTES`].
pub(super) fn read_png(file: &Path) -> Result<Picture, StackError> {
    decode_png(&import::read(file, MAX_PICTURE_BYTES)?, file)
}

fn decode_png(bytes: &[u8], file: &Path) -> Result<Picture, StackError> {
    let bad = |error: image::ImageError| StackError::Picture {
        file: file.into(),
        message: error.to_string(),
    };
    let mut reader = ImageReader::with_format(Cursor::new(bytes), image::ImageFormat::Png);
    let mut limits = Limits::default();
    limits.max_image_width = Some(MAX_PIXELS_PER_AXIS as u32);
    limits.max_image_height = Some(MAX_PIXELS_PER_AXIS as u32);
    reader.limits(limits);
    let decoder = reader.into_decoder().map_err(bad)?;
    let is_grey = matches!(decoder.color_type(), ColorType::L8 | ColorType::L16);
    let decoded = DynamicImage::from_decoder(decoder).map_err(bad)?;
    let size = [decoded.width() as usize, decoded.height() as usize];
    if is_grey {
        let grey = decoded.to_luma32f().into_raw();
        return Ok(Picture {
            width: size[0],
            height: size[1],
            hidden: vec![false; grey.len()],
            grey,
        });
    }
    let samples = decoded.into_rgba16();
    let level = |sample: u16| f32::from(sample) / f32::from(u16::MAX);
    let mut picture = Picture::from_colours(
        size,
        samples.pixels().map(|pixel| [pixel[0], pixel[1], pixel[2]].map(level)),
    );
    let coloured = picture.hidden.iter().filter(|&&coloured| coloured).count();
    picture.check_colour(coloured, file)?;
    for (hidden, pixel) in picture.hidden.iter_mut().zip(samples.pixels()) {
        *hidden |= pixel[3] < u16::MAX / 2;
    }
    Ok(picture)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn png(image: DynamicImage) -> Vec<u8> {
        let mut bytes = Cursor::new(Vec::new());
        image.write_to(&mut bytes, image::ImageFormat::Png).unwrap();
        bytes.into_inner()
    }

    fn decoded(image: impl Into<DynamicImage>) -> Result<Picture, StackError> {
        decode_png(&png(image.into()), Path::new("frame.png"))
    }

    #[test]
    fn grey_comes_out_alike_however_it_is_stored() {
        let bytes = image::GrayImage::from_fn(7, 5, |x, y| image::Luma([(30 * x + y) as u8]));
        let words = image::ImageBuffer::from_fn(7, 5, |x, y| image::Luma([257 * (30 * x + y) as u16]));
        let colours = image::RgbImage::from_fn(7, 5, |x, y| image::Rgb([(30 * x + y) as u8; 3]));
        let pictures = [
            decoded(bytes).unwrap(),
            decoded(words).unwrap(),
            decoded(colours).unwrap(),
        ];
        assert!((pictures[0].grey[8] - 31.0 / 255.0).abs() < 1e-6);
        for picture in &pictures {
            assert!(picture.hidden.iter().all(|&hidden| !hidden));
            let differ = picture
                .grey
                .iter()
                .zip(&pictures[0].grey)
                .any(|(a, b)| (a - b).abs() > 1e-6);
            assert!(!differ);
        }
    }

    #[test]
    fn a_few_coloured_marks_are_hidden_and_a_photo_is_refused() {
        let marked = |columns: u32| {
            decoded(image::RgbImage::from_fn(100, 10, |x, _| {
                image::Rgb(if x < columns { [255, 200, 0] } else { [90, 95, 88] })
            }))
        };
        let picture = marked(4).unwrap();
        assert_eq!(picture.hidden.iter().filter(|&&hidden| hidden).count(), 40);
        let error = marked(6).unwrap_err();
        assert!(
            matches!(error, StackError::Coloured { percent, .. } if percent == 6.0),
            "{error}"
        );
    }

    #[test]
    fn transparent_pixels_are_not_shown() {
        let picture = decoded(image::RgbaImage::from_fn(4, 4, |x, _| {
            image::Rgba([9, 9, 9, if x == 1 { 0 } else { 255 }])
        }));
        let picture = picture.unwrap();
        assert_eq!(picture.hidden.iter().filter(|&&hidden| hidden).count(), 4);
    }

    #[test]
    fn damaged_pictures_are_errors_wherever_they_are_cut() {
        let whole = png(image::GrayImage::from_fn(40, 30, |x, y| image::Luma([(x * y) as u8])).into());
        for length in 0..whole.len() - 12 {
            let error = decode_png(&whole[..length], Path::new("cut.png")).unwrap_err();
            assert!(error.to_string().starts_with("cut.png: "), "{error}");
        }
    }
}
