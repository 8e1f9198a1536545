//! Searches for the least of an error over weights in standard deviations, each within [`WEIGHT_LIMIT`].
//!
//! The genetic algorithm is the one in use; the others are there to be compared with it at equal evaluations.

mod genetic;
mod local;

pub use genetic::{GeneticOptions, genetic};
pub use local::{local, random};

use crate::principal::WEIGHT_LIMIT;

/// What a search found.
#[derive(Debug, Clone, PartialEq)]
pub struct Found {
    /// Where the error is least, of the places looked at.
    pub weights: Vec<f64>,
    /// The error there.
    pub error: f64,
    /// Evaluations of the error.
    pub evaluations: usize,
    /// Evaluations made and least error so far, whenever it fell.
    pub history: Vec<(usize, f64)>,
}

impl Found {
    fn start(weights: Vec<f64>, error: f64) -> Found {
        Found {
            weights,
            error,
            evaluations: 1,
            history: vec![(1, error)],
        }
    }

    /// Counts an evaluation; whether it is the best so far.
    fn offer(&mut self, weights: &[f64], error: f64) -> bool {
        self.evaluations += 1;
        let better = error < self.error;
        if better {
            self.weights.copy_from_slice(weights);
            self.error = error;
            self.history.push((self.evaluations, error));
        }
        better
    }
}

/// The genetic algorithm, then a compass search from what it found.
pub fn genetic_then_local(
    starts: &[Vec<f64>],
    options: &GeneticOptions,
    refinement: usize,
    seed: u64,
    error: impl Fn(&[f64]) -> f64 + Sync,
) -> Found {
    let mut found = genetic(starts, options, seed, &error);
    if refinement > 0 {
        let refined = local(&found.weights, refinement, &error);
        let later = refined.history[1..].iter();
        found
            .history
            .extend(later.map(|(evaluations, error)| (found.evaluations + evaluations, *error)));
        found.evaluations += refined.evaluations;
        (found.weights, found.error) = (refined.weights, refined.error);
    }
    found
}

fn limit(weight: f64) -> f64 {
    weight.clamp(-WEIGHT_LIMIT, WEIGHT_LIMIT)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A bowl with ripples; least at 0.5 along each axis.
    fn rippled(weights: &[f64]) -> f64 {
        weights
            .iter()
            .map(|weight| {
                let away = weight - 0.5;
                away * away + 0.3 * (1.0 - (6.0 * away).cos())
            })
            .sum()
    }

    #[test]
    fn the_genetic_algorithm_finds_the_least_among_ripples() {
        let found = genetic(&[vec![-2.0; 6]], &GeneticOptions::default(), 7, rippled);
        assert!(found.error < 0.05, "{found:?}");
        assert!(found.weights.iter().all(|weight| weight.abs() <= WEIGHT_LIMIT));
    }

    #[test]
    fn it_finds_the_same_bits_with_any_number_of_threads() {
        let run = |threads| {
            let pool = rayon::ThreadPoolBuilder::new()
                .num_threads(threads)
                .build()
                .expect("threads");
            pool.install(|| genetic(&[vec![1.0; 5]], &GeneticOptions::default(), 3, rippled))
        };
        let bits = |found: &Found| -> Vec<u64> { found.weights.iter().map(|weight| weight.to_bits()).collect() };
        let (one, four) = (run(1), run(4));
        assert_eq!(bits(&one), bits(&four));
        assert_eq!(one, four);
    }

    #[test]
    fn no_search_is_worse_than_its_start_nor_looks_more_often_than_allowed() {
        let start = vec![2.0, -1.0, 0.3];
        let at_start = rippled(&start);
        let few = GeneticOptions {
            evaluations: 300,
            ..GeneticOptions::default()
        };
        for found in [
            genetic(std::slice::from_ref(&start), &few, 1, rippled),
            local(&start, 300, rippled),
            random(&start, 300, 1, rippled),
        ] {
            assert!(found.error <= at_start);
            assert!(found.evaluations <= 300, "{}", found.evaluations);
        }
    }
}
