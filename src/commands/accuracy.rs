//! `resecta accuracy`: speed against error of integrators, and how exactly tissue is cut, in tables and charts.

use std::path::PathBuf;

use clap::{Args, ValueEnum};
use indicatif::{ProgressBar, ProgressStyle};
use resecta_methods::{Progress, write_cuts, write_report};

use super::Failure;

/// Measure speed against error of many integrators in many kinds of scenes, and cuts against exact solids; write tables and
/// charts (some minutes)
#[derive(Args)]
pub struct Accuracy {
    /// Folder to write to; what is in it under the same names is replaced
    #[arg(long, default_value = "docs/accuracy")]
    out: PathBuf,
    /// Measure one part [default: both]
    #[arg(long)]
    only: Option<Part>,
}

#[derive(Clone, Copy, PartialEq, ValueEnum)]
enum Part {
    /// Integrators
    Methods,
    /// Cuts (some minutes)
    Cuts,
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

    /// What was measured, and where it stands.
    fn measure(&self, bar: &ProgressBar) -> Result<Vec<String>, Failure> {
        let progress = |now: Progress| {
            bar.set_length(now.of as u64);
            bar.set_position(now.done as u64);
            bar.set_message(format!("{}: {}", now.regime, now.method));
        };
        let mut done = Vec::new();
        if self.only != Some(Part::Cuts) {
            let summary = write_report(&self.out, progress)?;
            done.push(format!(
                "{} runs in {} kinds of scenes: {}",
                summary.rows.len(),
                summary.regimes.len(),
                self.out.join("index.md").display()
            ));
        }
        if self.only != Some(Part::Methods) {
            let cuts = write_cuts(&self.out, progress)?;
            done.push(format!(
                "{} cuts of exact solids, {} glands cut from end to end: {}",
                cuts.errors.len(),
                cuts.glands.len(),
                self.out.join("cuts.md").display()
            ));
        }
        Ok(done)
    }
}
