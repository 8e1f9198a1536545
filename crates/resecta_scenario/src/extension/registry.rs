//! Which extensions an app has, by name.

use std::{any::TypeId, collections::BTreeMap};

use bevy::prelude::*;
use thiserror::Error;

use super::{ExerciseExtension, ExtensionMetric, GoalExtension, GoalId, MetricExtension};
use crate::{
    assets,
    errors::RuleError,
    exercise::{Exercise, Goal},
    library::Library,
    metrics::MetricId,
    trigger::Trigger,
};

/// The metrics, goals and exercises of extensions that an app has. Give them to a [`Library`](crate::Library) for the exercises that
/// name them.
#[derive(Resource, Debug, Clone, Default)]
pub struct Extensions {
    metrics: BTreeMap<&'static str, ExtensionMetric>,
    goals: BTreeMap<&'static str, GoalId>,
    exercises: BTreeMap<&'static str, (TypeId, fn() -> Exercise)>,
    refused: Vec<ExtensionError>,
}

/// Why an extension was not taken. What was registered before it stays.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
pub enum ExtensionError {
    /// Two of one name.
    #[error("extension `{type_name}`: the name \"{name}\" is taken")]
    NameTaken {
        /// The type that was refused.
        type_name: &'static str,
        /// Its name.
        name: &'static str,
    },
    /// A name that no file can use.
    #[error("extension `{type_name}`: the name \"{name}\" is not of a to z, 0 to 9 and _")]
    BadName {
        /// The type that was refused.
        type_name: &'static str,
        /// Its name.
        name: &'static str,
    },
    /// An exercise of a name that a shipped file has, too.
    #[error("exercise \"{name}\" of an extension: a shipped file has the name, and is used")]
    Shipped {
        /// The name.
        name: &'static str,
    },
}

/// Registers extensions.
pub trait ScenarioAppExt {
    /// Adds a metric: exercises may name it from now on. Its system goes into
    /// [`ScenarioSystems::Extend`](crate::ScenarioSystems::Extend).
    ///
    /// A name that is taken already, or that no file can use, is an [`ExtensionError`]: it is logged when the app starts, and
    /// kept in [`Extensions::refused`].
    fn add_metric<M: MetricExtension>(&mut self) -> &mut Self;

    /// Adds a goal, as [`ScenarioAppExt::add_metric`] does a metric.
    fn add_goal<G: GoalExtension>(&mut self) -> &mut Self;

    /// Adds an exercise, as [`ScenarioAppExt::add_metric`] does a metric.
    fn add_exercise<E: ExerciseExtension>(&mut self) -> &mut Self;
}

impl ScenarioAppExt for App {
    fn add_metric<M: MetricExtension>(&mut self) -> &mut Self {
        of_app(self).add_metric::<M>();
        self
    }

    fn add_goal<G: GoalExtension>(&mut self) -> &mut Self {
        of_app(self).add_goal::<G>();
        self
    }

    fn add_exercise<E: ExerciseExtension>(&mut self) -> &mut Self {
        of_app(self).add_exercise::<E>();
        self
    }
}

/// Our plugin may come later, or not at all.
fn of_app(app: &mut App) -> Mut<'_, Extensions> {
    app.world_mut().get_resource_or_init::<Extensions>()
}

impl Extensions {
    /// Adds a metric, or keeps why not in [`Extensions::refused`].
    pub fn add_metric<M: MetricExtension>(&mut self) {
        self.add_row::<M>(ExtensionMetric::of::<M>());
    }

    /// Adds a goal, or keeps why not in [`Extensions::refused`].
    pub fn add_goal<G: GoalExtension>(&mut self) {
        let goal = GoalId::of::<G>();
        if self.add_row::<G>(goal.metric()) {
            self.goals.insert(goal.name(), goal);
        }
    }

    /// Adds an exercise, or keeps why not in [`Extensions::refused`].
    pub fn add_exercise<E: ExerciseExtension>(&mut self) {
        let type_id = TypeId::of::<E>();
        let same = (self.exercises.get(E::NAME)).map(|(other, _)| *other == type_id);
        if self.may_add::<E>(E::NAME, same) {
            self.exercises.insert(E::NAME, (type_id, E::exercise));
        }
    }

