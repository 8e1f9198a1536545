//! Networks of springs that the tests share, and what rounding makes of their energy.

use glam::DVec3;
use resecta_solver::{Network, Tissue};

/// Nodes along x at every `spacing` mm, each joined to the next, the first one held.
pub fn chain(nodes: u32, spacing: f64, mass: f64, stiffness: f64, damping: f64) -> Network {
    let springs = (1..nodes).map(|n| [n - 1, n]).collect();
    let positions = (0..nodes).map(|n| DVec3::X * spacing * f64::from(n)).collect();
    let mut network = at_rest(positions, springs, mass, stiffness, damping);
    network.fixed[0] = true;
    network
}

/// A cube of `n` nodes a side, 1 mm apart, each joined to its neighbours along the axes and across the faces.
pub fn cube(n: u32, mass: f64, stiffness: f64, damping: f64) -> Network {
    let place = |node: u32| [node % n, node / n % n, node / n / n];
    let positions: Vec<DVec3> = (0..n * n * n).map(|node| place(node).map(f64::from).into()).collect();
    let mut springs = Vec::new();
    for a in 0..n * n * n {
        for b in a + 1..n * n * n {
            if positions[a as usize].distance_squared(positions[b as usize]) < 2.5 {
                springs.push([a, b]);
            }
        }
    }
    at_rest(positions, springs, mass, stiffness, damping)
}

/// Equal nodes and springs that are at rest where they are; nothing is held.
pub fn at_rest(positions: Vec<DVec3>, springs: Vec<[u32; 2]>, mass: f64, stiffness: f64, damping: f64) -> Network {
    let count = positions.len();
    let length = |[a, b]: [u32; 2]| positions[a as usize].distance(positions[b as usize]);
    Network {
        velocities: vec![DVec3::ZERO; count],
        masses: vec![mass; count],
        damping: vec![damping; count],
        loads: vec![DVec3::ZERO; count],
        fixed: vec![false; count],
        stiffness: vec![stiffness; springs.len()],
        rest_lengths: springs.iter().map(|&ends| length(ends)).collect(),
        springs,
        positions,
    }
}

/// Numbers from 0 to 1 that look random and are the same in every run.
pub fn uniform() -> impl FnMut() -> f64 {
    let mut count = 0.0f64;
    move || {
        count += 1.0;
        ((count * 12.9898).sin() * 43_758.545_3).rem_euclid(1.0)
    }
}

/// Energy that rounding of positions to single precision may make of rest, nJ: a spring's length is known to within a unit
/// in the last place of its ends' coordinates.
pub fn rounding_nj(tissue: &Tissue) -> f64 {
    let furthest = (0..tissue.node_count() as u32)
        .map(|node| tissue.position(node).abs().max_element())
        .fold(0.0, f32::max);
    let uncertainty = f64::from(furthest) * f64::from(f32::EPSILON) * 3.0f64.sqrt();
    let stiffness: f64 = (0..tissue.spring_count() as u32)
        .map(|spring| f64::from(tissue.spring(spring).stiffness))
        .sum();
    0.5 * stiffness * uncertainty * uncertainty
}

/// A tissue of a network that is known to be one.
pub fn tissue(network: &Network) -> Tissue {
    Tissue::from_network(network).expect("a complete network")
}
