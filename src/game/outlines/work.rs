//! What takes longer than a frame: reading images, finding the gland in them, searching one image anew. On other threads.

use std::{
    path::{Path, PathBuf},
    sync::{
        Arc,
        atomic::{AtomicUsize, Ordering},
    },
};

use bevy::tasks::{AsyncComputeTaskPool, Task, block_on, poll_once};
use resecta_anatomy::{
    Case, CaseSource,
    generate::{GlandSpec, generate},
};
use resecta_annotate::{
    Geometry, Model, Outline, Outlines, Stack, SyntheticOptions, TrainingCase, annotate, read_stack, synthesize,
};
use resecta_scenario::CASE_SUFFIX;

use crate::assets;

/// Seed of all searches: the same images give the same outlines.
const SEED: u64 = 1;
/// Seed of the example's speckle.
const EXAMPLE_SEED: u64 = 7;
/// The shipped case whose ultrasound the example is.
const EXAMPLE: &str = "cases/medium.case.ron";
/// Distance between the pixels of the example, mm.
const EXAMPLE_SPACING_MM: f64 = 0.6;
/// The generated glands whose synthetic ultrasound the example's model learns from, volume in ml and median lobe in mm: a
/// model of real images knows nothing of synthetic ones.
const LEARNED_FROM: [(f64, f64); 6] = [
    (35.0, 0.0),
    (45.0, 4.0),
    (52.0, 8.0),
    (60.0, 0.0),
    (68.0, 6.0),
    (80.0, 10.0),
];

/// Where images come from.
#[derive(Debug, Clone, PartialEq)]
pub enum Images {
    /// Somebody's own.
    Files(Box<ImageFiles>),
    /// Synthetic ultrasound of a shipped gland.
    Example,
}

/// Images in files, and what goes with them.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct ImageFiles {
    /// A folder of pictures, a volume or a DICOM file.
    pub path: PathBuf,
    /// What is said of them beside their sidecar.
    pub geometry: Geometry,
    /// A case with outlines of them; they are searched where there is none.
    pub case: Option<PathBuf>,
    /// The model to search with; the shipped one where there is none.
    pub model: Option<PathBuf>,
}

/// Images with outlines to mend.
pub struct Opened {
    pub stack: Arc<Stack>,
    pub model: Arc<Model>,
    pub outlines: Outlines,
    /// Name for the case: its own, or that of the images.
    pub name: String,
    /// Where the case goes: where it came from, or a file of the images' name.
    pub file: String,
    /// Who made the images, as far as it is known.
    pub source: CaseSource,
    /// Something to be told of it.
    pub note: Option<String>,
}

/// What is done, and how far it is.
pub enum Work {
    /// Reading and searching a stack.
    Opening {
        task: Task<Result<Opened, String>>,
        /// Steps done, and of how many; 0 of 0 before it is known.
        progress: Arc<[AtomicUsize; 2]>,
    },
    /// Searching one image.
    Searching {
        image: usize,
        task: Task<Result<Outline, String>>,
    },
}

/// What came of it.
pub enum Finished {
    Opened(Result<Box<Opened>, String>),
    Searched {
        image: usize,
        found: Result<Outline, String>,
    },
}

impl Work {
    /// Begins to read images and to find the gland in them.
    pub fn open(images: Images) -> Self {
        let progress = Arc::<[AtomicUsize; 2]>::default();
        let told = progress.clone();
        let task = AsyncComputeTaskPool::get().spawn(async move { open(images, &told) });
        Self::Opening { task, progress }
    }

    /// Begins to search one image from the outline it has.
    pub fn search(image: usize, stack: &Arc<Stack>, model: &Arc<Model>, outlines: &Outlines) -> Self {
        let (stack, model, outlines) = (stack.clone(), model.clone(), outlines.clone());
        let task = AsyncComputeTaskPool::get().spawn(async move {
            let found = outlines.search(image, &stack, &model, SEED);
            found.map_err(in_words)
        });
        Self::Searching { image, task }
    }

    /// What came of it, once it is done.
    pub fn poll(&mut self) -> Option<Finished> {
        match self {
            Self::Opening { task, .. } => {
                let opened = block_on(poll_once(task))?;
                Some(Finished::Opened(opened.map(Box::new)))
            }
            Self::Searching { image, task } => {
                let found = block_on(poll_once(task))?;
                Some(Finished::Searched { image: *image, found })
            }
        }
    }

