//! Small scenes with known answers.

use glam::DVec3;
use resecta_methods::{
    method::Method,
    system::{State, System, Work},
};
use resecta_solver::Network;

/// A chain of `count` free nodes along x, `spacing` apart, between two walls; at rest.
pub fn chain(count: usize, mass: f64, stiffness: f64, spacing: f64) -> Network {
    let nodes = count + 2;
    Network {
        positions: (0..nodes).map(|n| DVec3::X * (spacing * n as f64)).collect(),
        velocities: vec![DVec3::ZERO; nodes],
        masses: vec![mass; nodes],
        damping: vec![0.0; nodes],
        loads: vec![DVec3::ZERO; nodes],
        fixed: (0..nodes).map(|n| n == 0 || n == nodes - 1).collect(),
        springs: (0..nodes as u32 - 1).map(|n| [n, n + 1]).collect(),
        stiffness: vec![stiffness; nodes - 1],
        rest_lengths: vec![spacing; nodes - 1],
    }
}

/// Makes steps; panics where one fails.
pub fn advance(method: &mut dyn Method, system: &System, state: &mut State, steps: usize) {
    let mut work = Work::default();
    for _ in 0..steps {
        method
            .step(system, state, &mut work)
            .unwrap_or_else(|error| panic!("{}: {error}", method.name()));
    }
}
