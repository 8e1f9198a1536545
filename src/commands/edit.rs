//! `resecta edit`: the game's screen of outlines, on images of one's own.

use std::path::PathBuf;

use clap::Args;
use resecta::game::{self, GameOptions, ImageFiles, Images};

use super::{Failure, game_options, images::ImageGeometry};

/// Open ultrasound images in the game, with the outlines found in them or those of a case, to mend them by hand
#[derive(Args)]
pub struct Edit {
    /// Folder of pictures, volume or DICOM file, as for `resecta annotate`
    images: PathBuf,
    /// Case with outlines of these images [default: the images are searched]
    #[arg(long)]
    case: Option<PathBuf>,
    /// Model made by `resecta train` [default: the shipped one]
    #[arg(long)]
    model: Option<PathBuf>,
    #[command(flatten)]
    geometry: ImageGeometry,
}

impl Edit {
    pub fn run(self) -> Result<(), Failure> {
        let images = Images::Files(Box::new(ImageFiles {
            path: self.images,
            geometry: self.geometry.geometry(),
            case: self.case,
            model: self.model,
        }));
        Ok(game::run(GameOptions {
            images: Some(images),
            ..game_options()
        })?)
    }
}
