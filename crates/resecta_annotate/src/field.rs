//! A stack made ready for measuring: log-compressed grey values, free of the scanner's gain and dynamic range, at any place.

use glam::{DVec2, DVec3};

use crate::{Image, Stack};

/// Added to the grey value, as a share of the stack's mean, before its logarithm is taken: below it is darkness.
const DARK: f32 = 0.1;
/// About the size of the pixels measured in, mm: speckle is averaged, a boundary is not.
const PIXEL_MM: f64 = 1.5;
/// Distance between the planes that a stack is resampled to, mm.
const PLANE_MM: f64 = 0.8;
/// Grey from which a pixel counts for the mean.
const LIT: f32 = 0.01;

/// Log-compressed grey values of a stack, of mean 0 and standard deviation 1 where it is lit: what a scanner's gain adds
/// everywhere and what its dynamic range multiplies is gone.
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
    /// Pixels a millimetre.
    per_mm: DVec2,
    origin: DVec2,
    log: Vec<f32>,
}

impl Field {
    pub fn of(stack: &Stack) -> Field {
        let coarse: Vec<(f64, Coarse)> = stack
            .slices()
            .iter()
            .map(|slice| (slice.z_mm, Coarse::of(&slice.image)))
            .collect();
        let (mut sum, mut count) = (0.0_f64, 0_usize);
        for grey in coarse.iter().flat_map(|(_, coarse)| &coarse.grey) {
            if *grey > LIT {
                sum += f64::from(*grey);
                count += 1;
            }
        }
        let mean = if count > 0 { (sum / count as f64) as f32 } else { 1.0 };
        let mut slices: Vec<FieldSlice> = Vec::with_capacity(coarse.len());
        let mut lit = Vec::new();
        for (z, coarse) in coarse {
            let log: Vec<f32> = coarse.grey.iter().map(|grey| (grey / mean + DARK).ln()).collect();
            let both = log.iter().zip(&coarse.grey);
            lit.extend(both.filter(|(_, grey)| **grey > LIT).map(|(log, _)| f64::from(*log)));
            slices.push(FieldSlice {
                z,
                width: coarse.size[0],
                height: coarse.size[1],
                spacing: coarse.spacing,
                per_mm: coarse.spacing.recip(),
                origin: coarse.origin,
                log,
            });
        }
        let level = lit.iter().sum::<f64>() / lit.len().max(1) as f64;
        let variance = lit.iter().map(|log| (log - level).powi(2)).sum::<f64>() / lit.len().max(1) as f64;
        let (level, deviation) = (level as f32, variance.sqrt().max(1e-3) as f32);
        for log in slices.iter_mut().flat_map(|slice| &mut slice.log) {
            *log = (*log - level) / deviation;
        }
        Field {
            slices: planes(&slices),
        }
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

    /// The image at a height: the plane nearest to it; the first and last hold beyond the ends.
    #[inline]
    pub fn plane(&self, z: f64) -> &FieldSlice {
        // Faster than to round, which is a call: what is below 0 becomes 0 as an index.
        let plane = ((z - self.slices[0].z) * (1.0 / PLANE_MM) + 0.5) as usize;
        &self.slices[plane.min(self.slices.len() - 1)]
    }

    /// The value at a place.
    pub fn at(&self, place: DVec3) -> f32 {
        self.plane(place.z).at(place.truncate())
    }
}

/// Planes every [`PLANE_MM`] from the first slice to the last, between slices by linear interpolation.
fn planes(slices: &[FieldSlice]) -> Vec<FieldSlice> {
    let (Some(first), Some(last)) = (slices.first(), slices.last()) else {
        return Vec::new();
    };
    let count = ((last.z - first.z) / PLANE_MM).round() as usize + 1;
    (0..count)
        .map(|plane| {
            let z = (first.z + plane as f64 * PLANE_MM).min(last.z);
            let above = slices.partition_point(|slice| slice.z < z).min(slices.len() - 1);
            let (low, high) = (&slices[above.saturating_sub(1)], &slices[above]);
            let share = if high.z > low.z {
                ((z - low.z) / (high.z - low.z)).clamp(0.0, 1.0) as f32
            } else {
                0.0
            };
            let log = low
                .log
                .iter()
                .zip(&high.log)
                .map(|(a, b)| a + share * (b - a))
                .collect();
            FieldSlice { z, log, ..high.clone() }
        })
        .collect()
}

/// An image averaged to pixels of about [`PIXEL_MM`]; what is not shown is black.
struct Coarse {
    size: [usize; 2],
    spacing: DVec2,
    origin: DVec2,
    grey: Vec<f32>,
}

impl Coarse {
    fn of(image: &Image) -> Coarse {
        let fine = DVec2::from_array(image.spacing_mm());
        let full = [image.width(), image.height()];
        let block = [0, 1].map(|axis| ((PIXEL_MM / fine[axis]).round() as usize).clamp(1, full[axis] / 2));
        let size = [full[0] / block[0], full[1] / block[1]];
        let mut grey = Vec::with_capacity(size[0] * size[1]);
        for row in 0..size[1] {
            for column in 0..size[0] {
                let mut sum = 0.0;
                for y in row * block[1]..(row + 1) * block[1] {
                    for x in column * block[0]..(column + 1) * block[0] {
                        if image.is_shown(x, y) {
                            sum += image.grey()[y * full[0] + x];
                        }
                    }
                }
                grey.push(sum / (block[0] * block[1]) as f32);
            }
        }
        let block = DVec2::new(block[0] as f64, block[1] as f64);
        Coarse {
            size,
            spacing: fine * block,
            origin: DVec2::from_array(image.origin_mm()) + 0.5 * (block - 1.0) * fine,
            grey,
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
        let x = (((place.x - self.origin.x) * self.per_mm.x) as f32).clamp(0.0, (self.width - 1) as f32);
        let y = (((place.y - self.origin.y) * self.per_mm.y) as f32).clamp(0.0, (self.height - 1) as f32);
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ImageSlice;

    fn field(grey: impl Fn(usize) -> f32) -> Field {
        let slice = |z: u32| {
            let grey = (0..64).map(|pixel| grey(pixel + z as usize)).collect();
            ImageSlice {
                z_mm: f64::from(z),
                image: Image::new([8, 8], [1.5; 2], [0.0; 2], grey).expect("an image"),
            }
        };
        Field::of(&Stack::new((0..3).map(slice).collect()).expect("a stack"))
    }

    #[test]
    fn gain_and_dynamic_range_do_not_matter() {
        let shade = |pixel: usize| 0.2 + 0.1 * (pixel as f32 * 0.7).sin();
        let (one, brighter) = (field(shade), field(|pixel| 2.0 * shade(pixel)));
        let wider = field(|pixel| 4.0 * shade(pixel).powf(1.5));
        for (index, value) in one.slices[0].log.iter().enumerate() {
            assert!((value - brighter.slices[0].log[index]).abs() < 1e-4);
            assert!((value - wider.slices[0].log[index]).abs() < 0.25);
        }
    }
}
