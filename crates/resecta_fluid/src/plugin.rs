//! The order of a step, and what every model of the crate needs.

use bevy::{
    app::PluginGroupBuilder,
    ecs::schedule::{InternedScheduleLabel, ScheduleLabel},
    prelude::*,
};
use resecta_tissue::TissueSystems;

use crate::{
    absorption::AbsorptionPlugin,
    balance::{self, Branch, Passed, Ports},
    bladder::{Bladder, BladderSettings, BladderTotals},
    bleeding::BleedingPlugin,
    irrigation::IrrigationPlugin,
    lumen,
    refused::{FluidRefused, keep_good},
    turbidity::TurbidityPlugin,
};

/// The stages of a step, in this order, after [`TissueSystems::Last`] in the schedule that the plugins were given. A step of
/// length zero changes nothing but the vessels that were cut.
#[derive(SystemSet, Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum FluidSystems {
    /// Empty, for users: the last moment to turn taps and change settings for this step.
    First,
    /// Settings that make no sense are put back.
    Prepare,
    /// Vessels are carried along by the tissue, opened by cuts and closed by currents.
    Vessels,
    /// What could flow: taps, vessels, uptake.
    Demand,
    /// The bladder moves on.
    Flow,
    /// What flowed is put down to vessels and patient; alarms.
    Account,
    /// Blood mixes with the water; what a lens sees of it.
    View,
    /// Empty, for users: everything of this step is there to be read.
    Last,
}

/// The step that is being made.
#[derive(Resource, Default)]
pub(crate) struct Step {
    /// s.
    pub seconds: f64,
    pub ports: Ports,
    pub passed: Passed,
    pub branches: Vec<Branch>,
    /// What veins would have lost against no pressure, ml.
    pub veins_due_ml: f64,
    /// Veins that are open, those that clot in the step by their share of it.
    pub open_veins: f64,
}

/// All models of the crate; each does something only where the app has its resources or components.
#[derive(Debug, Clone)]
pub struct FluidPlugins {
    schedule: InternedScheduleLabel,
}

impl FluidPlugins {
    /// Runs them in another schedule.
    pub fn new(schedule: impl ScheduleLabel) -> Self {
        Self {
            schedule: schedule.intern(),
        }
    }
}

impl Default for FluidPlugins {
    /// Runs in [`FixedPostUpdate`].
    fn default() -> Self {
        Self::new(FixedPostUpdate)
    }
}

impl PluginGroup for FluidPlugins {
    fn build(self) -> PluginGroupBuilder {
        PluginGroupBuilder::start::<Self>()
            .add(IrrigationPlugin::new(self.schedule))
            .add(BleedingPlugin::new(self.schedule))
            .add(TurbidityPlugin::new(self.schedule))
            .add(AbsorptionPlugin::new(self.schedule))
    }
}

/// What the plugins share; the first of them brings it.
struct CorePlugin {
    schedule: InternedScheduleLabel,
}

pub(crate) fn add_core(app: &mut App, schedule: InternedScheduleLabel) {
    if !app.is_plugin_added::<CorePlugin>() {
        app.add_plugins(CorePlugin { schedule });
    }
}

impl Plugin for CorePlugin {
    fn build(&self, app: &mut App) {
        app.init_resource::<Step>()
            .add_message::<FluidRefused>()
            .register_type::<Bladder>()
            .register_type::<BladderSettings>()
            .register_type::<BladderTotals>()
            .configure_sets(
                self.schedule,
                (
                    FluidSystems::First,
                    FluidSystems::Prepare,
                    FluidSystems::Vessels,
                    FluidSystems::Demand,
                    FluidSystems::Flow,
                    FluidSystems::Account,
                    FluidSystems::View,
                    FluidSystems::Last,
                )
                    .chain()
                    .after(TissueSystems::Last),
            )
            .add_systems(
                self.schedule,
                (
                    (begin, keep_good).chain().in_set(FluidSystems::Prepare),
                    flow.in_set(FluidSystems::Flow),
                    lumen::press.in_set(FluidSystems::Account),
                ),
            );
    }
}

/// Whether the step has a length.
pub(crate) fn time_passes(step: Res<Step>) -> bool {
    step.seconds > 0.0
}

fn begin(time: Res<Time>, mut step: ResMut<Step>) {
    let mut branches = std::mem::take(&mut step.branches);
    branches.clear();
    *step = Step {
        seconds: time.delta_secs_f64(),
        branches,
        ..default()
    };
}

fn flow(bladder: Option<ResMut<Bladder>>, mut step: ResMut<Step>) {
    if step.seconds <= 0.0 {
        return;
    }
    let step = &mut *step;
    let Some(mut bladder) = bladder else {
        step.passed = Passed {
            veins: step.veins_due_ml,
            arteries: step.ports.arteries * step.seconds,
            ..default()
        };
        return;
    };
    let (volume_ml, passed) = balance::advance(
        &bladder.settings,
        bladder.volume_ml(),
        &step.ports,
        step.seconds,
        &mut step.branches,
    );
    step.passed = passed;
    bladder.follow(volume_ml, &passed, step.seconds);
}
