//! The bladder: how its pressure follows from its volume, and the books of what went in and out.
//!
//! ```text
//! p(V) = 0                                            V <= V0          not stretched yet
//!        (V - V0) / C                                 V0 <= V <= Vc    filling
//!        (Vc - V0) / C + (V - Vc) / C'                Vc <= V          past its capacity
//! ```
//!
//! V0 = 100 ml, C = 20 ml/cmH2O, Vc = 500 ml and C' = 2.5 ml/cmH2O unless set otherwise. These are ours: a capacity of about
//! 500 ml, at which the pressure reaches 20 cmH2O (2 kPa), where absorption is reported to begin (Hahn 2000); mean pressures of
//! 11 to 35 cmH2O (the same) then lie at 320 to 540 ml. A bag 60 cmH2O high fills it to 600 ml. Nothing here has a memory: a
//! real bladder creeps.
//!
//! How it moves on is `balance.rs`.

use bevy::prelude::*;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::{
    PA_PER_CMH2O,
    balance::Passed,
    refused::{Checked, FluidError, check},
};

/// Most a bladder may be told to hold, ml: no bladder does, and nothing overflows.
const MOST_ML: f64 = 1e6;

/// The pressure-volume law of a bladder. Module docs of `bladder.rs` have the equation and the basis of the defaults.
#[derive(Reflect, Serialize, Deserialize, JsonSchema, Debug, Clone, Copy, PartialEq)]
#[serde(deny_unknown_fields, default)]
pub struct BladderSettings {
    /// Volume up to which there is no pressure, ml; 0 to 10,000.
    #[schemars(range(min = 0.0, max = 10000.0))]
    pub unstretched_ml: f64,
    /// Volume that a cmH2O takes from there to the capacity, ml/cmH2O; 0.01 to 10,000.
    #[schemars(range(min = 0.01, max = 10000.0))]
    pub compliance_ml_per_cmh2o: f64,
    /// Volume from which the wall is stiff, ml; above `unstretched_ml`, to 10,000.
    pub capacity_ml: f64,
    /// The compliance past the capacity, ml/cmH2O; 0.01 to 10,000.
    #[schemars(range(min = 0.01, max = 10000.0))]
    pub stiff_compliance_ml_per_cmh2o: f64,
}

impl Default for BladderSettings {
    fn default() -> Self {
        Self {
            unstretched_ml: 100.0,
            compliance_ml_per_cmh2o: 20.0,
            capacity_ml: 500.0,
            stiff_compliance_ml_per_cmh2o: 2.5,
        }
    }
}

impl BladderSettings {
    /// Pressure at a volume (ml), cmH2O.
    pub fn pressure(&self, volume_ml: f64) -> f64 {
        let stretched = volume_ml.min(self.capacity_ml) - self.unstretched_ml;
        stretched.max(0.0) / self.compliance_ml_per_cmh2o
            + (volume_ml - self.capacity_ml).max(0.0) / self.stiff_compliance_ml_per_cmh2o
    }

    /// The largest volume at which the pressure (cmH2O) is no larger than this, ml.
    pub fn volume_at(&self, pressure_cmh2o: f64) -> f64 {
        let at_capacity = self.pressure(self.capacity_ml);
        self.unstretched_ml
            + pressure_cmh2o.clamp(0.0, at_capacity) * self.compliance_ml_per_cmh2o
            + (pressure_cmh2o - at_capacity).max(0.0) * self.stiff_compliance_ml_per_cmh2o
    }

    /// dp/dV at a volume that is no kink, cmH2O per ml.
    pub(crate) fn stiffness(&self, volume_ml: f64) -> f64 {
        if volume_ml < self.unstretched_ml {
            0.0
        } else if volume_ml < self.capacity_ml {
            1.0 / self.compliance_ml_per_cmh2o
        } else {
            1.0 / self.stiff_compliance_ml_per_cmh2o
        }
    }
}

/// What went into and out of a bladder since it was made, ml. `irrigated + blood = drained + absorbed + change of volume`.
#[derive(Reflect, Debug, Clone, Copy, PartialEq, Default)]
pub struct BladderTotals {
    /// From the bag.
    pub irrigated_ml: f64,
    /// From arteries and veins.
    pub blood_ml: f64,
    /// Through the outflow.
    pub drained_ml: f64,
    /// Into opened veins.
    pub absorbed_ml: f64,
}

