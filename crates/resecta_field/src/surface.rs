//! The surface between what is kept and what is not: triangles in slots, and which pentahedron they belong to.
//!
//! Where a cut has reached, the surface is that of `extract.rs`; elsewhere the exposed faces as they are (`coarse.rs`).
//! All triangles together are closed and oriented outwards: every directed edge has its opposite.

use std::sync::Arc;

use glam::Vec3;

use crate::changes::{Changes, Marked};
use crate::extract::Walks;
use crate::lookup::Lookup;
use crate::mesh::Mesh;
use crate::room;
use crate::shape;
use crate::sublattice::LANES;
use crate::vertices::Vertices;

pub const NONE: u32 = u32::MAX;

/// Slots in a chunk of vertices: see [`Surface::chunk`].
pub const CHUNK: usize = LANES;

/// Free slots that are not worth giving back.
pub const MOST_FREE: usize = 1 << 14;

/// What a part of the surface is. Where kinds meet, the vertex is of the first.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[repr(u8)]
pub enum SurfaceKind {
    /// The lining of the lumen.
    Mucosa,
    /// The outer surface of the organ.
    Capsule,
    /// Another part of the surface that was there before any cut.
    Other,
    /// Laid bare by a cut.
    Cut,
}

/// The vertices of a touched pentahedron's part of the surface.
#[derive(Debug, Clone, Default)]
pub struct Piece {
    /// Slot of the vertex in every sub-prism, and in every fine triangle of the boundary; `NONE` where there is none.
    /// The second is empty where the pentahedron has no exposed face; both until it is first updated.
    pub duals: Box<[u32]>,
    pub rims: Box<[u32]>,
    pub chunks: Vec<u32>,
}

/// The vertices of an untouched pentahedron beside a touched one.
#[derive(Debug, Clone, Default)]
pub struct Coarse {
    /// Slots in the middle of exposed faces.
    pub centres: Vec<u32>,
    pub chunks: Vec<u32>,
}

/// The surface of a [`crate::Field`].
#[derive(Debug, Clone)]
pub struct Surface {
    pub(crate) vertices: Vertices,
    /// A free slot has `NONE` thrice.
    triangles: Vec<[u32; 3]>,
    /// A pentahedron's triangles are a list linked by slots: four bytes a triangle, and none moves when others go.
    next: Vec<u32>,
    /// The kept point that a triangle hangs on.
    kept: Vec<u32>,
    first: Vec<u32>,
    free: Vec<u32>,
    /// Pieces by the index of the pentahedron's cell.
    pub(crate) pieces: Vec<Piece>,
    pub(crate) coarse: Lookup<u32, Coarse>,
    /// Slots of kept points on the exposed surface, by point.
    pub(crate) point_slots: Vec<u32>,
    /// Triangle slots changed since they were last asked for.
    changes: Marked,
    pub(crate) version: u64,
    pub(crate) walks: Walks,
    /// See [`Mesh`].
    orders: Arc<[[u8; 6]]>,
}

impl Surface {
    /// No triangles, on the same nodes.
    pub(crate) fn like(other: &Self) -> Self {
        Self {
            vertices: Vertices::like(&other.vertices),
            triangles: Vec::new(),
            next: Vec::new(),
            kept: Vec::new(),
            first: vec![NONE; other.first.len()],
            free: Vec::new(),
            pieces: Vec::new(),
            coarse: Lookup::default(),
            point_slots: Vec::new(),
            changes: Marked::default(),
            version: 1,
            walks: Walks::default(),
            orders: other.orders.clone(),
        }
    }

    /// The exposed faces of an uncut tissue.
    pub(crate) fn of_mesh(mesh: &Mesh) -> Self {
        let mut surface = Self {
            vertices: Vertices::new(mesh),
            triangles: Vec::new(),
            next: Vec::new(),
            kept: Vec::new(),
            first: vec![NONE; mesh.pentahedra.len()],
            free: Vec::new(),
            pieces: Vec::new(),
            coarse: Lookup::default(),
            point_slots: Vec::new(),
            changes: Marked::default(),
            version: 1,
            walks: Walks::default(),
            orders: mesh.orders.clone(),
        };
        for (pentahedron, face) in mesh.exposed_faces() {
            surface.add_face(mesh, pentahedron, face);
        }
        surface.take_changes();
        surface
    }

