//! What the tests of this package share.

// Every test program uses a part of this.
#![allow(dead_code)]

use std::path::Path;

use bevy::prelude::*;
use resecta_instrument::{InstrumentLimits, InstrumentRequest, InstrumentScript, InstrumentSource};
use resecta_records::{Hands, RecorderPlugin, RunRecord, RunRecorder, record_run};
use resecta_scenario::{
    ActiveExercise, EndReason, Library, LoadedExercise, RunState, assets, headless, spawn_exercise,
};

/// Two strokes from beside the verumontanum. Where they go is not the point, only that they cut.
const SCRIPT: &str = "(keys: [
    (time_s: 0, roll_deg: 90, stroke_mm: 0),
    (time_s: 0.3, stroke_mm: 12),
    (time_s: 0.4, stroke_mm: 12, yaw_deg: 0, cut: true),
    (time_s: 0.6, yaw_deg: 4),
    (time_s: 1.0, stroke_mm: 0, cut: false, yaw_deg: 4, roll_deg: 90),
    (time_s: 1.2, stroke_mm: 2),
])";

/// A shipped exercise on a coarse lattice.
pub fn coarse(name: &str) -> LoadedExercise {
    let mut loaded = Library::new(assets::find().unwrap()).load(name).unwrap();
    loaded.exercise.alpha_deg = 20.0;
    loaded
}

/// An app that records.
pub fn app() -> App {
    let mut app = headless::app(None);
    app.add_plugins(RecorderPlugin);
    headless::finish_plugins(&mut app);
    app
}

/// A short run by a script.
pub fn scripted(loaded: LoadedExercise) -> RunRecord {
    let mut app = app();
    let script = InstrumentScript::from_ron(SCRIPT, Path::new("script.ron"), &InstrumentLimits::default()).unwrap();
    headless::start(&mut app, loaded.prepare().unwrap(), InstrumentSource::Script(script));
    record_run(app.world_mut(), Hands::Script("script.ron".into()));
    headless::play(&mut app, |_| {});
    app.world_mut().resource_mut::<RunRecorder>().take().unwrap()
}

/// A run as the game has it: a briefing in which the gland settles, then play by requests, ended by hand. `app` may have played
/// before.
pub fn played(app: &mut App, loaded: LoadedExercise, briefing: u32, steps: u32, trainee: &str) -> RunRecord {
    spawn_exercise(app.world_mut(), loaded.prepare().unwrap());
    record_run(
        app.world_mut(),
        Hands::Person {
            trainee: trainee.into(),
            ended_unix_s: 1_700_000_000,
        },
    );
    (0..briefing).for_each(|_| app.update());
    app.insert_resource(RunState::Running);
    let instrument = app.world().resource::<ActiveExercise>().instrument;
    for step in 0..steps {
        let mut request = app.world_mut().get_mut::<InstrumentRequest>(instrument).unwrap();
        request.0.stroke_mm = 6.0 + 6.0 * (step as f32 / 20.0).sin();
        request.0.pitch_deg = (step as f32 / 31.0).cos();
        request.0.outflow_tap = 1.0;
        request.0.cut = step % 40 > 20;
        app.update();
    }
    app.insert_resource(RunState::Ended(EndReason::Player));
    app.update();
    app.world_mut().resource_mut::<RunRecorder>().take().unwrap()
}
