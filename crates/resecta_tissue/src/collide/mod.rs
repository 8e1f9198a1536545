//! Collision: tools push tissue, and tissue tells what touched it.
//!
//! Before a step moves the tissue, the points of it that parts of tools may touch on their way are found (`samples.rs`,
//! `contacts.rs`). The solver then keeps each out of its part in every substep, so that neither a thin loop nor a fast one is carried
//! past what it should push.

mod closest;
mod collider;
mod contacts;
mod eights;
mod make_room;
mod nearest;
mod overlap;
mod patches;
mod samples;
mod search;
mod sweep;
mod winding;

use bevy::prelude::*;
use resecta_solver::{Contact, Touch};

pub use self::overlap::Overlap;
pub(crate) use self::{
    closest::segment_triangle,
    collider::{Collider, DEPTH_LIMIT_MM, Face},
    contacts::Found,
    nearest::reach_mm,
    sweep::ToolMotion,
};
use self::{
    samples::Near,
    search::{Before, Search},
    sweep::PartSweep,
};
use crate::{
    components::{Tissue, WaterPressure},
    cut::Reports,
    diagnostics::{TissueDiagnostics, timed},
    messages::{PutAsideReason, PutAsideSubject, TissueContact},
    settings::TissueSettings,
    skin::Skin,
    tool::{TissueTool, ToolLoad, ToolPartKind},
};

/// The ways of all tools in the coming step, in the order of their query.
#[derive(Resource, Default, Deref)]
pub(crate) struct StepTools(Vec<ToolMotion>);

/// What tools touch of a tissue.
#[derive(Component, Default)]
pub(crate) struct ToolContacts {
    /// What loops under current touch when the step begins.
    burning: Vec<Found>,
    /// What they pushed in the last step.
    before: Before,
}

impl ToolContacts {
    /// What loops under current touch when the step begins.
    pub fn burning(&self) -> &[Found] {
        &self.burning
    }
}

/// Reads the tools. One that is not finite is left out and reported.
pub(crate) fn read_tools(tools: Query<(Entity, &TissueTool)>, mut step: ResMut<StepTools>, mut reports: Reports) {
    step.0.clear();
    for (entity, tool) in &tools {
        if tool.is_valid() {
            step.0.push(ToolMotion::new(entity, tool));
        } else {
            reports.put_aside(entity, PutAsideSubject::Tool, PutAsideReason::Tool);
        }
    }
}

/// Whether there is a tool and a tissue that collides.
pub(crate) fn any_collision(tools: Query<(), With<TissueTool>>, tissues: Query<&TissueSettings, With<Tissue>>) -> bool {
    !tools.is_empty() && tissues.iter().any(|settings| settings.collision)
}

/// Whether there is a tool.
pub(crate) fn any_tool(tools: Query<(), With<TissueTool>>) -> bool {
    !tools.is_empty()
}

/// Finds what loops under current touch, in the tissue as the last step left it.
pub(crate) fn collide(
    mut tissues: Query<(&Tissue, &TissueSettings, &mut ToolContacts)>,
    tools: Res<StepTools>,
    mut diagnostics: ResMut<TissueDiagnostics>,
) {
    let mut spent = std::time::Duration::ZERO;
    timed(&mut spent, || {
        for (tissue, settings, mut contacts) in &mut tissues {
            contacts.burning.clear();
            if settings.collision {
                let burns = |tool: &ToolMotion, kind| tool.current(kind);
                let ToolContacts { burning, before } = &mut *contacts;
                find(tissue, (&tools, before), burns, 0.0, burning);
                contacts.burning.retain(Found::is_touched);
            }
        }
    });
    diagnostics.collide += spent;
}

