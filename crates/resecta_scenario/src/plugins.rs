//! The simulation as one group of plugins, and the clock that it runs by.

use std::time::Duration;

use bevy::{app::PluginGroupBuilder, prelude::*};
use resecta_chips::ChipsPlugin;
use resecta_fluid::FluidPlugins;
use resecta_instrument::InstrumentPlugin;
use resecta_tissue::TissuePlugin;

use crate::plugin::ScenarioPlugin;

/// Fixed steps a second.
pub const STEP_HZ: f64 = 60.0;

/// Real time that one frame may make up for, s: a machine that cannot keep up runs slower than real time instead of
/// computing ever more steps a frame.
pub const CATCH_UP_S: f32 = 0.05;

/// Instrument, tissue, blood and water, floating chips, and scenario: the whole simulation, on steps of 1/[`STEP_HZ`] s.
/// Needs Bevy's `MinimalPlugins` or `DefaultPlugins` beside it, draws nothing and reads no device.
#[derive(Debug, Default, Clone, Copy)]
pub struct ResectaPlugins;

impl PluginGroup for ResectaPlugins {
    fn build(self) -> PluginGroupBuilder {
        PluginGroupBuilder::start::<Self>()
            .add(FixedStepPlugin)
            .add(InstrumentPlugin)
            .add(TissuePlugin::default())
            .add_group(FluidPlugins::default())
            .add(ChipsPlugin::default())
            .add(ScenarioPlugin::default())
    }
}

/// Sets the length of the fixed step to 1/[`STEP_HZ`] s.
#[derive(Debug, Default, Clone, Copy)]
pub struct FixedStepPlugin;

impl Plugin for FixedStepPlugin {
    fn build(&self, app: &mut App) {
        app.insert_resource(Time::<Fixed>::from_hz(STEP_HZ));
        app.insert_resource(Time::<Virtual>::from_max_delta(Duration::from_secs_f32(CATCH_UP_S)));
    }
}
