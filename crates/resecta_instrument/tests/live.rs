//! Keyboard and mouse: nothing lost between frames and fixed steps, and a help that cannot be wrong.

use bevy::prelude::*;
use resecta_instrument::{
    BoundInput, Devices, InstrumentAction, InstrumentBindings, InstrumentField, InstrumentLimits, InstrumentState,
    LiveInput,
};

const STEP_S: f32 = 1.0 / 60.0;

/// A frame in which these keys are down.
fn frame(live: &mut LiveInput, keys: &ButtonInput<KeyCode>) {
    live.add_frame(
        &Devices {
            keys: Some(keys),
            ..default()
        },
        &InstrumentBindings::default(),
    );
}

#[test]
fn a_held_key_moves_by_time_however_many_frames_there_are() {
    let bindings = InstrumentBindings::default();
    let mut keys = ButtonInput::default();
    keys.press(KeyCode::KeyW);
    let distance = |frames_per_step: usize| {
        let mut live = LiveInput::default();
        let mut moved = 0.0;
        for step in 0..60 {
            // Fewer than one frame a step: a frame every other step.
            let frames = if frames_per_step == 0 {
                1 - step % 2
            } else {
                frames_per_step
            };
            (0..frames).for_each(|_| frame(&mut live, &keys));
            moved += live.take_step(&bindings, STEP_S).change[InstrumentField::Insertion as usize];
        }
        moved
    };
    for frames_per_step in 0..4 {
        assert!(
            (distance(frames_per_step) - bindings.insertion.held_per_s).abs() < 1e-3,
            "{frames_per_step}"
        );
    }
}

#[test]
fn a_click_shorter_than_a_step_lasts_one_step() {
    let bindings = InstrumentBindings::default();
    let mut live = LiveInput::default();
    let mut keys = ButtonInput::default();
    keys.press(KeyCode::KeyF);
    keys.release(KeyCode::KeyF);
    frame(&mut live, &keys);
    keys.clear();
    frame(&mut live, &keys);
    assert!(live.take_step(&bindings, STEP_S).cut);
    assert!(!live.take_step(&bindings, STEP_S).cut);
}

#[test]
fn a_mouse_movement_counts_once() {
    let bindings = InstrumentBindings::default();
    let mut live = LiveInput::default();
    for _ in 0..3 {
        live.add_frame(
            &Devices {
                mouse: Vec2::new(10.0, -20.0),
                wheel: 1.0,
                ..default()
            },
            &bindings,
        );
    }
    let change = live.take_step(&bindings, STEP_S).change;
    assert!((change[InstrumentField::Yaw as usize] - 30.0 * bindings.tilt.per_pixel).abs() < 1e-4);
    assert!((change[InstrumentField::Pitch as usize] - 60.0 * bindings.tilt.per_pixel).abs() < 1e-4);
    assert!((change[InstrumentField::Insertion as usize] - 3.0 * bindings.insertion.per_line).abs() < 1e-4);
    assert_eq!(live.take_step(&bindings, STEP_S), default());
}

#[test]
fn a_menu_takes_the_keyboard_away() {
    let mut live = LiveInput::default();
    let mut keys = ButtonInput::default();
    keys.press(KeyCode::KeyF);
    frame(&mut live, &keys);
    live.captured = false;
    frame(&mut live, &keys);
    assert_eq!(live.take_step(&InstrumentBindings::default(), STEP_S), default());
}

#[test]
fn a_flick_of_the_mouse_is_not_followed_for_long() {
    let limits = InstrumentLimits::default();
    let bindings = InstrumentBindings::default();
    let mut live = LiveInput::default();
    live.add_frame(
        &Devices {
            mouse: Vec2::new(1e6, 0.0),
            ..default()
        },
        &bindings,
    );
    let state = InstrumentState::default();
    let mut request = live
        .take_step(&bindings, STEP_S)
        .apply(&state, &state, &limits)
        .expect("finite");
    let mut now = state;
    let mut steps = 0;
    while now.yaw_deg != request.yaw_deg {
        now = limits.advance(&now, &request, STEP_S).expect("finite");
        request = live
            .take_step(&bindings, STEP_S)
            .apply(&request, &now, &limits)
            .expect("finite");
        steps += 1;
        assert!(steps < 10, "still following after {steps} steps");
    }
}

#[test]
fn the_help_follows_the_table() {
    let mut bindings = InstrumentBindings::default();
    let labels: Vec<&str> = bindings.help().iter().map(|(label, _)| *label).collect();
    assert_eq!(
        labels,
        InstrumentAction::ALL.map(InstrumentAction::label),
        "every action is bound and explained"
    );
    assert_eq!(bindings.help()[0].1, "W or Wheel up");
    bindings.rows[0].inputs = vec![
        BoundInput::Key(KeyCode::PageUp),
        BoundInput::Button(MouseButton::Middle),
    ];
    assert_eq!(bindings.help()[0].1, "Page Up or Middle mouse button");
    let mut keys = ButtonInput::default();
    keys.press(KeyCode::PageUp);
    let mut live = LiveInput::default();
    live.add_frame(
        &Devices {
            keys: Some(&keys),
            ..default()
        },
        &bindings,
    );
    assert!(live.take_step(&bindings, STEP_S).change[InstrumentField::Insertion as usize] > 0.0);
}

#[test]
fn no_input_is_bound_twice() {
    let inputs: Vec<BoundInput> = InstrumentBindings::default()
        .rows
        .into_iter()
        .flat_map(|row| row.inputs)
        .collect();
    for (index, input) in inputs.iter().enumerate() {
        assert!(!inputs[..index].contains(input), "{input} is bound twice");
    }
}
