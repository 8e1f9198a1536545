//! Scenes whose motion is known in closed form.

use glam::DVec3;
use resecta_solver::{Network, NetworkError, Tissue};

/// Nodes along x at every `spacing` mm, each joined to the next, the first one held.
fn chain(nodes: u32, spacing: f64, mass: f64, stiffness: f64, damping: f64) -> Network {
    let count = nodes as usize;
    Network {
        positions: (0..nodes).map(|n| DVec3::X * spacing * f64::from(n)).collect(),
        velocities: vec![DVec3::ZERO; count],
        masses: vec![mass; count],
        damping: vec![damping; count],
        loads: vec![DVec3::ZERO; count],
        fixed: (0..nodes).map(|n| n == 0).collect(),
        springs: (1..nodes).map(|n| [n - 1, n]).collect(),
        stiffness: vec![stiffness; count - 1],
        rest_lengths: vec![spacing; count - 1],
    }
}

#[test]
fn a_damped_oscillator_under_a_step_load_follows_the_closed_form() {
    // u = F/k [1 - e^(-z w t) (cos wd t + z / sqrt(1 - z²) sin wd t)] below critical damping, and above it with p and q
    // = -z w ± w sqrt(z² - 1): u = F/k [1 + (q e^(p t) - p e^(q t)) / (p - q)].
    let (mass, stiffness, load) = (0.01f64, 4_000.0, 1_000.0);
    let w = (stiffness / mass).sqrt();
    for damping_ratio in [0.0, 0.1, 0.7, 3.0] {
        let mut network = chain(2, 2.0, mass, stiffness, 2.0 * damping_ratio * w * mass);
        network.loads[1] = DVec3::X * load;
        let start = Tissue::from_network(&network).expect("two nodes are a network");
        let (step, steps) = (2e-5, 500);
        let time = step * f64::from(steps as u32);
        let mut tissue = start.clone();
        tissue.advance_steps(step, steps).expect("steps within the bound");
        let moved = tissue.precise_position(1).x - 2.0;
        let z = damping_ratio;
        let exact = if z < 1.0 {
            let wd = w * (1.0 - z * z).sqrt();
            let swing = (wd * time).cos() + z / (1.0 - z * z).sqrt() * (wd * time).sin();
            load / stiffness * (1.0 - (-z * w * time).exp() * swing)
        } else {
            let root = w * (z * z - 1.0).sqrt();
            let (p, q) = (-z * w + root, -z * w - root);
            load / stiffness * (1.0 + (q * (p * time).exp() - p * (q * time).exp()) / (p - q))
        };
        assert!(
            (moved - exact).abs() < 2e-5,
            "damping ratio {z}: {moved} against {exact}"
        );
    }
}

#[test]
fn a_chain_between_walls_swings_in_its_modes() {
    // w_p = 2 sqrt(k/m) sin(p π / 2(N + 1)), shape sin(p π j / (N + 1)). After whole periods the mode stands as it began.
    let (inner, mass, stiffness) = (12u32, 0.002f64, 1_500.0f64);
    for mode in [1u32, 3, 8] {
        let mut network = chain(inner + 2, 2.0, mass, stiffness, 0.0);
        network.fixed[inner as usize + 1] = true;
        let wave = |node: u32| {
            let part = f64::from(mode * node) / f64::from(inner + 1);
            (std::f64::consts::PI * part).sin()
        };
        let amplitude = 0.05;
        for node in 1..=inner {
            network.positions[node as usize].x += amplitude * wave(node);
        }
        let half_angle = std::f64::consts::PI * f64::from(mode) / (2.0 * f64::from(inner + 1));
        let period = std::f64::consts::PI / ((stiffness / mass).sqrt() * half_angle.sin());
        let start = Tissue::from_network(&network).expect("a chain is a network");
        let after = |part: f64| {
            let mut tissue = start.clone();
            tissue
                .advance_steps(part * period / 400.0, 400)
                .expect("steps within the bound");
            tissue
        };
        let (half, whole) = (after(0.5), after(1.0));
        for node in 1..=inner {
            let rest = 2.0 * f64::from(node);
            let (there, back) = (
                half.precise_position(node).x - rest,
                whole.precise_position(node).x - rest,
            );
            let expected = amplitude * wave(node);
            assert!(
                (there + expected).abs() < 2e-4 * amplitude,
                "mode {mode}, node {node}: {there}"
            );
            assert!(
                (back - expected).abs() < 2e-4 * amplitude,
                "mode {mode}, node {node}: {back}"
            );
        }
    }
}

#[test]
fn a_hanging_chain_comes_to_rest_at_the_closed_form() {
    // u_j = m g / k (j N - j (j - 1) / 2) for N nodes below the one that is held.
    let (below, mass, stiffness) = (10u32, 0.005f64, 8_000.0f64);
    let gravity = 9_810.0;
    let slowest = (stiffness / mass).sqrt() * std::f64::consts::PI / (2.0 * f64::from(below) + 1.0);
    // Near critical damping of the slowest mode: it comes to rest soonest.
    let mut network = chain(below + 1, 2.0, mass, stiffness, 2.0 * slowest * mass);
    network
        .loads
        .iter_mut()
        .for_each(|load| *load = DVec3::X * mass * gravity);
    let mut tissue = Tissue::from_network(&network).expect("a chain is a network");
    tissue
        .advance_steps(1e-3, 500)
        .expect("divided where the bound asks for it");
    for j in 1..=below {
        let (n, hung) = (f64::from(below), f64::from(j));
        let exact = mass * gravity / stiffness * (hung * n - hung * (hung - 1.0) / 2.0);
        let moved = tissue.precise_position(j).x - 2.0 * hung;
        assert!((moved / exact - 1.0).abs() < 1e-4, "node {j}: {moved} against {exact}");
    }
}

