//! What a caller may say of ultrasound images, for the commands that read them.

use clap::Args;
use resecta::{
    anatomy::import::Axes,
    annotate::{Geometry, Heights},
};

use super::import::{axes, numbers};

/// Geometry of images. What is given goes before the files and their sidecars (`stack.ron`).
#[derive(Args)]
pub struct ImageGeometry {
    /// Distance between pixels in mm, one number or two: right to left, anterior to posterior [default: the file's]
    #[arg(long, value_parser = spacing, value_name = "MM")]
    spacing: Option<[f64; 2]>,
    /// Distance between images in mm [default: the file's]
    #[arg(long, value_name = "MM")]
    distance: Option<f64>,
    /// Which way columns, rows and images run, or a volume's axes: a letter each of R/L, A/P, I/S. NIfTI volumes need it
    /// [default: the sidecar's; LPS for pictures]
    #[arg(long, value_parser = axes)]
    axes: Option<Axes>,
    /// Depth of the image in mm, as the scanner states it; gives the spacing where none is known
    #[arg(long, value_name = "MM")]
    depth: Option<f64>,
}

impl ImageGeometry {
    /// As the reader of stacks takes it, which checks the values.
    pub fn geometry(&self) -> Geometry {
        Geometry {
            spacing: self.spacing,
            z: self.distance.map(|distance| Heights::Even { first: 0.0, distance }),
            axes: self.axes,
            depth: self.depth,
            ..Geometry::default()
        }
    }
}

fn spacing(text: &str) -> Result<[f64; 2], String> {
    match numbers(text)?[..] {
        [all] => Ok([all; 2]),
        [x, y] => Ok([x, y]),
        _ => Err("expected one number or two".into()),
    }
}
