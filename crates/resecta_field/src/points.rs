//! The points of the sub-lattices, numbered over the whole mesh, and the values on them.
//!
//! A point belongs to the node, edge, face or interior that it lies in, so all pentahedra around name the same point
//! and neighbours always agree. Numbers are given when a pentahedron is first touched: the values of all points stand
//! in one array, without holes, and what nothing touched has none.

use resecta_anatomy::wedge;

use crate::lookup::Lookup;
use crate::mesh::{Mesh, edge, face_key};
use crate::sublattice::{FACES, Sublattice, face_corners};
use crate::volume;

const NONE: u32 = u32::MAX;

/// A touched pentahedron.
#[derive(Debug, Clone)]
pub struct Cell {
    /// Numbers of its points, in the order of [`Sublattice::steps`].
    pub points: Box<[u32]>,
    /// Sum of its tetrahedra's volumes at rest, mm³: what shares of it are taken of.
    pub tetrahedra_mm3: f64,
    /// Rest volume still there, mm³.
    pub kept_mm3: f64,
}

#[derive(Debug, Clone, Default)]
pub struct Points {
    /// Signed distance to what has been cut, mm, by point; positive where tissue is kept.
    pub values: Vec<f32>,
    /// How deep inside coagulated tissue a point lies, mm, 0 outside; empty until something coagulates.
    pub coagulation: Vec<f32>,
    /// When a point was last looked at: twice the number of the edit, one more if the edit changed it.
    pub marks: Vec<u32>,
    /// Number of the point at every node; empty until something is touched.
    nodes: Vec<u32>,
    /// First point inside an edge, counted from its smaller node, and inside a face.
    edges: Lookup<[u32; 2], u32>,
    faces: Lookup<[u32; 4], u32>,
    /// Index of every pentahedron's cell; empty until something is touched.
    cell_of: Vec<u32>,
    cells: Vec<Cell>,
}

impl Points {
    pub fn cell(&self, pentahedron: u32) -> Option<&Cell> {
        let index = *self.cell_of.get(pentahedron as usize)?;
        self.cells.get(index as usize)
    }

    pub fn cell_and_values(&mut self, pentahedron: u32) -> Option<(&mut Cell, &[f32])> {
        let index = *self.cell_of.get(pentahedron as usize)?;
        let cell = self.cells.get_mut(index as usize)?;
        Some((cell, &self.values))
    }

    /// Numbers of the points of a pentahedron; empty if untouched.
    pub fn of(&self, pentahedron: u32) -> &[u32] {
        self.cell(pentahedron).map_or(&[], |cell| &cell.points)
    }

    /// Gives a pentahedron points, new ones with the value `band`. Nothing happens if it has them.
    pub fn touch(&mut self, mesh: &Mesh, sub: &Sublattice, pentahedron: u32, band: f32) {
        if self.cell(pentahedron).is_some() {
            return;
        }
        if self.cell_of.is_empty() {
            self.cell_of = vec![NONE; mesh.pentahedra.len()];
            self.nodes = vec![NONE; mesh.rest.len()];
        }
        let points = self.number(&mesh.pentahedra[pentahedron as usize], sub);
        self.cell_of[pentahedron as usize] = self.cells.len() as u32;
        self.values.resize(self.marks.len(), band);
        if !self.coagulation.is_empty() {
            self.coagulation.resize(self.marks.len(), 0.0);
        }
        self.cells.push(Cell {
            tetrahedra_mm3: volume::tetrahedra_mm3(mesh, sub, pentahedron, &points),
            points,
            kept_mm3: mesh.rest_volumes[pentahedron as usize],
        });
    }

    /// Point inside the edge between two nodes, by its steps from `from`, of `divisions`; none if nothing touched the
    /// edge.
    pub fn inside_edge(&self, from: u32, to: u32, step: usize, divisions: usize) -> Option<u32> {
        let first = self.edges.get(&edge(from, to))?;
        let steps = if from < to { step } else { divisions - step };
        Some(first + steps as u32 - 1)
    }

    fn number(&mut self, nodes: &[u32; 6], sub: &Sublattice) -> Box<[u32]> {
        let (r, s) = (sub.r, sub.s);
        let new = |marks: &mut Vec<u32>, count: usize| {
            marks.resize(marks.len() + count, 0);
            (marks.len() - count) as u32
        };
        let corners = nodes.map(|node| {
            let number = &mut self.nodes[node as usize];
            if *number == NONE {
                *number = new(&mut self.marks, 1);
            }
            *number
        });
        let edges: [u32; 9] = std::array::from_fn(|n| {
            let [a, b] = wedge::EDGES[n].map(|end| nodes[end]);
            let count = if n < 6 { r } else { s } - 1;
            *self
                .edges
                .entry(edge(a, b))
                .or_insert_with(|| new(&mut self.marks, count))
        });
        let faces: [u32; FACES] = std::array::from_fn(|face| {
            let corners = face_corners(face)
                .iter()
                .map(|&corner| nodes[corner])
                .collect::<Vec<_>>();
            let count = if face < 2 {
                (r - 1) * r.saturating_sub(2) / 2
            } else {
                (r - 1) * (s - 1)
            };
            *self
                .faces
                .entry(face_key(&corners))
                .or_insert_with(|| new(&mut self.marks, count))
        });
        let count = (r - 1) * r.saturating_sub(2) / 2 * (s - 1);
        let mut interior = new(&mut self.marks, count);
        (0..sub.steps.len())
            .map(|point| match place(sub, point) {
                Place::Node(corner) => corners[corner],
                Place::Edge(n, step) => {
                    let [a, b] = wedge::EDGES[n].map(|end| nodes[end]);
                    let divisions = if n < 6 { r } else { s };
                    edges[n] + if a < b { step } else { divisions - step } as u32 - 1
                }
                Place::Triangle(face) => faces[face] + in_triangle(sub, point, face, nodes),
                Place::Quad(face) => faces[face] + in_quad(sub, point, face, nodes),
                Place::Interior => {
                    interior += 1;
                    interior - 1
                }
            })
            .collect()
    }

