//! `resecta gallery`: pictures of the game.

use std::path::PathBuf;

use clap::Args;
use resecta::game;

use super::{Failure, files};

/// Draw pictures of the game: every screen, what the instrument does, what becomes of tissue, at two sizes
///
/// Opens a window, leads the game through it and closes it; takes some minutes without a graphics card. Without a display, as
/// `xvfb-run -a -s '-screen 0 2560x1440x24' resecta gallery --out gallery/`.
#[derive(Args)]
pub struct Gallery {
    /// Folder of the pictures; one folder a size is made in it
    #[arg(long, value_name = "FOLDER")]
    out: PathBuf,
}

impl Gallery {
    /// Does what was asked for.
    pub fn run(self) -> Result<(), Failure> {
        files::prepare_folder(&self.out)?;
        let written = game::gallery(self.out)?;
        written.iter().for_each(|file| println!("{}", file.display()));
        Ok(())
    }
}
