//! Trains on synthetic glands, annotates others in rising noise, and prints how far the outlines found are from the exact
//! ones.
//!
//! `cargo run --release -p resecta_annotate --example rising_noise -- [SVG]`. One model learned from images of all levels of
//! noise, from clear to poor; every level shows the same glands, of sizes and seeds not learned from.

mod shared {
    pub mod chart;
    pub mod synthetic;
}

use std::path::Path;

use rayon::prelude::*;
use resecta_annotate::compare::{Overlap, distances_mm};
use resecta_annotate::{Gland, GlandSearch, Model, SyntheticOptions, TrainingCase, annotate};
use shared::chart::{Chart, Series, quantile, quartiles};

/// Glands learned from, and others annotated at every level.
const LEARNED: u64 = 20;
const ANNOTATED: u64 = 6;
/// Distance between pixels, mm.
const SPACING_MM: f64 = 0.5;
/// Levels of noise: 0 is light, 1 moderate, 2 heavy, and more goes on so.
const LEVELS: [f64; 6] = [0.0, 0.5, 1.0, 1.5, 2.0, 2.5];

/// One slice of a gland not learned from.
struct Seen {
    distances_mm: Vec<f64>,
    expected_mm: f64,
    is_flagged: bool,
}

/// One gland not learned from.
struct Annotated {
    slices: Vec<Seen>,
    overlap: Overlap,
    /// Distances between the exact outlines and what comes nearest of the model.
    nearest_mm: Vec<f64>,
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let cases = (1..=LEARNED)
        .into_par_iter()
        .map(|seed| gland(seed, 2.0 * (seed % 5) as f64 / 4.0))
        .collect::<Result<Vec<_>, String>>()?;
    let model = Model::train(&cases, "synthetic glands", 1, |_, _| {})?;
    println!(
        "{LEARNED} glands learned from ({} modes, slices adjusted: {}), {ANNOTATED} others annotated",
        model.gland.shape.modes.len(),
        model.adjusts_slices
    );
    println!("level                mean, mm  95 %, mm   Dice  flagged  expected, mm  nearest of the model, mm");
    let mut points = [Vec::new(), Vec::new()];
    for level in LEVELS {
        let found = annotate_all(&model, |seed| gland(seed, level))?;
        let means = report(&format!("{level:.1}"), &found);
        points[0].push((level, means));
        let slices = found.iter().flat_map(|gland| &gland.slices);
        points[1].push((level, quartiles(slices.map(|slice| slice.expected_mm).collect())));
    }
    for (name, change) in [
        (
            "moderate, 1 look",
            (|options| options.looks = 1) as fn(&mut SyntheticOptions),
        ),
        ("moderate, 0 dB", |options| options.gland_db = 0.0),
        ("moderate, 20 stones", |options| options.calcifications = 20),
    ] {
        let mut options = options(1.0);
        change(&mut options);
        report(name, &annotate_all(&model, |seed| shown(seed, &options))?);
    }
    if let Some(svg) = std::env::args().nth(1) {
        let [found, expected] = points;
        Chart {
            caption: "Synthetic glands in rising noise: median and quartiles over slices",
            axes: ["level of noise: 0 light, 1 moderate, 2 heavy", "mean distance, mm"],
            across: 0.0..LEVELS[LEVELS.len() - 1],
            up: 0.0..3.0,
            logarithmic: false,
            series: vec![
                Series {
                    name: "to the exact outline".into(),
                    points: found,
                },
                Series {
                    name: "as expected from the fit".into(),
                    points: expected,
                },
            ],
        }
        .draw(Path::new(&svg))?;
    }
    Ok(())
}

