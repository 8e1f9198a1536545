//! Chains whose motion is known in closed form, with the error of the step taken into account: what is left is rounding.

mod common;

use std::f64::consts::{PI, TAU};

use common::networks::{at_rest, chain, tissue};
use glam::DVec3;
use resecta_solver::Tissue;

const EPSILON: f64 = f32::EPSILON as f64;

#[test]
fn a_step_swings_at_the_frequency_of_leapfrog() {
    // On x'' = -w² x a step h gives x_n = A cos(W n h) with sin(W h / 2) = w h / 2, whatever h below the limit.
    let (mass, stiffness, spacing, amplitude) = (0.01f64, 4_000.0f64, 2.0, 0.1);
    let w = (stiffness / mass).sqrt();
    let mut network = chain(2, spacing, mass, stiffness, 0.0);
    network.positions[1].x += amplitude;
    for half_angle in [0.05, 0.2, 0.4, 0.6f64] {
        let (step_s, turn) = (2.0 * half_angle / w, 2.0 * half_angle.asin());
        let steps = 1_000u32;
        let mut tissue = tissue(&network);
        let report = tissue.advance_steps(step_s, steps.into()).expect("within the bound");
        assert_eq!(report.substeps, steps, "no step is divided");
        let turned = turn * f64::from(steps);
        let moved = tissue.precise_position(1).x - spacing;
        // The step and the kick are rounded to single precision, and turn the phase by as much in each step; a force is off
        // by the rounding of the length, at random.
        let rounding = turned * 4.0 * EPSILON / (1.0 - half_angle * half_angle).sqrt()
            + f64::from(steps).sqrt() * spacing * EPSILON / amplitude;
        let off = (moved - amplitude * turned.cos()).abs();
        assert!(
            off < rounding * amplitude,
            "w h / 2 = {half_angle}: {moved}, off by {off} mm"
        );
    }
}

#[test]
fn a_chain_under_tension_swings_sideways_in_its_modes() {
    // w_p = 2 sqrt(T / (m a)) sin(p π / 2(N + 1)), shape sin(p π j / (N + 1)).
    let (inner, mass, stiffness, spacing, rest) = (12u32, 0.002f64, 1_500.0f64, 2.0, 1.5);
    let tension = stiffness * (spacing - rest);
    for mode in [1u32, 3, 8] {
        let part = f64::from(mode) / f64::from(inner + 1);
        let w = 2.0 * (tension / (mass * spacing)).sqrt() * (0.5 * PI * part).sin();
        let (amplitude, steps) = (1e-3, 400u32);
        let wave = |node: u32| amplitude * (PI * part * f64::from(node)).sin();
        let mut network = chain(inner + 2, spacing, mass, stiffness, 0.0);
        network.fixed[inner as usize + 1] = true;
        network.rest_lengths.fill(rest);
        for node in 1..=inner {
            network.positions[node as usize].y = wave(node);
        }
        // So that leapfrog turns by a whole period in all steps.
        let step_s = 2.0 * (PI / f64::from(steps)).sin() / w;
        let mut tissue = tissue(&network);
        // Sideways moves stretch the springs a little, and the rounding of lengths changes their tension.
        let elongation = spacing - rest;
        let stretch = (2.0 * amplitude).powi(2) / (2.0 * spacing * elongation);
        let rounding = f64::from(steps).sqrt() * f64::from(inner + 1) * spacing * EPSILON / elongation;
        let tolerance = amplitude * (TAU * stretch + rounding);
        for sign in [-1.0, 1.0] {
            let report = tissue
                .advance_steps(step_s, u64::from(steps / 2))
                .expect("within the bound");
            assert_eq!(report.substeps, steps / 2, "no step is divided");
            for node in 1..=inner {
                let off = tissue.precise_position(node).y - sign * wave(node);
                assert!(off.abs() < tolerance, "mode {mode}, node {node}: {off} of {tolerance}");
            }
        }
    }
}

