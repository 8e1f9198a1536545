//! Briefing, play, pause, result, and what leads from one to the other. Time and instrument run only during play, but for
//! the briefing, in which the gland settles around the sheath.

use bevy::{
    input::mouse::{AccumulatedMouseMotion, AccumulatedMouseScroll},
    prelude::*,
    window::{CursorGrabMode, CursorOptions, PrimaryWindow, WindowFocused},
};
use resecta_instrument::{InstrumentSource, LiveInput};
use resecta_scenario::{EndReason, PreparedExercise, RunState, spawn_exercise};
use resecta_tissue::TissueSettings;

use super::{
    Loaded,
    layout::ViewLayout,
    pace::Pace,
    settings::{self, SettingsPage},
};
use crate::view::{OutsideCamera, ViewSystems};

/// Degrees that the outside view turns a pixel of mouse movement, and a second of a held key.
const TURN_PER_PIXEL_DEG: f32 = 0.35;
/// As above.
const TURN_PER_S_DEG: f32 = 60.0;

pub fn plugin(app: &mut App) {
    app.init_resource::<GameFlow>()
        .add_systems(
            Update,
            (
                read_keys.run_if(settings::is_closed),
                settings::keys,
                pause_without_focus,
                notice_end,
                carry_out,
            )
                .chain()
                .before(ViewSystems::First),
        )
        .add_systems(
            Update,
            turn_outside.in_set(ViewSystems::First).run_if(settings::is_closed),
        );
}

/// Where the player is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Phase {
    /// Reading what is to be done.
    #[default]
    Briefing,
    /// At the instrument.
    Playing,
    /// Away from it for a moment.
    Paused,
    /// Done.
    Result,
}

/// Something the player asked for, by key or button.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Wish {
    /// Begin, or go on.
    Play,
    /// Stop for a moment.
    Pause,
    /// Begin anew.
    Restart,
    /// Be done with it.
    End,
    /// Show or hide the help.
    Help,
    /// The next arrangement of the views.
    NextLayout,
    /// Open the settings.
    Settings,
    /// Leave.
    Quit,
}

/// Where the game stands.
#[derive(Resource, Debug, Default)]
pub struct GameFlow {
    /// Where the player is.
    pub phase: Phase,
    /// Whether the help is shown.
    pub help: bool,
    /// Whether the mouse turns the outside view in place of the instrument.
    pub turning: bool,
    /// Why the exercise could not be started again.
    pub trouble: Option<String>,
    wishes: Vec<Wish>,
}

impl GameFlow {
    /// Asks for something; it is done in the next frame.
    pub fn wish(&mut self, wish: Wish) {
        self.wishes.push(wish);
    }

    /// Whether something was asked for and is not done yet.
    pub fn is_asked(&self, wish: Wish) -> bool {
        self.wishes.contains(&wish)
    }

    /// Whether the player's hands are on the instrument.
    pub fn is_live(&self) -> bool {
        self.phase == Phase::Playing && !self.help
    }
}

/// Puts the exercise into the world, with keyboard and mouse at the instrument.
pub fn begin(world: &mut World, prepared: PreparedExercise) {
    let active = spawn_exercise(world, prepared);
    world.entity_mut(active.instrument).insert(InstrumentSource::Live);
    if let Some(mut settings) = world.get_mut::<TissueSettings>(active.tissue) {
        settings.watch_error_every = STEPS_A_WATCH;
    }
}

/// The panel shows an error of the step that is never older than this many steps, 2 s: some five steps' work in 120.
const STEPS_A_WATCH: u32 = 120;

/// The keys of the game. None of them is among the instrument's bindings.
pub const KEYS: [(&str, &str); 9] = [
    ("Begin, go on", "Enter, Pad Start"),
    ("Pause", "Esc, P, Pad Start"),
    ("Restart (in a pause)", "R"),
    ("Endoscope, outside, both", "Tab, Pad Back"),
    ("Turn the outside view", "Middle mouse button, or J L I K"),
    ("Zoom the outside view", "Middle mouse button and wheel, or U O"),
    ("Settings", "F2"),
    ("This help", "H or F1"),
    ("Quit", "Close the window"),
];

