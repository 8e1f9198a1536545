//! Keyboard, mouse and gamepads in one frame, and the capture of the next input for a new binding.

use bevy::ecs::system::SystemParam;
use bevy::input::mouse::{AccumulatedMouseMotion, AccumulatedMouseScroll, MouseScrollUnit};
use bevy::prelude::*;

use crate::{BoundInput, LiveFeel};

/// Share of its way from which a stick counts as pressed.
const PRESSED: f32 = 0.5;

/// Pixels that the mouse goes one way before a capture takes that for what is meant.
const CAPTURED_PIXELS: f32 = 200.0;

/// The devices in one frame. A device that the app lacks is absent.
#[derive(Debug, Clone, Default)]
pub struct Devices<'a> {
    /// Keys.
    pub keys: Option<&'a ButtonInput<KeyCode>>,
    /// Mouse buttons.
    pub buttons: Option<&'a ButtonInput<MouseButton>>,
    /// Movement of the mouse, pixels; `y` grows downwards.
    pub mouse: Vec2,
    /// Turn of the wheel, lines; positive is away from the operator.
    pub wheel: f32,
    /// Gamepads; what any of them does counts.
    pub pads: Vec<&'a Gamepad>,
}

/// The devices of an app, whichever of them it has.
#[derive(SystemParam)]
pub struct DeviceParams<'w, 's> {
    keys: Option<Res<'w, ButtonInput<KeyCode>>>,
    buttons: Option<Res<'w, ButtonInput<MouseButton>>>,
    mouse: Option<Res<'w, AccumulatedMouseMotion>>,
    wheel: Option<Res<'w, AccumulatedMouseScroll>>,
    pads: Query<'w, 's, &'static Gamepad>,
}

impl DeviceParams<'_, '_> {
    /// What they do in this frame.
    pub fn devices(&self) -> Devices<'_> {
        let wheel = self.wheel.as_ref().map_or(0.0, |wheel| match wheel.unit {
            MouseScrollUnit::Line => wheel.delta.y,
            MouseScrollUnit::Pixel => wheel.delta.y / MouseScrollUnit::SCROLL_UNIT_CONVERSION_FACTOR,
        });
        Devices {
            keys: self.keys.as_deref(),
            buttons: self.buttons.as_deref(),
            mouse: self.mouse.as_ref().map_or(Vec2::ZERO, |mouse| mouse.delta),
            wheel,
            pads: self.pads.iter().collect(),
        }
    }
}

impl Devices<'_> {
    /// Whether a key or a button of the mouse is held.
    pub(crate) fn is_held(&self, input: BoundInput) -> bool {
        match input {
            BoundInput::Key(key) => self.keys.is_some_and(|keys| keys.pressed(key)),
            BoundInput::Button(button) => self.buttons.is_some_and(|buttons| buttons.pressed(button)),
            _ => false,
        }
    }

    /// Whether it is down as a pedal is. Triggers are where Bevy's settings of the gamepad have them pressed.
    pub(crate) fn is_pressed(&self, input: BoundInput, feel: &LiveFeel) -> bool {
        match input {
            BoundInput::PadButton(button) => self.pads.iter().any(|pad| pad.pressed(button)),
            _ => self.is_held(input) || self.pushed(input, feel) >= PRESSED,
        }
    }

    /// Whether a key or button went down in this frame.
    pub(crate) fn was_tapped(&self, input: BoundInput) -> bool {
        match input {
            BoundInput::Key(key) => self.keys.is_some_and(|keys| keys.just_pressed(key)),
            BoundInput::Button(button) => self.buttons.is_some_and(|buttons| buttons.just_pressed(button)),
            BoundInput::PadButton(button) => self.pads.iter().any(|pad| pad.just_pressed(button)),
            _ => false,
        }
    }

    /// How far a gamepad's button, trigger or stick is pushed the input's way, 0 to 1, as the hand is answered.
    pub(crate) fn pushed(&self, input: BoundInput, feel: &LiveFeel) -> f32 {
        let axis = |axis: GamepadAxis, sign: f32| {
            let inverted = match axis {
                GamepadAxis::LeftStickX | GamepadAxis::RightStickX => feel.inverted.stick_x,
                GamepadAxis::LeftStickY | GamepadAxis::RightStickY => feel.inverted.stick_y,
                _ => false,
            };
            let sign = if inverted { -sign } else { sign };
            move |pad: &Gamepad| feel.answer(sign * pad.get(axis).unwrap_or(0.0))
        };
        match input {
            BoundInput::PadButton(button) => self.furthest(|pad| {
                let digital = if pad.pressed(button) { 1.0 } else { 0.0 };
                // A digital button has no way between; where a backend gives one no value, it is pressed or not.
                pad.get(button).map_or(digital, |amount| feel.answer(amount))
            }),
            BoundInput::PadPositive(stick) => self.furthest(axis(stick, 1.0)),
            BoundInput::PadNegative(stick) => self.furthest(axis(stick, -1.0)),
            _ => 0.0,
        }
    }

    fn furthest(&self, amount: impl Fn(&Gamepad) -> f32) -> f32 {
        self.pads.iter().map(|&pad| amount(pad)).fold(0.0, f32::max)
    }

    /// How far the mouse moved the input's way; negative for the opposite way is left to the opposite input.
    pub(crate) fn pixels(&self, input: BoundInput, feel: &LiveFeel) -> f32 {
        let turned = |inverted: bool, moved: f32| if inverted { -moved } else { moved };
        let x = turned(feel.inverted.mouse_x, self.mouse.x);
        let y = turned(feel.inverted.mouse_y, self.mouse.y);
        match input {
            BoundInput::MouseUp => (-y).max(0.0),
            BoundInput::MouseDown => y.max(0.0),
            BoundInput::MouseLeft => (-x).max(0.0),
            BoundInput::MouseRight => x.max(0.0),
            _ => 0.0,
        }
    }

    /// How far the wheel turned the input's way.
    pub(crate) fn lines(&self, input: BoundInput, feel: &LiveFeel) -> f32 {
        let wheel = if feel.inverted.wheel { -self.wheel } else { self.wheel };
        match input {
            BoundInput::WheelUp => wheel.max(0.0),
            BoundInput::WheelDown => (-wheel).max(0.0),
            _ => 0.0,
        }
    }
}

