//! Exercises, metrics, scores and the record of a run.
//!
//! An [`Exercise`] is a file. [`Library::load`] reads it with its case, [`LoadedExercise::prepare`] builds the gland and
//! places the instrument, [`spawn_exercise`] puts them into the world; a file with a fault is refused by the first two
//! and changes nothing. While [`RunState`] is `Running`, [`ScenarioPlugin`] measures every fixed step ([`Metrics`]),
//! keeps the [`ScoreCard`] and ends the run; [`Report::of_world`] is what remains of it.
//!
//! | to find | look in |
//! |---|---|
//! | what an exercise file may say | `exercise.rs` |
//! | which rules it must keep | `rules.rs`, `reach.rs` |
//! | which tissue is marked | `region.rs` |
//! | what is cut before it begins | `begun.rs` |
//! | which blood and water it has | `water.rs` |
//! | whether what is cut free floats | `chips.rs` |
//! | the table of metrics, and how each is measured | `metrics/` |
//! | how points follow from metrics | `score.rs` |
//! | bronze, silver, gold | `pars.rs` |
//! | steps of a tutorial and what ends them | `steps.rs`, `trigger.rs` |
//! | what was cut, by height and hour | `cut_map.rs` |
//! | how far the loop is from capsule and sphincter | `clearance.rs` |
//! | where the organ holds a sheath in hands | `confine.rs` |
//! | samples of a run over time | `run_log.rs` |
//! | what ends a run early | `limits.rs` |
//! | what to do better | `advice.rs` |
//! | who shows an exercise | `shown.rs` |
//! | the order in which exercises are taken | `curriculum.rs` |
//! | metrics, goals and exercises of others | `extension/` |
//! | mods: folders of exercises and cases of others | `mods/` |
//! | the reference of exercise files, and their schema | `reference/` |
//! | whether files are good | `validate.rs` |
//! | a file to begin with | `template.rs` |
//! | the order of a step | `plugin.rs` |
//! | the whole simulation as plugins, and without a window | `plugins.rs`, `headless.rs` |
//! | tests of exercises and extensions | `testing.rs` |
//! | where the shipped assets are | `assets.rs` |
//!
//! ```no_run
//! use bevy::prelude::*;
//! use resecta_scenario::{ExerciseError, Library, RunState, spawn_exercise};
//!
//! fn start(world: &mut World) -> Result<(), ExerciseError> {
//!     let prepared = Library::new("assets").load("first_cuts")?.prepare()?;
//!     spawn_exercise(world, prepared);
//!     world.insert_resource(RunState::Running);
//!     Ok(())
//! }
//! ```

mod active;
mod admit;
mod advice;
mod anchor;
pub mod assets;
mod begun;
mod chips;
mod clearance;
mod confine;
mod curriculum;
mod cut_map;
mod errors;
mod exercise;
mod extension;
mod false_passage;
pub mod headless;
mod landmarks;
mod library;
mod limits;
mod marked_way;
pub mod metrics;
pub mod mods;
mod on_case;
mod pars;
mod parse;
mod plugin;
mod plugins;
mod prepare;
mod reach;
pub mod reference;
mod region;
mod report;
mod rules;
mod run_log;
mod score;
mod shown;
mod sight;
mod state;
mod steps;
mod template;
pub mod testing;
mod trace;
mod trigger;
mod validate;
mod walls;
mod water;

pub use active::{ActiveExercise, spawn_exercise};
pub use advice::{Advice, advice};
pub use begun::{Begun, Trench};
pub use clearance::LoopClearance;
pub use curriculum::{Curriculum, Level, Needs};
pub use cut_map::{CutCell, CutMap};
pub use errors::{ExerciseError, RuleError};
pub use exercise::{
    ClockRange, Condition, Exercise, Goal, HeightRange, InstrumentSetup, Marked, Models, Part, Range, ScoreRule,
};
pub use extension::{
    ExerciseExtension, ExtensionError, ExtensionMetric, Extensions, GoalExtension, GoalId, MetricExtension,
    ScenarioAppExt,
};
pub use landmarks::mean_way;
pub use library::{CASE_SUFFIX, EXERCISE_SUFFIX, Library, LoadedExercise, MAX_FILE_BYTES};
pub use limits::Limits;
pub use metrics::{Better, MetricId, MetricInfo, Metrics};
pub use mods::{Mod, ModAside, ModError, Mods};
pub use on_case::LoadCaseError;
pub use pars::{Medal, Pars};
pub use plugin::{ScenarioPlugin, ScenarioSystems};
pub use plugins::{CATCH_UP_S, FixedStepPlugin, ResectaPlugins, STEP_HZ};
pub use prepare::{LatticeSummary, PreparedExercise};
pub use region::MarkedRegion;
pub use report::{CaseSummary, ExerciseSummary, FORMAT, MetricValue, Report, RunSummary, StepSummary, state_hash};
pub use resecta_text::Place;
pub use run_log::{LogSample, RunLog, STEPS_A_SAMPLE};
pub use score::{GoalState, PartScore, ScoreCard, ScoreLine};
pub use shown::{Demonstration, ShownBy};
pub use sight::{FAR_MM, LandmarkObservation, Sight, Unseen};
pub use state::{CapsulePerforated, EndReason, RunState};
pub use steps::{Step, StepProgress};
pub use template::{check_name, new_case, new_exercise, new_mod};
pub use trace::{COLUMNS, Trace, TraceRow};
pub use trigger::Trigger;
pub use validate::{FileFault, Validation};
pub use walls::Walls;
pub use water::{Bleeding, Water};

/// What a user types daily.
pub mod prelude {
    pub use crate::{
        ActiveExercise, Better, CapsulePerforated, EndReason, Exercise, ExerciseExtension, Extensions, GoalExtension,
        Library, MetricExtension, MetricId, MetricInfo, Metrics, Report, RunState, ScenarioAppExt, ScenarioPlugin,
        ScenarioSystems, ScoreCard, Trace, spawn_exercise,
    };
}
