//! Hard cases, each over steps from far below the bound of stability to far above it: nothing blows up, energy without load
//! never grows, and what cannot go on is named.
//!
//! The scene is a thick tube of springs, 1,008 nodes, its outer layer held; the cases are those of the common list
//! (stiffness and mass ratios to a million, starts that are stretched, flat, collapsed, random or mirrored, fragments,
//! free fall, buckling, 5 m/s, springs without length).

use std::f64::consts::TAU;

use glam::DVec3;
use resecta_solver::{Network, Tissue};

const ANGLES: usize = 14;
const SLICES: usize = 12;
const LAYERS: usize = 6;

/// Steps, s: the bound of the plain scene is near 2e-4 s.
const STEPS_S: [f64; 4] = [2e-5, 1e-4, 1e-3, 1e-2];

/// How long each case runs, s.
const DURATION_S: f64 = 0.2;

fn index(angle: usize, slice: usize, layer: usize) -> u32 {
    ((angle % ANGLES * SLICES + slice) * LAYERS + layer) as u32
}

fn tube() -> Network {
    let (inner, outer, length, density, modulus) = (3.0, 22.5, 40.0, 1.05e-3, 20e3);
    let radius = |layer: usize| inner + (outer - inner) * layer as f64 / (LAYERS - 1) as f64;
    let mut network = Network::default();
    let volume = TAU / 2.0 * (outer * outer - inner * inner) * length;
    let cell = volume / (ANGLES * SLICES * LAYERS) as f64;
    for angle in 0..ANGLES {
        for slice in 0..SLICES {
            for layer in 0..LAYERS {
                let (sin, cos) = (TAU * angle as f64 / ANGLES as f64).sin_cos();
                let z = length * slice as f64 / (SLICES - 1) as f64;
                network
                    .positions
                    .push(DVec3::new(radius(layer) * cos, radius(layer) * sin, z));
                // As much as the cell is wide there.
                network.masses.push(density * cell * radius(layer) / radius(LAYERS / 2));
                network.fixed.push(layer == LAYERS - 1);
                for (next, exists) in [
                    (index(angle, slice, layer + 1), layer + 1 < LAYERS),
                    (index(angle, slice + 1, layer), slice + 1 < SLICES),
                    (index(angle + 1, slice, layer), true),
                ] {
                    if exists {
                        network.springs.push([index(angle, slice, layer), next]);
                    }
                }
            }
        }
    }
    let count = network.positions.len();
    network.damping = network.masses.iter().map(|mass| 40.0 * mass).collect();
    network.velocities = vec![DVec3::ZERO; count];
    network.loads = vec![DVec3::ZERO; count];
    network.stiffness = vec![modulus * cell.cbrt(); network.springs.len()];
    let length = |[a, b]: [u32; 2]| network.positions[a as usize].distance(network.positions[b as usize]);
    network.rest_lengths = network.springs.iter().map(|&ends| length(ends)).collect();
    network
}

/// Changes the positions of the nodes that are not held.
fn place(network: &mut Network, place: impl Fn(DVec3) -> DVec3) {
    for (position, fixed) in network.positions.iter_mut().zip(&network.fixed) {
        if !fixed {
            *position = place(*position);
        }
    }
}

