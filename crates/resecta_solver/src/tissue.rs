//! The tissue: every array of its state, and how it is read and edited.
//!
//! # Layout
//!
//! Everything is an array over nodes, springs or pentahedra, one array a quantity. The hot loop (forces, then motion)
//! reads positions, stiffness and rest length and writes forces and velocities; in arrays of their own these are
//! contiguous, 4 bytes a component, and nothing that the loop does not read takes room in its caches. An array of node
//! structures would carry masses, loads and flags (80 bytes a node) through the cache to use 24. Within an array nodes lie
//! by sites of eight (`sites.rs`).
//!
//! Indices are `u32`, given once and never reused: a removed node, spring or pentahedron keeps its index and is marked.
//! What removal leaves in the hot arrays (stiffness 0, inverse mass 0) computes to nothing, so a removal touches only what
//! it removes and its neighbours.
//!
//! Positions are `f32` with a second array of what their rounding lost (compensated summation): plain `f32` positions
//! stop creeping once a step's displacement falls below half a unit in the last place.

use std::ops::{Range, RangeInclusive};

use glam::{DVec3, Vec3};
use resecta_anatomy::{Zone, wedge};

use crate::bound::{Usual, Weighing};
use crate::collapse::Collapse;
use crate::mobility::Frame;
use crate::motion::Scratch;
use crate::pressed::Water;
use crate::ranges::{FURTHEST_MM, HEAVIEST_G, MOST_DAMPED, STIFFEST};
use crate::sleep::Sleep;
use crate::springs::Springs;
use crate::surface::Surface;
use crate::team::Team;
use crate::vectors::{Scalars, Segment, Vectors};
use crate::volumes::Volumes;
use crate::watch::{Accuracy, Watch};

/// What moves: the state that one step turns into the next.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Motion {
    /// mm.
    pub positions: Vectors,
    /// What rounding took from the positions, mm.
    pub lost: Vectors,
    /// mm/s.
    pub velocities: Vectors,
}

/// The nodes of a tissue: what does not move.
#[derive(Debug, Clone)]
pub(crate) struct Nodes {
    pub rest: Vectors,
    pub kind: Vec<NodeKind>,
    /// g; what the living pentahedra around the node lend it.
    pub mass: Scalars,
    /// Damping over mass, 1/s.
    pub damping_rate: Scalars,
    /// 1/g, see [`Tissue::inertia_g`]; 0 for nodes that do not move: removed ones, fixed ones
    /// and those put aside.
    pub inverse_inertia: Scalars,
    /// Stiffness of the bed that holds a capsule node at its rest position, µN/mm.
    pub support: Scalars,
    /// Ranges of sites with a node that is held by the bed.
    pub supported: Vec<Range<usize>>,
    /// The user's load, µN.
    pub load: Vectors,
    /// Load that balances the pre-tension of the living springs in the rest shape, µN.
    pub balance: Vectors,
    pub alive: Vec<bool>,
    /// Whether the node is held where it is.
    pub fixed: Vec<bool>,
    /// Living pentahedra around the node.
    pub pentahedra_left: Vec<u16>,
    /// Pentahedra around each node, living or not: `around[start[n]..start[n + 1]]`.
    pub around_start: Vec<u32>,
    pub around: Vec<u32>,
    pub put_aside: Vec<bool>,
}

/// The pentahedra of a tissue.
#[derive(Debug, Clone)]
pub(crate) struct Pentahedra {
    pub nodes: Vec<[u32; 6]>,
    pub zone: Vec<Zone>,
    /// mm³.
    pub rest_volume: Vec<f64>,
    /// Square of the length of the longest edge at rest, mm².
    pub longest_edge_squared: Vec<f32>,
    /// Share of the rest volume that each holds: less than 1 where a cut finer than they are went.
    pub fill: Vec<f64>,
    /// Area of the faces that lie on the capsule, mm².
    pub capsule_area: Vec<f32>,
    /// Whether what surrounds the organ holds any of its faces.
    pub held: Vec<bool>,
    pub alive: Vec<bool>,
    /// The springs each stands behind, with the volume (mm³) it lends: `shares[start[p]..start[p + 1]]`.
    pub share_start: Vec<u32>,
    pub shares: Vec<(u32, f32)>,
}

/// What a node is part of.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum NodeKind {
    /// The wall of the lumen.
    Mucosa,
    /// Inside the tissue.
    Inner,
    /// The capsule.
    Capsule,
}

