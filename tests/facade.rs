//! The facade: what a user of the library types.

mod common;

use bevy::{
    ecs::schedule::{LogLevel, ScheduleBuildSettings},
    prelude::*,
};
use resecta::{
    assets, headless,
    prelude::*,
    scenario::LoadedExercise,
    testing::Trial,
    tissue::{TissueDiagnostics, TissueSettings},
};

/// A small exercise.
fn loaded() -> LoadedExercise {
    let library = Library::new(assets::find().unwrap());
    library
        .load_text(common::EXERCISE, "test.exercise.ron".as_ref())
        .unwrap()
}

/// A few steps of it in an app built by hand; returns the state of the gland.
fn play(app: &mut App, steps: u64) -> String {
    headless::start(app, loaded().prepare().unwrap(), InstrumentSource::Requests);
    while headless::steps(app.world()) < steps {
        app.update();
    }
    Report::of_world(app.world()).unwrap().state_hash
}

/// The same in an app for tests.
fn try_out(mut trial: Trial, steps: u32) -> String {
    trial.start(loaded()).unwrap();
    trial.steps(steps);
    trial.state_hash()
}

#[test]
fn a_minimal_app_needs_the_two_preludes_and_the_plugin_group_and_its_systems_edit_the_tissue() {
    #[derive(Resource, Default)]
    struct Moved(f32);

    fn press(mut nodes: Query<&mut TissueNode>, mut moved: ResMut<Moved>) {
        for mut node in nodes.iter_mut().filter(|node| node.index == 0) {
            node.load = Vec3::new(0.0, 0.0, 500.0);
            moved.0 = moved.0.max(node.velocity.length());
        }
    }

    let mut app = App::new();
    app.add_plugins((MinimalPlugins, ResectaPlugins))
        .insert_resource(headless::one_step_an_update())
        .init_resource::<Moved>()
        .add_systems(FixedUpdate, press);
    play(&mut app, 5);
    assert!(app.world().resource::<Moved>().0 > 0.0);
}

#[test]
fn no_two_systems_of_the_whole_simulation_race() {
    let trial = Trial::new(|app: &mut App| {
        app.configure_schedules(ScheduleBuildSettings {
            ambiguity_detection: LogLevel::Error,
            ..default()
        });
        app.init_resource::<Trace>();
    });
    // A schedule with an ambiguity panics when it is built, which is when it first runs.
    try_out(trial, 3);
}

#[test]
fn a_run_repeats_itself_bit_for_bit_and_the_order_of_plugins_does_not_matter() {
    let first = try_out(Trial::new(()), 12);
    let again = try_out(Trial::new(()), 12);
    let mut app = App::new();
    app.insert_resource(headless::one_step_an_update());
    app.add_plugins((ResectaPlugins, MinimalPlugins));
    let reversed = play(&mut app, 12);
    assert_eq!(first, again);
    assert_eq!(first, reversed);
}

#[test]
fn watching_the_error_tells_it_and_changes_nothing() {
    let play = |watch: u32, error_aim_mm: Option<f32>| {
        let mut trial = Trial::new(());
        trial.start(loaded()).unwrap();
        let tissue = trial.active().tissue;
        let mut settings = trial.app.world_mut().get_mut::<TissueSettings>(tissue).unwrap();
        (settings.watch_error_every, settings.error_aim_mm) = (watch, error_aim_mm);
        trial.follow_script(common::SCRIPT).unwrap();
        trial.steps(90);
        let error_mm = trial.app.world().resource::<TissueDiagnostics>().error_mm;
        (trial.state_hash(), error_mm)
    };
    let (alone, none) = play(0, None);
    assert_eq!(none, 0.0);
    let (watched, error_mm) = play(7, None);
    assert_eq!(watched, alone);
    assert!(error_mm > 0.0 && error_mm < 0.1, "{error_mm}");
    // An aim is followed, where there is one.
    let (followed, _) = play(7, Some(1e-6));
    assert_ne!(followed, alone);
}
