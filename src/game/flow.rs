//! Title, choice, briefing, play, pause, debriefing, and what leads from one to the other. Time and instrument run only during
//! play, but for the briefing, in which the gland settles around the sheath, and a moment at the title.

use bevy::{
    prelude::*,
    tasks::{AsyncComputeTaskPool, Task, block_on, poll_once},
    window::{CursorGrabMode, CursorOptions, PrimaryWindow, WindowCloseRequested, WindowFocused},
};
use resecta_instrument::{InstrumentSource, LiveInput};
use resecta_records::{Hands, RunRecorder, record_run};
use resecta_scenario::{
    ActiveExercise, EndReason, ExerciseError, LoadedExercise, Metrics, PreparedExercise, RunState, spawn_exercise,
};
use resecta_tissue::TissueSettings;

use super::{
    again::WatchAgain,
    catalogue::Catalogue,
    history::History,
    keys,
    layout::ViewLayout,
    pace::Pace,
    settings::{self, KeptSettings, SettingsPage},
};
use crate::{
    players,
    view::{OutsideCamera, ViewSystems},
};

/// Steps that the gland behind the title is given to take its shape.
const TITLE_STEPS: u32 = 4;

pub fn plugin(app: &mut App) {
    app.init_resource::<GameFlow>().add_systems(
        Update,
        (
            keys::read.run_if(settings::is_closed),
            settings::keys,
            pause_without_focus,
            take_prepared,
            notice_end,
            carry_out,
        )
            .chain()
            .before(ViewSystems::First),
    );
}

/// Where the player is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Phase {
    /// At the door.
    #[default]
    Title,
    /// Looking for an exercise.
    Choosing,
    /// Looking at who plays and how they came along.
    Progress,
    /// Outlining a gland in ultrasound images.
    Outlines,
    /// Waiting for the gland to be built.
    Preparing,
    /// Reading what is to be done.
    Briefing,
    /// At the instrument.
    Playing,
    /// Away from it for a moment.
    Paused,
    /// Done.
    Result,
}

impl Phase {
    /// Whether an exercise is shown, in its views and beside its panel.
    pub fn shows_exercise(self) -> bool {
        matches!(self, Phase::Briefing | Phase::Playing | Phase::Paused)
    }
}

/// Something the player asked for, by key or button.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Wish {
    /// To the title.
    Title,
    /// To the exercises.
    Choose,
    /// To the trainees and their progress.
    Progress,
    /// To the outlines on ultrasound images.
    Outlines,
    /// The briefing of the exercise that is looked at in the catalogue.
    Open,
    /// Begin, or go on.
    Play,
    /// Let somebody else show it.
    Watch,
    /// Watch the run that is over again.
    WatchAgain,
    /// Stop for a moment.
    Pause,
    /// Begin anew.
    Restart,
    /// Be done with it.
    End,
    /// Not what would have lost the run, after all.
    Keep,
    /// That, and let the run be lost.
    Lose,
    /// Show or hide the help.
    Help,
    /// The next arrangement of the views.
    NextLayout,
    /// Open the settings.
    Settings,
    /// Leave.
    Quit,
}

/// What is shown to the player goes at this share of its own speed: scripted hands are quicker than eyes.
const SHOWN_SPEED: f32 = 0.5;

/// A run that is shorter than this may be lost by a slip, s.
const SOON_DONE_AGAIN_S: f64 = 20.0;

/// Where the game stands.
#[derive(Resource, Debug, Default)]
pub struct GameFlow {
    /// Where the player is.
    pub phase: Phase,
    /// Whether the help is shown.
    pub help: bool,
    /// Whether the mouse turns the outside view in place of the instrument.
    pub turning: bool,
    /// Whether letters are being written: no key means anything else then.
    pub is_writing: bool,
    /// Whether the exercise is shown to the player, who has no hands on the instrument.
    pub watches: bool,
    /// What would lose the run in play, and waits until the player says so.
    pub doubt: Option<Wish>,
    /// Why the exercise could not be started.
    pub trouble: Option<String>,
    /// The exercise in play as it was loaded, to start it again from.
    loaded: Option<LoadedExercise>,
    /// Steps that the gland behind the title has had.
    title_steps: u32,
    wishes: Vec<Wish>,
}

impl GameFlow {
    /// At the briefing of this exercise.
    pub fn at_briefing(loaded: LoadedExercise) -> Self {
        Self {
            phase: Phase::Briefing,
            loaded: Some(loaded),
            ..default()
        }
    }

