//! The tissue and its parts as components: the face that other systems read and edit.
//!
//! The solver works on dense arrays of its own. Components are gathered from before a step and written back to after
//! it, so that no loop of the solver looks up an entity. A part names its tissue and its index in plain fields: with
//! 60,000 parts, relationships and children would make each removal cost a search, and flags as components would move
//! entities between archetypes.

use bevy::{
    ecs::{lifecycle::HookContext, world::DeferredWorld},
    prelude::*,
};
use resecta_anatomy::Zone;
use resecta_solver::TissuePoint;

use crate::{
    collide::{Collider, ToolContacts},
    fine::Fine,
    gather::RemovedParts,
    settings::TissueSettings,
    skin::Skin,
};

/// A tissue: the entity that owns the solver's state. Spawn it and its parts follow in the next step; remove or replace
/// it and its parts are despawned.
///
/// Positions are world coordinates in mm: leave the entity's `Transform` at identity.
#[derive(Component, Reflect)]
#[reflect(Component, from_reflect = false)]
#[component(on_discard = despawn_parts)]
#[require(TissueSettings, Collider, ToolContacts)]
pub struct Tissue {
    #[reflect(ignore)]
    pub(crate) solver: resecta_solver::Tissue,
    /// The boundary of cuts finer than the elements, where a scene cuts so.
    #[reflect(ignore)]
    pub(crate) fine: Option<Fine>,
    /// Whether it was found that the tissue can have none as fine as its settings say.
    #[reflect(ignore)]
    pub(crate) coarse_for_good: bool,
    /// The version of the motion in which it was last looked for what has torn off.
    #[reflect(ignore)]
    pub(crate) looked_for_tears: u64,
    #[reflect(ignore)]
    pub(crate) parts: Option<PartEntities>,
    /// Ordinal of the tissue in its app: decides the order of what is done and told, since entity ids may not.
    #[reflect(ignore)]
    pub(crate) ordinal: u64,
    /// The version of the motion that the components show.
    #[reflect(ignore)]
    pub(crate) written: Option<u64>,
    /// Nodes that lost mass since the components were written last.
    #[reflect(ignore)]
    pub(crate) lightened: Vec<u32>,
    /// Springs that lost stiffness since then.
    #[reflect(ignore)]
    pub(crate) weakened: Vec<u32>,
}

/// The entities of a tissue's parts by index. Entities of removed parts stay listed and are dead.
pub(crate) struct PartEntities {
    pub nodes: Vec<Entity>,
    pub springs: Vec<Entity>,
    pub pentahedra: Vec<Entity>,
}

/// Pressure of the water that a tissue's surface is in, Pa above what surrounds the organ; -1e6 to 1e6. It presses on all of the surface
/// but what is held from outside, and reaches what a cut opens. Of what is beyond some 0.4 times the tissue's modulus so much acts, lest the tissue burst
/// ([`set_water_pressure_pa`](resecta_solver::Tissue::set_water_pressure_pa)). A tissue without it is in no water, which costs nothing.
#[derive(Component, Reflect, Debug, Clone, Copy, Default, PartialEq)]
#[reflect(Component, Default)]
pub struct WaterPressure(pub f32);

impl Tissue {
    /// A tissue from the solver's state.
    pub fn new(solver: resecta_solver::Tissue) -> Self {
        Self {
            solver,
            fine: None,
            coarse_for_good: false,
            looked_for_tears: 0,
            parts: None,
            ordinal: u64::MAX,
            written: None,
            lightened: Vec::new(),
            weakened: Vec::new(),
        }
    }

    /// The solver's state.
    pub fn solver(&self) -> &resecta_solver::Tissue {
        &self.solver
    }

    /// The solver's state, to change it past the components, which show the change after the next step. Of a node that
    /// is edited both ways before a step, the component wins. Do not resect here: despawn entities, so that they go.
    pub fn solver_mut(&mut self) -> &mut resecta_solver::Tissue {
        &mut self.solver
    }

    /// The surface where it lies now: places of vertices, mm, and triangles, outward by the right-hand rule. Vertices of the elements' surface
    /// are nodes; of a finer one, also points that a cut laid bare.
    pub fn surface(&self) -> (Vec<Vec3>, Vec<[u32; 3]>) {
        let nodes: Vec<Vec3> = (0..self.solver.node_count() as u32)
            .map(|node| self.solver.position(node))
            .collect();
        let Some(fine) = &self.fine else {
            let triangles = self.solver.surface().triangles();
            return (nodes, triangles.map(|(_, triangle)| triangle).collect());
        };
        let mut places = Vec::new();
        // One place a node: nothing else is refused.
        fine.field().move_vertices(&nodes, &mut places).ok();
        (places, fine.surface().triangles().collect())
    }

    /// The surface vertex whose place at rest, mm, gives the least `measure`, and the pentahedron that carries it. With `only_bare` it is one that
    /// a cut laid bare. `None` if there is no such vertex. Looks at every vertex of the surface.
    pub fn nearest_vertex(&self, only_bare: bool, measure: impl Fn(Vec3) -> f32) -> Option<(TissuePoint, u32)> {
        let skin = Skin::of(self);
        let (vertex, pentahedron) = skin.nearest_at_rest(only_bare, measure)?;
        Some((skin.carriers(vertex), pentahedron))
    }