    /// What is going on, in words, and the share that is done where it is known.
    pub fn told(&self) -> (&'static str, Option<f32>) {
        match self {
            Self::Opening { progress, .. } => {
                let [done, of] = [0, 1].map(|index| progress[index].load(Ordering::Relaxed));
                match of {
                    0 => ("Preparing the images ...", None),
                    _ => ("Looking for the gland ...", Some(done as f32 / of as f32)),
                }
            }
            Self::Searching { .. } => ("Searching this image ...", None),
        }
    }
}

fn open(images: Images, progress: &[AtomicUsize; 2]) -> Result<Opened, String> {
    let (stack, name, case, model) = match images {
        Images::Files(files) => {
            let stack = read_stack(&files.path, &files.geometry).map_err(in_words)?;
            let model = match files.model {
                Some(file) => file,
                None => assets::find().map_err(in_words)?.join(assets::PROSTATE_MODEL),
            };
            let model = Model::load(&model).map_err(in_words)?;
            (stack, name_of(&files.path), files.case, model)
        }
        Images::Example => {
            let case = assets::find().map_err(in_words)?.join(EXAMPLE);
            let case = Case::load(&case).map_err(in_words)?;
            let stack = synthetic(&case, EXAMPLE_SEED)?;
            (stack, "example".to_owned(), None, synthetic_model(progress)?)
        }
    };
    let mut name = name;
    let mut file = format!("{name}{CASE_SUFFIX}");
    let mut source = CaseSource {
        description: format!("outlined in the images {name} with a model of the prostate"),
        licence: "unknown".into(),
    };
    let (outlines, note) = match case {
        Some(path) => {
            let case = Case::load(&path).map_err(in_words)?;
            file = path.display().to_string();
            (name, source) = (case.name.clone(), case.source.clone());
            let (outlines, left_out) = Outlines::of_case(&stack, &case);
            let note = format!("{left_out} outlines of {file} lie at no image and are left out");
            (outlines, (left_out > 0).then_some(note))
        }
        None => {
            let found = annotate(&stack, &model, SEED, |done, of| {
                progress[0].store(done, Ordering::Relaxed);
                progress[1].store(of, Ordering::Relaxed);
            });
            match found {
                Ok(found) => (Outlines::found(&stack, found), None),
                // There is something to look at, and to draw on.
                Err(error) => (Outlines::none(&stack), Some(error.to_string())),
            }
        }
    };
    Ok(Opened {
        stack: Arc::new(stack),
        model: Arc::new(model),
        outlines,
        name,
        file,
        source,
        note,
    })
}

fn synthetic(case: &Case, seed: u64) -> Result<Stack, String> {
    let options = SyntheticOptions {
        spacing_mm: EXAMPLE_SPACING_MM,
        ..SyntheticOptions::MODERATE
    };
    synthesize(case, &options, seed).map_err(in_words)
}

/// A model of synthetic ultrasound.
fn synthetic_model(progress: &[AtomicUsize; 2]) -> Result<Model, String> {
    let learned_from = |(index, (volume_ml, median_lobe_mm)): (usize, (f64, f64))| {
        let spec = GlandSpec {
            volume_ml,
            median_lobe_mm,
            seed: 1 + index as u64,
        };
        let case = generate(&spec).map_err(in_words)?;
        Ok(TrainingCase {
            name: format!("{volume_ml} ml"),
            stack: synthetic(&case, spec.seed)?,
            outlines: case.slices.into_iter().map(|slice| (slice.z, slice.capsule)).collect(),
        })
    };
    let cases = LEARNED_FROM.into_iter().enumerate().map(learned_from);
    let cases = cases.collect::<Result<Vec<_>, String>>()?;
    let attribution = "Learned from synthetic ultrasound of generated glands";
    Model::train(&cases, attribution, SEED, |done, of| {
        progress[0].store(done, Ordering::Relaxed);
        progress[1].store(of, Ordering::Relaxed);
    })
    .map_err(in_words)
}

fn in_words(error: impl std::fmt::Display) -> String {
    error.to_string()
}

/// The images' name up to its first dot.
fn name_of(path: &Path) -> String {
    // A folder may be given as `.`.
    let whole = path.canonicalize().unwrap_or_else(|_| path.into());
    let name = whole.file_name().unwrap_or_default().to_string_lossy();
    name.split('.').next().unwrap_or_default().to_owned()
}
