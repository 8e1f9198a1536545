//! The backward differentiation formula of order 2: `x1 = (4 x0 - x-1 + 2 h v1) / 3`, velocities alike. Implicit, stable on
//! the whole left half plane, damps high frequencies only.
//!
//! Source: Hairer and Wanner, Solving Ordinary Differential Equations II (1996), section V.1; in cloth Choi and Ko 2002. The
//! first step is one of backward Euler, whose single error of order 2 leaves the whole at order 2.

use super::sound;
use crate::{
    implicit::Stage,
    method::{Method, StepError},
    system::{State, System, Work},
};

/// BDF2.
#[derive(Debug, Clone)]
pub struct Bdf2 {
    step_s: f64,
    stage: Stage,
    base: State,
    before: Option<State>,
}

impl Bdf2 {
    /// For steps of `step_s`, s, above 0, solved to `tolerance`; see [`Stage::new`].
    pub fn new(step_s: f64, tolerance: f64) -> Bdf2 {
        Bdf2 {
            step_s,
            stage: Stage::new(tolerance),
            base: State::default(),
            before: None,
        }
    }
}

impl Method for Bdf2 {
    fn name(&self) -> &'static str {
        "BDF2"
    }

    fn order(&self) -> u32 {
        2
    }

    fn step(&mut self, system: &System, state: &mut State, work: &mut Work) -> Result<(), StepError> {
        let now = state.clone();
        self.base.clone_from(state);
        let mut length_s = self.step_s;
        if let Some(before) = &self.before {
            length_s *= 2.0 / 3.0;
            let pairs = self.base.positions.iter_mut().zip(&before.positions);
            for (value, before) in pairs.chain(self.base.velocities.iter_mut().zip(&before.velocities)) {
                *value = (*value * 4.0 - *before) / 3.0;
            }
        }
        self.stage
            .solve(system, length_s, &self.base, &mut state.velocities, work)?;
        for (node, place) in state.positions.iter_mut().enumerate() {
            *place = self.base.positions[node] + state.velocities[node] * length_s;
        }
        self.before = Some(now);
        sound(state)
    }
}
