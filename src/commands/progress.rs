//! `resecta progress`: how trainees came along.

use std::path::PathBuf;

use clap::Args;
use resecta::records::{
    Progress as Kept,
    progress::{Export, table, to_csv},
};

use super::{Failure, files};

/// Show how trainees came along: each metric of each exercise, run by run
///
/// Runs are kept by the game in a database of the user's own data folder; RESECTA_DATA_DIR names another folder.
#[derive(Args)]
pub struct Progress {
    /// Only this trainee
    #[arg(long, value_name = "NAME")]
    trainee: Option<String>,
    /// First add the runs of another machine: what it wrote with --json, or records (.resecta-run). Those that are here
    /// already are passed over
    #[arg(long, value_name = "FILE", num_args = 1..)]
    import: Vec<PathBuf>,
    /// Write all runs into a table, a row a run
    #[arg(long, value_name = "FILE")]
    csv: Option<PathBuf>,
    /// Write all runs into a file that another machine can import
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,
}

impl Progress {
    pub fn run(self) -> Result<(), Failure> {
        let (mut kept, notes) = Kept::of_user()?;
        notes.iter().for_each(|note| eprintln!("{note}"));
        for file in &self.import {
            let (runs, new) = kept.import(file)?;
            eprintln!("{}: {runs} runs, {new} of them new", file.display());
        }
        if let Some(name) = &self.trainee {
            let trainees = kept.trainees()?;
            if !trainees.iter().any(|trainee| trainee.eq_ignore_ascii_case(name)) {
                return Err(Failure::NoSuchTrainee {
                    name: name.clone(),
                    trainees,
                });
            }
        }
        let runs = kept.runs(self.trainee.as_deref())?;
        if let Some(file) = &self.csv {
            files::write(file, to_csv(&runs))?;
            eprintln!("{} runs in {}", runs.len(), file.display());
        }
        if let Some(file) = &self.json {
            files::write(file, Export::new(runs.clone()).to_json())?;
            eprintln!("{} runs in {}", runs.len(), file.display());
        }
        match runs.is_empty() {
            true => println!("no runs yet"),
            false => println!("{}", table(&runs)),
        }
        Ok(())
    }
}
