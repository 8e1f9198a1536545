//! Irrigation: a bag, two taps, and the way out.
//!
//! ```text
//! q_in  = tap_in  (H - p)+ / R_in
//! q_out = tap_out (p + h)  / R_out        or  (p + h) / R_empty  while the telescope is withdrawn
//! ```
//!
//! H is the bag's height over the bladder and p the pressure in it, both cmH2O; h is the pull of the outflow: how far its end
//! hangs below the bladder, with what the abdomen adds. Flows are ml/s, resistances cmH2O s/ml. A valve keeps the bag's water
//! from coming back. An empty bladder lets out what comes in.
//!
//! | quantity | default | basis |
//! |---|---|---|
//! | H | 60 cmH2O (0 to 100) | 60 to 100 cmH2O studied |
//! | R_in | 12 cmH2O s/ml | 60 cmH2O then give an empty bladder 300 ml/min; 150 to 500 reported, 1000 at most |
//! | R_out, h | 6 cmH2O s/ml, 10 cmH2O | ours: with both taps open 233 ml/min run through at 13.3 cmH2O; means of 11 to 35 reported |
//! | R_u | 6 cmH2O s/ml | ours (`lumen.rs`): obstructed men pass 10 ml/s at 60 cmH2O or more |
//! | R_empty | 1 cmH2O s/ml | ours: a full bladder empties in 32 s with the inflow shut |
//!
//! Flow in the narrow channels of a real sheath is between this (laminar) and the root of the pressure (turbulent).

use bevy::{
    ecs::schedule::{InternedScheduleLabel, ScheduleLabel},
    prelude::*,
};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::{
    balance::Port,
    bladder::Bladder,
    plugin::{self, FluidSystems, Step},
    refused::{Checked, FluidError, check},
};

/// The bag, the taps and the tubes: a surgeon's controls, and the resistances between. Write it at any time; what makes no
/// sense is put back and told ([`FluidRefused`](crate::FluidRefused)). Needs a [`Bladder`] beside it.
#[derive(Resource, Reflect, Serialize, Deserialize, JsonSchema, Debug, Clone, Copy, PartialEq)]
#[reflect(Resource, Default)]
#[serde(deny_unknown_fields, default)]
pub struct Irrigation {
    /// Height of the bag over the bladder, cmH2O; 0 to 100.
    #[schemars(range(min = 0.0, max = 100.0))]
    pub bag_height_cmh2o: f64,
    /// How far the inflow is open, 0 to 1.
    #[schemars(range(min = 0.0, max = 1.0))]
    pub inflow_tap: f64,
    /// How far the outflow of a continuous-flow sheath is open, 0 to 1.
    #[schemars(range(min = 0.0, max = 1.0))]
    pub outflow_tap: f64,
    /// Whether the telescope is withdrawn, so that the bladder empties through the sheath whatever the outflow's tap says.
    pub emptying: bool,
    /// Resistance from the bag to the bladder with an open tap, cmH2O s/ml; 0.001 to 1,000,000.
    #[schemars(range(min = 0.001, max = 1e6))]
    #[schemars(extend("x-unit" = "cmH2O s/ml"))]
    pub inflow_resistance: f64,
    /// Resistance of the outflow with an open tap, cmH2O s/ml; 0.001 to 1,000,000.
    #[schemars(range(min = 0.001, max = 1e6))]
    #[schemars(extend("x-unit" = "cmH2O s/ml"))]
    pub outflow_resistance: f64,
    /// Resistance of the sheath without its telescope, cmH2O s/ml; 0.001 to 1,000,000.
    #[schemars(range(min = 0.001, max = 1e6))]
    #[schemars(extend("x-unit" = "cmH2O s/ml"))]
    pub emptying_resistance: f64,
    /// Resistance of the prostatic urethra from the tip to the bladder, cmH2O s/ml; 0.001 to 1,000,000.
    #[schemars(range(min = 0.001, max = 1e6))]
    #[schemars(extend("x-unit" = "cmH2O s/ml"))]
    pub urethra_resistance: f64,
    /// Pull of the outflow, cmH2O; 0 to 100.
    #[schemars(range(min = 0.0, max = 100.0))]
    pub outflow_head_cmh2o: f64,
}

