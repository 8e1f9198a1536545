//! Plays a record again, step by step, and tells where it goes another way.

use std::{fmt, path::Path};

use bevy::prelude::*;
use resecta_instrument::InstrumentSource;
use resecta_scenario::{EndReason, Extensions, PreparedExercise, Report, RunState, headless, spawn_exercise};
use serde_json::Value;

use crate::{
    error::RecordError,
    record::{HASH_EVERY, RunRecord},
    recorder::{RecorderPlugin, RunRecorder, record_run},
};

/// Where a run that is played again goes another way than its record.
#[derive(Debug, Clone, PartialEq)]
pub enum Difference {
    /// The gland is another. Hashes are kept every [`HASH_EVERY`] steps: up to the one before it was the same.
    Gland {
        /// The first step whose hash differs.
        step: u64,
        /// The hash in the record.
        recorded: u64,
        /// The hash now.
        replayed: u64,
    },
    /// The run ends earlier, or not where it did.
    End {
        /// The step at which one of them ended.
        step: u64,
        /// Why the recorded run ended, where it did.
        recorded: Option<EndReason>,
        /// Why this one did.
        replayed: Option<EndReason>,
    },
    /// Something in the results is another.
    Results {
        /// The last step.
        step: u64,
        /// Path of the field in the report, such as `metrics[3].value`.
        field: String,
        /// Its value in the record.
        recorded: String,
        /// Its value now.
        replayed: String,
    },
}

impl fmt::Display for Difference {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Difference::Gland {
                step,
                recorded,
                replayed,
            } => {
                let from = step - HASH_EVERY + 1;
                write!(
                    formatter,
                    "differs from step {step} on at the latest, from {from} at the earliest: the gland's hash is {replayed:016x}, in the record {recorded:016x}"
                )
            }
            Difference::End {
                step,
                recorded,
                replayed,
            } => {
                let words = |reason: &Option<EndReason>| reason.map_or("it goes on", EndReason::words);
                write!(
                    formatter,
                    "differs in step {step}: {}; in the record {}",
                    words(replayed),
                    words(recorded)
                )
            }
            Difference::Results {
                step,
                field,
                recorded,
                replayed,
            } => write!(
                formatter,
                "differs after the last step, {step}: {field} of the report is {replayed}, in the record {recorded}"
            ),
        }
    }
}

/// Plays records again: what [`Replay::start`] put into the world. Brings [`RecorderPlugin`], for a replay is a run like any other.
#[derive(Debug, Default, Clone, Copy)]
pub struct ReplayPlugin;

impl Plugin for ReplayPlugin {
    fn build(&self, app: &mut App) {
        if !app.is_plugin_added::<RecorderPlugin>() {
            app.add_plugins(RecorderPlugin);
        }
        app.add_systems(FixedLast, follow.run_if(resource_exists::<Replay>));
    }
}

/// After every step.
fn follow(world: &mut World) {
    world.resource_scope(|world, mut replay: Mut<Replay>| {
        if !replay.is_over {
            replay.take_note(world);
        }
    });
}

/// A record that is being played again, in an app with [`ReplayPlugin`].
#[derive(Resource, Debug, Clone)]
pub struct Replay {
    record: RunRecord,
    compared: usize,
    is_over: bool,
    /// The first difference, once there is one.
    pub difference: Option<Difference>,
}

impl Replay {
    /// The exercise of a record, ready to be played; `file` is named in errors.
    ///
    /// # Errors
    /// [`RecordError`] names what is wrong with the exercise or the case.
    pub fn prepare(record: &RunRecord, file: &Path, extensions: &Extensions) -> Result<PreparedExercise, RecordError> {
        let loaded = record.exercise(file, extensions)?;
        loaded.prepare().map_err(|source| RecordError::Exercise {
            file: file.into(),
            source: source.into(),
        })
    }

    /// Puts the run into the world at its begin.
    pub fn start(world: &mut World, record: RunRecord, prepared: PreparedExercise) {
        let active = spawn_exercise(world, prepared);
        let source = InstrumentSource::Recording(record.recording());
        world.entity_mut(active.instrument).insert(source);
        record_run(world, record.hands.clone());
        let replay = Self {
            record,
            compared: 0,
            is_over: false,
            difference: None,
        };
        replay.begin_where_it_began(world, 0);
        world.insert_resource(replay);
    }

    /// The record.
    pub fn record(&self) -> &RunRecord {
        &self.record
    }

    /// Steps that were played.
    pub fn steps(world: &World) -> u64 {
        world.get_resource::<RunRecorder>().map_or(0, RunRecorder::steps)
    }