    /// A face as it is.
    pub(crate) fn add_face(&mut self, mesh: &Mesh, pentahedron: u32, face: usize) {
        for triangle in mesh.face_triangles(pentahedron, face) {
            self.add(pentahedron, NONE, triangle);
        }
    }

    /// Adds a triangle that goes with a kept point, or (`NONE`) with any change of the pentahedron's piece.
    pub(crate) fn add(&mut self, pentahedron: u32, kept: u32, triangle: [u32; 3]) {
        let slot = self.free.pop().unwrap_or_else(|| {
            self.triangles.push([NONE; 3]);
            self.next.push(NONE);
            self.kept.push(NONE);
            self.triangles.len() as u32 - 1
        });
        self.triangles[slot as usize] = triangle;
        self.kept[slot as usize] = kept;
        self.changes.mark(slot);
        self.next[slot as usize] = std::mem::replace(&mut self.first[pentahedron as usize], slot);
    }

    /// Frees those triangles of a pentahedron whose kept point is to go.
    pub(crate) fn drop_triangles(&mut self, pentahedron: u32, goes: impl Fn(u32) -> bool) {
        let mut slot = std::mem::replace(&mut self.first[pentahedron as usize], NONE);
        let mut last = NONE;
        while slot != NONE {
            let next = std::mem::replace(&mut self.next[slot as usize], NONE);
            if goes(self.kept[slot as usize]) {
                self.triangles[slot as usize] = [NONE; 3];
                self.changes.mark(slot);
                self.free.push(slot);
            } else {
                let link = if last == NONE {
                    &mut self.first[pentahedron as usize]
                } else {
                    &mut self.next[last as usize]
                };
                *link = slot;
                last = slot;
            }
            slot = next;
        }
    }

