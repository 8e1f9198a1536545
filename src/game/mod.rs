//! The game: a window with both views, a panel beside them, and somebody's hands on the instrument.
//!
//! | to find | look in |
//! |---|---|
//! | title, choice, briefing, play, pause, debriefing, and what leads from one to the other | `flow.rs` |
//! | the keys of the game | `keys.rs` |
//! | the title | `title.rs` |
//! | choosing an exercise, and its picture | `choose.rs`, `catalogue.rs`, `sketch.rs` |
//! | files that change while the game runs | `reload.rs` |
//! | who plays, their records and scores | `history.rs` |
//! | choosing who plays, and learning curves | `progress.rs` |
//! | which view is where in the window | `layout.rs` |
//! | the outside view turned | `outside.rs` |
//! | the panel at the side | `panel.rs` |
//! | what lies over the views: briefing, pause, help, warnings | `overlay.rs` |
//! | the present step of a tutorial | `tutorial.rs` |
//! | what the hands do that show an exercise | `shown.rs` |
//! | landmarks, distances, slices and map over the views | `guidance/` |
//! | outlines on ultrasound images, mended by hand | `outlines/` |
//! | what a run came to: score, plots, map, advice | `debrief/` |
//! | colours | `palette.rs` |
//! | sizes, buttons, the keyboard's focus | `menu.rs` |
//! | pictures of key moments | `moments.rs` |
//! | records played again, with a ghost | `replay/`, and from the game `again.rs` |
//! | how fast it runs | `pace.rs` |
//! | how finely it is drawn where that is too slow | `fineness.rs` |
//! | how many steps a late frame makes up for | `catch_up.rs` |
//! | pictures of all of it | `gallery/` |
//! | the player's settings, their file and their page | `settings/` |
//! | what is heard | `sound/` |
//! | what is told of vessels under the coagulating current | `closing.rs` |
//! | what is shown and felt at the end of the instrument's way | `stops.rs` |

mod again;
mod catalogue;
mod catch_up;
mod choose;
mod closing;
mod debrief;
mod display;
mod fineness;
mod flow;
mod gallery;
mod guidance;
mod history;
mod keys;
mod layout;
mod menu;
mod menu_pad;
mod moments;
mod outlines;
mod outside;
mod overlay;
mod pace;
mod palette;
mod panel;
mod progress;
mod reload;
mod replay;
mod settings;
mod shown;
mod sketch;
mod sound;
mod stops;
mod title;
mod tutorial;
mod unlock;
mod way;

use std::path::PathBuf;

use bevy::{
    app::{PluginGroupBuilder, Plugins},
    log::LogPlugin,
    prelude::*,
    render::{RenderPlugin, settings::WgpuSettings},
    transform::systems::StaticTransformOptimizations,
    window::{PresentMode, WindowResolution},
    winit::WinitPlugin,
};
use bevy_egui::EguiPlugin;
use resecta_instrument::LiveInput;
use resecta_records::{RecordError, RecorderPlugin};
use resecta_scenario::{ExerciseError, Extensions, Library, LoadCaseError, LoadedExercise, RunLog};
use thiserror::Error;

use crate::{
    ResectaPlugins,
    assets::{self, AssetsMissing},
    players::PlayersPlugin,
    view::{DrawBetweenSteps, NoAdapter, ViewPlugin, adapter_available},
};

pub use display::NoDisplay;
pub use flow::{GameFlow, Phase};
pub use gallery::GalleryError;
pub use layout::ViewLayout;
pub use outlines::{ImageFiles, Images};
pub use replay::{ReplayOptions, replay};
pub use settings::{KeptSettings, Settings, SettingsError, SettingsFile, SettingsPage, SettingsPlugin, SoundSettings};
pub use sound::{SoundDevice, SoundOutput};

/// What to play.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct GameOptions {
    /// Name of a shipped exercise, `mod/exercise` or the path of an exercise file, to open its briefing; none to open the title.
    pub exercise: Option<String>,
    /// The case to play that exercise on, in place of its own: the name of a shipped one or the path of a file.
    pub case: Option<String>,
    /// Images to outline, to open these; not together with an exercise.
    pub images: Option<Images>,
    /// The program whose `replay FILE` shows a record: who has played can then watch it again, in a window of its own.
    pub replays_by: Option<PathBuf>,
}