/// Waits for the next input of the player, who wants it bound.
#[derive(Debug, Clone, Default)]
pub struct InputCapture {
    /// Whether movements of mouse and wheel are taken too.
    pub movements: bool,
    /// Sticks count once they have been let go.
    sticks_were_free: bool,
    moved: Vec2,
}

impl InputCapture {
    /// A capture for an action that moves the instrument (`movements`) or for a pedal.
    pub fn new(movements: bool) -> Self {
        Self { movements, ..default() }
    }

    /// Looks at a frame; gives the input that it waited for. Keys without a name are passed over: they could not be kept.
    pub fn add_frame(&mut self, devices: &Devices) -> Option<BoundInput> {
        let keys = devices.keys.into_iter().flat_map(|keys| keys.get_just_pressed());
        let buttons = devices
            .buttons
            .into_iter()
            .flat_map(|buttons| buttons.get_just_pressed());
        let pads = devices.pads.iter().flat_map(|pad| pad.get_just_pressed());
        let pressed = (keys.map(|&key| BoundInput::Key(key)))
            .chain(buttons.map(|&button| BoundInput::Button(button)))
            .chain(pads.map(|&button| BoundInput::PadButton(button)))
            .find(|input| input.name().is_some());
        pressed
            .or_else(|| self.pushed_stick(devices))
            .or_else(|| self.movement(devices))
    }

    fn pushed_stick(&mut self, devices: &Devices) -> Option<BoundInput> {
        let pushed = GamepadAxis::all().into_iter().find_map(|axis| {
            let amounts = devices.pads.iter().filter_map(|pad| pad.get(axis));
            let furthest = amounts.fold(0.0, |a: f32, b| if b.abs() > a.abs() { b } else { a });
            match furthest {
                amount if amount > PRESSED => Some(BoundInput::PadPositive(axis)),
                amount if amount < -PRESSED => Some(BoundInput::PadNegative(axis)),
                _ => None,
            }
        });
        self.sticks_were_free |= pushed.is_none();
        pushed.filter(|_| self.sticks_were_free)
    }

    fn movement(&mut self, devices: &Devices) -> Option<BoundInput> {
        if !self.movements {
            return None;
        }
        self.moved += devices.mouse;
        let Vec2 { x, y } = self.moved;
        let rows = [
            (BoundInput::WheelUp, devices.wheel > 0.0),
            (BoundInput::WheelDown, devices.wheel < 0.0),
            (BoundInput::MouseRight, x > CAPTURED_PIXELS),
            (BoundInput::MouseLeft, x < -CAPTURED_PIXELS),
            (BoundInput::MouseDown, y > CAPTURED_PIXELS),
            (BoundInput::MouseUp, y < -CAPTURED_PIXELS),
        ];
        rows.into_iter().find(|row| row.1).map(|row| row.0)
    }
}