/// A spring as it stands.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SpringState {
    /// The nodes it joins.
    pub nodes: [u32; 2],
    /// Stiffness, µN/mm = mN/m.
    pub stiffness: f32,
    /// Rest length, mm.
    pub rest_length: f32,
}

/// An edit that was refused; the tissue is as before.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum EditError {
    /// No element has this index, or it has been removed.
    #[error("there is no living {what} {index}")]
    NoSuch {
        /// `node`, `spring` or `pentahedron`.
        what: &'static str,
        /// The index given.
        index: u32,
    },
    /// The value is NaN, infinite or out of range.
    #[error("{field} of {what} {index} cannot be {value}, expected {expected}")]
    Value {
        /// `node`, `spring` or `tissue`.
        what: &'static str,
        /// Index of the element; 0 for a tissue.
        index: u32,
        /// Name of the field.
        field: &'static str,
        /// The value given; of a vector its first offending component.
        value: f32,
        /// What was expected.
        expected: &'static str,
    },
}

/// A tissue: nodes joined by springs, filled with pentahedra, that moves and is cut.
#[derive(Debug, Clone)]
pub struct Tissue {
    pub(crate) motion: Motion,
    pub(crate) nodes: Nodes,
    pub(crate) springs: Springs,
    pub(crate) pentahedra: Pentahedra,
    /// Where the material has a Poisson's ratio of its own.
    pub(crate) volumes: Option<Volumes>,
    pub(crate) surface: Surface,
    pub(crate) collapse: Collapse,
    pub(crate) water: Option<Water>,
    /// What its bed rests on, where that gives way.
    pub(crate) frame: Option<Frame>,
    /// Pa; what shares of volume are multiplied by to give stiffness: the modulus of the springs alone.
    pub(crate) modulus_pa: f64,
    /// Strain of the springs in the rest shape.
    pub(crate) pre_tension: f32,
    /// Mean edge length of the springs at rest, mm.
    pub(crate) mean_length: f32,
    /// Largest distance from a pentahedron's first node to its centroid at rest, mm.
    pub(crate) reach: f32,
    pub(crate) rest_volume_mm3: f64,
    pub(crate) removed_volume_mm3: f64,
    pub(crate) living: Living,
    /// The longest stable step of the tissue as it lies, s, if it has been measured.
    pub(crate) bound: Option<f64>,
    pub(crate) weighing: Weighing,
    /// None without nodes.
    pub(crate) usual: Option<Usual>,
    pub(crate) sleep: Sleep,
    pub(crate) motion_version: u64,
    pub(crate) accuracy: Accuracy,
    pub(crate) watch: Option<Watch>,
    /// None where one thread steps it.
    pub(crate) team: Option<Team>,
    pub(crate) scratch: Scratch,
}

/// How many of each are left.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Living {
    pub nodes: usize,
    pub springs: usize,
    pub pentahedra: usize,
}

impl Tissue {
    /// Nodes the tissue was built with; their indices are below this for good.
    pub fn node_count(&self) -> usize {
        self.nodes.alive.len()
    }

    /// Springs the tissue was built with.
    pub fn spring_count(&self) -> usize {
        self.springs.nodes.len()
    }

    /// Pentahedra the tissue was built with.
    pub fn pentahedron_count(&self) -> usize {
        self.pentahedra.nodes.len()
    }

    /// Nodes not yet removed.
    pub fn living_nodes(&self) -> usize {
        self.living.nodes
    }

    /// Springs not yet removed.
    pub fn living_springs(&self) -> usize {
        self.living.springs
    }

    /// Pentahedra not yet removed.
    pub fn living_pentahedra(&self) -> usize {
        self.living.pentahedra
    }

    /// Whether the node exists and has not been removed.
    pub fn is_node_alive(&self, node: u32) -> bool {
        self.nodes.alive.get(node as usize) == Some(&true)
    }

    /// Whether the spring exists and has not been removed.
    pub fn is_spring_alive(&self, spring: u32) -> bool {
        self.springs.alive.get(spring as usize) == Some(&true)
    }

    /// Whether the pentahedron exists and has not been removed.
    pub fn is_pentahedron_alive(&self, pentahedron: u32) -> bool {
        self.pentahedra.alive.get(pentahedron as usize) == Some(&true)
    }

    /// Position of a node, mm.
    #[inline]
    pub fn position(&self, node: u32) -> Vec3 {
        self.motion.positions.at(node)
    }

