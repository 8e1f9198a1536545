//! `resecta score`: computes the score of a record anew.

use std::{num::NonZeroUsize, path::PathBuf};

use clap::Args;
use resecta::{
    headless,
    records::{Replay, RunRecord, rescore},
    scenario::{Extensions, Medal, ScoreCard},
};

use super::{Failure, quiet_log, run::progress_bar};

/// Compute the score of a record anew, line by line
///
/// By the formula in the record at the metrics in the record, or with `--replay` at those of the run played again. Exits with 1
/// where the total is not the recorded one.
#[derive(Args)]
pub struct Score {
    /// Record of a run, .resecta-run
    file: PathBuf,
    /// Play the run again and take its metrics
    #[arg(long)]
    replay: bool,
    /// Also play the record of another build, which may go another way
    #[arg(long, requires = "replay")]
    any_build: bool,
    /// Threads to use [default: as many as the machine has]
    #[arg(long, requires = "replay")]
    threads: Option<NonZeroUsize>,
}

impl Score {
    pub fn run(self) -> Result<(), Failure> {
        let (record, _) = RunRecord::load(&self.file)?;
        let results = record.results();
        let card = if self.replay {
            if !self.any_build {
                record.of_this_build(&self.file)?;
            }
            let progress = progress_bar("steps", record.states.len() as u64);
            let mut app = headless::app(self.threads);
            quiet_log(&mut app);
            let checked = Replay::check(&mut app, record, &self.file, |step| progress.set_position(step));
            progress.finish_and_clear();
            checked?.1.score
        } else {
            rescore(&record, &self.file, &Extensions::default())?
        };
        println!(
            "{}, {:.1} s, {}",
            results.exercise.title,
            results.run.elapsed_s,
            results.run.ended.words()
        );
        print(&card);
        if card.total != results.score.total {
            return Err(Failure::ScoreDiffers {
                file: self.file,
                recorded: results.score.total,
                computed: card.total,
            });
        }
        Ok(())
    }
}

/// The score line by line, with formula, parts and medals.
fn print(card: &ScoreCard) {
    let medal = |medal: Option<Medal>| medal.map_or(String::new(), |medal| format!("   {}", medal.name()));
    for line in &card.lines {
        let unit = if line.unit == "1" { "" } else { line.unit };
        println!(
            "{:<28}{:>9.2} of {:>5.1} points   {:.3} {unit}{}",
            line.title,
            line.points,
            line.out_of,
            line.value,
            medal(line.medal)
        );
        println!("    {}", line.formula);
    }
    for part in &card.parts {
        let name = part.part.name();
        println!("{name:<28}{:>9.2} of {:>5.1} points", part.points, part.out_of);
    }
    println!("{}", total(card));
}

/// The line of the total, with its medal or the harm that it earns none for.
pub(super) fn total(card: &ScoreCard) -> String {
    let medal = match (card.medal, card.harm) {
        (Some(medal), _) => format!("   {}", medal.name()),
        (None, Some(harm)) => format!("   no medal: {}", harm.words()),
        (None, None) => String::new(),
    };
    format!(
        "{:<28}{:>9.2} of {:>5.1} points{medal}",
        "Total", card.total, card.out_of
    )
}
