//! How far the simulation itself was off: tissue inside of steel, and elements inside out. No fault of the player's.

use bevy::prelude::*;
use serde::Serialize;

use super::StepObservation;

/// Overlaps that count as seen, mm: what a lens shows of a sheath in tissue (ours).
const SEEN_MM: f32 = 0.5;

/// Errors of contact and of elements so far.
#[derive(Reflect, Serialize, Debug, Clone, Copy, PartialEq, Default)]
pub struct ContactError {
    /// Deepest that tissue lay inside of the instrument when a step began, mm.
    pub deepest_overlap_mm: f32,
    /// Steps that began with more than 0.5 mm of it.
    pub steps_above_half_mm: u64,
    /// Most pentahedra without volume or turned inside out in a step.
    pub most_inverted: u32,
    /// Longest time in which no step was without one, s.
    pub longest_inverted_s: f64,
    /// How long there has been one, s.
    #[serde(skip)]
    inverted_for_s: f64,
}

impl ContactError {
    /// Takes one step into account.
    pub fn observe(&mut self, step: &StepObservation) {
        let overlap_mm = step.overlap.deepest_mm;
        self.deepest_overlap_mm = self.deepest_overlap_mm.max(overlap_mm);
        self.steps_above_half_mm += u64::from(overlap_mm > SEEN_MM);
        self.most_inverted = self.most_inverted.max(step.inverted);
        self.inverted_for_s = match step.inverted {
            0 => 0.0,
            _ => self.inverted_for_s + step.step_s,
        };
        self.longest_inverted_s = self.longest_inverted_s.max(self.inverted_for_s);
    }
}

#[cfg(test)]
mod tests {
    use resecta_tissue::Overlap;

    use super::*;

    #[test]
    fn the_worst_of_a_run_is_kept() {
        let mut error = ContactError::default();
        for (deepest_mm, inverted) in [(0.1, 0), (0.7, 2), (0.6, 1), (0.2, 0), (0.3, 1)] {
            let overlap = Overlap {
                deepest_mm,
                ..Overlap::default()
            };
            error.observe(&StepObservation {
                step_s: 0.5,
                overlap,
                inverted,
                ..StepObservation::default()
            });
        }
        let of_run = ContactError {
            deepest_overlap_mm: 0.7,
            steps_above_half_mm: 2,
            most_inverted: 2,
            longest_inverted_s: 1.0,
            inverted_for_s: 0.5,
        };
        assert_eq!(error, of_run);
    }
}
