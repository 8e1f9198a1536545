//! `resecta generate`: a plausible gland from published dimensions.

use std::path::PathBuf;

use clap::Args;
use resecta::anatomy::generate::{GlandSpec, generate};

use super::{Failure, case_path};

/// Make a plausible gland from published dimensions
#[derive(Args)]
pub struct Generate {
    /// Volume inside the capsule, 15 to 150 ml
    #[arg(long)]
    volume_ml: f64,
    /// How far the middle lobe protrudes into the bladder, 0 (no middle lobe) to 20 mm
    #[arg(long, default_value_t = 0.0)]
    median_lobe_mm: f64,
    /// Two seeds give two glands of the same size
    #[arg(long, default_value_t = 0)]
    seed: u64,
    /// Case file to write, *.case.ron; an existing one is replaced [default: standard output]
    #[arg(long, value_parser = case_path)]
    out: Option<PathBuf>,
    /// Name of the case [default: from its dimensions]
    #[arg(long)]
    name: Option<String>,
}

impl Generate {
    pub fn run(self) -> Result<(), Failure> {
        let mut case = generate(&GlandSpec {
            volume_ml: self.volume_ml,
            median_lobe_mm: self.median_lobe_mm,
            seed: self.seed,
        })?;
        case.name = self.name.unwrap_or(case.name);
        match self.out {
            Some(file) => {
                case.save(&file)?;
                println!("{}: written to {}", case.name, file.display());
            }
            None => print!("{}", case.to_ron()),
        }
        Ok(())
    }
}
