//! Principal components: the mean of aligned shapes and the few modes in which they differ.

use nalgebra::{DMatrix, SymmetricEigen};
use serde::{Deserialize, Serialize};

/// Share of the variance that the kept modes explain.
pub const VARIANCE_SHARE: f64 = 0.98;
/// A mode's weight lies within this many standard deviations.
pub const WEIGHT_LIMIT: f64 = 3.0;

/// Mean and modes of a set of vectors.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Modes {
    /// The mean.
    pub mean: Vec<f64>,
    /// The modes, largest first, each as long as one standard deviation of the training set along it.
    pub modes: Vec<Vec<f64>>,
}

impl Modes {
    /// Mean and modes that explain [`VARIANCE_SHARE`] of the samples' variance; all samples are equally long.
    pub fn of(samples: &[Vec<f64>]) -> Modes {
        let count = samples.len();
        let length = samples.first().map_or(0, Vec::len);
        let mut mean = vec![0.0; length];
        for sample in samples {
            for (sum, value) in mean.iter_mut().zip(sample) {
                *sum += value / count as f64;
            }
        }
        let centred = DMatrix::from_fn(length, count, |row, column| samples[column][row] - mean[row]);
        // Few samples of many coordinates: the Gram matrix has the same eigenvalues and is small.
        let spread = (count.max(2) - 1) as f64;
        let gram = (centred.transpose() * &centred) / spread;
        let eigen = SymmetricEigen::new(gram);
        let mut order: Vec<usize> = (0..count).collect();
        order.sort_by(|&a, &b| eigen.eigenvalues[b].total_cmp(&eigen.eigenvalues[a]).then(a.cmp(&b)));
        let total: f64 = eigen.eigenvalues.iter().map(|value| value.max(0.0)).sum();
        let (mut explained, mut modes) = (0.0, Vec::new());
        for index in order {
            let value = eigen.eigenvalues[index];
            if explained >= VARIANCE_SHARE * total || value <= 1e-12 * total {
                break;
            }
            explained += value;
            let mut mode = &centred * eigen.eigenvectors.column(index);
            // Its length squared is `spread * value`.
            mode /= spread.sqrt();
            // The sign is free: the largest coordinate is positive, whatever the solver returned.
            let largest = mode
                .iter()
                .copied()
                .fold(0.0, |a: f64, b| if b.abs() > a.abs() { b } else { a });
            if largest < 0.0 {
                mode.neg_mut();
            }
            modes.push(mode.iter().copied().collect());
        }
        Modes { mean, modes }
    }

    /// The vector at weights in standard deviations; missing weights are 0.
    pub fn at(&self, weights: &[f64]) -> Vec<f64> {
        let mut vector = self.mean.clone();
        for (mode, weight) in self.modes.iter().zip(weights) {
            for (value, step) in vector.iter_mut().zip(mode) {
                *value += weight * step;
            }
        }
        vector
    }

    /// The weights, in standard deviations and within [`WEIGHT_LIMIT`], that come nearest to a vector.
    pub fn weights_of(&self, vector: &[f64]) -> Vec<f64> {
        self.modes
            .iter()
            .map(|mode| {
                let (mut along, mut length) = (0.0, 0.0);
                for ((value, mean), step) in vector.iter().zip(&self.mean).zip(mode) {
                    along += (value - mean) * step;
                    length += step * step;
                }
                (along / length).clamp(-WEIGHT_LIMIT, WEIGHT_LIMIT)
            })
            .collect()
    }
}
