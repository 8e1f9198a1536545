//! A record played again in a window: both views, a bar to pause, seek and change the speed, and the ghost of another run.
//!
//! The simulation makes every step again, for nothing else knows where each node was: going back means to play from the start, as
//! fast as the machine can, and so does skipping ahead from where it is. All the while it is compared with the record.
//!
//! | to find | look in |
//! |---|---|
//! | how many steps a frame makes | `clock.rs` |
//! | the bar, keys and mouse | `bar.rs` |

mod bar;
mod clock;

use std::{path::PathBuf, time::Duration};

use bevy::{prelude::*, time::TimeUpdateStrategy, window::PrimaryWindow};
use bevy_egui::EguiPlugin;
use resecta_instrument::InstrumentState;
use resecta_records::{Replay, ReplayPlugin, RunRecord};
use resecta_scenario::{Extensions, RunLog};

use self::clock::ReplayClock;
use super::{
    GameError, ResectaPlugins, ViewLayout, ViewPlugin, adapter_available, display,
    flow::{GameFlow, Phase},
    in_window, layout, menu, window,
};
use crate::view::{EndoscopeCamera, Ghost, OutsideCamera, ViewSystems};

/// What to show.
#[derive(Debug, Clone, PartialEq)]
pub struct ReplayOptions {
    /// The record, and the file that it is from.
    pub record: (PathBuf, RunRecord),
    /// Another run on the same gland, whose instrument is shown, too.
    pub ghost: Option<(PathBuf, RunRecord)>,
}

/// Shows a record and returns when its window is closed.
///
/// # Errors
/// [`GameError`]: no display, no graphics adapter, a record whose exercise is refused, a ghost of another gland. Nothing was opened
/// then.
pub fn replay(options: ReplayOptions) -> Result<(), GameError> {
    open(options)?.run();
    Ok(())
}

/// The record that is shown.
#[derive(Resource)]
struct Shown {
    file: PathBuf,
    record: RunRecord,
}

/// The way of the ghost's instrument, beginning with its run.
#[derive(Component)]
struct GhostWay(Vec<InstrumentState>);

fn open(options: ReplayOptions) -> Result<App, GameError> {
    display::check()?;
    adapter_available()?;
    let (file, record) = options.record;
    let prepared = Replay::prepare(&record, &file, &Extensions::default())?;
    let ghost = options.ghost.map(|(ghost_file, ghost)| {
        let there = Replay::prepare(&ghost, &ghost_file, &Extensions::default())?;
        if ghost.case != record.case {
            return Err(GameError::OtherGland {
                file: ghost_file,
                ghost: there.loaded.case.name.clone(),
                shown: prepared.loaded.case.name.clone(),
            });
        }
        let scope = there.resectoscope;
        let way = ghost.states.into_iter().skip(ghost.begins_after as usize).collect();
        let state = ghost.start;
        Ok((Ghost { scope, state }, GhostWay(way)))
    });
    let ghost = ghost.transpose()?;

    let mut app = App::new();
    app.add_plugins((
        in_window(window(format!("Resecta: {}", prepared.loaded.exercise.title)), false),
        EguiPlugin::default(),
        ResectaPlugins,
        ViewPlugin,
        ReplayPlugin,
        // Style and size of what is shown.
        menu::plugin,
        clock::plugin,
        bar::plugin,
    ));
    app.init_resource::<ViewLayout>()
        .init_resource::<RunLog>()
        .init_resource::<GameFlow>()
        .add_systems(Startup, layout::add_cameras)
        .add_systems(Update, (arrange, super::outside::turn).in_set(ViewSystems::First))
        .add_systems(Update, follow_ghost.before(ViewSystems::First));
    // Keys turn the outside view; at the title it turns by itself.
    app.world_mut().resource_mut::<GameFlow>().phase = Phase::Briefing;
    // Steps are counted here, and no frame is too long.
    app.world_mut()
        .resource_mut::<Time<Virtual>>()
        .set_max_delta(Duration::from_secs(3600));
    app.insert_resource(TimeUpdateStrategy::FixedTimesteps(0));
    if let Some(ghost) = ghost {
        app.world_mut().spawn(ghost);
    }
    app.insert_resource(ReplayClock::of(&record));
    app.insert_resource(Shown {
        file,
        record: record.clone(),
    });
    Replay::start(app.world_mut(), record, prepared);
    Ok(app)
}

/// The ghost is where its run was as long after its begin as this one is.
fn follow_ghost(clock: Res<ReplayClock>, mut ghosts: Query<(&GhostWay, &mut Ghost)>) {
    for (way, mut ghost) in &mut ghosts {
        let step = clock.played().saturating_sub(1) as usize;
        if let Some(state) = way.0.get(step).or(way.0.last()) {
            ghost.state = *state;
        }
    }
}

fn arrange(
    (layout, clock): (Res<ViewLayout>, Res<ReplayClock>),
    zoom: Res<menu::UiZoom>,
    windows: Query<&Window, With<PrimaryWindow>>,
    mut endoscopes: Query<&mut Camera, (With<EndoscopeCamera>, Without<OutsideCamera>)>,
    mut outsides: Query<&mut Camera, With<OutsideCamera>>,
) {
    let Ok(window) = windows.single() else { return };
    let bar = (bar::HEIGHT * zoom.0 * window.scale_factor()).ceil() as u32;
    let size = window.physical_size();
    let area = UVec2::new(size.x, size.y.saturating_sub(bar));
    // A minimised window has no size.
    if area.cmplt(UVec2::splat(32)).any() {
        return;
    }
    let [endoscope, outside] = match clock.is_far() {
        true => [None, None],
        false => layout.places(area),
    };
    endoscopes
        .iter_mut()
        .for_each(|mut camera| layout::place(&mut camera, endoscope));
    outsides
        .iter_mut()
        .for_each(|mut camera| layout::place(&mut camera, outside));
}
