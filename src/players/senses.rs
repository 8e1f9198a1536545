//! What a player can tell at a step: nothing that view and panels do not offer.

use bevy::{ecs::system::SystemParam, prelude::*};
use resecta_fluid::{RedOut, Turbidity, Vessels};
use resecta_instrument::{InstrumentState, Resectoscope};
use resecta_scenario::{ActiveExercise, metrics::StepObservation};

/// How far a bleeder is made out through clear water, mm. Our choice: about the length of a prostatic urethra.
const SIGHT_MM: f32 = 40.0;
/// Share of the light that has to come back from a bleeder for it to be made out. Our choice: a jet is dark red before tissue, so
/// it is told in murk in which tissue is not.
const LEAST_LIGHT: f64 = 0.15;

/// Where a player's senses come from.
#[derive(SystemParam)]
pub(super) struct Senses<'w, 's> {
    active: Res<'w, ActiveExercise>,
    step: Res<'w, StepObservation>,
    vessels: Query<'w, 's, &'static Vessels>,
    turbidity: Option<Res<'w, Turbidity>>,
    red_outs: Query<'w, 's, &'static RedOut>,
}

impl Senses<'_, '_> {
    /// Whether the loop is seen in tissue, dents it or cuts it.
    pub fn loop_in_tissue(&self) -> bool {
        self.step.loop_in_tissue
    }

    /// Pressure in the bladder on the panel, cmH2O.
    pub fn pressure_cmh2o(&self) -> f64 {
        self.step.water.pressure_cmh2o
    }

    /// How clear the view is, 0 to 1.
    pub fn visibility(&self) -> f64 {
        self.step.water.visibility
    }

    /// Share of the light that comes back from a distance, 0 to 1: in murk one sees what is near.
    fn light_from(&self, distance_mm: f32) -> f64 {
        let covered = self
            .red_outs
            .get(self.active.instrument)
            .map_or(0.0, |red_out| red_out.covered);
        let murk = self.turbidity.as_ref();
        (1.0 - covered) * murk.map_or(1.0, |turbidity| turbidity.visibility_at(distance_mm.into()))
    }

    /// Where blood is seen to come from: open vessels within the round field, as far as one sees.
    pub fn bleeders(&self, scope: &Resectoscope, state: &InstrumentState) -> Vec<Vec3> {
        let eye = scope.lens_pose(state);
        let half_field = (0.5 * scope.geometry.field_of_view_deg).to_radians();
        let is_seen = |place: &Vec3| {
            let there = eye.rotation.inverse() * (*place - Vec3::from(eye.translation));
            let distance_mm = there.length();
            distance_mm < SIGHT_MM
                && there.angle_between(Vec3::NEG_Z) < half_field
                && self.light_from(distance_mm) >= LEAST_LIGHT
        };
        let vessels = self.vessels.get(self.active.tissue).ok();
        let open = vessels.into_iter().flat_map(Vessels::open);
        open.map(|vessel| vessel.place).filter(is_seen).collect()
    }
}
