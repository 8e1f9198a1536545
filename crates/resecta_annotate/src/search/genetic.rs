//! The genetic algorithm.

use rayon::prelude::*;
use resecta_anatomy::random::SplitMix64;

use super::{Found, limit};

/// How the genetic algorithm works.
#[derive(Debug, Clone, PartialEq)]
pub struct GeneticOptions {
    /// Individuals of a generation.
    pub population: usize,
    /// Most evaluations of the error.
    pub evaluations: usize,
    /// Generations without a better individual after which it stops.
    pub patience: usize,
    /// Spread of the first generation about the starts, and of early mutations, in standard deviations.
    pub spread: f64,
    /// The best that pass unchanged.
    pub elite: usize,
    /// How far beyond its parents a child may lie, as a share of their distance (blend crossover).
    pub blend: f64,
    /// Chance that a weight mutates.
    pub mutation: f64,
}

impl Default for GeneticOptions {
    fn default() -> Self {
        Self {
            population: 48,
            evaluations: 2400,
            patience: 25,
            spread: 0.8,
            elite: 2,
            blend: 0.3,
            mutation: 0.15,
        }
    }
}

/// Individuals that a tournament for parenthood is held among.
const TOURNAMENT: usize = 3;
/// How the spread of mutations shrinks a generation.
const COOLING: f64 = 0.965;

/// Looks for the least error from some starts: a first generation spread about them, tournaments, blend crossover,
/// Gaussian mutations that cool, and an elite that stays.
///
/// Children are drawn one after the other and judged in parallel, so a seed gives the same bits with any number of threads.
/// `starts` are equally long and at least one.
pub fn genetic(
    starts: &[Vec<f64>],
    options: &GeneticOptions,
    seed: u64,
    error: impl Fn(&[f64]) -> f64 + Sync,
) -> Found {
    let mut random = SplitMix64::new(seed);
    let judge = |individuals: Vec<Vec<f64>>| -> Vec<(f64, Vec<f64>)> {
        individuals
            .into_par_iter()
            .map(|weights| (error(&weights), weights))
            .collect()
    };
    let mut individuals: Vec<Vec<f64>> = starts.to_vec();
    while individuals.len() < options.population {
        let start = &starts[individuals.len() % starts.len()];
        let child = start
            .iter()
            .map(|weight| limit(weight + options.spread * gaussian(&mut random)));
        individuals.push(child.collect());
    }
    individuals.truncate(options.evaluations.max(1));
    let mut generation = judge(individuals);
    let mut found = Found::start(generation[0].1.clone(), generation[0].0);
    for (error, weights) in &generation[1..] {
        found.offer(weights, *error);
    }
    let (mut spread, mut idle) = (options.spread, 0);
    while idle < options.patience && found.evaluations < options.evaluations {
        // A stable sort: equals keep the order in which they were born.
        generation.sort_by(|one, other| one.0.total_cmp(&other.0));
        let room =
            (options.population.saturating_sub(options.elite).max(1)).min(options.evaluations - found.evaluations);
        let children = (0..room)
            .map(|_| child(&generation, options, spread, &mut random))
            .collect();
        generation.truncate(options.elite);
        let before = found.error;
        for (error, weights) in judge(children) {
            found.offer(&weights, error);
            generation.push((error, weights));
        }
        idle = if found.error < before { 0 } else { idle + 1 };
        spread *= COOLING;
    }
    found
}

fn child(generation: &[(f64, Vec<f64>)], options: &GeneticOptions, spread: f64, random: &mut SplitMix64) -> Vec<f64> {
    let mut parent = || {
        // The generation is sorted: the smallest index is the best.
        let drawn = (0..TOURNAMENT).map(|_| (random.unit() * generation.len() as f64) as usize);
        &generation[drawn.min().unwrap_or(0)].1
    };
    let (mother, father) = (parent(), parent());
    mother
        .iter()
        .zip(father)
        .map(|(one, other)| {
            let share = random.between([-options.blend, 1.0 + options.blend]);
            let mut weight = one + share * (other - one);
            if random.unit() < options.mutation {
                weight += spread * gaussian(random);
            }
            limit(weight)
        })
        .collect()
}

/// A draw from the normal distribution (Box and Muller).
pub(super) fn gaussian(random: &mut SplitMix64) -> f64 {
    let radius = (-2.0 * (1.0 - random.unit()).ln()).sqrt();
    radius * (std::f64::consts::TAU * random.unit()).cos()
}
