//! Tests of exercises and extensions: an app without a window that runs step by step.
//!
//! ```
//! use bevy::prelude::*;
//! use resecta_scenario::testing::Trial;
//! use resecta_tissue::TissueResected;
//!
//! # fn main() -> Result {
//! // Plugins of your own in place of `()`: what they register is there for the exercise.
//! let mut trial = Trial::new(());
//! let mut loaded = trial.library()?.load("first_cuts")?;
//! loaded.exercise.alpha_deg = 20.0;
//! trial.watch::<TissueResected>();
//! trial.start(loaded.clone())?;
//!
//! trial.steps_by(60, |step, instrument| instrument.stroke_mm = step as f32 / 4.0);
//! assert_eq!(trial.value("elapsed_s"), 60.0 * trial.report().run.step_s);
//! assert_eq!(trial.seen::<TissueResected>(), [], "no pedal was down");
//!
//! // The same again gives the same bits.
//! let mut again = Trial::new(());
//! again.start(loaded)?;
//! again.steps_by(60, |step, instrument| instrument.stroke_mm = step as f32 / 4.0);
//! assert_eq!(trial.state_hash(), again.state_hash());
//! # Ok(())
//! # }
//! ```

use std::path::Path;

use bevy::{app::Plugins, prelude::*};
use resecta_instrument::{
    InstrumentRequest, InstrumentScript, InstrumentSource, InstrumentState, Resectoscope, ScriptError,
};
use thiserror::Error;

use crate::{
    active::ActiveExercise,
    assets::{self, AssetsMissing},
    errors::{ExerciseError, nearest},
    exercise::Exercise,
    extension::Extensions,
    headless,
    library::{Library, LoadedExercise},
    metrics::{MetricId, Metrics},
    report::Report,
    state::{EndReason, RunState},
};

