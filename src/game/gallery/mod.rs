//! Pictures of the game as a player sees it: every screen, what the instrument does, what becomes of tissue, at two sizes.
//!
//! The game is opened in a window and led through a list of deeds by the ways that a player has: buttons, keys that arrange the
//! views, an instrument that moves by a script. Steps are counted and no clock is read, and neither settings nor scores of the
//! user are, so that the same build on the same adapter draws the same pictures. The views are drawn for the pictures alone, and
//! one operation serves all sizes: the window changes its size for each picture.

mod plan;

use std::{
    collections::VecDeque,
    path::{Path, PathBuf},
    sync::{Arc, Mutex},
    time::{Duration, Instant},
};

use bevy::{
    prelude::*,
    render::view::screenshot::{Screenshot, ScreenshotCaptured},
    time::TimeUpdateStrategy,
    window::PrimaryWindow,
};
use bevy_egui::PrimaryEguiContext;
use resecta_instrument::{InstrumentScript, InstrumentSource, Resectoscope, ScriptError};
use resecta_records::{Hands, record_run};
use resecta_scenario::{ActiveExercise, Metrics};
use thiserror::Error;

use self::plan::Deed;
use super::{
    catalogue::Catalogue,
    debrief::Debriefing,
    flow::{GameFlow, Phase, Wish},
    guidance::Guidance,
    layout::ViewLayout,
    outlines::{Editor, Images},
    settings::KeptSettings,
};
use crate::{
    players,
    view::{ViewSystems, save_picture},
};

/// Names and sizes of the pictures, pixels. The window has the first one on the way.
const SIZES: [(&str, [u32; 2]); 2] = [("1280x720", [1280, 720]), ("2560x1440", [2560, 1440])];
/// Frames that a screen gets to settle, what fades in included, before its picture is taken.
const SETTLE_FRAMES: u32 = 10;
/// Frames that are drawn at each size before its picture is: what was just switched on is complete by then.
const DRAWN_FRAMES: u32 = 2;
/// Frames in which a window takes a new size.
const RESIZE_FRAMES: u32 = 3;
/// Steps a frame on the way to the next picture,
const STEPS_A_FRAME: u32 = 12;
/// but for the last of it, s: jets and sparks, which are of frames, are then as in play.
const IN_STEP_S: f64 = 0.5;
/// How time goes where nothing is waited for: what fades in goes by it, too.
const A_STEP_A_FRAME: TimeUpdateStrategy = TimeUpdateStrategy::ManualDuration(Duration::from_micros(16_667));
/// How it goes while a picture is on its way.
const STANDING: TimeUpdateStrategy = TimeUpdateStrategy::ManualDuration(Duration::ZERO);
/// So many frames, and so long a time, may pass without a deed being done before something is wrong: runs go by frames, and what is
/// computed beside them, as outlines are, by time, however many frames are drawn meanwhile.
const PATIENCE_FRAMES: u32 = 5000;
const PATIENCE: Duration = Duration::from_secs(600);

