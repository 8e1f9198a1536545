//! Keyboard, mouse and gamepad: nothing lost between frames and fixed steps, and a help that cannot be wrong.

use bevy::input::gamepad::GamepadInput;
use bevy::prelude::*;
use resecta_instrument::{
    BoundInput, Devices, Handedness, InputCapture, InstrumentAction, InstrumentBindings, InstrumentField,
    InstrumentLimits, InstrumentState, LiveCommand, LiveFeel, LiveInput, PedalMode,
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
    let mut bindings = InstrumentBindings::default();
    let mut keys = ButtonInput::default();
    keys.press(KeyCode::KeyW);
    let distance = |bindings: &InstrumentBindings, frames_per_step: usize| {
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
            moved += live.take_step(bindings, STEP_S).change[InstrumentField::Insertion as usize];
        }
        moved
    };
    for factor in [1.0, 0.4] {
        bindings.feel.keys = factor;
        for frames_per_step in 0..4 {
            assert!(
                (distance(&bindings, frames_per_step) - factor * bindings.insertion.held_per_s).abs() < 1e-3,
                "{frames_per_step}"
            );
        }
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
    assert_eq!(bindings.help()[0].1, "W or Turn wheel up");
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
    for hand in [Handedness::Right, Handedness::Left] {
        let bindings = InstrumentBindings::of_hand(hand);
        for input in bindings.rows.iter().flat_map(|row| &row.inputs) {
            assert_eq!(bindings.uses(*input).count(), 1, "{hand:?}: {input} is bound twice");
        }
        for action in InstrumentAction::ALL {
            let inputs: Vec<BoundInput> = bindings.inputs(action).collect();
            assert!(
                inputs.iter().any(|input| input.is_pad()),
                "{hand:?}: {action:?} on a gamepad"
            );
            assert!(
                inputs.iter().any(|input| matches!(input, BoundInput::Key(_))),
                "{hand:?}: {action:?} on the keyboard"
            );
        }
    }
}

/// A gamepad with its sticks and triggers so far.
fn pad(axes: &[(GamepadInput, f32)]) -> Gamepad {
    let mut pad = Gamepad::default();
    for &(input, amount) in axes {
        pad.analog_mut().set(input, amount);
    }
    pad
}

/// A step after a frame of these gamepads.
fn step_of(pads: &[Gamepad], bindings: &InstrumentBindings) -> LiveCommand {
    let mut live = LiveInput::default();
    let pads = pads.iter().collect();
    live.add_frame(&Devices { pads, ..default() }, bindings);
    live.take_step(bindings, STEP_S)
}

#[test]
fn a_stick_rests_in_its_dead_zone_and_answers_along_its_curve() {
    let stick = |amount| [pad(&[(GamepadAxis::RightStickY.into(), amount)])];
    let mut bindings = InstrumentBindings::default();
    let pitch = |amount, bindings: &InstrumentBindings| {
        step_of(&stick(amount), bindings).change[InstrumentField::Pitch as usize]
            / (bindings.tilt.pushed_per_s * STEP_S)
    };
    for rest in [0.0, 0.1, -0.149, f32::NAN] {
        assert_eq!(pitch(rest, &bindings), 0.0, "{rest}");
    }
    assert!((pitch(1.0, &bindings) - 1.0).abs() < 1e-5);
    assert!((pitch(-1.0, &bindings) + 1.0).abs() < 1e-5);
    let half = 0.15 + 0.85 / 2.0;
    assert!((pitch(half, &bindings) - 0.25).abs() < 1e-5, "a square");
    bindings.feel.curve = 1.0;
    assert!((pitch(half, &bindings) - 0.5).abs() < 1e-5, "straight");
    bindings.feel.inverted.stick_y = true;
    assert!((pitch(half, &bindings) + 0.5).abs() < 1e-5, "inverted");
    bindings.feel.stick = 0.5;
    assert!((pitch(half, &bindings) + 0.25).abs() < 1e-5, "half as sensitive");
}

