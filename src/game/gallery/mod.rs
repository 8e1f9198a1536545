//! Pictures of the game as a player sees it: every screen, what the instrument does, what becomes of tissue, at two sizes.
//!
//! The game is opened in a window and led through a list of deeds by the ways that a player has: buttons, keys that arrange the
//! views, an instrument that moves by a script. Steps are counted and no clock is read, and neither settings nor scores of the
//! user are, so that the same build on the same adapter draws the same pictures.

mod plan;

use std::{
    collections::VecDeque,
    path::{Path, PathBuf},
    sync::{Arc, Mutex},
    time::Duration,
};

use bevy::{
    prelude::*,
    render::view::screenshot::{Screenshot, ScreenshotCaptured},
    time::TimeUpdateStrategy,
    window::PrimaryWindow,
};
use resecta_instrument::{InstrumentScript, InstrumentSource, Resectoscope, ScriptError};
use resecta_scenario::{ActiveExercise, Metrics};
use thiserror::Error;

use self::plan::Deed;
use super::{
    catalogue::Catalogue,
    flow::{GameFlow, Phase, Wish},
    guidance::Guidance,
    layout::ViewLayout,
};
use crate::view::save_picture;

/// Frames that a screen gets to settle, what fades in included, before its picture is taken.
const SETTLE_FRAMES: u32 = 12;
/// Steps a frame on the way to the next picture.
const STEPS_A_FRAME: u32 = 6;
/// How time goes where nothing is waited for. It never stands: what fades in goes by it, too.
const A_STEP_A_FRAME: TimeUpdateStrategy = TimeUpdateStrategy::ManualDuration(Duration::from_micros(16_667));
/// So many frames may pass without a deed being done before something is wrong.
const PATIENCE_FRAMES: u32 = 5000;

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
    /// What came of it.
    pub outcome: Outcome,
}

impl Plugin for GalleryPlugin {
    fn build(&self, app: &mut App) {
        app.insert_resource(Gallery {
            folder: self.folder.clone(),
            deeds: plan::deeds(),
            size: String::new(),
            waited: 0,
            pending: 0,
            written: Vec::new(),
            failed: None,
            outcome: self.outcome.clone(),
        })
        .insert_resource(A_STEP_A_FRAME)
        .add_systems(First, lead);
    }
}

#[derive(Resource)]
struct Gallery {
    folder: PathBuf,
    deeds: VecDeque<Deed>,
    /// Name of the present size.
    size: String,
    /// Frames since the last deed was done.
    waited: u32,
    /// Pictures on their way.
    pending: u32,
    written: Vec<PathBuf>,
    failed: Option<GalleryError>,
    outcome: Outcome,
}

/// Does the next deed, once its time has come.
fn lead(world: &mut World) {
    world.resource_scope(|world, mut gallery: Mut<Gallery>| {
        let next = gallery.deeds.front().copied();
        let is_done = match next {
            Some(deed) => do_or_wait(world, &mut gallery, deed),
            None => gallery.pending == 0,
        };
        gallery.waited = if is_done { 0 } else { gallery.waited + 1 };
        if is_done && gallery.deeds.pop_front().is_none() {
            let written = std::mem::take(&mut gallery.written);
            finish(world, &gallery.outcome, Ok(written));
        }
        if gallery.waited > PATIENCE_FRAMES {
            let stuck = GalleryError::Stuck {
                wanted: next.map_or_else(|| "its last picture".into(), |deed| format!("{deed:?}")),
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
        Deed::Size(name, [width, height]) => {
            gallery.size = name.into();
            for mut window in world
                .query_filtered::<&mut Window, With<PrimaryWindow>>()
                .iter_mut(world)
            {
                window.resolution.set_physical_resolution(width, height);
            }
        }
        Deed::Wish(wish) => world.resource_mut::<GameFlow>().wish(wish),
        Deed::Select(name) => world.resource_mut::<Catalogue>().select(name),
        Deed::Await(wanted) => return phase == wanted,
        Deed::Script(text) => match hand_over(world, text) {
            Ok(is_done) => return is_done,
            Err(error) => gallery.failed = Some(error.into()),
        },
        Deed::PlayTo(time_s) => {
            let is_there = world.resource::<Metrics>().elapsed_s() >= time_s || phase == Phase::Result;
            world.insert_resource(match is_there {
                true => A_STEP_A_FRAME,
                false => TimeUpdateStrategy::FixedTimesteps(STEPS_A_FRAME),
            });
            return is_there;
        }
        Deed::Views(layout) => *world.resource_mut::<ViewLayout>() = layout,
        Deed::Guide(guidance) => *world.resource_mut::<Guidance>() = guidance,
        Deed::Settings(open) => world.resource_mut::<super::SettingsPage>().open = open,
        Deed::Settle => return gallery.waited >= SETTLE_FRAMES,
        Deed::Picture(name) => {
            // One at a time: the window is read back whole.
            if gallery.pending > 0 {
                return false;
            }
            gallery.pending += 1;
            let file = gallery.folder.join(&gallery.size).join(format!("{name}.png"));
            world.spawn(Screenshot::primary_window()).observe(
                move |captured: On<ScreenshotCaptured>, mut gallery: ResMut<Gallery>| {
                    gallery.take(&captured.image, &file)
                },
            );
        }
    }
    true
}

/// Gives the instrument to a script. Whether there is an instrument.
fn hand_over(world: &mut World, text: &str) -> Result<bool, ScriptError> {
    let instrument = world.get_resource::<ActiveExercise>().map(|active| active.instrument);
    let Some(scope) = instrument.and_then(|instrument| world.get::<Resectoscope>(instrument)) else {
        return Ok(false);
    };
    let script = InstrumentScript::from_ron(text, Path::new("gallery"), &scope.limits)?;
    if let Some(instrument) = instrument {
        world.entity_mut(instrument).insert(InstrumentSource::Script(script));
    }
    Ok(true)
}

impl Gallery {
    fn take(&mut self, image: &Image, file: &Path) {
        self.pending -= 1;
        match save_picture(image, file) {
            Ok(()) => self.written.push(file.to_path_buf()),
            Err(error) => self.failed = Some(error.into()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use resecta_instrument::InstrumentLimits;

    #[test]
    fn its_scripts_are_sound_and_its_exercises_shipped() {
        let library = resecta_scenario::Library::new(crate::assets::find().expect("the assets are here"));
        let mut ends_s = 0.0;
        for deed in plan::deeds() {
            match deed {
                Deed::Script(text) => {
                    let script = InstrumentScript::from_ron(text, Path::new("gallery"), &InstrumentLimits::default());
                    ends_s = script.expect("the script is sound").duration_s();
                }
                Deed::Select(name) => assert!(library.exercise_names().iter().any(|shipped| shipped == name), "{name}"),
                Deed::PlayTo(time_s) => assert!(time_s <= ends_s, "{time_s} s is past the end of the script"),
                _ => {}
            }
        }
    }

    #[test]
    fn every_picture_has_a_name_of_its_own() {
        let mut names = std::collections::BTreeSet::new();
        let mut size = "";
        for deed in plan::deeds() {
            match deed {
                Deed::Size(name, _) => size = name,
                Deed::Picture(name) => assert!(names.insert((size, name)), "{name} twice"),
                _ => {}
            }
        }
        assert!(names.len() > 30);
    }
}
