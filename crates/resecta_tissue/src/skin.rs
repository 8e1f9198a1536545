//! The skin of a tissue: the surface that tools touch and that is drawn.
//!
//! By whole elements it is the exposed faces, and its vertices are nodes. Cut finer than the elements it is the surface of
//! a [`Field`](resecta_field::Field), whose vertices are carried by the pentahedra; those of it that no cut has reached are
//! nodes and exposed faces again.

use std::ops::Range;

use bevy::prelude::*;
use resecta_field::{CHUNK, SurfaceKind};
use resecta_solver::{NodeKind, TissuePoint};

use crate::{change_log::ChangesSince, components::Tissue, fine::Fine};

/// The skin of a tissue as it lies.
#[derive(Clone, Copy)]
pub(crate) struct Skin<'a> {
    solver: &'a resecta_solver::Tissue,
    fine: Option<&'a Fine>,
}

/// Tells one state of the triangles from another.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct SkinVersion {
    is_fine: bool,
    changes: u64,
}

impl<'a> Skin<'a> {
    /// The skin of a tissue. A fine one is where [`Fine::bring`] or [`Fine::follow`] last brought it.
    pub fn of(tissue: &'a Tissue) -> Self {
        Self::new(&tissue.solver, tissue.fine.as_ref())
    }

    /// The skin of a tissue of these parts.
    pub fn new(solver: &'a resecta_solver::Tissue, fine: Option<&'a Fine>) -> Self {
        Self { solver, fine }
    }