    /// Brings a surface finer than the elements to where the tissue is.
    pub(crate) fn follow(&mut self) {
        if let Some(fine) = &mut self.fine {
            fine.follow(&self.solver);
        }
    }

    /// Chips that were cut out and are not told yet ([`TissueChip`](crate::TissueChip)): a stroke goes on, or a chip's surface
    /// is being made.
    pub fn chips_to_come(&self) -> usize {
        self.fine.as_ref().map_or(0, Fine::chips_to_come)
    }

    /// The finer boundary of the tissue, where it is cut finer than its elements ([`CutDetail`](crate::CutDetail)); none before
    /// the app has a tool with a loop.
    pub fn field(&self) -> Option<&resecta_field::Field> {
        self.fine.as_ref().map(Fine::field)
    }

    /// The entity of node `index`; none before the first step and past the end. Dead once the node is removed.
    pub fn node_entity(&self, index: u32) -> Option<Entity> {
        self.parts.as_ref()?.nodes.get(index as usize).copied()
    }

    /// The entity of spring `index`; none before the first step and past the end. Dead once the spring is removed.
    pub fn spring_entity(&self, index: u32) -> Option<Entity> {
        self.parts.as_ref()?.springs.get(index as usize).copied()
    }

    /// The entity of pentahedron `index`; none before the first step and past the end. Dead once it is resected.
    pub fn pentahedron_entity(&self, index: u32) -> Option<Entity> {
        self.parts.as_ref()?.pentahedra.get(index as usize).copied()
    }
}

/// A node: a point mass of a tissue. Edits are taken over at the next step; what is not finite is refused and reported.
/// Despawning the entity resects every pentahedron of the node.
#[derive(Component, Reflect, Debug, Clone, PartialEq)]
#[reflect(Component)]
#[component(on_remove = note_removed_node)]
pub struct TissueNode {
    /// The entity with the [`Tissue`]. Not to be changed.
    pub tissue: Entity,
    /// Index in the tissue. Not to be changed.
    pub index: u32,
    /// Position, mm. Written after each step.
    pub position: Vec3,
    /// Velocity, mm/s. Written after each step.
    pub velocity: Vec3,
    /// External force, µN (g·mm/s²): acts until it is changed. Only ever read by the plugin.
    pub load: Vec3,
    /// Mass, g, > 0.
    pub mass_g: f32,
    /// Viscous damping by the medium, g/s, >= 0.
    pub damping_g_per_s: f32,
}

/// A spring between two nodes. Edits are taken over at the next step; what is not finite is refused and reported.
/// Despawning the entity severs the spring: it exerts no force any more.
#[derive(Component, Reflect, Debug, Clone, PartialEq)]
#[reflect(Component)]
#[component(on_remove = note_removed_spring)]
pub struct Spring {
    /// The entity with the [`Tissue`]. Not to be changed.
    pub tissue: Entity,
    /// Index in the tissue. Not to be changed.
    pub index: u32,
    /// The indices of its two nodes. Not to be changed.
    pub nodes: [u32; 2],
    /// Stiffness, mN/m (µN/mm), >= 0.
    pub stiffness_mn_per_m: f32,
    /// Rest length, mm, > 0.
    pub rest_length_mm: f32,
}

/// A pentahedron (triangular prism): the volume element that is resected. Despawning the entity is a resection.
#[derive(Component, Reflect, Debug, Clone, PartialEq)]
#[reflect(Component, from_reflect = false)]
#[component(on_remove = note_removed_pentahedron)]
pub struct Pentahedron {
    /// The entity with the [`Tissue`]. Not to be changed.
    pub tissue: Entity,
    /// Index in the tissue. Not to be changed.
    pub index: u32,
    /// The indices of its nodes, in the order of VTK's wedge. Not to be changed.
    pub nodes: [u32; 6],
    /// The zone it belongs to. Not to be changed.
    #[reflect(ignore)]
    pub zone: Zone,
}

fn note_removed_node(mut world: DeferredWorld, context: HookContext) {
    let Some(&TissueNode { tissue, index, .. }) = world.get(context.entity) else {
        return;
    };
    if let Some(mut removed) = world.get_resource_mut::<RemovedParts>() {
        removed.nodes.push((tissue, index, context.entity));
    }
}

fn note_removed_spring(mut world: DeferredWorld, context: HookContext) {
    let Some(&Spring { tissue, index, .. }) = world.get(context.entity) else {
        return;
    };
    if let Some(mut removed) = world.get_resource_mut::<RemovedParts>() {
        removed.springs.push((tissue, index, context.entity));
    }
}

fn note_removed_pentahedron(mut world: DeferredWorld, context: HookContext) {
    let Some(&Pentahedron { tissue, index, .. }) = world.get(context.entity) else {
        return;
    };
    if let Some(mut removed) = world.get_resource_mut::<RemovedParts>() {
        removed.pentahedra.push((tissue, index, context.entity));
    }
}

fn despawn_parts(mut world: DeferredWorld, context: HookContext) {
    let Some(mut tissue) = world.get_mut::<Tissue>(context.entity) else {
        return;
    };
    let Some(parts) = tissue.bypass_change_detection().parts.take() else {
        return;
    };
    world.commands().queue(move |world: &mut World| {
        for entity in parts.nodes.into_iter().chain(parts.springs).chain(parts.pentahedra) {
            world.try_despawn(entity).ok();
        }
    });
}
