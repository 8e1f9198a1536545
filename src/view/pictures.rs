//! Pictures of both views as files, drawn without a window.
//!
//! Drawing costs far more than a step, so the cameras are on only in the updates whose picture is kept.

use std::{
    cmp::Reverse,
    io::Cursor,
    path::{Path, PathBuf},
    time::Duration,
};

use bevy::{
    app::TerminalCtrlCHandlerPlugin,
    camera::{RenderTarget, visibility::NoFrustumCulling},
    diagnostic::FrameCountPlugin,
    log::{Level, LogPlugin},
    prelude::*,
    render::{
        RenderApp, RenderPlugin,
        pipelined_rendering::PipelinedRenderingPlugin,
        render_resource::{PipelineCache, TextureFormat},
        view::screenshot::{Screenshot, ScreenshotCaptured},
    },
    time::{TimePlugin, TimeUpdateStrategy},
    window::ExitCondition,
    winit::WinitPlugin,
};
use resecta_scenario::Metrics;
use thiserror::Error;

use crate::{STEP_HZ, headless::finish_plugins};

use super::{
    EndoscopeCamera, OutsideCamera, ViewMaterial, ViewPlugin, ViewSystems, both_layers,
    cameras::endoscope_background,
    endoscope_camera, outside_camera,
    veil::{PICTURE_WAITS_S, Veil},
};

/// Width and height of a picture, pixels.
pub const PICTURE_SIZE: UVec2 = UVec2::new(960, 720);
/// Updates with the cameras on before one whose picture is kept: what was just spawned or changed is drawn by then.
const SETTLE_UPDATES: u64 = 2;
/// How long shaders may take to load, or a picture to arrive, before we give up.
const PATIENCE: Duration = Duration::from_secs(60);
/// Time between two looks at whether that happened.
const PAUSE: Duration = Duration::from_millis(4);

/// Draws `count` pictures of each view into `folder`, as `endoscope_000.png` and `outside_000.png` and so on, evenly
/// spaced over a run of `steps` fixed steps: the first at its beginning, the last at its end, however long it was.
///
/// Brings [`ViewPlugin`] and everything else of Bevy that drawing needs and `MinimalPlugins` lacks. Call
/// [`adapter_available`](super::adapter_available) first, [`warm_up`](Pictures::warm_up) before the first step and
/// [`finish_pictures`] after the last.
#[derive(Debug, Clone, PartialEq)]
pub struct PicturesPlugin {
    /// Where the files go; made if need be.
    pub folder: PathBuf,
    /// Pictures of each view.
    pub count: u32,
    /// Steps that the run is expected to have. If it ends earlier there are fewer pictures.
    pub steps: u64,
    /// More pictures of the endoscope's view, each as `NAME.png`: name and step. While tissue lies before the lens the picture
    /// waits, for 1.4 s at most.
    pub moments: Vec<(String, u64)>,
}

/// A picture that could not be made.
#[derive(Debug, Error)]
pub enum PictureError {
    /// The file or folder could not be written.
    #[error("{}: {reason}", file.display())]
    Write {
        /// The file or folder.
        file: PathBuf,
        /// Why.
        reason: String,
    },
    /// The adapter never delivered.
    #[error("{} pictures were not drawn within {} s", missing, PATIENCE.as_secs())]
    TimedOut {
        /// How many.
        missing: u32,
    },
}

/// What was drawn so far.
#[derive(Resource, Debug)]
pub struct Pictures {
    folder: PathBuf,
    /// The step of each picture but the last, rising.
    planned: Vec<u64>,
    /// Further pictures of the endoscope's view, the next one last.
    moments: Vec<Moment>,
    /// Pictures of each view that were asked for.
    taken: u32,
    /// Files still on their way from the adapter.
    pending: u32,
    /// Whether the cameras are to be on whatever the step.
    always_on: bool,
    written: Vec<PathBuf>,
    failed: Vec<PictureError>,
    targets: [Handle<Image>; 2],
}

