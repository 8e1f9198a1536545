//! The plugin in an app without a window: sources, placing, recording, replay.

use std::path::Path;
use std::time::Duration;

use bevy::ecs::schedule::{LogLevel, ScheduleBuildSettings};
use bevy::input::keyboard::{Key, KeyboardInput};
use bevy::input::{ButtonState, InputPlugin};
use bevy::prelude::*;
use bevy::time::TimeUpdateStrategy;
use resecta_instrument::*;
use resecta_tissue::TissueTool;

fn app() -> App {
    let mut app = App::new();
    app.add_plugins((MinimalPlugins, InstrumentPlugin))
        .insert_resource(Time::<Fixed>::from_hz(60.0))
        .insert_resource(TimeUpdateStrategy::FixedTimesteps(1));
    // The first update only starts the clock.
    app.update();
    app
}

fn scope() -> Resectoscope {
    Resectoscope::new(Vec3::new(0.0, 0.0, -10.0), Vec3::Z, Vec3::NEG_Y).expect("a valid placement")
}

fn script() -> InstrumentScript {
    let text = "(keys: [
        (time_s: 0.0, insertion_mm: 20, pitch_deg: 3, stroke_mm: 0),
        (time_s: 0.5, insertion_mm: 41.7, stroke_mm: 22.3, cut: true),
        (time_s: 1.1, roll_deg: 33.3, pitch_deg: -7.1, stroke_mm: 1, cut: false, coagulate: true),
        (time_s: 1.3, roll_deg: 0.1),
    ])";
    InstrumentScript::from_ron(text, Path::new("test.ron"), &InstrumentLimits::default()).expect("a valid script")
}

/// Runs a source for some steps and returns what was recorded, through the file's text.
fn record(source: InstrumentSource, steps: usize) -> InstrumentRecording {
    let mut app = app();
    let instrument = app
        .world_mut()
        .spawn((scope(), source, InstrumentRecording::default()))
        .id();
    (0..steps).for_each(|_| app.update());
    let text = app
        .world()
        .get::<InstrumentRecording>(instrument)
        .expect("recorded")
        .to_csv();
    InstrumentRecording::from_csv(&text, Path::new("test.csv"), &InstrumentLimits::default()).expect("valid")
}

#[test]
fn a_script_is_played_exactly_one_state_a_step() {
    let recording = record(InstrumentSource::Script(script()), 90);
    assert_eq!(recording.states.len(), 90);
    let start = recording.start;
    assert_eq!(
        (start.insertion_mm, start.cut),
        (20.0, false),
        "placed at the first key"
    );
    for (step, state) in (1..).zip(&recording.states) {
        assert_eq!(
            *state,
            script().sample(f64::from(step) * recording.step_s, &start),
            "step {step}"
        );
    }
}

#[test]
fn a_replay_gives_the_same_recording_bit_for_bit() {
    let first = record(InstrumentSource::Script(script()), 90);
    let replay = record(InstrumentSource::Recording(first.clone()), 90);
    assert_eq!(replay.to_csv(), first.to_csv());
}

#[test]
fn a_request_cut_short_by_the_limits_replays_bit_for_bit() {
    let mut app = app();
    let instrument = app.world_mut().spawn((scope(), InstrumentRecording::default())).id();
    for step in 0..200 {
        let far = if step % 50 < 25 { 1000.0 } else { -1000.0 };
        let request = InstrumentState {
            insertion_mm: far,
            pitch_deg: -far,
            yaw_deg: far,
            roll_deg: -far,
            stroke_mm: far,
            inflow_tap: far,
            outflow_tap: -far,
            cut: step % 3 == 0,
            coagulate: false,
        };
        app.world_mut()
            .get_mut::<InstrumentRequest>(instrument)
            .expect("required")
            .0 = request;
        app.update();
    }
    let first = app
        .world()
        .get::<InstrumentRecording>(instrument)
        .expect("recorded")
        .clone();
    assert_eq!(
        record(InstrumentSource::Recording(first.clone()), 200).to_csv(),
        first.to_csv()
    );
}

#[test]
fn when_a_script_is_over_the_instrument_stays_with_its_pedals_up() {
    let recording = record(InstrumentSource::Script(script()), 120);
    let last = recording.states[119];
    assert!(recording.states[76].coagulate && !last.coagulate);
    assert_eq!(
        last,
        InstrumentState {
            coagulate: false,
            ..recording.states[78]
        }
    );
}

