//! Backward Euler: `x1 = x0 + h v1`, `m (v1 - v0) = h (F(x1) - gamma v1)`. Order 1, implicit, unconditionally stable; it
//! damps motion by `(1 + w² h²)^(-1/2)` a step.
//!
//! Source: Baraff and Witkin 1998, equation (3); here the equations are solved and not only linearised once.

use super::sound;
use crate::{
    implicit::Stage,
    method::{Method, StepError},
    system::{State, System, Work},
};

/// Backward Euler.
#[derive(Debug, Clone)]
pub struct ImplicitEuler {
    step_s: f64,
    stage: Stage,
    base: State,
}

impl ImplicitEuler {
    /// For steps of `step_s`, s, above 0, solved to `tolerance`; see [`Stage::new`].
    pub fn new(step_s: f64, tolerance: f64) -> ImplicitEuler {
        ImplicitEuler {
            step_s,
            stage: Stage::new(tolerance),
            base: State::default(),
        }
    }
}

impl Method for ImplicitEuler {
    fn name(&self) -> &'static str {
        "implicit Euler"
    }

    fn order(&self) -> u32 {
        1
    }

    fn step(&mut self, system: &System, state: &mut State, work: &mut Work) -> Result<(), StepError> {
        self.base.clone_from(state);
        self.stage
            .solve(system, self.step_s, &self.base, &mut state.velocities, work)?;
        for (place, velocity) in state.positions.iter_mut().zip(&state.velocities) {
            *place += *velocity * self.step_s;
        }
        sound(state)
    }
}
