//! Hard cases of the step: at, beyond and far from the bound, changed mid-run, a million of them, and loads that turn round
//! with each. The step beyond the bound is divided, never taken blindly.

mod common;

use std::f64::consts::PI;

use common::networks::{at_rest, chain, cube, rounding_nj, tissue, uniform};
use glam::{DVec3, Vec3};
use resecta_solver::{Network, StepError};

const EPSILON: f64 = f32::EPSILON as f64;

/// A chain between walls, every node moved along it: linear, and with all its modes.
fn shaken_chain() -> Network {
    let mut network = chain(32, 1.0, 0.002, 3_000.0, 0.0);
    network.fixed[31] = true;
    let mut uniform = uniform();
    for node in 1..31 {
        network.positions[node].x += 0.3 * (uniform() - 0.5);
    }
    network
}

#[test]
fn the_bound_of_a_chain_is_that_of_its_fastest_mode_and_never_above() {
    let (inner, mass, stiffness) = (30.0, 0.002f64, 3_000.0f64);
    let fastest = 2.0 * (stiffness / mass).sqrt() * (0.5 * PI * inner / (inner + 1.0)).sin();
    let ratio = tissue(&shaken_chain()).bound_s() / (2.0 / fastest);
    assert!((0.99..1.0).contains(&ratio), "{ratio}");
}

#[test]
fn a_step_below_the_bound_is_stable_and_one_above_is_divided_and_stable_too() {
    let network = shaken_chain();
    for part in [0.5, 0.8, 0.95, 1.05, 10.0, 1_000.0] {
        let mut tissue = tissue(&network);
        let (step_s, first) = (part * tissue.bound_s(), tissue.energy().total());
        // As few parts as the bound asks for, with a margin of a fifth; a step in more than 128 parts is rounded up once more.
        let (fewest, most) = (f64::ceil(part), 1.01 * f64::ceil(part / 0.8));
        let steps = (20_000.0 / most).ceil();
        for _ in 0..5 {
            let report = tissue.advance_steps(step_s, steps as u64).expect("divided");
            assert!(report.substep_s <= report.bound_s, "{report:?}");
            let divisions = f64::from(report.substeps) / steps;
            assert!((fewest..=most).contains(&divisions), "{part} of the bound: {divisions}");
            // Leapfrog keeps v² + w² (1 - w² h² / 4) x² of each mode: from a start at rest v² + w² x² never exceeds the
            // first. Rounding adds up at random, and counts 1 / (1 - w² h² / 4) = 10 times near the bound.
            let rounding = 10.0 * 20_000.0f64.sqrt() * EPSILON;
            let energy = tissue.energy().total();
            assert!(
                energy < first * (1.0 + rounding),
                "{part} of the bound: {energy} of {first} nJ"
            );
        }
    }
}

#[test]
fn a_step_that_the_motion_outruns_is_made_again_and_said_so() {
    // A node between six others that is shot away: springs that held it along one axis each now all pull along one.
    let ends = [DVec3::X, -DVec3::X, DVec3::Y, -DVec3::Y, DVec3::Z, -DVec3::Z];
    let positions = [DVec3::ZERO].into_iter().chain(ends).collect();
    let mut network = at_rest(positions, (1..7).map(|n| [0, n]).collect(), 0.01, 1_000.0, 0.0);
    network.fixed[1..].fill(true);
    network.velocities[0] = DVec3::new(3e4, 2e4, 1e4);
    let mut tissue = tissue(&network);
    let first = 0.5 * 0.01 * network.velocities[0].length_squared();
    let step_s = 0.8 * tissue.bound_s();
    let mut repeated = 0;
    for _ in 0..200 {
        let report = tissue.advance_steps(step_s, 1).expect("divided");
        repeated += report.substeps_repeated;
        assert_eq!(report.put_aside, []);
        assert!(report.substep_s <= report.bound_s, "{report:?}");
        // The step may miss the energy by the square of what is left of w h / 2 below the bound.
        let energy = tissue.energy().total();
        assert!(energy < 2.0 * first, "{energy} of {first} nJ");
    }
    assert!(repeated > 0, "the first step was too long for where it led");
}