/// The patient's bladder, with the prostatic urethra: what all models share. One an app; with none, blood runs away against
/// no pressure. Without [`Irrigation`](crate::Irrigation) it is closed, and fills with blood.
#[derive(Resource, Reflect, Debug, Clone, PartialEq, Default)]
#[reflect(Resource, Default)]
pub struct Bladder {
    /// How its pressure follows from its volume. What makes no sense is put back and told.
    pub settings: BladderSettings,
    #[reflect(ignore)]
    volume_ml: f64,
    #[reflect(ignore)]
    totals: BladderTotals,
    #[reflect(ignore)]
    flows: [f64; 2],
}

impl Bladder {
    /// A bladder that holds `volume_ml`.
    ///
    /// # Errors
    /// [`FluidError`] names the first setting that is out of range, or the volume.
    pub fn new(settings: BladderSettings, volume_ml: f64) -> Result<Self, FluidError> {
        Self::check(&settings)?;
        let mut bladder = Self { settings, ..default() };
        bladder.set_volume_ml(volume_ml)?;
        Ok(bladder)
    }

    /// Volume, ml.
    pub fn volume_ml(&self) -> f64 {
        self.volume_ml
    }

    /// Fills or empties it out of the books.
    ///
    /// # Errors
    /// [`FluidError`] for a volume that is not between 0 and 1,000 litres; the bladder is as before.
    pub fn set_volume_ml(&mut self, volume_ml: f64) -> Result<(), FluidError> {
        check("volume_ml", volume_ml, 0.0..=MOST_ML, "0 to 1e6 ml")?;
        self.volume_ml = volume_ml;
        Ok(())
    }

    /// Pressure, cmH2O.
    pub fn pressure_cmh2o(&self) -> f64 {
        self.settings.pressure(self.volume_ml)
    }

    /// Pressure, Pa.
    pub fn pressure_pa(&self) -> f64 {
        self.pressure_cmh2o() * PA_PER_CMH2O
    }

    /// Mean flow from the bag in the last step that had a length, ml/s.
    pub fn inflow_ml_per_s(&self) -> f64 {
        self.flows[0]
    }

    /// Mean flow through the outflow in the last step that had a length, ml/s.
    pub fn outflow_ml_per_s(&self) -> f64 {
        self.flows[1]
    }

    /// What went in and out.
    pub fn totals(&self) -> &BladderTotals {
        &self.totals
    }

    /// Takes over what a step did.
    pub(crate) fn follow(&mut self, volume_ml: f64, passed: &Passed, seconds: f64) {
        self.volume_ml = volume_ml;
        self.totals.irrigated_ml += passed.bag;
        self.totals.blood_ml += passed.veins + passed.arteries;
        self.totals.drained_ml += passed.drain;
        self.totals.absorbed_ml += passed.uptake;
        self.flows = [passed.bag / seconds, passed.drain / seconds];
    }
}

impl Checked for Bladder {
    type Settings = BladderSettings;
    const NAME: &'static str = "Bladder";

    fn settings(&self) -> &BladderSettings {
        &self.settings
    }

    fn set(&mut self, settings: BladderSettings) {
        self.settings = settings;
    }

    fn check(settings: &BladderSettings) -> Result<(), FluidError> {
        let compliance = 0.01..=10_000.0;
        let expected = "0.01 to 10,000 ml/cmH2O";
        check(
            "unstretched_ml",
            settings.unstretched_ml,
            0.0..=10_000.0,
            "0 to 10,000 ml",
        )?;
        check(
            "compliance_ml_per_cmh2o",
            settings.compliance_ml_per_cmh2o,
            compliance.clone(),
            expected,
        )?;
        let above = settings.unstretched_ml.next_up()..=10_000.0;
        check(
            "capacity_ml",
            settings.capacity_ml,
            above,
            "above unstretched_ml, to 10,000 ml",
        )?;
        check(
            "stiff_compliance_ml_per_cmh2o",
            settings.stiff_compliance_ml_per_cmh2o,
            compliance,
            expected,
        )
    }
}