fn read_keys(keys: Res<ButtonInput<KeyCode>>, mut flow: ResMut<GameFlow>) {
    let phase = flow.phase;
    let any = |codes: &[KeyCode]| keys.any_just_pressed(codes.iter().copied());
    if any(&[KeyCode::KeyH, KeyCode::F1]) || (flow.help && any(&[KeyCode::Escape, KeyCode::Enter])) {
        flow.wish(Wish::Help);
    } else if any(&[KeyCode::Enter, KeyCode::NumpadEnter]) && phase != Phase::Playing {
        flow.wish(if phase == Phase::Result {
            Wish::Restart
        } else {
            Wish::Play
        });
    } else if any(&[KeyCode::Escape, KeyCode::KeyP]) {
        match phase {
            Phase::Playing => flow.wish(Wish::Pause),
            Phase::Paused => flow.wish(Wish::Play),
            Phase::Briefing | Phase::Result => {}
        }
    }
    if any(&[KeyCode::KeyR]) {
        // Beside the keys of the instrument: one slip must not cost the run.
        flow.wish(if phase == Phase::Playing {
            Wish::Pause
        } else {
            Wish::Restart
        });
    }
    if any(&[KeyCode::Tab]) {
        flow.wish(Wish::NextLayout);
    }
}

fn pause_without_focus(mut focus: MessageReader<WindowFocused>, mut flow: ResMut<GameFlow>) {
    if focus.read().any(|change| !change.focused) && flow.phase == Phase::Playing {
        flow.wish(Wish::Pause);
    }
}

fn notice_end(state: Res<RunState>, mut flow: ResMut<GameFlow>) {
    if matches!(*state, RunState::Ended(_)) && flow.phase == Phase::Playing {
        flow.phase = Phase::Result;
    }
}

fn carry_out(
    mut flow: ResMut<GameFlow>,
    mut state: ResMut<RunState>,
    (mut layout, mut page): (ResMut<ViewLayout>, ResMut<SettingsPage>),
    mut time: ResMut<Time<Virtual>>,
    mut pace: ResMut<Pace>,
    mut live: ResMut<LiveInput>,
    mut cursors: Query<&mut CursorOptions, With<PrimaryWindow>>,
    mut exit: MessageWriter<AppExit>,
    loaded: Res<Loaded>,
    buttons: Res<ButtonInput<MouseButton>>,
    keys: Res<ButtonInput<KeyCode>>,
    mut commands: Commands,
) {
    for wish in std::mem::take(&mut flow.wishes) {
        match wish {
            Wish::Play => {
                flow.phase = Phase::Playing;
                flow.help = false;
                *state = RunState::Running;
            }
            Wish::Pause => flow.phase = Phase::Paused,
            Wish::Help => flow.help = !flow.help,
            Wish::End => {
                flow.phase = Phase::Result;
                *state = RunState::Ended(EndReason::Player);
            }
            Wish::NextLayout => *layout = layout.next(),
            Wish::Settings => page.open = true,
            Wish::Quit => {
                exit.write(AppExit::Success);
            }
            Wish::Restart => match loaded.0.clone().prepare() {
                Ok(prepared) => {
                    *flow = GameFlow::default();
                    commands.queue(move |world: &mut World| begin(world, prepared));
                }
                // It could be prepared before; nothing that a player does changes that.
                Err(error) => flow.trouble = Some(error.to_string()),
            },
        }
    }

    let is_live = flow.is_live() && !page.open;
    let is_still = page.open || !is_live && flow.phase != Phase::Briefing;
    if is_still && !time.is_paused() {
        time.pause();
    } else if !is_still && time.is_paused() {
        time.unpause();
        pace.forget();
    }
    flow.turning = buttons.pressed(MouseButton::Middle);
    // A click that began the game is still held: it must not cut before it was let go once.
    let holds_over = !live.captured
        && (buttons.any_pressed([MouseButton::Left, MouseButton::Right]) || keys.pressed(KeyCode::Enter));
    let captured = is_live && !flow.turning && !holds_over;
    if live.captured != captured {
        live.captured = captured;
    }
    for mut cursor in &mut cursors {
        let grab = if is_live {
            CursorGrabMode::Locked
        } else {
            CursorGrabMode::None
        };
        if cursor.grab_mode != grab || cursor.visible == is_live {
            cursor.grab_mode = grab;
            cursor.visible = !is_live;
        }
    }
}

fn turn_outside(
    flow: Res<GameFlow>,
    time: Res<Time<Real>>,
    keys: Res<ButtonInput<KeyCode>>,
    mouse: Res<AccumulatedMouseMotion>,
    wheel: Res<AccumulatedMouseScroll>,
    mut cameras: Query<&mut OutsideCamera>,
) {
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