/// A gallery that could not be made.
#[derive(Debug, Error)]
pub enum GalleryError {
    /// A picture could not be written.
    #[error(transparent)]
    Picture(#[from] crate::view::PictureError),
    /// A script of the gallery is at fault.
    #[error(transparent)]
    Script(#[from] ScriptError),
    /// The window was closed on the way.
    #[error("the window was closed before the last picture")]
    Closed,
    /// The game did not come to the next picture.
    #[error("after {} pictures the game did not come to {wanted}", written.len())]
    Stuck {
        /// What was waited for.
        wanted: String,
        /// What was written by then.
        written: Vec<PathBuf>,
    },
}

/// What came of it, for whoever opened the window; none as long as it goes on.
pub(super) type Outcome = Arc<Mutex<Option<Result<Vec<PathBuf>, GalleryError>>>>;

/// Leads the game through the gallery and closes the window.
pub(super) struct GalleryPlugin {
    /// Where the pictures go.
    pub folder: PathBuf,
    /// Where the shipped scripts are.
    pub scripts: PathBuf,
    /// What came of it.
    pub outcome: Outcome,
}

impl Plugin for GalleryPlugin {
    fn build(&self, app: &mut App) {
        // Nobody waits for a frame here: each may make all of its steps.
        app.world_mut()
            .resource_mut::<Time<Virtual>>()
            .set_max_delta(Duration::from_secs(1));
        app.insert_resource(Gallery {
            folder: self.folder.clone(),
            scripts: self.scripts.clone(),
            deeds: plan::deeds(),
            waited: 0,
            last_done: Instant::now(),
            stage: Stage::Settling,
            is_watched: false,
            written: Vec::new(),
            failed: None,
            outcome: self.outcome.clone(),
        })
        .insert_resource(A_STEP_A_FRAME)
        .add_systems(PostStartup, |world: &mut World| resize(world, 0))
        .add_systems(First, lead)
        .add_systems(Update, cover.after(ViewSystems::First).before(ViewSystems::Dress));
    }
}

#[derive(Resource)]
struct Gallery {
    folder: PathBuf,
    scripts: PathBuf,
    deeds: VecDeque<Deed>,
    /// Frames since the last deed was done.
    waited: u32,
    /// When that was.
    last_done: Instant,
    /// How far the next picture is.
    stage: Stage,
    /// Whether the views are drawn between pictures, too.
    is_watched: bool,
    written: Vec<PathBuf>,
    failed: Option<GalleryError>,
    outcome: Outcome,
}

/// How far a picture is, and which of [`SIZES`] it has.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Stage {
    /// The screen settles.
    Settling,
    /// The views are drawn, for so many frames by now.
    Drawn { size: usize, frames: u32 },
    /// The picture is on its way; once the renderer has all of it, nothing more need be drawn.
    Asked { size: usize, is_extracted: bool },
    /// It has come.
    Taken { size: usize },
    /// The window gets this size, for so many frames by now. Nothing is drawn: views and window differ in size meanwhile.
    Resizing { size: usize, frames: u32 },
}

/// Switches off what nobody looks at: the views between pictures, and everything while the window changes its size.
fn cover(gallery: Res<Gallery>, mut cameras: Query<(&mut Camera, Has<PrimaryEguiContext>)>) {
    let is_shown = match gallery.stage {
        Stage::Drawn { .. }
        | Stage::Asked {
            is_extracted: false, ..
        } => true,
        Stage::Settling => gallery.is_watched,
        _ => false,
    };
    for (mut camera, is_screen) in &mut cameras {
        if is_screen {
            camera.is_active = is_shown;
        } else if !is_shown {
            camera.is_active = false;
        }
    }
}

/// Does the next deed, once its time has come.
fn lead(world: &mut World) {
    world.resource_scope(|world, mut gallery: Mut<Gallery>| {
        let next = gallery.deeds.front().copied();
        let is_done = next.is_none_or(|deed| do_or_wait(world, &mut gallery, deed));
        if is_done {
            (gallery.waited, gallery.last_done) = (0, Instant::now());
        } else {
            gallery.waited += 1;
        }
        if is_done && gallery.deeds.pop_front().is_none() {
            let written = std::mem::take(&mut gallery.written);
            finish(world, &gallery.outcome, Ok(written));
        }
        if gallery.waited > PATIENCE_FRAMES && gallery.last_done.elapsed() > PATIENCE {
            let stuck = GalleryError::Stuck {
                wanted: next.map_or_else(|| "its end".into(), |deed| format!("{deed:?}")),
                written: std::mem::take(&mut gallery.written),
            };
            gallery.failed.get_or_insert(stuck);
        }
        if let Some(error) = gallery.failed.take() {
            finish(world, &gallery.outcome, Err(error));
        }
    });
}

fn finish(world: &mut World, outcome: &Outcome, with: Result<Vec<PathBuf>, GalleryError>) {
    // Poisoned by nobody: the window's thread alone writes.
    if let Ok(mut outcome) = outcome.lock() {
        *outcome = Some(with);
    }
    world.write_message(AppExit::Success);
}

/// Whether the deed is done.
fn do_or_wait(world: &mut World, gallery: &mut Gallery, deed: Deed) -> bool {
    let phase = world.resource::<GameFlow>().phase;
    match deed {
        Deed::Wish(wish) => world.resource_mut::<GameFlow>().wish(wish),
        Deed::Select(name) => world.resource_mut::<Catalogue>().select(name),
        Deed::Await(wanted) => return phase == wanted,
        Deed::AwaitTitleGland => return world.resource::<GameFlow>().title_has_gland(),
        Deed::Levels { all_open } => world.resource_mut::<KeptSettings>().all_open = all_open,
        Deed::Script(name) => match hand_over(world, &gallery.scripts.join(name)) {
            Ok(is_done) => return is_done,
            Err(error) => gallery.failed = Some(error.into()),
        },
        Deed::Shown => {
            let is_done = players::show(world);
            if is_done {
                record_run(world, Hands::Player(String::new()));
            }
            return is_done;
        }
        Deed::PlayTo(time_s) => {
            let left_s = time_s - world.resource::<Metrics>().elapsed_s();
            let is_there = left_s <= 0.0 || phase == Phase::Result;
            world.insert_resource(match is_there || left_s < IN_STEP_S {
                true => A_STEP_A_FRAME,
                false => TimeUpdateStrategy::FixedTimesteps(STEPS_A_FRAME),
            });
            return is_there;
        }
        Deed::Views(layout) => *world.resource_mut::<ViewLayout>() = layout,
        Deed::Guide(guidance) => *world.resource_mut::<Guidance>() = guidance,
        Deed::Settings(open) => world.resource_mut::<super::SettingsPage>().open = open,
        Deed::Outline => {
            let mut editor = world.resource_mut::<Editor>();
            if !editor.has_begun() {
                editor.begin(Images::Example);
            }
            return editor.is_ready();
        }
        Deed::Debrief(page) => world.resource_mut::<Debriefing>().page = page,
        Deed::Watch(is_watched) => gallery.is_watched = is_watched,
        Deed::Picture(name) => return gallery.portray(world, name),
    }
    true
}

/// Gives the instrument to a script. Whether there is an instrument.
fn hand_over(world: &mut World, script: &Path) -> Result<bool, ScriptError> {
    let instrument = world.get_resource::<ActiveExercise>().map(|active| active.instrument);
    let Some(scope) = instrument.and_then(|instrument| world.get::<Resectoscope>(instrument)) else {
        return Ok(false);
    };
    let script = InstrumentScript::load(script, &scope.limits)?;
    if let Some(instrument) = instrument {
        world.entity_mut(instrument).insert(InstrumentSource::Script(script));
        // Placed anew, it is recorded anew.
        record_run(world, Hands::Script(String::new()));
    }
    Ok(true)
}

impl Gallery {
    /// Takes a picture of every size, over some frames. Whether all are there.
    fn portray(&mut self, world: &mut World, name: &'static str) -> bool {
        self.stage = match self.stage {
            Stage::Settling if self.waited < SETTLE_FRAMES => Stage::Settling,
            Stage::Settling => Stage::Drawn { size: 0, frames: 0 },
            Stage::Drawn { size, frames } if frames < DRAWN_FRAMES => Stage::Drawn {
                size,
                frames: frames + 1,
            },
            Stage::Drawn { size, .. } => {
                let file = self.folder.join(SIZES[size].0).join(format!("{name}.png"));
                world.spawn(Screenshot::primary_window()).observe(
                    move |captured: On<ScreenshotCaptured>, mut gallery: ResMut<Gallery>| {
                        gallery.take(&captured.image, &file)
                    },
                );
                Stage::Asked {
                    size,
                    is_extracted: false,
                }
            }
            Stage::Asked { size, .. } => {
                // In how many frames it comes is the adapter's own: a gland that settles meanwhile would be another one each time.
                world.insert_resource(STANDING);
                Stage::Asked {
                    size,
                    is_extracted: true,
                }
            }
            Stage::Taken { size } => {
                world.insert_resource(A_STEP_A_FRAME);
                let size = (size + 1) % SIZES.len();
                resize(world, size);
                Stage::Resizing { size, frames: 0 }
            }
            Stage::Resizing { size, frames } if frames < RESIZE_FRAMES => Stage::Resizing {
                size,
                frames: frames + 1,
            },
            Stage::Resizing { size: 0, .. } => Stage::Settling,
            Stage::Resizing { size, .. } => Stage::Drawn { size, frames: 0 },
        };
        self.stage == Stage::Settling && self.waited > SETTLE_FRAMES
    }

