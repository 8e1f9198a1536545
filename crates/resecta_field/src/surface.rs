//! The surface between what is kept and what is not: triangles in slots, and which pentahedron they belong to.
//!
//! Where a cut has reached, the surface is that of `extract.rs`; elsewhere the exposed faces as they are (`coarse.rs`).
//! All triangles together are closed and oriented outwards: every directed edge has its opposite.

use glam::Vec3;
use resecta_anatomy::wedge;

use crate::lookup::Lookup;
use crate::mesh::Mesh;
use crate::shape;
use crate::vertices::Vertices;

pub const NONE: u32 = u32::MAX;

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

/// The vertices of one pentahedron's part of the surface.
#[derive(Debug, Clone, Default)]
pub struct Piece {
    /// Slot of the vertex in every sub-prism, and in every fine triangle of the boundary; `NONE` where there is none.
    /// Empty where the pentahedron is untouched, and the second where it has no exposed face.
    pub duals: Box<[u32]>,
    pub rims: Box<[u32]>,
    /// Slots in the middle of exposed faces that are coarse beside fine ones.
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
    first: Vec<u32>,
    free: Vec<u32>,
    /// Pieces by pentahedron; empty until a cut.
    pub(crate) pieces: Lookup<u32, Piece>,
    /// Slots of kept points on the exposed surface.
    pub(crate) point_slots: Lookup<u32, u32>,
    version: u64,
}

impl Surface {
    /// No triangles yet.
    pub(crate) fn empty(mesh: &Mesh) -> Self {
        Self {
            vertices: Vertices::new(mesh),
            triangles: Vec::new(),
            next: Vec::new(),
            first: vec![NONE; mesh.pentahedra.len()],
            free: Vec::new(),
            pieces: Lookup::default(),
            point_slots: Lookup::default(),
            version: 1,
        }
    }

    /// The exposed faces of an uncut tissue.
    pub(crate) fn of_mesh(mesh: &Mesh) -> Self {
        let mut surface = Self::empty(mesh);
        let mut pentahedra = Vec::new();
        for (pentahedron, face) in mesh.exposed_faces() {
            surface.add_face(pentahedron, &mesh.face_nodes(pentahedron, face));
            pentahedra.push(pentahedron);
        }
        pentahedra.dedup();
        surface.rebuild_normals(mesh, &pentahedra);
        surface
    }

    /// A face as it is.
    pub(crate) fn add_face(&mut self, pentahedron: u32, nodes: &[u32]) {
        match *nodes {
            [a, b, c, d] => {
                for triangle in wedge::split_quad([a, b, c, d]) {
                    self.add(pentahedron, triangle);
                }
            }
            _ => self.add(pentahedron, [nodes[0], nodes[1], nodes[2]]),
        }
    }

    pub(crate) fn add(&mut self, pentahedron: u32, triangle: [u32; 3]) {
        let slot = self.free.pop().unwrap_or_else(|| {
            self.triangles.push([NONE; 3]);
            self.next.push(NONE);
            self.triangles.len() as u32 - 1
        });
        self.triangles[slot as usize] = triangle;
        self.next[slot as usize] = std::mem::replace(&mut self.first[pentahedron as usize], slot);
    }

    /// Frees the triangles of a pentahedron.
    pub(crate) fn clear(&mut self, pentahedron: u32) {
        let mut slot = std::mem::replace(&mut self.first[pentahedron as usize], NONE);
        while slot != NONE {
            self.triangles[slot as usize] = [NONE; 3];
            self.free.push(slot);
            slot = std::mem::replace(&mut self.next[slot as usize], NONE);
        }
        self.version += 1;
    }

    /// The triangles of a pentahedron's piece.
    pub(crate) fn of(&self, pentahedron: u32) -> impl Iterator<Item = [u32; 3]> + '_ {
        let begin = Some(self.first[pentahedron as usize]).filter(|&slot| slot != NONE);
        std::iter::successors(begin, |&slot| {
            Some(self.next[slot as usize]).filter(|&slot| slot != NONE)
        })
        .map(|slot| self.triangles[slot as usize])
    }

    /// Whether a pentahedron has neither triangles nor vertices.
    pub(crate) fn is_bare(&self, pentahedron: u32) -> bool {
        let has_vertices = self
            .pieces
            .get(&pentahedron)
            .is_some_and(|piece| !piece.chunks.is_empty());
        self.first[pentahedron as usize] == NONE && !has_vertices
    }

    /// Rises with every change of the triangles.
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

    /// The pentahedron that carries a vertex and its weights for the six corners (each 0 or more, sum 1); none for a
    /// free slot and for nodes inside the tissue.
    pub fn carrier(&self, vertex: u32) -> Option<(u32, [f32; 6])> {
        let (pentahedron, [a, b, t]) = self.vertices.home(vertex)?;
        Some((pentahedron, shape::weights(a, b, t)))
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

    /// Normals at rest, weighted by area, of all vertices whose surroundings these pentahedra's pieces are part of.
    pub(crate) fn rebuild_normals(&mut self, mesh: &Mesh, pentahedra: &[u32]) {
        // A vertex that moved turns the triangles around it, and they the normals of their other corners: those lie in
        // the pieces around, and what meets in them one ring further.
        let near = mesh.ring(pentahedra);
        let mut places = vec![NONE; self.vertices.len()];
        let mut targets = Vec::new();
        for vertex in near.iter().flat_map(|&pentahedron| self.of(pentahedron)).flatten() {
            let place = &mut places[vertex as usize];
            if *place == NONE {
                *place = targets.len() as u32;
                targets.push(vertex);
            }
        }
        let mut sums = vec![Vec3::ZERO; targets.len()];
        for pentahedron in mesh.ring(&near) {
            for triangle in self.of(pentahedron) {
                let at = triangle.map(|vertex| places[vertex as usize]);
                if at == [NONE; 3] {
                    continue;
                }
                let [a, b, c] = triangle.map(|vertex| self.vertices.rest[vertex as usize]);
                let area = (b - a).cross(c - a);
                for place in at.into_iter().filter(|&place| place != NONE) {
                    sums[place as usize] += area;
                }
            }
        }
        for (&vertex, &sum) in targets.iter().zip(&sums) {
            self.vertices.set_normal(mesh, vertex, sum.normalize_or_zero());
        }
    }

    /// Bytes that cuts have made the surface hold.
    pub(crate) fn bytes(&self) -> usize {
        let pieces = self.pieces.values().map(|piece| {
            4 * (piece.duals.len() + piece.rims.len() + piece.centres.capacity() + piece.chunks.capacity())
        });
        if self.pieces.is_empty() {
            return 0;
        }
        pieces.sum::<usize>()
            + self.pieces.capacity() * size_of::<(u32, Piece)>()
            + self.point_slots.capacity() * size_of::<[u32; 2]>()
            + self.triangles.capacity() * size_of::<[u32; 4]>()
            + self.vertices.bytes()
    }
}
