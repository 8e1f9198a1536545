//! The surface of what is kept inside touched pentahedra: a dual method ("surface nets") on the sub-prisms.
//!
//! Around every sub-lattice edge between a kept point `k` and a removed one `m` stands the polygon of the vertices of
//! the sub-prisms around it, counter-clockwise about the direction from `k` to `m`. Its sides join prisms that share a
//! face; a face has as many such edges in one sense as in the other, so every side has its opposite.
//!
//! An edge on the exposed surface has a fan of prisms between two exposed fine triangles. Its polygon begins and ends
//! in the rim vertices of these two, and the triangle of `k` and both rims closes it on the exposed surface. Where the
//! pentahedra at an edge form several fans, each is closed by itself: the two triangles belong together through the
//! tissue between them, never across a gap. What else is kept of an exposed fine triangle is the triangle itself, or,
//! of one with two kept corners, those two and its rim.

use resecta_anatomy::wedge;

use crate::crossings::fine_triangles;
use crate::mesh::Mesh;
use crate::points::Points;
use crate::sublattice::{Across, FACES, Sublattice};
use crate::surface::{NONE, Piece, Surface};

/// More sub-prisms than ever stand around an edge.
const MOST_AROUND: usize = 100_000;

const EDGES: usize = wedge::EDGES.len();

/// By two corners: the number of their edge, and the face whose outward cycle runs from the first to the second.
struct Corners {
    edge: [[u8; 6]; 6],
    left: [[u8; 6]; 6],
}

const CORNERS: Corners = {
    let mut corners = Corners {
        edge: [[0; 6]; 6],
        left: [[0; 6]; 6],
    };
    let mut n = 0;
    while n < EDGES {
        let [a, b] = wedge::EDGES[n];
        corners.edge[a][b] = n as u8;
        corners.edge[b][a] = n as u8;
        n += 1;
    }
    let mut face = 0;
    while face < FACES {
        let count = if face < 2 { 3 } else { 4 };
        let mut n = 0;
        while n < count {
            let (a, b) = if face < 2 {
                (wedge::TRIANGLES[face][n], wedge::TRIANGLES[face][(n + 1) % 3])
            } else {
                (wedge::QUADS[face - 2][n], wedge::QUADS[face - 2][(n + 1) % 4])
            };
            corners.left[a][b] = face as u8;
            n += 1;
        }
        face += 1;
    }
    corners
};

/// A sub-prism.
#[derive(Clone, Copy)]
struct At<'a> {
    pentahedron: u32,
    points: &'a [u32],
    piece: &'a Piece,
    prism: usize,
}

struct Extraction<'a, V> {
    mesh: &'a Mesh,
    sub: &'a Sublattice,
    points: &'a Points,
    surface: &'a Surface,
    value: V,
    dirty: &'a [u32],
    /// A bit for every edge of the dirty pentahedra's prisms whose polygon is done.
    done: Vec<u16>,
    /// Triangles and the pentahedra whose pieces they belong to.
    found: Vec<(u32, [u32; 3])>,
    polygon: Vec<u32>,
}

impl Surface {
    /// Makes anew the pieces of touched pentahedra (rising): all of which a point's value or coagulation changed, and
    /// all that were touched since.
    pub(crate) fn update(
        &mut self,
        mesh: &Mesh,
        sub: &Sublattice,
        points: &Points,
        value: impl Fn(u32) -> f32 + Copy,
        dirty: &[u32],
    ) {
        for &pentahedron in dirty {
            self.place_vertices(mesh, sub, points, value, pentahedron);
        }
        let mut extraction = Extraction {
            mesh,
            sub,
            points,
            surface: self,
            value,
            dirty,
            done: vec![0; dirty.len() * sub.prisms.len()],
            found: Vec::new(),
            polygon: Vec::new(),
        };
        extraction.run();
        let found = extraction.found;
        for &pentahedron in dirty {
            self.clear(pentahedron);
            if let Some(piece) = self.pieces.get_mut(&pentahedron) {
                self.vertices.release(&mut piece.chunks);
            }
        }
        for (pentahedron, triangle) in found {
            self.add(pentahedron, triangle);
        }
    }
}

