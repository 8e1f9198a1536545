//! Collision: tools push tissue, and tissue tells what touched it.
//!
//! The motion of a tool during a step is divided into passes that are short against the part that moves. Each pass brings
//! the hierarchy up to date, finds contacts and moves the tissue by its share of the step, so that neither a thin loop nor
//! a fast one is carried past what it should push.

mod closest;
mod collider;
mod contacts;
mod nearest;
mod patches;
mod steady;
mod surroundings;
mod sweep;
mod touch;
mod winding;

use std::ops::Range;

use bevy::prelude::*;
use resecta_solver::{Contact, NodeKind};

pub(crate) use self::{
    closest::segment_triangle,
    collider::{Collider, Face},
    contacts::Found,
    nearest::{Nearest, reach_mm},
    sweep::{Axis, ToolMotion},
};
use self::{
    collider::Nearby,
    contacts::Search,
    sweep::{PartSweep, Pass},
};
use crate::{
    components::Tissue,
    cut::Reports,
    diagnostics::{TissueDiagnostics, timed},
    messages::{PutAsideReason, PutAsideSubject, TissueContact},
    settings::TissueSettings,
    skin::Skin,
    tool::{TissueTool, ToolPartKind},
};

/// The ways of all tools in the coming step, in the order of their query.
#[derive(Resource, Default, Deref)]
pub(crate) struct StepTools(Vec<ToolMotion>);

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

/// Finds what each tool touches on its way through the step, in the tissue as the last step left it: all that a step of one
/// pass enforces, and what loops under current touch.
pub(crate) fn collide(
    mut tissues: Query<(&mut Tissue, &TissueSettings, &mut Collider)>,
    tools: Res<StepTools>,
    time: Res<Time>,
    mut diagnostics: ResMut<TissueDiagnostics>,
) {
    let mut spent = std::time::Duration::ZERO;
    timed(&mut spent, || {
        let mut ordered: Vec<_> = tissues
            .iter_mut()
            .filter(|(_, settings, _)| settings.collision)
            .collect();
        ordered.sort_unstable_by_key(|(tissue, ..)| tissue.ordinal);
        for (mut tissue, _, mut collider) in ordered {
            collider.update(&Skin::of(&tissue));
            let passes = collider.passes(&tools);
            let mut found = collider.take_found();
            found.clear();
            // What pushes is found anew in each of several passes, and after a cut.
            collider.found_all = passes == 1 && !tools.iter().any(|tool| tool.cutting);
            let wanted = |tool: &ToolMotion, kind| collider.found_all || tool.current(kind) || !tool.pushes(kind);
            for pass in Pass::all(passes) {
                find_contacts(
                    &collider,
                    &mut tissue,
                    &tools,
                    (pass, time.delta_secs()),
                    wanted,
                    &mut found,
                );
            }
            collider.put_found(found);
        }
    });
    diagnostics.collide += spent;
}

