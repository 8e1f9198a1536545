//! What the genetic algorithm is compared with, and the refinement after it: a compass search, and chance.

use resecta_anatomy::random::SplitMix64;

use super::genetic::gaussian;
use super::{Found, limit};

/// First step of the compass, in standard deviations, and the one below which it stops.
const STEPS: [f64; 2] = [0.5, 0.01];

/// A compass search: one weight after the other a step up or down, the better stays; where none is better the step halves.
pub fn local(start: &[f64], evaluations: usize, error: impl Fn(&[f64]) -> f64) -> Found {
    let mut found = Found::start(start.to_vec(), error(start));
    let mut step = STEPS[0];
    while step >= STEPS[1] {
        let before = found.error;
        for axis in 0..start.len() {
            for sign in [1.0, -1.0] {
                if found.evaluations >= evaluations {
                    return found;
                }
                let mut weights = found.weights.clone();
                weights[axis] = limit(weights[axis] + sign * step);
                let value = error(&weights);
                if found.offer(&weights, value) {
                    break;
                }
            }
        }
        if found.error >= before {
            step *= 0.5;
        }
    }
    found
}

/// Independent draws from the normal distribution of the weights.
pub fn random(start: &[f64], evaluations: usize, seed: u64, error: impl Fn(&[f64]) -> f64) -> Found {
    let mut source = SplitMix64::new(seed);
    let mut found = Found::start(start.to_vec(), error(start));
    while found.evaluations < evaluations {
        let weights: Vec<f64> = start.iter().map(|_| limit(gaussian(&mut source))).collect();
        let value = error(&weights);
        found.offer(&weights, value);
    }
    found
}
