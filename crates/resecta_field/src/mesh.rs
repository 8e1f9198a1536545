//! The mesh that the field lives on: which pentahedra meet in a face, at a node, and at an edge of the exposed surface.

use std::sync::Arc;

use glam::{DVec3, Vec3};
use resecta_anatomy::wedge;

use crate::FieldError;
use crate::divide::{Divided, Tables};
use crate::lookup::Lookup;
use crate::shape::{Carrier, Shape};
use crate::sublattice::{FACES, Sublattice, face_corners};
use crate::surface::SurfaceKind;

const NONE: u32 = u32::MAX;

/// Fixed after construction: cuts are values on points, so no face becomes exposed by them.
#[derive(Debug, Clone)]
pub struct Mesh {
    pub rest: Vec<DVec3>,
    /// Nodes of the pentahedra, not in the order given (see `divide.rs`).
    pub pentahedra: Vec<[u32; 6]>,
    /// Which of the given corners every corner is.
    pub orders: Arc<[[u8; 6]]>,
    /// Numbers of their edges and faces.
    pub edges: Vec<[u32; 9]>,
    pub edge_count: usize,
    pub faces: Vec<[u32; FACES]>,
    pub face_count: usize,
    tables: Tables,
    pub rest_volumes: Vec<f64>,
    /// By `pentahedron * FACES + face`: the same of the face on the other side, or `NONE` where exposed.
    across: Vec<u32>,
    /// Which corner of the other face is this face's corner 0.
    turns: Vec<u8>,
    /// Kind of every face; matters where exposed.
    kinds: Vec<SurfaceKind>,
    /// The pentahedra around node `n` are `around[starts[n]..starts[n + 1]]`, rising.
    starts: Vec<u32>,
    around: Vec<u32>,
    /// Exposed faces at every edge of the exposed surface.
    exposed_at: Lookup<[u32; 2], Vec<u32>>,
}

impl Mesh {
    pub fn new(
        rest: &[DVec3],
        pentahedra: &[[u32; 6]],
        spacing_mm: f64,
        kind: impl Fn(u32, usize) -> SurfaceKind,
    ) -> Result<Self, FieldError> {
        if pentahedra.is_empty() {
            return Err(FieldError::Empty);
        }
        if let Some(node) = rest.iter().position(|position| !position.is_finite()) {
            return Err(FieldError::Position(node));
        }
        let mut rest_volumes = Vec::with_capacity(pentahedra.len());
        for (index, nodes) in pentahedra.iter().enumerate() {
            if let Some(&node) = nodes.iter().find(|&&node| node as usize >= rest.len()) {
                return Err(FieldError::NoSuchNode {
                    pentahedron: index,
                    node,
                    count: rest.len(),
                });
            }
            if (1..6).any(|n| nodes[..n].contains(&nodes[n])) {
                return Err(FieldError::Repeated(index));
            }
            let volume_mm3 = wedge::volume(nodes, |node| rest[node as usize]);
            if volume_mm3.is_nan() || volume_mm3 <= 0.0 {
                return Err(FieldError::Inverted { index, volume_mm3 });
            }
            rest_volumes.push(volume_mm3);
        }
        let divided = Divided::new(rest, pentahedra, spacing_mm)?;
        let kinds = (0..pentahedra.len() * FACES)
            .map(|id| ((id / FACES) as u32, id % FACES))
            .map(|(pentahedron, face)| kind(pentahedron, divided.given_face(pentahedron, face)))
            .collect();
        let (starts, around) = around_nodes(pentahedra, rest.len());
        let mut mesh = Self {
            rest: rest.to_vec(),
            pentahedra: divided.pentahedra,
            orders: divided.orders.into(),
            edges: divided.edges,
            edge_count: divided.edge_count,
            faces: vec![[0; FACES]; pentahedra.len()],
            face_count: 0,
            tables: divided.tables,
            rest_volumes,
            across: vec![NONE; pentahedra.len() * FACES],
            turns: vec![0; pentahedra.len() * FACES],
            kinds,
            starts,
            around,
            exposed_at: Lookup::default(),
        };
        mesh.join()?;
        for (pentahedron, face) in mesh.exposed_faces() {
            let nodes = mesh.face_nodes(pentahedron, face);
            for (&from, &to) in nodes.iter().zip(nodes.iter().cycle().skip(1)) {
                let id = pentahedron * FACES as u32 + face as u32;
                mesh.exposed_at.entry(edge(from, to)).or_default().push(id);
            }
        }
        Ok(mesh)
    }

    fn join(&mut self) -> Result<(), FieldError> {
        let mut open: Lookup<[u32; 4], usize> = Lookup::default();
        for id in 0..self.across.len() {
            let (pentahedron, face) = (id / FACES, id % FACES);
            let nodes = self.face_nodes(pentahedron as u32, face);
            let Some(&other) = open.get(&face_key(&nodes)) else {
                open.insert(face_key(&nodes), id);
                self.faces[pentahedron][face] = self.face_count as u32;
                self.face_count += 1;
                continue;
            };
            let theirs = self.face_nodes((other / FACES) as u32, other % FACES);
            let count = nodes.len();
            let turn = |a: &[u32], b: &[u32]| b.iter().position(|&node| node == a[0]).unwrap_or(0);
            let there = turn(&nodes, &theirs);
            let opposite = (0..count).all(|m| theirs[(there + count - m) % count] == nodes[m]);
            if self.across[other] != NONE || !opposite {
                return Err(FieldError::NotManifold(pentahedron));
            }
            self.faces[pentahedron][face] = self.faces[other / FACES][other % FACES];
            (self.across[id], self.across[other]) = (other as u32, id as u32);
            (self.turns[id], self.turns[other]) = (there as u8, turn(&theirs, &nodes) as u8);
        }
        Ok(())
    }

