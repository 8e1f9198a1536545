//! Trains on a folder of annotated volumes and prints how models trained without each case found it.
//!
//! `cargo run --release -p resecta_annotate --example leave_one_out -- FOLDER SPACING [MODEL]`, with `FOLDER` and
//! `SPACING` as `shared` reads them.

mod shared;

use std::path::Path;

use resecta_annotate::Model;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [folder, spacing, rest @ ..] = arguments.as_slice() else {
        return Err("expected FOLDER SPACING [MODEL]".into());
    };
    let (folder, spacing) = (Path::new(folder), spacing.parse::<f64>()?);
    let cases = shared::cases(folder, spacing)?;
    let start = std::time::Instant::now();
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
    if let [path, ..] = rest {
        model.save(Path::new(path))?;
    }
    Ok(())
}
