//! The surface's vertices, carried by the pentahedra.
//!
//! A vertex is a pentahedron and local coordinates in it; slot `n` below the number of nodes is node `n` itself. The
//! other slots come in chunks of eight that belong to one pentahedron: its corners are then loaded once for eight
//! vertices, and coordinates, stored by component, are worked on eight at a time. (Six weights a vertex would be twice
//! the memory, and 18 scattered loads each.) A slot keeps its vertex for as long as that is needed, so what was not cut
//! stays where it is in a mesh's buffers.
//!
//! A normal is stored as its products with the three local axes: the cofactors of the axes bring it to any deformed
//! state.

use std::sync::Arc;

use glam::Vec3;
use resecta_solver::with_widest_registers;

use crate::changes::Marked;
use crate::lanes;
use crate::mesh::Mesh;
use crate::room;
use crate::shape::{self, Shape};
use crate::sublattice::{LANES, Lanes, face_corners};
use crate::surface::{MOST_FREE, SurfaceKind};

const NONE: u32 = u32::MAX;

/// Local coordinates and normals of a chunk's vertices, by component.
#[derive(Debug, Clone, Default)]
struct Chunk {
    place: [Lanes; 3],
    normal: [Lanes; 3],
}

/// A vertex inside a pentahedron.
#[derive(Debug, Clone, Copy)]
pub struct Vertex {
    /// Local coordinates.
    pub place: [f32; 3],
    /// Products with the local axes at rest, of any positive length.
    pub normal: [f32; 3],
    pub kind: SurfaceKind,
    /// Depth in coagulated tissue, mm.
    pub coagulation: f32,
}

/// What never changes at a node.
#[derive(Debug, Clone, Copy)]
struct AtNode {
    /// A pentahedron of an exposed node, `NONE` inside, and the corner that the node is there.
    home: (u32, u8),
    /// The normal in it, as in a chunk.
    normal: [f32; 3],
    /// Unit normal at rest of the uncut surface; zero inside.
    rest_normal: Vec3,
}

#[derive(Debug, Clone)]
pub struct Vertices {
    nodes: usize,
    at_nodes: Arc<[AtNode]>,
    chunks: Vec<Chunk>,
    /// Pentahedron of every chunk; `NONE` for a free one.
    owners: Vec<u32>,
    /// A bit for every lane in use.
    used: Vec<u8>,
    free: Vec<u32>,
    /// By slot.
    pub rest: Vec<Vec3>,
    pub kinds: Vec<SurfaceKind>,
    pub coagulation: Vec<f32>,
    /// Slots changed since they were last asked for.
    pub changes: Marked,
}

impl Vertices {
    pub fn new(mesh: &Mesh) -> Self {
        let nodes = mesh.rest.len();
        let mut kinds = vec![SurfaceKind::Cut; nodes];
        let mut at_nodes = vec![
            AtNode {
                home: (NONE, 0),
                normal: [0.0; 3],
                rest_normal: Vec3::ZERO,
            };
            nodes
        ];
        for (pentahedron, face) in mesh.exposed_faces() {
            for &corner in face_corners(face) {
                let node = mesh.pentahedra[pentahedron as usize][corner] as usize;
                kinds[node] = kinds[node].min(mesh.kind(pentahedron, face));
                if at_nodes[node].home.0 == NONE {
                    at_nodes[node].home = (pentahedron, corner as u8);
                }
            }
            // Weighted by area.
            for triangle in mesh.face_triangles(pentahedron, face) {
                let [a, b, c] = triangle.map(|node| mesh.rest[node as usize]);
                let area = (b - a).cross(c - a).as_vec3();
                (triangle.into_iter()).for_each(|node| at_nodes[node as usize].rest_normal += area);
            }
        }
        for at_node in &mut at_nodes {
            let (pentahedron, corner) = at_node.home;
            at_node.rest_normal = at_node.rest_normal.normalize_or_zero();
            if pentahedron != NONE {
                let place = corner_place(corner).map(f64::from);
                let axes = mesh.rest_shape(pentahedron).jacobian(place);
                at_node.normal = axes.map(|axis| axis.as_vec3().dot(at_node.rest_normal));
            }
        }
        Self {
            nodes,
            at_nodes: at_nodes.into(),
            chunks: Vec::new(),
            owners: Vec::new(),
            used: Vec::new(),
            free: Vec::new(),
            rest: mesh.rest.iter().map(|place| place.as_vec3()).collect(),
            kinds,
            coagulation: vec![0.0; nodes],
            changes: Marked::default(),
        }
    }