#[test]
fn a_number_that_is_none_is_refused_and_the_last_state_held() {
    let mut app = app();
    let start = InstrumentState {
        insertion_mm: 30.0,
        ..default()
    };
    let instrument = app.world_mut().spawn((scope(), start)).id();
    app.update();
    let bad = InstrumentState {
        roll_deg: f32::NAN,
        insertion_mm: 31.0,
        ..default()
    };
    app.world_mut()
        .get_mut::<InstrumentRequest>(instrument)
        .expect("required")
        .0 = bad;
    app.update();
    assert_eq!(app.world().get::<InstrumentState>(instrument), Some(&start));
    assert!(app.world().get::<TissueTool>(instrument).expect("required").is_valid());
    let mut refused = app.world_mut().resource_mut::<Messages<InstrumentRefused>>();
    let refused: Vec<InstrumentRefused> = refused.drain().collect();
    assert_eq!(refused.len(), 1, "the next step asks for numbers again");
    assert_eq!(
        (refused[0].instrument, refused[0].reason.field),
        (instrument, InstrumentField::Roll)
    );
}

#[test]
fn the_tool_follows_the_state_and_placing_sweeps_nothing() {
    let mut app = app();
    let instrument = app
        .world_mut()
        .spawn((scope(), InstrumentSource::Script(script())))
        .id();
    (0..45).for_each(|_| app.update());
    let state = *app.world().get::<InstrumentState>(instrument).expect("required");
    assert!(state.cut);
    let tool = app.world().get::<TissueTool>(instrument).expect("required");
    assert_eq!(tool.pose, scope().sheath_pose(&state));
    assert_eq!(tool.parts, ResectoscopeGeometry::default().tool_parts(state.stroke_mm));
    assert!(tool.cutting);
    let transform = app.world().get::<Transform>(instrument).expect("required");
    assert_eq!(transform.translation, scope().tip(&state));

    // The tissue keeps where the tool was; a source set anew must make it forget.
    let mut tool = app.world_mut().get_mut::<TissueTool>(instrument).expect("required");
    tool.previous = Some(tool.placement());
    app.world_mut()
        .entity_mut(instrument)
        .insert(InstrumentSource::Script(script()));
    app.update();
    assert_eq!(
        app.world().get::<TissueTool>(instrument).expect("required").previous,
        None
    );
    assert_eq!(
        app.world()
            .get::<InstrumentPlayback>(instrument)
            .expect("required")
            .steps,
        1
    );
}

#[test]
fn keys_reach_the_instrument_through_the_plugin() {
    let mut app = app();
    app.init_resource::<ButtonInput<KeyCode>>();
    let start = InstrumentState {
        insertion_mm: 30.0,
        ..default()
    };
    let instrument = app.world_mut().spawn((scope(), start, InstrumentSource::Live)).id();
    app.update();
    app.world_mut()
        .resource_mut::<ButtonInput<KeyCode>>()
        .press(KeyCode::KeyW);
    (0..60).for_each(|_| app.update());
    let inserted_mm = app
        .world()
        .get::<InstrumentState>(instrument)
        .expect("required")
        .insertion_mm;
    let expected_mm = 30.0 + InstrumentBindings::default().insertion.held_per_s;
    assert!((inserted_mm - expected_mm).abs() < 1e-3, "{inserted_mm}");
}

/// An app with the devices of Bevy and one instrument in the player's hand.
fn in_hand(start: InstrumentState) -> (App, Entity) {
    let mut app = App::new();
    app.add_plugins((MinimalPlugins, InputPlugin, InstrumentPlugin))
        .insert_resource(Time::<Fixed>::from_hz(60.0))
        .insert_resource(TimeUpdateStrategy::FixedTimesteps(1));
    app.update();
    let instrument = app.world_mut().spawn((scope(), start, InstrumentSource::Live)).id();
    app.update();
    (app, instrument)
}

fn state(app: &App, instrument: Entity) -> InstrumentState {
    *app.world().get::<InstrumentState>(instrument).expect("required")
}

fn key(app: &mut App, key_code: KeyCode, logical_key: Key, pressed: ButtonState) {
    app.world_mut().write_message(KeyboardInput {
        key_code,
        logical_key,
        state: pressed,
        text: None,
        repeat: false,
        window: Entity::PLACEHOLDER,
    });
}

#[test]
fn a_press_acts_in_the_fixed_step_of_the_frame_that_it_comes_in() {
    // Out: a loop that is drawn in delivers no current.
    let out_mm = 5.0;
    let (mut app, instrument) = in_hand(InstrumentState {
        stroke_mm: out_mm,
        ..default()
    });
    let f = || Key::Character("f".into());
    key(&mut app, KeyCode::KeyF, f(), ButtonState::Pressed);
    app.update();
    assert!(state(&app, instrument).cut, "the first step after the press");
    assert!(app.world().get::<TissueTool>(instrument).expect("required").cutting);
    key(&mut app, KeyCode::KeyF, f(), ButtonState::Released);
    app.update();
    assert!(!state(&app, instrument).cut, "the first step after the release");

    key(&mut app, KeyCode::Space, Key::Space, ButtonState::Pressed);
    app.update();
    let step_s = 1.0 / 60.0;
    let moved_mm = state(&app, instrument).stroke_mm - out_mm;
    let expected_mm = InstrumentBindings::default().stroke.held_per_s * step_s;
    assert!((moved_mm - expected_mm).abs() < 1e-4, "{moved_mm} mm in its first step");
}