    /// Asks for something; it is done in the next frame.
    pub fn wish(&mut self, wish: Wish) {
        self.wishes.push(wish);
    }

    /// Whether something was asked for and is not done yet.
    pub fn is_asked(&self, wish: Wish) -> bool {
        self.wishes.contains(&wish)
    }

    /// The name of the exercise in play.
    pub fn exercise(&self) -> Option<&str> {
        self.loaded.as_ref().map(|loaded| loaded.name.as_str())
    }

    /// Whether the gland behind the title is there and has taken shape.
    pub fn title_has_gland(&self) -> bool {
        self.title_steps >= TITLE_STEPS
    }

    /// The title of the exercise that the next start begins.
    #[cfg(test)]
    pub fn next_title(&self) -> Option<&str> {
        self.loaded.as_ref().map(|loaded| loaded.exercise.title.as_str())
    }

    /// The exercise in play says something else by now, which the next start takes up; a briefing that is open shows it at once.
    pub fn renew(&mut self, loaded: LoadedExercise) {
        self.loaded = Some(loaded);
        if self.phase == Phase::Briefing {
            self.wish(Wish::Restart);
        }
    }

    /// Opens the briefing of an exercise, wherever it comes from.
    pub fn open(&mut self, loaded: LoadedExercise) {
        self.loaded = Some(loaded);
        self.wish(Wish::Restart);
    }

    /// Whether a run is in play that it would be a pity to lose.
    pub fn would_lose(&self, metrics: &Metrics) -> bool {
        let is_run = matches!(self.phase, Phase::Playing | Phase::Paused) && !self.watches;
        is_run && metrics.elapsed_s() >= SOON_DONE_AGAIN_S
    }

    /// Whether the instrument is in use, in the player's hands or others'.
    pub fn is_live(&self) -> bool {
        self.phase == Phase::Playing && !self.help
    }
}

/// A gland that is being built on another thread.
#[derive(Resource)]
pub struct Preparing {
    task: Task<Result<PreparedExercise, ExerciseError>>,
}

impl Preparing {
    /// Begins to build.
    pub fn begin(loaded: LoadedExercise) -> Self {
        let task = AsyncComputeTaskPool::get().spawn(async move { loaded.prepare() });
        Self { task }
    }
}

/// Puts the exercise into the world, with keyboard and mouse at the instrument.
pub fn begin(world: &mut World, prepared: PreparedExercise) {
    let active = spawn_exercise(world, prepared);
    world.entity_mut(active.instrument).insert(InstrumentSource::Live);
    // Who it was is told when they are done.
    let somebody = Hands::Person {
        trainee: String::new(),
        ended_unix_s: 0,
    };
    record_run(world, somebody);
    if let Some(mut settings) = world.get_mut::<TissueSettings>(active.tissue) {
        settings.watch_error_every = STEPS_A_WATCH;
    }
    // The title turns the camera.
    for mut camera in world.query::<&mut OutsideCamera>().iter_mut(world) {
        *camera = default();
    }
}

/// The panel shows an error of the step that is never older than this many steps, 2 s: some five steps' work in 120.
const STEPS_A_WATCH: u32 = 120;

fn pause_without_focus(mut focus: MessageReader<WindowFocused>, mut flow: ResMut<GameFlow>) {
    if focus.read().any(|change| !change.focused) && flow.phase == Phase::Playing {
        flow.wish(Wish::Pause);
    }
}

/// Shows the gland that was built meanwhile: at the briefing, or behind the title.
fn take_prepared(preparing: Option<ResMut<Preparing>>, mut flow: ResMut<GameFlow>, mut commands: Commands) {
    let Some(mut preparing) = preparing else { return };
    let Some(prepared) = block_on(poll_once(&mut preparing.task)) else {
        return;
    };
    commands.remove_resource::<Preparing>();
    let is_asked_for = flow.phase == Phase::Preparing;
    match prepared {
        Ok(prepared) => {
            if is_asked_for {
                flow.phase = Phase::Briefing;
            }
            commands.queue(move |world: &mut World| begin(world, prepared));
        }
        Err(error) if is_asked_for => {
            flow.phase = Phase::Choosing;
            flow.trouble = Some(error.to_string());
        }
        // Nothing behind the title, then; who chooses it will be told why.
        Err(_) => {}
    }
}