/// Moves every tissue by one step, pass by pass, and tells what touched it.
pub(crate) fn integrate(
    mut tissues: Query<(Entity, &mut Tissue, &TissueSettings, &mut Collider)>,
    tools: Res<StepTools>,
    time: Res<Time>,
    mut contacts: Local<Vec<Contact>>,
    mut steps: Local<u32>,
    mut messages: MessageWriter<TissueContact>,
    mut reports: Reports,
    mut diagnostics: ResMut<TissueDiagnostics>,
) {
    if time.delta().is_zero() {
        // A paused clock in a schedule that runs every frame. Tools may be gone when it goes on.
        tissues
            .iter_mut()
            .for_each(|(.., mut collider)| collider.put_found(Vec::new()));
        return;
    }
    let mut spent = std::time::Duration::ZERO;
    timed(&mut spent, || {
        let mut ordered: Vec<_> = tissues.iter_mut().collect();
        ordered.sort_unstable_by_key(|(_, tissue, ..)| tissue.ordinal);
        for (entity, mut tissue, settings, mut collider) in ordered {
            let collides = settings.collision && tools.iter().any(ToolMotion::pushes_anything);
            let passes = if collides { collider.passes(&tools) } else { 1 };
            let watched = settings.watch_error_every > 0 && steps.is_multiple_of(settings.watch_error_every);
            if watched {
                if let Some(aim_mm) = settings.error_aim_mm {
                    // An aim that is none is left out: the solver keeps the one it has.
                    tissue.solver.set_error_aim_mm(aim_mm).ok();
                }
                tissue.solver.begin_watch();
            }
            let mut found = collider.take_found();
            let mut touches = Touches::default();
            touches.extend(found.iter());
            // What was found before the cut serves the step, too, if it is all and nothing was cut since.
            let serves = collider.found_all && collider.is_current(&Skin::of(&tissue));
            if !serves {
                found.clear();
            }
            for pass in Pass::all(passes) {
                contacts.clear();
                if collides {
                    if !serves {
                        collider.update(&Skin::of(&tissue));
                        found.retain(|found| found.passes.contains(&pass.number));
                        let wanted = |tool: &ToolMotion, kind| tool.pushes(kind);
                        find_contacts(
                            &collider,
                            &mut tissue,
                            &tools,
                            (pass, time.delta_secs()),
                            wanted,
                            &mut found,
                        );
                        // Later contacts win: whether found now or before, they keep the order of the parts.
                        if !found.is_sorted_by_key(|found| (found.tool, found.part)) {
                            found.sort_by_key(|found| (found.tool, found.part));
                        }
                    }
                    collider.steady.hold_still(pass.number, &mut found, &tissue.solver);
                    contacts.extend(found.iter().filter_map(|found| found.contact_in(pass.number)));
                    if !collider.found_all {
                        touches.extend(found.iter().filter(|found| found.passes.start == pass.number));
                    }
                }
                let pass_s = time.delta_secs_f64() / f64::from(passes);
                match tissue.solver.advance(pass_s, &contacts) {
                    Ok(report) => {
                        for put_aside in &report.put_aside {
                            reports.put_aside(entity, PutAsideSubject::Node(put_aside.node), PutAsideReason::Motion);
                        }
                        if report.contacts_refused > 0 {
                            let refused = PutAsideReason::Contacts(report.contacts_refused);
                            reports.put_aside(entity, PutAsideSubject::Step, refused);
                        }
                        diagnostics.substeps += report.substeps + report.substeps_repeated;
                    }
                    Err(error) => reports.put_aside(entity, PutAsideSubject::Step, PutAsideReason::Step(error)),
                }
                diagnostics.contacts += contacts.len();
            }
            // They have served: a step without tools finds none.
            found.clear();
            collider.put_found(found);
            touches.tell(entity, &tools, &mut messages);
            if watched {
                let error = match settings.error_aim_mm {
                    Some(_) => tissue.solver.end_watch(),
                    None => tissue.solver.drop_watch(),
                };
                diagnostics.error_mm = error.map_or(diagnostics.error_mm, |error| error as f32);
            }
            diagnostics.passes = diagnostics.passes.max(passes);
            diagnostics.nodes += tissue.solver.living_nodes();
            diagnostics.springs += tissue.solver.living_springs();
            diagnostics.springs_softened += tissue.solver.softened_springs();
            diagnostics.pentahedra += tissue.solver.living_pentahedra();
        }
        *steps = steps.wrapping_add(1);
    });
    diagnostics.integrate += spent;
}

/// What touched a tissue in a step, with the pentahedron that was touched.
#[derive(Default)]
struct Touches(Vec<Touched>);

/// Where a part touched a pentahedron.
struct Touched {
    /// Indices of tool and part, and the pentahedron.
    of: (u32, u32, u32),
    kind: ToolPartKind,
    surface: NodeKind,
    point: Vec3,
    normal: Vec3,
    depth: f32,
}