/// Moves every tissue by one step, and writes messages about what touched it.
pub(crate) fn integrate(
    mut tissues: Query<(
        Entity,
        &mut Tissue,
        &TissueSettings,
        &mut ToolContacts,
        Option<&WaterPressure>,
    )>,
    mut loads: Query<&mut ToolLoad>,
    tools: Res<StepTools>,
    time: Res<Time>,
    mut steps: Local<u32>,
    mut messages: MessageWriter<TissueContact>,
    mut reports: Reports,
    mut diagnostics: ResMut<TissueDiagnostics>,
) {
    if time.delta().is_zero() {
        // A paused clock in a schedule that runs every frame. Tools may be gone when it goes on.
        tissues
            .iter_mut()
            .for_each(|(.., mut contacts, _)| contacts.burning.clear());
        return;
    }
    let mut spent = std::time::Duration::ZERO;
    let mut on_tools = vec![ToolLoad::default(); tools.len()];
    timed(&mut spent, || {
        let mut ordered: Vec<_> = tissues.iter_mut().collect();
        ordered.sort_unstable_by_key(|(_, tissue, ..)| tissue.ordinal);
        for (entity, mut tissue, settings, mut of_tools, water) in ordered {
            let WaterPressure(pressure_pa) = water.copied().unwrap_or_default();
            if let Err(error) = tissue.solver.set_water_pressure_pa(pressure_pa) {
                reports.put_aside(entity, PutAsideSubject::Step, PutAsideReason::Edit(error));
            }
            let watched = settings.watch_error_every > 0 && steps.is_multiple_of(settings.watch_error_every);
            if watched {
                if let Some(aim_mm) = settings.error_aim_mm {
                    // An aim that is none is left out: the solver keeps the one it has.
                    tissue.solver.set_error_aim_mm(aim_mm).ok();
                }
                tissue.solver.begin_watch();
            }
            let mut found = Vec::new();
            let mut touches = Touches::default();
            if settings.collision {
                let pushes = |tool: &ToolMotion, kind| tool.pushes(kind);
                let overlap = find(
                    &tissue,
                    (&tools, &of_tools.before),
                    pushes,
                    time.delta_secs(),
                    &mut found,
                );
                diagnostics.overlap.join(overlap);
                // A loop that cuts pushes nothing: its contacts are those from before the cut.
                let is_told = |found: &&Found| !tools[found.tool as usize].pushes(found.kind);
                touches.extend(of_tools.burning.iter().filter(is_told).map(Touched::burnt));
            }
            let parts: Vec<Vec<PartSweep>> = tools.iter().map(|tool| tool.parts().collect()).collect();
            let part = |found: &Found| &parts[found.tool as usize][found.part as usize];
            let modulus_pa = tissue.solver.spring_modulus_pa();
            let contacts: Vec<Contact> = (found.iter())
                .map(|found| found.contact(part(found), modulus_pa))
                .collect();
            match tissue.solver.advance(time.delta_secs_f64(), &contacts) {
                Ok(report) => {
                    for put_aside in &report.put_aside {
                        reports.put_aside(entity, PutAsideSubject::Node(put_aside.node), PutAsideReason::Motion);
                    }
                    if report.contacts_refused > 0 {
                        let refused = PutAsideReason::Contacts(report.contacts_refused);
                        reports.put_aside(entity, PutAsideSubject::Step, refused);
                    }
                    diagnostics.substeps += report.substeps + report.substeps_repeated;
                    of_tools.before.renew(&found, tissue.solver.touches());
                    for (found, touch) in found.iter().zip(tissue.solver.touches()) {
                        on_tools[found.tool as usize].add(touch.force_un, found.place);
                        touches.extend(Touched::pushed(found, part(found), &touch, &tissue.solver));
                    }
                }
                Err(error) => reports.put_aside(entity, PutAsideSubject::Step, PutAsideReason::Step(error)),
            }
            diagnostics.contacts += contacts.len();
            of_tools.burning.clear();
            touches.tell(entity, &tools, &mut messages);
            if watched {
                let error = match settings.error_aim_mm {
                    Some(_) => tissue.solver.end_watch(),
                    None => tissue.solver.drop_watch(),
                };
                diagnostics.error_mm = error.map_or(diagnostics.error_mm, |error| error as f32);
            }
            diagnostics.nodes += tissue.solver.living_nodes();
            diagnostics.springs += tissue.solver.living_springs();
            diagnostics.springs_softened += tissue.solver.softened_springs();
            diagnostics.pentahedra += tissue.solver.living_pentahedra();
            diagnostics.inverted += tissue.solver.inverted_count();
        }
        *steps = steps.wrapping_add(1);
    });
    for (tool, on_tool) in tools.iter().zip(on_tools) {
        if let Ok(mut load) = loads.get_mut(tool.entity) {
            load.set_if_neq(on_tool);
        }
    }
    diagnostics.integrate += spent;
}

