//! What a player can tell at a step: nothing that view and panels do not offer.

use bevy::{ecs::system::SystemParam, prelude::*};
use resecta_fluid::Vessels;
use resecta_scenario::{ActiveExercise, Sight, mean_way, metrics::StepObservation};

/// Nodes so near to a place at rest tell where it has moved, mm: about a cell.
const AROUND_MM: f32 = 4.0;
/// Further than this it is followed no more, mm.
const FURTHEST_MM: f32 = 8.0;

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

    /// Displacement of the tissue at some places of the rest shape (mm), mm, at most 8: the mean over the living nodes within 4 mm, weighted
    /// by nearness. Zero where there are none. A surgeon sees it move.
    pub fn moved(&self, places: &[Vec3]) -> Vec<Vec3> {
        let Some(tissue) = self.sight.rays.tissue(self.active.tissue) else {
            return vec![Vec3::ZERO; places.len()];
        };
        let weight = |mm: f32| (1.0 - mm / AROUND_MM).max(0.0);
        let way = |place: &Vec3| mean_way(tissue.solver(), *place, weight).clamp_length_max(FURTHEST_MM);
        places.iter().map(way).collect()
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
