//! `resecta annotate`: a case from ultrasound images.

use std::path::{Path, PathBuf};

use bevy::math::DVec3;
use clap::Args;
use resecta::{
    anatomy::{Case, CaseSource},
    annotate::{Annotation, Colour, Flag, Model, Outlines, Overlay, Stack, annotate, contact_sheet, read_stack},
    assets,
};

use super::{
    Failure, case_path, files,
    images::ImageGeometry,
    import::{SaidOfCase, numbers},
    mesh,
    run::progress_bar,
};

/// Find the prostate in ultrasound images and make a case of it
///
/// IMAGES is a folder of pictures (.png with a stack.ron beside them, or .dcm), a volume (.nii, .nii.gz) or a DICOM file of
/// several frames. Beside the case it writes a contact sheet: every image with the outline found; those to be looked at are
/// framed. The same seed gives the same case.
#[derive(Args)]
pub struct Annotate {
    /// Folder of pictures, volume or DICOM file
    images: PathBuf,
    /// Model made by `resecta train` [default: the shipped one]
    #[arg(long)]
    model: Option<PathBuf>,
    /// Case file to write, *.case.ron; an existing one is replaced
    #[arg(long, value_parser = case_path)]
    out: PathBuf,
    /// Contact sheet to write, .png [default: beside the case]
    #[arg(long)]
    sheet: Option<PathBuf>,
    #[command(flatten)]
    geometry: ImageGeometry,
    /// A place that the urethra is known to pass, mm from the first pixel of the lowest image; may be given again
    #[arg(long, value_parser = place, value_name = "X,Y,Z", allow_hyphen_values = true)]
    urethra: Vec<DVec3>,
    /// Start of the search's chance
    #[arg(long, default_value_t = 1)]
    seed: u64,
    #[command(flatten)]
    said: SaidOfCase,
}

/// Outlines as good as any, and those to be looked at.
const GOOD: Colour = [90, 220, 120];
const DOUBTFUL: Colour = [255, 150, 40];
/// Images a row of the sheet.
const COLUMNS: usize = 6;

impl Annotate {
    pub fn run(self) -> Result<(), Failure> {
        let sheet = self.sheet.unwrap_or_else(|| beside(&self.out));
        files::check_folder_of(&self.out)?;
        files::check_folder_of(&sheet)?;
        let model = Model::load(&match self.model {
            Some(file) => file,
            None => assets::find()?.join(assets::PROSTATE_MODEL),
        })?;
        let stack = read_stack(&self.images, &self.geometry.geometry())?;
        let bar = progress_bar("slices", 0);
        let annotation = annotate(&stack, &model, self.seed, |done, of| {
            bar.set_length(of as u64);
            bar.set_position(done as u64);
        });
        bar.finish_and_clear();
        let annotation = annotation.map_err(|source| Failure::Annotate {
            images: self.images.clone(),
            source,
        })?;
        let file_name = file_name(&self.images);
        let stem = file_name.split('.').next().unwrap_or_default();
        let source = CaseSource {
            description: format!("outlined in the images {file_name} by a model of the prostate"),
            licence: "unknown".into(),
        };
        let mut outlines = Outlines::found(&stack, annotation.clone());
        for &place in &self.urethra {
            let image = stack.image_at(place.z);
            if !image.is_some_and(|image| outlines.mark_urethra(image, Some(place.truncate()))) {
                return Err(Failure::Urethra { place });
            }
        }
        let case = outlines.to_case(&stack, stem, source);
        let mut case = case.map_err(|source| Failure::AnnotatedCase {
            images: self.images.clone(),
            source,
        })?;
        self.said.say(&mut case);
        files::write(&sheet, contact_sheet(&stack, &overlays(&stack, &annotation), COLUMNS))?;
        case.save(&self.out)?;
        print_table(&annotation, &case);
        println!("model               {}", model.attribution);
        println!("written to {} and {}", self.out.display(), sheet.display());
        Ok(())
    }
}

fn place(text: &str) -> Result<DVec3, String> {
    match numbers(text)?[..] {
        [x, y, z] => Ok(DVec3::new(x, y, z)),
        _ => Err("expected three numbers".into()),
    }
}

fn file_name(path: &Path) -> String {
    // A folder may be given as `.`.
    let whole = path.canonicalize().unwrap_or_else(|_| path.into());
    whole.file_name().unwrap_or_default().to_string_lossy().into_owned()
}

/// `patient.png` for `patient.case.ron`.
fn beside(case: &Path) -> PathBuf {
    case.with_extension("").with_extension("png")
}

fn overlays<'a>(stack: &Stack, annotation: &'a Annotation) -> Vec<Overlay<'a>> {
    let mut overlays = vec![Overlay::default(); stack.slices().len()];
    for slice in &annotation.slices {
        let doubtful = !slice.flags.is_empty();
        overlays[slice.image] = Overlay {
            contours: vec![(&slice.capsule, if doubtful { DOUBTFUL } else { GOOD })],
            frame: doubtful.then_some(DOUBTFUL),
        };
    }
    overlays
}

fn print_table(annotation: &Annotation, case: &Case) {
    println!("image    z mm  zone    error mm  to be looked at");
    for slice in &annotation.slices {
        let zone = format!("{:?}", slice.zone).to_lowercase();
        let flags: Vec<String> = slice.flags.iter().map(Flag::to_string).collect();
        println!(
            "{:>5}  {:>6.1}  {zone:<6}  {:>8.1}  {}",
            slice.image,
            slice.z_mm,
            slice.error_mm,
            flags.join("; ")
        );
    }
    let flagged = annotation.slices.iter().filter(|slice| !slice.flags.is_empty()).count();
    println!(
        "{}: {} slices, {:.1} ml; {flagged} to be looked at; the error is the mean distance to the true outline that is expected",
        case.name,
        annotation.slices.len(),
        annotation.volume_ml()
    );
    let mut rest = case.clone();
    rest.approximated.retain(|note| !note.what.ends_with(".capsule"));
    mesh::print_approximations(&rest);
}