/// Finds what the wanted parts of all tools may touch in the step, in the order of tools and parts: later contacts win. Returns how much
/// tissue lies in these parts when the step begins.
fn find(
    tissue: &Tissue,
    (tools, before): (&[ToolMotion], &Before),
    wanted: impl Fn(&ToolMotion, ToolPartKind) -> bool,
    step_s: f32,
    found: &mut Vec<Found>,
) -> Overlap {
    let mut overlap = Overlap::default();
    for (tool_index, tool) in (0..).zip(tools) {
        let parts = (0u32..).zip(tool.parts());
        let parts: Vec<(u32, PartSweep)> = parts.filter(|(_, part)| wanted(tool, part.kind)).collect();
        if parts.is_empty() {
            continue;
        }
        let near = Near::of(tissue, &parts, step_s);
        let search = Search {
            skin: &Skin::of(tissue),
            fine: tissue.fine.as_ref(),
            near: &near,
            tool: tool_index,
            parts: &parts,
            before,
        };
        overlap.join(search.find(found));
    }
    overlap
}

/// What touched a tissue in a step.
#[derive(Default)]
struct Touches(Vec<Touched>);

/// Where a part touched a pentahedron.
struct Touched {
    /// Indices of tool and part, and the pentahedron.
    of: (u32, u32, u32),
    kind: ToolPartKind,
    surface: resecta_solver::NodeKind,
    point: Vec3,
    normal: Vec3,
    depth: f32,
    force_un: Vec3,
}

impl Touched {
    /// By a loop that cuts, when the step begins.
    fn burnt(found: &Found) -> Touched {
        Touched {
            of: (found.tool, found.part, found.pentahedron),
            kind: found.kind,
            surface: found.surface,
            point: found.place,
            normal: found.away,
            depth: -found.gap_mm,
            force_un: Vec3::ZERO,
        }
    }

    /// By a part that pushed; `None` if it did not come to that.
    fn pushed(found: &Found, part: &PartSweep, touch: &Touch, solver: &resecta_solver::Tissue) -> Option<Touched> {
        let has_pushed = touch.normal != Vec3::ZERO;
        if !has_pushed && !found.is_touched() {
            return None;
        }
        let point = (found.point.parts()).fold(Vec3::ZERO, |sum, (node, weight)| sum + solver.position(node) * weight);
        Some(Touched {
            normal: if has_pushed { touch.normal } else { found.away },
            depth: part.depth_at_end(point),
            force_un: touch.force_un,
            point,
            ..Touched::burnt(found)
        })
    }
}

impl Touches {
    fn extend(&mut self, touched: impl IntoIterator<Item = Touched>) {
        self.0.extend(touched);
    }

    /// Writes one message for each part and pentahedron: the deepest contact, with the sum of the forces.
    fn tell(mut self, tissue: Entity, tools: &[ToolMotion], messages: &mut MessageWriter<TissueContact>) {
        self.0.sort_by(|a, b| a.of.cmp(&b.of).then(b.depth.total_cmp(&a.depth)));
        for touches in self.0.chunk_by(|one, next| one.of == next.of) {
            let touch = &touches[0];
            let (tool, _, pentahedron) = touch.of;
            let tool = &tools[tool as usize];
            let force_un: Vec3 = touches.iter().map(|touch| touch.force_un).sum();
            messages.write(TissueContact {
                tissue,
                tool: tool.entity,
                part: touch.kind,
                pentahedron,
                point: touch.point,
                normal: touch.normal,
                depth_mm: touch.depth.max(0.0),
                force_n: force_un.length() * 1e-6,
                kind: touch.surface,
                current: tool.current(touch.kind),
            });
        }
    }
}

/// Remembers where the step left each tool.
pub(crate) fn remember_tools(mut tools: Query<&mut TissueTool>) {
    for mut tool in &mut tools {
        if tool.is_valid() {
            let placement = tool.placement();
            tool.bypass_change_detection().previous = Some(placement);
        }
    }
}
