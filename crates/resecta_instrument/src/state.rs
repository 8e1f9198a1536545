//! What the operator's hands and feet hold the instrument at: five numbers and two pedals.

use bevy::prelude::*;
use serde::{Deserialize, Serialize};

/// The state of the instrument at one step: where the hands hold it and which pedal is down.
///
/// This is all that moves between an input source and the instrument; pose, collision parts and the view follow from it
/// through [`Resectoscope`](crate::Resectoscope).
#[derive(Component, Reflect, Serialize, Deserialize, Debug, Clone, Copy, PartialEq, Default)]
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
        }
    }

    /// The first field that is NaN or infinite, with its value.
    pub fn first_not_finite(&self) -> Option<(InstrumentField, f32)> {
        InstrumentField::ALL
            .into_iter()
            .map(|field| (field, self.get(field)))
            .find(|(_, value)| !value.is_finite())
    }
}

/// One of the five numbers of an [`InstrumentState`].
#[derive(Reflect, Debug, Clone, Copy, PartialEq, Eq)]
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
}

impl InstrumentField {
    /// Every field, in the order of the columns of a recording.
    pub const ALL: [InstrumentField; 5] = [
        InstrumentField::Insertion,
        InstrumentField::Pitch,
        InstrumentField::Yaw,
        InstrumentField::Roll,
        InstrumentField::Stroke,
    ];

    /// The field's name in [`InstrumentState`], in scripts and in recordings; it ends in the unit.
    pub const fn name(self) -> &'static str {
        match self {
            InstrumentField::Insertion => "insertion_mm",
            InstrumentField::Pitch => "pitch_deg",
            InstrumentField::Yaw => "yaw_deg",
            InstrumentField::Roll => "roll_deg",
            InstrumentField::Stroke => "stroke_mm",
        }
    }
}
