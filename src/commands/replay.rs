//! `resecta replay`: plays a record again, in a window or to check it.

use std::{num::NonZeroUsize, path::PathBuf};

use clap::Args;
use resecta::{
    game::{self, ReplayOptions},
    headless,
    records::{Replay as Replayed, RunRecord},
};

use super::{Failure, quiet_log, run::progress_bar};

/// Play the record of a run again: in a window, or without one to check it
///
/// `--check` compares the gland every half second and all results at the end, and exits with 1 at the first difference.
#[derive(Args)]
pub struct Replay {
    /// Record of a run, .resecta-run
    file: PathBuf,
    /// Without a window: compare everything with the record
    #[arg(long)]
    check: bool,
    /// Show the instrument of another run, too, translucent
    #[arg(long, value_name = "FILE", conflicts_with = "check")]
    ghost: Option<PathBuf>,
    /// Also play the record of another build, which may go another way
    #[arg(long)]
    any_build: bool,
    /// Threads to use [default: as many as the machine has]
    #[arg(long, requires = "check")]
    threads: Option<NonZeroUsize>,
}

impl Replay {
    pub fn run(self) -> Result<(), Failure> {
        let (record, _) = RunRecord::load(&self.file)?;
        if !self.any_build {
            record.of_this_build(&self.file)?;
        }
        if !self.check {
            let ghost = self
                .ghost
                .map(|file| RunRecord::load(&file).map(|(record, _)| (file, record)));
            return Ok(game::replay(ReplayOptions {
                record: (self.file, record),
                ghost: ghost.transpose()?,
            })?);
        }
        let steps = record.states.len() as u64;
        let progress = progress_bar("steps", steps);
        let mut app = headless::app(self.threads);
        quiet_log(&mut app);
        let checked = Replayed::check(&mut app, record, &self.file, |step| progress.set_position(step));
        progress.finish_and_clear();
        match checked?.0 {
            Some(difference) => Err(Failure::ReplayDiffers {
                file: self.file,
                difference,
            }),
            None => {
                println!(
                    "{}: {steps} steps, every hash and all results as recorded",
                    self.file.display()
                );
                Ok(())
            }
        }
    }
}
