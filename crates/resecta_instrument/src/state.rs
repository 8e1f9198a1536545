//! What the operator's hands and feet hold the instrument at: five numbers, two taps and two pedals.

use bevy::prelude::*;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// The state of the instrument at one step: where the hands hold it and which pedal is down.
///
/// This is all that moves between an input source and the instrument; pose, collision parts and the view follow from it
/// through [`Resectoscope`](crate::Resectoscope).
#[derive(Component, Reflect, Serialize, Deserialize, JsonSchema, Debug, Clone, Copy, PartialEq, Default)]
#[reflect(Component, Default)]
#[serde(deny_unknown_fields, default)]
pub struct InstrumentState {
    /// Distance from the pivot to the sheath's tip along the sheath, mm; grows towards the bladder.
    pub insertion_mm: f32,
    /// Angle that raises the tip towards anterior (12 o'clock), degrees.
    pub pitch_deg: f32,
    /// Angle that turns the tip to the operator's right (3 o'clock, the patient's left), degrees.
    pub yaw_deg: f32,
    /// Turn about the sheath's axis, degrees; positive is clockwise as the operator sees it (12 towards 3 o'clock).
    pub roll_deg: f32,
    /// How far the loop is pushed out beyond the sheath's tip, mm.
    pub stroke_mm: f32,
    /// How far the tap on the sheath's inflow is open, 0 (closed) to 1. Moves water only where there is some.
    #[schemars(range(min = 0.0, max = 1.0))]
    pub inflow_tap: f32,
    /// How far the tap on the sheath's outflow is open, 0 (closed) to 1.
    #[schemars(range(min = 0.0, max = 1.0))]
    pub outflow_tap: f32,
    /// Whether the cutting pedal is down.
    pub cut: bool,
    /// Whether the coagulation pedal is down.
    pub coagulate: bool,
}

impl InstrumentState {
    /// The value of a field, in the field's unit.
    pub fn get(&self, field: InstrumentField) -> f32 {
        match field {
            InstrumentField::Insertion => self.insertion_mm,
            InstrumentField::Pitch => self.pitch_deg,
            InstrumentField::Yaw => self.yaw_deg,
            InstrumentField::Roll => self.roll_deg,
            InstrumentField::Stroke => self.stroke_mm,
            InstrumentField::InflowTap => self.inflow_tap,
            InstrumentField::OutflowTap => self.outflow_tap,
        }
    }

    /// Sets a field to a value in the field's unit.
    pub fn set(&mut self, field: InstrumentField, value: f32) {
        match field {
            InstrumentField::Insertion => self.insertion_mm = value,
            InstrumentField::Pitch => self.pitch_deg = value,
            InstrumentField::Yaw => self.yaw_deg = value,
            InstrumentField::Roll => self.roll_deg = value,
            InstrumentField::Stroke => self.stroke_mm = value,
            InstrumentField::InflowTap => self.inflow_tap = value,
            InstrumentField::OutflowTap => self.outflow_tap = value,
        }
    }

    /// The same with the taps of another.
    #[must_use]
    pub fn with_taps_of(self, other: &InstrumentState) -> Self {
        InstrumentState {
            inflow_tap: other.inflow_tap,
            outflow_tap: other.outflow_tap,
            ..self
        }
    }

    /// A share (0 to 1) of the way to another state, whose pedals it has.
    #[must_use]
    pub fn towards(&self, other: &InstrumentState, share: f32) -> Self {
        let mut between = *other;
        for field in InstrumentField::ALL {
            between.set(field, self.get(field).lerp(other.get(field), share));
        }
        between
    }

    /// The first field that is NaN or infinite, with its value.
    pub fn first_not_finite(&self) -> Option<(InstrumentField, f32)> {
        InstrumentField::ALL
            .into_iter()
            .map(|field| (field, self.get(field)))
            .find(|(_, value)| !value.is_finite())
    }
}

/// One of the numbers of an [`InstrumentState`].
#[derive(Reflect, Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum InstrumentField {
    /// `insertion_mm`
    Insertion,
    /// `pitch_deg`
    Pitch,
    /// `yaw_deg`
    Yaw,
    /// `roll_deg`
    Roll,
    /// `stroke_mm`
    Stroke,
    /// `inflow_tap`
    InflowTap,
    /// `outflow_tap`
    OutflowTap,
}

impl InstrumentField {
    /// Every field, in the order of the columns of a recording.
    pub const ALL: [InstrumentField; 7] = [
        InstrumentField::Insertion,
        InstrumentField::Pitch,
        InstrumentField::Yaw,
        InstrumentField::Roll,
        InstrumentField::Stroke,
        InstrumentField::InflowTap,
        InstrumentField::OutflowTap,
    ];

    /// The two taps, the last of [`InstrumentField::ALL`].
    pub const TAPS: [InstrumentField; 2] = [InstrumentField::InflowTap, InstrumentField::OutflowTap];

    /// The field's name in [`InstrumentState`], in scripts and in recordings; it ends in the unit, but for a tap's, which has
    /// none.
    pub const fn name(self) -> &'static str {
        match self {
            InstrumentField::Insertion => "insertion_mm",
            InstrumentField::Pitch => "pitch_deg",
            InstrumentField::Yaw => "yaw_deg",
            InstrumentField::Roll => "roll_deg",
            InstrumentField::Stroke => "stroke_mm",
            InstrumentField::InflowTap => "inflow_tap",
            InstrumentField::OutflowTap => "outflow_tap",
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_state_between_two_has_the_pedals_of_the_later_one() {
        let earlier = InstrumentState {
            insertion_mm: 10.0,
            roll_deg: -20.0,
            outflow_tap: 1.0,
            ..InstrumentState::default()
        };
        let later = InstrumentState {
            insertion_mm: 14.0,
            roll_deg: 20.0,
            cut: true,
            ..InstrumentState::default()
        };
        let between = earlier.towards(&later, 0.25);
        assert_eq!((between.insertion_mm, between.roll_deg), (11.0, -10.0));
        assert_eq!((between.outflow_tap, between.cut), (0.75, true));
        assert_eq!(earlier.towards(&later, 1.0), later);
    }
}