#[test]
fn a_step_changed_mid_run_costs_no_more_than_each_step_by_itself() {
    let (mass, stiffness, amplitude) = (0.01f64, 4_000.0f64, 0.1);
    let w = (stiffness / mass).sqrt();
    let mut network = chain(2, 2.0, mass, stiffness, 0.0);
    network.positions[1].x += amplitude;
    let mut tissue = tissue(&network);
    let (mut time, mut allowed) = (0.0, 0.0);
    for (product, steps) in [(0.6, 20), (0.05, 400), (0.3, 60), (0.01, 1_000), (0.6, 30), (0.1, 200)] {
        let step_s = product / w;
        tissue.advance_steps(step_s, steps).expect("within the bound");
        time += step_s * steps as f64;
        // Leapfrog turns by w h (1 + w² h² / 24) a step to lowest order, and its ellipse is flat by w² h² / 8.
        allowed += amplitude * (product.powi(3) / 24.0 * steps as f64 + product * product / 8.0) * 1.1;
        let off = tissue.precise_position(1).x - 2.0 - amplitude * (w * time).cos();
        assert!(off.abs() < allowed, "after {time} s: {off} of {allowed} mm");
    }
}

#[test]
fn a_load_that_turns_round_each_step_never_pushes_further_than_it_does_when_it_stays() {
    // At critical damping the answer to a blow never changes sign: |x| <= F / k whatever the load within ± F.
    let (mass, stiffness, load) = (0.01f64, 4_000.0f64, 1_000.0f32);
    let w = (stiffness / mass).sqrt();
    let network = chain(2, 2.0, mass, stiffness, 2.0 * w * mass);
    let furthest = f64::from(load) / stiffness;
    for step_s in [1e-6, 1e-5, 1e-4, 1e-3, 1e-2, 0.1] {
        let mut tissue = tissue(&network);
        for step in 0..2_000 {
            let turned = if step % 2 == 0 { load } else { -load };
            tissue.set_load(1, Vec3::X * turned).expect("a finite load");
            let report = tissue.advance(step_s, &[]).expect("divided if need be");
            // The step answers to w h as it is, at most 1.9 with such a damping, to the second order.
            let error = 0.25 * (w * report.substep_s).powi(2) + 4.0 * EPSILON / furthest;
            let off = (tissue.precise_position(1).x - 2.0).abs();
            assert!(
                off <= furthest * (1.0 + error),
                "steps of {step_s} s, {step}: {off} of {furthest} mm"
            );
        }
    }
}

#[test]
fn mass_and_stiffness_ratios_of_a_million_at_any_step() {
    let plain = cube(5, 0.01, 2_000.0, 0.2);
    let change = |springs: bool, ratio: f64| {
        let mut network = plain.clone();
        for node in (0..125).step_by(7) {
            if !springs {
                network.masses[node] *= ratio;
                network.damping[node] *= ratio;
            }
        }
        for spring in (0..network.springs.len()).step_by(7).filter(|_| springs) {
            network.stiffness[spring] *= ratio;
        }
        network
            .positions
            .iter_mut()
            .for_each(|place| *place *= DVec3::new(1.2, 1.1, 0.9));
        network
    };
    let mut steps: Vec<f64> = vec![1e-7, 1e-5, 1e-4, 1e-3, 1e-2];
    for (springs, ratio) in [(false, 1e6), (false, 1e-6), (true, 1e6), (true, 1e-6)] {
        let network = change(springs, ratio);
        let start = tissue(&network);
        let (first, rounding) = (start.energy().total(), rounding_nj(&start));
        steps.retain(|step_s| *step_s > 0.0);
        for &step_s in &steps {
            let case = format!("springs {springs}, ratio {ratio}, steps of {step_s} s");
            let mut tissue = start.clone();
            // Far below the bound a few steps tell; else long enough to swing.
            let count = (0.02 / step_s).ceil().min(20_000.0) as u64;
            let report = tissue.advance_steps(step_s, count).expect("divided if need be");
            assert_eq!(report.put_aside, [], "{case}");
            assert!(report.substep_s <= report.bound_s, "{case}: {report:?}");
            let energy = tissue.energy().total();
            // A symplectic step swings about the true energy, most where a mode is near the bound.
            assert!(energy <= 1.05 * first + rounding, "{case}: {energy} of {first} nJ");
        }
    }
}

