//! Before the step: parts get their entities, and what systems did to components reaches the solver.
//!
//! Only what changed since the last gathering is read. Ticks are compared over whole tables
//! (`contiguous_iter`), which costs a few bytes a component; the plugin's own writing bypasses change detection, so that
//! it is never taken for an edit.

use bevy::{
    ecs::{change_detection::Tick, entity::EntityHashMap},
    prelude::*,
};
use resecta_solver::EditError;

use crate::{
    components::{PartEntities, Pentahedron, Spring, Tissue, TissueNode},
    cut::{Cut, Reports},
    diagnostics::{TissueDiagnostics, timed},
    messages::{PutAsideReason, PutAsideSubject},
    settings::TissueSettings,
};

/// Parts whose component or entity was removed since the last step: tissue, index, entity.
#[derive(Resource, Default)]
pub(crate) struct RemovedParts {
    pub nodes: Vec<(Entity, u32, Entity)>,
    pub springs: Vec<(Entity, u32, Entity)>,
    pub pentahedra: Vec<(Entity, u32, Entity)>,
}

/// How many tissues the app has had: the next one's ordinal.
#[derive(Resource, Default)]
pub(crate) struct TissueCount(u64);

/// Lets the entities of the parts of new tissues be spawned. By a command: an exclusive system would be ambiguous with
/// whatever else runs in the schedule.
pub(crate) fn spawn_parts(tissues: Query<(Entity, &Tissue)>, mut commands: Commands) {
    for (entity, tissue) in &tissues {
        if tissue.parts.is_none() {
            commands.queue(move |world: &mut World| spawn_parts_of(world, entity));
        }
    }
}

/// Spawns the entities of a tissue's parts, in batches, in the order of their indices.
fn spawn_parts_of(world: &mut World, entity: Entity) {
    let Some(tissue) = world.get::<Tissue>(entity) else {
        return;
    };
    let solver = &tissue.solver;
    let nodes: Vec<u32> = (0..solver.node_count() as u32).collect();
    let springs: Vec<u32> = (0..solver.spring_count() as u32).collect();
    let pentahedra: Vec<u32> = (0..solver.pentahedron_count() as u32).collect();
    // Dead parts of a tissue that was cut before get no entity.
    let nodes: Vec<Option<TissueNode>> = nodes
        .into_iter()
        .map(|n| solver.is_node_alive(n).then(|| node(entity, solver, n)))
        .collect();
    let springs: Vec<Option<Spring>> = springs
        .into_iter()
        .map(|s| solver.is_spring_alive(s).then(|| spring(entity, solver, s)))
        .collect();
    let pentahedra: Vec<Option<Pentahedron>> = pentahedra
        .into_iter()
        .map(|p| solver.is_pentahedron_alive(p).then(|| pentahedron(entity, solver, p)))
        .collect();
    let parts = PartEntities {
        nodes: spawn(world, nodes),
        springs: spawn(world, springs),
        pentahedra: spawn(world, pentahedra),
    };
    let mut count = world.resource_mut::<TissueCount>();
    let ordinal = count.0;
    count.0 += 1;
    if let Some(mut tissue) = world.get_mut::<Tissue>(entity) {
        tissue.parts = Some(parts);
        tissue.ordinal = ordinal;
    }
}

/// An entity for each part there is; a placeholder for each that there is not.
fn spawn<C: Component>(world: &mut World, parts: Vec<Option<C>>) -> Vec<Entity> {
    let there: Vec<bool> = parts.iter().map(Option::is_some).collect();
    let living: Vec<C> = parts.into_iter().flatten().collect();
    let mut spawned = world.spawn_batch(living).collect::<Vec<Entity>>().into_iter();
    let entity = |there: bool| if there { spawned.next() } else { None };
    there
        .into_iter()
        .map(entity)
        .map(|entity| entity.unwrap_or(Entity::PLACEHOLDER))
        .collect()
}

fn node(tissue: Entity, solver: &resecta_solver::Tissue, index: u32) -> TissueNode {
    TissueNode {
        tissue,
        index,
        position: solver.position(index),
        velocity: solver.velocity(index),
        load: solver.load(index),
        mass_g: solver.mass_g(index),
        damping_g_per_s: solver.damping_g_per_s(index),
    }
}

fn spring(tissue: Entity, solver: &resecta_solver::Tissue, index: u32) -> Spring {
    let state = solver.spring(index);
    Spring {
        tissue,
        index,
        nodes: state.nodes,
        stiffness_mn_per_m: state.stiffness,
        rest_length_mm: state.rest_length,
    }
}

