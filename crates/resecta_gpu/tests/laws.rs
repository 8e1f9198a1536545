//! What the equations say, and what must always hold, on the graphics processor.

mod common;

use common::{cube, gpu, positions, rms, shake, swinging_block};
use glam::{DVec3, Vec3};
use resecta_gpu::{GpuError, GpuTissue};
use resecta_solver::reference::{self, Inertia};
use resecta_solver::{EditError, StepError, Tissue};

#[test]
fn the_order_is_two_against_the_reference() {
    let Some(gpu) = gpu() else { return };
    let mut start = swinging_block();
    let time = 40.0 * 0.4 * start.bound_s();
    let exact = reference::positions_after(&start, time, 1280, Inertia::AsStepped);
    let error = |steps: u64| {
        let mut moving = GpuTissue::new(&gpu, &start).expect("a small tissue");
        let report = moving.advance_steps(time / steps as f64, steps).expect("plain steps");
        assert_eq!(u64::from(report.substeps), steps, "none is divided");
        rms(&moving.positions().expect("a working device"), &exact)
    };
    let errors = [80, 160, 320].map(error);
    let orders = [(errors[0] / errors[1]).log2(), (errors[1] / errors[2]).log2()];
    println!("errors {errors:?} mm, orders {orders:?}");
    assert!(orders.iter().all(|order| (1.8..2.2).contains(order)), "{orders:?}");
}

#[test]
fn without_load_momentum_is_constant() {
    let Some(gpu) = gpu() else { return };
    let start = swinging_block();
    let mut moving = GpuTissue::new(&gpu, &start).expect("a small tissue");
    moving.advance_steps(1e-4, 2000).expect("plain steps");
    let after = moving.tissue().expect("a working device");
    let inertia: f64 = (0..start.node_count() as u32)
        .map(|node| f64::from(after.inertia_g(node)))
        .sum();
    let change = (after.momentum() - momentum_settled(&start)).length() / inertia;
    println!("momentum: the mean velocity changed by {change:.1e} mm/s");
    assert!(change < 1e-3, "the mean velocity changed by {change} mm/s");
}

/// With the inertias of the next advance.
fn momentum_settled(start: &Tissue) -> DVec3 {
    let mut start = start.clone();
    start.settle();
    start.momentum()
}

#[test]
fn the_same_run_gives_the_same_bytes_and_to_look_changes_nothing() {
    let Some(gpu) = gpu() else { return };
    let start = swinging_block();
    let run = |looks: bool| {
        let mut moving = GpuTissue::new(&gpu, &start).expect("a small tissue");
        for _ in 0..4 {
            moving.advance_steps(3e-4, 100).expect("plain steps");
            if looks {
                moving.tissue().expect("a working device");
            }
        }
        let places = moving.positions().expect("a working device");
        places
            .into_iter()
            .flat_map(|place| place.to_array().map(f64::to_bits))
            .collect::<Vec<u64>>()
    };
    let once = run(false);
    assert!(once == run(false) && once == run(true));
}

#[test]
fn the_slowest_creep_is_not_lost_to_rounding() {
    let Some(gpu) = gpu() else { return };
    // At a metre, single precision tells places apart by 6e-5 mm; a substep's way is a hundredth of that.
    let mut network = cube(2, 0.0);
    network
        .positions
        .iter_mut()
        .for_each(|place| *place += DVec3::splat(1000.0));
    network.fixed.fill(false);
    network.loads.fill(DVec3::ZERO);
    network.velocities.fill(DVec3::new(0.6, -0.3, 0.2));
    let start = Tissue::from_network(&network).expect("a network");
    let mut moving = GpuTissue::new(&gpu, &start).expect("a small tissue");
    moving.advance_steps(1e-6, 3000).expect("plain steps");
    let after = moving.positions().expect("a working device");
    let way = after
        .iter()
        .zip(&network.positions)
        .map(|(after, before)| *after - *before)
        .sum::<DVec3>()
        / 8.0;
    let expected = DVec3::new(0.6, -0.3, 0.2) * 3e-3;
    assert!(
        way.distance(expected) < 1e-3 * expected.length(),
        "{way}, expected {expected}"
    );
}

#[test]
fn a_node_that_stops_being_sound_is_put_aside_by_name() {
    let Some(gpu) = gpu() else { return };
    let network = cube(4, 1e-3);
    let mut start = Tissue::from_network(&network).expect("a network");
    start.set_load(21, Vec3::X * 1e38).expect("a finite load");
    let mut plain = start.clone();
    let expected = plain.advance_steps(1e-4, 200).expect("plain steps").put_aside;
    let mut moving = GpuTissue::new(&gpu, &start).expect("a small tissue");
    let report = moving.advance_steps(1e-4, 200).expect("plain steps");
    assert_eq!(report.put_aside.first().map(|aside| aside.node), Some(21));
    assert_eq!(report.put_aside, expected);
    assert!(report.substeps_repeated > 0);
    let after = moving.tissue().expect("a working device");
    assert!(after.is_put_aside(21) && positions(&after).iter().all(|place| place.is_finite()));
    assert!(rms(&positions(&plain), &positions(&after)) < 1e-3);
}

#[test]
fn motion_that_outruns_its_bound_is_repeated() {
    let Some(gpu) = gpu() else { return };
    let mut start = swinging_block();
    shake(&mut start, 1500.0);
    let mut moving = GpuTissue::new(&gpu, &start).expect("a small tissue");
    let step_s = 0.9 * start.bound_s();
    let report = moving.advance_steps(step_s, 400).expect("plain steps");
    assert!(report.substeps_repeated > 0, "{report:?}");
    let mut plain = start.clone();
    plain.advance_steps(step_s, 400).expect("plain steps");
    let after = moving.tissue().expect("a working device");
    let [expected, found] = [&plain, &after].map(|tissue| tissue.energy().total());
    assert!(
        (found / expected - 1.0).abs() < 0.05,
        "{found} nJ, expected {expected} nJ"
    );
    assert!(positions(&after).iter().all(|place| place.is_finite()));
}

#[test]
fn what_is_no_number_is_refused() {
    let Some(gpu) = gpu() else { return };
    let start = swinging_block();
    let mut moving = GpuTissue::new(&gpu, &start).expect("a small tissue");
    let refused = moving.edit(|tissue| tissue.set_load(3, Vec3::new(0.0, f32::NAN, 0.0)));
    let refused = refused.expect("a working device").expect_err("no load is NaN");
    assert!(
        matches!(
            refused,
            EditError::Value {
                index: 3,
                field: "load",
                ..
            }
        ),
        "{refused}"
    );
    for step in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        let refused = moving.advance_steps(step, 1).expect_err("no step");
        assert!(matches!(refused, GpuError::Step(StepError::Duration(_))), "{refused}");
    }
    assert_eq!(moving.positions().expect("a working device"), positions(&start));
}
