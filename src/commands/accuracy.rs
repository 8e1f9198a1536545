//! `resecta accuracy`: speed against error of integrators, how exactly tissue is cut, what strokes leave, how far water opens the lumen, and
//! what each part of the model errs by, in tables and charts.

use std::path::PathBuf;

use clap::{Args, ValueEnum};
use indicatif::{ProgressBar, ProgressStyle};
use resecta::{assets, budget, lumen::write_lumen, scenario::Library, strokes::write_strokes};
use resecta_methods::{Progress, write_cuts, write_report};

use super::Failure;

/// Measure speed against error of many integrators in many kinds of scenes, cuts against exact solids, what strokes leave, how far water opens the
/// lumen, and the error of each part of the model in scenes of an operation; write tables and charts (half an hour)
#[derive(Args)]
pub struct Accuracy {
    /// Folder to write to; what is in it under the same names is replaced
    #[arg(long, default_value = "docs/accuracy")]
    out: PathBuf,
    /// Measure one part [default: all]
    #[arg(long)]
    only: Option<Part>,
}

#[derive(Clone, Copy, PartialEq, ValueEnum)]
enum Part {
    /// Integrators
    Methods,
    /// Cuts (some minutes)
    Cuts,
    /// Twelve standard strokes on three glands (some minutes)
    Strokes,
    /// The lumen under pressure, and what the lens then sees (a minute)
    Lumen,
    /// The error budget: each part of the model in scenes of an operation (some 20 minutes)
    Budget,
}

impl Accuracy {
    pub fn run(self) -> Result<(), Failure> {
        let bar = ProgressBar::new(0);
        let style = ProgressStyle::with_template("{bar:30} {pos}/{len} {msg}").expect("a plain template");
        bar.set_style(style);
        let done = self.measure(&bar);
        bar.finish_and_clear();
        for line in done? {
            println!("{line}");
        }
        Ok(())
    }

    fn measures(&self, part: Part) -> bool {
        self.only.is_none_or(|only| only == part)
    }

    /// What was measured, and where it stands.
    fn measure(&self, bar: &ProgressBar) -> Result<Vec<String>, Failure> {
        let progress = |now: Progress| {
            bar.set_length(now.of as u64);
            bar.set_position(now.done as u64);
            bar.set_message(format!("{}: {}", now.regime, now.method));
        };
        let mut done = Vec::new();
        if self.measures(Part::Methods) {
            let summary = write_report(&self.out, progress)?;
            done.push(format!(
                "{} runs in {} kinds of scenes: {}",
                summary.rows.len(),
                summary.regimes.len(),
                self.out.join("index.md").display()
            ));
        }
        if self.measures(Part::Cuts) {
            let cuts = write_cuts(&self.out, progress)?;
            done.push(format!(
                "{} cuts of exact solids, {} glands cut from end to end: {}",
                cuts.errors.len(),
                cuts.glands.len(),
                self.out.join("cuts.md").display()
            ));
        }
        if self.measures(Part::Strokes) {
            let library = Library::new(assets::find()?);
            let strokes = write_strokes(&library, &self.out, |number, of, name| {
                bar.set_length(of as u64);
                bar.set_position(number as u64);
                bar.set_message(name.to_string());
            })?;
            done.push(format!(
                "{} strokes: {}",
                strokes.len(),
                self.out.join("strokes.md").display()
            ));
        }
        if self.measures(Part::Lumen) {
            let library = Library::new(assets::find()?);
            let lumen = write_lumen(&library, &self.out)?;
            done.push(format!(
                "the lumen under {} pressures: {}",
                lumen.openings.len(),
                self.out.join("lumen.md").display()
            ));
        }
        if self.measures(Part::Budget) {
            let library = Library::new(assets::find()?);
            let budget = budget::write_budget(&self.out, &library, progress)?;
            done.push(format!(
                "{} runs of {} scenes: {}",
                budget.runs().count(),
                budget.scenes.len(),
                self.out.join("budget.md").display()
            ));
        }
        Ok(done)
    }
}