/// A picture of the endoscope's view at a moment.
#[derive(Debug, Clone, PartialEq, Eq)]
struct Moment {
    /// The step that it is taken in, and the latest one.
    step: u64,
    latest: u64,
    /// Of the file, without its ending.
    name: String,
}

impl Moment {
    fn new(step: u64, name: String) -> Self {
        let latest = step + (PICTURE_WAITS_S * STEP_HZ) as u64;
        Self { step, latest, name }
    }

    /// Whether the cameras have to be on in the update after so many steps.
    fn is_near(&self, steps: u64) -> bool {
        steps + SETTLE_UPDATES >= self.step
    }

    /// Waits while the lens sees nothing, as long as it may; the cameras stay off meanwhile.
    fn wait_for(&mut self, is_blind: bool, steps: u64) {
        if is_blind && self.is_near(steps) {
            self.step = (steps + SETTLE_UPDATES + 1).clamp(self.step, self.latest);
        }
    }
}

/// What is drawn while shaders load.
#[derive(Component)]
struct WarmUp;

impl Plugin for PicturesPlugin {
    fn build(&self, app: &mut App) {
        add_drawing(app);
        if !app.is_plugin_added::<ViewPlugin>() {
            app.add_plugins(ViewPlugin);
        }
        let mut target = || {
            let UVec2 { x, y } = PICTURE_SIZE;
            let image = Image::new_target_texture(x, y, TextureFormat::Rgba8UnormSrgb, None);
            app.world_mut().resource_mut::<Assets<Image>>().add(image)
        };
        let targets = [target(), target()];
        let last = u64::from(self.count.saturating_sub(1));
        let moments = self.moments.iter().map(|(name, step)| Moment::new(*step, name.clone()));
        let mut moments: Vec<Moment> = moments.collect();
        moments.sort_by_key(|moment| Reverse(moment.step));
        app.insert_resource(Pictures {
            folder: self.folder.clone(),
            planned: (0..last).map(|picture| (self.steps * picture / last).max(1)).collect(),
            moments,
            taken: 0,
            pending: 0,
            always_on: false,
            written: Vec::new(),
            failed: Vec::new(),
            targets,
        });
        app.add_systems(Startup, add_cameras)
            .add_systems(Update, take.in_set(ViewSystems::First));
    }
}

/// Everything of `DefaultPlugins` that the app does not have yet, but for windows, threads of drawing and the log's chatter.
fn add_drawing(app: &mut App) {
    if app.is_plugin_added::<RenderPlugin>() {
        return;
    }
    let mut plugins = DefaultPlugins
        .set(WindowPlugin {
            primary_window: None,
            exit_condition: ExitCondition::DontExit,
            ..default()
        })
        .set(RenderPlugin {
            synchronous_pipeline_compilation: true,
            ..default()
        })
        .set(LogPlugin {
            level: Level::ERROR,
            ..default()
        })
        .disable::<WinitPlugin>()
        .disable::<PipelinedRenderingPlugin>()
        .disable::<TerminalCtrlCHandlerPlugin>();
    // `MinimalPlugins` and what a test may have added beside it.
    macro_rules! skip_known {
        ($($plugin:ty),+ $(,)?) => {
            $(if app.is_plugin_added::<$plugin>() {
                plugins = plugins.disable::<$plugin>();
            })+
        };
    }
    skip_known!(
        TaskPoolPlugin,
        FrameCountPlugin,
        TimePlugin,
        TransformPlugin,
        AssetPlugin,
        LogPlugin,
        bevy::input::InputPlugin,
        bevy::mesh::MeshPlugin,
    );
    app.add_plugins(plugins);
}

fn add_cameras(pictures: Res<Pictures>, mut commands: Commands) {
    let camera = |order| Camera {
        order,
        is_active: false,
        clear_color: ClearColorConfig::Custom(endoscope_background()),
        ..default()
    };
    let [endoscope, outside] = pictures.targets.clone().map(|image| RenderTarget::Image(image.into()));
    commands.spawn((endoscope_camera(), camera(0), endoscope, Msaa::Sample4));
    commands.spawn((outside_camera(), camera(1), outside, Msaa::Sample4));
}