#[test]
fn a_million_steps_do_not_drift() {
    // Leapfrog keeps v² + w² (1 - w² h² / 4) x² for good; what is left is rounding, which adds up at random.
    let (mass, stiffness, spacing, amplitude) = (0.01f64, 4_000.0f64, 2.0, 0.1);
    let w = (stiffness / mass).sqrt();
    let mut network = chain(2, spacing, mass, stiffness, 0.0);
    network.positions[1].x += amplitude;
    let mut tissue = tissue(&network);
    let (product, steps) = (0.2, 1_000_000u32);
    let kept = |x: f64, v: f64| v * v + w * w * (1.0 - product * product / 4.0) * x * x;
    let first = kept(amplitude, 0.0);
    tissue
        .advance_steps(product / w, steps.into())
        .expect("within the bound");
    let velocity = f64::from(tissue.velocity(1).x);
    let last = kept(tissue.precise_position(1).x - spacing, velocity);
    // Each step rounds the velocity, and the force by that of the length.
    let a_step = EPSILON * (1.0 + product * spacing / amplitude);
    let allowed = 4.0 * f64::from(steps).sqrt() * a_step;
    assert!(
        (last / first - 1.0).abs() < allowed,
        "{last} of {first}, {allowed} allowed"
    );
}

#[test]
fn a_free_tumbling_cube_neither_gains_nor_loses_in_two_hundred_thousand_steps() {
    let mut network = cube(2, 0.01, 2_000.0, 0.0);
    for (place, velocity) in network.positions.iter().zip(&mut network.velocities) {
        *velocity = DVec3::new(10.0, -25.0, 15.0).cross(*place) * (1.0 + 0.2 * place.x);
    }
    let mut tissue = tissue(&network);
    let product = 0.1;
    let step_s = 0.5 * product * tissue.bound_s();
    let steps = 200_000u32;
    let first = 0.5 * 0.01 * network.velocities.iter().map(|v| v.length_squared()).sum::<f64>();
    for part in 1..=20 {
        tissue
            .advance_steps(step_s, u64::from(steps / 20))
            .expect("within the bound");
        let energy = tissue.energy().total();
        // Energy swings by w² h² / 4, and rounding adds up at random.
        let allowed = 0.25 * product * product + 4.0 * f64::from(steps).sqrt() * EPSILON;
        assert!(
            (energy / first - 1.0).abs() < allowed,
            "part {part}: {energy} of {first} nJ"
        );
    }
}

#[test]
fn a_node_that_creeps_by_less_than_rounding_a_step_creeps_on() {
    // Against drag a load moves a node by F / γ a second, here by a hundredth of a unit in the last place a step.
    let (place, step_s, steps) = (100.0, 1e-4, 100_000u32);
    let speed = 0.01 * 64.0 * EPSILON / step_s;
    let mut network = at_rest(vec![DVec3::splat(place)], Vec::new(), 0.01, 0.0, 10.0);
    network.loads[0] = DVec3::X * speed * 10.0;
    network.velocities[0] = DVec3::X * speed;
    let mut tissue = tissue(&network);
    tissue
        .advance_steps(step_s, steps.into())
        .expect("no spring limits the step");
    let exact = speed * step_s * f64::from(steps);
    let moved = tissue.precise_position(0).x - place;
    // Speed, step and kick are rounded, alike in each step.
    assert!((moved / exact - 1.0).abs() < 4.0 * EPSILON, "{moved} of {exact} mm");
}

#[test]
fn more_substeps_than_a_scene_can_wait_for_are_refused_by_name_and_nothing_moves() {
    let mut network = shaken_chain();
    network.stiffness[3] *= 1e12;
    let mut tissue = tissue(&network);
    let refused = tissue.advance_steps(1.0, 3);
    assert!(matches!(refused, Err(StepError::TooManySubsteps { .. })), "{refused:?}");
    for (node, place) in (0..).zip(&network.positions) {
        assert!(tissue.precise_position(node).distance(*place) < 1e-12, "node {node}");
    }
}
