//! Where the surface's vertices lie: in the middle of the places where the value changes its sign.
//!
//! One vertex in every sub-prism with a change of sign, and one in every exposed fine triangle with one: the rim of the
//! cut. Each is a mean of places on edges, so it lies inside. Kept points of the exposed surface are vertices too.

use resecta_anatomy::wedge;

use crate::mesh::Mesh;
use crate::points::Points;
use crate::sublattice::{BoundaryCell, FACES, Sublattice, face_corners};
use crate::surface::{NONE, Piece, Surface, SurfaceKind};

/// Edges of a triangle.
const SIDES: [[usize; 2]; 3] = [[0, 1], [1, 2], [2, 0]];

/// The fine triangles of a cell on the boundary, as local points, outward. Quadrilaterals are cut as the tetrahedra
/// are: through the smallest number.
pub fn fine_triangles(sub: &Sublattice, cell: &BoundaryCell, points: &[u32]) -> ([[u32; 3]; 2], usize) {
    let prism = &sub.prisms[cell.prism];
    let corners = face_corners(cell.face);
    let at = |n: usize| prism[corners[n]];
    if cell.face < 2 {
        return ([[at(0), at(1), at(2)]; 2], 1);
    }
    let smallest = (0..4).min_by_key(|&n| points[at(n) as usize]).unwrap_or(0);
    let turned = |n: usize| at((smallest + n) % 4);
    (
        [[turned(0), turned(1), turned(2)], [turned(0), turned(2), turned(3)]],
        2,
    )
}

/// A pentahedron's values, by local point.
struct Local<'a> {
    sub: &'a Sublattice,
    values: Vec<f32>,
    coagulation: Vec<f32>,
}

impl Local<'_> {
    /// Whether the sign changes among these points.
    fn is_mixed(&self, points: &[u32]) -> bool {
        let kept = points
            .iter()
            .filter(|&&point| self.values[point as usize] > 0.0)
            .count();
        kept > 0 && kept < points.len()
    }

    /// Mean place, and mean depth of coagulation, of the changes of sign on the edges.
    fn crossing(&self, points: &[u32], edges: &[[usize; 2]]) -> ([f64; 3], f32) {
        let (mut place, mut depth, mut count) = ([0.0; 3], 0.0, 0.0);
        for [a, b] in edges.iter().map(|ends| ends.map(|end| points[end] as usize)) {
            let [from, to] = [self.values[a], self.values[b]];
            if (from > 0.0) == (to > 0.0) {
                continue;
            }
            let share = f64::from(from) / (f64::from(from) - f64::from(to));
            for (sum, (start, end)) in place.iter_mut().zip(self.sub.places[a].iter().zip(self.sub.places[b])) {
                *sum += start + (end - start) * share;
            }
            if !self.coagulation.is_empty() {
                depth += self.coagulation[a] + (self.coagulation[b] - self.coagulation[a]) * share as f32;
            }
            count += 1.0;
        }
        (place.map(|sum| sum / count), depth / count as f32)
    }
}

impl Surface {
    /// Puts a touched pentahedron's vertices where its values want them.
    pub(crate) fn place_vertices(
        &mut self,
        mesh: &Mesh,
        sub: &Sublattice,
        points: &Points,
        value: impl Fn(u32) -> f32,
        pentahedron: u32,
    ) {
        let mut piece = self.pieces.remove(&pentahedron).unwrap_or_default();
        for centre in piece.centres.drain(..) {
            self.vertices.remove(centre);
        }
        let exposed: [bool; FACES] = std::array::from_fn(|face| mesh.is_exposed(pentahedron, face));
        if piece.duals.is_empty() {
            piece.duals = vec![NONE; sub.prisms.len()].into();
            let rims = if exposed.contains(&true) {
                sub.boundary_triangles
            } else {
                0
            };
            piece.rims = vec![NONE; rims].into();
        }
        let ids = points.of(pentahedron);
        let coagulation = &points.coagulation;
        let local = Local {
            sub,
            values: ids.iter().map(|&point| value(point)).collect(),
            coagulation: if coagulation.is_empty() {
                Vec::new()
            } else {
                ids.iter().map(|&point| coagulation[point as usize]).collect()
            },
        };
        let shape = mesh.rest_shape(pentahedron);
        let Piece {
            duals, rims, chunks, ..
        } = &mut piece;
        let mut put =
            |vertices: &mut crate::vertices::Vertices, slot: &mut u32, crossing: Option<([f64; 3], f32)>, kind| {
                match crossing {
                    Some((place, depth)) => {
                        if *slot == NONE {
                            *slot = vertices.add(pentahedron, chunks);
                        }
                        vertices.set(*slot, place, &shape, kind, depth);
                    }
                    None if *slot != NONE => vertices.remove(std::mem::replace(slot, NONE)),
                    None => {}
                }
            };
        for (prism, slot) in sub.prisms.iter().zip(duals.iter_mut()) {
            let crossing = local.is_mixed(prism).then(|| local.crossing(prism, &wedge::EDGES));
            put(&mut self.vertices, slot, crossing, SurfaceKind::Cut);
        }
        for cell in sub.boundary.iter().filter(|cell| exposed[cell.face]) {
            let kind = mesh.kind(pentahedron, cell.face);
            let (triangles, count) = fine_triangles(sub, cell, ids);
            for (n, triangle) in triangles[..count].iter().enumerate() {
                let crossing = local.is_mixed(triangle).then(|| local.crossing(triangle, &SIDES));
                put(&mut self.vertices, &mut rims[cell.triangle + n], crossing, kind);
            }
            for &corner in triangles[..count].iter().flatten() {
                let id = ids[corner as usize];
                if local.values[corner as usize] <= 0.0 {
                    if let Some(slot) = self.point_slots.remove(&id)
                        && !self.vertices.is_node(slot)
                    {
                        self.vertices.remove(slot);
                    }
                    continue;
                }
                let depth = local.coagulation.get(corner as usize).copied().unwrap_or(0.0);
                let at_node = sub.corners.iter().position(|&point| point == corner);
                if let Some(node) = at_node.map(|node| mesh.pentahedra[pentahedron as usize][node]) {
                    self.point_slots.insert(id, node);
                    self.vertices.coagulation[node as usize] = depth;
                    continue;
                }
                let mut kind = kind;
                let slot = match self.point_slots.get(&id) {
                    Some(&slot) => {
                        kind = kind.min(self.vertices.kinds[slot as usize]);
                        self.vertices.coagulation[slot as usize] = depth;
                        self.vertices.kinds[slot as usize] = kind;
                        continue;
                    }
                    None => NONE,
                };
                let mut slot = slot;
                put(
                    &mut self.vertices,
                    &mut slot,
                    Some((sub.places[corner as usize], depth)),
                    kind,
                );
                self.point_slots.insert(id, slot);
            }
        }
        self.pieces.insert(pentahedron, piece);
    }
}
