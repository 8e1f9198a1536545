//! Extended position-based dynamics. Order 1 for any number of iterations: with one, small steps approach symplectic Euler,
//! with many, backward Euler.
//!
//! Source: Macklin, Müller and Chentanez 2016, equations (17) and (18), springs in the order of the network; Macklin et al.
//! 2019 for few iterations and small steps. A spring of stiffness k has the compliance 1 / k. Damping is that of backward
//! Euler: over a step a node of mass m has the inertia m + h gamma, in the prediction and against the springs.

use glam::DVec3;

use super::sound;
use crate::{
    method::{Method, StepError},
    system::{State, System, Work},
};

/// Extended position-based dynamics.
#[derive(Debug, Clone)]
pub struct Xpbd {
    step_s: f64,
    iterations: u32,
    /// 1 / (m + h gamma) of each node, 1/g; of a fixed one 0.
    mobilities: Vec<f64>,
    multipliers: Vec<f64>,
    start: Vec<DVec3>,
}

impl Xpbd {
    /// For steps of `step_s`, s, above 0, with one sweep over the springs an iteration, 1 or more.
    pub fn new(system: &System, step_s: f64, iterations: u32) -> Xpbd {
        let nodes = system.inverse_masses.iter().zip(&system.damping);
        let mobilities = nodes
            .map(|(inverse, damping)| inverse / (1.0 + step_s * damping * inverse))
            .collect();
        Xpbd {
            step_s,
            iterations,
            mobilities,
            multipliers: Vec::new(),
            start: Vec::new(),
        }
    }
}

impl Method for Xpbd {
    fn name(&self) -> &'static str {
        match self.iterations {
            1 => "XPBD, 1 sweep",
            10 => "XPBD, 10 sweeps",
            _ => "XPBD",
        }
    }

    fn order(&self) -> u32 {
        1
    }

    fn step(&mut self, system: &System, state: &mut State, work: &mut Work) -> Result<(), StepError> {
        let h = self.step_s;
        self.start.clone_from(&state.positions);
        for (node, place) in state.positions.iter_mut().enumerate() {
            let momentum = state.velocities[node] * system.masses[node] + system.loads[node] * h;
            let velocity = momentum * self.mobilities[node];
            *place += velocity * h;
        }
        self.multipliers.clear();
        self.multipliers.resize(system.springs.len(), 0.0);
        for _ in 0..self.iterations {
            work.sweeps += 1;
            work.spring_visits += system.springs.len() as u64;
            for (spring, multiplier) in system.springs.iter().zip(&mut self.multipliers) {
                let [a, b] = spring.ends.map(|end| end as usize);
                let [mobile_a, mobile_b] = [a, b].map(|node| self.mobilities[node]);
                let between = state.positions[b] - state.positions[a];
                let length = between.length();
                let compliance = 1.0 / (spring.stiffness * h * h);
                let change =
                    -(length - spring.rest_length + compliance * *multiplier) / (mobile_a + mobile_b + compliance);
                // A spring without stiffness, without length or between fixed nodes moves nothing.
                if !change.is_finite() || length == 0.0 {
                    continue;
                }
                *multiplier += change;
                let push = between * (change / length);
                state.positions[a] -= push * mobile_a;
                state.positions[b] += push * mobile_b;
            }
        }
        for (node, velocity) in state.velocities.iter_mut().enumerate() {
            *velocity = (state.positions[node] - self.start[node]) / h;
        }
        sound(state)
    }
}