/// Runs a case with every step. Without loads energy stays below that of the start.
fn survives(name: &str, network: &Network, mut also: impl FnMut(&str, &Tissue)) {
    let is_loaded = network.loads.iter().any(|load| *load != DVec3::ZERO);
    let start = Tissue::from_network(network).expect("a case is a network");
    // Inertias are given with the first step.
    let moving = |node: usize| !network.fixed[node];
    let kinetic: f64 = (0..network.masses.len())
        .filter(|&node| moving(node))
        .map(|node| 0.5 * network.masses[node] * network.velocities[node].length_squared())
        .sum();
    let first = start.energy().elastic + kinetic;
    // What is left at rest is the rounding of positions in single precision: see the law of energy among those of motion.
    let furthest = network
        .positions
        .iter()
        .map(|position| position.abs().max_element())
        .fold(0.0, f64::max);
    let uncertainty = furthest * f64::from(f32::EPSILON) * 3.0f64.sqrt();
    let rounding = 0.5 * network.stiffness.iter().sum::<f64>() * uncertainty * uncertainty;
    for step_s in STEPS_S {
        let case = format!("{name}, steps of {step_s} s");
        let mut tissue = start.clone();
        let stretches = 10;
        for _ in 0..stretches {
            let steps = (DURATION_S / f64::from(stretches) / step_s).round() as u64;
            let report = tissue
                .advance_steps(step_s, steps)
                .unwrap_or_else(|error| panic!("{case}: {error}"));
            assert_eq!(report.put_aside, [], "{case}");
            let energy = tissue.energy().total();
            assert!(energy.is_finite(), "{case}");
            if !is_loaded {
                // A symplectic step swings about the true energy, most where a mode is near the bound.
                assert!(energy <= 1.05 * first + rounding, "{case}: {energy} nJ of {first}");
            }
        }
        for node in 0..tissue.node_count() as u32 {
            assert!(tissue.precise_position(node).is_finite(), "{case}: node {node}");
        }
        also(&case, &tissue);
    }
}

#[test]
fn at_rest_nothing_moves() {
    let network = tube();
    survives("rest", &network, |case, tissue| {
        for (node, position) in (0..).zip(&network.positions) {
            // Lengths at rest are rounded to single precision, and six neighbours hold a node sideways by nothing.
            let moved = tissue.precise_position(node).distance(*position);
            assert!(moved < 1e-4, "{case}: node {node} by {moved} mm");
        }
    });
}

#[test]
fn stiffness_ratios() {
    for ratio in [1e2, 1e4] {
        let mut network = tube();
        let stiff = |node: u32| [1, 2].contains(&(node as usize % LAYERS));
        for (stiffness, ends) in network.stiffness.iter_mut().zip(&network.springs) {
            if ends.iter().all(|&node| stiff(node)) {
                *stiffness *= ratio;
            }
        }
        place(&mut network, |position| position * DVec3::new(1.2, 1.2, 1.0));
        survives(&format!("stiffness ratio {ratio}"), &network, |_, _| ());
    }
}

#[test]
fn a_stiffness_ratio_of_a_million() {
    // 400,000 substeps in 0.2 s: one step length is enough to wait for.
    let mut network = tube();
    let stiff = |node: u32| [1, 2].contains(&(node as usize % LAYERS));
    for (stiffness, ends) in network.stiffness.iter_mut().zip(&network.springs) {
        if ends.iter().all(|&node| stiff(node)) {
            *stiffness *= 1e6;
        }
    }
    place(&mut network, |position| position * DVec3::new(1.2, 1.2, 1.0));
    let mut tissue = Tissue::from_network(&network).expect("a case is a network");
    let first = tissue.energy().elastic;
    let report = tissue
        .advance_steps(1e-3, 50)
        .expect("divided where the bound asks for it");
    assert_eq!(report.put_aside, []);
    let left = tissue.energy().total();
    assert!(left.is_finite() && left < 1.05 * first, "{left} nJ of {first}");
}

#[test]
fn mass_ratios() {
    for ratio in [1e6, 1e4, 1e-4] {
        let mut network = tube();
        for node in (0..network.masses.len())
            .step_by(37)
            .filter(|node| node % LAYERS != LAYERS - 1)
        {
            network.masses[node] *= ratio;
            network.damping[node] *= ratio;
        }
        place(&mut network, |position| position * DVec3::new(1.2, 1.2, 1.0));
        survives(&format!("mass ratio {ratio}"), &network, |_, _| ());
    }
}

