//! After the step: what the solver moved and what a cut weakened is written to the components.

use bevy::{ecs::entity::EntityHashMap, prelude::*};

use crate::{
    components::{Spring, Tissue, TissueNode},
    diagnostics::{TissueDiagnostics, timed},
};

/// Writes positions and velocities of all nodes; after a cut also masses, dampings and stiffness, which fall with the
/// tissue around them. Bypasses change detection, which tells edits from this. What sleeps is not written again.
pub(crate) fn write_back(
    mut tissues: Query<(Entity, &mut Tissue)>,
    mut nodes: Query<&mut TissueNode>,
    mut springs: Query<&mut Spring>,
    mut diagnostics: ResMut<TissueDiagnostics>,
) {
    let mut time = std::time::Duration::ZERO;
    timed(&mut time, || {
        let solvers: EntityHashMap<&Tissue> = tissues.iter().collect();
        // Parts of a tissue lie beside each other: one look-up serves a whole run of them.
        let mut known: Option<(Entity, &Tissue)> = None;
        let mut tissue_of = |entity: Entity| match known {
            Some((of, tissue)) if of == entity => Some(tissue),
            _ => {
                known = solvers.get(&entity).map(|tissue| (entity, *tissue));
                known.map(|(_, tissue)| tissue)
            }
        };
        let is_shown = |tissue: &Tissue| !tissue.cut && tissue.written == Some(tissue.solver.motion_version());
        let any_moved = !solvers.values().all(|tissue| is_shown(tissue));
        for mut table in any_moved
            .then(|| nodes.contiguous_iter_mut())
            .into_iter()
            .flatten()
            .flatten()
        {
            for node in table.bypass_change_detection() {
                let Some(tissue) = tissue_of(node.tissue) else { continue };
                if is_shown(tissue) || node.index as usize >= tissue.solver.node_count() {
                    continue;
                }
                node.position = tissue.solver.position(node.index);
                node.velocity = tissue.solver.velocity(node.index);
                if tissue.cut {
                    node.mass_g = tissue.solver.mass_g(node.index);
                    node.damping_g_per_s = tissue.solver.damping_g_per_s(node.index);
                }
            }
        }
        drop(solvers);
        for (_, mut tissue) in &mut tissues {
            let tissue = tissue.bypass_change_detection();
            tissue.cut = false;
            tissue.written = Some(tissue.solver.motion_version());
            for index in std::mem::take(&mut tissue.weakened) {
                let entity = tissue
                    .parts
                    .as_ref()
                    .and_then(|parts| parts.springs.get(index as usize));
                // One that another cut of this step took is gone.
                if let Some(mut spring) = entity.and_then(|&entity| springs.get_mut(entity).ok()) {
                    spring.bypass_change_detection().stiffness_mn_per_m = tissue.solver.spring(index).stiffness;
                }
            }
        }
    });
    diagnostics.write_back += time;
}
