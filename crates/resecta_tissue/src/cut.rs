//! Resection: by the loop of a tool, or because entities were despawned.

use bevy::{ecs::system::SystemParam, prelude::*};

use crate::{
    collide::{Collider, StepTools},
    components::Tissue,
    diagnostics::{TissueDiagnostics, timed},
    messages::{PutAsideReason, PutAsideSubject, TissueInconsistent, TissuePutAside, TissueResected},
    settings::{CuttingRule, TissueSettings},
    tool::ToolPartKind,
};

/// Where the stages tell what happened.
#[derive(SystemParam)]
pub(crate) struct Reports<'w> {
    resected: MessageWriter<'w, TissueResected>,
    put_aside: MessageWriter<'w, TissuePutAside>,
    inconsistent: MessageWriter<'w, TissueInconsistent>,
    totals: ResMut<'w, ReportTotals>,
}

/// How much was told since the app began.
#[derive(Resource, Default)]
pub(crate) struct ReportTotals {
    pub put_aside: usize,
    pub inconsistencies: usize,
}

impl Reports<'_> {
    pub fn put_aside(&mut self, tissue: Entity, subject: PutAsideSubject, reason: PutAsideReason) {
        self.totals.put_aside += 1;
        self.put_aside.write(TissuePutAside {
            tissue,
            subject,
            reason,
        });
    }

    /// Validates the solver's arrays where that was asked for.
    fn check(&mut self, entity: Entity, tissue: &Tissue, settings: &TissueSettings) {
        if !(cfg!(debug_assertions) || settings.check_consistency) {
            return;
        }
        if let Err(inconsistency) = tissue.solver.validate() {
            error!("tissue {entity} is inconsistent: {inconsistency}");
            self.totals.inconsistencies += 1;
            self.inconsistent.write(TissueInconsistent {
                tissue: entity,
                inconsistency: inconsistency.to_string(),
            });
        }
    }
}

/// Lets the loops of tools that cut take what they reach.
pub(crate) fn cut(
    mut tissues: Query<(Entity, &mut Tissue, &TissueSettings, &Collider)>,
    tools: Res<StepTools>,
    mut commands: Commands,
    mut reports: Reports,
    mut diagnostics: ResMut<TissueDiagnostics>,
) {
    let mut time = std::time::Duration::ZERO;
    timed(&mut time, || {
        let mut ordered: Vec<_> = tissues.iter_mut().collect();
        ordered.sort_unstable_by_key(|(_, tissue, ..)| tissue.ordinal);
        for (entity, mut tissue, settings, collider) in ordered {
            for (index, tool) in tools.iter().enumerate().filter(|(_, tool)| tool.cutting) {
                let (Some(sweep), Some(deepest)) = (tool.loop_sweep(), tool.loop_deepest_point()) else {
                    continue;
                };
                let swept = tissue.solver.pentahedra_swept(&sweep);
                let reached = match settings.cutting {
                    CuttingRule::Sweep => swept,
                    CuttingRule::Sphere { radius_mm } => {
                        let touched = collider.found().iter().filter(|found| {
                            found.tool == index as u32 && found.kind == ToolPartKind::Loop && found.touches()
                        });
                        let nodes = touched.flat_map(|found| found.contact.nodes);
                        let nodes = nodes.chain(swept.iter().flat_map(|&index| tissue.solver.pentahedron_nodes(index)));
                        match nearest_node(&tissue.solver, deepest, nodes) {
                            Some(node) => tissue.solver.pentahedra_near(node, f64::from(radius_mm)),
                            None => Vec::new(),
                        }
                    }
                };
                let tissue = &mut *tissue;
                let by = Some(tool.entity);
                resect(
                    entity,
                    tissue,
                    settings,
                    by,
                    reached,
                    &mut commands,
                    &mut reports,
                    &mut diagnostics,
                );
            }
        }
    });
    diagnostics.resect += time;
}

/// The contact node: of the nodes that the loop touches, the nearest to its deepest point.
fn nearest_node(solver: &resecta_solver::Tissue, point: Vec3, nodes: impl Iterator<Item = u32>) -> Option<u32> {
    let distance = |node: u32| solver.position(node).distance_squared(point);
    nodes.min_by(|&a, &b| distance(a).total_cmp(&distance(b)).then(a.cmp(&b)))
}

/// Removes pentahedra with all that goes with them, pieces that they leave hanging by nothing included, from the solver
/// and from the world, and tells.
pub(crate) fn resect(
    entity: Entity,
    tissue: &mut Tissue,
    settings: &TissueSettings,
    tool: Option<Entity>,
    mut pentahedra: Vec<u32>,
    commands: &mut Commands,
    reports: &mut Reports,
    diagnostics: &mut TissueDiagnostics,
) {
    pentahedra.retain(|&index| tissue.solver.is_pentahedron_alive(index));
    pentahedra.sort_unstable();
    pentahedra.dedup();
    if pentahedra.is_empty() {
        return;
    }
    let pieces = tissue.solver.pieces_cut_free(&pentahedra);
    pentahedra.extend(pieces);
    let resection = tissue.solver.resect(&pentahedra, settings.collapse);
    tissue.cut = true;
    tissue.weakened.extend(&resection.weakened);
    diagnostics.resected += resection.pentahedra.len();
    if resection.law_refused {
        reports.put_aside(entity, PutAsideSubject::Step, PutAsideReason::Collapse);
    }
    if let Some(parts) = &tissue.parts {
        let entities = |indices: &[u32], parts: &[Entity]| -> Vec<Entity> {
            indices
                .iter()
                .filter_map(|&index| parts.get(index as usize).copied())
                .collect()
        };
        let mut gone = entities(&resection.pentahedra, &parts.pentahedra);
        gone.extend(entities(&resection.springs, &parts.springs));
        gone.extend(entities(&resection.nodes, &parts.nodes));
        commands.queue(move |world: &mut World| {
            for entity in gone {
                // What a system despawned is gone already.
                world.try_despawn(entity).ok();
            }
        });
    }
    reports.resected.write(TissueResected {
        tissue: entity,
        tool,
        pentahedra: resection.pentahedra,
        volume_mm3: resection.rest_volume_mm3,
        by_zone_mm3: resection.by_zone_mm3,
        capsule_area_mm2: resection.capsule_area_mm2,
    });
    reports.check(entity, tissue, settings);
}
