//! Symplectic (semi-implicit) Euler with exact damping: a kick, then a drift. Order 1, explicit, one force pass a step.
//!
//! Source: Hairer, Lubich and Wanner, Geometric Numerical Integration (2006), I.1.2. What games call "semi-implicit".

use glam::DVec3;

use super::{Kicks, sound};
use crate::{
    method::{Method, StepError},
    system::{State, System, Work},
};

/// Symplectic Euler with exact damping.
#[derive(Debug, Clone)]
pub struct SymplecticEuler {
    step_s: f64,
    whole: Kicks,
    forces: Vec<DVec3>,
}

impl SymplecticEuler {
    /// For steps of `step_s`, s, above 0.
    pub fn new(system: &System, step_s: f64) -> SymplecticEuler {
        SymplecticEuler {
            step_s,
            whole: Kicks::new(system, step_s),
            forces: vec![DVec3::ZERO; system.node_count()],
        }
    }
}

impl Method for SymplecticEuler {
    fn name(&self) -> &'static str {
        "symplectic Euler"
    }

    fn order(&self) -> u32 {
        1
    }

    fn step(&mut self, system: &System, state: &mut State, work: &mut Work) -> Result<(), StepError> {
        system.forces(&state.positions, &mut self.forces, work);
        for (node, velocity) in state.velocities.iter_mut().enumerate() {
            *velocity = *velocity * self.whole.kept[node] + self.forces[node] * self.whole.gained[node];
            state.positions[node] += *velocity * self.step_s;
        }
        sound(state)
    }
}