    fn take(&mut self, image: &Image, file: &Path) {
        if let Stage::Asked { size, .. } = self.stage {
            self.stage = Stage::Taken { size };
        }
        match save_picture(image, file) {
            Ok(()) => self.written.push(file.to_path_buf()),
            Err(error) => self.failed = Some(error.into()),
        }
    }
}

/// Gives the window one of [`SIZES`], with smooth edges in the smallest, whatever the adapter: few frames are drawn.
fn resize(world: &mut World, size: usize) {
    let smoothing = if size == 0 { Msaa::Sample4 } else { Msaa::Off };
    for mut msaa in world.query::<&mut Msaa>().iter_mut(world) {
        *msaa = smoothing;
    }
    let [width, height] = SIZES[size].1;
    let mut windows = world.query_filtered::<&mut Window, With<PrimaryWindow>>();
    for mut window in windows.iter_mut(world) {
        window.resolution.set_physical_resolution(width, height);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use resecta_instrument::InstrumentLimits;

    #[test]
    fn its_scripts_are_sound_and_its_exercises_shipped() {
        let assets = crate::assets::find().expect("the assets are here");
        let scripts = assets.join("scripts");
        let library = resecta_scenario::Library::new(assets);
        let mut ends_s = 0.0;
        for deed in plan::deeds() {
            match deed {
                Deed::Script(name) => {
                    let script = InstrumentScript::load(&scripts.join(name), &InstrumentLimits::default());
                    ends_s = script.expect("the script is sound").duration_s();
                }
                // To the end of the run, whenever that is.
                Deed::Shown | Deed::Wish(Wish::Watch) => ends_s = f64::INFINITY,
                Deed::Select(name) => assert!(library.exercise_names().iter().any(|shipped| shipped == name), "{name}"),
                Deed::PlayTo(time_s) => assert!(time_s <= ends_s, "{time_s} s is past the end of the script"),
                _ => {}
            }
        }
    }

    #[test]
    fn every_picture_has_a_name_of_its_own() {
        let mut names = std::collections::BTreeSet::new();
        for deed in plan::deeds() {
            if let Deed::Picture(name) = deed {
                assert!(names.insert(name), "{name} twice");
            }
        }
        assert!(names.len() > 30);
    }

    #[test]
    fn every_size_is_as_wide_to_its_height_as_screens_are_laid_out_for() {
        for (name, [width, height]) in SIZES {
            assert_eq!(9 * width, 16 * height);
            assert_eq!(name, format!("{width}x{height}"));
        }
    }
}
