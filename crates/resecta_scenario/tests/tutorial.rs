//! The shipped tutorial, played by its shipped script on the whole stack.

use std::path::Path;

use bevy::{prelude::*, time::TimeUpdateStrategy};
use resecta_fluid::FluidPlugins;
use resecta_instrument::{InstrumentLimits, InstrumentPlugin, InstrumentScript, InstrumentSource};
use resecta_scenario::{
    EndReason, Library, MetricId, Metrics, Report, RunLog, RunState, ScenarioPlugin, Trace, spawn_exercise,
};
use resecta_tissue::TissuePlugin;

#[test]
fn whoever_does_what_the_tutorial_says_finishes_it() {
    let assets = Path::new("../../assets");
    let prepared = Library::new(assets).load("tutorial").unwrap().prepare().unwrap();
    let script = InstrumentScript::load(&assets.join("scripts/tutorial.ron"), &InstrumentLimits::default()).unwrap();
    let mut app = App::new();
    app.add_plugins((
        MinimalPlugins,
        TissuePlugin::default(),
        FluidPlugins::default(),
        InstrumentPlugin,
        ScenarioPlugin::default(),
    ))
    .insert_resource(Time::<Fixed>::from_hz(60.0))
    .insert_resource(TimeUpdateStrategy::FixedTimesteps(1))
    .init_resource::<Trace>()
    .init_resource::<RunLog>();
    let active = spawn_exercise(app.world_mut(), prepared);
    app.world_mut()
        .entity_mut(active.instrument)
        .insert(InstrumentSource::Script(script));
    app.update();
    app.insert_resource(RunState::Running);
    while *app.world().resource::<RunState>() == RunState::Running {
        app.update();
    }

    let world = app.world();
    assert_eq!(*world.resource::<RunState>(), RunState::Ended(EndReason::GoalsReached));
    let metrics = world.resource::<Metrics>();
    let steps = active.exercise.steps.len();
    assert_eq!(metrics.value(MetricId::StepsDone), steps as f64);
    let report = Report::of_world(world).unwrap();
    let times: Vec<f64> = report.steps.iter().map(|step| step.done_at_s.unwrap()).collect();
    assert!(times.len() == steps && times.is_sorted_by(|a, b| a < b), "{times:?}");
    let rows = &world.resource::<Trace>().rows;
    assert_eq!(rows.last().unwrap().steps_done as usize, steps);
    // A row before a step is done has one step less than the row in which it is.
    assert!(rows.windows(2).all(|pair| pair[1].steps_done - pair[0].steps_done <= 1));
    let log = &world.resource::<RunLog>().samples;
    assert_eq!(log.last().unwrap().time_s, metrics.elapsed_s());
    assert!((log.last().unwrap().removed_ml - metrics.removal.volume_mm3 / 1000.0).abs() < 1e-12);
    assert!(log.is_sorted_by(|a, b| a.removed_ml <= b.removed_ml && a.blood_ml <= b.blood_ml));
}