/// Switches the cameras on where a picture is due and asks for it.
fn take(
    metrics: Res<Metrics>,
    veils: Query<&Veil>,
    mut pictures: ResMut<Pictures>,
    mut cameras: Query<&mut Camera, Or<(With<EndoscopeCamera>, With<OutsideCamera>)>>,
    mut commands: Commands,
) {
    let next = pictures.planned.get(pictures.taken as usize).copied();
    let is_blind = veils.iter().any(Veil::is_blind);
    for moment in &mut pictures.moments {
        moment.wait_for(is_blind, metrics.steps);
    }
    // Those that wait may be overtaken.
    pictures.moments.sort_by_key(|moment| Reverse(moment.step));
    let is_near = next.is_some_and(|next| metrics.steps + SETTLE_UPDATES >= next)
        || (pictures.moments.last()).is_some_and(|moment| moment.is_near(metrics.steps));
    for mut camera in &mut cameras {
        camera.is_active = pictures.always_on || is_near;
    }
    let mut names = [Vec::new(), Vec::new()];
    if next.is_some_and(|next| metrics.steps >= next) {
        names = pictures.next_names();
    }
    while let Some(moment) = pictures.moments.pop_if(|moment| metrics.steps >= moment.step) {
        names[0].push(moment.name);
    }
    pictures.ask(names, &mut commands);
}

impl Pictures {
    /// The names of the next evenly spaced pictures of both views.
    fn next_names(&mut self) -> [Vec<String>; 2] {
        let number = self.taken;
        self.taken += 1;
        ["endoscope", "outside"].map(|view| vec![format!("{view}_{number:03}")])
    }

    /// Asks for a picture of each view that has names, as it will be at the end of this update: a view is read back once, for all
    /// names of it.
    fn ask(&mut self, names: [Vec<String>; 2], commands: &mut Commands) {
        for (names, target) in names.into_iter().zip(&self.targets) {
            if names.is_empty() {
                continue;
            }
            let files = names.into_iter().map(|name| self.folder.join(format!("{name}.png")));
            let files: Vec<PathBuf> = files.collect();
            self.pending += 1;
            commands.spawn(Screenshot::image(target.clone())).observe(
                move |captured: On<ScreenshotCaptured>, mut pictures: ResMut<Pictures>| {
                    pictures.pending -= 1;
                    for file in &files {
                        match save_picture(&captured.image, file) {
                            Ok(()) => pictures.written.push(file.clone()),
                            Err(error) => pictures.failed.push(error),
                        }
                    }
                },
            );
        }
    }

    /// The files written so far.
    pub fn written(&self) -> &[PathBuf] {
        &self.written
    }

    /// Loads every shader, so that the first picture is complete. Takes no step.
    ///
    /// # Errors
    /// [`PictureError::TimedOut`] if the adapter does not get ready.
    pub fn warm_up(app: &mut App) -> Result<(), PictureError> {
        finish_plugins(app);
        let strategy = stop_clock(app);
        let world = app.world_mut();
        let mesh = world.resource_mut::<Assets<Mesh>>().add(Sphere::new(1.0));
        let material = world
            .resource_mut::<Assets<ViewMaterial>>()
            .add(ViewMaterial::default());
        world.spawn((
            WarmUp,
            Mesh3d(mesh),
            MeshMaterial3d(material),
            both_layers(),
            NoFrustumCulling,
        ));
        world.resource_mut::<Pictures>().always_on = true;

        let mut ready_updates = 0;
        let mut waited = Duration::ZERO;
        while ready_updates < 4 {
            if waited > PATIENCE {
                return Err(PictureError::TimedOut { missing: 2 });
            }
            app.update();
            let pipelines = app.sub_app(RenderApp).world().resource::<PipelineCache>();
            let is_ready = pipelines.waiting_pipelines().next().is_none() && pipelines.pipelines().next().is_some();
            ready_updates = if is_ready { ready_updates + 1 } else { 0 };
            std::thread::sleep(PAUSE);
            waited += PAUSE;
        }

        let world = app.world_mut();
        world.resource_mut::<Pictures>().always_on = false;
        let mut warm_up = world.query_filtered::<Entity, With<WarmUp>>();
        for entity in warm_up.iter(world).collect::<Vec<_>>() {
            world.despawn(entity);
        }
        world.insert_resource(strategy);
        Ok(())
    }
}

