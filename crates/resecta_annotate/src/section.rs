//! The point distribution model of one transverse section: for an image that stands alone, and to adjust a single slice.

use glam::DVec2;
use serde::{Deserialize, Serialize};

use crate::landmarks::LANDMARKS;
use crate::principal::Modes;

/// Parameters of a section's pose: translation along x and y, rotation, and the logarithm of the scale.
pub const SECTION_POSE: usize = 4;
/// Rounds of alignment to the mean; two already agree to a thousandth.
const ROUNDS: usize = 4;

/// Pose and shape of transverse sections, learned from all levels.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SectionModel {
    /// Mean pose: place of the middle relative to that of the image, mm, rotation, rad, logarithm of the size in mm.
    pub pose_mean: [f64; SECTION_POSE],
    /// Standard deviations of the same.
    pub pose_deviation: [f64; SECTION_POSE],
    /// Shape of the aligned sections.
    pub shape: Modes,
}

/// Where a section lies, how it is turned, and how large it is.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Similarity {
    middle: DVec2,
    /// Cosine and sine of the rotation, times the size in mm.
    turn: DVec2,
}

impl Similarity {
    fn apply(&self, shape: &[f64]) -> Vec<DVec2> {
        shape
            .chunks_exact(2)
            .map(|pair| self.middle + self.turn.rotate(DVec2::new(pair[0], pair[1])))
            .collect()
    }

    /// The one that brings a shape about its middle nearest to landmarks, least squares.
    fn between(shape: &[f64], landmarks: &[DVec2]) -> Similarity {
        let middle = landmarks.iter().sum::<DVec2>() / landmarks.len() as f64;
        let (mut turn, mut squares) = (DVec2::ZERO, 0.0);
        for (pair, place) in shape.chunks_exact(2).zip(landmarks) {
            let (from, to) = (DVec2::new(pair[0], pair[1]), *place - middle);
            turn += DVec2::new(from.dot(to), from.perp_dot(to));
            squares += from.length_squared();
        }
        Similarity {
            middle,
            turn: turn / squares.max(f64::MIN_POSITIVE),
        }
    }

    /// The landmarks as the shape that this would bring to them.
    fn undo(&self, landmarks: &[DVec2]) -> Vec<f64> {
        let back = DVec2::new(self.turn.x, -self.turn.y) / self.turn.length_squared();
        landmarks
            .iter()
            .flat_map(|place| back.rotate(*place - self.middle).to_array())
            .collect()
    }

    fn parameters(&self, image_centre: DVec2) -> [f64; SECTION_POSE] {
        let place = self.middle - image_centre;
        [place.x, place.y, self.turn.to_angle(), self.turn.length().ln()]
    }

    fn of_parameters(parameters: [f64; SECTION_POSE], image_centre: DVec2) -> Similarity {
        let [x, y, angle, size] = parameters;
        Similarity {
            middle: image_centre + DVec2::new(x, y),
            turn: DVec2::from_angle(angle) * size.exp(),
        }
    }
}

impl SectionModel {
    /// Learns from sections and the middles of the images that show them, by generalised Procrustes alignment.
    pub fn of(sections: &[(Vec<DVec2>, DVec2)]) -> SectionModel {
        // The first guess of the mean, of size 1: a circle, anterior landmark first, so that nothing hangs on the first case.
        let mut mean: Vec<f64> = (0..LANDMARKS)
            .flat_map(|landmark| {
                let angle = std::f64::consts::TAU * (landmark as f64 / LANDMARKS as f64 - 0.25);
                DVec2::from_angle(angle).to_array()
            })
            .collect();
        let mut aligned: Vec<Vec<f64>> = Vec::new();
        for _ in 0..ROUNDS {
            aligned = sections
                .iter()
                .map(|(section, _)| Similarity::between(&mean, section).undo(section))
                .collect();
            mean = Modes::of(&aligned).mean;
            let size = (mean.iter().map(|value| value * value).sum::<f64>() / LANDMARKS as f64).sqrt();
            mean.iter_mut().for_each(|value| *value /= size);
        }
        let poses: Vec<[f64; SECTION_POSE]> = sections
            .iter()
            .map(|(section, centre)| Similarity::between(&mean, section).parameters(*centre))
            .collect();
        let (pose_mean, pose_deviation) = moments(&poses);
        SectionModel {
            pose_mean,
            pose_deviation,
            shape: Modes::of(&aligned),
        }
    }

