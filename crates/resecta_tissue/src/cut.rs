//! Resection: by the loop of a tool, or because entities were despawned; by whole elements, or finer (`fine.rs`).

use std::sync::Arc;

use bevy::{ecs::system::SystemParam, math::DVec3, prelude::*};
use resecta_field::{FieldError, Tool};
use resecta_solver::{NodeKind, Resection};

use crate::{
    collide::{Found, StepTools, ToolContacts, ToolMotion},
    components::Tissue,
    diagnostics::{TissueDiagnostics, timed},
    fine::{Fine, Taken},
    messages::{PutAsideReason, PutAsideSubject, TissueChip, TissueInconsistent, TissuePutAside, TissueResected},
    settings::{CutDetail, CuttingRule, TissueSettings},
    tool::TissueTool,
};

/// Where the stages tell what happened.
#[derive(SystemParam)]
pub(crate) struct Reports<'w> {
    resected: MessageWriter<'w, TissueResected>,
    chips: MessageWriter<'w, TissueChip>,
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

/// Prepares tissues that a scene cuts finer than their elements.
pub(crate) fn refine(
    mut tissues: Query<(Entity, &mut Tissue, &TissueSettings)>,
    tools: Query<&TissueTool>,
    mut reports: Reports,
) {
    if tools.iter().all(|tool| tool.cutter.is_none()) {
        return;
    }
    for (entity, mut tissue, settings) in &mut tissues {
        let CutDetail::Field { spacing_mm } = settings.detail else {
            continue;
        };
        if tissue.fine.is_some() || tissue.coarse_for_good {
            continue;
        }
        match Fine::new(&tissue.solver, spacing_mm) {
            Ok(fine) => tissue.fine = Some(fine),
            Err(error) => {
                tissue.coarse_for_good = true;
                reports.put_aside(entity, PutAsideSubject::Step, PutAsideReason::Field(error));
            }
        }
    }
}