    /// The living nodes within a distance of a point, mm, by rising index. Looks at all, some ten thousand in 3 µs.
    pub fn nodes_within(&self, centre: Vec3, radius_mm: f32) -> Vec<u32> {
        let mut near = self.motion.positions.within(centre, radius_mm);
        near.retain(|&node| self.is_node_alive(node));
        near.sort_unstable();
        near
    }

    /// The living nodes near any of some segments, ascending. Looks at all, some ten thousand in 3 µs a segment.
    pub fn nodes_near(&self, segments: &[Segment]) -> Vec<u32> {
        let mut near = self.motion.positions.near(segments);
        near.retain(|&node| self.is_node_alive(node));
        near.sort_unstable();
        near
    }

    /// The living node that is nearest to a point, of several the one of the lowest index; none where none is within a distance, mm.
    pub fn nearest_node(&self, point: Vec3, within_mm: f32) -> Option<u32> {
        let far = |node: &u32| self.position(*node).distance_squared(point);
        let near = self.nodes_within(point, within_mm).into_iter();
        near.min_by(|a, b| far(a).total_cmp(&far(b)))
    }

    /// Position of a node with what single precision cannot hold of it, mm.
    pub fn precise_position(&self, node: u32) -> DVec3 {
        self.position64(node) - self.motion.lost.at(node).as_dvec3()
    }

    /// Velocity of a node, mm/s.
    #[inline]
    pub fn velocity(&self, node: u32) -> Vec3 {
        self.motion.velocities.at(node)
    }

    /// Rest position of a node, mm.
    pub fn rest_position(&self, node: u32) -> Vec3 {
        self.nodes.rest.at(node)
    }

    /// What the node is part of.
    pub fn node_kind(&self, node: u32) -> NodeKind {
        self.nodes.kind[node as usize]
    }

    /// Mass of a node, g; falls as pentahedra around it are removed.
    #[inline]
    pub fn mass_g(&self, node: u32) -> f32 {
        self.nodes.mass.at(node)
    }

    /// Inertia of a node, g: its mass, or more where that would ask for a step much shorter than the rest of the tissue
    /// needs (see `bound.rs`). 0 for a node that does not move. As of the last advance.
    pub fn inertia_g(&self, node: u32) -> f32 {
        let inverse = self.nodes.inverse_inertia.at(node);
        if inverse > 0.0 { 1.0 / inverse } else { 0.0 }
    }

    /// Damping of a node, gamma of equation (1), g/s.
    #[inline]
    pub fn damping_g_per_s(&self, node: u32) -> f32 {
        self.nodes.damping_rate.at(node) * self.mass_g(node)
    }

    /// The user's load on a node, µN.
    #[inline]
    pub fn load(&self, node: u32) -> Vec3 {
        self.nodes.load.at(node)
    }

    /// Whether the node was put aside: it stays where it is, because a number of its motion was not finite.
    pub fn is_put_aside(&self, node: u32) -> bool {
        self.nodes.put_aside[node as usize]
    }

    /// A spring as it stands; a removed one has no stiffness.
    #[inline]
    pub fn spring(&self, spring: u32) -> SpringState {
        SpringState {
            nodes: self.springs.nodes[spring as usize],
            stiffness: self.springs.stiffness(spring),
            rest_length: self.springs.rest_length(spring),
        }
    }

    /// The six nodes of a pentahedron.
    #[inline]
    pub fn pentahedron_nodes(&self, pentahedron: u32) -> [u32; 6] {
        self.pentahedra.nodes[pentahedron as usize]
    }

    /// Zone of a pentahedron.
    pub fn pentahedron_zone(&self, pentahedron: u32) -> Zone {
        self.pentahedra.zone[pentahedron as usize]
    }

    /// Volume of a pentahedron at rest, all of it, mm³.
    pub fn rest_volume_mm3(&self, pentahedron: u32) -> f64 {
        self.pentahedra.rest_volume[pentahedron as usize]
    }

    /// Share of its rest volume that a pentahedron holds, 0 to 1; 0 for one that is removed or does not exist.
    pub fn fill(&self, pentahedron: u32) -> f64 {
        self.pentahedra.fill.get(pentahedron as usize).copied().unwrap_or(0.0)
    }

    /// Area of a pentahedron's faces that lie on the capsule at rest, mm².
    pub fn capsule_area_mm2(&self, pentahedron: u32) -> f32 {
        self.pentahedra.capsule_area[pentahedron as usize]
    }