impl<'a, V: Fn(u32) -> f32 + Copy> Extraction<'a, V> {
    fn run(&mut self) {
        for (place, &pentahedron) in self.dirty.iter().enumerate() {
            let Some(piece) = self.surface.pieces.get(&pentahedron) else {
                continue;
            };
            let points = self.points.of(pentahedron);
            let kept: Vec<bool> = points.iter().map(|&point| (self.value)(point) > 0.0).collect();
            for (prism, corners) in self.sub.prisms.iter().enumerate() {
                let at = At {
                    pentahedron,
                    points,
                    piece,
                    prism,
                };
                if piece.duals[prism] == NONE {
                    continue;
                }
                for (edge, [a, b]) in wedge::EDGES.into_iter().enumerate() {
                    let [a_kept, b_kept] = [a, b].map(|corner| kept[corners[corner] as usize]);
                    let done = self.done[place * self.sub.prisms.len() + prism] >> edge & 1 == 1;
                    if a_kept != b_kept && !done {
                        let [k, m] = if a_kept { [a, b] } else { [b, a] };
                        self.around(at, [k, m].map(|corner| points[corners[corner] as usize]));
                    }
                }
            }
            if !piece.rims.is_empty() {
                self.exposed(pentahedron, points, piece, &kept);
            }
        }
    }

    /// The polygon around an edge from a kept point to a removed one.
    fn around(&mut self, start: At<'a>, edge: [u32; 2]) {
        let [k, m] = edge;
        let mut owner = u32::MAX;
        let mut polygon = std::mem::take(&mut self.polygon);
        polygon.clear();
        // Clockwise first, to find where an open fan begins.
        let first = match self.walk(start, [m, k], |_, _, _| {}) {
            End::Closed => (start, None),
            End::Exposed(at, face) => (at, Some(self.rim(at, face, edge))),
        };
        polygon.extend(first.1);
        let end = self.walk_marking(first.0, edge, &mut polygon, &mut owner);
        if let End::Exposed(at, face) = end {
            polygon.push(self.rim(at, face, edge));
        }
        if self.dirty.binary_search(&owner).is_ok() {
            for n in 1..polygon.len().saturating_sub(1) {
                self.found.push((owner, [polygon[0], polygon[n], polygon[n + 1]]));
            }
            if let (Some(behind), Some(&kept), Some(&ahead)) =
                (first.1, self.surface.point_slots.get(&k), polygon.last())
            {
                self.found.push((owner, [kept, behind, ahead]));
            }
        }
        self.polygon = polygon;
    }