/// Why a trial did not start.
#[derive(Debug, Error)]
pub enum TrialError {
    /// No assets.
    #[error(transparent)]
    Assets(#[from] AssetsMissing),
    /// The exercise is at fault.
    #[error(transparent)]
    Exercise(#[from] ExerciseError),
    /// The script is at fault.
    #[error(transparent)]
    Script(#[from] ScriptError),
}

/// A run to test with, one fixed step an update. Equal trials have equal bits.
///
/// Its methods panic where a test has gone wrong: no exercise was started, no such metric, nothing watched.
pub struct Trial {
    /// The app, its clocks started. Whatever Bevy can do with one a test can.
    pub app: App,
}

/// An exercise to start: the name of one or the path of its file (`&str`), one made in Rust ([`Exercise`]), or one that is loaded.
pub trait Startable {
    /// It and its case.
    ///
    /// # Errors
    /// [`ExerciseError`] names what is wrong with it.
    fn load(self, library: &Library) -> Result<LoadedExercise, ExerciseError>;
}

impl Startable for &str {
    fn load(self, library: &Library) -> Result<LoadedExercise, ExerciseError> {
        library.load(self)
    }
}

impl Startable for Exercise {
    fn load(self, library: &Library) -> Result<LoadedExercise, ExerciseError> {
        library.load_value("trial", self)
    }
}

impl Startable for LoadedExercise {
    fn load(self, _: &Library) -> Result<LoadedExercise, ExerciseError> {
        Ok(self)
    }
}

/// What was watched of one type.
#[derive(Resource)]
struct Seen<T>(Vec<T>);

impl Trial {
    /// An app of [`headless::app`] with these plugins besides: one, a tuple of them, a closure on the app, or `()`.
    pub fn new<M>(plugins: impl Plugins<M>) -> Self {
        let mut app = headless::app(None);
        app.add_plugins(plugins);
        headless::finish_plugins(&mut app);
        // The first update sets the clocks, and takes no step.
        app.update();
        Self { app }
    }

    /// The shipped exercises, and those of the plugins.
    ///
    /// # Errors
    /// [`AssetsMissing`].
    pub fn library(&self) -> Result<Library, AssetsMissing> {
        let extensions = self.app.world().resource::<Extensions>();
        Ok(Library::new(assets::find()?).with_extensions(extensions.clone()))
    }

    /// Starts an exercise, in place of one that runs. Its instrument goes where [`Trial::steps_by`] or a system says.
    ///
    /// # Errors
    /// [`TrialError`] names what is wrong with the exercise.
    pub fn start(&mut self, exercise: impl Startable) -> Result<(), TrialError> {
        let prepared = exercise.load(&self.library()?)?.prepare()?;
        headless::start(&mut self.app, prepared, InstrumentSource::Requests);
        Ok(())
    }

    /// Runs fixed steps.
    pub fn steps(&mut self, steps: u32) {
        (0..steps).for_each(|_| self.app.update());
    }

    /// Runs fixed steps; before each, `hands` is told its number, from 0, and says where the instrument is to go.
    pub fn steps_by(&mut self, steps: u32, mut hands: impl FnMut(u32, &mut InstrumentState)) {
        for step in 0..steps {
            let instrument = self.active().instrument;
            if let Some(mut request) = self.app.world_mut().get_mut::<InstrumentRequest>(instrument) {
                hands(step, &mut request.0);
            }
            self.app.update();
        }
    }

    /// Gives the instrument to a script, whose text this is.
    ///
    /// # Errors
    /// [`ScriptError`] names the line and the key.
    pub fn follow_script(&mut self, text: &str) -> Result<(), ScriptError> {
        let instrument = self.active().instrument;
        let scope = self.app.world().get::<Resectoscope>(instrument);
        let limits = scope.map(|scope| scope.limits).unwrap_or_default();
        let script = InstrumentScript::from_ron(text, Path::new("script"), &limits)?;
        self.follow(InstrumentSource::Script(script));
        Ok(())
    }

    /// Gives the instrument to a script, a recording or the devices.
    pub fn follow(&mut self, source: InstrumentSource) {
        let instrument = self.active().instrument;
        self.app.world_mut().entity_mut(instrument).insert(source);
    }

    /// Runs until the run ends: by its goals, a limit, or the end of a script.
    pub fn play(&mut self) -> EndReason {
        headless::play(&mut self.app, |_| {})
    }

    /// From now on keeps every message of this kind.
    pub fn watch<M: Message + Clone>(&mut self) {
        fn keep<M: Message + Clone>(mut messages: MessageReader<M>, mut seen: ResMut<Seen<M>>) {
            seen.0.extend(messages.read().cloned());
        }
        self.app
            .insert_resource(Seen::<M>(Vec::new()))
            .add_message::<M>()
            .add_systems(Last, keep::<M>);
    }

    /// From now on keeps every event of this kind.
    pub fn watch_events<E: Event + Clone>(&mut self) {
        self.app
            .insert_resource(Seen::<E>(Vec::new()))
            .add_observer(|event: On<E>, mut seen: ResMut<Seen<E>>| seen.0.push(event.event().clone()));
    }

    /// The messages or events of a kind since it was watched, in order.
    pub fn seen<T: Send + Sync + 'static>(&self) -> &[T] {
        let seen = self.app.world().get_resource::<Seen<T>>();
        &seen
            .unwrap_or_else(|| panic!("{} is not watched", std::any::type_name::<T>()))
            .0
    }

    /// The exercise that runs.
    pub fn active(&self) -> &ActiveExercise {
        let active = self.app.world().get_resource();
        active.expect("an exercise was started")
    }

    /// A component of the instrument, as that of a [`MetricExtension`](crate::MetricExtension); none where it has none.
    pub fn on_instrument<C: Component>(&self) -> Option<&C> {
        self.app.world().get(self.active().instrument)
    }

    /// Where the run stands.
    pub fn state(&self) -> RunState {
        *self.app.world().resource()
    }

    /// The value of a metric by its id in files.
    pub fn value(&self, id: &str) -> f64 {
        let world = self.app.world();
        let extensions = world.resource::<Extensions>();
        let metric = MetricId::from_id(id).or_else(|| extensions.metric(id));
        let metric = metric.unwrap_or_else(|| {
            let built_in = MetricId::ALL.iter().map(|metric| metric.info().id);
            let like = nearest(id, built_in.chain(extensions.metric_names()));
            panic!("no metric \"{id}\"; the most like it: {like:?}")
        });
        world.resource::<Metrics>().value(metric)
    }

    /// The report as it stands.
    pub fn report(&self) -> Report {
        Report::of_world(self.app.world()).expect("an exercise was started, and its gland is there")
    }

    /// [`state_hash`](crate::state_hash) of the gland, hexadecimal: equal where it moved and was cut alike, to the bit.
    pub fn state_hash(&self) -> String {
        self.report().state_hash
    }
}