    /// How a pentahedron is divided.
    pub fn sub(&self, pentahedron: u32) -> &Sublattice {
        self.tables.of(pentahedron)
    }

    /// Nodes of a face in outward cyclic order.
    pub fn face_nodes(&self, pentahedron: u32, face: usize) -> Vec<u32> {
        let nodes = &self.pentahedra[pentahedron as usize];
        face_corners(face).iter().map(|&corner| nodes[corner]).collect()
    }

    /// The triangles of a face.
    pub fn face_triangles(&self, pentahedron: u32, face: usize) -> Vec<[u32; 3]> {
        match *self.face_nodes(pentahedron, face) {
            [a, b, c, d] => wedge::split_quad([a, b, c, d]).to_vec(),
            [a, b, c] => vec![[a, b, c]],
            _ => Vec::new(),
        }
    }

    /// The pentahedron across a face, its face, and the turn between the two (see `Sublattice::facing`).
    pub fn across(&self, pentahedron: u32, face: usize) -> Option<(u32, usize, usize)> {
        let id = pentahedron as usize * FACES + face;
        let other = self.across[id];
        (other != NONE).then(|| {
            let (pentahedron, face) = (other / FACES as u32, other as usize % FACES);
            (pentahedron, face, usize::from(self.turns[id]))
        })
    }

    pub fn is_exposed(&self, pentahedron: u32, face: usize) -> bool {
        self.across[pentahedron as usize * FACES + face] == NONE
    }

    pub fn exposed_faces(&self) -> Vec<(u32, usize)> {
        (0..self.across.len())
            .filter(|&id| self.across[id] == NONE)
            .map(|id| ((id / FACES) as u32, id % FACES))
            .collect()
    }

    /// Exposed faces at an edge, as pentahedron and face.
    pub fn exposed_at(&self, from: u32, to: u32) -> impl Iterator<Item = (u32, usize)> + '_ {
        let faces = self.exposed_at.get(&edge(from, to)).map_or(&[][..], Vec::as_slice);
        faces.iter().map(|&id| (id / FACES as u32, id as usize % FACES))
    }

    pub fn kind(&self, pentahedron: u32, face: usize) -> SurfaceKind {
        self.kinds[pentahedron as usize * FACES + face]
    }

    /// Pentahedra around a node, rising.
    pub fn around(&self, node: u32) -> &[u32] {
        let node = node as usize;
        &self.around[self.starts[node] as usize..self.starts[node + 1] as usize]
    }

    /// Those given and all that share a node with them, rising.
    pub fn ring(&self, pentahedra: &[u32]) -> Vec<u32> {
        let mut ring: Vec<u32> = (pentahedra.iter())
            .flat_map(|&pentahedron| self.pentahedra[pentahedron as usize])
            .collect();
        ring.sort_unstable();
        ring.dedup();
        ring = ring
            .into_iter()
            .flat_map(|node| self.around(node).iter().copied())
            .collect();
        ring.sort_unstable();
        ring.dedup();
        ring
    }

    pub fn rest_shape(&self, pentahedron: u32) -> Shape {
        Shape::new(self.pentahedra[pentahedron as usize].map(|node| self.rest[node as usize]))
    }

    pub fn shape(&self, pentahedron: u32, positions: &[Vec3]) -> Shape {
        Shape::new(self.pentahedra[pentahedron as usize].map(|node| positions[node as usize].as_dvec3()))
    }

    #[inline(always)]
    pub fn carrier(&self, pentahedron: u32, position: impl Fn(u32) -> Vec3) -> Carrier {
        // Written out: `map` is not inlined here, and this is where most surface vertices are.
        let [a, b, c, d, e, f] = self.pentahedra[pentahedron as usize];
        Carrier::new([
            position(a),
            position(b),
            position(c),
            position(d),
            position(e),
            position(f),
        ])
    }

    /// Refuses positions that are not one finite place a node.
    pub fn check(&self, positions: &[Vec3]) -> Result<(), FieldError> {
        if positions.len() != self.rest.len() {
            return Err(FieldError::PositionCount {
                given: positions.len(),
                expected: self.rest.len(),
            });
        }
        match positions.iter().position(|position| !position.is_finite()) {
            Some(node) => Err(FieldError::Position(node)),
            None => Ok(()),
        }
    }

    /// Refuses an index that names no pentahedron.
    pub fn check_pentahedron(&self, index: u32) -> Result<(), FieldError> {
        if (index as usize) < self.pentahedra.len() {
            return Ok(());
        }
        Err(FieldError::NoSuchPentahedron {
            index,
            count: self.pentahedra.len(),
        })
    }
}

/// An edge by its nodes, rising.
pub fn edge(a: u32, b: u32) -> [u32; 2] {
    [a.min(b), a.max(b)]
}

/// A face by its nodes, rising; a triangle ends in `NONE`.
pub fn face_key(nodes: &[u32]) -> [u32; 4] {
    let mut key = [NONE; 4];
    key[..nodes.len()].copy_from_slice(nodes);
    key.sort_unstable();
    key
}

fn around_nodes(pentahedra: &[[u32; 6]], nodes: usize) -> (Vec<u32>, Vec<u32>) {
    let mut starts = vec![0; nodes + 1];
    for &node in pentahedra.iter().flatten() {
        starts[node as usize + 1] += 1;
    }
    for node in 0..nodes {
        starts[node + 1] += starts[node];
    }
    let mut next = starts.clone();
    let mut around = vec![0; pentahedra.len() * 6];
    for (pentahedron, corners) in pentahedra.iter().enumerate() {
        for &node in corners {
            around[next[node as usize] as usize] = pentahedron as u32;
            next[node as usize] += 1;
        }
    }
    (starts, around)
}
