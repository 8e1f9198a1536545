//! What a player can tell at a step: nothing that view and panels do not offer.

use bevy::{ecs::system::SystemParam, prelude::*};
use resecta_fluid::Vessels;
use resecta_instrument::{InstrumentState, Resectoscope};
use resecta_scenario::{ActiveExercise, metrics::StepObservation};

/// How far a bleeder is made out through clear water, mm. Our choice: about the length of a prostatic urethra.
const SIGHT_MM: f32 = 40.0;
/// Below this share of the light that comes back, no bleeder is made out. Our choice, as in the metric of blind time.
const LEAST_VISIBILITY: f64 = 0.3;

/// Where a player's senses come from.
#[derive(SystemParam)]
pub(super) struct Senses<'w, 's> {
    active: Res<'w, ActiveExercise>,
    step: Res<'w, StepObservation>,
    vessels: Query<'w, 's, &'static Vessels>,
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

    /// Where blood is seen to come from: open vessels within the round field, as far as one sees.
    pub fn bleeders(&self, scope: &Resectoscope, state: &InstrumentState) -> Vec<Vec3> {
        if self.visibility() < LEAST_VISIBILITY {
            return Vec::new();
        }
        let eye = scope.lens_pose(state);
        let half_field = (0.5 * scope.geometry.field_of_view_deg).to_radians();
        let reach = SIGHT_MM * self.visibility() as f32;
        let is_seen = |place: &Vec3| {
            let there = eye.rotation.inverse() * (*place - Vec3::from(eye.translation));
            there.length() < reach && there.angle_between(Vec3::NEG_Z) < half_field
        };
        let vessels = self.vessels.get(self.active.tissue).ok();
        let open = vessels.into_iter().flat_map(Vessels::open);
        open.map(|vessel| vessel.place).filter(is_seen).collect()
    }
}
