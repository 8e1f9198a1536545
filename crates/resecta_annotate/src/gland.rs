//! The point distribution model of the whole gland: landmarks at levels from apex to base, in three dimensions.
//!
//! A stack shows one gland. Fitted whole, clear slices help unclear ones, and where apex and base lie is found with the rest.

use glam::{DVec2, DVec3};
use nalgebra::{DMatrix, DVector};
use serde::{Deserialize, Serialize};

use crate::landmarks::{LANDMARKS, landmarks};
use crate::principal::{Modes, WEIGHT_LIMIT};
use crate::section::moments;

/// Levels of the model, evenly from one end to the other.
pub const LEVELS: usize = 11;
/// Heights at which a gland is compared with images: about as many as a stack of thin slices shows of it.
const HEIGHTS: usize = 20;
/// Parameters of the pose: translation along x, y and z, and the logarithm of the scale.
pub const POSE: usize = 4;

/// A gland as landmarks at levels of even distance.
#[derive(Debug, Clone, PartialEq)]
pub struct Gland {
    /// Heights of the lowest and of the highest level, mm.
    pub ends: [f64; 2],
    /// Landmarks of each level, mm.
    pub levels: Vec<Vec<DVec2>>,
}

/// A landmark on the surface of a gland.
pub(crate) struct SurfacePoint {
    pub place: DVec3,
    /// Outwards, of length 1.
    pub normal: DVec3,
    /// In proportion to the area that it stands for.
    pub area: f64,
}

impl Gland {
    /// From outlines by rising height, mm; none where fewer than three have an area. A gland ends somewhere between the last
    /// slice that shows it and the next, so half the distance of two slices is added at both ends.
    pub fn of_outlines(outlines: &[(f64, Vec<DVec2>)]) -> Option<Gland> {
        let marked: Vec<(f64, Vec<DVec2>)> = outlines
            .iter()
            .filter_map(|(z, outline)| Some((*z, landmarks(outline)?)))
            .collect();
        let height = |index: usize| marked[index].0;
        let last = marked.len().checked_sub(1).filter(|last| *last >= 2)?;
        let ends = [
            height(0) - 0.5 * (height(1) - height(0)),
            height(last) + 0.5 * (height(last) - height(last - 1)),
        ];
        if ends[1] <= ends[0] {
            return None;
        }
        let levels = (0..LEVELS).map(|level| {
            let z = ends[0] + (ends[1] - ends[0]) * level as f64 / (LEVELS - 1) as f64;
            let above = marked
                .partition_point(|(height, _)| *height < z)
                .clamp(1, marked.len() - 1);
            let (low, high) = (&marked[above - 1], &marked[above]);
            let share = ((z - low.0) / (high.0 - low.0)).clamp(0.0, 1.0);
            low.1.iter().zip(&high.1).map(|(a, b)| a.lerp(*b, share)).collect()
        });
        Some(Gland {
            ends,
            levels: levels.collect(),
        })
    }

    /// Height within the gland: 0 at the lowest level, 1 at the highest.
    pub fn share_of(&self, z: f64) -> f64 {
        (z - self.ends[0]) / (self.ends[1] - self.ends[0])
    }

