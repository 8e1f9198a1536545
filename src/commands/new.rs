//! `resecta new`: an exercise or a case to begin with.

use std::{
    fs::OpenOptions,
    io::{self, Write},
    path::PathBuf,
};

use clap::{Args, Subcommand};
use resecta::scenario::{CASE_SUFFIX, EXERCISE_SUFFIX, check_name, new_case, new_exercise};

use super::Failure;

/// Write an exercise or a case to begin with, in the working directory; it plays at once
#[derive(Args)]
pub struct New {
    #[command(subcommand)]
    what: What,
}

#[derive(Subcommand)]
enum What {
    /// Write NAME.exercise.ron, with a comment on what may be changed
    Exercise(Named),
    /// Write NAME.case.ron, a generated gland
    Case(Named),
}

#[derive(Args)]
struct Named {
    /// Small letters, digits and `_`, a letter first; no file of that name may be there
    #[arg(value_parser = name)]
    name: String,
}

impl New {
    pub fn run(self) -> Result<(), Failure> {
        let (file, text, then) = match self.what {
            What::Exercise(Named { name }) => {
                let file = format!("{name}{EXERCISE_SUFFIX}");
                (
                    file.clone(),
                    new_exercise(&name),
                    format!("play it: resecta --exercise {file}"),
                )
            }
            What::Case(Named { name }) => {
                let file = format!("{name}{CASE_SUFFIX}");
                let then = format!("use it: write case: \"{file}\" into an exercise beside it");
                (file, new_case(&name), then)
            }
        };
        write_new(file.as_str().into(), &text)?;
        println!("{file}: written; {then}");
        Ok(())
    }
}

/// Writes a file that is not there yet.
fn write_new(file: PathBuf, text: &str) -> Result<(), Failure> {
    let made = OpenOptions::new().write(true).create_new(true).open(&file);
    let written = made.and_then(|mut made| made.write_all(text.as_bytes()));
    written.map_err(|source| match source.kind() {
        io::ErrorKind::AlreadyExists => Failure::IsThere { file },
        _ => Failure::Write { file, source },
    })
}

fn name(text: &str) -> Result<String, String> {
    check_name(text).map(|()| text.to_owned())
}
