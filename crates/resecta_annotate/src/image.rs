//! One transverse image: grey levels with their place in the patient.

use std::ops::RangeInclusive;

use glam::DVec2;
use resecta_anatomy::MAX_COORDINATE_MM;

use crate::ImageError;

/// Most pixels along one side of an image.
pub const MAX_PIXELS_PER_AXIS: usize = 4096;
/// Distances between pixels that can be those of a prostate's image, mm.
pub const PIXEL_SPACING_MM: RangeInclusive<f64> = 0.01..=5.0;

/// A transverse image of known geometry. Columns run to the patient's left (`+x`), rows backwards (`+y`, posterior), as seen
/// from the patient's feet.
#[derive(Debug, Clone, PartialEq)]
pub struct Image {
    width: usize,
    height: usize,
    spacing_mm: [f64; 2],
    origin_mm: [f64; 2],
    grey: Vec<f32>,
    /// Empty where every pixel is shown.
    shown: Vec<bool>,
}

impl Image {
    /// An image of `size` columns and rows, every pixel of which is shown.
    ///
    /// `spacing_mm` is the distance between columns and between rows, within [`PIXEL_SPACING_MM`]; `origin_mm` the centre of
    /// the first pixel; `grey` the levels row by row, 0 (black) to 1 (white).
    ///
    /// # Errors
    ///
    /// [`ImageError::Size`], [`ImageError::Spacing`], [`ImageError::Place`], [`ImageError::Count`] or [`ImageError::Grey`].
    pub fn new(
        size: [usize; 2],
        spacing_mm: [f64; 2],
        origin_mm: [f64; 2],
        grey: Vec<f32>,
    ) -> Result<Image, ImageError> {
        let [width, height] = size;
        if size.iter().any(|pixels| !(2..=MAX_PIXELS_PER_AXIS).contains(pixels)) {
            return Err(ImageError::Size {
                width,
                height,
                most: MAX_PIXELS_PER_AXIS,
            });
        }
        for (spacing_mm, along) in spacing_mm.into_iter().zip(["along x", "along y"]) {
            check_spacing(along, spacing_mm)?;
        }
        for value_mm in origin_mm {
            check_place("origin", value_mm)?;
        }
        if grey.len() != width * height {
            return Err(ImageError::Count {
                what: "grey",
                found: grey.len(),
                expected: width * height,
            });
        }
        if let Some(pixel) = grey.iter().position(|grey| !(0.0..=1.0).contains(grey)) {
            return Err(ImageError::Grey {
                x: pixel % width,
                y: pixel / width,
                grey: grey[pixel],
            });
        }
        Ok(Image {
            width,
            height,
            spacing_mm,
            origin_mm,
            grey,
            shown: Vec::new(),
        })
    }

    /// The same image, of which only the pixels marked in `shown` (row by row) hold anything of the patient.
    ///
    /// # Errors
    ///
    /// [`ImageError::Count`] or [`ImageError::NothingShown`].
    pub fn with_shown(mut self, shown: Vec<bool>) -> Result<Image, ImageError> {
        if shown.len() != self.grey.len() {
            return Err(ImageError::Count {
                what: "shown",
                found: shown.len(),
                expected: self.grey.len(),
            });
        }
        if !shown.contains(&true) {
            return Err(ImageError::NothingShown);
        }
        self.shown = if shown.contains(&false) { shown } else { Vec::new() };
        Ok(self)
    }

    /// Pixels a row.
    pub fn width(&self) -> usize {
        self.width
    }

    /// Rows.
    pub fn height(&self) -> usize {
        self.height
    }

    /// Distance between columns and between rows, mm.
    pub fn spacing_mm(&self) -> [f64; 2] {
        self.spacing_mm
    }

    /// Centre of the first pixel, mm.
    pub fn origin_mm(&self) -> [f64; 2] {
        self.origin_mm
    }

    /// Grey levels row by row, 0 (black) to 1 (white).
    pub fn grey(&self) -> &[f32] {
        &self.grey
    }

    /// Whether a pixel holds anything of the patient: it lies within the sector and under no mark of the scanner.
    pub fn is_shown(&self, x: usize, y: usize) -> bool {
        x < self.width && y < self.height && (self.shown.is_empty() || self.shown[y * self.width + x])
    }

    /// Centre of a pixel, mm.
    pub fn place(&self, x: usize, y: usize) -> DVec2 {
        DVec2::from_array(self.origin_mm) + DVec2::new(x as f64, y as f64) * DVec2::from_array(self.spacing_mm)
    }

    /// The grey level at a point (mm), between pixels by bilinear interpolation; `None` beyond the outermost pixels' centres
    /// and where one of the pixels needed is not shown.
    pub fn grey_at(&self, point: DVec2) -> Option<f32> {
        let place = (point - DVec2::from_array(self.origin_mm)) / DVec2::from_array(self.spacing_mm);
        let last = DVec2::new((self.width - 1) as f64, (self.height - 1) as f64);
        if !(place.cmpge(DVec2::ZERO).all() && place.cmple(last).all()) {
            return None;
        }
        // On the last row or column the square before it serves, with the weight wholly on its far side.
        let (x, y) = (
            (place.x as usize).min(self.width - 2),
            (place.y as usize).min(self.height - 2),
        );
        let (right, down) = ((place.x - x as f64) as f32, (place.y - y as f64) as f32);
        let mut grey = 0.0;
        for (x, y, weight) in [
            (x, y, (1.0 - right) * (1.0 - down)),
            (x + 1, y, right * (1.0 - down)),
            (x, y + 1, (1.0 - right) * down),
            (x + 1, y + 1, right * down),
        ] {
            if weight > 0.0 {
                if !self.is_shown(x, y) {
                    return None;
                }
                grey += weight * self.grey[y * self.width + x];
            }
        }
        Some(grey)
    }

