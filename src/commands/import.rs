//! `resecta import`: a case from contours or from a mask.

use std::path::PathBuf;

use clap::Args;
use resecta::anatomy::{
    Case,
    import::{Axes, MaskOptions, import},
};

use super::{Failure, case_path, mesh};

/// Make a case from a contour file (.json) or a segmentation mask (.nii, .nii.gz)
#[derive(Args)]
pub struct Import {
    /// Contour file or mask
    input: PathBuf,
    /// Case file to write, *.case.ron; an existing one is replaced
    #[arg(long, value_parser = case_path)]
    out: PathBuf,
    #[command(flatten)]
    said: SaidOfCase,
    /// Masks: voxel spacing in mm, one number or three along the volume's axes (0.8,0.8,3) [default: the header's]
    #[arg(long, value_parser = spacing)]
    spacing: Option<[f64; 3]>,
    /// Masks: which way the volume's axes run, a letter each of R/L, A/P, I/S [default: PLS]
    #[arg(long, value_parser = axes)]
    axes: Option<Axes>,
    /// Masks: channel that holds the gland [default: 0]
    #[arg(long)]
    channel: Option<usize>,
    /// Masks: channels that mark where the urethra leaves the apex and enters the base, for example 1,2
    #[arg(long, value_parser = channels, value_name = "APEX,BASE")]
    urethra_channels: Option<[usize; 2]>,
}

/// What a caller says of a case beside its contours.
#[derive(Args)]
pub(super) struct SaidOfCase {
    /// Name of the case [default: the input's name]
    #[arg(long)]
    name: Option<String>,
    /// Who measured the data, and how
    #[arg(long)]
    source: Option<String>,
    /// Licence of the data, an SPDX expression where there is one
    #[arg(long)]
    licence: Option<String>,
}

impl SaidOfCase {
    /// Puts it in the place of what the case says.
    pub(super) fn say(self, case: &mut Case) {
        let said = [
            (&mut case.name, self.name),
            (&mut case.source.description, self.source),
            (&mut case.source.licence, self.licence),
        ];
        for (field, said) in said {
            if let Some(said) = said {
                *field = said;
            }
        }
    }
}

impl Import {
    pub fn run(self) -> Result<(), Failure> {
        if self.input.extension().is_some_and(|extension| extension == "json") {
            let mask_options = [
                ("--spacing", self.spacing.is_some()),
                ("--axes", self.axes.is_some()),
                ("--channel", self.channel.is_some()),
                ("--urethra-channels", self.urethra_channels.is_some()),
            ];
            if let Some((option, _)) = mask_options.into_iter().find(|(_, given)| *given) {
                return Err(Failure::MaskOption {
                    input: self.input,
                    option,
                });
            }
        }
        let options = MaskOptions {
            spacing_mm: self.spacing,
            channel: self.channel.unwrap_or_default(),
            endpoint_channels: self.urethra_channels,
            axes: self.axes.unwrap_or_default(),
        };
        let mut case = import(&self.input, &options)?;
        self.said.say(&mut case);
        case.save(&self.out)?;
        println!("{}: {} slices", case.name, case.slices.len());
        mesh::print_approximations(&case);
        println!("written to {}", self.out.display());
        Ok(())
    }
}

fn spacing(text: &str) -> Result<[f64; 3], String> {
    match numbers(text)?[..] {
        [all] => Ok([all; 3]),
        [x, y, z] => Ok([x, y, z]),
        _ => Err("expected one number or three".into()),
    }
}

fn channels(text: &str) -> Result<[usize; 2], String> {
    <[usize; 2]>::try_from(numbers(text)?).map_err(|_| "expected two numbers".into())
}

pub(super) fn numbers<T: std::str::FromStr<Err: std::fmt::Display>>(text: &str) -> Result<Vec<T>, String> {
    text.split(',')
        .map(|number| {
            number
                .trim()
                .parse()
                .map_err(|error: T::Err| format!("{number:?}: {error}"))
        })
        .collect()
}

pub(super) fn axes(text: &str) -> Result<Axes, String> {
    text.parse()
        .map_err(|error: resecta::anatomy::import::AxesError| error.to_string())
}