#[test]
fn a_wave_travels_with_the_speed_of_its_length() {
    // w(q) = 2 sqrt(k / m) sin(q a / 2), from the speed of sound for long waves to standing still for the shortest. In n steps
    // a node feels no further than n neighbours, so that the middle of a long chain is that of an endless one.
    let (steps, spacing, mass, stiffness, amplitude) = (40u32, 1.0, 0.001f64, 4_000.0f64, 0.1);
    let nodes = 3 * steps + 1;
    let rest = |node: u32| spacing * (f64::from(node) - f64::from(nodes / 2));
    for wave_number in [PI / 20.0, PI / 3.0, 0.9 * PI] {
        let positions: Vec<DVec3> = (0..nodes).map(|node| DVec3::X * rest(node)).collect();
        let springs = (1..nodes).map(|n| [n - 1, n]).collect();
        let mut network = at_rest(positions, springs, mass, stiffness, 0.0);
        let step_s = 0.8 * tissue(&network).bound_s();
        let w = 2.0 * (stiffness / mass).sqrt() * (0.5 * wave_number * spacing).sin();
        let turn = 2.0 * (0.5 * w * step_s).asin();
        for node in 0..nodes {
            let phase = wave_number * rest(node);
            network.positions[node as usize].x += amplitude * phase.cos();
            network.velocities[node as usize].x = amplitude * phase.sin() * turn.sin() / step_s;
        }
        let mut tissue = tissue(&network);
        let report = tissue.advance_steps(step_s, steps.into()).expect("within the bound");
        assert_eq!(report.substeps, steps, "no step is divided");
        // A force off by the rounding of a length changes the velocity for all steps to come.
        let rounding = rest(nodes - 1) * EPSILON * f64::from(steps).powf(1.5);
        for node in steps..=2 * steps {
            let phase = wave_number * rest(node) - turn * f64::from(steps);
            let off = tissue.precise_position(node).x - rest(node) - amplitude * phase.cos();
            assert!(
                off.abs() < rounding,
                "wave number {wave_number}, node {node}: {off} of {rounding} mm"
            );
        }
    }
}

#[test]
fn three_steps_tell_the_order_two() {
    // p = log2(|x_h - x_(h/2)| / |x_(h/2) - x_(h/4)|), on a chain that swings far: nothing is linear.
    let mut network = chain(9, 2.0, 0.01, 2_000.0, 0.02);
    network.fixed[8] = true;
    network.rest_lengths.fill(1.7);
    for node in 1..8 {
        network.loads[node] = DVec3::new(0.0, 300.0, -150.0);
        network.velocities[node].z = 200.0 * (node as f64).sin();
    }
    let after = |steps: u32| -> Tissue {
        let mut tissue = tissue(&network);
        let report = tissue
            .advance_steps(0.02 / f64::from(steps), steps.into())
            .expect("within the bound");
        assert_eq!(report.substeps, steps, "no step is divided");
        tissue
    };
    let apart = |a: &Tissue, b: &Tissue| -> f64 {
        let squares = (1..8).map(|node| a.precise_position(node).distance_squared(b.precise_position(node)));
        squares.sum::<f64>().sqrt()
    };
    let (coarse, middle, fine) = (after(25), after(50), after(100));
    let order = (apart(&coarse, &middle) / apart(&middle, &fine)).log2();
    assert!((1.9..2.1).contains(&order), "{order}");
}

#[test]
fn an_even_stretch_leaves_no_force_inside_and_k_e_a_at_the_ends() {
    // A lattice stretched by a quarter along x, pulled at each end node by the force of the one spring that is missing there.
    let (n, stiffness, strain) = (5u32, 1_000.0, 0.25);
    let index = |x: u32, y: u32, z: u32| (z * n + y) * n + x;
    let mut positions = Vec::new();
    let mut springs = Vec::new();
    for (z, y, x) in (0..n).flat_map(|z| (0..n).flat_map(move |y| (0..n).map(move |x| (z, y, x)))) {
        positions.push(DVec3::new(x.into(), y.into(), z.into()));
        let next = [(x + 1, y, z), (x, y + 1, z), (x, y, z + 1)];
        let inside = next.into_iter().filter(|&(x, y, z)| x.max(y).max(z) < n);
        springs.extend(inside.map(|(nx, ny, nz)| [index(x, y, z), index(nx, ny, nz)]));
    }
    let mut network = at_rest(positions, springs, 0.01, stiffness, 0.0);
    for node in 0..network.positions.len() {
        let place = &mut network.positions[node];
        network.loads[node].x = match place.x {
            0.0 => -stiffness * strain,
            x if x == f64::from(n - 1) => stiffness * strain,
            _ => 0.0,
        };
        place.x *= 1.0 + strain;
    }
    let mut tissue = tissue(&network);
    let report = tissue.advance_steps(1e-3, 500).expect("divided if need be");
    assert_eq!(report.put_aside, []);
    for (node, place) in (0..).zip(&network.positions) {
        // All lengths and forces are whole numbers of 1/4: there is nothing to round.
        assert_eq!(tissue.precise_position(node), *place, "node {node}");
    }
}