    /// Refuses an image all of whose shown pixels have one grey level.
    ///
    /// # Errors
    ///
    /// [`ImageError::Blank`].
    pub fn check_contrast(&self) -> Result<(), ImageError> {
        let mut levels = (0..self.grey.len())
            .filter(|&pixel| self.shown.is_empty() || self.shown[pixel])
            .map(|pixel| self.grey[pixel]);
        let grey = levels.next().unwrap_or_default();
        if levels.all(|level| level == grey) {
            return Err(ImageError::Blank { grey });
        }
        Ok(())
    }
}

/// Refuses a distance that pixels of a prostate cannot have.
pub(crate) fn check_spacing(along: &'static str, spacing_mm: f64) -> Result<(), ImageError> {
    if PIXEL_SPACING_MM.contains(&spacing_mm) {
        return Ok(());
    }
    Err(ImageError::Spacing {
        along,
        spacing_mm,
        least: *PIXEL_SPACING_MM.start(),
        most: *PIXEL_SPACING_MM.end(),
    })
}

/// Refuses a coordinate beyond what a case may hold.
pub(crate) fn check_place(what: &'static str, value_mm: f64) -> Result<(), ImageError> {
    if value_mm.abs() <= MAX_COORDINATE_MM {
        return Ok(());
    }
    Err(ImageError::Place {
        what,
        value_mm,
        most: MAX_COORDINATE_MM,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ramp() -> Image {
        // grey = (x + 2 y) / 10 in pixels.
        let grey = (0..12)
            .map(|pixel| (pixel % 4 + 2 * (pixel / 4)) as f32 / 10.0)
            .collect();
        Image::new([4, 3], [0.5, 2.0], [-3.0, 7.0], grey).unwrap()
    }

    #[test]
    fn a_linear_image_is_reproduced_between_its_pixels_to_its_very_edges() {
        let image = ramp();
        for (x, y) in [(0.0, 0.0), (3.0, 2.0), (0.0, 2.0), (3.0, 0.0), (1.3, 0.8), (2.9, 1.99)] {
            let point = DVec2::new(-3.0 + 0.5 * x, 7.0 + 2.0 * y);
            let expected = ((x + 2.0 * y) / 10.0) as f32;
            assert!((image.grey_at(point).unwrap() - expected).abs() < 1e-6, "{point}");
        }
    }

    #[test]
    fn nothing_is_known_outside_or_where_nothing_is_shown() {
        let image = ramp();
        for point in [(-3.01, 8.0), (-1.49, 8.0), (-2.0, 6.9), (-2.0, 11.1), (f64::NAN, 8.0)] {
            assert_eq!(image.grey_at(DVec2::from(point)), None, "{point:?}");
        }
        let mut shown = vec![true; 12];
        shown[5] = false;
        let image = image.with_shown(shown).unwrap();
        assert_eq!(image.grey_at(image.place(1, 1) + DVec2::splat(0.01)), None);
        // A pixel beside it is known at its centre, where the hidden one has no weight.
        assert!(image.grey_at(image.place(2, 1)).is_some());
    }

    #[test]
    fn geometry_that_cannot_be_is_refused_by_name() {
        let new = |size, spacing, origin, count| Image::new(size, spacing, origin, vec![0.5; count]);
        let (size, spacing, origin) = ([4, 3], [0.5; 2], [0.0; 2]);
        for size in [[0, 0], [1, 3], [4, 1], [MAX_PIXELS_PER_AXIS + 1, 2]] {
            assert!(matches!(new(size, spacing, origin, 12), Err(ImageError::Size { .. })));
        }
        for step in [0.0, -0.3, f64::NAN, f64::INFINITY, 300.0] {
            let error = new(size, [0.5, step], origin, 12).unwrap_err();
            assert!(matches!(error, ImageError::Spacing { along: "along y", .. }), "{error}");
        }
        for place in [f64::NAN, 1e9] {
            assert!(matches!(
                new(size, spacing, [place, 0.0], 12),
                Err(ImageError::Place { .. })
            ));
        }
        assert!(matches!(new(size, spacing, origin, 11), Err(ImageError::Count { .. })));
        let grey = Image::new(size, spacing, origin, [vec![0.5; 11], vec![f32::NAN]].concat());
        assert!(matches!(grey, Err(ImageError::Grey { x: 3, y: 2, .. })));
    }

    #[test]
    fn an_image_of_one_level_is_empty_whatever_lies_outside_its_sector() {
        let mut grey = vec![0.25; 12];
        grey[0] = 0.0;
        let image = Image::new([4, 3], [1.0; 2], [0.0; 2], grey).unwrap();
        assert_eq!(image.check_contrast(), Ok(()));
        let mut shown = vec![true; 12];
        shown[0] = false;
        let image = image.with_shown(shown).unwrap();
        assert_eq!(image.check_contrast(), Err(ImageError::Blank { grey: 0.25 }));
        assert_eq!(image.with_shown(vec![false; 12]), Err(ImageError::NothingShown));
    }
}
