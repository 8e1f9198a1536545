//! Motion to an aim, and springs that are softened for it.

mod common;

use common::networks::{cube, tissue, uniform};
use glam::DVec3;
use resecta_solver::reference::{self, Inertia};
use resecta_solver::{Effort, Network, Tissue};

const SIDE: u32 = 7;

/// A cube with springs across its faces, held at the bottom, its top pulled along x, with a quarter of its nodes a twentieth
/// as heavy as the rest. Springs between two of its layers are `ratio` times as stiff as the others.
fn pulled(ratio: f64) -> Network {
    let mut network = cube(SIDE, 1e-3, 300.0, 0.02);
    let layer = |node: u32| node / (SIDE * SIDE);
    for node in 0..SIDE.pow(3) {
        let index = node as usize;
        network.fixed[index] = layer(node) == 0;
        if layer(node) == SIDE - 1 {
            network.loads[index] = DVec3::X * 20.0;
        }
        if node % 4 == 0 {
            network.masses[index] *= 0.05;
        }
    }
    for (stiffness, ends) in network.stiffness.iter_mut().zip(&network.springs) {
        if ends.iter().all(|&end| (2..=3).contains(&layer(end))) {
            *stiffness *= ratio;
        }
    }
    network
}

fn places(tissue: &Tissue) -> Vec<DVec3> {
    (0..tissue.node_count() as u32)
        .map(|node| tissue.precise_position(node))
        .collect()
}

fn rms(a: &[DVec3], b: &[DVec3]) -> f64 {
    let sum: f64 = a.iter().zip(b).map(|(a, b)| a.distance_squared(*b)).sum();
    (sum / a.len() as f64).sqrt()
}

/// How far the nodes of a tissue move in a time, mm RMS.
fn moved_in(tissue: &mut Tissue, time_s: f64) -> f64 {
    let start = places(tissue);
    tissue.advance_steps(time_s, 1).expect("a plain step");
    rms(&places(tissue), &start)
}

#[test]
fn an_aim_is_reached_with_fewer_substeps_than_true_masses_ask_for() {
    const TIME_S: f64 = 0.6;
    let full = tissue(&pulled(1.0)).advance_steps(TIME_S, 1).expect("a plain step");
    let exact = reference::positions_after(&tissue(&pulled(1.0)), TIME_S, 4000, Inertia::Mass);
    for (aim_mm, most) in [(1e-1, 0.8), (1e-2, 1.0), (1e-3, 1.6)] {
        let mut tissue = tissue(&pulled(1.0));
        tissue.set_error_aim_mm(aim_mm).expect("a plain aim");
        let report = tissue.advance_to_aim(TIME_S).expect("a plain advance");
        let (error, aim_mm) = (rms(&places(&tissue), &exact), f64::from(aim_mm));
        let substeps = f64::from(report.steps.substeps + report.steps.substeps_beside) / f64::from(full.substeps);
        println!(
            "aim {aim_mm}: error {error:.2e}, told {:.2e}, substeps {substeps:.2} of those of the full effort",
            report.error_mm
        );
        assert!(error < aim_mm, "aim {aim_mm}: {error}");
        assert!(substeps < most, "aim {aim_mm}: {substeps}");
    }
}

#[test]
fn a_shell_far_stiffer_costs_what_the_aim_asks_for() {
    const TIME_S: f64 = 0.4;
    for ratio in [1e2, 1e4] {
        let network = pulled(ratio);
        let mut full = tissue(&network);
        let moved = moved_in(&mut full, TIME_S);
        let soft = tissue(&pulled(1.0)).advance_steps(TIME_S, 1).expect("a plain step");
        let mut tissue = tissue(&network);
        tissue.set_error_aim_mm(0.3 * moved as f32).expect("a plain aim");
        let report = tissue.advance_to_aim(TIME_S).expect("a plain advance");
        let error = rms(&places(&tissue), &places(&full));
        let substeps = f64::from(report.steps.substeps + report.steps.substeps_beside) / f64::from(soft.substeps);
        println!(
            "ratio {ratio}: moved {moved:.2e} mm, error {error:.2e}, told {:.2e}, substeps {substeps:.2} of those without a shell",
            report.error_mm
        );
        assert!(error < 0.3 * moved, "ratio {ratio}: {error} of {moved}");
        assert!(
            report.error_mm > error / 3.0,
            "ratio {ratio}: told {}, true {error}",
            report.error_mm
        );
        assert!(substeps < 3.0, "ratio {ratio}: {substeps}");
        assert!(tissue.softened_springs() > 0);
        for (spring, &stiffness) in (0u32..).zip(&network.stiffness) {
            assert_eq!(f64::from(tissue.spring(spring).stiffness), stiffness);
        }
    }
}

