//! Where the landmarks of a case are while its gland gives way.

use bevy::prelude::*;
use resecta_anatomy::Landmark;
use resecta_tissue::Tissue;

use crate::active::ActiveExercise;

/// Nodes within this distance of a place at rest take it along, mm. Ours: about the radius of the urethra and its mucosa, so that the walls
/// around a place in the lumen count and distant tissue does not.
const AROUND_MM: f32 = 10.0;

impl ActiveExercise {
    /// Where a landmark is now, mm; `None` in a case that lacks it.
    ///
    /// The nodes within 10 mm of it at rest take it along by their mean way. Landmarks of the bladder have none around them and stay: the
    /// bladder does not give way.
    pub fn landmark(&self, landmark: Landmark, tissue: &Tissue) -> Option<Vec3> {
        let rest = landmark.place(&self.case)?.as_vec3();
        let is_near = |mm: f32| if mm < AROUND_MM { 1.0 } else { 0.0 };
        Some(rest + mean_way(tissue.solver(), rest, is_near))
    }
}

/// The mean way of the living nodes near a place at rest, mm; zero if there are none. `weight`: what a node counts by its distance from the
/// place at rest, mm; 0 or more. It looks at every node of the tissue.
pub fn mean_way(solver: &resecta_solver::Tissue, rest: Vec3, weight: impl Fn(f32) -> f32) -> Vec3 {
    let (mut sum, mut weights) = (Vec3::ZERO, 0.0);
    for node in (0..solver.node_count() as u32).filter(|&node| solver.is_node_alive(node)) {
        let at_rest = solver.rest_position(node);
        let weight = weight(at_rest.distance(rest));
        if weight > 0.0 {
            sum += (solver.position(node) - at_rest) * weight;
            weights += weight;
        }
    }
    sum / f32::max(weights, f32::MIN_POSITIVE)
}