    /// None but the nodes of others.
    pub fn like(other: &Self) -> Self {
        Self {
            nodes: other.nodes,
            at_nodes: other.at_nodes.clone(),
            chunks: Vec::new(),
            owners: Vec::new(),
            used: Vec::new(),
            free: Vec::new(),
            rest: other.rest[..other.nodes].to_vec(),
            kinds: other.kinds[..other.nodes].to_vec(),
            coagulation: other.coagulation[..other.nodes].to_vec(),
            changes: Marked::default(),
        }
    }

    /// Unit normal at rest of the uncut surface at a place on it: the mean of the nodes' around.
    pub fn surface_normal(&self, mesh: &Mesh, pentahedron: u32, [a, b, t]: [f32; 3]) -> Vec3 {
        let nodes = &mesh.pentahedra[pentahedron as usize];
        let sum: Vec3 = (nodes.iter().zip(shape::weights(a, b, t)))
            .map(|(&node, weight)| self.at_nodes[node as usize].rest_normal * weight)
            .sum();
        sum.normalize_or_zero()
    }

    /// Slots, free ones included.
    pub fn len(&self) -> usize {
        self.nodes + self.chunks.len() * LANES
    }

    pub fn chunk_count(&self) -> usize {
        self.chunks.len()
    }

    pub fn is_node(&self, slot: u32) -> bool {
        (slot as usize) < self.nodes
    }

    /// Whether the slot holds a vertex of the surface. Nodes always do, be they on the surface or not.
    pub fn is_used(&self, slot: u32) -> bool {
        let slot = slot as usize;
        if slot < self.nodes {
            return true;
        }
        let (chunk, lane) = ((slot - self.nodes) / LANES, (slot - self.nodes) % LANES);
        self.used.get(chunk).is_some_and(|used| used >> lane & 1 == 1)
    }

    /// The pentahedron of a vertex and its local coordinates.
    pub fn home(&self, slot: u32) -> Option<(u32, [f32; 3])> {
        if !self.is_used(slot) {
            return None;
        }
        let slot = slot as usize;
        if slot < self.nodes {
            let (pentahedron, corner) = self.at_nodes[slot].home;
            return (pentahedron != NONE).then_some((pentahedron, corner_place(corner)));
        }
        let (chunk, lane) = ((slot - self.nodes) / LANES, (slot - self.nodes) % LANES);
        Some((self.owners[chunk], self.chunks[chunk].place.map(|lanes| lanes[lane])))
    }

    /// A free slot of a pentahedron, whose chunks are `chunks`.
    pub fn add(&mut self, pentahedron: u32, chunks: &mut Vec<u32>) -> u32 {
        let open = chunks
            .iter()
            .copied()
            .find(|&chunk| self.used[chunk as usize] != u8::MAX);
        let chunk = open.unwrap_or_else(|| {
            let chunk = self.free.pop().unwrap_or_else(|| {
                self.chunks.push(Chunk::default());
                self.owners.push(NONE);
                self.used.push(0);
                self.rest.resize(self.len(), Vec3::ZERO);
                self.kinds.resize(self.len(), SurfaceKind::Cut);
                self.coagulation.resize(self.len(), 0.0);
                self.owners.len() as u32 - 1
            });
            self.owners[chunk as usize] = pentahedron;
            chunks.push(chunk);
            chunk
        }) as usize;
        let lane = (!self.used[chunk]).trailing_zeros() as usize;
        self.used[chunk] |= 1 << lane;
        (self.nodes + chunk * LANES + lane) as u32
    }

    pub fn set(&mut self, slot: u32, vertex: &Vertex, shape: &Shape) {
        let index = slot as usize - self.nodes;
        let chunk = &mut self.chunks[index / LANES];
        for axis in 0..3 {
            chunk.place[axis][index % LANES] = vertex.place[axis];
            chunk.normal[axis][index % LANES] = vertex.normal[axis];
        }
        self.rest[slot as usize] = shape.at(vertex.place.map(f64::from)).as_vec3();
        self.kinds[slot as usize] = vertex.kind;
        self.coagulation[slot as usize] = vertex.coagulation;
        self.changes.mark(slot);
    }

