//! The outside view turned by the player's hands, and by itself behind the title.

use bevy::{
    input::mouse::{AccumulatedMouseMotion, AccumulatedMouseScroll},
    prelude::*,
};

use super::{
    flow::{GameFlow, Phase},
    settings,
};
use crate::view::{OutsideCamera, ViewSystems};

/// Degrees that the outside view turns a pixel of mouse movement, and a second of a held key.
const TURN_PER_PIXEL_DEG: f32 = 0.35;
/// As above.
const TURN_PER_S_DEG: f32 = 60.0;
/// The gland behind the title swings this far to either side, degrees, in as many seconds there and back: its section stays in
/// view.
const TITLE_SWING_DEG: f32 = 50.0;
/// As above.
const TITLE_SWING_S: f32 = 40.0;

pub fn plugin(app: &mut App) {
    app.add_systems(Update, turn.in_set(ViewSystems::First).run_if(settings::is_closed));
}

/// Turns the camera of the outside view; at the title it swings by itself.
pub(super) fn turn(
    flow: Res<GameFlow>,
    time: Res<Time<Real>>,
    keys: Res<ButtonInput<KeyCode>>,
    mouse: Res<AccumulatedMouseMotion>,
    wheel: Res<AccumulatedMouseScroll>,
    mut cameras: Query<&mut OutsideCamera>,
) {
    if flow.phase == Phase::Title {
        let turns = time.elapsed_secs_wrapped() / TITLE_SWING_S;
        let from_left = OutsideCamera::default();
        for mut camera in &mut cameras {
            *camera = OutsideCamera {
                round_deg: from_left.round_deg + TITLE_SWING_DEG * (turns * std::f32::consts::TAU).sin(),
                ..from_left
            };
        }
        return;
    }
    let held = |code: KeyCode| if keys.pressed(code) { 1.0 } else { 0.0 };
    let by_keys = Vec2::new(
        held(KeyCode::KeyI) - held(KeyCode::KeyK),
        held(KeyCode::KeyL) - held(KeyCode::KeyJ),
    ) * TURN_PER_S_DEG
        * time.delta_secs();
    let mut turn = by_keys;
    let mut nearer = (held(KeyCode::KeyU) - held(KeyCode::KeyO)) * time.delta_secs();
    if flow.turning {
        turn += Vec2::new(mouse.delta.y, -mouse.delta.x) * TURN_PER_PIXEL_DEG;
        nearer += wheel.delta.y.clamp(-3.0, 3.0) * 0.08;
    }
    if turn == Vec2::ZERO && nearer == 0.0 {
        return;
    }
    for mut camera in &mut cameras {
        camera.turn(turn.x, turn.y);
        camera.approach((-nearer).exp());
    }
}
