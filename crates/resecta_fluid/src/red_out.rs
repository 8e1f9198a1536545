//! Red-out: a jet at the lens.
//!
//! An open artery at x with the unit direction n hits a lens at y where y lies in a cone about n, the lens does not look away
//! from x, and the distance r is less than the jet's reach L. It does so with
//!
//! ```text
//! w = (1 - r / L)+ s            s: what its clot has left of it
//! ```
//!
//! and all that hit with h = 1 - product of (1 - w). The share R of the lens that is covered goes by
//!
//! ```text
//! dR/dt = h (1 - R) / T - R q / W
//! ```
//!
//! T how fast a jet smears, q the flow from the bag past the lens, W the volume that clears it; with constant coefficients over
//! a step, so the step is an exact exponential. All constants are ours.
//!
//! So does a view get lost, and come back: turn away or advance past the jet, let the water run.

use bevy::prelude::*;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::{
    balance::phi,
    plugin::Step,
    refused::{FluidError, FluidRefused, check},
    turbidity::Turbidity,
    vessels::{VesselKind, Vessels},
};

/// The front lens of a telescope. Whoever moves it writes it before [`FluidSystems::View`](crate::FluidSystems::View).
#[derive(Component, Reflect, Debug, Clone, Copy, PartialEq)]
#[reflect(Component)]
#[require(RedOut)]
pub struct Lens {
    /// Where it is, mm, world.
    pub tip: Vec3,
    /// Where it looks; of any length but 0.
    pub direction: Vec3,
}

impl Lens {
    fn check(&self) -> Result<Vec3, FluidError> {
        let offending = |vector: Vec3| vector.to_array().into_iter().find(|component| !component.is_finite());
        let refused = |field, value: f32, expected| FluidError {
            field,
            value: value.into(),
            expected,
        };
        if let Some(value) = offending(self.tip) {
            return Err(refused("tip", value, "finite components"));
        }
        self.direction.try_normalize().ok_or_else(|| {
            let value = offending(self.direction).unwrap_or(0.0);
            refused("direction", value, "finite components, not all 0")
        })
    }
}

/// How much of a lens is covered by blood.
#[derive(Component, Reflect, Debug, Clone, Copy, PartialEq, Default)]
#[reflect(Component)]
pub struct RedOut {
    /// 0 (clear) to 1 (nothing but red). Written after each step.
    pub covered: f64,
}

/// Jets at the lens. Module docs of `red_out.rs` have the equations.
#[derive(Reflect, Serialize, Deserialize, JsonSchema, Debug, Clone, Copy, PartialEq)]
#[serde(deny_unknown_fields, default)]
pub struct RedOutSettings {
    /// L: how far a jet reaches, mm; 0.001 to 1,000.
    #[schemars(range(min = 0.001, max = 1000.0))]
    pub reach_mm: f64,
    /// Half the angle of a jet's cone, degrees; 0 to 90.
    #[schemars(range(min = 0.0, max = 90.0))]
    pub half_angle_deg: f64,
    /// T: time in which a jet covers the lens, s; 0.001 to 1,000.
    #[schemars(range(min = 0.001, max = 1000.0))]
    pub smear_s: f64,
    /// W: irrigant that clears it, ml; 0.001 to 1,000.
    #[schemars(range(min = 0.001, max = 1000.0))]
    pub clearing_ml: f64,
}

impl Default for RedOutSettings {
    fn default() -> Self {
        Self {
            reach_mm: 15.0,
            half_angle_deg: 25.0,
            smear_s: 0.1,
            clearing_ml: 4.0,
        }
    }
}

impl RedOutSettings {
    pub(crate) fn check(&self) -> Result<(), FluidError> {
        check("red_out.reach_mm", self.reach_mm, 1e-3..=1e3, "0.001 to 1,000 mm")?;
        check(
            "red_out.half_angle_deg",
            self.half_angle_deg,
            0.0..=90.0,
            "0 to 90 degrees",
        )?;
        check("red_out.smear_s", self.smear_s, 1e-3..=1e3, "0.001 to 1,000 s")?;
        check("red_out.clearing_ml", self.clearing_ml, 1e-3..=1e3, "0.001 to 1,000 ml")
    }

    /// How strongly a full jet from `from` along `along` hits a lens at `tip` that looks along `looks`, 0 to 1.
    fn hits(&self, from: Vec3, along: Vec3, tip: Vec3, looks: Vec3) -> f64 {
        let way = tip - from;
        let distance = f64::from(way.length());
        let cosine = f64::from(way.normalize_or(along).dot(along));
        let inside = cosine >= self.half_angle_deg.to_radians().cos() && looks.dot(way) <= 0.0;
        if inside {
            (1.0 - distance / self.reach_mm).max(0.0)
        } else {
            0.0
        }
    }
}

/// Jets cover lenses, and water clears them.
pub(crate) fn redden(
    mut lenses: Query<(Entity, &Lens, &mut RedOut)>,
    vessels: Query<&Vessels>,
    turbidity: Res<Turbidity>,
    step: Res<Step>,
    mut refused: MessageWriter<FluidRefused>,
) {
    let settings = &turbidity.settings.red_out;
    let mut lists: Vec<&Vessels> = vessels.iter().collect();
    lists.sort_unstable_by_key(|vessels| vessels.ordinal);
    let clears = step.passed.bag / step.seconds / settings.clearing_ml;
    for (entity, lens, mut red_out) in &mut lenses {
        let mut missed = 1.0;
        match lens.check() {
            Ok(looks) => {
                let open = lists.iter().flat_map(|vessels| vessels.open());
                for jet in open.filter(|open| open.vessel.kind == VesselKind::Arterial) {
                    missed *= 1.0 - jet.share * settings.hits(jet.place, jet.direction, lens.tip, looks);
                }
            }
            Err(error) => {
                refused.write(FluidRefused {
                    what: "Lens",
                    entity: Some(entity),
                    error,
                });
            }
        }
        let covers = (1.0 - missed) / settings.smear_s;
        // What someone wrote into it does not spread.
        let covered = if red_out.covered.is_finite() {
            red_out.covered
        } else {
            0.0
        };
        let rate = covers - (covers + clears) * covered;
        red_out.covered = (covered + rate * phi(covers + clears, step.seconds)).clamp(0.0, 1.0);
    }
}