#[test]
fn a_fine_aim_leaves_no_shell_soft() {
    const TIME_S: f64 = 0.4;
    let network = pulled(1e2);
    let mut full = tissue(&network);
    let aim_mm = 0.01 * moved_in(&mut full, TIME_S);
    let mut tissue = tissue(&network);
    tissue.set_error_aim_mm(aim_mm as f32).expect("a plain aim");
    tissue.advance_to_aim(TIME_S).expect("a plain advance");
    let error = rms(&places(&tissue), &places(&full));
    assert!(error < aim_mm, "{error} for an aim of {aim_mm}");
    assert_eq!(tissue.softened_springs(), 0);
}

#[test]
fn what_softened_springs_miss_while_a_tissue_creeps_is_seen() {
    const TIME_S: f64 = 0.1;
    let mut network = pulled(1e4);
    network.damping.iter_mut().for_each(|damping| *damping *= 100.0);
    let mut full = tissue(&network);
    let moved = moved_in(&mut full, TIME_S);
    for share in [0.1, 0.01] {
        let mut tissue = tissue(&network);
        tissue.set_error_aim_mm((share * moved) as f32).expect("a plain aim");
        let report = tissue.advance_to_aim(TIME_S).expect("a plain advance");
        let error = rms(&places(&tissue), &places(&full));
        println!(
            "moved {moved:.2e}, aim {:.2e}, error {error:.2e}, told {:.2e}, softened {}",
            share * moved,
            report.error_mm,
            tissue.softened_springs()
        );
        assert!(error < share * moved, "{error} for an aim of {share} of {moved}");
    }
}

#[test]
fn full_effort_gives_springs_back_their_stiffness_to_the_bit() {
    let network = pulled(1e4);
    let (mut changed, mut fresh) = (tissue(&network), tissue(&network));
    let bound_s = fresh.bound_s();
    changed.set_effort(Effort::ACCURATE);
    assert!(changed.bound_s() > 20.0 * bound_s && changed.softened_springs() > 0);
    // An edit while springs are softened is not lost.
    for tissue in [&mut changed, &mut fresh] {
        tissue.set_spring_stiffness(700, 5e6).expect("a plain stiffness");
    }
    changed.set_effort(Effort::FULL);
    assert_eq!(changed.bound_s(), fresh.bound_s());
    assert_eq!(changed.softened_springs(), 0);
    for tissue in [&mut changed, &mut fresh] {
        tissue.advance(0.01, &[]).expect("a plain advance");
    }
    assert_eq!(places(&changed), places(&fresh));
}

#[test]
fn with_softened_springs_the_energy_of_what_is_stepped_stays() {
    let mut network = pulled(1e4);
    let mut random = uniform();
    network.damping.fill(0.0);
    network.loads.fill(DVec3::ZERO);
    for velocity in &mut network.velocities {
        *velocity = DVec3::new(random() - 0.5, random() - 0.5, random() - 0.5) * 100.0;
    }
    let mut tissue = tissue(&network);
    // So short that the energy leapfrog keeps is near the true one.
    tissue.set_effort(Effort {
        substeps: 6.0,
        ..Effort::ACCURATE
    });
    tissue.bound_s();
    let start = tissue.energy().total();
    for _ in 0..50 {
        tissue.advance(0.02, &[]).expect("a plain advance");
        let ratio = tissue.energy().total() / start;
        assert!((0.97..1.03).contains(&ratio), "{ratio}");
    }
    assert!(tissue.softened_springs() > 0);
}

#[test]
fn a_tissue_without_springs_or_nodes_reaches_any_aim() {
    let mut alone = cube(1, 1e-3, 1.0, 0.0);
    alone.velocities[0] = DVec3::X;
    let mut alone = tissue(&alone);
    let report = alone.advance_to_aim(0.2).expect("a plain advance");
    assert!(report.error_mm <= f64::from(alone.error_aim_mm()));
    assert!((alone.precise_position(0) - DVec3::X * 0.2).length() < 1e-6);
    assert!(alone.advance_to_aim(f64::NAN).is_err() && alone.advance_to_aim(0.0).is_err());
}
