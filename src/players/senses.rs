//! What a player can tell at a step: nothing that view and panels do not offer.

use bevy::{ecs::system::SystemParam, prelude::*};
use resecta_fluid::Vessels;
use resecta_scenario::{ActiveExercise, Sight, metrics::StepObservation};

/// Where a player's senses come from.
#[derive(SystemParam)]
pub(super) struct Senses<'w, 's> {
    active: Res<'w, ActiveExercise>,
    step: Res<'w, StepObservation>,
    vessels: Query<'w, 's, &'static Vessels>,
    sight: Sight<'w, 's>,
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

    /// Where blood is seen to come from: open vessels that the lens sees.
    pub fn bleeders(&mut self) -> Vec<Vec3> {
        let vessels = self.vessels.get(self.active.tissue).ok();
        let open = vessels.into_iter().flat_map(Vessels::open);
        let sight = &mut self.sight;
        open.map(|vessel| vessel.place)
            .filter(|place| sight.sees(*place))
            .collect()
    }
}
