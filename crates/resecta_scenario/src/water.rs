//! Blood and water of an exercise: which models of `resecta_fluid` it names, and how they get into the world.
//!
//! An exercise without them is dry: no resource of theirs is there, and they cost nothing.

use bevy::prelude::*;
use resecta_fluid::{
    Absorption, AbsorptionSettings, Bladder, BladderSettings, Circulation, CirculationSettings, FluidError, Irrigation,
    Lens, Turbidity, TurbiditySettings, VesselError, VesselOptions, Vessels,
};
use resecta_instrument::{InstrumentState, Resectoscope};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::{active::ActiveExercise, begun::Begun, errors::RuleError};

/// Irrigation and bladder, and what else of blood and water is on.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Water {
    /// Bag, and the taps as the instrument begins with them: fields of [`Irrigation`]. In play the taps follow the instrument.
    pub irrigation: Irrigation,
    /// How the bladder gives way: fields of [`BladderSettings`].
    pub bladder: BladderSettings,
    /// What the bladder holds at the start, ml, 0 or more. Default 100.
    #[schemars(range(min = 0.0, max = 1e6))]
    pub bladder_ml: f64,
    /// Vessels that open when they are cut; absent, nothing bleeds.
    pub bleeding: Option<Bleeding>,
    /// Blood clouds the water, and jets the lens: fields of [`TurbiditySettings`]; absent, the water stays clear.
    pub turbidity: Option<TurbiditySettings>,
    /// Water gets into opened veins: fields of [`AbsorptionSettings`]; absent, none does.
    pub absorption: Option<AbsorptionSettings>,
}

impl Default for Water {
    fn default() -> Self {
        Self {
            irrigation: Irrigation::default(),
            bladder: BladderSettings::default(),
            bladder_ml: 100.0,
            bleeding: None,
            turbidity: None,
            absorption: None,
        }
    }
}

/// The vessels of an exercise.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Bleeding {
    /// Decides where the vessels lie: the same number, the same vessels. Default 0.
    pub seed: u64,
    /// What they are like: fields of [`VesselOptions`].
    pub vessels: VesselOptions,
    /// Pulse, venous pressure, and what closes a vessel: fields of [`CirculationSettings`].
    pub circulation: CirculationSettings,
}

/// What an exercise's blood and water begin as.
#[derive(Debug, Clone)]
pub(crate) struct PreparedWater {
    irrigation: Irrigation,
    bladder: Bladder,
    circulation: Option<Circulation>,
    vessels: Option<Vessels>,
    turbidity: Option<Turbidity>,
    absorption: Option<Absorption>,
}

impl PreparedWater {
    /// Pressure on the walls of the lumen, Pa.
    pub(crate) fn pressure_pa(&self) -> f64 {
        self.irrigation.pressure_at_tip_pa(self.bladder.pressure_cmh2o())
    }

    /// The state with its taps as the exercise says.
    pub(crate) fn with_taps(&self, start: InstrumentState) -> InstrumentState {
        InstrumentState {
            inflow_tap: self.irrigation.inflow_tap as f32,
            outflow_tap: self.irrigation.outflow_tap as f32,
            ..start
        }
    }

    /// Blood where the operation has begun: from the vessels that lie open, or are closed, and in the water.
    pub(crate) fn begin(&mut self, begun: &Begun, gland: &resecta_solver::Tissue) -> Result<(), RuleError> {
        if let Some(vessels) = self.vessels.as_mut().filter(|_| !begun.bleeding) {
            vessels.close_cut(gland);
        }
        match &mut self.turbidity {
            Some(turbidity) => (turbidity.set_concentration(begun.blood_in_water))
                .map_err(|error| RuleError::new("begun.blood_in_water", error.value, error.expected)),
            None => Ok(()),
        }
    }
}

impl Water {
    /// Checks every rule that needs no gland.
    pub(crate) fn check(&self) -> Result<(), RuleError> {
        self.without_vessels().map(drop)
    }