#[test]
fn triggers_push_the_loop_by_their_way_and_buttons_press_pedals_and_turn_taps() {
    let bindings = InstrumentBindings::default();
    let half = 0.15 + 0.85 / 2.0;
    let mut pad = pad(&[(GamepadButton::RightTrigger2.into(), half)]);
    pad.digital_mut().press(GamepadButton::RightTrigger);
    pad.digital_mut().press(GamepadButton::DPadLeft);
    let step = step_of(&[Gamepad::default(), pad], &bindings);
    let expected_mm = 0.25 * bindings.stroke.pushed_per_s * STEP_S;
    assert!((step.change[InstrumentField::Stroke as usize] - expected_mm).abs() < 1e-5);
    assert!(step.cut && !step.coagulate);
    let closed = step.change[InstrumentField::OutflowTap as usize];
    assert!((closed + bindings.tap.pushed_per_s * STEP_S).abs() < 1e-6, "{closed}");
}

#[test]
fn sensitivity_and_inverted_axes_act_on_the_mouse() {
    let mut bindings = InstrumentBindings::default();
    let moved = |bindings: &InstrumentBindings| {
        let mut live = LiveInput::default();
        let devices = Devices {
            mouse: Vec2::new(10.0, -20.0),
            wheel: 1.0,
            ..default()
        };
        live.add_frame(&devices, bindings);
        let change = live.take_step(bindings, STEP_S).change;
        [InstrumentField::Yaw, InstrumentField::Pitch, InstrumentField::Insertion].map(|field| change[field as usize])
    };
    let plain = moved(&bindings);
    bindings.feel.mouse = 2.0;
    bindings.feel.wheel = 0.5;
    bindings.feel.inverted.mouse_y = true;
    bindings.feel.inverted.wheel = true;
    let [yaw, pitch, insertion] = moved(&bindings);
    assert!((yaw - 2.0 * plain[0]).abs() < 1e-5, "{yaw}");
    assert!((pitch + 2.0 * plain[1]).abs() < 1e-5, "{pitch}");
    assert!((insertion + 0.5 * plain[2]).abs() < 1e-5, "{insertion}");
}

#[test]
fn a_number_of_the_feel_out_of_its_range_is_named() {
    assert_eq!(LiveFeel::default().checked(), Ok(LiveFeel::default()));
    let wrong = LiveFeel {
        curve: f32::NAN,
        ..default()
    };
    let error = wrong.checked().expect_err("NaN is no curve");
    assert_eq!(error.to_string(), "curve is NaN, expected 1 to 4");
}

#[test]
fn toggled_pedals_stay_down_until_the_next_press_the_other_pedal_or_a_menu() {
    let mut bindings = InstrumentBindings::default();
    bindings.feel.pedals = PedalMode::Toggle;
    let mut live = LiveInput::default();
    let mut keys = ButtonInput::default();
    // Every press lasts two frames, with a step between.
    let mut press = |live: &mut LiveInput, key: KeyCode| {
        keys.press(key);
        for _ in 0..2 {
            let devices = Devices {
                keys: Some(&keys),
                ..default()
            };
            live.add_frame(&devices, &bindings);
            live.take_step(&bindings, STEP_S);
            keys.clear();
        }
        keys.release(key);
        let devices = Devices {
            keys: Some(&keys),
            ..default()
        };
        live.add_frame(&devices, &bindings);
        keys.clear();
        let step = live.take_step(&bindings, STEP_S);
        (step.cut, step.coagulate)
    };
    assert_eq!(press(&mut live, KeyCode::KeyF), (true, false));
    assert_eq!(press(&mut live, KeyCode::KeyX), (true, false), "another key");
    assert_eq!(press(&mut live, KeyCode::KeyC), (false, true), "the other pedal");
    assert_eq!(press(&mut live, KeyCode::KeyC), (false, false), "the next press");
    assert_eq!(press(&mut live, KeyCode::KeyF), (true, false));
    live.captured = false;
    live.add_frame(&Devices::default(), &bindings);
    live.captured = true;
    assert_eq!(press(&mut live, KeyCode::KeyX), (false, false), "a menu");
}

#[test]
fn a_pedal_held_through_a_menu_counts_once_it_was_let_go() {
    for pedals in [PedalMode::Hold, PedalMode::Toggle] {
        let mut bindings = InstrumentBindings::default();
        bindings.feel.pedals = pedals;
        let mut live = LiveInput::default();
        let mut keys = ButtonInput::default();
        let mut cut = |keys: &ButtonInput<KeyCode>, captured: bool| {
            live.captured = captured;
            let devices = Devices {
                keys: Some(keys),
                ..default()
            };
            live.add_frame(&devices, &bindings);
            live.take_step(&bindings, STEP_S).cut
        };
        keys.press(KeyCode::KeyF);
        assert!(!cut(&keys, false));
        keys.clear();
        assert!(!cut(&keys, true), "still held from before");
        keys.release(KeyCode::KeyF);
        assert!(!cut(&keys, true));
        keys.press(KeyCode::KeyF);
        assert!(cut(&keys, true), "{pedals:?}: pressed anew");
    }
}

