//! The shipped exercise on the whole stack: gland, solver, tissue, instrument.

use std::path::Path;

use bevy::prelude::*;
use resecta_anatomy::Zone;
use resecta_instrument::InstrumentState;
use resecta_scenario::{
    ActiveExercise, EndReason, Library, MetricId, Metrics, Report, RunState, Trace, spawn_exercise, testing::Trial,
};
use resecta_solver::NodeKind;
use resecta_tissue::{Tissue, TissueTint};

fn library() -> Library {
    Library::new(Path::new("../../assets"))
}

fn trial() -> Trial {
    let mut trial = Trial::new(());
    trial.app.init_resource::<Trace>();
    trial.start("first_cuts").unwrap();
    trial
}

#[test]
fn every_shipped_exercise_can_be_prepared() {
    for name in library().exercise_names() {
        library()
            .load(&name)
            .and_then(|loaded| loaded.prepare())
            .map(drop)
            .unwrap();
    }
}

#[test]
fn the_view_is_inclined_as_the_exercise_says() {
    let mut loaded = library().load("first_cuts").unwrap();
    loaded.exercise.instrument.optic_deg = Some(30.0);
    let prepared = loaded.prepare().unwrap();
    let (scope, start) = (&prepared.resectoscope, &prepared.start);
    let ahead = scope.sheath_pose(start).rotation * Vec3::NEG_Z;
    let seen = scope.lens_pose(start).rotation * Vec3::NEG_Z;
    assert!((ahead.angle_between(seen).to_degrees() - 30.0).abs() < 1e-3);
    assert!(seen.dot(scope.loop_pose(start).down) > 0.0, "towards the loop");
}

#[test]
fn the_marked_part_is_middle_lobe_off_the_capsule() {
    let prepared = library().load("first_cuts").unwrap().prepare().unwrap();
    let volume_ml = prepared.marked.total_mm3() / 1000.0;
    assert!((1.0..15.0).contains(&volume_ml), "{volume_ml} ml");
    assert!(
        prepared
            .marked
            .pentahedra()
            .all(|index| prepared.tissue.solver().capsule_area_mm2(index) == 0.0)
    );
    let inside: f64 = prepared
        .marked
        .pentahedra()
        .map(|index| prepared.tissue.solver().rest_volume_mm3(index))
        .sum();
    assert!((inside / prepared.marked.total_mm3() - 1.0).abs() < 1e-5);
    let adenoma = Zone::ALL.into_iter().filter(|zone| zone.is_adenoma());
    let adenoma_mm3: f64 = adenoma.map(|zone| prepared.zone_mm3[zone.index()]).sum();
    assert!(prepared.marked.total_mm3() < adenoma_mm3);
}

#[test]
fn the_lobe_in_the_bladder_has_no_capsule() {
    let loaded = library().load("first_cuts").unwrap();
    let neck_z = loaded.case.landmarks.bladder_neck.unwrap().z;
    let lobe_z = loaded.case.slices.last().unwrap().z;
    assert!(lobe_z > neck_z + 5.0, "a lobe in the bladder");
    let prepared = loaded.prepare().unwrap();
    let tissue = prepared.tissue.solver();
    let of_kind = |kind| (0..tissue.node_count() as u32).filter(move |&node| tissue.node_kind(node) == kind);
    let heights = of_kind(NodeKind::Capsule).map(|node| f64::from(tissue.rest_position(node).z));
    let highest = heights.fold(f64::NEG_INFINITY, f64::max);
    assert!(
        highest < neck_z + 0.01 && highest > neck_z - 5.0,
        "{highest} of {neck_z} mm"
    );
    // The wall that covers the lobe holds it all the same.
    let held = (0..tissue.pentahedron_count() as u32).filter(|&index| tissue.is_held(index));
    let bare = held.filter(|&index| f64::from(tissue.rest_centroid(index).z) > neck_z);
    assert!(bare.clone().count() > 0);
    for index in bare {
        let centroid = tissue.rest_centroid(index).as_dvec3();
        assert!(prepared.walls.capsule_mm(centroid) >= centroid.z - neck_z);
        let whole = tissue.pentahedron_nodes(index).map(|node| tissue.rest_position(node).z);
        let is_beyond = whole.iter().all(|&z| f64::from(z) > neck_z + 0.01);
        assert!(!is_beyond || tissue.capsule_area_mm2(index) == 0.0);
    }
}

