//! `resecta accuracy`: speed against error of integrators, in tables and charts.

use std::path::PathBuf;

use clap::Args;
use indicatif::{ProgressBar, ProgressStyle};
use resecta_methods::write_report;

use super::Failure;

/// Measure speed against error of many integrators in many kinds of scenes; write tables and charts (some minutes)
#[derive(Args)]
pub struct Accuracy {
    /// Folder to write to; what is in it under the same names is replaced
    #[arg(long, default_value = "docs/accuracy")]
    out: PathBuf,
}

impl Accuracy {
    pub fn run(self) -> Result<(), Failure> {
        let bar = ProgressBar::new(0);
        let style = ProgressStyle::with_template("{bar:30} {pos}/{len} {msg}").expect("a plain template");
        bar.set_style(style);
        let report = write_report(&self.out, |now| {
            bar.set_length(now.of as u64);
            bar.set_position(now.done as u64);
            bar.set_message(format!("{}: {}", now.regime, now.method));
        });
        bar.finish_and_clear();
        let summary = report?;
        println!(
            "{} runs in {} kinds of scenes: {}",
            summary.rows.len(),
            summary.regimes.len(),
            self.out.join("index.md").display()
        );
        Ok(())
    }
}
