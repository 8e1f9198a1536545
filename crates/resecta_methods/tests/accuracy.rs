//! Methods against closed forms: order of convergence on oscillators and a chain, exact decay.

mod common;

use std::f64::consts::PI;

use common::{advance, chain};
use glam::DVec3;
use resecta_methods::{
    method::{Choice, Method},
    methods::{bdf2::Bdf2, implicit_euler::ImplicitEuler, midpoint::Midpoint},
    system::{State, System},
};
use resecta_solver::Network;

/// A node of mass `mass` on a spring from a fixed node, loaded along it.
fn oscillator(mass: f64, stiffness: f64, damping: f64, load: f64) -> (System, State) {
    let network = Network {
        positions: vec![DVec3::ZERO, DVec3::X],
        velocities: vec![DVec3::ZERO; 2],
        masses: vec![mass; 2],
        damping: vec![damping; 2],
        loads: vec![DVec3::ZERO, DVec3::X * load],
        fixed: vec![true, false],
        springs: vec![[0, 1]],
        stiffness: vec![stiffness],
        rest_lengths: vec![1.0],
    };
    System::new(&network).expect("a sound network")
}

/// The method, solved as exactly as it can be where there is something to solve.
fn exact(choice: Choice, system: &System, step_s: f64) -> Box<dyn Method> {
    match choice {
        Choice::ImplicitEuler => Box::new(ImplicitEuler::new(step_s, 1e-9)),
        Choice::Bdf2 => Box::new(Bdf2::new(step_s, 1e-9)),
        Choice::Midpoint => Box::new(Midpoint::new(step_s, 1e-9)),
        other => other.build(system, step_s),
    }
}

/// Movement under a step load: numerics of a damped oscillator of frequency w and damping ratio z.
fn step_response(w: f64, z: f64, t: f64) -> f64 {
    if z < 1.0 {
        let root = (1.0 - z * z).sqrt();
        let wd = w * root;
        1.0 - (-z * w * t).exp() * ((wd * t).cos() + z / root * (wd * t).sin())
    } else {
        let root = w * (z * z - 1.0).sqrt();
        let (p, q) = (-z * w + root, -z * w - root);
        1.0 + (q * (p * t).exp() - p * (q * t).exp()) / (p - q)
    }
}

/// The order between two numbers of steps, each the half of the next.
fn order(error: impl Fn(usize) -> f64, steps: usize) -> f64 {
    (error(steps) / error(2 * steps)).log2()
}

#[test]
fn every_method_converges_on_a_damped_oscillator_with_its_order() {
    let (mass, w): (f64, f64) = (0.01, 20.0);
    for z in [0.2, 0.7, 3.0] {
        let (system, start) = oscillator(mass, mass * w * w, 2.0 * z * w * mass, 0.3);
        let (t, still) = (0.13, 0.3 / (mass * w * w));
        for choice in Choice::ALL {
            let error = |steps: usize| {
                let mut state = start.clone();
                let mut method = exact(choice, &system, t / steps as f64);
                advance(method.as_mut(), &system, &mut state, steps);
                (state.positions[1].x - 1.0 - still * step_response(w, z, t)).abs()
            };
            let expected = exact(choice, &system, 1e-3).order();
            // Of order 4 the error drowns in rounding where steps are shorter still.
            let seen = order(error, if expected > 2 { 64 } else { 256 });
            assert!(
                (seen - f64::from(expected)).abs() < 0.2,
                "{choice:?} at z = {z}: order {seen}"
            );
        }
    }
}

#[test]
fn every_method_converges_on_a_chain_in_its_slowest_mode() {
    let (count, mass, stiffness) = (5, 0.01, 4.0);
    let mut network = chain(count, mass, stiffness, 2.0);
    let shape = |node: usize| 0.05 * (PI * node as f64 / (count + 1) as f64).sin();
    for (node, place) in network.positions.iter_mut().enumerate().take(count + 1).skip(1) {
        place.x += shape(node);
    }
    let w = 2.0 * (stiffness / mass).sqrt() * (PI / (2.0 * (count + 1) as f64)).sin();
    let (system, start) = System::new(&network).expect("a sound network");
    let t = 0.22;
    for choice in Choice::ALL {
        let error = |steps: usize| {
            let mut state = start.clone();
            advance(
                exact(choice, &system, t / steps as f64).as_mut(),
                &system,
                &mut state,
                steps,
            );
            let off = |node: usize| state.positions[node].x - 2.0 * node as f64 - shape(node) * (w * t).cos();
            (1..=count).map(|node| off(node).powi(2)).sum::<f64>().sqrt()
        };
        let expected = exact(choice, &system, 1e-3).order();
        let seen = order(error, if expected > 2 { 32 } else { 512 });
        assert!((seen - f64::from(expected)).abs() < 0.2, "{choice:?}: order {seen}");
    }
}

#[test]
fn damping_alone_decays_exactly() {
    let (mut system, mut start) = oscillator(0.02, 0.0, 0.5, 0.0);
    system.springs.clear();
    start.velocities[1].x = 7.0;
    let (t, steps) = (0.1, 9);
    for choice in [Choice::Leapfrog, Choice::SymplecticEuler] {
        let mut state = start.clone();
        advance(
            choice.build(&system, t / steps as f64).as_mut(),
            &system,
            &mut state,
            steps,
        );
        let expected = 7.0 * (-0.5 / 0.02 * t).exp();
        assert!((state.velocities[1].x / expected - 1.0).abs() < 1e-10, "{choice:?}");
    }
}
