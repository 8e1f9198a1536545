//! Keyboard and mouse as a stream of instrument states.
//!
//! Frames and fixed steps keep no step: between two fixed steps there may be no frame or several. [`LiveInput`] stands
//! between them: each frame adds what happened, each fixed step takes it. A click that begins and ends between two steps
//! still lasts one step, and a mouse movement is never counted twice.

use bevy::input::mouse::{AccumulatedMouseMotion, AccumulatedMouseScroll, MouseScrollUnit};
use bevy::prelude::*;

use crate::{
    BoundInput, InstrumentAction, InstrumentBindings, InstrumentField, InstrumentLimits, InstrumentState, NotFinite,
};

/// How far the request may run ahead of the instrument, as time at full speed. A mouse flicked faster than the instrument
/// moves is followed for this long and no longer, so that the hand never waits for the instrument.
const LONGEST_LAG_S: f32 = 0.1;

/// What keyboard and mouse did since the last fixed step.
#[derive(Resource, Reflect, Debug, Clone, PartialEq)]
#[reflect(Resource, Default)]
pub struct LiveInput {
    /// Whether keyboard and mouse drive the instrument. A game clears it while a menu has them; all keys then count as up.
    pub captured: bool,
    held: [bool; InstrumentAction::ALL.len()],
    tapped: [bool; InstrumentAction::ALL.len()],
    moved: [f32; InstrumentField::ALL.len()],
}

impl Default for LiveInput {
    fn default() -> Self {
        LiveInput {
            captured: true,
            held: default(),
            tapped: default(),
            moved: default(),
        }
    }
}

/// What one fixed step takes from [`LiveInput`].
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct LiveCommand {
    /// Change of each field of [`InstrumentField::ALL`], in the field's unit.
    pub change: [f32; InstrumentField::ALL.len()],
    /// Whether the cutting pedal is down.
    pub cut: bool,
    /// Whether the coagulation pedal is down.
    pub coagulate: bool,
}

/// The devices in one frame. A device that the app lacks is `None`.
#[derive(Debug, Clone, Copy, Default)]
pub struct Devices<'a> {
    /// Keys.
    pub keys: Option<&'a ButtonInput<KeyCode>>,
    /// Mouse buttons.
    pub buttons: Option<&'a ButtonInput<MouseButton>>,
    /// Movement of the mouse, pixels; `y` grows downwards.
    pub mouse: Vec2,
    /// Turn of the wheel, lines; positive is away from the operator.
    pub wheel: f32,
}

impl LiveInput {
    /// Adds what happened in a frame.
    pub fn add_frame(&mut self, devices: &Devices, bindings: &InstrumentBindings) {
        self.held = default();
        if !self.captured {
            self.tapped = default();
            self.moved = default();
            return;
        }
        for row in &bindings.rows {
            for &input in &row.inputs {
                self.held[row.action.index()] |= devices.is_held(input);
                self.tapped[row.action.index()] |= devices.was_tapped(input);
                if let Some((field, sign)) = row.action.movement() {
                    let speed = bindings.speed(field);
                    let moved = devices.pixels(input) * speed.per_pixel + devices.lines(input) * speed.per_line;
                    self.moved[field as usize] += sign * moved;
                }
            }
        }
    }

    /// Takes what a fixed step of `dt_s` seconds is to do. Held keys stay held; clicks and movements are used up.
    pub fn take_step(&mut self, bindings: &InstrumentBindings, dt_s: f32) -> LiveCommand {
        let tapped = std::mem::take(&mut self.tapped);
        let mut change = std::mem::take(&mut self.moved);
        let is_active = |action: InstrumentAction| self.held[action.index()] || tapped[action.index()];
        for action in InstrumentAction::ALL.into_iter().filter(|&action| is_active(action)) {
            if let Some((field, sign)) = action.movement() {
                change[field as usize] += sign * bindings.speed(field).held_per_s * dt_s;
            }
        }
        LiveCommand {
            change,
            cut: is_active(InstrumentAction::Cut),
            coagulate: is_active(InstrumentAction::Coagulate),
        }
    }
}

impl LiveCommand {
    /// The next request: `request` changed by the command, at most a short lag away from `state`.
    ///
    /// # Errors
    /// [`NotFinite`] names a field whose change is NaN or infinite.
    pub fn apply(
        &self,
        request: &InstrumentState,
        state: &InstrumentState,
        limits: &InstrumentLimits,
    ) -> Result<InstrumentState, NotFinite> {
        let mut next = *request;
        for (field, change) in InstrumentField::ALL.into_iter().zip(self.change) {
            next.set(field, next.get(field) + change);
        }
        next.cut = self.cut;
        next.coagulate = self.coagulate;
        limits.advance(state, &next, LONGEST_LAG_S)
    }
}

impl Devices<'_> {
    fn is_held(&self, input: BoundInput) -> bool {
        match input {
            BoundInput::Key(key) => self.keys.is_some_and(|keys| keys.pressed(key)),
            BoundInput::Button(button) => self.buttons.is_some_and(|buttons| buttons.pressed(button)),
            _ => false,
        }
    }

    fn was_tapped(&self, input: BoundInput) -> bool {
        match input {
            BoundInput::Key(key) => self.keys.is_some_and(|keys| keys.just_pressed(key)),
            BoundInput::Button(button) => self.buttons.is_some_and(|buttons| buttons.just_pressed(button)),
            _ => false,
        }
    }

    /// How far the mouse moved the input's way; negative for the opposite way is left to the opposite input.
    fn pixels(&self, input: BoundInput) -> f32 {
        match input {
            BoundInput::MouseUp => (-self.mouse.y).max(0.0),
            BoundInput::MouseDown => self.mouse.y.max(0.0),
            BoundInput::MouseLeft => (-self.mouse.x).max(0.0),
            BoundInput::MouseRight => self.mouse.x.max(0.0),
            _ => 0.0,
        }
    }

    fn lines(&self, input: BoundInput) -> f32 {
        match input {
            BoundInput::WheelUp => self.wheel.max(0.0),
            BoundInput::WheelDown => (-self.wheel).max(0.0),
            _ => 0.0,
        }
    }
}

/// Adds the frame's input. Without Bevy's input plugin there is none.
pub(crate) fn gather_live_input(
    mut live: ResMut<LiveInput>,
    bindings: Res<InstrumentBindings>,
    keys: Option<Res<ButtonInput<KeyCode>>>,
    buttons: Option<Res<ButtonInput<MouseButton>>>,
    mouse: Option<Res<AccumulatedMouseMotion>>,
    wheel: Option<Res<AccumulatedMouseScroll>>,
) {
    let wheel = wheel.map_or(0.0, |wheel| match wheel.unit {
        MouseScrollUnit::Line => wheel.delta.y,
        MouseScrollUnit::Pixel => wheel.delta.y / MouseScrollUnit::SCROLL_UNIT_CONVERSION_FACTOR,
    });
    let devices = Devices {
        keys: keys.as_deref(),
        buttons: buttons.as_deref(),
        mouse: mouse.map_or(Vec2::ZERO, |mouse| mouse.delta),
        wheel,
    };
    live.add_frame(&devices, &bindings);
}
