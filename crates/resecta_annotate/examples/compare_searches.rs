//! Compares searches for the whole gland at equal numbers of evaluations, and settings of the genetic algorithm.
//!
//! `cargo run --release -p resecta_annotate --example compare_searches -- FOLDER SPACING [SVG]`, with `FOLDER` and `SPACING`
//! as `shared/volumes.rs` reads them. Every gland is searched with a model that learned from others: the volumes each left
//! out once, and synthetic glands. An error is given less the least that any search found for that gland; a distance is the
//! mean over the slices that the gland found and the drawn one share.

mod shared {
    pub mod chart;
    pub mod synthetic;
    pub mod volumes;
}

use std::path::Path;

use rayon::prelude::*;
use resecta_anatomy::random::SplitMix64;
use resecta_annotate::compare::mean_distance_mm;
use resecta_annotate::search::{Found, GeneticOptions, genetic_then_local, local, random};
use resecta_annotate::{GlandSearch, Model, SyntheticOptions, TrainingCase};
use shared::chart::{Chart, Series, quantile, quartiles};

/// Evaluations that every search may make.
const EVALUATIONS: usize = 3000;
/// Those of them that a compass search makes from what the genetic algorithm found.
const REFINEMENT: usize = 600;
const SEEDS: u64 = 2;
/// Synthetic glands to learn from, and others to search.
const LEARNED: u64 = 20;
const SEARCHED: u64 = 4;

/// Ways that are drawn, and tried on synthetic glands too; the rest are settings.
const DRAWN: usize = 5;

/// How a gland is searched.
enum Way {
    Genetic(GeneticOptions, usize),
    /// From the mean gland, once.
    Compass,
    /// From the mean gland, then from random ones.
    CompassAgain,
    Random,
}

struct Task {
    case: TrainingCase,
    model: Model,
    is_synthetic: bool,
}

/// What a way found in a task with a seed.
struct Outcome {
    task: usize,
    found: Found,
    distance_mm: f64,
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [folder, spacing, rest @ ..] = arguments.as_slice() else {
        return Err("expected FOLDER SPACING [SVG]".into());
    };
    let tasks = tasks(&shared::volumes::cases(Path::new(folder), spacing.parse()?)?)?;
    let ways = ways();
    let volumes = tasks.len() - SEARCHED as usize;
    let outcomes: Vec<Vec<Outcome>> = ways
        .iter()
        .enumerate()
        .map(|(place, (_, way))| search_all(way, if place < DRAWN { &tasks } else { &tasks[..volumes] }))
        .collect();
    let mut least = vec![f64::INFINITY; tasks.len()];
    for outcome in outcomes.iter().flatten() {
        least[outcome.task] = least[outcome.task].min(outcome.found.error);
    }
    let above_least = |outcome: &Outcome, evaluations: usize| {
        let until = outcome.found.history.iter().take_while(|(at, _)| *at <= evaluations);
        until.last().map_or(f64::NAN, |(_, error)| error - least[outcome.task])
    };

    println!(
        "{volumes} volumes and {SEARCHED} synthetic glands, {SEEDS} seeds; median (quartiles) of the error above the least found"
    );
    println!(
        "search                          evaluations   at 500              at 1500             at the end          90 %   volumes, mm       synthetic, mm"
    );
    for ((name, _), outcomes) in ways.iter().zip(&outcomes) {
        let used = quartiles(
            outcomes
                .iter()
                .map(|outcome| outcome.found.evaluations as f64)
                .collect(),
        )[1];
        print!("{name:31} {used:6.0}      ");
        for evaluations in [500, 1500, usize::MAX] {
            let [low, middle, high] = quartiles(outcomes.iter().map(|of| above_least(of, evaluations)).collect());
            print!("{middle:5.2} ({low:5.2} {high:5.2}) ");
        }
        let mut all: Vec<f64> = outcomes.iter().map(|of| above_least(of, usize::MAX)).collect();
        all.sort_by(f64::total_cmp);
        print!("{:5.2}", quantile(&all, 0.9));
        for synthetic in [false, true] {
            let these = outcomes.iter().filter(|of| tasks[of.task].is_synthetic == synthetic);
            let distances: Vec<f64> = these.map(|of| of.distance_mm).collect();
            if !distances.is_empty() {
                let [low, middle, high] = quartiles(distances);
                print!("  {middle:4.2} ({low:4.2} {high:4.2})");
            }
        }
        println!();
    }
    if let [svg, ..] = rest {
        let series = ways.iter().zip(&outcomes).take(DRAWN).map(|((name, _), outcomes)| {
            let at = |evaluations: usize| quartiles(outcomes.iter().map(|of| above_least(of, evaluations)).collect());
            let points = (1..=EVALUATIONS / 25).map(|step| (25.0 * step as f64, at(25 * step)));
            Series {
                name: (*name).to_owned(),
                points: points.collect(),
            }
        });
        Chart {
            caption: "Searches for the whole gland: median and quartiles over glands and seeds",
            axes: ["evaluations of the error function", "error above the least found"],
            across: 0.0..EVALUATIONS as f64,
            up: 0.03..100.0,
            logarithmic: true,
            series: series.collect(),
        }
        .draw(Path::new(svg))?;
    }
    Ok(())
}