fn pentahedron(tissue: Entity, solver: &resecta_solver::Tissue, index: u32) -> Pentahedron {
    Pentahedron {
        tissue,
        index,
        nodes: solver.pentahedron_nodes(index),
        zone: solver.pentahedron_zone(index),
    }
}

/// Takes over edits of components, then removals of parts.
pub(crate) fn gather(
    mut tissues: Query<(Entity, &mut Tissue, &TissueSettings)>,
    mut nodes: ParamSet<(Query<(Entity, Ref<TissueNode>)>, Query<&mut TissueNode>)>,
    mut springs: ParamSet<(Query<(Entity, Ref<Spring>)>, Query<&mut Spring>)>,
    pentahedra: Query<(Entity, Ref<Pentahedron>)>,
    mut removed: ResMut<RemovedParts>,
    mut commands: Commands,
    mut reports: Reports,
    mut diagnostics: ResMut<TissueDiagnostics>,
) {
    let mut time = std::time::Duration::ZERO;
    timed(&mut time, || {
        let node_edits = changed(nodes.p0());
        let spring_edits = changed(springs.p0());
        let pentahedron_edits = changed(pentahedra);
        let removed = std::mem::take(&mut *removed);
        diagnostics.edits += node_edits.len() + spring_edits.len() + pentahedron_edits.len();

        let known: EntityHashMap<()> = tissues.iter().map(|(entity, ..)| (entity, ())).collect();
        for (tissue, subject) in strays(&known, &node_edits, &spring_edits, &pentahedron_edits) {
            reports.put_aside(tissue, subject, PutAsideReason::Identity);
        }
        let mut ordered: Vec<_> = tissues.iter_mut().collect();
        ordered.sort_unstable_by_key(|(_, tissue, _)| tissue.ordinal);
        for (entity, mut tissue, settings) in ordered {
            let tissue = &mut *tissue;
            let Some(parts) = &tissue.parts else { continue };
            for (part, edit) in of_tissue(&node_edits, entity) {
                let subject = PutAsideSubject::Node(edit.index);
                if parts.nodes.get(edit.index as usize) != Some(&part) {
                    reports.put_aside(entity, subject, PutAsideReason::Identity);
                    continue;
                }
                for error in take_node(&mut tissue.solver, edit) {
                    reports.put_aside(entity, subject, PutAsideReason::Edit(error));
                    if let Ok(mut shown) = nodes.p1().get_mut(part) {
                        *shown.bypass_change_detection() = node(entity, &tissue.solver, edit.index);
                    }
                }
            }
            for (part, edit) in of_tissue(&spring_edits, entity) {
                let subject = PutAsideSubject::Spring(edit.index);
                if parts.springs.get(edit.index as usize) != Some(&part) {
                    reports.put_aside(entity, subject, PutAsideReason::Identity);
                    continue;
                }
                for error in take_spring(&mut tissue.solver, edit) {
                    reports.put_aside(entity, subject, PutAsideReason::Edit(error));
                    if let Ok(mut shown) = springs.p1().get_mut(part) {
                        *shown.bypass_change_detection() = spring(entity, &tissue.solver, edit.index);
                    }
                }
            }
            for (part, edit) in of_tissue(&pentahedron_edits, entity) {
                if parts.pentahedra.get(edit.index as usize) != Some(&part) {
                    reports.put_aside(
                        entity,
                        PutAsideSubject::Pentahedron(edit.index),
                        PutAsideReason::Identity,
                    );
                }
            }

            for index in gone(&removed.springs, entity, &parts.springs) {
                // A spring that is already removed has nothing left to sever.
                tissue.solver.set_spring_stiffness(index, 0.0).ok();
            }
            let mut doomed = gone(&removed.pentahedra, entity, &parts.pentahedra);
            for index in gone(&removed.nodes, entity, &parts.nodes) {
                doomed.extend(tissue.solver.pentahedra_around(index));
            }
            if let Some(fine) = &mut tissue.fine {
                fine.begin_step();
            }
            let mut cut = Cut {
                entity,
                tissue,
                settings,
                by: None,
            };
            let resection = cut.of_elements(doomed);
            cut.tell(resection, &mut commands, &mut reports, &mut diagnostics);
        }
    });
    diagnostics.prepare += time;
}

/// Parts whose ticks are compared at once.
const TICKS: usize = 64;

