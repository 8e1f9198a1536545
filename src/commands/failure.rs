//! Why a command ended without doing what it was asked for: one message each, that names the file, the field and the rule.

use std::{io, path::PathBuf};

use bevy::math::DVec3;
use resecta::{
    anatomy::{CaseError, CaseRuleError, LatticeError, generate::GenerateError, import::ImportError},
    annotate::{AnnotateError, ModelError, StackError, TrainError, TrainingFolderError},
    assets::AssetsMissing,
    game::GameError,
    instrument::{RecordingError, ScriptError},
    measured::MeasuredError,
    rates::RateError,
    records::{Difference, ProgressError, RecordError},
    scenario::{ExerciseError, LoadCaseError},
    spring_scene::SpringSceneError,
    view::{NoAdapter, PictureError},
};
use thiserror::Error;

/// Why a command failed.
#[derive(Debug, Error)]
pub enum Failure {
    #[error(transparent)]
    Assets(#[from] AssetsMissing),
    #[error(transparent)]
    Case(#[from] CaseError),
    #[error(transparent)]
    Import(#[from] ImportError),
    #[error(transparent)]
    Stack(#[from] StackError),
    #[error(transparent)]
    Model(#[from] ModelError),
    #[error("{}: {source}", images.display())]
    Annotate { images: PathBuf, source: AnnotateError },
    #[error("{}: the outlines found make no case: {source}", images.display())]
    AnnotatedCase { images: PathBuf, source: CaseRuleError },
    #[error("urethra: {place} mm lies in no outline that was found")]
    Urethra { place: DVec3 },
    #[error(transparent)]
    TrainingFolder(#[from] TrainingFolderError),
    #[error("{}: {source}", folder.display())]
    Train { folder: PathBuf, source: TrainError },
    #[error(transparent)]
    Generate(#[from] GenerateError),
    #[error(transparent)]
    Measured(#[from] MeasuredError),
    #[error(transparent)]
    Exercise(#[from] ExerciseError),
    #[error(transparent)]
    Script(#[from] ScriptError),
    #[error(transparent)]
    Game(#[from] GameError),
    #[error("frames: {0}")]
    NoAdapter(#[from] NoAdapter),
    #[error("frames: {0}")]
    Pictures(#[from] PictureError),
    #[error(
        "frames: the run of the pictures ended as {pictures}, the run of the report as {report}: a defect of the program"
    )]
    PicturesDiffer { pictures: String, report: String },
    #[error("player: nobody shows {exercise}; expected `shown_by` in its file, or `careful` or `careless` here")]
    NobodyShows { exercise: String },
    #[error(transparent)]
    Recording(#[from] RecordingError),
    #[error(transparent)]
    Record(#[from] RecordError),
    #[error("{}: {difference}", file.display())]
    ReplayDiffers { file: PathBuf, difference: Difference },
    #[error("{}: the score is {computed}, in the record {recorded}", file.display())]
    ScoreDiffers {
        file: PathBuf,
        recorded: f64,
        computed: f64,
    },
    #[error(transparent)]
    Progress(#[from] ProgressError),
    #[error("trainee: there is no \"{name}\"; there {}", list(trainees))]
    NoSuchTrainee { name: String, trainees: Vec<String> },
    #[error(transparent)]
    LoadCase(#[from] LoadCaseError),
    #[error("{case}: {source}")]
    Lattice { case: String, source: LatticeError },
    #[error("{case}: material is \"{material}\"; expected one of {}", presets.join(", "))]
    Material {
        case: String,
        material: String,
        presets: Vec<&'static str>,
    },
    #[error("{}: {option} is for masks (.nii, .nii.gz) and says nothing about a contour file", input.display())]
    MaskOption { input: PathBuf, option: &'static str },
    #[error("{case}: {source}")]
    Rates { case: String, source: RateError },
    #[error(transparent)]
    SpringScene(#[from] SpringSceneError),
    #[error(transparent)]
    Accuracy(#[from] resecta_methods::ReportError),
    #[error("{}: {problem}", scene.display())]
    Solve { scene: PathBuf, problem: String },
    #[error("{faults} faults in {bad} of {files} files")]
    Invalid { faults: usize, bad: usize, files: usize },
    #[error("{}: is there already; another name writes another file", file.display())]
    IsThere { file: PathBuf },
    #[error("{}: cannot be written: {source}", file.display())]
    Write { file: PathBuf, source: io::Error },
    #[error("{}: cannot be read: {source}", file.display())]
    ReadPicture { file: PathBuf, source: io::Error },
    #[error("{}: out: {rule}", folder.display())]
    OutFolder { folder: PathBuf, rule: String },
}

fn list(trainees: &[String]) -> String {
    match trainees {
        [] => "is nobody yet".into(),
        [one] => format!("is {one}"),
        all => format!("are {}", all.join(", ")),
    }
}