impl Touches {
    fn extend<'a>(&mut self, found: impl Iterator<Item = &'a Found>) {
        let touches = found.filter_map(|found| {
            Some(Touched {
                of: (found.tool, found.part, found.touched()?),
                kind: found.kind,
                surface: found.surface,
                point: found.point,
                normal: found.normal,
                depth: found.depth,
            })
        });
        self.0.extend(touches);
    }

    /// Tells of each part and pentahedron where it was deepest.
    fn tell(mut self, tissue: Entity, tools: &[ToolMotion], messages: &mut MessageWriter<TissueContact>) {
        self.0.sort_by(|a, b| a.of.cmp(&b.of).then(b.depth.total_cmp(&a.depth)));
        self.0.dedup_by_key(|touch| touch.of);
        for touch in self.0 {
            let (tool, _, pentahedron) = touch.of;
            let tool = &tools[tool as usize];
            messages.write(TissueContact {
                tissue,
                tool: tool.entity,
                part: touch.kind,
                pentahedron,
                point: touch.point,
                normal: touch.normal,
                depth_mm: touch.depth.max(0.0),
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

/// Appends the contacts of those parts of all tools that are wanted and whose way from a pass on is to be looked at, in a step of so
/// many seconds.
fn find_contacts(
    collider: &Collider,
    tissue: &mut Tissue,
    tools: &[ToolMotion],
    (pass, step_s): (Pass, f32),
    wanted: impl Fn(&ToolMotion, ToolPartKind) -> bool,
    found: &mut Vec<Found>,
) {
    let mut nearby = Nearby::default();
    for (tool_index, tool) in (0..).zip(tools) {
        let parts = tool.parts_from(pass);
        let parts = parts.filter(|(.., part)| wanted(tool, part.kind) && collider.may_touch(part));
        let parts: Vec<(u32, Range<u32>, PartSweep)> = parts.collect();
        // The wires of a loop lie together: what is near any of them is found at once.
        let is_wire = |(.., part): &(u32, Range<u32>, PartSweep)| part.kind == ToolPartKind::Loop;
        for together in parts.chunk_by(|one, next| is_wire(one) && is_wire(next)) {
            let axes = together.iter().map(|(.., part)| (part.to, part.range()));
            let runs = collider.runs_near(axes);
            let Tissue { solver, fine, .. } = &mut *tissue;
            if let Some(fine) = fine {
                fine.bring(solver, collider.chunks_of(&runs));
            }
            for (part_index, passes, part) in together {
                let search = Search {
                    collider,
                    skin: &Skin::of(tissue),
                    part,
                    runs: &runs,
                    number: (tool_index, *part_index),
                    pushes: tool.pushes(part.kind),
                    passes: passes.clone(),
                    pass_s: step_s * passes.len() as f32 / pass.of as f32,
                };
                search.find(&mut nearby, found);
            }
        }
    }
}

impl Collider {
    /// Into how many passes the step of these tools is divided.
    fn passes(&self, tools: &[ToolMotion]) -> u32 {
        tools
            .iter()
            .map(|tool| tool.passes(|part| self.may_touch(part)))
            .max()
            .unwrap_or(1)
    }

    /// Whether the way of a part may come near the surface.
    fn may_touch(&self, part: &PartSweep) -> bool {
        let Some((mins, maxs)) = self.bounds() else {
            return false;
        };
        let ends = [part.from.a, part.from.b, part.to.a, part.to.b];
        let reach = Vec3::splat(part.radius + contacts::MARGIN_MM);
        let low = ends.into_iter().fold(Vec3::INFINITY, Vec3::min) - reach;
        let high = ends.into_iter().fold(Vec3::NEG_INFINITY, Vec3::max) + reach;
        low.cmple(maxs).all() && high.cmpge(mins).all()
    }
}
