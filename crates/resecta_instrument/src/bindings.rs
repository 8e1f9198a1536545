//! Which key, button or movement does what: the one table that the live input follows and that the help is read from.

use bevy::prelude::*;

use crate::{BoundInput, Handedness, InstrumentAction, InstrumentField, LiveFeel};

/// How much of a field's unit each kind of input moves.
#[derive(Reflect, Debug, Clone, Copy, PartialEq)]
pub struct LiveSpeed {
    /// By a held key or button, a second.
    pub held_per_s: f32,
    /// By a stick, trigger or button of a gamepad at the end of its way, a second.
    pub pushed_per_s: f32,
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

/// The table of bindings, how fast they move the instrument, and how they answer the hand.
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
    /// Share of the way from closed to open; both taps.
    pub tap: LiveSpeed,
    /// Sensitivities, inverted axes, dead zone, pedals.
    pub feel: LiveFeel,
}

impl Default for InstrumentBindings {
    /// For a mouse in the right hand.
    fn default() -> Self {
        Self::of_hand(Handedness::Right)
    }
}

impl InstrumentBindings {
    /// The bindings that a player begins with.
    ///
    /// Mouse: tip; wheel: insertion; left and right button: the two pedals. W, S, Q, E, the arrows, Space, left Shift, F
    /// and C do the same without a mouse, and 1 to 4 turn the taps. Gamepad: right stick: tip; left stick: insertion and
    /// roll; triggers: loop; shoulders: pedals; cross: taps. With the mouse in the left hand, buttons, sticks, triggers
    /// and shoulders change sides, the arrows advance and roll, and the keys lie at the right of the keyboard.
    ///
    /// Keys move well below the limits, so that a hand can stop where it means to: insertion at 30 of 200 mm/s, the loop
    /// at 30 mm/s, the middle of the cutting pulls of practice (10 to 50 mm/s). A stick can be held halfway, and gets
    /// further at its end. A tap takes a second from closed to open.
    pub fn of_hand(hand: Handedness) -> Self {
        let tilted = LiveSpeed {
            held_per_s: 15.0,
            pushed_per_s: 30.0,
            per_pixel: 0.05,
            per_line: 1.0,
        };
        let pulled = LiveSpeed {
            held_per_s: 30.0,
            pushed_per_s: 45.0,
            per_pixel: 0.1,
            per_line: 2.0,
        };
        InstrumentBindings {
            rows: InstrumentAction::ALL
                .into_iter()
                .map(|action| InstrumentBinding {
                    action,
                    inputs: default_inputs(action, hand),
                })
                .collect(),
            insertion: pulled,
            tilt: tilted,
            roll: LiveSpeed {
                held_per_s: 60.0,
                pushed_per_s: 90.0,
                per_pixel: 0.3,
                per_line: 5.0,
            },
            stroke: pulled,
            tap: LiveSpeed {
                held_per_s: 1.0,
                pushed_per_s: 1.0,
                per_pixel: 0.005,
                per_line: 0.1,
            },
            feel: LiveFeel::default(),
        }
    }

    /// How fast a field is moved.
    pub fn speed(&self, field: InstrumentField) -> &LiveSpeed {
        match field {
            InstrumentField::Insertion => &self.insertion,
            InstrumentField::Pitch | InstrumentField::Yaw => &self.tilt,
            InstrumentField::Roll => &self.roll,
            InstrumentField::Stroke => &self.stroke,
            InstrumentField::InflowTap | InstrumentField::OutflowTap => &self.tap,
        }
    }

    /// What does an action.
    pub fn inputs(&self, action: InstrumentAction) -> impl Iterator<Item = BoundInput> {
        let rows = self.rows.iter().filter(move |row| row.action == action);
        rows.flat_map(|row| row.inputs.iter().copied())
    }

    /// What an input does: one action, unless the same input was bound twice.
    pub fn uses(&self, input: BoundInput) -> impl Iterator<Item = InstrumentAction> {
        let rows = self.rows.iter().filter(move |row| row.inputs.contains(&input));
        rows.map(|row| row.action)
    }

    /// Binds an input to an action in the place of `instead`, or beside the others. Twice is once.
    pub fn bind(&mut self, action: InstrumentAction, input: BoundInput, instead: Option<BoundInput>) {
        let Some(row) = self.rows.iter_mut().find(|row| row.action == action) else {
            let inputs = vec![input];
            self.rows.push(InstrumentBinding { action, inputs });
            return;
        };
        let place = instead.and_then(|instead| row.inputs.iter().position(|&bound| bound == instead));
        match (row.inputs.contains(&input), place) {
            (true, _) => {}
            (false, Some(place)) => row.inputs[place] = input,
            (false, None) => row.inputs.push(input),
        }
    }

    /// Takes an input away from an action.
    pub fn unbind(&mut self, action: InstrumentAction, input: BoundInput) {
        for row in self.rows.iter_mut().filter(|row| row.action == action) {
            row.inputs.retain(|&bound| bound != input);
        }
    }

