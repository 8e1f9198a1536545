//! How the live input answers the hand: sensitivities, inverted axes, the sticks' dead zone and curve, the pedals' way.

use bevy::prelude::*;
use serde::{Deserialize, Serialize};
use thiserror::Error;

/// Which hand holds the mouse: decides the bindings that a player begins with.
#[derive(Reflect, Serialize, Deserialize, Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Handedness {
    /// Mouse in the right hand, keys under the left.
    #[default]
    Right,
    /// Mouse in the left hand, with its buttons changed over, keys under the right; sticks and shoulders changed over.
    Left,
}

/// How a press of a pedal acts.
#[derive(Reflect, Serialize, Deserialize, Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum PedalMode {
    /// Down as long as it is held, as a real one is.
    #[default]
    Hold,
    /// A press puts it down, the next one up; it goes up when the other is pressed, and when a menu takes the keyboard.
    Toggle,
}

/// Axes that act the other way round.
#[derive(Reflect, Serialize, Deserialize, Debug, Clone, Copy, PartialEq, Eq, Default)]
#[serde(deny_unknown_fields, default)]
pub struct InvertedAxes {
    /// Mouse to the left and right.
    pub mouse_x: bool,
    /// Mouse up and down.
    pub mouse_y: bool,
    /// Wheel.
    pub wheel: bool,
    /// Both sticks to the left and right.
    pub stick_x: bool,
    /// Both sticks up and down.
    pub stick_y: bool,
}

/// How the live input answers the hand.
#[derive(Reflect, Serialize, Deserialize, Debug, Clone, Copy, PartialEq)]
#[serde(deny_unknown_fields, default)]
pub struct LiveFeel {
    /// Factor on what the mouse moves, 0.1 to 5.
    pub mouse: f32,
    /// Factor on what the wheel moves, 0.1 to 5.
    pub wheel: f32,
    /// Factor on what held keys move, 0.1 to 5.
    pub keys: f32,
    /// Factor on what sticks and buttons of a gamepad move, 0.1 to 5.
    pub stick: f32,
    /// Share of a stick's or trigger's way that does nothing, 0 to 0.9.
    pub dead_zone: f32,
    /// Exponent of the answer over the rest of the way, 1 (straight) to 4 (finest in the middle).
    pub curve: f32,
    /// Axes that act the other way round.
    pub inverted: InvertedAxes,
    /// How a press of a pedal acts.
    pub pedals: PedalMode,
}

impl Default for LiveFeel {
    /// Factors of 1; a dead zone of 0.15, above what worn sticks rest at, and a square, so that small movements are fine (ours).
    fn default() -> Self {
        LiveFeel {
            mouse: 1.0,
            wheel: 1.0,
            keys: 1.0,
            stick: 1.0,
            dead_zone: 0.15,
            curve: 2.0,
            inverted: InvertedAxes::default(),
            pedals: PedalMode::default(),
        }
    }
}

/// A number of [`LiveFeel`] that is out of its range.
#[derive(Error, Debug, Clone, Copy, PartialEq)]
#[error("{field} is {value}, expected {min} to {max}")]
pub struct FeelError {
    /// The field.
    pub field: &'static str,
    /// Its value.
    pub value: f32,
    /// Smallest value allowed.
    pub min: f32,
    /// Largest value allowed.
    pub max: f32,
}

impl LiveFeel {
    /// The range of the four factors.
    pub const FACTOR: [f32; 2] = [0.1, 5.0];
    /// The range of the dead zone.
    pub const DEAD_ZONE: [f32; 2] = [0.0, 0.9];
    /// The range of the curve.
    pub const CURVE: [f32; 2] = [1.0, 4.0];

    /// The same, if every number is in its range.
    ///
    /// # Errors
    /// [`FeelError`] names the first that is not.
    pub fn checked(self) -> Result<Self, FeelError> {
        let fields = [
            ("mouse", self.mouse, Self::FACTOR),
            ("wheel", self.wheel, Self::FACTOR),
            ("keys", self.keys, Self::FACTOR),
            ("stick", self.stick, Self::FACTOR),
            ("dead_zone", self.dead_zone, Self::DEAD_ZONE),
            ("curve", self.curve, Self::CURVE),
        ];
        match fields
            .into_iter()
            .find(|(_, value, [min, max])| !(*min..=*max).contains(value))
        {
            Some((field, value, [min, max])) => Err(FeelError { field, value, min, max }),
            None => Ok(self),
        }
    }

    /// The answer to a stick or trigger at `amount` of its way: 0 in the dead zone and for what is no number, then
    /// `((amount - dead zone) / (1 - dead zone))^curve`, 1 at most.
    pub fn answer(&self, amount: f32) -> f32 {
        let live = (amount - self.dead_zone) / (1.0 - self.dead_zone);
        if live > 0.0 {
            live.min(1.0).powf(self.curve)
        } else {
            0.0
        }
    }
}
