//! Takes a run down while it is played.

use std::collections::BTreeMap;

use bevy::prelude::*;
use resecta_instrument::InstrumentRecording;
use resecta_scenario::{
    ActiveExercise, Metrics, Report, RunState, ScenarioSystems, ScoreCard, StepProgress, state_hash,
};
use resecta_tissue::Tissue;

use crate::{
    identity::Build,
    inputs::MAX_STEPS,
    record::{HASH_EVERY, Hands, RunRecord},
};

/// Records the run that [`record_run`] was asked for. Needs the scenario's plugin.
#[derive(Debug, Default, Clone, Copy)]
pub struct RecorderPlugin;

impl Plugin for RecorderPlugin {
    fn build(&self, app: &mut App) {
        app.add_systems(
            FixedPostUpdate,
            (keep, finish)
                .chain()
                .in_set(ScenarioSystems::Last)
                .run_if(resource_exists::<RunRecorder>),
        )
        // A run that somebody ends does so between steps, and no later step is part of it.
        .add_systems(FixedFirst, finish.run_if(is_recording))
        .add_systems(Last, finish.run_if(is_recording));
    }
}

fn is_recording(recorder: Option<Res<RunRecorder>>, active: Option<Res<ActiveExercise>>) -> bool {
    active.is_some() && recorder.is_some_and(|recorder| !recorder.is_over)
}

/// A run as it is being recorded.
#[derive(Resource, Debug)]
pub struct RunRecorder {
    instrument: Entity,
    hands: Hands,
    steps: u64,
    begins_after: Option<u64>,
    hashes: Vec<u64>,
    is_over: bool,
    record: Option<RunRecord>,
}

impl RunRecorder {
    /// Steps since the exercise was put into the world.
    pub fn steps(&self) -> u64 {
        self.steps
    }

    /// Hashes of the gland so far, one every [`HASH_EVERY`] steps.
    pub fn hashes(&self) -> &[u64] {
        &self.hashes
    }

    /// The record, once the run has ended; none of a run without a step, of one longer than [`MAX_STEPS`], and of one whose
    /// instrument was put elsewhere on the way.
    pub fn take(&mut self) -> Option<RunRecord> {
        self.record.take()
    }
}

/// Begins to record the exercise in play, which was just put into the world, in place of any other. Nothing happens without one.
pub fn record_run(world: &mut World, hands: Hands) {
    let Some(instrument) = world.get_resource::<ActiveExercise>().map(|active| active.instrument) else {
        return;
    };
    world.entity_mut(instrument).insert(InstrumentRecording::default());
    world.insert_resource(RunRecorder {
        instrument,
        hands,
        steps: 0,
        begins_after: None,
        hashes: Vec::new(),
        is_over: false,
        record: None,
    });
}

fn keep(
    active: Res<ActiveExercise>,
    metrics: Res<Metrics>,
    tissues: Query<&Tissue>,
    mut recorder: ResMut<RunRecorder>,
) {
    if recorder.is_over || recorder.instrument != active.instrument {
        return;
    }
    recorder.steps += 1;
    if metrics.steps == 1 && recorder.begins_after.is_none() {
        recorder.begins_after = Some(recorder.steps - 1);
    }
    if recorder.steps.is_multiple_of(HASH_EVERY)
        && let Ok(tissue) = tissues.get(active.tissue)
    {
        recorder.hashes.push(state_hash(tissue.solver()));
    }
    recorder.is_over = recorder.steps > MAX_STEPS;
}

/// Makes the record in the step in which the run ends: a frame may have more steps, which are none of the run's.
fn finish(
    active: Res<ActiveExercise>,
    state: Res<RunState>,
    (metrics, card, progress): (Res<Metrics>, Res<ScoreCard>, Res<StepProgress>),
    tissues: Query<&Tissue>,
    recordings: Query<&InstrumentRecording>,
    mut recorder: ResMut<RunRecorder>,
) {
    if recorder.is_over || recorder.instrument != active.instrument || !matches!(*state, RunState::Ended(_)) {
        return;
    }
    recorder.is_over = true;
    let (Some(begins_after), Ok(tissue), Ok(recording)) = (
        recorder.begins_after,
        tissues.get(active.tissue),
        recordings.get(active.instrument),
    ) else {
        return;
    };
    if recording.states.len() as u64 != recorder.steps {
        return;
    }
    let hash = state_hash(tissue.solver());
    let report = Report::new(&active, *state, &metrics, &card, &progress, hash);
    // An exercise is plain data: RON writes all of it.
    let exercise = ron::to_string(&active.exercise).expect("an exercise is plain data");
    let bleeding = active
        .exercise
        .models
        .water
        .as_ref()
        .and_then(|water| water.bleeding.as_ref());
    let record = RunRecord {
        build: Build::this(),
        name: active.name.clone(),
        exercise,
        case: active.case.to_ron(),
        seeds: BTreeMap::from_iter(bleeding.map(|bleeding| ("vessels".into(), bleeding.seed))),
        hands: recorder.hands.clone(),
        step_s: recording.step_s,
        begins_after,
        start: recording.start,
        states: recording.states.clone(),
        hashes: std::mem::take(&mut recorder.hashes),
        report: report.to_json(),
    };
    recorder.record = Some(record);
}