/// Between the levels linearly; looks by ratios, and at least one.
fn options(level: f64) -> SyntheticOptions {
    let (from, to, share) = if level < 1.0 {
        (SyntheticOptions::LIGHT, SyntheticOptions::MODERATE, level)
    } else {
        (SyntheticOptions::MODERATE, SyntheticOptions::HEAVY, level - 1.0)
    };
    let between = |from: f64, to: f64| from + share * (to - from);
    let looks = between(f64::from(from.looks).ln(), f64::from(to.looks).ln()).exp();
    SyntheticOptions {
        spacing_mm: SPACING_MM,
        looks: (looks.round() as u32).max(1),
        gland_db: between(from.gland_db, to.gland_db),
        texture_db: between(from.texture_db, to.texture_db),
        noise_db: between(from.noise_db, to.noise_db),
        attenuation_db_per_cm_mhz: between(from.attenuation_db_per_cm_mhz, to.attenuation_db_per_cm_mhz),
        calcifications: between(f64::from(from.calcifications), f64::from(to.calcifications)).round() as u32,
        ..from
    }
}

fn gland(seed: u64, level: f64) -> Result<TrainingCase, String> {
    shown(seed, &options(level))
}

fn shown(seed: u64, options: &SyntheticOptions) -> Result<TrainingCase, String> {
    shared::synthetic::gland(seed, options).map_err(|problem| problem.to_string())
}

fn annotate_all(
    model: &Model,
    gland: impl Fn(u64) -> Result<TrainingCase, String> + Sync,
) -> Result<Vec<Annotated>, String> {
    (1001..=1000 + ANNOTATED)
        .into_par_iter()
        .map(|seed| {
            let case = gland(seed)?;
            let found = annotate(&case.stack, model, 1, |_, _| {}).map_err(|problem| problem.to_string())?;
            let search = GlandSearch::new(&case.stack, model);
            let truth = Gland::of_outlines(&case.outlines).ok_or("no gland")?;
            let nearest = search.gland(&search.weights_of(&truth));
            let mut annotated = Annotated {
                slices: Vec::new(),
                overlap: Overlap::default(),
                nearest_mm: Vec::new(),
            };
            for (z, exact) in &case.outlines {
                let slice = found.slices.iter().find(|slice| (slice.z_mm - z).abs() < 1e-6);
                annotated.overlap += Overlap::of(exact, slice.map_or(&[], |slice| &slice.capsule));
                if let Some(slice) = slice {
                    annotated.slices.push(Seen {
                        distances_mm: distances_mm(exact, &slice.capsule),
                        expected_mm: slice.error_mm,
                        is_flagged: !slice.flags.is_empty(),
                    });
                }
                if let Some(nearest) = nearest.section(*z) {
                    annotated.nearest_mm.extend(distances_mm(exact, &nearest));
                }
            }
            Ok(annotated)
        })
        .collect()
}

/// Prints a row; quartiles over the slices of the mean distance.
fn report(name: &str, found: &[Annotated]) -> [f64; 3] {
    let slices: Vec<&Seen> = found.iter().flat_map(|gland| &gland.slices).collect();
    let mean = |values: &[f64]| values.iter().sum::<f64>() / values.len().max(1) as f64;
    let mut all: Vec<f64> = slices
        .iter()
        .flat_map(|slice| slice.distances_mm.iter().copied())
        .collect();
    all.sort_by(f64::total_cmp);
    let dice: Vec<f64> = found.iter().map(|gland| gland.overlap.dice()).collect();
    let flagged = slices.iter().filter(|slice| slice.is_flagged).count() as f64 / slices.len().max(1) as f64;
    let expected: Vec<f64> = slices.iter().map(|slice| slice.expected_mm).collect();
    let nearest: Vec<f64> = found
        .iter()
        .flat_map(|gland| gland.nearest_mm.iter().copied())
        .collect();
    println!(
        "{name:20} {:8.2}  {:8.2}  {:.3}  {flagged:7.2}  {:12.2}  {:8.2}",
        mean(&all),
        quantile(&all, 0.95),
        mean(&dice),
        mean(&expected),
        mean(&nearest)
    );
    quartiles(slices.iter().map(|slice| mean(&slice.distances_mm)).collect())
}