#[test]
fn spawning_another_exercise_replaces_the_first() {
    let mut app = trial().app;
    app.update();
    let first = app.world().resource::<ActiveExercise>().clone();
    let parts = app
        .world_mut()
        .query::<&resecta_tissue::TissueNode>()
        .iter(app.world())
        .count();
    let prepared = library().load("first_cuts").unwrap().prepare().unwrap();
    spawn_exercise(app.world_mut(), prepared);
    assert_eq!(*app.world().resource::<RunState>(), RunState::Briefing);
    assert_eq!(app.world().resource::<Metrics>().steps, 0);
    assert!(app.world().resource::<Trace>().rows.is_empty());
    app.update();
    assert!(app.world().get_entity(first.tissue).is_err());
    assert!(app.world().get_entity(first.instrument).is_err());
    assert_eq!(app.world_mut().query::<&Tissue>().iter(app.world()).count(), 1);
    assert_eq!(
        app.world_mut()
            .query::<&resecta_tissue::TissueNode>()
            .iter(app.world())
            .count(),
        parts
    );
}

#[test]
fn a_bad_exercise_changes_nothing() {
    let mut app = trial().app;
    app.update();
    let before = Report::of_world(app.world()).unwrap();
    let entities = app.world().entities().len();
    let text = std::fs::read_to_string(library().load("first_cuts").unwrap().file).unwrap();
    let nowhere = text.replace("from_mm: -20, to_mm: 20", "from_mm: 500, to_mm: 600");
    let loaded = library().load_text(&nowhere, Path::new("mine.exercise.ron")).unwrap();
    let error = loaded.prepare().map(drop).unwrap_err().to_string();
    assert_eq!(
        error,
        "mine.exercise.ron: marked is empty on this gland; expected a region with tissue in it: widen zones, clock, \
         height or depth"
    );
    assert_eq!(Report::of_world(app.world()).unwrap(), before);
    assert_eq!(app.world().entities().len(), entities);
}

/// Loop out from the start, down into the lobe, then drawn back with current. Returns report and trace.
fn cut_once() -> (Report, Vec<u8>) {
    let mut trial = trial();
    let tint = trial.app.world().get::<TissueTint>(trial.active().tissue);
    assert!(!tint.unwrap().nodes.is_empty());
    let start = *trial.on_instrument::<InstrumentState>().unwrap();
    trial.steps_by(150, |step, state| {
        let out = (step as f32 / 40.0).min(1.0);
        let back = ((step as f32 - 60.0) / 60.0).clamp(0.0, 1.0);
        *state = InstrumentState {
            insertion_mm: start.insertion_mm + 15.0,
            pitch_deg: -8.0 * out,
            stroke_mm: 25.0 * (out - back),
            cut: (60..120).contains(&step),
            ..start
        };
    });
    trial.app.insert_resource(RunState::Ended(EndReason::Player));
    let mut csv = Vec::new();
    trial.app.world().resource::<Trace>().write_csv(&mut csv).unwrap();
    (trial.report(), csv)
}

#[test]
fn a_cut_removes_tissue_and_the_same_cut_gives_the_same_bytes() {
    let (report, trace) = cut_once();
    let value = |id: MetricId| report.metrics.iter().find(|metric| metric.id == id).unwrap().value;
    assert_eq!(report.run.steps, 150);
    assert_eq!(report.run.ended, Some(EndReason::Player));
    assert!(value(MetricId::Removed) > 0.0, "{}", report.to_json());
    let by_zone = [
        MetricId::LateralLobeRemoved,
        MetricId::MiddleLobeRemoved,
        MetricId::PeripheralRemoved,
        MetricId::OtherRemoved,
    ];
    let sum: f64 = by_zone.into_iter().map(value).sum();
    assert!(
        (sum - value(MetricId::Removed)).abs() < 1e-6 * sum,
        "{sum} {}",
        value(MetricId::Removed)
    );
    assert!(value(MetricId::TipPath) > 10.0);

    let (again, trace_again) = cut_once();
    assert_eq!(report.to_json(), again.to_json());
    assert_eq!(trace, trace_again);
}
