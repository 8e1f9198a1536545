//! The graphics processor moves a tissue as its own solver does, within a small part of the method's own error.

mod common;

use common::{block, cube, gpu, positions, rms, shake, swinging_block};
use glam::Vec3;
use resecta_gpu::{Gpu, GpuTissue};
use resecta_solver::reference::{self, Inertia};
use resecta_solver::{CollapseLaw, Material, Tissue};

/// Part of the method's error that the two may be apart.
const PART: f64 = 0.01;

/// Moves a tissue by both and says how they compare.
fn assert_agreement(gpu: &Gpu, name: &str, start: &Tissue, step_s: f64, steps: u32) {
    let exact = reference::positions_after(start, step_s * f64::from(steps), 4 * steps, Inertia::AsStepped);
    let mut plain = start.clone();
    let expected = plain.advance_steps(step_s, steps.into()).expect("plain steps");
    let mut moving = GpuTissue::new(gpu, start).expect("a small tissue");
    let report = moving.advance_steps(step_s, steps.into()).expect("plain steps");
    assert_eq!(report.substeps, expected.substeps, "{name}");
    assert_eq!((report.substeps_repeated, expected.substeps_repeated), (0, 0), "{name}");
    assert!(
        (report.bound_s / expected.bound_s - 1.0).abs() < 1e-4,
        "{name}: {report:?}, {expected:?}"
    );
    let (plain, moved) = (positions(&plain), moving.positions().expect("a working device"));
    let (error, other_error, apart) = (rms(&plain, &exact), rms(&moved, &exact), rms(&plain, &moved));
    let way = rms(&exact, &positions(start));
    println!("{name}: way {way:.2e}, errors {error:.2e} and {other_error:.2e}, apart {apart:.2e} mm");
    assert!(way > 20.0 * error, "{name}: it moves");
    assert!(
        apart < PART * error,
        "{name}: {apart} mm apart, with an error of {error} mm"
    );
    let velocities = |tissue: &Tissue| -> Vec<_> {
        (0..tissue.node_count() as u32)
            .map(|node| tissue.velocity(node).as_dvec3())
            .collect()
    };
    let mut plain = start.clone();
    plain.advance_steps(step_s, steps.into()).expect("plain steps");
    let (one, other) = (
        velocities(&plain),
        velocities(&moving.tissue().expect("a working device")),
    );
    let speed = rms(&one, &vec![Default::default(); one.len()]);
    assert!(rms(&one, &other) < 1e-3 * speed + 1e-4, "{name}: velocities");
}

#[test]
fn a_swinging_block() {
    let Some(gpu) = gpu() else { return };
    let mut start = swinging_block();
    let step_s = 0.5 * start.bound_s();
    assert_agreement(&gpu, "swinging block", &start, step_s, 300);
}

#[test]
fn a_block_on_its_bed_under_loads_and_strong_damping() {
    let Some(gpu) = gpu() else { return };
    let mut start = block([5, 4, 6], &Material::default());
    let step_s = 0.5 * start.bound_s();
    let top = (0..start.node_count() as u32).filter(|&node| start.position(node).z > 11.0);
    for node in top.collect::<Vec<_>>() {
        start
            .set_load(node, Vec3::new(150.0, -60.0, 40.0))
            .expect("a finite load");
        // A substep takes two thirds of the velocity of these.
        let damping = start.inertia_g(node) / step_s as f32;
        start.set_damping(node, damping).expect("a damping");
    }
    shake(&mut start, 10.0);
    assert_agreement(&gpu, "bed, loads, strong damping", &start, step_s, 300);
}

#[test]
fn a_network_with_fixed_nodes_and_loads() {
    let Some(gpu) = gpu() else { return };
    let network = cube(6, 2e-2);
    let mut start = Tissue::from_network(&network).expect("a network");
    let step_s = 0.5 * start.bound_s();
    assert_agreement(&gpu, "fixed nodes, loads", &start, step_s, 300);
    let mut moving = GpuTissue::new(&gpu, &start).expect("a small tissue");
    moving.advance_steps(step_s, 50).expect("plain steps");
    let places = moving.positions().expect("a working device");
    for node in (0..places.len()).filter(|&node| network.fixed[node]) {
        assert_eq!(places[node], network.positions[node]);
    }
}