    /// Makes what they begin as, with the vessels of this gland.
    pub(crate) fn prepare(&self, gland: &resecta_solver::Tissue) -> Result<PreparedWater, RuleError> {
        let vessels = |bleeding: &Bleeding| {
            let vessels = Vessels::generate(gland, &bleeding.vessels, bleeding.seed);
            vessels.map_err(|error| match error {
                VesselError::Option(error) => at("models.water.bleeding.vessels.", error),
                error => RuleError::new(
                    "models.water.bleeding.vessels",
                    error,
                    "vessels that can lie in this gland",
                ),
            })
        };
        Ok(PreparedWater {
            vessels: self.bleeding.as_ref().map(vessels).transpose()?,
            ..self.without_vessels()?
        })
    }

    fn without_vessels(&self) -> Result<PreparedWater, RuleError> {
        let within = |part: &'static str| move |error: FluidError| at(part, error);
        let circulation = self
            .bleeding
            .as_ref()
            .map(|bleeding| Circulation::new(bleeding.circulation));
        // What it holds is a field beside the others here.
        let bladder = Bladder::new(self.bladder, self.bladder_ml).map_err(|error| match error.field {
            "volume_ml" => RuleError::new("models.water.bladder_ml", error.value, error.expected),
            _ => at("models.water.bladder.", error),
        })?;
        let turbidity = self.turbidity.map(Turbidity::new).transpose();
        let absorption = self.absorption.map(Absorption::new).transpose();
        Ok(PreparedWater {
            irrigation: (self.irrigation.checked()).map_err(within("models.water.irrigation."))?,
            bladder,
            circulation: (circulation.transpose()).map_err(within("models.water.bleeding.circulation."))?,
            vessels: None,
            turbidity: turbidity.map_err(within("models.water.turbidity."))?,
            absorption: absorption.map_err(within("models.water.absorption."))?,
        })
    }
}

/// Names a field of a file by where it stands.
fn at(part: &str, error: FluidError) -> RuleError {
    RuleError::new(format!("{part}{}", error.field), error.value, error.expected)
}

/// Puts the water of an exercise into the world in place of what was there; none for a dry one.
pub(crate) fn fill(world: &mut World, water: Option<PreparedWater>, tissue: Entity, instrument: Entity) {
    world.remove_resource::<Irrigation>();
    world.remove_resource::<Bladder>();
    world.remove_resource::<Circulation>();
    world.remove_resource::<Turbidity>();
    world.remove_resource::<Absorption>();
    let Some(water) = water else { return };
    world.insert_resource(water.irrigation);
    world.insert_resource(water.bladder);
    if let Some(circulation) = water.circulation {
        world.insert_resource(circulation);
    }
    if let Some(vessels) = water.vessels {
        world.entity_mut(tissue).insert(vessels);
    }
    if let Some(turbidity) = water.turbidity {
        world.insert_resource(turbidity);
        world.entity_mut(instrument).insert(Lens {
            tip: Vec3::ZERO,
            direction: Vec3::Z,
        });
    }
    if let Some(absorption) = water.absorption {
        world.insert_resource(absorption);
    }
}

/// Turns the bladder's taps as far as the instrument's are.
pub(crate) fn follow_taps(
    active: Res<ActiveExercise>,
    instruments: Query<&InstrumentState>,
    mut irrigation: ResMut<Irrigation>,
) {
    if let Ok(state) = instruments.get(active.instrument) {
        let [inflow_tap, outflow_tap] = [state.inflow_tap, state.outflow_tap].map(f64::from);
        irrigation.set_if_neq(Irrigation {
            inflow_tap,
            outflow_tap,
            ..*irrigation
        });
    }
}

/// Puts the lens where the instrument holds it.
pub(crate) fn follow_lens(mut lenses: Query<(&mut Lens, &Resectoscope, &InstrumentState)>) {
    for (mut lens, scope, state) in &mut lenses {
        let pose = scope.lens_pose(state);
        *lens = Lens {
            tip: pose.translation.into(),
            direction: pose.rotation * Vec3::NEG_Z,
        };
    }
}
