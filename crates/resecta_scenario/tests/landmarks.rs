//! Landmarks go where the gland takes them.

use bevy::prelude::*;
use resecta_anatomy::Landmark;
use resecta_instrument::{InstrumentState, Resectoscope};
use resecta_scenario::{ActiveExercise, metrics::StepObservation, testing::Trial};
use resecta_tissue::Tissue;

fn places(active: &ActiveExercise, tissue: &Tissue) -> [Vec3; 5] {
    Landmark::ALL.map(|landmark| active.landmark(landmark, tissue).expect("a complete case"))
}

/// Puts every node this far from its place at rest, mm.
fn shift(tissue: &mut Tissue, way: Vec3) {
    let solver = tissue.solver_mut();
    for node in 0..solver.node_count() as u32 {
        solver.set_position(node, solver.rest_position(node) + way).unwrap();
    }
}

#[test]
fn the_gland_takes_its_landmarks_along_and_leaves_the_bladders() {
    let mut trial = Trial::new(());
    trial.start("orientation").unwrap();
    let active = trial.active().clone();
    let mut tissue = trial.app.world_mut().get_mut::<Tissue>(active.tissue).unwrap();
    shift(&mut tissue, Vec3::ZERO);
    let before = places(&active, &tissue);
    for (landmark, place) in Landmark::ALL.into_iter().zip(before) {
        assert_eq!(
            Some(place),
            landmark.place(&active.case).map(|place| place.as_vec3()),
            "{landmark:?}"
        );
    }

    let way = Vec3::new(1.0, -3.0, 2.0);
    shift(&mut tissue, way);
    let after = places(&active, &tissue);
    for ((landmark, before), after) in Landmark::ALL.into_iter().zip(before).zip(after) {
        let is_in_bladder = matches!(landmark, Landmark::LeftOrifice | Landmark::RightOrifice);
        let expected = if is_in_bladder { Vec3::ZERO } else { way };
        assert!(
            (after - before).distance(expected) < 1e-3,
            "{landmark:?}: {}",
            after - before
        );
    }
}

#[test]
fn a_step_asks_for_a_landmark_where_the_sheath_has_taken_it() {
    let mut trial = Trial::new(());
    trial.start("orientation").unwrap();
    // A sheath that is raised takes the gland up, towards -y. The first step asks for the verumontanum, which is behind the lens.
    trial
        .follow_script(
            "(keys: [
                (time_s: 0, insertion_mm: 24, pitch_deg: -12),
                (time_s: 1, insertion_mm: 30, pitch_deg: -10),
                (time_s: 3, insertion_mm: 30, pitch_deg: 3),
                (time_s: 5, insertion_mm: 30, pitch_deg: 3),
            ])",
        )
        .unwrap();
    trial.steps(280);
    let active = trial.active().clone();
    let tissue = trial.app.world().get::<Tissue>(active.tissue).unwrap();
    let now = |landmark| active.landmark(landmark, tissue).unwrap();
    let neck = Landmark::BladderNeck.place(&active.case).unwrap().as_vec3();
    let moved = now(Landmark::BladderNeck) - neck;
    assert!(moved.y < -1.0, "{moved}");

    let step = trial.app.world().resource::<StepObservation>();
    let state = trial.on_instrument::<InstrumentState>().unwrap();
    let scope = trial.on_instrument::<Resectoscope>().unwrap();
    let asked_for = scope.sheath_pose(state) * step.landmark.unwrap().from_tip;
    assert!(asked_for.distance(now(Landmark::Verumontanum)) < 1e-3, "{asked_for}");
}
