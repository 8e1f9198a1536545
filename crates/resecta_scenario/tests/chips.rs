//! Floating chips of an exercise, on the whole stack.

use std::path::Path;

use bevy::{prelude::*, time::TimeUpdateStrategy};
use resecta_chips::{Chips, ChipsPlugin, FloatingChip};
use resecta_fluid::FluidPlugins;
use resecta_instrument::InstrumentPlugin;
use resecta_scenario::{ActiveExercise, Library, MetricId, Metrics, RunState, ScenarioPlugin, spawn_exercise};
use resecta_tissue::{Tissue, TissuePlugin};

fn start(app: &mut App, exercise: &str) {
    let library = Library::new(Path::new("../../assets"));
    let prepared = library.load(exercise).and_then(|loaded| loaded.prepare()).unwrap();
    spawn_exercise(app.world_mut(), prepared);
    app.insert_resource(RunState::Running);
}

fn floating(app: &mut App) -> usize {
    app.world_mut().query::<&FloatingChip>().iter(app.world()).count()
}

#[test]
fn what_is_cut_free_floats_and_is_weighed_until_another_exercise_begins() {
    let mut app = App::new();
    app.add_plugins((
        MinimalPlugins,
        TissuePlugin::default(),
        FluidPlugins::default(),
        ChipsPlugin::default(),
        InstrumentPlugin,
        ScenarioPlugin::default(),
    ))
    .insert_resource(Time::<Fixed>::from_hz(60.0))
    .insert_resource(TimeUpdateStrategy::FixedTimesteps(1));
    start(&mut app, "middle_lobe");
    // The clock starts with the first update: no step yet, and no entities.
    app.update();
    app.update();
    let value = |app: &App, metric: MetricId| app.world().resource::<Metrics>().value(metric);
    assert_eq!(value(&app, MetricId::ChipsInBladder), 0.0);

    let active = app.world().resource::<ActiveExercise>();
    let tissue = active.tissue;
    let gone: Vec<u32> = active.marked.pentahedra().take(6).collect();
    for pentahedron in gone {
        let entity = app
            .world()
            .get::<Tissue>(tissue)
            .unwrap()
            .pentahedron_entity(pentahedron);
        app.world_mut().try_despawn(entity.unwrap()).ok();
    }
    for _ in 0..30 {
        app.update();
    }
    let removed = value(&app, MetricId::RemovedMass);
    let weighed = value(&app, MetricId::ChipsInBladder) + value(&app, MetricId::ChipsFlushed);
    assert!(
        removed > 0.0 && (weighed - removed).abs() < 1e-9,
        "{weighed} of {removed} g"
    );
    assert!(floating(&mut app) > 0);

    start(&mut app, "first_cuts");
    for _ in 0..3 {
        app.update();
    }
    assert!(!app.world().contains_resource::<Chips>());
    assert_eq!(floating(&mut app), 0);
    assert_eq!(value(&app, MetricId::ChipsInBladder), 0.0);
}
