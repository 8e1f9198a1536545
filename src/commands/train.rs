//! `resecta train`: a model of the prostate in ultrasound from annotated cases.

use std::path::PathBuf;

use clap::Args;
use resecta::annotate::{Figures, Model, Score, read_training_cases};

use super::{Failure, images::ImageGeometry, run::progress_bar};

/// Learn a model of the prostate from annotated ultrasound, and measure it on each case with a model that did without it
///
/// DIR holds images/ (folders of pictures, volumes, DICOM files) and labels/ with outlines of the same names: masks (.nii,
/// .nii.gz), contours (.json) or cases (.case.ron).
#[derive(Args)]
pub struct Train {
    /// Folder with images/ and labels/
    dir: PathBuf,
    /// Model to write, .pdm; an existing one is replaced
    #[arg(long)]
    out: PathBuf,
    /// Case not to learn from; may be given again
    #[arg(long, value_name = "NAME")]
    without: Vec<String>,
    /// Whose data it learns from, and under which licence
    #[arg(long, default_value = "unknown")]
    attribution: String,
    #[command(flatten)]
    geometry: ImageGeometry,
    /// Start of the search's chance
    #[arg(long, default_value_t = 1)]
    seed: u64,
}

impl Train {
    pub fn run(self) -> Result<(), Failure> {
        let cases = read_training_cases(&self.dir, &self.geometry.geometry(), &self.without)?;
        let bar = progress_bar("cases left out", cases.len() as u64);
        let model = Model::train(&cases, &self.attribution, self.seed, |done, _| {
            bar.set_position(done as u64)
        });
        bar.finish_and_clear();
        let model = model.map_err(|source| Failure::Train {
            folder: self.dir,
            source,
        })?;
        model.save(&self.out)?;
        print_figures(&model.figures);
        println!("written to {}", self.out.display());
        Ok(())
    }
}

/// What the table shows of a case, with the width of its column.
const COLUMNS: [(&str, usize, fn(&Score) -> f64); 8] = [
    ("Dice", 6, |score| score.dice),
    ("middle", 7, |score| score.dice_middle),
    ("apex", 6, |score| score.dice_apex),
    ("base", 6, |score| score.dice_base),
    ("middle mm", 10, |score| score.distance_middle_mm),
    ("volume %", 9, |score| 100.0 * score.volume_error),
    ("flagged %", 10, |score| 100.0 * score.flagged),
    ("confidence", 11, |score| score.confidence),
];

fn print_figures(figures: &Figures) {
    let widest = figures.scores.iter().map(|score| score.case.chars().count()).max();
    let first = widest.unwrap_or_default().max("left out".len());
    let row = |name: &str, cell: &dyn Fn(usize) -> String| {
        let cells: String = (0..COLUMNS.len())
            .map(|column| format!("{:>width$}", cell(column), width = COLUMNS[column].1 + 1))
            .collect();
        println!("{name:<first$}{cells}");
    };
    row("left out", &|column| COLUMNS[column].0.into());
    for score in &figures.scores {
        row(&score.case, &|column| {
            let (_, _, of) = COLUMNS[column];
            format!("{:.2}", of(score))
        });
    }
    // A volume is too large or too small; the median of both together would say nothing.
    row("median", &|column| {
        let (name, _, of) = COLUMNS[column];
        let magnitude = name == "volume %";
        let value = figures.median(|score| if magnitude { of(score).abs() } else { of(score) });
        format!("{value:.2}")
    });
    println!("middle, apex and base: Dice of the middle two thirds, the lowest and the highest sixth");
    println!("confidence: how the error expected ranks with the true one, 1 wholly, 0 not at all");
}