/// Why the game did not open.
#[derive(Debug, Error)]
pub enum GameError {
    /// Nowhere to open a window.
    #[error(transparent)]
    NoDisplay(#[from] NoDisplay),
    /// Nothing to draw with.
    #[error(transparent)]
    NoAdapter(#[from] NoAdapter),
    /// No assets.
    #[error(transparent)]
    Assets(#[from] AssetsMissing),
    /// The exercise is at fault.
    #[error(transparent)]
    Exercise(#[from] ExerciseError),
    /// The case to play it on is.
    #[error(transparent)]
    Case(#[from] LoadCaseError),
    /// A record that is to be shown is at fault.
    #[error(transparent)]
    Record(#[from] RecordError),
    /// The ghost's run was on another gland.
    #[error("{}: a run on another gland ({ghost}), which can be no ghost beside one on {shown}", file.display())]
    OtherGland {
        /// The ghost's record.
        file: PathBuf,
        /// Its case.
        ghost: String,
        /// The case that is shown.
        shown: String,
    },
    /// A picture of the gallery is missing.
    #[error(transparent)]
    Gallery(#[from] GalleryError),
}

/// Whose settings and scores the game has.
enum Player {
    /// Those of the user.
    User,
    /// None: the defaults, and nothing is kept.
    Nobody,
}

/// Opens the game and returns when its window is closed.
///
/// # Errors
/// [`GameError`]: no display, no graphics adapter, no such exercise. Nothing was opened then.
pub fn run(options: GameOptions) -> Result<(), GameError> {
    run_with(options, ())
}

/// As [`run`], with extensions: plugins that register metrics, goals and exercises. They are added before all others.
///
/// # Errors
/// As of [`run`].
pub fn run_with<M>(options: GameOptions, extensions: impl Plugins<M>) -> Result<(), GameError> {
    open(options, Player::User, extensions)?.run();
    Ok(())
}

/// Opens the game, draws pictures of all its screens and states into a folder, one of each size, and closes it. Returns the files.
///
/// # Errors
/// [`GameError`]: as of [`run`], or a picture could not be made.
pub fn gallery(folder: PathBuf) -> Result<Vec<PathBuf>, GameError> {
    let outcome = gallery::Outcome::default();
    let mut app = open(GameOptions::default(), Player::Nobody, ())?;
    app.add_plugins(gallery::GalleryPlugin {
        folder,
        scripts: assets::find()?.join("scripts"),
        outcome: outcome.clone(),
    });
    app.run();
    let outcome = outcome.lock().ok().and_then(|mut outcome| outcome.take());
    Ok(outcome.unwrap_or(Err(GalleryError::Closed))?)
}

/// Threads that systems run on, at least: a step of the tissue keeps one of them, and the picture of the step before is drawn
/// meanwhile. Left to itself, Bevy has a single one where there are two cores, and draws only once the step is done.
const LEAST_THREADS: usize = 2;

/// A window of this title.
fn window(title: String) -> WindowPlugin {
    WindowPlugin {
        primary_window: Some(Window {
            title,
            resolution: WindowResolution::new(1280, 720),
            present_mode: PresentMode::AutoVsync,
            ..default()
        }),
        ..default()
    }
}

/// Bevy's own plugins, with a window.
fn in_window(window: WindowPlugin, waits_for_shaders: bool) -> PluginGroupBuilder {
    let mut threads = TaskPoolOptions::default();
    threads.compute.min_threads = LEAST_THREADS;
    DefaultPlugins
        .set(TaskPoolPlugin {
            task_pool_options: threads,
        })
        .set(window)
        .set(RenderPlugin {
            synchronous_pipeline_compilation: waits_for_shaders,
            ..default()
        })
        .set(LogPlugin {
            filter: "warn,wgpu_hal=error".into(),
            ..default()
        })
}

/// All of the game but its window and what is drawn by itself.
fn add_screens(app: &mut App, player: &Player) {
    let (file, history) = match player {
        Player::User => (SettingsFile::of_user(), history::History::load()),
        Player::Nobody => (None, history::History::default()),
    };
    app.add_plugins((
        EguiPlugin::default(),
        PlayersPlugin,
        (menu::plugin, menu_pad::plugin),
        flow::plugin,
        (layout::plugin, outside::plugin),
        (pace::plugin, fineness::plugin),
        (panel::plugin, overlay::plugin, shown::plugin),
        title::plugin,
        (choose::plugin, progress::plugin, outlines::plugin, RecorderPlugin),
        tutorial::plugin,
        moments::plugin,
        (debrief::plugin, again::plugin),
        (stops::plugin, closing::plugin, sound::plugin),
        guidance::plugin,
        SettingsPlugin { file },
    ));
    app.init_resource::<DrawBetweenSteps>()
        .init_resource::<RunLog>()
        // Of the few things that have a place of their own most move: to look for those that do not takes longer.
        .insert_resource(StaticTransformOptimizations::Disabled)
        .insert_resource(history);
}

/// Everything of a window's app but an adapter, an event loop and the log. No window opens; the app has one of Bevy's default size.
pub fn without_display() -> PluginGroupBuilder {
    DefaultPlugins
        .set(RenderPlugin {
            render_creation: WgpuSettings {
                backends: None,
                ..default()
            }
            .into(),
            ..default()
        })
        .disable::<LogPlugin>()
        .disable::<WinitPlugin>()
}

/// Adds the game's screens, panel and guidance to an app without a display, as if an exercise were shown in play: what they cost a
/// frame is measured so (`benches/frame.rs`). The app has the plugins of [`without_display`], [`ResectaPlugins`] and
/// [`ViewPlugin`]; nothing of the user is read or kept.
pub fn add_screens_in_play(app: &mut App, library: Library, exercise: LoadedExercise) {
    add_screens(app, &Player::Nobody);
    let sources = catalogue::Sources {
        library,
        mods: None,
        own: None,
    };
    let mut flow = GameFlow::at_briefing(exercise);
    (flow.phase, flow.watches) = (Phase::Playing, true);
    app.insert_resource(sources.read()).insert_resource(flow);
}

/// The game, ready to run.
fn open<M>(options: GameOptions, player: Player, extensions: impl Plugins<M>) -> Result<App, GameError> {
    display::check()?;
    adapter_available()?;
    let mut app = App::new();
    app.add_plugins(extensions);
    let extensions = app.world().get_resource::<Extensions>().cloned().unwrap_or_default();
    let sources = catalogue::Sources {
        library: Library::new(assets::find()?).with_extensions(extensions),
        mods: match player {
            Player::User => assets::mods_folder(),
            Player::Nobody => None,
        },
        own: options.exercise.clone(),
    };
    let chosen = options.exercise.map(|name| sources.library().load(&name));
    let chosen = match (chosen.transpose()?, options.case) {
        (Some(loaded), Some(case)) => {
            let on = sources.library().load_case(&case)?;
            Some(loaded.on_case(&case, on))
        }
        (chosen, _) => chosen,
    };
    let prepared = chosen.clone().map(|loaded| loaded.prepare()).transpose()?;
    let mut catalogue = sources.read();
    let title = match &chosen {
        Some(loaded) => format!("Resecta: {}", loaded.exercise.title),
        None => "Resecta".into(),
    };

    app.add_plugins((
        // Who waits for pictures waits for shaders. `outlines` closes the window.
        in_window(
            WindowPlugin {
                close_when_requested: false,
                ..window(title)
            },
            matches!(player, Player::Nobody),
        ),
        ResectaPlugins,
        ViewPlugin,
    ));
    add_screens(&mut app, &player);
    if let Player::User = player {
        app.add_plugins((reload::ReloadPlugin { sources }, catch_up::plugin));
    }
    // Keyboard and mouse are the menu's until play begins.
    app.world_mut().resource_mut::<LiveInput>().captured = false;
    match (chosen, prepared) {
        (Some(loaded), Some(prepared)) => {
            catalogue.select(&loaded.name);
            app.insert_resource(GameFlow::at_briefing(loaded));
            flow::begin(app.world_mut(), prepared);
        }
        _ => {
            // Something to turn behind the title.
            if let Some(entry) = catalogue.entries.first() {
                app.insert_resource(flow::Preparing::begin(entry.loaded.clone()));
            }
        }
    }
    if let Some(program) = options.replays_by {
        app.insert_resource(again::WatchAgain::by(program));
    }
    if let Some(images) = options.images {
        app.world_mut().resource_mut::<GameFlow>().phase = Phase::Outlines;
        app.world_mut().resource_mut::<outlines::Editor>().begin(images);
    }
    app.insert_resource(catalogue);
    Ok(app)
}
