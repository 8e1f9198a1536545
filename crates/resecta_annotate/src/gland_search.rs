//! The search for the whole gland in one stack.

use resecta_anatomy::contour;

use crate::field::Field;
use crate::gland::{Gland, POSE};
use crate::search::{Found, GeneticOptions, genetic_then_local};
use crate::{Model, Stack};

/// Evaluations of the compass search after each genetic one.
pub(crate) const REFINEMENT: usize = 600;

/// What a search for the whole gland in one stack makes least, and the gland at any weights.
pub struct GlandSearch<'a> {
    model: &'a Model,
    pub(crate) field: Field,
}

impl<'a> GlandSearch<'a> {
    /// In a stack, with a model.
    pub fn new(stack: &Stack, model: &'a Model) -> GlandSearch<'a> {
        GlandSearch {
            model,
            field: Field::of(stack),
        }
    }

    /// Weights of a gland: pose, then modes.
    pub fn dimensions(&self) -> usize {
        self.model.gland.dimensions()
    }

    /// The error at weights in standard deviations: what the grey values say against it, and how unusual it is.
    pub fn error(&self, weights: &[f64]) -> f64 {
        self.model.gland_error(&self.field, weights, self.field.centre())
    }

    /// The gland at weights in standard deviations.
    pub fn gland(&self, weights: &[f64]) -> Gland {
        self.model.gland.at(weights, self.field.centre())
    }

    /// The weights that come nearest to a gland.
    pub fn weights_of(&self, gland: &Gland) -> Vec<f64> {
        self.model.gland.weights_of(gland, self.field.centre())
    }

    /// The gland of least error: the genetic algorithm, then a compass search from what it found.
    pub fn run(&self, seed: u64) -> Found {
        let start = vec![0.0; self.dimensions()];
        let mut found = genetic_then_local(&[start], &GeneticOptions::default(), REFINEMENT, seed, |weights| {
            self.error(weights)
        });
        // A shape far from the mean may cross itself, small as its probability is: it is drawn back until it does not.
        for _ in 0..20 {
            let gland = self.gland(&found.weights);
            if gland.levels.iter().all(|level| contour::self_crossing(level).is_none()) {
                break;
            }
            found.weights[POSE..].iter_mut().for_each(|weight| *weight *= 0.8);
        }
        found
    }
}
