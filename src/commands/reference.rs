//! `resecta reference`: what exercise files may say, for people and for editors.

use std::path::PathBuf;

use clap::Args;
use resecta::scenario::reference::{REFERENCE_FILE, SCHEMA_FILE, reference, schema};

use super::{Failure, files};

/// Write the reference of exercise files (Markdown) and their JSON Schema
///
/// Both are made from the types that read the files: exercise_reference.md and exercise.schema.json.
#[derive(Args)]
pub struct Reference {
    /// Folder for both; made if only it is missing, and files of these names in it are replaced
    #[arg(long)]
    out: PathBuf,
}

impl Reference {
    pub fn run(self) -> Result<(), Failure> {
        files::prepare_folder(&self.out)?;
        for (name, text) in [(REFERENCE_FILE, reference()), (SCHEMA_FILE, schema())] {
            let file = self.out.join(name);
            files::write(&file, text)?;
            println!("{}: written", file.display());
        }
        Ok(())
    }
}