/// Draws the last picture, with those that still waited for a clear lens, and waits until every file is written. The app's
/// clock stands still from here on.
///
/// # Errors
/// The first picture that failed.
pub fn finish_pictures(app: &mut App) -> Result<Vec<PathBuf>, PictureError> {
    finish_plugins(app);
    stop_clock(app);
    app.world_mut().resource_mut::<Pictures>().always_on = true;
    for _ in 0..=SETTLE_UPDATES {
        app.update();
    }
    let is_wanted = |pictures: &Pictures| pictures.taken == 0 || !pictures.planned.is_empty();
    app.world_mut().resource_scope(|world, mut pictures: Mut<Pictures>| {
        if is_wanted(&pictures) {
            pictures.planned.clear();
            let mut names = pictures.next_names();
            names[0].extend(
                std::mem::take(&mut pictures.moments)
                    .into_iter()
                    .map(|moment| moment.name),
            );
            pictures.ask(names, &mut world.commands());
        }
        world.flush();
    });

    let mut waited = Duration::ZERO;
    loop {
        app.update();
        let mut pictures = app.world_mut().resource_mut::<Pictures>();
        if !pictures.failed.is_empty() {
            return Err(pictures.failed.remove(0));
        }
        if pictures.pending == 0 {
            pictures.always_on = false;
            pictures.written.sort();
            return Ok(pictures.written.clone());
        }
        if waited > PATIENCE {
            return Err(PictureError::TimedOut {
                missing: pictures.pending,
            });
        }
        std::thread::sleep(PAUSE);
        waited += PAUSE;
    }
}

/// Stops the app's time and returns how it went before.
fn stop_clock(app: &mut App) -> TimeUpdateStrategy {
    let world = app.world_mut();
    let strategy = world.remove_resource::<TimeUpdateStrategy>().unwrap_or_default();
    world.insert_resource(TimeUpdateStrategy::ManualDuration(Duration::ZERO));
    strategy
}

/// Writes a picture that was read back from the adapter, and its folder if there is none.
///
/// # Errors
/// [`PictureError::Write`].
pub(crate) fn save_picture(image: &Image, file: &Path) -> Result<(), PictureError> {
    let failed = |reason: String| PictureError::Write {
        file: file.to_path_buf(),
        reason,
    };
    if let Some(folder) = file.parent() {
        std::fs::create_dir_all(folder).map_err(|error| failed(error.to_string()))?;
    }
    let png = png_of(image).map_err(failed)?;
    std::fs::write(file, png).map_err(|error| failed(error.to_string()))
}

/// A picture as a PNG file.
///
/// # Errors
/// Why it is no picture.
pub(crate) fn png_of(image: &Image) -> Result<Vec<u8>, String> {
    let picture = image.clone().try_into_dynamic().map_err(|error| error.to_string())?;
    let mut png = Cursor::new(Vec::new());
    let written = picture.to_rgb8().write_to(&mut png, image::ImageFormat::Png);
    written.map_err(|error| error.to_string())?;
    Ok(png.into_inner())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The step in which a moment of step 100 is taken, the lens in tissue from step 90 to before `clear`.
    fn taken(clear: u64) -> u64 {
        let mut moment = Moment::new(100, "first_cut".into());
        for steps in 80..1000 {
            moment.wait_for((90..clear).contains(&steps), steps);
            if steps >= moment.step {
                return steps;
            }
        }
        panic!("never taken")
    }

    #[test]
    fn a_moment_waits_for_a_clear_lens_but_not_for_long() {
        assert_eq!(taken(0), 100);
        assert_eq!(taken(98), 100);
        assert_eq!(taken(150), 150 + SETTLE_UPDATES);
        assert_eq!(taken(1000), 100 + (PICTURE_WAITS_S * STEP_HZ) as u64);
    }
}
