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

use glam::Vec3;

use crate::mesh::Mesh;
use crate::shape::Shape;
use crate::surface::SurfaceKind;

/// Vertices of a chunk.
const LANES: usize = 8;

const NONE: u32 = u32::MAX;

type Lanes = [f32; LANES];

/// Local coordinates and normals of a chunk's vertices, by component.
#[derive(Debug, Clone, Default)]
struct Chunk {
    place: [Lanes; 3],
    normal: [Lanes; 3],
}

#[derive(Debug, Clone)]
pub struct Vertices {
    nodes: usize,
    /// A pentahedron at every exposed node and the corner that the node is there, and the normal in it.
    node_homes: Vec<(u32, u8)>,
    node_normals: Vec<[f32; 3]>,
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
}

impl Vertices {
    pub fn new(mesh: &Mesh) -> Self {
        let nodes = mesh.rest.len();
        let mut vertices = Self {
            nodes,
            node_homes: vec![(NONE, 0); nodes],
            node_normals: vec![[0.0; 3]; nodes],
            chunks: Vec::new(),
            owners: Vec::new(),
            used: Vec::new(),
            free: Vec::new(),
            rest: mesh.rest.iter().map(|place| place.as_vec3()).collect(),
            kinds: vec![SurfaceKind::Cut; nodes],
            coagulation: vec![0.0; nodes],
        };
        for (pentahedron, face) in mesh.exposed_faces() {
            for &corner in crate::sublattice::face_corners(face) {
                let node = mesh.pentahedra[pentahedron as usize][corner] as usize;
                vertices.kinds[node] = vertices.kinds[node].min(mesh.kind(pentahedron, face));
                if vertices.node_homes[node].0 == NONE {
                    vertices.node_homes[node] = (pentahedron, corner as u8);
                }
            }
        }
        vertices
    }

    /// Slots, free ones included.
    pub fn len(&self) -> usize {
        self.nodes + self.chunks.len() * LANES
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
            let (pentahedron, corner) = self.node_homes[slot];
            let [a, b] = [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]][usize::from(corner % 3)];
            return (pentahedron != NONE).then_some((pentahedron, [a, b, f32::from(corner / 3)]));
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