/// The five searches that are drawn, then settings of the one in use, each beside its default.
fn ways() -> Vec<(&'static str, Way)> {
    let usual = GeneticOptions::default();
    let patient = GeneticOptions {
        evaluations: EVALUATIONS,
        patience: EVALUATIONS,
        ..usual.clone()
    };
    let mut ways = vec![
        ("in use: genetic, then compass", Way::Genetic(usual.clone(), REFINEMENT)),
        ("genetic alone", Way::Genetic(patient, 0)),
        ("compass from the mean", Way::Compass),
        ("compass, starts at random", Way::CompassAgain),
        ("random", Way::Random),
    ];
    let mut with = |name: &'static str, change: &dyn Fn(&mut GeneticOptions)| {
        let mut options = usual.clone();
        change(&mut options);
        ways.push((name, Way::Genetic(options, REFINEMENT)));
    };
    with("population 16", &|options| options.population = 16);
    with("population 32", &|options| options.population = 32);
    with("population 96", &|options| options.population = 96);
    with("blend 0.1", &|options| options.blend = 0.1);
    with("blend 0.5", &|options| options.blend = 0.5);
    with("mutation 0.05", &|options| options.mutation = 0.05);
    with("mutation 0.3", &|options| options.mutation = 0.3);
    with("elite 0", &|options| options.elite = 0);
    with("elite 6", &|options| options.elite = 6);
    with("patience 8", &|options| options.patience = 8);
    with("patience without end", &|options| options.patience = EVALUATIONS);
    with("1200 and 600 evaluations", &|options| options.evaluations = 1200);
    with("4800 and 600 evaluations", &|options| options.evaluations = 4800);
    ways.push(("2400 and 0 evaluations", Way::Genetic(usual.clone(), 0)));
    ways.push(("2400 and 1200 evaluations", Way::Genetic(usual, 1200)));
    ways
}

fn tasks(volumes: &[TrainingCase]) -> Result<Vec<Task>, Box<dyn std::error::Error>> {
    let mut tasks = Vec::new();
    for left_out in 0..volumes.len() {
        let mut others = volumes.to_vec();
        let case = others.remove(left_out);
        tasks.push(Task {
            case,
            model: Model::learn(&others)?,
            is_synthetic: false,
        });
    }
    let options = SyntheticOptions {
        spacing_mm: 0.8,
        ..SyntheticOptions::MODERATE
    };
    let gland = |seed| shared::synthetic::gland(seed, &options);
    let model = Model::learn(&(1..=LEARNED).map(gland).collect::<Result<Vec<_>, _>>()?)?;
    for seed in LEARNED + 1..=LEARNED + SEARCHED {
        tasks.push(Task {
            case: gland(seed)?,
            model: model.clone(),
            is_synthetic: true,
        });
    }
    Ok(tasks)
}

fn search_all(way: &Way, tasks: &[Task]) -> Vec<Outcome> {
    let runs: Vec<(usize, u64)> = (0..tasks.len())
        .flat_map(|task| (1..=SEEDS).map(move |seed| (task, seed)))
        .collect();
    runs.into_par_iter()
        .map(|(index, seed)| {
            let task = &tasks[index];
            let search = GlandSearch::new(&task.case.stack, &task.model);
            let found = run(way, &search, seed);
            let gland = search.gland(&found.weights);
            let distances: Vec<f64> = task
                .case
                .outlines
                .iter()
                .filter_map(|(z, drawn)| Some(mean_distance_mm(drawn, &gland.section(*z)?)))
                .collect();
            Outcome {
                task: index,
                found,
                distance_mm: distances.iter().sum::<f64>() / distances.len().max(1) as f64,
            }
        })
        .collect()
}

fn run(way: &Way, search: &GlandSearch, seed: u64) -> Found {
    let error = |weights: &[f64]| search.error(weights);
    let mean = vec![0.0; search.dimensions()];
    match way {
        Way::Genetic(options, refinement) => genetic_then_local(&[mean], options, *refinement, seed, error),
        Way::Compass => local(&mean, EVALUATIONS, error),
        Way::CompassAgain => compass_again(&mean, seed, error),
        Way::Random => random(&mean, EVALUATIONS, seed, error),
    }
}

/// A compass search from a start, then from others drawn as the first generation of the genetic algorithm is.
fn compass_again(start: &[f64], seed: u64, error: impl Fn(&[f64]) -> f64) -> Found {
    let mut source = SplitMix64::new(seed);
    let spread = GeneticOptions::default().spread;
    let mut found = local(start, EVALUATIONS, &error);
    while found.evaluations < EVALUATIONS {
        let start: Vec<f64> = start
            .iter()
            // A sum of twelve even numbers is nearly normal.
            .map(|weight| weight + spread * ((0..12).map(|_| source.unit()).sum::<f64>() - 6.0))
            .collect();
        let again = local(&start, EVALUATIONS - found.evaluations, &error);
        for (evaluations, error) in &again.history {
            if *error < found.history[found.history.len() - 1].1 {
                found.history.push((found.evaluations + evaluations, *error));
            }
        }
        found.evaluations += again.evaluations;
        if again.error < found.error {
            (found.weights, found.error) = (again.weights, again.error);
        }
    }
    found
}