    /// Where the gland is compared with images: at [`HEIGHTS`] heights, given as shares of the whole, its landmarks there.
    pub(crate) fn surface(&self) -> impl Iterator<Item = (f64, Vec<SurfacePoint>)> + '_ {
        let height = self.ends[1] - self.ends[0];
        (0..HEIGHTS).map(move |index| {
            let share = (index as f64 + 0.5) / HEIGHTS as f64;
            let half = 0.5 / (LEVELS - 1) as f64;
            let (lower, upper) = ((share - half).max(0.0), (share + half).min(1.0));
            let (below, here, above) = (self.at_share(lower), self.at_share(share), self.at_share(upper));
            let z = self.ends[0] + share * height;
            let rise = (upper - lower) * height;
            let places = (0..LANDMARKS).map(|landmark| {
                let around = here[(landmark + 1) % LANDMARKS] - here[(landmark + LANDMARKS - 1) % LANDMARKS];
                let up = (above[landmark] - below[landmark]).extend(rise);
                let area = around.extend(0.0).cross(up);
                SurfacePoint {
                    place: here[landmark].extend(z),
                    normal: area.normalize_or_zero(),
                    area: area.length(),
                }
            });
            (share, places.collect())
        })
    }

    /// The landmarks at a height; none below the lowest and above the highest level.
    pub fn section(&self, z: f64) -> Option<Vec<DVec2>> {
        let share = self.share_of(z);
        (0.0..=1.0).contains(&share).then(|| self.at_share(share))
    }

    /// The landmarks at a share of the height, from 0 to 1.
    pub(crate) fn at_share(&self, share: f64) -> Vec<DVec2> {
        let place = share * (LEVELS - 1) as f64;
        let low = (place as usize).min(LEVELS - 2);
        let (below, above) = (&self.levels[low], &self.levels[low + 1]);
        below
            .iter()
            .zip(above)
            .map(|(a, b)| a.lerp(*b, place - low as f64))
            .collect()
    }

    /// Middle, mm, and size: root mean square distance of the landmarks from it, in the plane, mm.
    fn pose(&self) -> (DVec3, f64) {
        let count = (LEVELS * LANDMARKS) as f64;
        let middle = self.levels.iter().flatten().sum::<DVec2>() / count;
        let squares: f64 = self
            .levels
            .iter()
            .flatten()
            .map(|place| place.distance_squared(middle))
            .sum();
        (
            middle.extend(0.5 * (self.ends[0] + self.ends[1])),
            (squares / count).sqrt(),
        )
    }

    /// Coordinates about the middle in units of the size, then the height, weighted as all the landmarks' heights together.
    fn vector(&self, middle: DVec3, size: f64) -> Vec<f64> {
        let flat = middle.truncate();
        let mut vector: Vec<f64> = self
            .levels
            .iter()
            .flatten()
            .flat_map(|place| ((place - flat) / size).to_array())
            .collect();
        vector.push(height_weight() * (self.ends[1] - self.ends[0]) / size);
        vector
    }
}

fn height_weight() -> f64 {
    let squares = (0..LEVELS).map(|level| (level as f64 / (LEVELS - 1) as f64 - 0.5).powi(2));
    (LANDMARKS as f64 * squares.sum::<f64>()).sqrt()
}

/// Pose and shape of the whole gland, learned.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct GlandModel {
    /// Mean pose: place of the middle relative to that of the stack, mm, and the logarithm of the size in mm.
    pub pose_mean: [f64; POSE],
    /// Standard deviations of the same.
    pub pose_deviation: [f64; POSE],
    /// Shape of the aligned glands.
    pub shape: Modes,
}

impl GlandModel {
    /// Learns from glands and the middles of the stacks that show them.
    pub fn of(glands: &[(Gland, DVec3)]) -> GlandModel {
        let mut vectors = Vec::new();
        let mut poses = Vec::new();
        for (gland, stack_centre) in glands {
            let (middle, size) = gland.pose();
            vectors.push(gland.vector(middle, size));
            let place = middle - *stack_centre;
            poses.push([place.x, place.y, place.z, size.ln()]);
        }
        let (pose_mean, pose_deviation) = moments(&poses);
        GlandModel {
            pose_mean,
            pose_deviation,
            shape: Modes::of(&vectors),
        }
    }

    /// Parameters: pose, then modes.
    pub fn dimensions(&self) -> usize {
        POSE + self.shape.modes.len()
    }

