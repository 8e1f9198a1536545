//! Blood and water of an exercise, on the whole stack.

use bevy::prelude::*;
use resecta_fluid::{Absorption, Bladder, Circulation, Irrigation, Lens, Turbidity, VesselKind, Vessels};
use resecta_instrument::{InstrumentRecording, InstrumentRequest, InstrumentSource, InstrumentState, Resectoscope};
use resecta_scenario::{ActiveExercise, MetricId, Metrics, RunState, testing::Trial};
use resecta_solver::NodeKind;
use resecta_tissue::{Tissue, TissueContact, ToolPartKind};

fn value(app: &App, metric: MetricId) -> f64 {
    app.world().resource::<Metrics>().value(metric)
}

#[test]
fn a_cut_artery_bleeds_clouds_the_water_and_is_counted_until_another_exercise_begins() {
    let mut trial = Trial::new(());
    trial.start("middle_lobe").unwrap();
    let app = &mut trial.app;
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
    assert!((value(app, MetricId::Irrigated) - totals.irrigated_ml).abs() < 1e-9);
    assert_eq!(value(app, MetricId::BloodLost), 0.0);

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
    assert!((value(app, MetricId::BloodLost) - lost).abs() < 1e-9);
    // What still bleeds counts as lost in all, as long as it is open.
    let vessels = app.world().get::<Vessels>(tissue).unwrap();
    let to_come: f64 = vessels.open().map(|vessel| vessel.to_come_ml()).sum();
    assert!(to_come > 10.0, "{to_come} ml");
    assert!((value(app, MetricId::BloodInAll) - lost - to_come).abs() < 1e-9);
    assert!(app.world().resource::<Turbidity>().visibility() < 1.0);
    // The lens is where the telescope is.
    let state = *app.world().get::<InstrumentState>(instrument).unwrap();
    let scope = app.world().get::<Resectoscope>(instrument).unwrap();
    let lens = app.world().get::<Lens>(instrument).unwrap();
    assert_eq!(lens.tip, Vec3::from(scope.lens_pose(&state).translation));

    trial.start("first_cuts").unwrap();
    trial.steps(3);
    let world = trial.app.world();
    assert!(!world.contains_resource::<Bladder>() && !world.contains_resource::<Irrigation>());
    assert!(!world.contains_resource::<Circulation>() && !world.contains_resource::<Turbidity>());
    assert!(!world.contains_resource::<Absorption>());
    for metric in [
        MetricId::BloodLost,
        MetricId::Irrigated,
        MetricId::Absorbed,
        MetricId::BlindTime,
    ] {
        assert_eq!(value(&trial.app, metric), 0.0, "{metric}");
    }
}

/// The water of `middle_lobe` over a coarser gland that nothing touches, played by a script.
fn flushing(script: &str) -> App {
    let mut trial = Trial::new(());
    let mut loaded = trial.library().unwrap().load("middle_lobe").unwrap();
    loaded.exercise.alpha_deg = 20.0;
    loaded.exercise.models.collision = false;
    trial.start(loaded).unwrap();
    trial.follow_script(script).unwrap();
    trial.app
}

fn taps(app: &App) -> [f64; 2] {
    let irrigation = app.world().resource::<Irrigation>();
    [irrigation.inflow_tap, irrigation.outflow_tap]
}

#[test]
fn a_player_empties_the_bladder_by_the_taps_and_fills_it_again() {
    // Shut the inflow and let run out; shut the outflow and let run in.
    let mut app = flushing(
        "(keys: [
            (time_s: 0, inflow_tap: 1, outflow_tap: 1),
            (time_s: 1, inflow_tap: 1, outflow_tap: 1),
            (time_s: 1.5, inflow_tap: 0),
            (time_s: 110, inflow_tap: 0, outflow_tap: 1),
            (time_s: 110.5, inflow_tap: 1, outflow_tap: 0),
            (time_s: 150),
        ])",
    );
    assert_eq!(taps(&app), [1.0, 1.0], "the taps begin as the exercise says");
    let volume = |app: &App| app.world().resource::<Bladder>().volume_ml();
    let begin_ml = volume(&app);
    let run = |app: &mut App, seconds: u32| (0..60 * seconds).for_each(|_| app.update());
    run(&mut app, 60);
    assert_eq!(taps(&app), [0.0, 1.0]);
    run(&mut app, 49);
    let emptied_ml = volume(&app);
    assert!(emptied_ml < 1e-6, "{emptied_ml} ml are left");
    run(&mut app, 31);
    assert_eq!(taps(&app), [1.0, 0.0]);
    // 60 cmH2O over 12 cmH2O s/ml: 5 ml/s into a bladder that does not press back yet.
    let filled_ml = volume(&app);
    assert!(
        (140.0..148.0).contains(&filled_ml),
        "{filled_ml} ml after 29.5 s of inflow"
    );
    let totals = *app.world().resource::<Bladder>().totals();
    let (came, went) = (
        totals.irrigated_ml + totals.blood_ml,
        totals.drained_ml + totals.absorbed_ml,
    );
    let off_ml = begin_ml + came - went - filled_ml;
    assert!(off_ml.abs() < 1e-9 * (came + went), "{off_ml} ml are unaccounted for");
    assert!(totals.drained_ml > 150.0, "{totals:?}");
}

