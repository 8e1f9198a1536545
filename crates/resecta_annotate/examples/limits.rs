//! Prints what limits how well a gland is found: voxels, the shape model, the grey values, or the search.
//!
//! `cargo run --release -p resecta_annotate --example limits -- FOLDER SPACING`, with `FOLDER` and `SPACING` as `shared/volumes.rs` reads
//! them. Each case is looked at with a model that learned from the others. Rows are medians over the cases.

mod shared {
    pub mod volumes;
}

use std::path::Path;

use glam::DVec2;
use rayon::prelude::*;
use resecta_annotate::{Gland, GlandSearch, Model, TrainingCase, overlap_of_parts, search};

type Outlines = Vec<(f64, Vec<DVec2>)>;

/// Evaluations of the compass search from the outlines drawn.
const NEARBY: usize = 2000;

/// What was looked at, Dice's coefficients by part, and the ends' errors, mm.
type Row = (&'static str, [f64; 3], Option<[f64; 2]>);

struct Looked {
    rows: Vec<Row>,
    /// Mean grey as a share of the brightest, and the share of pixels below a tenth of the mean; of those not black.
    light: [f64; 2],
    /// The error function where the model comes nearest to the drawn outlines, at its least from there, and as found.
    errors: [f64; 3],
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [folder, spacing] = arguments.as_slice() else {
        return Err("expected FOLDER SPACING".into());
    };
    let spacing = spacing.parse::<f64>()?;
    let cases = shared::volumes::cases(Path::new(folder), spacing)?;
    let looked = (0..cases.len())
        .into_par_iter()
        .map(|left_out| look(&cases, left_out, spacing).map_err(|problem| problem.to_string()))
        .collect::<Result<Vec<Looked>, String>>()?;

    println!("case         mean grey  dark   error function: nearest  least nearby  found");
    for (case, Looked { light, errors, .. }) in cases.iter().zip(&looked) {
        println!(
            "{:12} {:9.2} {:5.2} {:24.1} {:13.1} {:6.1}",
            case.name, light[0], light[1], errors[0], errors[1], errors[2]
        );
    }
    println!("\nDice, median                     apex  middle   base | ends, mm: median, RMS, bias of apex; of base");
    for (index, (name, ..)) in looked[0].rows.iter().enumerate() {
        let of = |part: usize| median(looked.iter().map(|case| case.rows[index].1[part]).collect());
        print!("{name:31} {:.3}   {:.3}  {:.3}", of(0), of(1), of(2));
        for end in 0..2 {
            let away: Vec<f64> = looked
                .iter()
                .filter_map(|case| Some(case.rows[index].2?[end]))
                .collect();
            if !away.is_empty() {
                let count = away.len() as f64;
                let bias = away.iter().sum::<f64>() / count;
                let rms = (away.iter().map(|away| away * away).sum::<f64>() / count).sqrt();
                let middle = median(away.iter().map(|away| away.abs()).collect());
                print!(" | {middle:.1} {rms:.1} {bias:+.1}");
            }
        }
        println!();
    }
    Ok(())
}

fn look(cases: &[TrainingCase], left_out: usize, spacing: f64) -> Result<Looked, Box<dyn std::error::Error>> {
    let case = &cases[left_out];
    let drawn = &case.outlines;
    let heights: Vec<f64> = case.stack.slices().iter().map(|slice| slice.z_mm).collect();
    let dice = |outlines: &[(f64, Vec<DVec2>)]| {
        let [apex, middle, base, _] = overlap_of_parts(&heights, drawn, outlines);
        [apex, middle, base].map(|part| part.dice())
    };
    let mut rows: Vec<Row> = Vec::new();
    let moved = |by: DVec2, up: f64| -> Outlines {
        let move_one = |(z, outline): &(f64, Vec<DVec2>)| (z + up, outline.iter().map(|place| *place + by).collect());
        drawn.iter().map(move_one).collect()
    };
    for (name, outlines) in [
        ("drawn, an end slice less each", drawn[1..drawn.len() - 1].to_vec()),
        ("drawn, moved up by a slice", moved(DVec2::ZERO, spacing)),
        ("drawn, aside by half a voxel", moved(0.5 * spacing * DVec2::X, 0.0)),
        ("drawn, aside by a voxel", moved(spacing * DVec2::X, 0.0)),
        ("drawn, backwards by a voxel", moved(spacing * DVec2::Y, 0.0)),
    ] {
        rows.push((name, dice(&outlines), None));
    }

    let others: Vec<TrainingCase> = (0..cases.len())
        .filter(|index| *index != left_out)
        .map(|index| cases[index].clone())
        .collect();
    let (model, knowing) = (Model::learn(&others)?, Model::learn(cases)?);
    let (task, known) = (
        GlandSearch::new(&case.stack, &model),
        GlandSearch::new(&case.stack, &knowing),
    );
    let truth = Gland::of_outlines(drawn).ok_or("no gland")?;
    let nearest = task.weights_of(&truth);
    let nearby = search::local(&nearest, NEARBY, |weights| task.error(weights));
    let found = task.run(1);
    let with_ends = |mut gland: Gland, ends: [f64; 2]| {
        gland.ends = ends;
        gland
    };
    for (name, gland) in [
        ("drawn, at the model's levels", truth.clone()),
        ("nearest of the model", task.gland(&nearest)),
        ("mean of the model", task.gland(&vec![0.0; task.dimensions()])),
        ("least error near the drawn", task.gland(&nearby.weights)),
        ("found", task.gland(&found.weights)),
        (
            "found, with the drawn ends",
            with_ends(task.gland(&found.weights), truth.ends),
        ),
        ("found, case not left out", known.gland(&known.run(1).weights)),
    ] {
        let section = |z: &f64| Some((*z, gland.section(*z)?));
        let outlines: Outlines = heights.iter().filter_map(section).collect();
        let away = [gland.ends[0] - truth.ends[0], gland.ends[1] - truth.ends[1]];
        rows.push((name, dice(&outlines), Some(away)));
    }
    let greys = case.stack.slices().iter().flat_map(|slice| slice.image.grey());
    let greys: Vec<f64> = greys.filter(|grey| **grey > 0.0).map(|grey| f64::from(*grey)).collect();
    let share = 1.0 / greys.len().max(1) as f64;
    let mean = share * greys.iter().sum::<f64>();
    let dark = greys.iter().filter(|grey| **grey < 0.1 * mean).count() as f64;
    Ok(Looked {
        rows,
        light: [mean / greys.iter().copied().fold(0.0, f64::max), share * dark],
        errors: [task.error(&nearest), nearby.error, found.error],
    })
}

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}
