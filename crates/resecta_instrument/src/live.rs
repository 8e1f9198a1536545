//! Keyboard, mouse and gamepad as a stream of instrument states.
//!
//! Frames and fixed steps keep no step: between two fixed steps there may be no frame or several. [`LiveInput`] stands
//! between them: each frame adds what happened, each fixed step takes it. A click that begins and ends between two steps
//! still lasts one step, and a mouse movement is never counted twice. What is pressed before a fixed step acts in it.

use bevy::prelude::*;

use crate::devices::{DeviceParams, Devices};
use crate::{
    InstrumentAction, InstrumentBindings, InstrumentField, InstrumentLimits, InstrumentState, NotFinite, PedalMode,
};

/// How far the request may run ahead of the instrument, as time at full speed. A mouse flicked faster than the instrument
/// moves is followed for this long and no longer, so that the hand never waits for the instrument.
const LONGEST_LAG_S: f32 = 0.1;

/// The two pedals, the one that goes before first.
const PEDALS: [InstrumentAction; 2] = [InstrumentAction::Cut, InstrumentAction::Coagulate];

/// What keyboard, mouse and gamepad did since the last fixed step.
#[derive(Resource, Reflect, Debug, Clone, PartialEq)]
#[reflect(Resource, Default)]
pub struct LiveInput {
    /// Whether the devices drive the instrument. A game clears it while a menu has them; all keys then count as up, and a
    /// pedal that is held when they come back counts only once it was let go.
    pub captured: bool,
    held: [bool; InstrumentAction::ALL.len()],
    pushed: [f32; InstrumentAction::ALL.len()],
    tapped: [bool; InstrumentAction::ALL.len()],
    moved: [f32; InstrumentField::ALL.len()],
    pedals: [Pedal; PEDALS.len()],
}

/// One of the two pedals.
#[derive(Reflect, Debug, Clone, Copy, PartialEq, Default)]
struct Pedal {
    /// Pressed now.
    held: bool,
    /// Pressed since the devices were a menu's.
    stale: bool,
    /// Down by a press that another press ends.
    toggled: bool,
}

impl Default for LiveInput {
    fn default() -> Self {
        LiveInput {
            captured: true,
            held: default(),
            pushed: default(),
            tapped: default(),
            moved: default(),
            pedals: default(),
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

impl LiveInput {
    /// Adds what happened in a frame.
    pub fn add_frame(&mut self, devices: &Devices, bindings: &InstrumentBindings) {
        let feel = &bindings.feel;
        self.held = default();
        self.pushed = default();
        let mut pressed = [false; PEDALS.len()];
        for row in &bindings.rows {
            let action = row.action.index();
            let pedal = PEDALS.iter().position(|&pedal| pedal == row.action);
            for &input in &row.inputs {
                if let Some(pedal) = pedal {
                    pressed[pedal] |= devices.is_pressed(input, feel);
                }
                self.held[action] |= devices.is_held(input);
                self.tapped[action] |= devices.was_tapped(input);
                self.pushed[action] = self.pushed[action].max(devices.pushed(input, feel));
                if let Some((field, sign)) = row.action.movement() {
                    let speed = bindings.speed(field);
                    let moved = devices.pixels(input, feel) * speed.per_pixel * feel.mouse
                        + devices.lines(input, feel) * speed.per_line * feel.wheel;
                    self.moved[field as usize] += sign * moved;
                }
            }
        }
        self.add_pedals(pressed, feel.pedals);
        if !self.captured {
            *self = LiveInput {
                captured: false,
                pedals: self.pedals,
                ..default()
            };
        }
    }

    fn add_pedals(&mut self, pressed: [bool; PEDALS.len()], mode: PedalMode) {
        for (index, action) in PEDALS.into_iter().enumerate() {
            let is_pressed = pressed[index];
            let before = self.pedals[index];
            let stale = is_pressed && (before.stale || !self.captured);
            let tapped = &mut self.tapped[action.index()];
            *tapped &= !stale;
            let went_down = self.captured && !stale && (*tapped || is_pressed && !before.held);
            let pedal = &mut self.pedals[index];
            pedal.held = is_pressed;
            pedal.stale = stale;
            pedal.toggled &= self.captured && mode == PedalMode::Toggle;
            if went_down && mode == PedalMode::Toggle {
                pedal.toggled = !pedal.toggled;
                *tapped = false;
                if pedal.toggled {
                    self.pedals[1 - index].toggled = false;
                }
            }
        }
    }

    /// Takes what a fixed step of `dt_s` seconds is to do. Held keys stay held; clicks and movements are used up.
    pub fn take_step(&mut self, bindings: &InstrumentBindings, dt_s: f32) -> LiveCommand {
        let tapped = std::mem::take(&mut self.tapped);
        let mut change = std::mem::take(&mut self.moved);
        for action in InstrumentAction::ALL {
            if let Some((field, sign)) = action.movement() {
                let (index, speed) = (action.index(), bindings.speed(field));
                let pushed_per_s = self.pushed[index] * bindings.feel.stick * speed.pushed_per_s;
                // A gamepad's button is tapped, too: it then moves as far as it was pushed.
                let is_held = self.held[index] || tapped[index] && pushed_per_s == 0.0;
                let held_per_s = if is_held {
                    bindings.feel.keys * speed.held_per_s
                } else {
                    0.0
                };
                change[field as usize] += sign * held_per_s.max(pushed_per_s) * dt_s;
            }
        }
        let [cut, coagulate] = [0, 1].map(|index| {
            let Pedal { held, stale, toggled } = self.pedals[index];
            match bindings.feel.pedals {
                PedalMode::Hold => held && !stale || tapped[PEDALS[index].index()],
                PedalMode::Toggle => toggled,
            }
        });
        let cut = cut && self.captured;
        let coagulate = coagulate && self.captured;
        LiveCommand { change, cut, coagulate }
    }
}

impl LiveCommand {
    /// Where the command would have the instrument, whatever its limits.
    pub fn wanted(&self, request: &InstrumentState) -> InstrumentState {
        let mut next = *request;
        for (field, change) in InstrumentField::ALL.into_iter().zip(self.change) {
            next.set(field, next.get(field) + change);
        }
        next.cut = self.cut;
        next.coagulate = self.coagulate;
        next
    }

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
        limits.advance(state, &self.wanted(request), LONGEST_LAG_S)
    }
}

/// Adds the frame's input. Without Bevy's input plugin there is none.
pub(crate) fn gather_live_input(mut live: ResMut<LiveInput>, bindings: Res<InstrumentBindings>, params: DeviceParams) {
    live.add_frame(&params.devices(), &bindings);
}