    /// The triangles of a pentahedron.
    pub(crate) fn triangles_of(&self, pentahedron: u32) -> impl Iterator<Item = [u32; 3]> + '_ {
        let used = |slot: u32| (slot != NONE).then_some(slot);
        let slots = std::iter::successors(used(self.first[pentahedron as usize]), move |&slot| {
            used(self.next[slot as usize])
        });
        slots.map(|slot| self.triangles[slot as usize])
    }

    /// Whether a touched pentahedron has neither triangles nor vertices.
    pub(crate) fn is_bare(&self, pentahedron: u32, cell: usize) -> bool {
        let has_vertices = self.pieces.get(cell).is_some_and(|piece| !piece.chunks.is_empty());
        self.first[pentahedron as usize] == NONE && !has_vertices
    }

    /// Gives back free slots at the end, where those are most of all. `points`: how many there are.
    pub(crate) fn trim(&mut self, points: usize) {
        self.vertices.trim();
        if points < self.point_slots.len() {
            room::cut_off(&mut self.point_slots, points);
        }
        if self.free.len() > MOST_FREE.max(self.triangles.len() / 2) {
            let used = self.triangles.iter().rposition(|triangle| triangle[0] != NONE);
            let count = used.map_or(0, |last| last + 1);
            if count > self.triangles.len() / 2 {
                return;
            }
            room::cut_off(&mut self.triangles, count);
            room::cut_off(&mut self.next, count);
            room::cut_off(&mut self.kept, count);
            self.free.retain(|&slot| (slot as usize) < count);
        }
    }

    pub(crate) fn make_room(&mut self) {
        room::make(&mut self.triangles);
        room::make(&mut self.next);
        room::make(&mut self.kept);
        room::make(&mut self.pieces);
        room::make(&mut self.point_slots);
        self.changes.make_room();
        self.vertices.make_room();
    }

    /// Slots changed since the last time.
    pub(crate) fn take_changes(&mut self) -> Changes {
        let mut vertices = self.vertices.changes.take();
        vertices.retain(|&vertex| (vertex as usize) < self.vertices.len());
        Changes {
            vertices,
            triangles: self.changes.take(),
        }
    }

    /// Rises with every change of the triangles, and of what the vertices are and where in their pentahedra.
    pub fn version(&self) -> u64 {
        self.version
    }

    /// The triangles by slot, as vertex slots, outward by the right-hand rule; `u32::MAX` thrice in a free slot.
    pub fn triangle_slots(&self) -> &[[u32; 3]] {
        &self.triangles
    }

    /// The triangles in use, by rising slot.
    pub fn triangles(&self) -> impl Iterator<Item = [u32; 3]> + '_ {
        self.triangles.iter().copied().filter(|triangle| triangle[0] != NONE)
    }

    /// Vertex slots, free ones included. The first are the nodes, in their order.
    pub fn vertex_count(&self) -> usize {
        self.vertices.len()
    }

    /// Whether a slot holds a vertex. Nodes always do, be they on the surface or not.
    #[inline]
    pub fn is_used(&self, vertex: u32) -> bool {
        self.vertices.is_used(vertex)
    }

    /// The pentahedron that carries a vertex; none for a free slot and for nodes inside the tissue.
    pub fn home(&self, vertex: u32) -> Option<u32> {
        match self.vertices.chunk(vertex) {
            Some(chunk) if self.vertices.is_used(vertex) => self.vertices.owner(chunk),
            Some(_) => None,
            None => self.vertices.home(vertex).map(|(pentahedron, _)| pentahedron),
        }
    }

    /// The chunk that a vertex is in; none for a node. Slots past the nodes come in chunks of [`CHUNK`], and one
    /// pentahedron carries all vertices of a chunk: they are placed together ([`crate::Field::chunk_places`]).
    #[inline]
    pub fn chunk(&self, vertex: u32) -> Option<u32> {
        self.vertices.chunk(vertex)
    }

    /// The pentahedron that carries a chunk; none for a free one.
    #[inline]
    pub fn chunk_home(&self, chunk: u32) -> Option<u32> {
        self.vertices.owner(chunk)
    }

    /// The slot of a chunk's first vertex.
    pub fn chunk_start(&self, chunk: u32) -> u32 {
        self.vertices.first_slot(chunk)
    }

    /// The pentahedron that carries a vertex and its weights for the six corners (each 0 or more, sum 1); none for a
    /// free slot and for nodes inside the tissue.
    pub fn carrier(&self, vertex: u32) -> Option<(u32, [f32; 6])> {
        let (pentahedron, [a, b, t]) = self.vertices.home(vertex)?;
        let mut given = [0.0; 6];
        let order = &self.orders[pentahedron as usize];
        for (&corner, weight) in order.iter().zip(shape::weights(a, b, t)) {
            given[usize::from(corner)] = weight;
        }
        Some((pentahedron, given))
    }

    /// What the vertices are part of, by slot.
    pub fn kinds(&self) -> &[SurfaceKind] {
        &self.vertices.kinds
    }

    /// How deep in coagulated tissue the vertices lie, mm, by slot; 0 outside of it.
    pub fn coagulation_mm(&self) -> &[f32] {
        &self.vertices.coagulation
    }

    /// Where the vertices are at rest, mm, by slot.
    pub fn rest_places(&self) -> &[Vec3] {
        &self.vertices.rest
    }

    /// Bytes that cuts have made the surface hold.
    pub(crate) fn bytes(&self) -> usize {
        if self.pieces.is_empty() {
            return 0;
        }
        let pieces =
            (self.pieces.iter()).map(|piece| 4 * (piece.duals.len() + piece.rims.len() + piece.chunks.capacity()));
        pieces.sum::<usize>()
            + self.pieces.capacity() * size_of::<Piece>()
            + self.coarse.capacity() * size_of::<(u32, Coarse)>()
            + 4 * (self.point_slots.capacity() + self.free.capacity())
            + self.triangles.capacity() * size_of::<[u32; 5]>()
            + self.changes.bytes()
            + self.walks.bytes()
            + self.vertices.bytes()
    }
}