/// The parts whose component changed since this system last ran.
fn changed<C: Part>(parts: Query<(Entity, Ref<C>)>) -> Vec<(Entity, C)> {
    let mut found = Vec::new();
    // Parts live in tables, which are always dense.
    for (entities, components) in parts.contiguous_iter().into_iter().flatten() {
        let (last, now): (Tick, Tick) = (components.last_run_tick(), components.this_run_tick());
        let ticks = components.changed_ticks_slice();
        for (from, ticks) in (0..).step_by(TICKS).zip(ticks.chunks(TICKS)) {
            // Parts are spawned together and changed by few: most have the tick of the first, which is found out without a branch.
            let first = ticks[0];
            let others = ticks.iter().fold(0, |others, tick| others | (tick.get() ^ first.get()));
            if others == 0 && !first.is_newer_than(last, now) {
                continue;
            }
            for (i, tick) in (from..).zip(ticks) {
                if tick.is_newer_than(last, now) {
                    found.push((entities[i], components[i].clone()));
                }
            }
        }
    }
    found
}

/// The edits of one tissue by ascending index.
fn of_tissue<C: Part>(edits: &[(Entity, C)], tissue: Entity) -> Vec<(Entity, &C)> {
    let mut found: Vec<(Entity, &C)> = edits
        .iter()
        .filter(|(_, part)| part.tissue() == tissue)
        .map(|(entity, part)| (*entity, part))
        .collect();
    found.sort_by_key(|(_, part)| part.index());
    found
}

/// Edits of parts that name a tissue which does not exist.
fn strays(
    known: &EntityHashMap<()>,
    nodes: &[(Entity, TissueNode)],
    springs: &[(Entity, Spring)],
    pentahedra: &[(Entity, Pentahedron)],
) -> Vec<(Entity, PutAsideSubject)> {
    fn of<C: Part>(known: &EntityHashMap<()>, edits: &[(Entity, C)]) -> Vec<(Entity, PutAsideSubject)> {
        let stray = edits.iter().filter(|(_, part)| !known.contains_key(&part.tissue()));
        stray.map(|(_, part)| (part.tissue(), part.subject())).collect()
    }
    [of(known, nodes), of(known, springs), of(known, pentahedra)].concat()
}

/// Indices of the removed parts that really were parts of the tissue, ascending.
fn gone(removed: &[(Entity, u32, Entity)], tissue: Entity, parts: &[Entity]) -> Vec<u32> {
    let ours = removed
        .iter()
        .filter(|(owner, index, part)| *owner == tissue && parts.get(*index as usize) == Some(part));
    let mut indices: Vec<u32> = ours.map(|(_, index, _)| *index).collect();
    indices.sort_unstable();
    indices
}

fn take_node(solver: &mut resecta_solver::Tissue, edit: &TissueNode) -> Vec<EditError> {
    let index = edit.index;
    let mut refused = Vec::new();
    if edit.position != solver.position(index) {
        refused.extend(solver.set_position(index, edit.position).err());
    }
    if edit.velocity != solver.velocity(index) {
        refused.extend(solver.set_velocity(index, edit.velocity).err());
    }
    if edit.load != solver.load(index) {
        refused.extend(solver.set_load(index, edit.load).err());
    }
    // Damping last: a change of mass keeps it.
    let damping = edit.damping_g_per_s != solver.damping_g_per_s(index);
    if edit.mass_g != solver.mass_g(index) {
        refused.extend(solver.set_mass(index, edit.mass_g).err());
    }
    if damping {
        refused.extend(solver.set_damping(index, edit.damping_g_per_s).err());
    }
    refused
}

fn take_spring(solver: &mut resecta_solver::Tissue, edit: &Spring) -> Vec<EditError> {
    let (index, now) = (edit.index, solver.spring(edit.index));
    let mut refused = Vec::new();
    if edit.stiffness_mn_per_m != now.stiffness {
        refused.extend(solver.set_spring_stiffness(index, edit.stiffness_mn_per_m).err());
    }
    if edit.rest_length_mm != now.rest_length {
        refused.extend(solver.set_spring_rest_length(index, edit.rest_length_mm).err());
    }
    refused
}

/// What the three kinds of parts have in common.
trait Part: Component + Clone {
    fn tissue(&self) -> Entity;
    fn index(&self) -> u32;
    fn subject(&self) -> PutAsideSubject;
}

impl Part for TissueNode {
    fn tissue(&self) -> Entity {
        self.tissue
    }
    fn index(&self) -> u32 {
        self.index
    }
    fn subject(&self) -> PutAsideSubject {
        PutAsideSubject::Node(self.index)
    }
}

impl Part for Spring {
    fn tissue(&self) -> Entity {
        self.tissue
    }
    fn index(&self) -> u32 {
        self.index
    }
    fn subject(&self) -> PutAsideSubject {
        PutAsideSubject::Spring(self.index)
    }
}

impl Part for Pentahedron {
    fn tissue(&self) -> Entity {
        self.tissue
    }
    fn index(&self) -> u32 {
        self.index
    }
    fn subject(&self) -> PutAsideSubject {
        PutAsideSubject::Pentahedron(self.index)
    }
}