    fn add_row<T>(&mut self, metric: ExtensionMetric) -> bool {
        let name = metric.info().id;
        let same = match self.metrics.get(name) {
            // A type that is a metric and a goal needs two names.
            Some(other) => Some(other.is_same(metric)),
            None => MetricId::from_id(name).map(|_| false),
        };
        let may_add = self.may_add::<T>(name, same);
        if may_add {
            self.metrics.insert(name, metric);
        }
        may_add
    }

    /// Whether a name is free. `same` says whether what has it is the same extension; none where nothing has.
    fn may_add<T>(&mut self, name: &'static str, same: Option<bool>) -> bool {
        let type_name = std::any::type_name::<T>();
        let is_plain = |byte: u8| byte.is_ascii_lowercase() || byte.is_ascii_digit() || byte == b'_';
        let refused = if name.is_empty() || !name.bytes().all(is_plain) {
            ExtensionError::BadName { type_name, name }
        } else if same == Some(false) {
            ExtensionError::NameTaken { type_name, name }
        } else {
            return same.is_none();
        };
        self.refused.push(refused);
        false
    }

    /// Whether none was registered.
    pub fn is_empty(&self) -> bool {
        self.metrics.is_empty() && self.exercises.is_empty() && self.refused.is_empty()
    }

    /// What was not taken, and why.
    pub fn refused(&self) -> &[ExtensionError] {
        &self.refused
    }

    /// The metric of this id, goals among them.
    pub fn metric(&self, id: &str) -> Option<MetricId> {
        self.metrics.get(id).copied().map(MetricId::Extension)
    }

    /// The goal of this name.
    pub fn goal(&self, name: &str) -> Option<GoalId> {
        self.goals.get(name).copied()
    }

    /// The exercise of this name.
    pub fn exercise(&self, name: &str) -> Option<Exercise> {
        self.exercises.get(name).map(|(_, exercise)| exercise())
    }

    /// The ids of the metrics, goals among them, sorted.
    pub fn metric_names(&self) -> impl Iterator<Item = &'static str> {
        self.metrics.keys().copied()
    }

    /// The names of the goals, sorted.
    pub fn goal_names(&self) -> impl Iterator<Item = &'static str> {
        self.goals.keys().copied()
    }

    /// The names of the exercises, sorted.
    pub fn exercise_names(&self) -> impl Iterator<Item = &'static str> {
        self.exercises.keys().copied()
    }

    /// Whether all that an exercise made in Rust names is registered; for a file, its reading has told.
    pub(crate) fn check(&self, exercise: &Exercise) -> Result<(), RuleError> {
        for (field, metric) in exercise.extensions() {
            let name = metric.info().id;
            if !self.metrics.contains_key(name) {
                let expected = "one that the app has: `add_metric` or `add_goal` its type";
                return Err(RuleError::unknown_name(field, name, expected, self.metric_names()));
            }
        }
        Ok(())
    }
}

impl Exercise {
    /// The metrics and goals of extensions that it names, and where.
    pub(crate) fn extensions(&self) -> impl Iterator<Item = (String, ExtensionMetric)> {
        let steps = self
            .steps
            .iter()
            .enumerate()
            .filter_map(|(index, step)| match step.until {
                Trigger::Extension(goal) => Some((format!("steps[{index}].until"), MetricId::Extension(goal.metric()))),
                _ => None,
            });
        let goals = self.goals.iter().enumerate().filter_map(|(index, goal)| match goal {
            Goal::Extension(goal) => Some((format!("goals[{index}]"), MetricId::Extension(goal.metric()))),
            _ => None,
        });
        let lines = self.scoring.iter().enumerate().flat_map(|(index, rule)| {
            let needs = rule
                .needs
                .map(|needs| (format!("scoring[{index}].needs.metric"), needs.metric));
            [Some((format!("scoring[{index}].metric"), rule.metric)), needs]
                .into_iter()
                .flatten()
        });
        let all = steps.chain(goals).chain(lines);
        all.filter_map(|(field, metric)| match metric {
            MetricId::Extension(metric) => Some((field, metric)),
            _ => None,
        })
    }
}

/// Tells what was not taken and what is not found, once there is a log.
pub(crate) fn tell_refused(extensions: Res<Extensions>) {
    for refused in extensions.refused() {
        error!("{refused}");
    }
    if let Ok(assets) = assets::find() {
        let library = Library::new(assets).with_extensions(extensions.clone());
        library.shadowed().for_each(|shadowed| error!("{shadowed}"));
    }
}
