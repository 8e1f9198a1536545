//! The classical Runge-Kutta method on positions and velocities. Order 4, explicit, four force passes a step.
//!
//! Source: Kutta 1901; Hairer, Nørsett and Wanner, Solving Ordinary Differential Equations I (1993), table II.1.2. Stable for
//! `h < 2.82 / w` without damping. It also makes the reference solutions.

use glam::DVec3;

use super::sound;
use crate::{
    method::{Method, StepError},
    system::{State, System, Work},
};

/// Classical Runge-Kutta.
#[derive(Debug, Clone)]
pub struct Rk4 {
    step_s: f64,
    rates: Vec<f64>,
    stage: State,
    sum: State,
    forces: Vec<DVec3>,
}

impl Rk4 {
    /// For steps of `step_s`, s, above 0.
    pub fn new(system: &System, step_s: f64) -> Rk4 {
        Rk4 {
            step_s,
            rates: (0..system.node_count()).map(|node| system.damping_rate(node)).collect(),
            stage: State::default(),
            sum: State::default(),
            forces: vec![DVec3::ZERO; system.node_count()],
        }
    }
}

impl Method for Rk4 {
    fn name(&self) -> &'static str {
        "RK4"
    }

    fn order(&self) -> u32 {
        4
    }

    fn step(&mut self, system: &System, state: &mut State, work: &mut Work) -> Result<(), StepError> {
        let h = self.step_s;
        self.stage.clone_from(state);
        self.sum.clone_from(state);
        // Share of the slope in the step, and where the next slope is taken.
        for (weight, next) in [(h / 6.0, 0.5 * h), (h / 3.0, 0.5 * h), (h / 3.0, h), (h / 6.0, 0.0)] {
            system.forces(&self.stage.positions, &mut self.forces, work);
            for node in 0..system.node_count() {
                let velocity = self.stage.velocities[node];
                let acceleration = self.forces[node] * system.inverse_masses[node] - velocity * self.rates[node];
                self.sum.positions[node] += velocity * weight;
                self.sum.velocities[node] += acceleration * weight;
                self.stage.positions[node] = state.positions[node] + velocity * next;
                self.stage.velocities[node] = state.velocities[node] + acceleration * next;
            }
        }
        std::mem::swap(state, &mut self.sum);
        sound(state)
    }
}
