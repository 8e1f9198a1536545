//! A stack made ready for measuring: log-compressed grey values, free of the scanner's gain, at any place.

use glam::{DVec2, DVec3};

use crate::image::Stack;

/// Added to the grey value, as a share of the stack's mean, before its logarithm is taken: below it is darkness.
const DARK: f32 = 0.1;
/// Grey from which a pixel counts for the mean.
const LIT: f32 = 0.01;

/// Log-compressed grey values of a stack. A change of gain adds the same everywhere, and the mean is about 0.
#[derive(Debug, Clone)]
pub(crate) struct Field {
    pub slices: Vec<FieldSlice>,
}

#[derive(Debug, Clone)]
pub(crate) struct FieldSlice {
    pub z: f64,
    width: usize,
    height: usize,
    spacing: DVec2,
    origin: DVec2,
    log: Vec<f32>,
}

impl Field {
    pub fn of(stack: &Stack) -> Field {
        let (mut sum, mut count) = (0.0_f64, 0_usize);
        for grey in stack.slices.iter().flat_map(|slice| &slice.image.grey) {
            if *grey > LIT {
                sum += f64::from(*grey);
                count += 1;
            }
        }
        let mean = if count > 0 { (sum / count as f64) as f32 } else { 1.0 };
        let slices = stack.slices.iter().map(|slice| {
            let image = &slice.image;
            FieldSlice {
                z: slice.z_mm,
                width: image.width,
                height: image.height,
                spacing: DVec2::from_array(image.spacing_mm),
                origin: DVec2::from_array(image.origin_mm),
                log: image.grey.iter().map(|grey| (grey.max(0.0) / mean + DARK).ln()).collect(),
            }
        });
        Field { slices: slices.collect() }
    }

    /// Middle of the stack, mm.
    pub fn centre(&self) -> DVec3 {
        let (Some(first), Some(last)) = (self.slices.first(), self.slices.last()) else {
            return DVec3::ZERO;
        };
        first.centre().extend(0.5 * (first.z + last.z))
    }

    /// The stack as it would be of the gland's mirror image, about the sagittal plane through the middle of the images.
    pub fn mirrored(&self) -> Field {
        let mut mirror = self.clone();
        for slice in &mut mirror.slices {
            for row in slice.log.chunks_exact_mut(slice.width) {
                row.reverse();
            }
        }
        mirror
    }

    /// The value at a place, between slices too; the nearest one holds beyond the ends.
    pub fn at(&self, place: DVec3) -> f32 {
        let above = self.slices.partition_point(|slice| slice.z < place.z);
        let flat = place.truncate();
        match (above.checked_sub(1).map(|below| &self.slices[below]), self.slices.get(above)) {
            (Some(low), Some(high)) => {
                let share = ((place.z - low.z) / (high.z - low.z)) as f32;
                low.at(flat) * (1.0 - share) + high.at(flat) * share
            }
            (Some(end), None) | (None, Some(end)) => end.at(flat),
            (None, None) => 0.0,
        }
    }
}

impl FieldSlice {
    pub fn centre(&self) -> DVec2 {
        self.origin + 0.5 * self.spacing * DVec2::new(self.width as f64 - 1.0, self.height as f64 - 1.0)
    }

    /// Whether a place lies on the image.
    pub fn holds(&self, place: DVec2) -> bool {
        let pixel = (place - self.origin) / self.spacing;
        let size = DVec2::new(self.width as f64, self.height as f64);
        pixel.cmpge(DVec2::splat(-0.5)).all() && pixel.cmple(size - 0.5).all()
    }

    /// Between pixels, linearly; the nearest pixel holds beyond the edge.
    #[inline]
    pub fn at(&self, place: DVec2) -> f32 {
        let x = (((place.x - self.origin.x) / self.spacing.x) as f32).clamp(0.0, (self.width - 1) as f32);
        let y = (((place.y - self.origin.y) / self.spacing.y) as f32).clamp(0.0, (self.height - 1) as f32);
        let (column, row) = (x as usize, y as usize);
        let (u, v) = (x - column as f32, y - row as f32);
        let right = usize::from(column + 1 < self.width);
        let below = if row + 1 < self.height { self.width } else { 0 };
        let corner = row * self.width + column;
        let grey = &self.log;
        let upper = grey[corner] + u * (grey[corner + right] - grey[corner]);
        let lower = grey[corner + below] + u * (grey[corner + below + right] - grey[corner + below]);
        upper + v * (lower - upper)
    }
}
