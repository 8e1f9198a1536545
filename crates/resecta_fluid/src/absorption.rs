//! Absorption: irrigant that runs into opened veins.
//!
//! ```text
//! q = n K (p - P)+
//! ```
//!
//! n veins that are open, p the pressure in the bladder, P = 2 kPa (20.4 cmH2O), above which absorption is reported (Hahn 2000).
//! K = 0.01 ml/s per cmH2O a vein is ours: five sinuses at 35 cmH2O then take 44 ml/min. It is a port of the bladder
//! (`balance.rs`), so its integral over a step is exact also where p passes P within one.
//!
//! What was absorbed alarms at levels from practice: 1000 ml (amber) and 2000 ml (red) of saline, 500 and 1000 ml of glycine.

use bevy::{
    ecs::schedule::{InternedScheduleLabel, ScheduleLabel},
    prelude::*,
};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::{
    PA_PER_CMH2O,
    balance::Port,
    bladder::Bladder,
    bleeding, irrigation,
    plugin::{self, FluidSystems, Step, time_passes},
    refused::{Checked, FluidError, check},
};

/// What is in the bag.
#[derive(Reflect, Serialize, Deserialize, JsonSchema, Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Irrigant {
    /// Isotonic saline, for bipolar currents.
    #[default]
    Saline,
    /// Glycine 1.5 %, for monopolar currents.
    Glycine,
}

impl Irrigant {
    /// How much of it absorbed is amber and how much is red, ml (practice).
    pub fn levels_ml(self) -> [f64; 2] {
        match self {
            Irrigant::Saline => [1000.0, 2000.0],
            Irrigant::Glycine => [500.0, 1000.0],
        }
    }
}

/// How much has been absorbed, in words.
#[derive(Reflect, Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Default)]
pub enum AbsorptionLevel {
    /// Below every alarm.
    #[default]
    Quiet,
    /// Watch out.
    Amber,
    /// Stop.
    Red,
}

/// The patient has absorbed so much that an alarm went off. Told once a level.
#[derive(Message, Debug, Clone, Copy, PartialEq)]
pub struct AbsorptionAlarm {
    /// The level reached.
    pub level: AbsorptionLevel,
    /// Absorbed so far, ml.
    pub absorbed_ml: f64,
}

/// How irrigant is absorbed. Module docs of `absorption.rs` have the equation and the basis of the defaults.
#[derive(Reflect, Serialize, Deserialize, JsonSchema, Debug, Clone, Copy, PartialEq)]
#[serde(deny_unknown_fields, default)]
pub struct AbsorptionSettings {
    /// What is in the bag.
    pub irrigant: Irrigant,
    /// Conductance of each open vein, ml/s per cmH2O; 0 to 100.
    #[schemars(range(min = 0.0, max = 100.0))]
    pub conductance_ml_per_s_per_cmh2o: f64,
    /// Pressure in the bladder from which irrigant is absorbed, Pa; 0 to 100,000.
    #[schemars(range(min = 0.0, max = 1e5))]
    pub threshold_pa: f64,
}

impl Default for AbsorptionSettings {
    fn default() -> Self {
        Self {
            irrigant: Irrigant::Saline,
            conductance_ml_per_s_per_cmh2o: 0.01,
            threshold_pa: 2000.0,
        }
    }
}

/// What the patient absorbs. Needs a [`Bladder`] and, to have open veins, [`Vessels`](crate::Vessels).
#[derive(Resource, Reflect, Debug, Clone, PartialEq, Default)]
#[reflect(Resource, Default)]
pub struct Absorption {
    /// Change them at any time; what makes no sense is put back and told.
    pub settings: AbsorptionSettings,
    #[reflect(ignore)]
    absorbed_ml: f64,
    #[reflect(ignore)]
    rate_ml_per_s: f64,
    #[reflect(ignore)]
    level: AbsorptionLevel,
}

impl Absorption {
    /// Nothing absorbed yet.
    ///
    /// # Errors
    /// [`FluidError`] names the first setting that is out of range.
    pub fn new(settings: AbsorptionSettings) -> Result<Self, FluidError> {
        Self::check(&settings)?;
        Ok(Self { settings, ..default() })
    }

    /// Absorbed since it was made, ml.
    pub fn absorbed_ml(&self) -> f64 {
        self.absorbed_ml
    }

    /// Mean rate in the last step that had a length, ml/s.
    pub fn rate_ml_per_s(&self) -> f64 {
        self.rate_ml_per_s
    }

    /// The highest level reached.
    pub fn level(&self) -> AbsorptionLevel {
        self.level
    }
}

impl Checked for Absorption {
    type Settings = AbsorptionSettings;
    const NAME: &'static str = "Absorption";

    fn settings(&self) -> &AbsorptionSettings {
        &self.settings
    }

    fn set(&mut self, settings: AbsorptionSettings) {
        self.settings = settings;
    }

    fn check(settings: &AbsorptionSettings) -> Result<(), FluidError> {
        check(
            "conductance_ml_per_s_per_cmh2o",
            settings.conductance_ml_per_s_per_cmh2o,
            0.0..=100.0,
            "0 to 100 ml/s per cmH2O",
        )?;
        check("threshold_pa", settings.threshold_pa, 0.0..=1e5, "0 to 100,000 Pa")
    }
}

/// Absorption through open veins: with a [`Bladder`] and an [`Absorption`] in the app.
#[derive(Debug, Clone)]
pub struct AbsorptionPlugin {
    schedule: InternedScheduleLabel,
}

impl AbsorptionPlugin {
    /// Runs in another schedule, which must be that of the other plugins of this crate.
    pub fn new(schedule: impl ScheduleLabel) -> Self {
        Self {
            schedule: schedule.intern(),
        }
    }
}

impl Default for AbsorptionPlugin {
    /// Runs in [`FixedPostUpdate`].
    fn default() -> Self {
        Self::new(FixedPostUpdate)
    }
}

impl Plugin for AbsorptionPlugin {
    fn build(&self, app: &mut App) {
        plugin::add_core(app, self.schedule);
        app.add_message::<AbsorptionAlarm>()
            .register_type::<Absorption>()
            .register_type::<AbsorptionSettings>()
            .add_systems(
                self.schedule,
                (
                    demand
                        .in_set(FluidSystems::Demand)
                        .after(irrigation::open_taps)
                        .after(bleeding::demand),
                    account.in_set(FluidSystems::Account),
                )
                    .run_if(resource_exists::<Absorption>.and_then(resource_exists::<Bladder>))
                    .run_if(time_passes),
            );
    }
}

fn demand(absorption: Res<Absorption>, mut step: ResMut<Step>) {
    step.ports.uptake = Port {
        conductance: absorption.settings.conductance_ml_per_s_per_cmh2o * step.open_veins,
        pressure: absorption.settings.threshold_pa / PA_PER_CMH2O,
    };
}

fn account(mut absorption: ResMut<Absorption>, step: Res<Step>, mut alarms: MessageWriter<AbsorptionAlarm>) {
    absorption.absorbed_ml += step.passed.uptake;
    absorption.rate_ml_per_s = step.passed.uptake / step.seconds;
    let [amber, red] = absorption.settings.irrigant.levels_ml();
    for (level, from_ml) in [(AbsorptionLevel::Amber, amber), (AbsorptionLevel::Red, red)] {
        if absorption.absorbed_ml >= from_ml && absorption.level < level {
            absorption.level = level;
            alarms.write(AbsorptionAlarm {
                level,
                absorbed_ml: absorption.absorbed_ml,
            });
        }
    }
}
