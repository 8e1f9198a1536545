//! The implicit midpoint rule: `x1 = x0 + h u`, `v1 = 2 u - v0` with the velocity u halfway. Order 2, implicit; stable
//! without limit for linear springs, damps nothing by itself.
//!
//! Source: Hairer, Lubich and Wanner, Geometric Numerical Integration (2006), I.1.2 and II.1.3.

use super::sound;
use crate::{
    implicit::Stage,
    method::{Method, StepError},
    system::{State, System, Work},
};

/// The implicit midpoint rule.
#[derive(Debug, Clone)]
pub struct Midpoint {
    step_s: f64,
    stage: Stage,
    base: State,
}

impl Midpoint {
    /// For steps of `step_s`, s, above 0, solved to `tolerance`; see [`Stage::new`].
    pub fn new(step_s: f64, tolerance: f64) -> Midpoint {
        Midpoint {
            step_s,
            stage: Stage::new(tolerance),
            base: State::default(),
        }
    }
}

impl Method for Midpoint {
    fn name(&self) -> &'static str {
        "implicit midpoint"
    }

    fn order(&self) -> u32 {
        2
    }

    fn step(&mut self, system: &System, state: &mut State, work: &mut Work) -> Result<(), StepError> {
        self.base.clone_from(state);
        self.stage
            .solve(system, 0.5 * self.step_s, &self.base, &mut state.velocities, work)?;
        for node in 0..system.node_count() {
            let halfway = state.velocities[node];
            state.positions[node] += halfway * self.step_s;
            state.velocities[node] = halfway * 2.0 - self.base.velocities[node];
        }
        sound(state)
    }
}