#[test]
fn a_recording_from_before_the_taps_has_the_water_of_its_exercise() {
    let mut app = flushing("(keys: [(time_s: 0), (time_s: 1)])");
    let ActiveExercise { instrument, .. } = *app.world().resource::<ActiveExercise>();
    let start = *app.world().get::<InstrumentState>(instrument).unwrap();
    let recording = InstrumentRecording {
        step_s: 1.0 / 60.0,
        without_taps: true,
        start: InstrumentState {
            inflow_tap: 0.0,
            outflow_tap: 0.0,
            ..start
        },
        states: vec![
            InstrumentState {
                inflow_tap: 0.0,
                outflow_tap: 0.0,
                ..start
            };
            30
        ],
    };
    let source = InstrumentSource::Recording(recording);
    app.world_mut().entity_mut(instrument).insert(source);
    (0..30).for_each(|_| app.update());
    assert_eq!(taps(&app), [1.0, 1.0]);
}

#[test]
fn only_coagulation_at_a_vessel_that_bleeds_is_precise() {
    let mut app = flushing("(keys: [(time_s: 0), (time_s: 1)])");
    let ActiveExercise { tissue, instrument, .. } = *app.world().resource::<ActiveExercise>();
    app.world_mut()
        .entity_mut(instrument)
        .insert(InstrumentSource::Requests);
    app.update();
    let vessels = app.world().get::<Vessels>(tissue).unwrap();
    let arteries = vessels.iter().filter(|(vessel, _)| vessel.kind == VesselKind::Arterial);
    let carriers: Vec<u32> = arteries.map(|(vessel, _)| vessel.pentahedron).collect();
    let carrier = carriers[0];
    let open = |app: &mut App, carrier: u32| {
        let entity = app.world().get::<Tissue>(tissue).unwrap().pentahedron_entity(carrier);
        app.world_mut().despawn(entity.unwrap());
        app.update();
        app.update();
    };
    open(&mut app, carrier);
    let place = |app: &App| {
        app.world()
            .get::<Vessels>(tissue)
            .unwrap()
            .open()
            .map(|open| open.place)
            .next()
    };
    let bleeds_at = place(&app).expect("its carrier is gone");

    let coagulate = |app: &mut App, steps: u32, point: Vec3| {
        let mut request = app.world_mut().get_mut::<InstrumentRequest>(instrument).unwrap();
        // Out: a loop that is drawn in delivers no current.
        (request.0.coagulate, request.0.stroke_mm) = (true, 1.0);
        for _ in 0..steps {
            app.world_mut().write_message(TissueContact {
                tissue,
                tool: instrument,
                part: ToolPartKind::Loop,
                pentahedron: carrier,
                point,
                normal: Vec3::Y,
                depth_mm: 0.1,
                force_n: 0.1,
                kind: NodeKind::Inner,
                current: true,
            });
            app.update();
        }
    };
    // Twenty steps away from it, then thirty at it, which close it, then ten at its closed mouth.
    coagulate(&mut app, 20, bleeds_at + Vec3::Z * 30.0);
    assert_eq!(value(&app, MetricId::CoagulationPrecision), 0.0);
    assert_eq!(value(&app, MetricId::BleedersClosed), 0.0);
    coagulate(&mut app, 30, bleeds_at);
    assert_eq!(place(&app), None, "half a second closes it");
    coagulate(&mut app, 10, bleeds_at);
    assert!((value(&app, MetricId::CoagulationPrecision) - 0.5).abs() < 1e-9);
    assert!((value(&app, MetricId::Coagulation) - 1.0).abs() < 1e-5);
    assert_eq!(value(&app, MetricId::BleedersClosed), 1.0);
    let next = carriers
        .iter()
        .find(|next| **next != carrier)
        .expect("a gland has several");
    open(&mut app, *next);
    let bleeding = app.world().get::<Vessels>(tissue).unwrap().open().count() as f64;
    assert!(bleeding >= 1.0);
    assert_eq!(value(&app, MetricId::BleedersClosed), 1.0 / (1.0 + bleeding));
}