    /// Tells a vertex on the former surface of another face that it lies on, and how deep it is coagulated.
    pub fn renew(&mut self, slot: u32, kind: SurfaceKind, coagulation: f32) {
        let index = slot as usize;
        let kind = kind.min(self.kinds[index]);
        if self.kinds[index] != kind || self.coagulation[index] != coagulation {
            self.kinds[index] = kind;
            self.coagulation[index] = coagulation;
            self.changes.mark(slot);
        }
    }

    /// Frees a slot; its pentahedron's chunks are not in `chunks` if it is another's.
    pub fn remove(&mut self, slot: u32) {
        let index = slot as usize - self.nodes;
        let chunk = index / LANES;
        self.used[chunk] &= !(1 << (index % LANES));
        for component in 0..3 {
            self.chunks[chunk].place[component][index % LANES] = 0.0;
            self.chunks[chunk].normal[component][index % LANES] = 0.0;
        }
        self.rest[slot as usize] = Vec3::ZERO;
        self.coagulation[slot as usize] = 0.0;
        self.changes.mark(slot);
    }

    /// Gives back those chunks of a pentahedron that hold no vertex.
    pub fn release(&mut self, chunks: &mut Vec<u32>) {
        chunks.retain(|&chunk| {
            let keep = self.used[chunk as usize] != 0;
            if !keep {
                self.owners[chunk as usize] = NONE;
                self.free.push(chunk);
            }
            keep
        });
    }

    /// Gives back free chunks at the end, where those are most of all.
    pub fn trim(&mut self) {
        if LANES * self.free.len() <= MOST_FREE.max(LANES * self.chunks.len() / 2) {
            return;
        }
        let used = self.owners.iter().rposition(|&owner| owner != NONE);
        let count = used.map_or(0, |last| last + 1);
        if count > self.chunks.len() / 2 {
            return;
        }
        room::cut_off(&mut self.chunks, count);
        room::cut_off(&mut self.owners, count);
        room::cut_off(&mut self.used, count);
        self.free.retain(|&chunk| (chunk as usize) < count);
        let slots = self.len();
        room::cut_off(&mut self.rest, slots);
        room::cut_off(&mut self.kinds, slots);
        room::cut_off(&mut self.coagulation, slots);
    }

    pub fn make_room(&mut self) {
        room::make(&mut self.chunks);
        room::make(&mut self.owners);
        room::make(&mut self.used);
        room::make(&mut self.rest);
        room::make(&mut self.kinds);
        room::make(&mut self.coagulation);
        self.changes.make_room();
    }

    /// The chunk of eight slots that a vertex is in; none for a node.
    #[inline]
    pub fn chunk(&self, slot: u32) -> Option<u32> {
        let past_nodes = (slot as usize).checked_sub(self.nodes)?;
        Some((past_nodes / LANES) as u32)
    }

    /// The pentahedron that carries a chunk; none for a free one and one that does not exist.
    #[inline]
    pub fn owner(&self, chunk: u32) -> Option<u32> {
        self.owners.get(chunk as usize).copied().filter(|&owner| owner != NONE)
    }

    /// The first slot of a chunk.
    pub fn first_slot(&self, chunk: u32) -> u32 {
        (self.nodes + chunk as usize * LANES) as u32
    }

    /// Where a chunk's vertices are with the nodes at `position`.
    #[inline(always)]
    pub fn chunk_places(&self, mesh: &Mesh, chunk: usize, position: impl Fn(u32) -> Vec3) -> [Vec3; LANES] {
        let [x, y, z] = self.chunk_lanes(mesh, chunk, position);
        std::array::from_fn(|l| Vec3::new(x[l], y[l], z[l]))
    }

    /// The same by component.
    #[inline(always)]
    pub fn chunk_lanes(&self, mesh: &Mesh, chunk: usize, position: impl Fn(u32) -> Vec3) -> [Lanes; 3] {
        mesh.carrier(self.owners[chunk], position).at(&self.chunks[chunk].place)
    }

    /// Which slots of a chunk hold a vertex, a bit each.
    #[inline(always)]
    pub fn used(&self, chunk: u32) -> u8 {
        self.used.get(chunk as usize).copied().unwrap_or(0)
    }

