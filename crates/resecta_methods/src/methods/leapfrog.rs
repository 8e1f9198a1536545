//! Leapfrog (velocity Verlet) with exact damping: half a kick, a drift, half a kick. Order 2, explicit, one force pass a step.
//!
//! Source: Störmer, Verlet; Hairer, Lubich and Wanner, Acta Numerica 2003, equation (1.4). Damping is integrated exactly with
//! the force in each half kick, which keeps the step symmetric and so its order. Stable for `h < 2 / w` and beyond with
//! damping. The product's own solver makes the same step in single precision.

use glam::DVec3;

use super::{Kicks, sound};
use crate::{
    method::{Method, StepError},
    system::{State, System, Work},
};

/// Leapfrog with exact damping.
#[derive(Debug, Clone)]
pub struct Leapfrog {
    step_s: f64,
    half: Kicks,
    forces: Vec<DVec3>,
    begun: bool,
}

impl Leapfrog {
    /// For steps of `step_s`, s, above 0.
    pub fn new(system: &System, step_s: f64) -> Leapfrog {
        Leapfrog {
            step_s,
            half: Kicks::new(system, 0.5 * step_s),
            forces: vec![DVec3::ZERO; system.node_count()],
            begun: false,
        }
    }

    fn kick(&self, velocities: &mut [DVec3]) {
        for (node, velocity) in velocities.iter_mut().enumerate() {
            *velocity = *velocity * self.half.kept[node] + self.forces[node] * self.half.gained[node];
        }
    }
}

impl Method for Leapfrog {
    fn name(&self) -> &'static str {
        "leapfrog"
    }

    fn order(&self) -> u32 {
        2
    }

    fn step(&mut self, system: &System, state: &mut State, work: &mut Work) -> Result<(), StepError> {
        if !self.begun {
            system.forces(&state.positions, &mut self.forces, work);
            self.begun = true;
        }
        self.kick(&mut state.velocities);
        for (place, velocity) in state.positions.iter_mut().zip(&state.velocities) {
            *place += *velocity * self.step_s;
        }
        system.forces(&state.positions, &mut self.forces, work);
        self.kick(&mut state.velocities);
        sound(state)
    }
}
