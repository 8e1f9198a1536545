//! What chips and water are like, and which numbers are refused.

use std::ops::RangeInclusive;

use bevy::prelude::*;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// A value that is not finite or out of its range; nothing was changed.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
#[error("{field} is {value}, expected {expected}")]
pub struct ChipError {
    /// Name of the field.
    pub field: &'static str,
    /// Its value.
    pub value: f64,
    /// What was expected.
    pub expected: &'static str,
}

/// How chips float and when they leave.
#[derive(Reflect, Serialize, Deserialize, JsonSchema, Debug, Clone, Copy, PartialEq)]
#[serde(deny_unknown_fields, default)]
pub struct ChipSettings {
    /// Density of the irrigant, g/mm³; 0.0009 to 0.0012.
    #[schemars(range(min = 0.0009, max = 0.0012))]
    pub water_density_g_per_mm3: f64,
    /// Viscosity of the irrigant, mPa s; 0.1 to 100.
    #[schemars(range(min = 0.1, max = 100.0))]
    pub water_viscosity_mpa_s: f64,
    /// Drag of a chip as a multiple of that of a sphere of its volume; 0.1 to 10.
    #[schemars(range(min = 0.1, max = 10.0))]
    pub drag_of_sphere: f64,
    /// Chips smaller than this are shreds, mm³ at rest, as are flakes thinner than 0.4 mm: no bodies, mixed with the water; 0 to 1000.
    #[schemars(range(min = 0.0, max = 1000.0))]
    pub least_mm3: f64,
    /// Outflow from which the sheath stands open and lets chips through, ml/s; 0.01 to 1000.
    #[schemars(range(min = 0.01, max = 1000.0))]
    pub flush_ml_per_s: f64,
    /// Bodies that move at once, 1 to 1000; beyond, the oldest are held where they are.
    #[schemars(range(min = 1, max = 1000))]
    pub most: u32,
}

impl Default for ChipSettings {
    /// - water at 20 °C: 0.998 g/ml and 1.0 mPa s;
    /// - twice a sphere's drag: canoes and curls of about 6 x 4 x 15 mm have a sphericity of some 0.7, for which Haider and
    ///   Levenspiel (1989) give about twice the sphere's coefficient at Reynolds numbers of some hundreds;
    /// - shreds below 2 mm³: a grain of 1.6 mm goes where the water goes (ours);
    /// - an open sheath from 6 ml/s: past what a continuous-flow sheath lets out with its telescope in (ours);
    /// - 100 bodies (ours: about a millisecond of a step on one core).
    fn default() -> Self {
        Self {
            water_density_g_per_mm3: 0.998e-3,
            water_viscosity_mpa_s: 1.0,
            drag_of_sphere: 2.0,
            least_mm3: 2.0,
            flush_ml_per_s: 6.0,
            most: 100,
        }
    }
}

impl ChipSettings {
    /// The same, if it makes sense.
    ///
    /// # Errors
    /// [`ChipError`] names the first field that is out of range.
    pub fn checked(self) -> Result<Self, ChipError> {
        check(
            "water_density_g_per_mm3",
            self.water_density_g_per_mm3,
            0.9e-3..=1.2e-3,
            "0.0009 to 0.0012 g/mm³",
        )?;
        check(
            "water_viscosity_mpa_s",
            self.water_viscosity_mpa_s,
            0.1..=100.0,
            "0.1 to 100 mPa s",
        )?;
        check("drag_of_sphere", self.drag_of_sphere, 0.1..=10.0, "0.1 to 10")?;
        check("least_mm3", self.least_mm3, 0.0..=1000.0, "0 to 1000 mm³")?;
        check(
            "flush_ml_per_s",
            self.flush_ml_per_s,
            0.01..=1000.0,
            "0.01 to 1000 ml/s",
        )?;
        check("most", self.most.into(), 1.0..=1000.0, "1 to 1000 bodies")?;
        Ok(self)
    }
}

/// Refuses a value outside of a range; NaN is outside of every range.
fn check(field: &'static str, value: f64, range: RangeInclusive<f64>, expected: &'static str) -> Result<(), ChipError> {
    if range.contains(&value) {
        return Ok(());
    }
    Err(ChipError { field, value, expected })
}
