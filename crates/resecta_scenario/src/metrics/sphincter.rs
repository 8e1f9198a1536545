//! The loop with current on below the verumontanum, where the external sphincter begins: the injury that leaves a patient
//! incontinent.

use bevy::prelude::*;

use super::StepObservation;

/// Time away after which the next touch is an injury of its own, s: a chattering contact is one (our choice).
const APART_S: f64 = 0.25;

/// Injuries so far.
#[derive(Reflect, Debug, Clone, PartialEq, Default)]
pub struct SphincterInjuries {
    /// Separate ones, at least 0.25 s apart.
    pub injuries: u32,
    /// Time below the verumontanum with current on, s.
    pub time_s: f64,
    /// Time since the last one, s; none before the first.
    since_s: Option<f64>,
}

impl SphincterInjuries {
    /// Takes one step into account.
    pub fn observe(&mut self, step: &StepObservation) {
        if !step.current_below_verumontanum {
            self.since_s = self.since_s.map(|since| since + step.step_s);
            return;
        }
        self.injuries += u32::from(self.since_s.is_none_or(|since| since >= APART_S));
        self.time_s += step.step_s;
        self.since_s = Some(0.0);
    }
}
