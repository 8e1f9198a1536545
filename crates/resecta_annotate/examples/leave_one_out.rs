//! Trains on a folder of annotated volumes and prints how models trained without each case found it.
//!
//! `cargo run --release -p resecta_annotate --example leave_one_out -- FOLDER SPACING [MODEL]`, with `FOLDER` and
//! `SPACING` as `shared/volumes.rs` reads them.

mod shared {
    pub mod volumes;
}

use std::path::Path;
use std::time::Instant;

use resecta_annotate::{AnnotateError, Model, POOR_FIT_MM, TrainingCase, annotate};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [folder, spacing, rest @ ..] = arguments.as_slice() else {
        return Err("expected FOLDER SPACING [MODEL]".into());
    };
    let (folder, spacing) = (Path::new(folder), spacing.parse::<f64>()?);
    let cases = shared::volumes::cases(folder, spacing)?;
    let start = Instant::now();
    let model = Model::train(&cases, "", 1, |_, _| {})?;
    let seconds = start.elapsed().as_secs_f64();
    println!("case         Dice  middle     mm    apex   base  volume  flagged  confidence");
    for score in &model.figures.scores {
        println!(
            "{}  {:.3}  {:.3}  {:5.2}  {:.3}  {:.3}  {:+.3}  {:.2}  {:+.2}",
            score.case,
            score.dice,
            score.dice_middle,
            score.distance_middle_mm,
            score.dice_apex,
            score.dice_base,
            score.volume_error,
            score.flagged,
            score.confidence
        );
    }
    let median = |of: &dyn Fn(&resecta_annotate::Score) -> f64| model.figures.median(of);
    println!(
        "median      {:.3}  {:.3}  {:5.2}  {:.3}  {:.3}  {:.3}  {:.2}  {:+.2}",
        median(&|score| score.dice),
        median(&|score| score.dice_middle),
        median(&|score| score.distance_middle_mm),
        median(&|score| score.dice_apex),
        median(&|score| score.dice_base),
        median(&|score| score.volume_error.abs()),
        median(&|score| score.flagged),
        median(&|score| score.confidence)
    );
    println!("{seconds:.1} s for {} trainings and annotations", cases.len());
    print_confidence(&model);
    print_times(&cases, &model)?;
    if let [path, ..] = rest {
        model.save(Path::new(path))?;
    }
    Ok(())
}

/// How well the error expected of a slice foretells the true one.
fn print_confidence(model: &Model) {
    let slices = model.figures.scores.iter().flat_map(|score| &score.slices);
    let mut seen: Vec<(f64, f64, bool)> = slices
        .filter_map(|slice| Some((slice.expected_mm?, slice.distance_mm?, slice.flagged)))
        .collect();
    seen.sort_by(|one, other| one.0.total_cmp(&other.0));
    println!(
        "slices by the error expected, in fifths: expected mm, true mm (mean, median), above {POOR_FIT_MM} mm, flagged"
    );
    let share = |part: &[(f64, f64, bool)], of: &dyn Fn(&(f64, f64, bool)) -> bool| {
        part.iter().filter(|slice| of(slice)).count() as f64 / part.len().max(1) as f64
    };
    for part in seen.chunks(seen.len().div_ceil(5).max(1)) {
        let mean = |of: &dyn Fn(&(f64, f64, bool)) -> f64| part.iter().map(of).sum::<f64>() / part.len() as f64;
        let mut far: Vec<f64> = part.iter().map(|slice| slice.1).collect();
        far.sort_by(f64::total_cmp);
        println!(
            "{:5.2}  {:5.2} {:5.2}  {:.2}  {:.2}",
            mean(&|slice| slice.0),
            mean(&|slice| slice.1),
            far[far.len() / 2],
            share(part, &|slice| slice.1 > POOR_FIT_MM),
            share(part, &|slice| slice.2)
        );
    }
    for limit in [3.0, POOR_FIT_MM] {
        let (flagged, plain): (Vec<_>, Vec<_>) = seen.iter().partition(|slice| slice.2);
        let bad = |slice: &(f64, f64, bool)| slice.1 > limit;
        println!(
            "above {limit} mm: {:.2} of {} flagged slices, {:.2} of {} others",
            share(&flagged, &bad),
            flagged.len(),
            share(&plain, &bad),
            plain.len()
        );
    }
}

/// How long a stack and a slice of it take.
fn print_times(cases: &[TrainingCase], model: &Model) -> Result<(), AnnotateError> {
    let (mut stacks, mut slices) = (Vec::new(), Vec::new());
    for case in cases {
        let start = Instant::now();
        let found = annotate(&case.stack, model, 1, |_, _| {})?;
        let seconds = start.elapsed().as_secs_f64();
        stacks.push(seconds);
        slices.push(seconds / found.slices.len() as f64);
    }
    let middle = |values: &mut Vec<f64>| {
        values.sort_by(f64::total_cmp);
        values[values.len() / 2]
    };
    println!(
        "{:.2} s a stack, {:.3} s a slice of it (medians)",
        middle(&mut stacks),
        middle(&mut slices)
    );
    Ok(())
}