    fn walk_marking(&mut self, start: At<'a>, edge: [u32; 2], polygon: &mut Vec<u32>, owner: &mut u32) -> End<'a> {
        let prisms = self.sub.prisms.len();
        let mut done = std::mem::take(&mut self.done);
        let end = self.walk(start, edge, |at, a, b| {
            polygon.push(at.piece.duals[at.prism]);
            *owner = at.pentahedron.min(*owner);
            if let Ok(place) = self.dirty.binary_search(&at.pentahedron) {
                done[place * prisms + at.prism] |= 1 << CORNERS.edge[a][b];
            }
        });
        self.done = done;
        end
    }

    /// Goes from prism to prism counter-clockwise about an edge, until back at the start or at an exposed face. `visit`
    /// is given every prism and the edge's corners in it.
    fn walk(&self, start: At<'a>, [from, to]: [u32; 2], mut visit: impl FnMut(&At<'a>, usize, usize)) -> End<'a> {
        let mut at = start;
        for _ in 0..MOST_AROUND {
            let corner = |point: u32| {
                let corners = &self.sub.prisms[at.prism];
                corners
                    .iter()
                    .position(|&corner| at.points[corner as usize] == point)
                    .unwrap_or(0)
            };
            let (a, b) = (corner(from), corner(to));
            visit(&at, a, b);
            let face = usize::from(CORNERS.left[a][b]);
            let Some(next) = self.across(&at, face) else {
                return End::Exposed(at, face);
            };
            at = next;
            if at.prism == start.prism && at.pentahedron == start.pentahedron {
                break;
            }
        }
        End::Closed
    }

    fn across(&self, at: &At<'a>, face: usize) -> Option<At<'a>> {
        match self.sub.across[at.prism][face] {
            Across::Prism(prism) => Some(At { prism, ..*at }),
            Across::Boundary(cell) => {
                let (pentahedron, its_face, turn) = self.mesh.across(at.pentahedron, face)?;
                Some(At {
                    pentahedron,
                    points: self.points.of(pentahedron),
                    piece: self.surface.pieces.get(&pentahedron)?,
                    prism: self.sub.facing(&self.sub.boundary[cell], its_face, turn).prism,
                })
            }
        }
    }

    /// The rim vertex of the fine triangle of an exposed face that an edge belongs to.
    fn rim(&self, at: At, face: usize, edge: [u32; 2]) -> u32 {
        let Across::Boundary(cell) = self.sub.across[at.prism][face] else {
            return NONE;
        };
        let cell = &self.sub.boundary[cell];
        let (triangles, _) = fine_triangles(self.sub, cell, at.points);
        let has = |point: u32| triangles[0].iter().any(|&corner| at.points[corner as usize] == point);
        let half = usize::from(!(has(edge[0]) && has(edge[1])));
        at.piece.rims[cell.triangle + half]
    }

    /// What is kept of the exposed fine triangles themselves, and the diagonals between them.
    fn exposed(&mut self, pentahedron: u32, points: &[u32], piece: &Piece, kept: &[bool]) {
        let slot = |corner: u32| self.surface.point_slots.get(&points[corner as usize]).copied();
        for cell in &self.sub.boundary {
            if !self.mesh.is_exposed(pentahedron, cell.face) {
                continue;
            }
            let (triangles, count) = fine_triangles(self.sub, cell, points);
            for (n, triangle) in triangles[..count].iter().enumerate() {
                let is_kept = triangle.map(|corner| kept[corner as usize]);
                if is_kept == [true; 3] {
                    if let [Some(a), Some(b), Some(c)] = triangle.map(slot) {
                        self.found.push((pentahedron, [a, b, c]));
                    }
                    continue;
                }
                let rim = piece.rims[cell.triangle + n];
                for side in 0..3 {
                    let next = (side + 1) % 3;
                    if is_kept[side]
                        && is_kept[next]
                        && let (Some(a), Some(b)) = (slot(triangle[side]), slot(triangle[next]))
                    {
                        self.found.push((pentahedron, [a, b, rim]));
                    }
                }
            }
            if count == 2 {
                let [from, to] = [triangles[0][0], triangles[0][2]];
                let [from_kept, to_kept] = [from, to].map(|corner| kept[corner as usize]);
                if from_kept != to_kept {
                    // The second half runs from `from` to `to`, the first back.
                    let k = if from_kept { from } else { to };
                    let [behind, ahead] = if from_kept { [0, 1] } else { [1, 0] };
                    let [behind, ahead] = [behind, ahead].map(|half| piece.rims[cell.triangle + half]);
                    self.found.push((pentahedron, [behind, piece.duals[cell.prism], ahead]));
                    if let Some(k) = slot(k) {
                        self.found.push((pentahedron, [k, behind, ahead]));
                    }
                }
            }
        }
    }
}

/// Where a walk around an edge ends.
enum End<'a> {
    Closed,
    /// At a prism's face with nothing across.
    Exposed(At<'a>, usize),
}
