//! Which key, button or movement does what: the one table that the live input follows and that the help is read from.

use std::fmt;

use bevy::prelude::*;

use crate::InstrumentField;

/// Something that the operator can do with the instrument.
#[derive(Reflect, Debug, Clone, Copy, PartialEq, Eq)]
pub enum InstrumentAction {
    /// Push the sheath towards the bladder.
    Advance,
    /// Pull the sheath back.
    Withdraw,
    /// Raise the tip, towards 12 o'clock.
    TipUp,
    /// Lower the tip, towards 6 o'clock.
    TipDown,
    /// Turn the tip to the operator's left, towards 9 o'clock.
    TipLeft,
    /// Turn the tip to the operator's right, towards 3 o'clock.
    TipRight,
    /// Roll counter-clockwise.
    RollLeft,
    /// Roll clockwise.
    RollRight,
    /// Push the loop out.
    LoopOut,
    /// Pull the loop in.
    LoopIn,
    /// Cutting pedal.
    Cut,
    /// Coagulation pedal.
    Coagulate,
}

impl InstrumentAction {
    /// Every action, in the order of the help.
    pub const ALL: [InstrumentAction; 12] = [
        InstrumentAction::Advance,
        InstrumentAction::Withdraw,
        InstrumentAction::TipUp,
        InstrumentAction::TipDown,
        InstrumentAction::TipLeft,
        InstrumentAction::TipRight,
        InstrumentAction::RollLeft,
        InstrumentAction::RollRight,
        InstrumentAction::LoopOut,
        InstrumentAction::LoopIn,
        InstrumentAction::Cut,
        InstrumentAction::Coagulate,
    ];

    /// A dense index, the place in [`InstrumentAction::ALL`].
    pub const fn index(self) -> usize {
        self as usize
    }

    /// The field that the action moves and in which sense; nothing for a pedal.
    pub const fn movement(self) -> Option<(InstrumentField, f32)> {
        match self {
            InstrumentAction::Advance => Some((InstrumentField::Insertion, 1.0)),
            InstrumentAction::Withdraw => Some((InstrumentField::Insertion, -1.0)),
            InstrumentAction::TipUp => Some((InstrumentField::Pitch, 1.0)),
            InstrumentAction::TipDown => Some((InstrumentField::Pitch, -1.0)),
            InstrumentAction::TipLeft => Some((InstrumentField::Yaw, -1.0)),
            InstrumentAction::TipRight => Some((InstrumentField::Yaw, 1.0)),
            InstrumentAction::RollLeft => Some((InstrumentField::Roll, -1.0)),
            InstrumentAction::RollRight => Some((InstrumentField::Roll, 1.0)),
            InstrumentAction::LoopOut => Some((InstrumentField::Stroke, 1.0)),
            InstrumentAction::LoopIn => Some((InstrumentField::Stroke, -1.0)),
            InstrumentAction::Cut | InstrumentAction::Coagulate => None,
        }
    }

    /// What the help calls it.
    pub const fn label(self) -> &'static str {
        match self {
            InstrumentAction::Advance => "Advance the sheath",
            InstrumentAction::Withdraw => "Withdraw the sheath",
            InstrumentAction::TipUp => "Tip up",
            InstrumentAction::TipDown => "Tip down",
            InstrumentAction::TipLeft => "Tip left",
            InstrumentAction::TipRight => "Tip right",
            InstrumentAction::RollLeft => "Roll counter-clockwise",
            InstrumentAction::RollRight => "Roll clockwise",
            InstrumentAction::LoopOut => "Loop out",
            InstrumentAction::LoopIn => "Loop in",
            InstrumentAction::Cut => "Cutting pedal",
            InstrumentAction::Coagulate => "Coagulation pedal",
        }
    }
}

/// A key, a button, or a way of moving mouse or wheel.
#[derive(Reflect, Debug, Clone, Copy, PartialEq, Eq)]
pub enum BoundInput {
    /// A key, held.
    Key(KeyCode),
    /// A mouse button, held.
    Button(MouseButton),
    /// Mouse moved up. Movements drive movements only: bound to a pedal they do nothing.
    MouseUp,
    /// Mouse moved down.
    MouseDown,
    /// Mouse moved to the left.
    MouseLeft,
    /// Mouse moved to the right.
    MouseRight,
    /// Wheel turned away from the operator.
    WheelUp,
    /// Wheel turned towards the operator.
    WheelDown,
}

impl fmt::Display for BoundInput {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            BoundInput::Key(key) => formatter.write_str(&words(&format!("{key:?}"))),
            BoundInput::Button(button) => {
                write!(formatter, "{} mouse button", words(&format!("{button:?}")))
            }
            BoundInput::MouseUp => formatter.write_str("Mouse up"),
            BoundInput::MouseDown => formatter.write_str("Mouse down"),
            BoundInput::MouseLeft => formatter.write_str("Mouse left"),
            BoundInput::MouseRight => formatter.write_str("Mouse right"),
            BoundInput::WheelUp => formatter.write_str("Wheel up"),
            BoundInput::WheelDown => formatter.write_str("Wheel down"),
        }
    }
}

