//! The loop on the capsule with current on: the mistake that every resection avoids.

use bevy::prelude::*;

use super::{StepObservation, removal::share};

/// Time off the capsule after which the next touch counts anew, s: a chattering contact is one touch (our choice).
const APART_S: f64 = 0.25;

/// Touches and cuts of the capsule so far.
#[derive(Reflect, Debug, Clone, PartialEq, Default)]
pub struct CapsuleTouches {
    /// Separate touches with current on, at least 0.25 s apart.
    pub touches: u32,
    /// Time on the capsule with current on, s.
    pub time_s: f64,
    /// Area of capsule cut out, mm².
    pub cut_mm2: f64,
    /// Area of the whole capsule at rest, mm².
    pub total_mm2: f64,
    /// Time since the last touch, s; none before the first.
    since_touch_s: Option<f64>,
}

impl CapsuleTouches {
    /// Takes one step into account. Returns whether a new touch began.
    pub fn observe(&mut self, step: &StepObservation) -> bool {
        self.cut_mm2 += step.capsule_cut_mm2;
        if !step.current_on_capsule {
            self.since_touch_s = self.since_touch_s.map(|since| since + step.step_s);
            return false;
        }
        let begins = self.since_touch_s.is_none_or(|since| since >= APART_S);
        self.touches += u32::from(begins);
        self.time_s += step.step_s;
        self.since_touch_s = Some(0.0);
        begins
    }

    /// Share of the capsule that was cut out, 0 to 1; 0 for a gland without one.
    pub fn cut_share(&self) -> f64 {
        share(self.cut_mm2, self.total_mm2)
    }
}