#[test]
fn stretched_flat_collapsed_and_mirrored_starts() {
    type Start = (&'static str, fn(DVec3) -> DVec3);
    let starts: [Start; 4] = [
        ("stretched three times", |position| position * 3.0),
        ("flat", |position| DVec3::new(position.x, position.y, 20.0)),
        ("collapsed to a point", |_| DVec3::new(0.0, 0.0, 20.0)),
        ("mirrored", |position| position * DVec3::new(-1.0, 1.0, 1.0)),
    ];
    for (name, start) in starts {
        let mut network = tube();
        place(&mut network, start);
        survives(name, &network, |_, _| ());
    }
}

#[test]
fn a_random_start_and_random_velocities() {
    // Digits far behind the point of a sine look random, and are the same in every run.
    let mut count = 0.0f64;
    let mut uniform = || {
        count += 1.0;
        ((count * 12.9898).sin() * 43_758.545_3).rem_euclid(1.0)
    };
    let mut places = tube();
    let mut speeds = tube();
    for node in 0..places.positions.len() {
        let at = DVec3::new(uniform() - 0.5, uniform() - 0.5, uniform()) * DVec3::new(45.0, 45.0, 40.0);
        let velocity = (DVec3::new(uniform(), uniform(), uniform()) - 0.5) * 2.0 * 5_000.0;
        if !places.fixed[node] {
            places.positions[node] = at;
            speeds.velocities[node] = velocity;
        }
    }
    survives("random places", &places, |_, _| ());
    survives("random velocities of 5 m/s", &speeds, |_, _| ());
}

#[test]
fn fragments_lone_nodes_and_a_free_fall() {
    let gravity = -9_810.0;
    let mut network = tube();
    let inside = |node: u32| {
        let position = network.positions[node as usize];
        position.x > 4.0 && position.y.abs() < 12.0 && (12.0..28.0).contains(&position.z)
    };
    let cut: Vec<bool> = network
        .springs
        .iter()
        .map(|&[a, b]| inside(a) != inside(b) || inside(a) && (a % 5 == 0 || b % 5 == 0))
        .collect();
    for (stiffness, _) in network.stiffness.iter_mut().zip(cut).filter(|(_, cut)| *cut) {
        *stiffness = 0.0;
    }
    for (load, mass) in network.loads.iter_mut().zip(&network.masses) {
        *load = DVec3::Z * gravity * *mass;
    }
    survives("fragments and lone nodes under gravity", &network, |_, _| ());

    // Nothing held: every node falls as one against its drag, z = g/r t - g/r² (1 - e^(-r t)).
    let mut falling = tube();
    falling.fixed.fill(false);
    falling.loads.clone_from(&network.loads);
    let rate = 40.0f64;
    let fallen = gravity / rate * DURATION_S - gravity / (rate * rate) * (1.0 - (-rate * DURATION_S).exp());
    survives("free fall", &falling, |case, tissue| {
        for (node, position) in (0..).zip(&falling.positions) {
            let apart = tissue.precise_position(node) - *position - DVec3::Z * fallen;
            assert!(apart.length() < 2e-3, "{case}: node {node} is {apart} off");
        }
    });
}

#[test]
fn a_push_that_buckles_and_springs_without_length() {
    let mut pushed = tube();
    let patch: Vec<usize> = (0..pushed.masses.len())
        .filter(|&node| node % LAYERS == 0 && pushed.positions[node].x > 2.0)
        .collect();
    for &node in &patch {
        pushed.loads[node] = DVec3::new(1.0, 0.17, 0.11).normalize() * 1e6 / patch.len() as f64;
    }
    survives("a push of 1 N outward", &pushed, |_, _| ());
    let mut without = tube();
    without
        .rest_lengths
        .iter_mut()
        .step_by(11)
        .for_each(|length| *length = 0.0);
    survives("every 11th spring without length", &without, |_, _| ());
}

#[test]
fn a_load_that_turns_round_each_step_and_nodes_thrown_about() {
    let network = tube();
    let mut tissue = Tissue::from_network(&network).expect("a tube is a network");
    for step in 0..600u32 {
        let load = DVec3::new(2e4, 0.0, 0.0) * if step % 2 == 0 { 1.0 } else { -1.0 };
        tissue.set_load(200, load.as_vec3()).expect("a finite load");
        let thrown = (step * 97) % 1008;
        if !network.fixed[thrown as usize] {
            let far = network.positions[thrown as usize].as_vec3() * 2.0;
            tissue.set_position(thrown, far).expect("a finite position");
        }
        let report = tissue.advance(1.0 / 60.0, &[]).expect("a plain advance");
        assert_eq!(report.put_aside, [], "step {step}");
    }
    assert!(tissue.energy().total().is_finite());
}
