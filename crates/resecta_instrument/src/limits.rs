//! How far and how fast the instrument moves, whatever its source of input asks for.

use bevy::prelude::*;
use serde::{Deserialize, Serialize};
use thiserror::Error;

use crate::{InstrumentField, InstrumentState};

/// Share by which a step may exceed the fastest one before it is cut short.
///
/// A step cut short and replayed from a recording differs from `max_speed * dt` by the rounding of one addition (below
/// 4e-5 of the step down to a millisecond); without this slack a replay would be cut a second time and lose a bit.
const STEP_SLACK: f32 = 1e-4;

/// Range and fastest change of one field.
#[derive(Reflect, Serialize, Deserialize, Debug, Clone, Copy, PartialEq)]
#[serde(deny_unknown_fields)]
pub struct FieldLimit {
    /// Smallest value, in the field's unit.
    pub min: f32,
    /// Largest value, in the field's unit.
    pub max: f32,
    /// Fastest change, in the field's unit per second.
    pub max_speed: f32,
}

impl FieldLimit {
    const fn new(min: f32, max: f32, max_speed: f32) -> Self {
        FieldLimit { min, max, max_speed }
    }

    /// Whether a value is a number within the range.
    pub fn contains(&self, value: f32) -> bool {
        (self.min..=self.max).contains(&value)
    }

    /// The value of the range that is nearest to `value`.
    fn clamp(&self, value: f32) -> f32 {
        value.max(self.min).min(self.max)
    }

    /// Where `from` gets in `dt_s` seconds on its way to `to`.
    fn advance(&self, from: f32, to: f32, dt_s: f32) -> f32 {
        let target = self.clamp(to);
        let change = target - from;
        let reach = self.max_speed * dt_s;
        if change.abs() <= reach * (1.0 + STEP_SLACK) {
            target
        } else {
            from + reach.copysign(change)
        }
    }
}

/// Ranges and fastest changes of every field. A setting of each [`Resectoscope`](crate::Resectoscope).
#[derive(Reflect, Serialize, Deserialize, Debug, Clone, Copy, PartialEq)]
#[serde(deny_unknown_fields, default)]
pub struct InstrumentLimits {
    /// mm and mm/s.
    pub insertion_mm: FieldLimit,
    /// Degrees and degrees/s.
    pub pitch_deg: FieldLimit,
    /// Degrees and degrees/s.
    pub yaw_deg: FieldLimit,
    /// Degrees and degrees/s.
    pub roll_deg: FieldLimit,
    /// mm and mm/s.
    pub stroke_mm: FieldLimit,
    /// Shares of the way from closed to open, and that share a second.
    pub inflow_tap: FieldLimit,
    /// As above.
    pub outflow_tap: FieldLimit,
}

impl Default for InstrumentLimits {
    /// - insertion -10 to 120 mm at 200 mm/s: from where the lens sees the sphincter's ring (ours), past a prostatic urethra of
    ///   45 mm, well into the bladder; 200 mm/s is the speed up to which collision must not tunnel;
    /// - pitch and yaw ±35° at 90°/s: from a pivot 40 mm away the tip reaches the wall of a lumen 56 mm wide (ours);
    /// - roll ±180° at 270°/s: every hour of the clock (ours);
    /// - stroke 0 to 30 mm at 50 mm/s: the loop's stroke and the fastest cutting pull (practice);
    /// - taps 0 to 1 at 4 a second: a quarter turn of the hand in a quarter of a second (ours).
    fn default() -> Self {
        InstrumentLimits {
            insertion_mm: FieldLimit::new(-10.0, 120.0, 200.0),
            pitch_deg: FieldLimit::new(-35.0, 35.0, 90.0),
            yaw_deg: FieldLimit::new(-35.0, 35.0, 90.0),
            roll_deg: FieldLimit::new(-180.0, 180.0, 270.0),
            stroke_mm: FieldLimit::new(0.0, 30.0, 50.0),
            inflow_tap: FieldLimit::new(0.0, 1.0, 4.0),
            outflow_tap: FieldLimit::new(0.0, 1.0, 4.0),
        }
    }
}

/// A field that is NaN or infinite; nothing was changed.
#[derive(Error, Debug, Clone, Copy, PartialEq)]
#[error("{} is {value}, expected a finite number", field.name())]
pub struct NotFinite {
    /// The first such field.
    pub field: InstrumentField,
    /// Its value.
    pub value: f32,
}

impl InstrumentLimits {
    /// Range and fastest change of a field.
    pub fn of(&self, field: InstrumentField) -> &FieldLimit {
        match field {
            InstrumentField::Insertion => &self.insertion_mm,
            InstrumentField::Pitch => &self.pitch_deg,
            InstrumentField::Yaw => &self.yaw_deg,
            InstrumentField::Roll => &self.roll_deg,
            InstrumentField::Stroke => &self.stroke_mm,
            InstrumentField::InflowTap => &self.inflow_tap,
            InstrumentField::OutflowTap => &self.outflow_tap,
        }
    }

    /// The state within the ranges that is nearest to `state`.
    ///
    /// # Errors
    /// [`NotFinite`] names the first field that is NaN or infinite.
    pub fn clamp(&self, state: &InstrumentState) -> Result<InstrumentState, NotFinite> {
        self.advance(state, state, f32::INFINITY)
    }

    /// The state after `dt_s` seconds on the way from `from` to `to`: within the ranges, no field faster than allowed, the
    /// pedals as in `to`.
    ///
    /// # Errors
    /// [`NotFinite`] names the first field of `to` that is NaN or infinite.
    pub fn advance(
        &self,
        from: &InstrumentState,
        to: &InstrumentState,
        dt_s: f32,
    ) -> Result<InstrumentState, NotFinite> {
        if let Some((field, value)) = to.first_not_finite() {
            return Err(NotFinite { field, value });
        }
        let mut state = *to;
        for field in InstrumentField::ALL {
            state.set(field, self.of(field).advance(from.get(field), to.get(field), dt_s));
        }
        Ok(state)
    }
}