/// Lets the loops of tools that cut take what they reach, and those that coagulate what they touch.
pub(crate) fn cut(
    mut tissues: Query<(Entity, &mut Tissue, &TissueSettings, &ToolContacts)>,
    tools: Res<StepTools>,
    mut commands: Commands,
    mut reports: Reports,
    mut diagnostics: ResMut<TissueDiagnostics>,
) {
    let mut time = std::time::Duration::ZERO;
    timed(&mut time, || {
        let mut ordered: Vec<_> = tissues.iter_mut().collect();
        ordered.sort_unstable_by_key(|(_, tissue, ..)| tissue.ordinal);
        for (entity, mut tissue, settings, contacts) in ordered {
            let tissue = &mut *tissue;
            if let Some(fine) = &mut tissue.fine {
                fine.end_strokes(|tool| tools.iter().any(|other| other.entity == tool && other.cutting));
            }
            for (index, tool) in (0u32..).zip(tools.iter()).filter(|(_, tool)| tool.cutting) {
                let mut cut = Cut {
                    entity,
                    tissue: &mut *tissue,
                    settings,
                    by: Some(tool.entity),
                };
                let resection = cut.by_loop(index, tool, contacts);
                cut.tell(resection, &mut commands, &mut reports, &mut diagnostics);
            }
            let mut cut = Cut {
                entity,
                tissue: &mut *tissue,
                settings,
                by: None,
            };
            let torn = cut.tear();
            cut.tell(torn, &mut commands, &mut reports, &mut diagnostics);
            let coagulates = |found: &&Found| tools[found.tool as usize].coagulates();
            let burnt: Vec<DVec3> = (contacts.burning().iter().filter(coagulates))
                .map(|found| found.place.as_dvec3())
                .collect();
            if let Some(fine) = tissue.fine.as_mut().filter(|_| !burnt.is_empty())
                && let Err(error) = fine.coagulate(&tissue.solver, &burnt)
            {
                reports.put_aside(entity, PutAsideSubject::Step, PutAsideReason::Field(error));
            }
            let chip = tissue.fine.as_mut().and_then(|fine| fine.take_chip(&tissue.solver));
            if let Some((tool, chip)) = chip {
                reports.chips.write(TissueChip {
                    tissue: entity,
                    tool,
                    chip: Arc::new(chip),
                });
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

/// Tissue that a cut has laid bare tears where an edge of a pentahedron is this many times as long as its longest at rest. Liver tears when
/// stretched by a quarter to a third (Kemper et al., Ann. Adv. Automot. Med. 54:15, 2010); a pentahedron that hangs on one corner is drawn out
/// far more than the tissue that it stands for, so it is given more. Our choice: with 2, 3 and 4 alike nothing hangs on threads of centimetres
/// any more, which asked for hundreds of substeps. What mucosa covers unfolds instead,
/// and the capsule, which what surrounds the organ holds, does not tear so easily.
const TORN_STRETCH: f32 = 3.0;

/// Whether a cut has gone into a pentahedron or exposed a face of it.
fn is_laid_bare(solver: &resecta_solver::Tissue, pentahedron: u32) -> bool {
    let is_mucosa = |&node: &u32| solver.node_kind(node) == NodeKind::Mucosa;
    let mut exposed = solver.surface().triangles_of(pentahedron);
    solver.fill(pentahedron) < 1.0 || exposed.any(|(_, triangle)| !triangle.iter().all(is_mucosa))
}

/// A tissue that is about to be cut.
pub(crate) struct Cut<'a> {
    pub entity: Entity,
    pub tissue: &'a mut Tissue,
    pub settings: &'a TissueSettings,
    /// The tool; none when a system despawned entities or something tore off.
    pub by: Option<Entity>,
}

impl Cut<'_> {
    /// Lets a loop take what it reaches in the step.
    fn by_loop(&mut self, index: u32, tool: &ToolMotion, contacts: &ToolContacts) -> Result<Resection, FieldError> {
        let (Some(sweep), Some(deepest)) = (tool.loop_sweep(), tool.loop_deepest_point()) else {
            return Ok(Resection::default());
        };
        let solver = &self.tissue.solver;
        match (self.settings.cutting, &mut self.tissue.fine) {
            (CuttingRule::Sweep, None) => {
                let swept = solver.pentahedra_swept(&sweep);
                self.of_elements(swept)
            }
            (CuttingRule::Sweep, Some(fine)) => {
                let step = fine.stroke(tool.entity, &sweep, tool.kerf_and_thin_mm());
                let taken = fine.cut(solver, self.by, &step)?;
                Ok(self.thin(&taken))
            }
            (CuttingRule::Sphere { radius_mm }, fine) => {
                let swept = solver.pentahedra_swept(&sweep);
                let of_loop = |found: &&Found| found.tool == index;
                let touched = contacts.burning().iter().filter(of_loop);
                let nodes = touched
                    .flat_map(|found| found.point.parts().map(|(node, _)| node))
                    .chain(swept.iter().flat_map(|&index| solver.pentahedron_nodes(index)));
                let Some(node) = nearest_node(solver, deepest, nodes) else {
                    return Ok(Resection::default());
                };
                let Some(fine) = fine else {
                    let near = solver.pentahedra_near(node, f64::from(radius_mm));
                    return self.of_elements(near);
                };
                let ball = Tool::Sphere {
                    centre: solver.position(node).as_dvec3(),
                    radius_mm: f64::from(radius_mm),
                };
                let taken = fine.cut(solver, self.by, &ball)?;
                Ok(self.thin(&taken))
            }
        }
    }

    /// Takes whole pentahedra, pieces that they leave hanging by nothing included.
    pub fn of_elements(&mut self, mut pentahedra: Vec<u32>) -> Result<Resection, FieldError> {
        let solver = &mut self.tissue.solver;
        pentahedra.retain(|&index| solver.is_pentahedron_alive(index));
        pentahedra.sort_unstable();
        pentahedra.dedup();
        if pentahedra.is_empty() {
            return Ok(Resection::default());
        }
        if let Some(fine) = &mut self.tissue.fine {
            let taken = fine.empty(&pentahedra)?;
            return Ok(self.thin(&taken));
        }
        let pieces = solver.pieces_cut_free(&pentahedra);
        pentahedra.extend(pieces);
        Ok(solver.resect(&pentahedra, self.settings.collapse))
    }

    /// Takes away what has torn off since the tissue last moved. Tissue that nothing was cut out of does not tear.
    fn tear(&mut self) -> Result<Resection, FieldError> {
        let Tissue {
            solver,
            fine,
            looked_for_tears,
            ..
        } = &mut *self.tissue;
        let is_still = std::mem::replace(looked_for_tears, solver.motion_version()) == solver.motion_version();
        if is_still || solver.removed_volume_mm3() == 0.0 {
            return Ok(Resection::default());
        }
        let mut drawn_out = solver.drawn_out_pentahedra(TORN_STRETCH);
        drawn_out.retain(|&pentahedron| is_laid_bare(solver, pentahedron) && !solver.is_held(pentahedron));
        let Some(fine) = fine else {
            return self.of_elements(drawn_out);
        };
        let torn = fine.tear(solver, drawn_out)?;
        Ok(self.thin(&torn))
    }

    fn thin(&mut self, taken: &Taken) -> Resection {
        Resection {
            // The solver knows of whole pentahedra only.
            capsule_area_mm2: taken.capsule_mm2,
            ..self.tissue.solver.thin(&taken.left, self.settings.collapse)
        }
    }

    /// Lets the entities of what went follow, and tells.
    pub fn tell(
        self,
        resection: Result<Resection, FieldError>,
        commands: &mut Commands,
        reports: &mut Reports,
        diagnostics: &mut TissueDiagnostics,
    ) {
        let Cut {
            entity,
            tissue,
            settings,
            by,
        } = self;
        let resection = match resection {
            Ok(resection) => resection,
            Err(error) => {
                reports.put_aside(entity, PutAsideSubject::Step, PutAsideReason::Field(error));
                return;
            }
        };
        if resection.taken_mm3.is_empty() {
            return;
        }
        tissue.lightened.extend(&resection.lightened);
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
            tool: by,
            pentahedra: resection.pentahedra,
            taken_mm3: resection.taken_mm3,
            volume_mm3: resection.rest_volume_mm3,
            by_zone_mm3: resection.by_zone_mm3,
            capsule_area_mm2: resection.capsule_area_mm2,
        });
        reports.check(entity, tissue, settings);
    }
}
