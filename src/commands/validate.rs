//! `resecta validate`: all that is wrong with exercises, cases and mods, without playing them.

use std::path::PathBuf;

use clap::Args;

use super::{Failure, library};

/// Check exercises, cases and mods, and tell all that is wrong with them
///
/// Prints a line for every fault (file:line:column: field and what was expected), every good file and every file that was passed over. Exit
/// code 1 where anything is wrong. Of each file a slip of syntax hides what follows it; broken rules are told all at once.
#[derive(Args)]
pub struct Validate {
    /// Files (*.exercise.ron, *.case.ron), mods (folders with mod.ron) and folders of all of these, looked into 8 folders deep
    #[arg(required = true, value_name = "PATH")]
    paths: Vec<PathBuf>,
}

impl Validate {
    pub fn run(self) -> Result<(), Failure> {
        let validation = library()?.validate(&self.paths);
        print!("{validation}");
        let (files, good, faults) = (validation.checked.len(), validation.good(), validation.faults());
        if faults > 0 {
            return Err(Failure::Invalid {
                faults,
                bad: files - good,
                files,
            });
        }
        println!("{good} of {files} files good");
        Ok(())
    }
}