    /// The gland at weights in standard deviations, in a stack with this middle.
    pub fn at(&self, weights: &[f64], stack_centre: DVec3) -> Gland {
        let pose: [f64; POSE] =
            std::array::from_fn(|axis| self.pose_mean[axis] + weights[axis] * self.pose_deviation[axis]);
        let middle = stack_centre + DVec3::new(pose[0], pose[1], pose[2]);
        let size = pose[3].exp();
        let vector = self.shape.at(&weights[POSE..]);
        let half = 0.5 * size * vector[vector.len() - 1] / height_weight();
        let places: Vec<DVec2> = vector[..2 * LEVELS * LANDMARKS]
            .chunks_exact(2)
            .map(|pair| middle.truncate() + size * DVec2::new(pair[0], pair[1]))
            .collect();
        Gland {
            ends: [middle.z - half, middle.z + half],
            levels: places.chunks_exact(LANDMARKS).map(<[DVec2]>::to_vec).collect(),
        }
    }

    /// The weights that come nearest to a gland.
    pub fn weights_of(&self, gland: &Gland, stack_centre: DVec3) -> Vec<f64> {
        let (middle, size) = gland.pose();
        let place = middle - stack_centre;
        let pose = [place.x, place.y, place.z, size.ln()];
        let mut weights: Vec<f64> = (0..POSE)
            .map(|axis| ((pose[axis] - self.pose_mean[axis]) / self.pose_deviation[axis]).clamp(-3.0, 3.0))
            .collect();
        weights.extend(self.shape.weights_of(&gland.vector(middle, size)));
        weights
    }

    /// The weights, in standard deviations and within [`WEIGHT_LIMIT`], that come nearest to a gland's outlines in the plane alone,
    /// wherever it lies: images do not move for somebody who shapes it. Without the height modes are not square to each other,
    /// so all weights are found at once, by least squares; none where two modes differ in the height alone.
    pub fn plane_weights(&self, gland: &Gland) -> Option<Vec<f64>> {
        let (middle, size) = gland.pose();
        let vector = gland.vector(middle, size);
        let (count, length) = (self.shape.modes.len(), 2 * LEVELS * LANDMARKS);
        let modes = DMatrix::from_fn(length, count, |row, mode| self.shape.modes[mode][row]);
        let away = DVector::from_fn(length, |row, _| vector[row] - self.shape.mean[row]);
        let weights = modes.tr_mul(&modes).cholesky()?.solve(&modes.tr_mul(&away));
        let within = weights.iter().map(|weight| weight.clamp(-WEIGHT_LIMIT, WEIGHT_LIMIT));
        Some(within.collect())
    }

    /// A gland with the weight of a mode grown by so many standard deviations, its ends where they were; none where there is
    /// no such mode.
    pub(crate) fn shaped(&self, gland: &Gland, mode: usize, by: f64) -> Option<Gland> {
        let (_, size) = gland.pose();
        let mut shaped = gland.clone();
        let places = shaped.levels.iter_mut().flatten();
        for (place, step) in places.zip(self.shape.modes.get(mode)?.chunks_exact(2)) {
            *place += size * by * DVec2::new(step[0], step[1]);
        }
        Some(shaped)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_gland_ends_half_a_slice_beyond_its_outlines_and_its_surface_counts_by_area() {
        let circle = |radius: f64| -> Vec<DVec2> {
            let corners = (0..90).map(|corner| DVec2::from_angle(std::f64::consts::TAU * f64::from(corner) / 90.0));
            corners.map(|corner| radius * corner).collect()
        };
        let outlines = [(0.0, circle(10.0)), (4.0, circle(20.0)), (10.0, circle(20.0))];
        let gland = Gland::of_outlines(&outlines).expect("a gland");
        assert_eq!(gland.ends, [-2.0, 13.0]);
        assert!(gland.section(12.9).is_some() && gland.section(13.1).is_none());
        let area = |(_, points): &(f64, Vec<SurfacePoint>)| points.iter().map(|point| point.area).sum::<f64>();
        let areas: Vec<f64> = gland.surface().map(|level| area(&level)).collect();
        assert!((areas[0] / areas[HEIGHTS - 1] - 0.5).abs() < 0.02, "{areas:?}");
    }
}