#[test]
fn a_gamepad_reaches_the_instrument_through_the_plugin() {
    let (mut app, instrument) = in_hand(default());
    let mut pad = Gamepad::default();
    pad.analog_mut().set(GamepadAxis::RightStickX, 1.0);
    pad.digital_mut().press(GamepadButton::LeftTrigger);
    app.world_mut().spawn(pad);
    (0..30).for_each(|_| app.update());
    let state = state(&app, instrument);
    let expected_deg = InstrumentBindings::default().tilt.pushed_per_s / 2.0;
    assert!((state.yaw_deg - expected_deg).abs() < 1e-3, "{}", state.yaw_deg);
    assert!(state.coagulate);
}

#[test]
fn the_end_of_the_way_is_told_by_field_side_and_push() {
    let start = InstrumentState {
        stroke_mm: 29.9,
        outflow_tap: 0.5,
        ..default()
    };
    let (mut app, instrument) = in_hand(start);
    let told = |app: &mut App| -> Vec<InstrumentStopped> {
        app.update();
        app.world_mut()
            .resource_mut::<Messages<InstrumentStopped>>()
            .drain()
            .collect()
    };
    assert_eq!(told(&mut app), [], "nothing is pressed");
    key(&mut app, KeyCode::Space, Key::Space, ButtonState::Pressed);
    let first = told(&mut app);
    let bindings = InstrumentBindings::default();
    let full = InstrumentLimits::default().stroke_mm.max_speed / 60.0;
    let past_mm = 29.9 + bindings.stroke.held_per_s / 60.0 - 30.0;
    let [InstrumentStopped { field, above, push, .. }] = first[..] else {
        panic!("{first:?}");
    };
    assert_eq!((field, above), (InstrumentField::Stroke, true));
    assert!((push - past_mm / full).abs() < 1e-3, "{push}");
    let held = told(&mut app);
    assert!(
        (held[0].push - bindings.stroke.held_per_s / 60.0 / full).abs() < 1e-3,
        "a key presses evenly"
    );
    assert_eq!(state(&app, instrument).stroke_mm, 30.0);
    key(&mut app, KeyCode::Space, Key::Space, ButtonState::Released);
    assert_eq!(told(&mut app), []);
}

#[test]
fn a_recording_without_taps_leaves_them_where_they_are() {
    let (mut app, instrument) = in_hand(InstrumentState {
        inflow_tap: 0.25,
        outflow_tap: 1.0,
        ..default()
    });
    let recording = InstrumentRecording {
        step_s: 1.0 / 60.0,
        without_taps: true,
        start: default(),
        states: vec![
            InstrumentState {
                stroke_mm: 0.5,
                ..default()
            };
            3
        ],
    };
    app.world_mut()
        .entity_mut(instrument)
        .insert(InstrumentSource::Recording(recording));
    for _ in 0..5 {
        app.update();
        let state = state(&app, instrument);
        assert_eq!((state.inflow_tap, state.outflow_tap), (0.25, 1.0));
    }
    assert_eq!(state(&app, instrument).stroke_mm, 0.5);
}

#[test]
fn two_frames_without_a_fixed_step_move_nothing() {
    let mut app = app();
    let start = InstrumentState {
        insertion_mm: 30.0,
        ..default()
    };
    let instrument = app.world_mut().spawn((scope(), start)).id();
    app.insert_resource(TimeUpdateStrategy::ManualDuration(Duration::ZERO));
    app.world_mut()
        .get_mut::<InstrumentRequest>(instrument)
        .expect("required")
        .0
        .insertion_mm = 60.0;
    app.update();
    app.update();
    assert_eq!(app.world().get::<InstrumentState>(instrument), Some(&start));
}

#[test]
fn the_order_of_the_systems_is_fixed() {
    let mut app = app();
    let settings = ScheduleBuildSettings {
        ambiguity_detection: LogLevel::Error,
        ..default()
    };
    app.edit_schedule(FixedUpdate, |schedule| {
        schedule.set_build_settings(settings.clone());
    });
    app.world_mut().spawn((scope(), InstrumentSource::Live));
    app.update();
}
