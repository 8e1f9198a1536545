//! Linear discriminants: where along a line a boundary lies, from the grey values on it.
//!
//! For each displacement of a landmark from the true boundary, training gives the mean grey profile seen there; the
//! covariance is shared. The Mahalanobis distances to these means make a posterior over displacements, so a profile that
//! tells nothing counts little, where the distance to the mean at the boundary alone would not know.

use nalgebra::{DMatrix, DVector};
use serde::{Deserialize, Serialize};

/// Scores of displacements, linear in the profile.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Discriminant {
    /// A displacement's weights of the samples, one displacement after the other.
    weights: Vec<f32>,
    /// What is added to a displacement's score.
    offsets: Vec<f32>,
}

/// Share of the mean variance that is added to every variance, against directions that training hardly saw.
const SHRINK: f64 = 0.01;

/// What a profile says about the displacement of its landmark.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Verdict {
    /// Minus the logarithm of the probability that it is not displaced.
    pub surprise: f32,
    /// Expected displacement in steps, positive if the landmark lies outside the boundary.
    pub displacement: f32,
}

/// Sums over the profiles seen at each displacement, from which a discriminant follows.
#[derive(Debug, Clone)]
pub(crate) struct Moments {
    /// At each displacement, how many, and the sum of the profiles.
    count: Vec<f64>,
    sum: Vec<DVector<f64>>,
    /// Sum of the products of samples, all displacements together.
    products: DMatrix<f64>,
}

impl Moments {
    pub fn new(displacements: usize, samples: usize) -> Moments {
        Moments {
            count: vec![0.0; displacements],
            sum: vec![DVector::zeros(samples); displacements],
            products: DMatrix::zeros(samples, samples),
        }
    }

    pub fn add(&mut self, displacement: usize, profile: &[f32]) {
        let profile = DVector::from_iterator(profile.len(), profile.iter().map(|value| f64::from(*value)));
        self.count[displacement] += 1.0;
        self.sum[displacement] += &profile;
        self.products.ger(1.0, &profile, &profile, 1.0);
    }
}

impl Discriminant {
    /// Learns from sums of profiles.
    pub(crate) fn of(moments: &Moments) -> Discriminant {
        let means: Vec<DVector<f64>> = moments
            .sum
            .iter()
            .zip(&moments.count)
            .map(|(sum, count)| sum / count.max(1.0))
            .collect();
        // Within the displacements: what the means do not explain.
        let mut covariance = moments.products.clone();
        for (mean, count) in means.iter().zip(&moments.count) {
            covariance.ger(-count, mean, mean, 1.0);
        }
        covariance /= moments.count.iter().sum::<f64>().max(1.0);
        let samples = covariance.nrows();
        let mean_variance = (covariance.trace() / samples.max(1) as f64).max(1e-6);
        for sample in 0..samples {
            covariance[(sample, sample)] += SHRINK * mean_variance;
        }
        let (mut weights, mut offsets) = (Vec::new(), Vec::new());
        // A covariance with something on its diagonal has a Cholesky factor.
        if let Some(factor) = covariance.cholesky() {
            for mean in &means {
                let solved = factor.solve(mean);
                weights.extend(solved.iter().map(|value| *value as f32));
                offsets.push((-0.5 * mean.dot(&solved)) as f32);
            }
        }
        Discriminant { weights, offsets }
    }

    /// Sizes of the parts for so many displacements and samples: field, found, expected.
    pub(crate) fn parts(
        &self,
        field: &'static str,
        displacements: usize,
        samples: usize,
    ) -> [(&'static str, usize, usize); 2] {
        [
            (field, self.offsets.len(), displacements),
            (field, self.weights.len(), displacements * samples),
        ]
    }

    /// Judges a profile. Displacements run evenly from one side to the other, the middle one is none.
    pub(crate) fn judge(&self, profile: &[f32]) -> Verdict {
        let mut scores = [0.0_f32; MOST];
        let count = self.offsets.len().min(MOST);
        let mut largest = f32::NEG_INFINITY;
        for (index, weights) in self.weights.chunks_exact(profile.len()).take(count).enumerate() {
            scores[index] = dot(weights, profile) + self.offsets[index];
            largest = largest.max(scores[index]);
        }
        let middle = count / 2;
        let (mut sum, mut moment) = (0.0, 0.0);
        for (index, score) in scores[..count].iter().enumerate() {
            let likelihood = (score - largest).exp();
            sum += likelihood;
            moment += likelihood * (index as f32 - middle as f32);
        }
        Verdict {
            surprise: sum.ln() + largest - scores[middle],
            displacement: moment / sum,
        }
    }
}

/// Sum of products, in four sums side by side: one after the other they would wait for each other.
fn dot(one: &[f32], other: &[f32]) -> f32 {
    let (fours, rest) = one.as_chunks::<4>();
    let (other_fours, other_rest) = other.as_chunks::<4>();
    let mut sums = [0.0_f32; 4];
    for (a, b) in fours.iter().zip(other_fours) {
        for lane in 0..4 {
            sums[lane] += a[lane] * b[lane];
        }
    }
    let rest: f32 = rest.iter().zip(other_rest).map(|(a, b)| a * b).sum();
    (sums[0] + sums[1]) + (sums[2] + sums[3]) + rest
}

/// Most displacements of a discriminant.
const MOST: usize = 16;