#[test]
fn a_wave_runs_along_a_chain_with_its_speed() {
    // c = a sqrt(k / m) for waves long against the spacing. Half the height of the front of a sudden pull at the end.
    let (nodes, spacing, mass, stiffness) = (400u32, 1.0, 0.001f64, 4_000.0f64);
    let mut network = chain(nodes, spacing, mass, stiffness, 0.0);
    let last = nodes as usize - 1;
    network.loads[last] = DVec3::X * 100.0;
    let mut tissue = Tissue::from_network(&network).expect("a chain is a network");
    let time = 0.1;
    tissue
        .advance_steps(time / 2_000.0, 2_000)
        .expect("steps within the bound");
    // Behind the front the strain is F/k a and the velocity c times that: the end has moved by c t F / (k a) a.
    let speed = spacing * (stiffness / mass).sqrt();
    let moved = tissue.precise_position(nodes - 1).x - spacing * f64::from(nodes - 1);
    let exact = speed * time * (100.0 / stiffness) / spacing;
    assert!((moved / exact - 1.0).abs() < 5e-3, "{moved} against {exact}");
    // Before the front nothing has moved yet.
    let ahead = (f64::from(nodes - 1) * spacing - speed * time) / spacing * 0.9;
    assert!((tissue.precise_position(ahead as u32).x - ahead.floor() * spacing).abs() < 1e-4);
}

#[test]
fn a_spring_across_the_way_pulls_back_as_its_stretch_says() {
    // F = 2 k u (1 - l0 / sqrt(l0² + u²)) on a node between two that are held.
    let (stiffness, spacing, sideways) = (2_000.0, 2.0, 0.4f64);
    let mut network = chain(3, spacing, 0.01, stiffness, 10.0);
    network.fixed[2] = true;
    let pull = 2.0 * stiffness * sideways * (1.0 - spacing / spacing.hypot(sideways));
    network.loads[1] = DVec3::Y * pull;
    let mut tissue = Tissue::from_network(&network).expect("three nodes are a network");
    tissue
        .advance_steps(1e-3, 2_000)
        .expect("divided where the bound asks for it");
    let moved = tissue.precise_position(1).y;
    assert!((moved / sideways - 1.0).abs() < 1e-4, "{moved}");
}

#[test]
fn steps_beyond_the_bound_are_divided_and_lead_to_the_same_place() {
    let mut network = chain(30, 1.0, 0.001, 4_000.0, 0.05);
    network.loads[29] = DVec3::new(50.0, 20.0, 0.0);
    let start = Tissue::from_network(&network).expect("a chain is a network");
    let bound = start.clone().bound_s();
    let mut fine = start.clone();
    fine.advance_steps(0.05 * bound, 4_000).expect("steps within the bound");
    let mut coarse = start.clone();
    let report = coarse.advance_steps(20.0 * bound, 10).expect("divided");
    assert!(report.substep_s < bound && report.substeps >= 200, "{report:?}");
    for node in 0..30 {
        let apart = fine.precise_position(node).distance(coarse.precise_position(node));
        assert!(apart < 0.02, "node {node}: {apart}");
    }
}

#[test]
fn fixed_nodes_stay_whatever_pulls_at_them() {
    let mut network = chain(5, 2.0, 0.01, 1_000.0, 0.1);
    network.fixed = vec![true, false, true, false, false];
    network.loads = vec![DVec3::new(500.0, 300.0, -100.0); 5];
    network.velocities = vec![DVec3::Y * 100.0; 5];
    let mut tissue = Tissue::from_network(&network).expect("a chain is a network");
    tissue
        .advance_steps(1e-3, 200)
        .expect("divided where the bound asks for it");
    for node in [0, 2] {
        assert_eq!(tissue.precise_position(node), network.positions[node as usize]);
    }
    assert!(tissue.precise_position(1).y > 0.1);
    assert_eq!(tissue.validate(), Ok(()));
}

#[test]
fn what_is_no_network_is_named() {
    let good = chain(3, 1.0, 0.01, 100.0, 0.0);
    let with = |change: fn(&mut Network)| {
        let mut network = good.clone();
        change(&mut network);
        Tissue::from_network(&network).expect_err("it is refused").to_string()
    };
    assert_eq!(
        with(|n| n.masses[1] = 0.0),
        "masses of node 1 is 0, expected above 0, up to 1e12 g"
    );
    assert_eq!(
        with(|n| n.positions[2].y = f64::NAN),
        "positions of node 2 is NaN, expected a number within 10 m"
    );
    assert_eq!(with(|n| n.damping.truncate(1)), "damping has 1 entries, expected 3");
    assert_eq!(
        with(|n| n.springs[0] = [0, 7]),
        "spring 0 joins node 7, but there are 3 nodes"
    );
    assert_eq!(
        with(|n| n.stiffness[1] = -1.0),
        "stiffness of spring 1 is -1, expected 0 to 1e18 µN/mm"
    );
    assert_eq!(
        Tissue::from_network(&Network::default()).err(),
        Some(NetworkError::Size(0))
    );
}