    /// Whether what surrounds the organ holds a pentahedron by one of its faces: the capsule, or what covers the organ where it has
    /// none ([`TissueMesh::covered`](crate::TissueMesh::covered)).
    pub fn is_held(&self, pentahedron: u32) -> bool {
        self.pentahedra.held[pentahedron as usize]
    }

    /// Mean of a pentahedron's corners at rest, mm.
    pub fn rest_centroid(&self, pentahedron: u32) -> Vec3 {
        let nodes = self.pentahedron_nodes(pentahedron);
        nodes.iter().map(|&node| self.rest_position(node)).sum::<Vec3>() / 6.0
    }

    /// Mean of a pentahedron's corners, mm.
    #[inline]
    pub fn centroid(&self, pentahedron: u32) -> Vec3 {
        let nodes = self.pentahedron_nodes(pentahedron);
        nodes.iter().map(|&node| self.position(node)).sum::<Vec3>() / 6.0
    }

    /// Volume of a pentahedron as it is now, all of it, mm³; negative when inverted.
    pub fn volume_of(&self, pentahedron: u32) -> f64 {
        let position = |node: u32| self.position(node).as_dvec3();
        wedge::volume(&self.pentahedron_nodes(pentahedron), position)
    }

    /// Indices of the living pentahedra around a node.
    pub fn pentahedra_around(&self, node: u32) -> impl Iterator<Item = u32> + '_ {
        self.nodes
            .around(node)
            .iter()
            .copied()
            .filter(|&pentahedron| self.is_pentahedron_alive(pentahedron))
    }

    /// Indices of the living pentahedra, rising.
    pub fn living_pentahedron_indices(&self) -> impl Iterator<Item = u32> + '_ {
        (0u32..)
            .zip(&self.pentahedra.alive)
            .filter(|(_, alive)| **alive)
            .map(|(pentahedron, _)| pentahedron)
    }

    /// Volume that the living pentahedra hold as they are now, mm³: what the exposed surface encloses, if none is thinned.
    pub fn volume_mm3(&self) -> f64 {
        self.living_pentahedron_indices()
            .map(|pentahedron| self.volume_of(pentahedron) * self.fill(pentahedron))
            .sum()
    }

    /// Volume at rest of the tissue as built, mm³.
    pub fn initial_volume_mm3(&self) -> f64 {
        self.rest_volume_mm3
    }

    /// Volume at rest of all that has been removed, mm³.
    pub fn removed_volume_mm3(&self) -> f64 {
        self.removed_volume_mm3
    }

    /// The exposed surface.
    pub fn surface(&self) -> &Surface {
        &self.surface
    }

    /// Young's modulus of the springs alone, Pa: less than the tissue's where volume effects bear a part.
    pub fn spring_modulus_pa(&self) -> f64 {
        self.modulus_pa
    }

    /// How far the centroid of a pentahedron is at most from its first node at rest, mm.
    pub fn reach_mm(&self) -> f32 {
        self.reach
    }

    /// Mean rest length of the springs, mm.
    pub fn mean_length_mm(&self) -> f32 {
        self.mean_length
    }

    /// Moves a node, mm.
    pub fn set_position(&mut self, node: u32, position: Vec3) -> Result<(), EditError> {
        self.check_node(node, "position", position)?;
        if let Some(value) = position.to_array().into_iter().find(|place| place.abs() > FURTHEST_MM) {
            return Err(EditError::Value {
                what: "node",
                index: node,
                field: "position",
                value,
                expected: "components within 10 m",
            });
        }
        self.motion.positions.set(node, position);
        self.motion.lost.set(node, Vec3::ZERO);
        self.forget_bound();
        self.wake(node);
        self.motion_version += 1;
        self.watch_does(|finer| finer.set_position(node, position));
        Ok(())
    }

    /// Gives a node a velocity, mm/s.
    pub fn set_velocity(&mut self, node: u32, velocity: Vec3) -> Result<(), EditError> {
        self.check_node(node, "velocity", velocity)?;
        self.motion.velocities.set(node, velocity);
        self.wake(node);
        self.watch_does(|finer| finer.set_velocity(node, velocity));
        Ok(())
    }

    /// Puts a load on a node, µN; it stays until it is changed.
    pub fn set_load(&mut self, node: u32, load: Vec3) -> Result<(), EditError> {
        self.check_node(node, "load", load)?;
        self.nodes.load.set(node, load);
        self.wake(node);
        self.watch_does(|finer| finer.set_load(node, load));
        Ok(())
    }

    /// Gives a node another damping, gamma of equation (1), g/s; 0 or more.
    pub fn set_damping(&mut self, node: u32, damping_g_per_s: f32) -> Result<(), EditError> {
        self.check_alive("node", node, self.is_node_alive(node))?;
        let most = MOST_DAMPED * self.mass_g(node);
        let expected = "0 to 1e24 times the mass a second";
        check_range("node", node, "damping", damping_g_per_s, 0.0..=most, expected)?;
        let rate = damping_g_per_s / self.mass_g(node);
        self.nodes.damping_rate.set(node, rate);
        self.forget_inertias();
        self.watch_does(|finer| finer.set_damping(node, damping_g_per_s));
        Ok(())
    }

    /// Gives a node another mass, g; above 0. Its damping stays.
    pub fn set_mass(&mut self, node: u32, mass_g: f32) -> Result<(), EditError> {
        self.check_alive("node", node, self.is_node_alive(node))?;
        let damping = self.damping_g_per_s(node);
        let least = f32::MIN_POSITIVE.max(damping / MOST_DAMPED);
        let expected = "above 0 and 1e-24 s of its damping, up to 1e12 g";
        check_range("node", node, "mass", mass_g, least..=HEAVIEST_G, expected)?;
        self.nodes.mass.set(node, mass_g);
        self.nodes.damping_rate.set(node, damping / mass_g);
        self.forget_inertias();
        self.watch_does(|finer| finer.set_mass(node, mass_g));
        Ok(())
    }

    /// Gives a spring another stiffness, µN/mm; 0 or more.
    pub fn set_spring_stiffness(&mut self, spring: u32, stiffness: f32) -> Result<(), EditError> {
        self.check_alive("spring", spring, self.is_spring_alive(spring))?;
        let expected = "0 to 1e18 µN/mm";
        check_range("spring", spring, "stiffness", stiffness, 0.0..=STIFFEST, expected)?;
        self.springs.set_stiffness(spring, stiffness);
        self.wake_ends(spring);
        self.forget_bound_and_inertias();
        self.watch_does(|finer| finer.set_spring_stiffness(spring, stiffness));
        Ok(())
    }

    /// Gives a spring another rest length, mm; 0 or more.
    pub fn set_spring_rest_length(&mut self, spring: u32, rest_length: f32) -> Result<(), EditError> {
        self.check_alive("spring", spring, self.is_spring_alive(spring))?;
        let expected = "0 to 10 m";
        check_range(
            "spring",
            spring,
            "rest_length",
            rest_length,
            0.0..=FURTHEST_MM,
            expected,
        )?;
        self.springs.set_rest_length(spring, rest_length);
        self.wake_ends(spring);
        self.forget_bound_and_inertias();
        self.watch_does(|finer| finer.set_spring_rest_length(spring, rest_length));
        Ok(())
    }

    fn check_alive(&self, what: &'static str, index: u32, alive: bool) -> Result<(), EditError> {
        if alive {
            Ok(())
        } else {
            Err(EditError::NoSuch { what, index })
        }
    }

    pub(crate) fn check_node(&self, node: u32, field: &'static str, value: Vec3) -> Result<(), EditError> {
        self.check_alive("node", node, self.is_node_alive(node))?;
        match value.to_array().into_iter().find(|component| !component.is_finite()) {
            None => Ok(()),
            Some(value) => Err(EditError::Value {
                what: "node",
                index: node,
                field,
                value,
                expected: "finite components",
            }),
        }
    }

    pub(crate) fn position64(&self, node: u32) -> DVec3 {
        self.position(node).as_dvec3()
    }
}

impl Nodes {
    /// All pentahedra around a node, living or not.
    pub fn around(&self, node: u32) -> &[u32] {
        let node = node as usize;
        &self.around[self.around_start[node] as usize..self.around_start[node + 1] as usize]
    }
}

impl Pentahedra {
    /// Where in `shares` those of a pentahedron are: the springs it stands behind, and the volume (mm³) it lends each.
    pub fn share_range(&self, pentahedron: u32) -> Range<usize> {
        let pentahedron = pentahedron as usize;
        self.share_start[pentahedron] as usize..self.share_start[pentahedron + 1] as usize
    }
}

pub(crate) fn check_range(
    what: &'static str,
    index: u32,
    field: &'static str,
    value: f32,
    range: RangeInclusive<f32>,
    expected: &'static str,
) -> Result<(), EditError> {
    if range.contains(&value) {
        return Ok(());
    }
    Err(EditError::Value {
        what,
        index,
        field,
        value,
        expected,
    })
}