    pub fn set(&mut self, slot: u32, place: [f64; 3], shape: &Shape, kind: SurfaceKind, coagulation: f32) {
        let index = slot as usize - self.nodes;
        for (lanes, value) in self.chunks[index / LANES].place.iter_mut().zip(place) {
            lanes[index % LANES] = value as f32;
        }
        self.rest[slot as usize] = shape.at(place).as_vec3();
        self.kinds[slot as usize] = kind;
        self.coagulation[slot as usize] = coagulation;
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

    /// Stores the normal that a vertex has at rest.
    pub fn set_normal(&mut self, mesh: &Mesh, slot: u32, normal: Vec3) {
        let Some((pentahedron, place)) = self.home(slot) else {
            return;
        };
        let axes = mesh.rest_shape(pentahedron).jacobian(place.map(f64::from));
        let local = axes.map(|axis| axis.dot(normal.as_dvec3()) as f32);
        if self.is_node(slot) {
            self.node_normals[slot as usize] = local;
            return;
        }
        let index = slot as usize - self.nodes;
        for (lanes, value) in self.chunks[index / LANES].normal.iter_mut().zip(local) {
            lanes[index % LANES] = value;
        }
    }

    /// Where the vertices are with the nodes at `positions`, one a node.
    pub fn places(&self, mesh: &Mesh, positions: &[Vec3], out: &mut Vec<Vec3>) {
        out.resize(self.len(), Vec3::ZERO);
        let (nodes, carried) = out.split_at_mut(self.nodes);
        nodes.copy_from_slice(positions);
        for ((chunk, &owner), out) in self
            .chunks
            .iter()
            .zip(&self.owners)
            .zip(carried.as_chunks_mut::<LANES>().0)
        {
            if owner == NONE {
                *out = [Vec3::ZERO; LANES];
                continue;
            }
            let c = coefficients(&mesh.pentahedra[owner as usize], positions);
            let [a, b, t] = &chunk.place;
            let component = |n: usize| -> Lanes {
                let c: [f32; 6] = std::array::from_fn(|term| c[term][n]);
                std::array::from_fn(|l| c[0] + c[1] * a[l] + c[2] * b[l] + (c[3] + c[4] * a[l] + c[5] * b[l]) * t[l])
            };
            let [x, y, z] = [component(0), component(1), component(2)];
            for (l, out) in out.iter_mut().enumerate() {
                *out = Vec3::new(x[l], y[l], z[l]);
            }
        }
    }

    /// Unit normals with the nodes at `positions`, one a node; zero where a slot is free.
    pub fn normals(&self, mesh: &Mesh, positions: &[Vec3], out: &mut Vec<Vec3>) {
        out.resize(self.len(), Vec3::ZERO);
        let (nodes, carried) = out.split_at_mut(self.nodes);
        for (n, out) in nodes.iter_mut().enumerate() {
            let (pentahedron, corner) = self.node_homes[n];
            *out = if pentahedron == NONE {
                Vec3::ZERO
            } else {
                let c = coefficients(&mesh.pentahedra[pentahedron as usize], positions);
                let (end, side) = (f32::from(corner / 3), corner % 3);
                let along = c[3]
                    + if side == 0 {
                        Vec3::ZERO
                    } else {
                        c[3 + usize::from(side)]
                    };
                carry(self.node_normals[n], [c[1] + c[4] * end, c[2] + c[5] * end, along])
            };
        }
        for ((chunk, &owner), out) in self
            .chunks
            .iter()
            .zip(&self.owners)
            .zip(carried.as_chunks_mut::<LANES>().0)
        {
            if owner == NONE {
                *out = [Vec3::ZERO; LANES];
                continue;
            }
            let c = coefficients(&mesh.pentahedra[owner as usize], positions);
            // By component, as in `places`, so that eight normals are worked on at a time.
            let [a, b, t] = &chunk.place;
            let axis = |[p, q, r]: [usize; 3], x: &Lanes, y: &Lanes| -> [Lanes; 3] {
                std::array::from_fn(|n| std::array::from_fn(|l| c[p][n] + c[q][n] * x[l] + c[r][n] * y[l]))
            };
            let zero = [0.0; LANES];
            let along = [
                axis([1, 4, 4], t, &zero),
                axis([2, 5, 5], t, &zero),
                axis([3, 4, 5], a, b),
            ];
            let mut normal = [zero; 3];
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
            let [x, y, z] = &normal;
            let scale: Lanes = std::array::from_fn(|l| {
                let square = x[l] * x[l] + y[l] * y[l] + z[l] * z[l];
                if square > f32::MIN_POSITIVE {
                    1.0 / square.sqrt()
                } else {
                    0.0
                }
            });
            for (l, out) in out.iter_mut().enumerate() {
                *out = Vec3::new(x[l], y[l], z[l]) * scale[l];
            }
        }
    }

    /// Bytes that stand for vertices other than nodes.
    pub fn bytes(&self) -> usize {
        self.chunks.capacity() * size_of::<Chunk>()
            + 5 * self.owners.capacity()
            + 4 * self.free.capacity()
            + self.chunks.len() * LANES * (size_of::<Vec3>() + size_of::<SurfaceKind>() + size_of::<f32>())
    }
}

/// The shape functions' polynomial, see [`Shape`].
#[inline(always)]
fn coefficients(nodes: &[u32; 6], positions: &[Vec3]) -> [Vec3; 6] {
    let x = nodes.map(|node| positions[node as usize]);
    let (a, b) = (x[1] - x[0], x[2] - x[0]);
    [x[0], a, b, x[3] - x[0], x[4] - x[3] - a, x[5] - x[3] - b]
}

/// A normal from its products with the axes. The axes of a pentahedron that is not inverted are left-handed.
#[inline(always)]
fn carry(normal: [f32; 3], [a, b, t]: [Vec3; 3]) -> Vec3 {
    (t.cross(b) * normal[0] + a.cross(t) * normal[1] + b.cross(a) * normal[2]).normalize_or_zero()
}