#[test]
fn names_of_inputs_read_back_and_others_are_refused() {
    let mut inputs = vec![
        BoundInput::Button(MouseButton::Other(7)),
        BoundInput::PadNegative(GamepadAxis::Other(3)),
        BoundInput::PadButton(GamepadButton::Other(12)),
    ];
    for hand in [Handedness::Right, Handedness::Left] {
        let rows = InstrumentBindings::of_hand(hand).rows;
        inputs.extend(rows.into_iter().flat_map(|row| row.inputs));
    }
    for input in inputs {
        let name = input.name().expect("all of these have names");
        assert_eq!(name.parse(), Ok(input), "{name}");
    }
    for wrong in [
        "",
        "keyW",
        "Unidentified",
        "MouseButton",
        "MouseButtonOther(x)",
        "Pad",
        "PadLeftStickX",
        "Pad+",
    ] {
        let error = wrong.parse::<BoundInput>().expect_err(wrong);
        assert!(
            error.to_string().starts_with(&format!("`{wrong}` is no input")),
            "{error}"
        );
    }
}

#[test]
fn rebinding_moves_an_input_and_shows_what_else_it_does() {
    let mut bindings = InstrumentBindings::default();
    let space = BoundInput::Key(KeyCode::Space);
    bindings.bind(InstrumentAction::Cut, space, Some(BoundInput::Key(KeyCode::KeyF)));
    let uses: Vec<_> = bindings.uses(space).collect();
    assert_eq!(
        uses,
        [InstrumentAction::LoopOut, InstrumentAction::Cut],
        "the same input for two actions"
    );
    assert_eq!(bindings.uses(BoundInput::Key(KeyCode::KeyF)).count(), 0);
    bindings.unbind(InstrumentAction::LoopOut, space);
    assert_eq!(bindings.uses(space).count(), 1);
    bindings.bind(InstrumentAction::Cut, space, None);
    assert_eq!(
        bindings
            .inputs(InstrumentAction::Cut)
            .filter(|&input| input == space)
            .count(),
        1,
        "twice is once"
    );
    for action in [InstrumentAction::Cut, InstrumentAction::LoopOut] {
        bindings.reset(action, Handedness::Right);
    }
    assert_eq!(bindings, InstrumentBindings::default());
}

#[test]
fn a_capture_takes_the_next_key_button_stick_or_movement() {
    let mut capture = InputCapture::new(true);
    assert_eq!(capture.add_frame(&Devices::default()), None);
    let mut keys = ButtonInput::default();
    keys.press(KeyCode::KeyZ);
    let by_key = Devices {
        keys: Some(&keys),
        ..default()
    };
    assert_eq!(capture.add_frame(&by_key), Some(BoundInput::Key(KeyCode::KeyZ)));

    let pushed = pad(&[(GamepadAxis::LeftStickX.into(), -0.9)]);
    let by_stick = Devices {
        pads: vec![&pushed],
        ..default()
    };
    let mut capture = InputCapture::new(false);
    assert_eq!(capture.add_frame(&by_stick), None, "held from before");
    assert_eq!(capture.add_frame(&Devices::default()), None);
    assert_eq!(
        capture.add_frame(&by_stick),
        Some(BoundInput::PadNegative(GamepadAxis::LeftStickX))
    );

    let by_mouse = Devices {
        mouse: Vec2::new(-90.0, 10.0),
        ..default()
    };
    let mut movement = InputCapture::new(true);
    let mut pedal = InputCapture::new(false);
    let taken: Vec<_> = (0..3).map(|_| movement.add_frame(&by_mouse)).collect();
    assert_eq!(taken, [None, None, Some(BoundInput::MouseLeft)]);
    assert!(
        (0..30).all(|_| pedal.add_frame(&by_mouse).is_none()),
        "no pedal is pressed by moving a mouse"
    );
}