    /// Unit normals of a chunk's vertices with the nodes at `position`; zero where a slot is free.
    #[inline(always)]
    pub fn chunk_normals(&self, mesh: &Mesh, chunk: usize, position: impl Fn(u32) -> Vec3) -> [Vec3; LANES] {
        let carrier = mesh.carrier(self.owners[chunk], position);
        let chunk = &self.chunks[chunk];
        // By component, as the places, so that eight normals are worked on at a time.
        let along = carrier.jacobian(&chunk.place);
        let mut normal = [[0.0; LANES]; 3];
        // As `carry`.
        for (product, [x, y]) in chunk.normal.iter().zip([[2, 1], [0, 2], [1, 0]]) {
            let (x, y) = (&along[x], &along[y]);
            for (n, sum) in normal.iter_mut().enumerate() {
                let (i, j) = ((n + 1) % 3, (n + 2) % 3);
                for l in 0..LANES {
                    sum[l] += product[l] * (x[i][l] * y[j][l] - x[j][l] * y[i][l]);
                }
            }
        }
        let [x, y, z] = lanes::normalized_or_zero(&normal);
        std::array::from_fn(|l| Vec3::new(x[l], y[l], z[l]))
    }

    /// Where the vertices are with the nodes at `positions`, one a node.
    pub fn places(&self, mesh: &Mesh, positions: &[Vec3], out: &mut Vec<Vec3>) {
        self.by_chunk(
            out,
            |nodes| nodes.copy_from_slice(positions),
            #[inline(always)]
            |chunk| self.chunk_places(mesh, chunk, |node| positions[node as usize]),
        );
    }

    /// Unit normals with the nodes at `positions`, one a node; zero where a slot is free.
    pub fn normals(&self, mesh: &Mesh, positions: &[Vec3], out: &mut Vec<Vec3>) {
        let at_nodes = |out: &mut [Vec3]| {
            for (at_node, out) in self.at_nodes.iter().zip(out) {
                let (pentahedron, corner) = at_node.home;
                *out = if pentahedron == NONE {
                    Vec3::ZERO
                } else {
                    let carrier = mesh.carrier(pentahedron, |node| positions[node as usize]);
                    carry(at_node.normal, carrier.axes(corner_place(corner)))
                };
            }
        };
        self.by_chunk(
            out,
            at_nodes,
            #[inline(always)]
            |chunk| self.chunk_normals(mesh, chunk, |node| positions[node as usize]),
        );
    }

    /// Fills a list of one vector a slot: the nodes at once, the others by chunk, zero for those of a free one. What
    /// tells of a chunk is to be inlined by force.
    #[inline(always)]
    fn by_chunk(&self, out: &mut Vec<Vec3>, at_nodes: impl Fn(&mut [Vec3]), of: impl Fn(usize) -> [Vec3; LANES]) {
        out.resize(self.len(), Vec3::ZERO);
        let (nodes, carried) = out.split_at_mut(self.nodes);
        at_nodes(nodes);
        with_widest_registers(
            #[inline(always)]
            || {
                for (chunk, out) in carried.as_chunks_mut::<LANES>().0.iter_mut().enumerate() {
                    *out = match self.owners[chunk] {
                        NONE => [Vec3::ZERO; LANES],
                        _ => of(chunk),
                    };
                }
            },
        );
    }

    /// Bytes that stand for vertices other than nodes.
    pub fn bytes(&self) -> usize {
        self.chunks.capacity() * size_of::<Chunk>()
            + 5 * self.owners.capacity()
            + 4 * self.free.capacity()
            + self.changes.bytes()
            + self.chunks.len() * LANES * (size_of::<Vec3>() + size_of::<SurfaceKind>() + size_of::<f32>())
    }
}

/// Local coordinates of a corner.
fn corner_place(corner: u8) -> [f32; 3] {
    let [a, b] = [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]][usize::from(corner % 3)];
    [a, b, f32::from(corner / 3)]
}

/// A normal from its products with the axes. The axes of a pentahedron that is not inverted are left-handed.
#[inline(always)]
pub fn carry(normal: [f32; 3], [a, b, t]: [Vec3; 3]) -> Vec3 {
    (t.cross(b) * normal[0] + a.cross(t) * normal[1] + b.cross(a) * normal[2]).normalize_or_zero()
}