impl Irrigation {
    /// The same, if it makes sense.
    ///
    /// # Errors
    /// [`FluidError`] names the first field that is out of range.
    pub fn checked(self) -> Result<Self, FluidError> {
        Self::check(&self)?;
        Ok(self)
    }

    /// The way from the bag.
    pub(crate) fn bag(&self) -> Port {
        Port {
            conductance: self.inflow_tap / self.inflow_resistance,
            pressure: self.bag_height_cmh2o,
        }
    }

    /// The way out.
    pub(crate) fn drain(&self) -> Port {
        Port {
            conductance: match self.emptying {
                true => self.emptying_resistance.recip(),
                false => self.outflow_tap / self.outflow_resistance,
            },
            pressure: -self.outflow_head_cmh2o,
        }
    }
}

impl Default for Irrigation {
    fn default() -> Self {
        Self {
            bag_height_cmh2o: 60.0,
            inflow_tap: 1.0,
            outflow_tap: 1.0,
            emptying: false,
            inflow_resistance: 12.0,
            outflow_resistance: 6.0,
            emptying_resistance: 1.0,
            urethra_resistance: 6.0,
            outflow_head_cmh2o: 10.0,
        }
    }
}

impl Checked for Irrigation {
    type Settings = Irrigation;
    const NAME: &'static str = "Irrigation";

    fn settings(&self) -> &Irrigation {
        self
    }

    fn set(&mut self, settings: Irrigation) {
        *self = settings;
    }

    fn check(settings: &Irrigation) -> Result<(), FluidError> {
        let resistance = |field, value| check(field, value, 1e-3..=1e6, "0.001 to 1,000,000 cmH2O s/ml");
        check(
            "bag_height_cmh2o",
            settings.bag_height_cmh2o,
            0.0..=100.0,
            "0 to 100 cmH2O",
        )?;
        check("inflow_tap", settings.inflow_tap, 0.0..=1.0, "0 to 1")?;
        check("outflow_tap", settings.outflow_tap, 0.0..=1.0, "0 to 1")?;
        resistance("inflow_resistance", settings.inflow_resistance)?;
        resistance("outflow_resistance", settings.outflow_resistance)?;
        resistance("emptying_resistance", settings.emptying_resistance)?;
        resistance("urethra_resistance", settings.urethra_resistance)?;
        check(
            "outflow_head_cmh2o",
            settings.outflow_head_cmh2o,
            0.0..=100.0,
            "0 to 100 cmH2O",
        )
    }
}

/// Water from the bag through the bladder: with a [`Bladder`] and an [`Irrigation`] in the app.
#[derive(Debug, Clone)]
pub struct IrrigationPlugin {
    schedule: InternedScheduleLabel,
}

impl IrrigationPlugin {
    /// Runs in another schedule, which must be that of the other plugins of this crate.
    pub fn new(schedule: impl ScheduleLabel) -> Self {
        Self {
            schedule: schedule.intern(),
        }
    }
}

impl Default for IrrigationPlugin {
    /// Runs in [`FixedPostUpdate`].
    fn default() -> Self {
        Self::new(FixedPostUpdate)
    }
}

impl Plugin for IrrigationPlugin {
    fn build(&self, app: &mut App) {
        plugin::add_core(app, self.schedule);
        app.register_type::<Irrigation>().add_systems(
            self.schedule,
            open_taps
                .in_set(FluidSystems::Demand)
                .run_if(resource_exists::<Irrigation>.and_then(resource_exists::<Bladder>)),
        );
    }
}

pub(crate) fn open_taps(irrigation: Res<Irrigation>, mut step: ResMut<Step>) {
    (step.ports.bag, step.ports.drain) = (irrigation.bag(), irrigation.drain());
}
