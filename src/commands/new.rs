//! `resecta new`: an exercise, a case or a mod to begin with.

use std::{
    fs::{self, OpenOptions},
    io::{self, Write},
    path::{Path, PathBuf},
};

use clap::{Args, Subcommand};
use resecta::{
    assets,
    scenario::{CASE_SUFFIX, EXERCISE_SUFFIX, check_name, new_case, new_exercise, new_mod},
};

use super::Failure;

/// Write an exercise, a case or a mod to begin with, in the working directory; it plays at once
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
    /// Write the folder NAME: a manifest, an exercise and a case of its own
    Mod(Named),
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
                let then = format!(
                    "use it: write case: \"{file}\" into an exercise beside it; in a mod's cases/ it is case: \"{name}\""
                );
                (file, new_case(&name), then)
            }
            What::Mod(Named { name }) => return write_mod(&name),
        };
        write_new(file.as_str().into(), &text)?;
        println!("{file}: written; {then}");
        Ok(())
    }
}

/// Writes the folder of a mod that is not there yet.
fn write_mod(name: &str) -> Result<(), Failure> {
    let folder = PathBuf::from(name);
    let refused = |file: &Path| {
        let file = file.to_owned();
        move |source: io::Error| match source.kind() {
            io::ErrorKind::AlreadyExists => Failure::IsThere { file },
            _ => Failure::Write { file, source },
        }
    };
    fs::create_dir(&folder).map_err(refused(&folder))?;
    for (path, text) in new_mod(name) {
        let file = folder.join(path);
        if let Some(inner) = file.parent() {
            fs::create_dir_all(inner).map_err(refused(inner))?;
        }
        write_new(file, &text)?;
    }
    println!("{name}: written; play it: resecta --exercise {name}/exercises/first{EXERCISE_SUFFIX}");
    if let Some(mods) = assets::mods_folder() {
        println!("the game finds it in {}", mods.display());
    }
    Ok(())
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