/// `KeyW` as `W`, `Digit1` as `1`, `ShiftLeft` as `Shift Left`.
fn words(name: &str) -> String {
    let name = name
        .strip_prefix("Key")
        .or_else(|| name.strip_prefix("Digit"))
        .unwrap_or(name);
    let mut words = String::new();
    for (index, letter) in name.char_indices() {
        if index > 0 && letter.is_uppercase() {
            words.push(' ');
        }
        words.push(letter);
    }
    words
}

/// How much of a field's unit each kind of input moves.
#[derive(Reflect, Debug, Clone, Copy, PartialEq)]
pub struct LiveSpeed {
    /// By a held key or button, a second.
    pub held_per_s: f32,
    /// By the mouse, a pixel.
    pub per_pixel: f32,
    /// By the wheel, a line.
    pub per_line: f32,
}

/// One row of the table.
#[derive(Reflect, Debug, Clone, PartialEq)]
pub struct InstrumentBinding {
    /// What is done.
    pub action: InstrumentAction,
    /// What does it; any of these.
    pub inputs: Vec<BoundInput>,
}

/// The table of bindings, and how fast they move the instrument.
#[derive(Resource, Reflect, Debug, Clone, PartialEq)]
#[reflect(Resource, Default)]
pub struct InstrumentBindings {
    /// The rows, in the order of the help.
    pub rows: Vec<InstrumentBinding>,
    /// mm.
    pub insertion: LiveSpeed,
    /// Degrees; pitch and yaw.
    pub tilt: LiveSpeed,
    /// Degrees.
    pub roll: LiveSpeed,
    /// mm.
    pub stroke: LiveSpeed,
}

impl Default for InstrumentBindings {
    /// Mouse: tip; wheel: insertion; left and right button: the two pedals. W, S, Q, E, the arrows, Space, left Shift, F
    /// and C do the same without a mouse.
    ///
    /// Keys move well below the limits, so that a hand can stop where it means to: insertion at 30 of 200 mm/s, the loop
    /// at 30 mm/s, the middle of the cutting pulls of practice (10 to 50 mm/s).
    fn default() -> Self {
        use BoundInput::{Button, Key};
        use InstrumentAction as Action;
        let row = |action, inputs: &[BoundInput]| InstrumentBinding {
            action,
            inputs: inputs.to_vec(),
        };
        InstrumentBindings {
            rows: vec![
                row(Action::Advance, &[Key(KeyCode::KeyW), BoundInput::WheelUp]),
                row(Action::Withdraw, &[Key(KeyCode::KeyS), BoundInput::WheelDown]),
                row(Action::TipUp, &[BoundInput::MouseUp, Key(KeyCode::ArrowUp)]),
                row(Action::TipDown, &[BoundInput::MouseDown, Key(KeyCode::ArrowDown)]),
                row(Action::TipLeft, &[BoundInput::MouseLeft, Key(KeyCode::ArrowLeft)]),
                row(Action::TipRight, &[BoundInput::MouseRight, Key(KeyCode::ArrowRight)]),
                row(Action::RollLeft, &[Key(KeyCode::KeyQ)]),
                row(Action::RollRight, &[Key(KeyCode::KeyE)]),
                row(Action::LoopOut, &[Key(KeyCode::Space)]),
                row(Action::LoopIn, &[Key(KeyCode::ShiftLeft)]),
                row(Action::Cut, &[Button(MouseButton::Left), Key(KeyCode::KeyF)]),
                row(Action::Coagulate, &[Button(MouseButton::Right), Key(KeyCode::KeyC)]),
            ],
            insertion: LiveSpeed {
                held_per_s: 30.0,
                per_pixel: 0.1,
                per_line: 2.0,
            },
            tilt: LiveSpeed {
                held_per_s: 15.0,
                per_pixel: 0.05,
                per_line: 1.0,
            },
            roll: LiveSpeed {
                held_per_s: 60.0,
                per_pixel: 0.3,
                per_line: 5.0,
            },
            stroke: LiveSpeed {
                held_per_s: 30.0,
                per_pixel: 0.1,
                per_line: 2.0,
            },
        }
    }
}

impl InstrumentBindings {
    /// How fast a field is moved.
    pub fn speed(&self, field: InstrumentField) -> &LiveSpeed {
        match field {
            InstrumentField::Insertion => &self.insertion,
            InstrumentField::Pitch | InstrumentField::Yaw => &self.tilt,
            InstrumentField::Roll => &self.roll,
            InstrumentField::Stroke => &self.stroke,
        }
    }

    /// The help, a row an action: what is done, and what does it.
    pub fn help(&self) -> Vec<(&'static str, String)> {
        self.rows
            .iter()
            .map(|row| {
                let inputs: Vec<String> = row.inputs.iter().map(BoundInput::to_string).collect();
                (row.action.label(), inputs.join(" or "))
            })
            .collect()
    }
}
