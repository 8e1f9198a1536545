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
        Some(rest + mean_way(tissue.solver(), rest))
    }
}

/// The mean way of the nodes that are near a place at rest, mm; zero if there are none.
fn mean_way(solver: &resecta_solver::Tissue, rest: Vec3) -> Vec3 {
    let nodes = (0..solver.node_count() as u32).filter(|&node| solver.is_node_alive(node));
    let near = nodes.filter(|&node| solver.rest_position(node).distance_squared(rest) < AROUND_MM * AROUND_MM);
    let (sum, count) = near.fold((Vec3::ZERO, 0.0_f32), |(sum, count), node| {
        (sum + solver.position(node) - solver.rest_position(node), count + 1.0)
    });
    sum / count.max(1.0)
}