    /// Bytes held.
    pub fn bytes(&self) -> usize {
        let points = self.cells.iter().map(|cell| size_of_val(&*cell.points)).sum::<usize>();
        points
            + 4 * (self.values.capacity() + self.coagulation.capacity() + self.marks.capacity())
            + 4 * (self.nodes.capacity() + self.cell_of.capacity())
            + self.edges.capacity() * size_of::<([u32; 2], u32)>()
            + self.faces.capacity() * size_of::<([u32; 4], u32)>()
            + self.cells.capacity() * size_of::<Cell>()
    }
}

/// The part of a pentahedron that a point lies in; faces and edges by their local numbers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Place {
    Node(usize),
    /// With the steps from the edge's first corner.
    Edge(usize, usize),
    Triangle(usize),
    Quad(usize),
    Interior,
}

impl Place {
    /// The local corners that the part joins.
    pub fn corners(self) -> Vec<usize> {
        match self {
            Place::Node(corner) => vec![corner],
            Place::Edge(n, _) => wedge::EDGES[n].to_vec(),
            Place::Triangle(face) | Place::Quad(face) => face_corners(face).to_vec(),
            Place::Interior => (0..6).collect(),
        }
    }
}

pub fn place(sub: &Sublattice, point: usize) -> Place {
    let towards: [usize; 3] = std::array::from_fn(|corner| sub.towards(point, corner));
    let k = sub.steps[point][2];
    let end = if k == 0 { Some(0) } else { (k == sub.s).then_some(1) };
    let zero = |corner: usize| towards[corner] == 0;
    let whole = (0..3).find(|&corner| towards[corner] == sub.r);
    let side = (0..3).find(|&side| zero((side + 2) % 3));
    match (end, whole, side) {
        (Some(end), Some(corner), _) => Place::Node(corner + 3 * end),
        (None, Some(corner), _) => Place::Edge(6 + corner, k),
        // Side n of the triangle joins the corners n and n + 1.
        (Some(end), None, Some(side)) => Place::Edge(side + 3 * end, towards[(side + 1) % 3]),
        (None, None, Some(side)) => Place::Quad(2 + side),
        (Some(end), None, None) => Place::Triangle(end),
        (None, None, None) => Place::Interior,
    }
}

/// Index of a point inside a triangular face: the steps towards its nodes in rising order name it.
fn in_triangle(sub: &Sublattice, point: usize, face: usize, nodes: &[u32; 6]) -> u32 {
    let mut corners = [0, 1, 2];
    corners.sort_unstable_by_key(|&corner| nodes[corner + 3 * face]);
    let [_, i, j] = corners.map(|corner| sub.towards(point, corner) - 1);
    // Rows of an inner triangle of r - 3 divisions.
    let row = j * (sub.r - 2) - j * j.saturating_sub(1) / 2;
    (row + i) as u32
}

/// Index of a point inside a quadrilateral face: steps from its smallest node, first towards the smaller of the two
/// nodes beside it.
fn in_quad(sub: &Sublattice, point: usize, face: usize, nodes: &[u32; 6]) -> u32 {
    let corners = face_corners(face);
    let (r, s) = (sub.r, sub.s);
    // In the face's own frame: u from corner 0 to 3, v from corner 0 to 1.
    let (u, v) = (sub.towards(point, corners[3] % 3), sub.steps[point][2]);
    let node = |corner: usize| nodes[corners[corner % 4]];
    let smallest = (0..4).min_by_key(|&corner| node(corner)).unwrap_or(0);
    let from_u = if smallest == 0 || smallest == 1 { u } else { r - u };
    let from_v = if smallest == 0 || smallest == 3 { v } else { s - v };
    // Corners 0 and 1, 2 and 3 are joined along v.
    let beside_along_v = node(smallest ^ 1);
    let beside_along_u = node(3 - smallest);
    let (x, y, length) = if beside_along_u < beside_along_v {
        (from_u, from_v, r)
    } else {
        (from_v, from_u, s)
    };
    ((y - 1) * (length - 1) + x - 1) as u32
}