/// Keeps the run if it is the player's, and goes to the debriefing.
fn notice_end(
    state: Res<RunState>,
    recorder: Option<ResMut<RunRecorder>>,
    mut history: ResMut<History>,
    mut flow: ResMut<GameFlow>,
) {
    let RunState::Ended(_) = *state else { return };
    if !matches!(flow.phase, Phase::Playing | Phase::Paused) {
        return;
    }
    flow.phase = Phase::Result;
    history.record = None;
    if let Some(record) = recorder.and_then(|mut recorder| recorder.take())
        && !flow.watches
    {
        history.add(record);
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
    mut windows: Query<(Entity, &mut Window), With<PrimaryWindow>>,
    mut closing: MessageWriter<WindowCloseRequested>,
    mut catalogue: ResMut<Catalogue>,
    (history, kept): (Res<History>, Res<KeptSettings>),
    (active, metrics): (Option<Res<ActiveExercise>>, Res<Metrics>),
    (buttons, keys): (Res<ButtonInput<MouseButton>>, Res<ButtonInput<KeyCode>>),
    mut commands: Commands,
) {
    for wish in std::mem::take(&mut flow.wishes) {
        let doubt = flow.doubt.take();
        let leads_away = matches!(wish, Wish::Restart | Wish::Choose | Wish::Quit);
        if leads_away && flow.phase == Phase::Paused && flow.would_lose(&metrics) {
            flow.doubt = Some(wish);
            continue;
        }
        let wish = match (wish, doubt) {
            (Wish::Lose, Some(doubt)) => doubt,
            _ => wish,
        };
        match wish {
            Wish::Keep | Wish::Lose => {}
            Wish::Title => flow.phase = Phase::Title,
            Wish::Progress => flow.phase = Phase::Progress,
            Wish::Outlines => flow.phase = Phase::Outlines,
            Wish::Choose => {
                // Whoever comes by way of the title finds the list as they left it.
                if let Some(active) = active.as_ref().filter(|_| flow.phase != Phase::Title) {
                    // Whoever has done all of it goes on.
                    match *state {
                        RunState::Ended(EndReason::GoalsReached) if !flow.watches => {
                            catalogue.select_after(&active.name)
                        }
                        _ => catalogue.select(&active.name),
                    }
                }
                *state = RunState::Briefing;
                flow.phase = Phase::Choosing;
            }
            // What was wished for before the run ended must not lead back into it.
            Wish::Play if !matches!(flow.phase, Phase::Briefing | Phase::Paused) => {}
            Wish::Pause if flow.phase != Phase::Playing => {}
            Wish::End if flow.phase != Phase::Paused => {}
            Wish::Play => {
                flow.phase = Phase::Playing;
                flow.help = false;
                *state = RunState::Running;
            }
            Wish::Watch => {
                let is_shown = active.as_ref().is_some_and(|active| active.demonstration.is_some());
                if is_shown && flow.phase == Phase::Briefing {
                    (flow.phase, flow.help, flow.watches) = (Phase::Playing, false, true);
                    *state = RunState::Running;
                    time.set_relative_speed(SHOWN_SPEED);
                    commands.queue(|world: &mut World| {
                        players::show(world);
                    });
                }
            }
            Wish::WatchAgain => {
                if let Some(record) = history.record.clone().filter(|_| flow.phase == Phase::Result) {
                    commands.queue(move |world: &mut World| {
                        world.resource_mut::<WatchAgain>().watch(&record, None);
                    });
                }
            }
            Wish::Pause => flow.phase = Phase::Paused,
            Wish::Help => flow.help = !flow.help,
            // The debriefing follows when the end is noticed.
            Wish::End => *state = RunState::Ended(EndReason::Player),
            Wish::NextLayout => *layout = layout.next(),
            Wish::Settings => page.open = true,
            Wish::Quit => {
                // The window must not ask once more.
                flow.doubt = doubt;
                closing.write_batch(windows.iter().map(|(window, _)| WindowCloseRequested { window }));
            }
            Wish::Open | Wish::Restart => {
                // Nobody begins without the lens's picture.
                if *layout == ViewLayout::Outside {
                    *layout = ViewLayout::default();
                }
                if wish == Wish::Open {
                    let chosen = catalogue.entries.get(catalogue.selected);
                    let is_locked =
                        chosen.is_some_and(|entry| catalogue.lock(entry, &history, kept.all_open).is_some());
                    if is_locked {
                        // What it takes stands beside the list.
                        continue;
                    }
                    flow.loaded = chosen.map(|entry| entry.loaded.clone());
                }
                if let Some(loaded) = flow.loaded.clone() {
                    for (_, mut window) in &mut windows {
                        window.title = format!("Resecta: {}", loaded.exercise.title);
                    }
                    flow.phase = Phase::Preparing;
                    flow.watches = false;
                    flow.trouble = None;
                    commands.insert_resource(Preparing::begin(loaded));
                }
            }
        }
    }

    if !matches!(flow.phase, Phase::Playing | Phase::Paused) && time.relative_speed() != 1.0 {
        time.set_relative_speed(1.0);
    }
    let is_live = flow.is_live() && !page.open;
    let takes_shape = flow.phase == Phase::Title && !flow.title_has_gland() && active.is_some();
    flow.title_steps += u32::from(takes_shape);
    let is_still = page.open || !is_live && flow.phase != Phase::Briefing && !takes_shape;
    if is_still && !time.is_paused() {
        time.pause();
    } else if !is_still && time.is_paused() {
        time.unpause();
    }
    if !is_live {
        // Loading, and what is drawn for the first time, tell nothing of how fast the machine plays.
        pace.forget();
    }
    flow.turning = buttons.pressed(MouseButton::Middle);
    // A click or key that began the game is still held: it must do nothing else before it was let go once.
    let holds_over = !live.captured
        && (buttons.any_pressed([MouseButton::Left, MouseButton::Right])
            || keys.any_pressed([KeyCode::Enter, KeyCode::NumpadEnter, KeyCode::Space]));
    let has_hands_on = is_live && !flow.watches;
    let captured = has_hands_on && !flow.turning && !holds_over;
    if live.captured != captured {
        live.captured = captured;
    }
    for mut cursor in &mut cursors {
        let grab = if has_hands_on {
            CursorGrabMode::Locked
        } else {
            CursorGrabMode::None
        };
        if cursor.grab_mode != grab || cursor.visible == has_hands_on {
            cursor.grab_mode = grab;
            cursor.visible = !has_hands_on;
        }
    }
}

#[cfg(test)]
mod tests {
    use std::fs;

    use resecta_records::RecorderPlugin;
    use resecta_scenario::new_exercise;

    use super::*;
    use crate::{game::catalogue::Sources, players::PlayersPlugin, testing::Trial};

    /// An exercise on a coarse gland that a script shows for half a second.
    fn shown(folder: &std::path::Path) -> LoadedExercise {
        let script = "(keys: [(time_s: 0, stroke_mm: 0), (time_s: 0.5, stroke_mm: 5)])";
        fs::write(folder.join("show.ron"), script).unwrap();
        let text = new_exercise("shown").replace("alpha_deg: 14", "alpha_deg: 20");
        let text = text.replace("shown_by: Careful", "shown_by: Script(\"./show.ron\")");
        let file = folder.join("shown.exercise.ron");
        let library = resecta_scenario::Library::new(crate::assets::find().unwrap());
        library.load_text(&text, &file).unwrap()
    }

    fn game(loaded: &LoadedExercise) -> Trial {
        let sources = Sources {
            library: resecta_scenario::Library::new("no assets"),
            mods: None,
            own: None,
        };
        let catalogue = sources.read();
        let mut trial = Trial::new((PlayersPlugin, RecorderPlugin));
        let app = &mut trial.app;
        app.add_message::<WindowCloseRequested>()
            .insert_resource(catalogue)
            .insert_resource(GameFlow::at_briefing(loaded.clone()))
            .init_resource::<History>()
            .init_resource::<ViewLayout>()
            .init_resource::<SettingsPage>()
            .init_resource::<KeptSettings>()
            .init_resource::<Pace>()
            .init_resource::<LiveInput>()
            .init_resource::<ButtonInput<MouseButton>>()
            .init_resource::<ButtonInput<KeyCode>>()
            .add_systems(Update, (notice_end, carry_out).chain());
        begin(app.world_mut(), loaded.clone().prepare().unwrap());
        trial
    }

    fn flow(trial: &mut Trial) -> Mut<'_, GameFlow> {
        trial.app.world_mut().resource_mut()
    }

    #[test]
    fn what_is_shown_leads_to_the_debriefing_and_is_nobodys_run() {
        let folder = tempfile::tempdir().unwrap();
        let loaded = shown(folder.path());
        let mut trial = game(&loaded);
        flow(&mut trial).wish(Wish::Watch);
        trial.steps(10);
        assert_eq!(flow(&mut trial).phase, Phase::Playing);
        let speed = |trial: &Trial| trial.app.world().resource::<Time<Virtual>>().relative_speed();
        assert_eq!(speed(&trial), SHOWN_SPEED);
        let source: &InstrumentSource = trial.on_instrument().unwrap();
        assert!(matches!(source, InstrumentSource::Script(_)));
        assert!(!trial.app.world().resource::<LiveInput>().captured, "no hands on it");
        trial.steps((30.0 / SHOWN_SPEED) as u32);
        assert_eq!(trial.state(), RunState::Ended(EndReason::InputEnded));
        assert!(flow(&mut trial).phase == Phase::Result && flow(&mut trial).watches);
        assert_eq!(speed(&trial), 1.0);
        assert!(trial.app.world().resource::<History>().is_empty());

        // The same run by the player counts.
        let mut trial = game(&loaded);
        flow(&mut trial).wish(Wish::Play);
        trial.steps(10);
        assert!(trial.app.world().resource::<LiveInput>().captured);
        flow(&mut trial).wish(Wish::Pause);
        trial.steps(2);
        flow(&mut trial).wish(Wish::End);
        trial.steps(2);
        assert_eq!(flow(&mut trial).phase, Phase::Result);
        assert_eq!(trial.app.world().resource::<History>().runs().len(), 1);
    }

    #[test]
    fn whoever_has_done_all_of_it_looks_at_the_next_exercise() {
        let folder = tempfile::tempdir().unwrap();
        let mut trial = game(&shown(folder.path()));
        let shipped = Sources {
            library: resecta_scenario::Library::new(crate::assets::find().unwrap()),
            mods: None,
            own: None,
        };
        let catalogue = shipped.read();
        let names: Vec<String> = catalogue
            .entries
            .iter()
            .map(|entry| entry.loaded.name.clone())
            .collect();
        trial.app.insert_resource(catalogue);
        let last = names.len() - 1;
        for (done, reason, watches, looked_at) in [
            (0, EndReason::GoalsReached, false, 1),
            (0, EndReason::GoalsReached, true, 0),
            (2, EndReason::Player, false, 2),
            (last, EndReason::GoalsReached, false, last),
        ] {
            let world = trial.app.world_mut();
            world.resource_mut::<ActiveExercise>().name = names[done].clone();
            *world.resource_mut::<RunState>() = RunState::Ended(reason);
            let mut flow = flow(&mut trial);
            (flow.phase, flow.watches) = (Phase::Result, watches);
            flow.wish(Wish::Choose);
            trial.steps(1);
            assert_eq!(
                trial.app.world().resource::<Catalogue>().selected,
                looked_at,
                "{done} {reason:?}"
            );
        }
    }

    #[test]
    fn a_run_is_lost_only_by_who_says_so_twice() {
        let folder = tempfile::tempdir().unwrap();
        let loaded = shown(folder.path());
        let mut trial = game(&loaded);
        let ask = |trial: &mut Trial, wish: Wish| {
            flow(trial).wish(wish);
            trial.steps(1);
            let flow = flow(trial);
            (flow.phase, flow.doubt)
        };
        let played = |trial: &mut Trial, steps: u32| {
            ask(trial, Wish::Play);
            trial.steps(steps);
            ask(trial, Wish::Pause);
        };
        let enough = (SOON_DONE_AGAIN_S * 60.0) as u32 + 2;
        played(&mut trial, enough);
        for wish in [Wish::Restart, Wish::Choose, Wish::Quit] {
            assert_eq!(ask(&mut trial, wish), (Phase::Paused, Some(wish)));
            assert_eq!(ask(&mut trial, Wish::Keep), (Phase::Paused, None));
        }
        // Told of nothing else once it was kept.
        assert_eq!(ask(&mut trial, Wish::Lose), (Phase::Paused, None));
        ask(&mut trial, Wish::Choose);
        assert_eq!(ask(&mut trial, Wish::Play), (Phase::Playing, None));
        ask(&mut trial, Wish::Pause);
        ask(&mut trial, Wish::Quit);
        // Who closes the window reads there that the question is answered.
        assert_eq!(ask(&mut trial, Wish::Lose), (Phase::Paused, Some(Wish::Quit)));
        ask(&mut trial, Wish::Choose);
        assert_eq!(ask(&mut trial, Wish::Lose), (Phase::Choosing, None));

        // What is soon done again is not asked about.
        let mut trial = game(&loaded);
        played(&mut trial, 60);
        assert_eq!(ask(&mut trial, Wish::Restart).0, Phase::Preparing);
    }

    #[test]
    fn nobody_watches_what_nobody_shows() {
        let folder = tempfile::tempdir().unwrap();
        let loaded = LoadedExercise {
            demonstration: None,
            ..shown(folder.path())
        };
        let mut trial = game(&loaded);
        flow(&mut trial).wish(Wish::Watch);
        trial.steps(2);
        assert_eq!(flow(&mut trial).phase, Phase::Briefing);
    }
}
