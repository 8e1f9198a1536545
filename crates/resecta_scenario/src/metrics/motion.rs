//! Where the tip went, how deep the instrument pressed and how often it was forced.

use bevy::prelude::*;

use super::StepObservation;

/// Motion of the instrument so far.
#[derive(Reflect, Debug, Clone, PartialEq, Default)]
pub struct TipMotion {
    /// Length of the path of the sheath's tip, mm.
    pub path_mm: f64,
    /// Deepest overlap with tissue at the beginning of a step, mm.
    pub largest_depth_mm: f64,
    /// How often tissue tore before it.
    pub false_passages: u32,
    /// Where the tip was after the last step, mm.
    last_tip: Option<Vec3>,
}

impl TipMotion {
    /// Takes one step into account.
    pub fn observe(&mut self, step: &StepObservation) {
        if let Some(last) = self.last_tip {
            self.path_mm += step.tip.as_dvec3().distance(last.as_dvec3());
        }
        self.last_tip = Some(step.tip);
        self.false_passages += step.false_passages;
        self.largest_depth_mm = self.largest_depth_mm.max(step.largest_depth_mm);
    }
}