    /// Compares what can be compared, begins the run after its briefing and ends it where whoever played it did.
    fn take_note(&mut self, world: &mut World) {
        let step = Self::steps(world);
        self.begin_where_it_began(world, step);
        let recorder = world.resource::<RunRecorder>();
        for (index, &replayed) in recorder.hashes().iter().enumerate().skip(self.compared) {
            let recorded = self.record.hashes.get(index).copied().unwrap_or(replayed);
            if recorded != replayed {
                let step = (index as u64 + 1) * HASH_EVERY;
                self.difference.get_or_insert(Difference::Gland {
                    step,
                    recorded,
                    replayed,
                });
            }
            self.compared = index + 1;
        }
        let steps = self.record.states.len() as u64;
        let results = self.record.results();
        let ended = match *world.resource::<RunState>() {
            RunState::Ended(reason) => Some(reason),
            RunState::Briefing | RunState::Running => None,
        };
        if ended.is_some() && step < steps {
            self.difference.get_or_insert(Difference::End {
                step,
                recorded: None,
                replayed: ended,
            });
        }
        self.is_over = ended.is_some() || step >= steps;
        if step < steps {
            return;
        }
        // A hand on the keyboard or the end of a script ended it: no rule does so again.
        let ended = match (ended, results.run.ended) {
            (None, by_hand @ (EndReason::Player | EndReason::InputEnded)) => {
                world.insert_resource(RunState::Ended(by_hand));
                Some(by_hand)
            }
            (ended, _) => ended,
        };
        if ended != Some(results.run.ended) {
            self.difference.get_or_insert(Difference::End {
                step,
                recorded: Some(results.run.ended),
                replayed: ended,
            });
            // Nothing is left to play.
            if ended.is_none() {
                world.insert_resource(RunState::Ended(EndReason::InputEnded));
            }
        }
        if self.difference.is_none()
            && let Some(report) = Report::of_world(world)
        {
            let replayed = serde_json::from_str(&report.to_json()).unwrap_or_default();
            let recorded = serde_json::from_str(&self.record.report).unwrap_or_default();
            self.difference =
                first_difference(String::new(), &recorded, &replayed).map(|(field, recorded, replayed)| {
                    Difference::Results {
                        step,
                        field,
                        recorded,
                        replayed,
                    }
                });
        }
    }

    fn begin_where_it_began(&self, world: &mut World, step: u64) {
        if step == self.record.begins_after && *world.resource::<RunState>() == RunState::Briefing {
            world.insert_resource(RunState::Running);
        }
    }

    /// Plays the whole record in an app made by [`headless::app`]; `after_step` is told how many steps were played. Returns the
    /// first difference, and the report of the run as it went now.
    ///
    /// # Errors
    /// As of [`Replay::prepare`].
    pub fn check(
        app: &mut App,
        record: RunRecord,
        file: &Path,
        mut after_step: impl FnMut(u64),
    ) -> Result<(Option<Difference>, Report), RecordError> {
        let extensions = app.world().get_resource::<Extensions>().cloned().unwrap_or_default();
        let prepared = Self::prepare(&record, file, &extensions)?;
        if !app.is_plugin_added::<ReplayPlugin>() {
            app.add_plugins(ReplayPlugin);
        }
        headless::finish_plugins(app);
        Self::start(app.world_mut(), record, prepared);
        while !app.world().resource::<Replay>().is_over {
            app.update();
            after_step(Self::steps(app.world()));
        }
        let difference = app.world().resource::<Replay>().difference.clone();
        let world = app.world();
        // The exercise was put into the world above, with all that a report is made of.
        let report = Report::of_world(world).expect("an exercise is in play");
        Ok((difference, report))
    }
}

/// The first field in which two reports differ: its path and both values. The program's version is no result.
fn first_difference(path: String, recorded: &Value, replayed: &Value) -> Option<(String, String, String)> {
    match (recorded, replayed) {
        (Value::Object(recorded), Value::Object(replayed)) => {
            let keys = recorded
                .keys()
                .chain(replayed.keys().filter(|key| !recorded.contains_key(*key)));
            let mut keys = keys.filter(|key| *key != "resecta_version");
            keys.find_map(|key| {
                let path = if path.is_empty() {
                    key.clone()
                } else {
                    format!("{path}.{key}")
                };
                let of = |object: &serde_json::Map<String, Value>| object.get(key).cloned().unwrap_or_default();
                first_difference(path, &of(recorded), &of(replayed))
            })
        }
        (Value::Array(recorded), Value::Array(replayed)) if recorded.len() == replayed.len() => {
            let mut pairs = recorded.iter().zip(replayed).enumerate();
            pairs.find_map(|(index, (recorded, replayed))| {
                first_difference(format!("{path}[{index}]"), recorded, replayed)
            })
        }
        _ if recorded == replayed => None,
        _ => Some((path, recorded.to_string(), replayed.to_string())),
    }
}