    /// Parameters: pose, then modes.
    pub fn dimensions(&self) -> usize {
        SECTION_POSE + self.shape.modes.len()
    }

    /// The landmarks at weights in standard deviations, in an image with this middle.
    pub fn at(&self, weights: &[f64], image_centre: DVec2) -> Vec<DVec2> {
        let pose = std::array::from_fn(|axis| self.pose_mean[axis] + weights[axis] * self.pose_deviation[axis]);
        Similarity::of_parameters(pose, image_centre).apply(&self.shape.at(&weights[SECTION_POSE..]))
    }

    /// The weights that come nearest to a section's landmarks.
    pub fn weights_of(&self, section: &[DVec2], image_centre: DVec2) -> Vec<f64> {
        let pose = Similarity::between(&self.shape.mean, section);
        let parameters = pose.parameters(image_centre);
        let mut weights: Vec<f64> = (0..SECTION_POSE)
            .map(|axis| ((parameters[axis] - self.pose_mean[axis]) / self.pose_deviation[axis]).clamp(-3.0, 3.0))
            .collect();
        weights.extend(self.shape.weights_of(&pose.undo(section)));
        weights
    }

    /// The weights of the modes alone, wherever the section lies.
    pub fn mode_weights(&self, section: &[DVec2]) -> Vec<f64> {
        self.weights_of(section, DVec2::ZERO).split_off(SECTION_POSE)
    }
}

/// Means and standard deviations of parameters, the latter never nothing.
pub(crate) fn moments<const N: usize>(samples: &[[f64; N]]) -> ([f64; N], [f64; N]) {
    let count = samples.len().max(1) as f64;
    let mean: [f64; N] = std::array::from_fn(|axis| samples.iter().map(|sample| sample[axis]).sum::<f64>() / count);
    let deviation = std::array::from_fn(|axis| {
        let squares: f64 = samples.iter().map(|sample| (sample[axis] - mean[axis]).powi(2)).sum();
        (squares / (count - 1.0).max(1.0)).sqrt().max(1e-6)
    });
    (mean, deviation)
}

#[cfg(test)]
mod tests {
    use super::*;
    use resecta_anatomy::random::SplitMix64;

    fn sections() -> Vec<(Vec<DVec2>, DVec2)> {
        let mut random = SplitMix64::new(5);
        (0..40)
            .map(|_| {
                let (wide, lean) = (1.2 + 0.1 * random.signed(), 0.05 * random.signed());
                let (size, place) = (
                    20.0 + 3.0 * random.signed(),
                    DVec2::new(random.signed(), random.signed()),
                );
                let section = (0..LANDMARKS).map(|landmark| {
                    let angle = std::f64::consts::TAU * (landmark as f64 / LANDMARKS as f64 - 0.25);
                    place + size * DVec2::new(wide * angle.cos(), angle.sin() + lean * (2.0 * angle).cos())
                });
                (section.collect(), DVec2::ZERO)
            })
            .collect()
    }

    #[test]
    fn it_gives_back_what_it_learned_from() {
        let sections = sections();
        let model = SectionModel::of(&sections);
        assert!(model.shape.modes.len() <= 4, "{}", model.shape.modes.len());
        for (section, centre) in &sections {
            let again = model.at(&model.weights_of(section, *centre), *centre);
            for (one, other) in section.iter().zip(&again) {
                assert!(one.distance(*other) < 0.8, "{one} {other}");
            }
        }
    }

    #[test]
    fn a_moved_turned_and_scaled_section_has_the_same_shape() {
        let model = SectionModel::of(&sections());
        let (section, centre) = &sections()[3];
        let moved: Vec<DVec2> = section
            .iter()
            .map(|place| DVec2::from_angle(0.01).rotate(*place) * 1.05 + DVec2::new(0.2, -0.1))
            .collect();
        let (one, other) = (model.weights_of(section, *centre), model.weights_of(&moved, *centre));
        for (one, other) in one[SECTION_POSE..].iter().zip(&other[SECTION_POSE..]) {
            assert!((one - other).abs() < 1e-9);
        }
    }
}