    /// Binds an action as it is at first.
    pub fn reset(&mut self, action: InstrumentAction, hand: Handedness) {
        for row in self.rows.iter_mut().filter(|row| row.action == action) {
            row.inputs = default_inputs(action, hand);
        }
    }

    /// The help, a row an action: what is done, and which key, button or movement of the mouse does it.
    pub fn help(&self) -> Vec<(&'static str, String)> {
        self.rows_of(|input| !input.is_pad())
    }

    /// The same for a gamepad.
    pub fn pad_help(&self) -> Vec<(&'static str, String)> {
        self.rows_of(BoundInput::is_pad)
    }

    fn rows_of(&self, shown: impl Fn(BoundInput) -> bool) -> Vec<(&'static str, String)> {
        let row = |row: &InstrumentBinding| {
            let inputs = row.inputs.iter().filter(|&&input| shown(input));
            let inputs: Vec<String> = inputs.map(BoundInput::to_string).collect();
            (row.action.label(), inputs.join(" or "))
        };
        self.rows.iter().map(row).collect()
    }
}

fn default_inputs(action: InstrumentAction, hand: Handedness) -> Vec<BoundInput> {
    use BoundInput::{Button, Key, PadButton, PadNegative, PadPositive};
    use InstrumentAction as Action;
    let is_right = hand == Handedness::Right;
    let key = |right: KeyCode, left: KeyCode| Key(if is_right { right } else { left });
    let button = |right, left| Button(if is_right { right } else { left });
    let pad = |right, left| PadButton(if is_right { right } else { left });
    let axis = |right, left| if is_right { right } else { left };
    let (tip_x, tip_y, roll, insertion) = (
        axis(GamepadAxis::RightStickX, GamepadAxis::LeftStickX),
        axis(GamepadAxis::RightStickY, GamepadAxis::LeftStickY),
        axis(GamepadAxis::LeftStickX, GamepadAxis::RightStickX),
        axis(GamepadAxis::LeftStickY, GamepadAxis::RightStickY),
    );
    let (index, middle) = (MouseButton::Left, MouseButton::Right);
    match action {
        Action::Advance => vec![
            key(KeyCode::KeyW, KeyCode::ArrowUp),
            BoundInput::WheelUp,
            PadPositive(insertion),
        ],
        Action::Withdraw => vec![
            key(KeyCode::KeyS, KeyCode::ArrowDown),
            BoundInput::WheelDown,
            PadNegative(insertion),
        ],
        Action::TipUp => vec![
            BoundInput::MouseUp,
            key(KeyCode::ArrowUp, KeyCode::KeyW),
            PadPositive(tip_y),
        ],
        Action::TipDown => vec![
            BoundInput::MouseDown,
            key(KeyCode::ArrowDown, KeyCode::KeyS),
            PadNegative(tip_y),
        ],
        Action::TipLeft => vec![
            BoundInput::MouseLeft,
            key(KeyCode::ArrowLeft, KeyCode::KeyA),
            PadNegative(tip_x),
        ],
        Action::TipRight => vec![
            BoundInput::MouseRight,
            key(KeyCode::ArrowRight, KeyCode::KeyD),
            PadPositive(tip_x),
        ],
        Action::RollLeft => vec![key(KeyCode::KeyQ, KeyCode::ArrowLeft), PadNegative(roll)],
        Action::RollRight => vec![key(KeyCode::KeyE, KeyCode::ArrowRight), PadPositive(roll)],
        Action::LoopOut => vec![
            Key(KeyCode::Space),
            pad(GamepadButton::RightTrigger2, GamepadButton::LeftTrigger2),
        ],
        Action::LoopIn => vec![
            key(KeyCode::ShiftLeft, KeyCode::ShiftRight),
            pad(GamepadButton::LeftTrigger2, GamepadButton::RightTrigger2),
        ],
        Action::Cut => vec![
            button(index, middle),
            key(KeyCode::KeyF, KeyCode::Period),
            pad(GamepadButton::RightTrigger, GamepadButton::LeftTrigger),
        ],
        Action::Coagulate => vec![
            button(middle, index),
            key(KeyCode::KeyC, KeyCode::Comma),
            pad(GamepadButton::LeftTrigger, GamepadButton::RightTrigger),
        ],
        Action::InflowOpen => vec![key(KeyCode::Digit2, KeyCode::Digit8), PadButton(GamepadButton::DPadUp)],
        Action::InflowClose => vec![
            key(KeyCode::Digit1, KeyCode::Digit7),
            PadButton(GamepadButton::DPadDown),
        ],
        Action::OutflowOpen => vec![
            key(KeyCode::Digit4, KeyCode::Digit0),
            PadButton(GamepadButton::DPadRight),
        ],
        Action::OutflowClose => vec![
            key(KeyCode::Digit3, KeyCode::Digit9),
            PadButton(GamepadButton::DPadLeft),
        ],
    }
}
