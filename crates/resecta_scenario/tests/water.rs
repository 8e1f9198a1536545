//! Blood and water of an exercise, on the whole stack.

use std::path::Path;

use bevy::{prelude::*, time::TimeUpdateStrategy};
use resecta_fluid::{Absorption, Bladder, Circulation, FluidPlugins, Irrigation, Lens, Turbidity, VesselKind, Vessels};
use resecta_instrument::{InstrumentPlugin, InstrumentState, Resectoscope};
use resecta_scenario::{ActiveExercise, Library, MetricId, Metrics, RunState, ScenarioPlugin, spawn_exercise};
use resecta_tissue::{Tissue, TissuePlugin};

fn app(exercise: &str) -> App {
    let mut app = App::new();
    app.add_plugins((
        MinimalPlugins,
        TissuePlugin::default(),
        FluidPlugins::default(),
        InstrumentPlugin,
        ScenarioPlugin::default(),
    ))
    .insert_resource(Time::<Fixed>::from_hz(60.0))
    .insert_resource(TimeUpdateStrategy::FixedTimesteps(1));
    start(&mut app, exercise);
    // The clock starts with the first update: no step yet.
    app.update();
    app
}

fn start(app: &mut App, exercise: &str) {
    let library = Library::new(Path::new("../../assets"));
    let prepared = library.load(exercise).and_then(|loaded| loaded.prepare()).unwrap();
    spawn_exercise(app.world_mut(), prepared);
    app.insert_resource(RunState::Running);
}

fn value(app: &App, metric: MetricId) -> f64 {
    app.world().resource::<Metrics>().value(metric)
}

#[test]
fn a_cut_artery_bleeds_clouds_the_water_and_is_counted_until_another_exercise_begins() {
    let mut app = app("middle_lobe");
    let ActiveExercise { tissue, instrument, .. } = *app.world().resource::<ActiveExercise>();
    app.insert_resource(RunState::Briefing);
    for _ in 0..60 {
        app.update();
    }
    let still = app.world().resource::<Bladder>();
    assert_eq!(
        (still.volume_ml(), still.totals().irrigated_ml),
        (150.0, 0.0),
        "a briefing is read"
    );
    app.insert_resource(RunState::Running);
    for _ in 0..60 {
        app.update();
    }
    let totals = *app.world().resource::<Bladder>().totals();
    assert!(totals.irrigated_ml > 3.0, "{totals:?}");
    assert!((value(&app, MetricId::Irrigated) - totals.irrigated_ml).abs() < 1e-9);
    assert_eq!(value(&app, MetricId::BloodLost), 0.0);

    // The pentahedra of ten arteries go at once.
    let vessels = app.world().get::<Vessels>(tissue).expect("the exercise names them");
    let arteries = vessels.iter().filter(|(vessel, _)| vessel.kind == VesselKind::Arterial);
    let carriers: Vec<u32> = arteries.map(|(vessel, _)| vessel.pentahedron).take(10).collect();
    for carrier in carriers {
        let entity = app.world().get::<Tissue>(tissue).unwrap().pentahedron_entity(carrier);
        // Two may lie in one.
        app.world_mut().try_despawn(entity.unwrap()).ok();
    }
    for _ in 0..120 {
        app.update();
    }
    let lost = app.world().resource::<Circulation>().blood_loss_ml();
    assert!(lost > 0.5, "{lost} ml");
    assert!((value(&app, MetricId::BloodLost) - lost).abs() < 1e-9);
    assert!(app.world().resource::<Turbidity>().visibility() < 1.0);
    // The lens is where the telescope is.
    let state = *app.world().get::<InstrumentState>(instrument).unwrap();
    let scope = app.world().get::<Resectoscope>(instrument).unwrap();
    let lens = app.world().get::<Lens>(instrument).unwrap();
    assert_eq!(lens.tip, Vec3::from(scope.lens_pose(&state).translation));

    start(&mut app, "first_cuts");
    for _ in 0..3 {
        app.update();
    }
    let world = app.world();
    assert!(!world.contains_resource::<Bladder>() && !world.contains_resource::<Irrigation>());
    assert!(!world.contains_resource::<Circulation>() && !world.contains_resource::<Turbidity>());
    assert!(!world.contains_resource::<Absorption>());
    for metric in [
        MetricId::BloodLost,
        MetricId::Irrigated,
        MetricId::Absorbed,
        MetricId::BlindTime,
    ] {
        assert_eq!(value(&app, metric), 0.0, "{metric}");
    }
}
