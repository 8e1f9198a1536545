//! What the current was used for: cuts, coagulation, or nothing.

use bevy::prelude::*;

use super::StepObservation;

/// Use of the two pedals so far.
#[derive(Reflect, Debug, Clone, PartialEq, Default)]
pub struct CurrentUse {
    /// Time with current on while the loop neither touched nor removed tissue, s; one that is drawn in delivers none, whatever it
    /// touches.
    pub without_contact_s: f64,
    /// Time with the coagulating current on, s. Of both pedals at once, cutting wins.
    pub coagulation_s: f64,
    /// The same with the loop in contact with tissue, s.
    pub coagulation_in_contact_s: f64,
    /// The same within reach of a vessel that bled until then, s.
    pub coagulation_on_vessel_s: f64,
    /// Presses of the cutting pedal that removed tissue.
    pub strokes: u32,
    /// Whether the present press of the cutting pedal has removed tissue already.
    stroke_counted: bool,
}

impl CurrentUse {
    /// Takes one step into account.
    pub fn observe(&mut self, step: &StepObservation) {
        if step.current() && !step.current_in_tissue {
            self.without_contact_s += step.step_s;
        }
        if step.instrument.coagulate && !step.instrument.cut {
            self.coagulation_s += step.step_s;
            if step.current_in_tissue {
                self.coagulation_in_contact_s += step.step_s;
            }
            if step.coagulates_vessel {
                self.coagulation_on_vessel_s += step.step_s;
            }
        }
        if !step.instrument.cut {
            self.stroke_counted = false;
        } else if step.removed_mm3 > 0.0 && !self.stroke_counted {
            self.stroke_counted = true;
            self.strokes += 1;
        }
    }
}