    /// The tissue whose skin it is.
    pub fn solver(&self) -> &'a resecta_solver::Tissue {
        self.solver
    }

    /// Changes with the triangles.
    pub fn version(&self) -> SkinVersion {
        SkinVersion {
            is_fine: self.fine.is_some(),
            changes: match self.fine {
                Some(fine) => fine.surface().version(),
                None => self.solver.surface().version(),
            },
        }
    }

    /// Changes with the places of the vertices.
    pub fn motion_version(&self) -> u64 {
        self.solver.motion_version()
    }

    /// Slots of triangles, free ones included.
    pub fn slot_count(&self) -> usize {
        match self.fine {
            Some(fine) => fine.surface().triangle_slots().len(),
            None => self.solver.surface().slot_count(),
        }
    }

    /// The vertices of the triangle in a slot, outward by the right-hand rule; none in a free one.
    pub fn triangle(&self, slot: u32) -> Option<[u32; 3]> {
        match self.fine {
            Some(fine) => {
                let triangle = fine.surface().triangle_slots().get(slot as usize).copied()?;
                (triangle[0] != u32::MAX).then_some(triangle)
            }
            None => self.solver.surface().triangle(slot),
        }
    }

    /// Where a vertex is, mm.
    pub fn place(&self, vertex: u32) -> Vec3 {
        match self.fine {
            Some(fine) => fine.place(vertex),
            None => self.solver.position(vertex),
        }
    }

    /// Vertices, those that no triangle uses included.
    pub fn vertex_count(&self) -> usize {
        match self.fine {
            Some(fine) => fine.surface().vertex_count(),
            None => self.solver.node_count(),
        }
    }

    /// The vertices' normals, where the skin keeps them; as of the last [`Fine::follow`].
    pub fn normals(&self) -> Option<&'a [Vec3]> {
        self.fine.map(Fine::normals)
    }

    /// How deep in coagulated tissue a vertex lies, mm.
    pub fn coagulation_mm(&self, vertex: u32) -> f32 {
        self.fine
            .map_or(0.0, |fine| fine.surface().coagulation_mm()[vertex as usize])
    }

    /// Whether it may have other vertices than nodes.
    pub fn is_fine(&self) -> bool {
        self.fine.is_some()
    }

    /// Whether a vertex is a node of the tissue.
    pub fn is_node(&self, vertex: u32) -> bool {
        self.fine.is_none() || (vertex as usize) < self.solver.node_count()
    }

    /// The nodes that carry a vertex, and their weights.
    pub fn carriers(&self, vertex: u32) -> TissuePoint {
        if self.is_node(vertex) {
            return TissuePoint::node(vertex);
        }
        let carrier = self.fine.and_then(|fine| fine.surface().carrier(vertex));
        // A vertex in use has one.
        carrier.map_or(TissuePoint::node(0), |(pentahedron, weights)| {
            TissuePoint::in_pentahedron(self.solver.pentahedron_nodes(pentahedron), weights)
        })
    }

    /// What cuts changed since a version of the skin; none if only a look at all of it tells.
    pub fn changes_since(&self, version: SkinVersion) -> Option<ChangesSince<'a>> {
        self.fine
            .filter(|_| version.is_fine)
            .and_then(|fine| fine.changes_since(version.changes))
    }

    /// The chunk of eight vertices that a vertex is in, and its number there; none for a node.
    pub fn chunk(&self, vertex: u32) -> Option<(u32, usize)> {
        let surface = self.fine?.surface();
        let chunk = surface.chunk(vertex)?;
        Some((chunk, (vertex - surface.chunk_start(chunk)) as usize))
    }

    /// Chunks of vertices, free ones included.
    pub fn chunk_count(&self) -> usize {
        (self.vertex_count() - self.solver.node_count()) / CHUNK
    }

    /// The vertex with a number in a chunk.
    pub fn vertex_of(&self, chunk: u32, number: usize) -> u32 {
        self.fine
            .map_or(0, |fine| fine.surface().chunk_start(chunk) + number as u32)
    }

    /// The vertices of a chunk.
    pub fn vertices_of(&self, chunk: u32) -> Range<u32> {
        let start = self.vertex_of(chunk, 0);
        start..start + CHUNK as u32
    }

    /// The pentahedron that carries a chunk.
    pub fn chunk_home(&self, chunk: u32) -> Option<u32> {
        self.fine?.surface().chunk_home(chunk)
    }

    /// Where the vertices of a chunk would be if the nodes were elsewhere, mm.
    #[inline(always)]
    pub fn chunk_places(&self, chunk: u32, place: impl Fn(u32) -> Vec3) -> Option<[Vec3; CHUNK]> {
        self.fine?.field().chunk_places(chunk, place)
    }

    /// Where a vertex is at rest, mm.
    pub fn rest_place(&self, vertex: u32) -> Vec3 {
        match self.fine {
            Some(fine) => fine.surface().rest_places()[vertex as usize],
            None => self.solver.rest_position(vertex),
        }
    }

    /// The pentahedron that carries most of a triangle.
    pub fn pentahedron(&self, slot: u32, triangle: [u32; 3]) -> u32 {
        match self.fine {
            Some(fine) => {
                let [a, b, c] = triangle.map(|vertex| fine.surface().home(vertex));
                if b == c { b } else { a }.unwrap_or(u32::MAX)
            }
            None => self.solver.surface().owner(slot),
        }
    }

    /// Whether a cut laid a vertex bare.
    pub fn is_bare(&self, vertex: u32) -> bool {
        match self.fine {
            Some(fine) => fine.surface().kinds()[vertex as usize] == SurfaceKind::Cut,
            None => self.solver.node_kind(vertex) == NodeKind::Inner,
        }
    }

    /// The vertex of a triangle whose place at rest, mm, gives the least `measure`, and a pentahedron that carries it; the first of equals. With
    /// `only_bare` it is one that a cut laid bare. `None` if there is no such vertex.
    pub fn nearest_at_rest(&self, only_bare: bool, measure: impl Fn(Vec3) -> f32) -> Option<(u32, u32)> {
        let counts = |vertex: &u32| !only_bare || self.is_bare(*vertex);
        match self.fine {
            Some(fine) => {
                let vertices = (0..self.vertex_count() as u32).filter(counts);
                let carried = vertices.filter_map(|vertex| Some((vertex, fine.surface().home(vertex)?)));
                self.least(carried, measure)
            }
            None => {
                let surface = self.solver.surface();
                let corners = (surface.triangles())
                    .flat_map(|(slot, triangle)| triangle.map(|vertex| (vertex, surface.owner(slot))));
                self.least(corners.filter(|(vertex, _)| counts(vertex)), measure)
            }
        }
    }

    /// Of some vertices, with what carries them, the first at which a measure of the place at rest is least.
    fn least(&self, vertices: impl Iterator<Item = (u32, u32)>, measure: impl Fn(Vec3) -> f32) -> Option<(u32, u32)> {
        let measured = vertices.map(|(vertex, carrier)| (measure(self.rest_place(vertex)), vertex, carrier));
        let least = measured.min_by(|a, b| a.0.total_cmp(&b.0));
        least.map(|(_, vertex, carrier)| (vertex, carrier))
    }

    /// What the skin is at a vertex.
    pub fn kind(&self, vertex: u32) -> NodeKind {
        let Some(fine) = self.fine else {
            return self.solver.node_kind(vertex);
        };
        match fine.surface().kinds()[vertex as usize] {
            SurfaceKind::Mucosa => NodeKind::Mucosa,
            SurfaceKind::Capsule => NodeKind::Capsule,
            SurfaceKind::Other | SurfaceKind::Cut => NodeKind::Inner,
        }
    }
}