#[test]
fn steps_above_the_bound_are_divided_alike() {
    let Some(gpu) = gpu() else { return };
    let mut start = swinging_block();
    // Three substeps a step, then more than fit between two looks at the bound.
    for (steps, divisions) in [(30, 2.6), (2, 150.0)] {
        let step_s = 0.9 * divisions * start.bound_s();
        let mut plain = start.clone();
        let expected = plain.advance_steps(step_s, steps).expect("plain steps");
        let mut moving = GpuTissue::new(&gpu, &start).expect("a small tissue");
        let report = moving.advance_steps(step_s, steps).expect("plain steps");
        assert_eq!(report.substeps, expected.substeps);
        assert!((report.substep_s / expected.substep_s - 1.0).abs() < 1e-9);
        let way = rms(&positions(&plain), &positions(&start));
        let apart = rms(&positions(&plain), &moving.positions().expect("a working device"));
        assert!(apart < 1e-3 * way, "{apart} mm apart after {way} mm");
    }
}

#[test]
fn tissue_that_was_cut_does_not_move_and_does_not_pull() {
    let Some(gpu) = gpu() else { return };
    let start = block([5, 4, 6], &Material::default());
    let above: Vec<u32> = (0..start.pentahedron_count() as u32)
        .filter(|&pentahedron| start.centroid(pentahedron).z > 8.0)
        .collect();
    let mut moving = GpuTissue::new(&gpu, &start).expect("a small tissue");
    moving.advance_steps(1e-4, 40).expect("plain steps");
    let law = Some(CollapseLaw::default());
    moving
        .edit(|tissue| tissue.resect(&above, law))
        .expect("a working device");
    let cut = moving.tissue().expect("a working device");
    let dead: Vec<u32> = (0..cut.node_count() as u32)
        .filter(|&node| !cut.is_node_alive(node))
        .collect();
    assert!(!dead.is_empty());
    let before = positions(&cut);
    // Resection forces come on over several stretches.
    let mut plain = cut.clone();
    plain.settle();
    let (step_s, steps) = (2e-4, 500);
    plain.advance_steps(step_s, steps).expect("plain steps");
    let report = moving.advance_steps(step_s, steps).expect("plain steps");
    assert_eq!(report.substeps_repeated, 0);
    let after = moving.positions().expect("a working device");
    for node in dead {
        assert_eq!(after[node as usize], before[node as usize], "node {node}");
    }
    let (way, apart) = (rms(&before, &after), rms(&positions(&plain), &after));
    println!("after a cut: way {way:.2e}, apart {apart:.2e} mm");
    assert!(way > 1e-3 && apart < 1e-3 * way, "{apart} mm apart after {way} mm");
    moving
        .tissue()
        .expect("a working device")
        .validate()
        .expect("a sound tissue");
}

#[test]
fn a_watch_tells_the_same_error() {
    let Some(gpu) = gpu() else { return };
    let mut plain = swinging_block();
    let mut moving = GpuTissue::new(&gpu, &plain).expect("a small tissue");
    assert_eq!(moving.watched_error_mm(), Ok(None));
    plain.begin_watch();
    moving.begin_watch().expect("a working device");
    let step_s = 0.5 * plain.bound_s();
    plain.advance_steps(step_s, 100).expect("plain steps");
    moving.advance_steps(step_s, 100).expect("plain steps");
    let expected = plain.end_watch().expect("a watch");
    let found = moving.end_watch().expect("a working device").expect("a watch");
    println!("watched errors: {expected:.4e} and {found:.4e} mm");
    assert!(
        (found / expected - 1.0).abs() < 0.01,
        "{found} mm, expected {expected} mm"
    );
    assert_eq!(moving.tissue().expect("a working device").effort(), plain.effort());
    assert_eq!(moving.watched_error_mm(), Ok(None));
}
