//! The game: a window with both views, a panel beside them, and somebody's hands on the instrument.
//!
//! | to find | look in |
//! |---|---|
//! | briefing, play, pause, result, and the keys between them | `flow.rs` |
//! | which view is where in the window | `layout.rs` |
//! | the panel at the side | `panel.rs` |
//! | what lies over the views: briefing, help, result, warnings | `overlay.rs` |
//! | how fast it runs | `pace.rs` |
//! | the player's settings, their file and their page | `settings/` |
//! | what is shown and felt at the end of the instrument's way | `stops.rs` |

mod display;
mod flow;
mod layout;
mod overlay;
mod pace;
mod panel;
mod settings;
mod stops;

use bevy::{
    log::LogPlugin,
    prelude::*,
    window::{PresentMode, WindowResolution},
};
use bevy_egui::EguiPlugin;
use resecta_instrument::LiveInput;
use resecta_scenario::{ExerciseError, Library, LoadedExercise};
use thiserror::Error;

use crate::{
    ResectaPlugins,
    assets::{self, AssetsMissing},
    view::{NoAdapter, ViewPlugin, adapter_available},
};

pub use display::NoDisplay;
pub use flow::{GameFlow, Phase};
pub use layout::ViewLayout;
pub use settings::{KeptSettings, Settings, SettingsError, SettingsFile, SettingsPage, SettingsPlugin};

/// What to play.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct GameOptions {
    /// Name of a shipped exercise or path of an exercise file.
    pub exercise: String,
}

impl Default for GameOptions {
    /// The first exercise.
    fn default() -> Self {
        GameOptions {
            exercise: "first_cuts".into(),
        }
    }
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
}

/// The exercise as it was loaded, to start it again from.
#[derive(Resource, Debug, Clone)]
struct Loaded(LoadedExercise);

/// Opens the game and returns when its window is closed.
///
/// # Errors
/// [`GameError`]: no display, no graphics adapter, no such exercise. Nothing was opened then.
pub fn run(options: GameOptions) -> Result<(), GameError> {
    display::check()?;
    adapter_available()?;
    let loaded = Library::new(assets::find()?).load(&options.exercise)?;
    let prepared = loaded.clone().prepare()?;

    let mut app = App::new();
    app.add_plugins((
        DefaultPlugins
            .set(WindowPlugin {
                primary_window: Some(Window {
                    title: format!("Resecta: {}", loaded.exercise.title),
                    resolution: WindowResolution::new(1280, 720),
                    present_mode: PresentMode::AutoVsync,
                    ..default()
                }),
                ..default()
            })
            .set(LogPlugin {
                filter: "warn,wgpu_hal=error".into(),
                ..default()
            }),
        EguiPlugin::default(),
        ResectaPlugins,
        ViewPlugin,
        flow::plugin,
        layout::plugin,
        pace::plugin,
        panel::plugin,
        overlay::plugin,
        stops::plugin,
        SettingsPlugin {
            file: SettingsFile::of_user(),
        },
    ));
    app.insert_resource(Loaded(loaded));
    // Keyboard and mouse are the menu's until play begins.
    app.world_mut().resource_mut::<LiveInput>().captured = false;
    flow::begin(app.world_mut(), prepared);
    app.run();
    Ok(())
}
