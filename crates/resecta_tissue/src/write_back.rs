//! After the step: what the solver moved and what a cut left lighter or weaker is written to the components.

use bevy::{ecs::entity::EntityHashMap, prelude::*};

use crate::{
    components::{Spring, Tissue, TissueNode},
    diagnostics::{TissueDiagnostics, timed},
};

/// Writes positions and velocities of all nodes, and masses, dampings and stiffness where a cut has taken tissue. Bypasses
/// change detection, which tells edits from this. What sleeps is not written again.
pub(crate) fn write_back(
    mut tissues: Query<(Entity, &mut Tissue)>,
    mut nodes: Query<&mut TissueNode>,
    mut springs: Query<&mut Spring>,
    mut diagnostics: ResMut<TissueDiagnostics>,
) {
    let mut time = std::time::Duration::ZERO;
    timed(&mut time, || {
        let is_shown = |tissue: &Tissue| tissue.written == Some(tissue.solver.motion_version());
        let moved = tissues.iter().filter(|(_, tissue)| !is_shown(tissue));
        let moved: EntityHashMap<&resecta_solver::Tissue> =
            moved.map(|(entity, tissue)| (entity, &tissue.solver)).collect();
        // Parts of a tissue lie beside each other: one look-up serves a whole run of them.
        let mut known: Option<(Entity, Option<&resecta_solver::Tissue>)> = None;
        let tables = (!moved.is_empty()).then(|| nodes.contiguous_iter_mut());
        for mut table in tables.into_iter().flatten().flatten() {
            for node in table.bypass_change_detection() {
                let solver = match known {
                    Some((of, solver)) if of == node.tissue => solver,
                    _ => known.insert((node.tissue, moved.get(&node.tissue).copied())).1,
                };
                if let Some(solver) = solver.filter(|solver| (node.index as usize) < solver.node_count()) {
                    node.position = solver.position(node.index);
                    node.velocity = solver.velocity(node.index);
                }
            }
        }
        drop(moved);
        for (_, mut tissue) in &mut tissues {
            let Tissue {
                solver,
                parts,
                written,
                lightened,
                weakened,
                ..
            } = tissue.bypass_change_detection();
            *written = Some(solver.motion_version());
            let (lightened, weakened) = (std::mem::take(lightened), std::mem::take(weakened));
            let Some(parts) = parts else { continue };
            // What another cut of this step took is gone.
            for index in lightened {
                let entity = parts.nodes.get(index as usize);
                if let Some(mut node) = entity.and_then(|&entity| nodes.get_mut(entity).ok()) {
                    let node = node.bypass_change_detection();
                    node.mass_g = solver.mass_g(index);
                    node.damping_g_per_s = solver.damping_g_per_s(index);
                }
            }
            for index in weakened {
                let entity = parts.springs.get(index as usize);
                if let Some(mut spring) = entity.and_then(|&entity| springs.get_mut(entity).ok()) {
                    spring.bypass_change_detection().stiffness_mn_per_m = solver.spring(index).stiffness;
                }
            }
        }
    });
    diagnostics.write_back += time;
}
