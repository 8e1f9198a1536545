//! Metrics, goals and exercises that crates of others add.
//!
//! An extension implements a trait and registers it, in any order and before or after our plugins:
//!
//! ```
//! use bevy::prelude::*;
//! use resecta_instrument::InstrumentState;
//! use resecta_scenario::{Better, MetricExtension, MetricInfo, ScenarioAppExt, ScenarioSystems};
//!
//! /// How far the loop was out at most, mm.
//! #[derive(Component, Default)]
//! struct Reach(f64);
//!
//! impl MetricExtension for Reach {
//!     const INFO: MetricInfo = MetricInfo {
//!         id: "largest_reach_mm",
//!         title: "Largest reach",
//!         unit: "mm",
//!         better: Better::Neither,
//!         doc: "How far the loop was out at most.",
//!     };
//!     fn value(&self) -> f64 {
//!         self.0
//!     }
//! }
//!
//! fn follow(mut reaches: Query<(&mut Reach, &InstrumentState)>) {
//!     for (mut reach, state) in &mut reaches {
//!         reach.0 = reach.0.max(f64::from(state.stroke_mm));
//!     }
//! }
//!
//! fn plugin(app: &mut App) {
//!     app.add_metric::<Reach>()
//!         .add_systems(FixedPostUpdate, follow.in_set(ScenarioSystems::Extend));
//! }
//! # App::new().add_plugins(plugin);
//! ```
//!
//! The component is put on the instrument of an exercise that names the metric, and on no other: an exercise that does not
//! name it has nothing for the system to find. An exercise file names a metric by its `id`, as any built-in one, and a goal
//! as `Extension("its_name")`, among `goals` and as `until` of a step.

mod id;
mod known;
mod make;
mod registry;

use bevy::prelude::*;
use resecta_instrument::InstrumentAction;

use crate::{exercise::Exercise, metrics::MetricInfo};

pub use id::{ExtensionMetric, GoalId};
pub use registry::{ExtensionError, Extensions, ScenarioAppExt};

pub(crate) use known::{known_goal, known_metric, while_known};
pub(crate) use registry::tell_refused;

/// A metric of an extension: a component on the instrument of every exercise that names it, which a system of the extension in
/// [`ScenarioSystems::Extend`](crate::ScenarioSystems::Extend) brings up to date. A run begins with its default.
pub trait MetricExtension: Component + Default {
    /// Its row in the table of metrics. The id is of `a` to `z`, `0` to `9` and `_`, and no other metric's or goal's.
    const INFO: MetricInfo;
    /// What to do better where it lost points, a sentence of the debriefing.
    const ADVICE: Option<&'static str> = None;

    /// The value so far, in the unit of its row. One that is not finite is passed over, and the value before stays.
    fn value(&self) -> f64;
}

/// A goal of an extension, a component as [`MetricExtension`] is. It ends a run, or a step that names it, when its share is 1; the
/// share counts from the start of the run. It is a metric, too: a line of a score may name it.
pub trait GoalExtension: Component + Default {
    /// Its name in exercise files, of `a` to `z`, `0` to `9` and `_`, and no other metric's or goal's.
    const NAME: &'static str;
    /// What is to be done, for the player.
    const WORDS: &'static str;
    /// What the player does it with: a step that waits for it shows their inputs.
    const ACTIONS: &'static [InstrumentAction] = &[];

    /// How far it is reached, 0 to 1.
    fn share(&self) -> f64;
}

/// An exercise of an extension, found in the library by its name as a file's is.
pub trait ExerciseExtension: 'static {
    /// Its name, of `a` to `z`, `0` to `9` and `_`. A shipped file of that name goes before it.
    const NAME: &'static str;

    /// What a file would say. A path in it is relative to the working directory.
    fn exercise() -> Exercise;
}

#[cfg(test)]
mod tests;
