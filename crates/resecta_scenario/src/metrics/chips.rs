//! Where the cut tissue is: still in the body, or flushed out.

use bevy::prelude::*;

use super::StepObservation;

/// Masses of chips now.
#[derive(Reflect, Debug, Clone, Copy, PartialEq, Default)]
pub struct ChipMasses {
    /// In the body, g.
    pub in_body_g: f64,
    /// Flushed out, g.
    pub flushed_g: f64,
}

impl ChipMasses {
    /// Takes one step into account.
    pub fn observe(&mut self, step: &StepObservation) {
        *self = step.chips;
    }
}
