//! Exposed faces that nothing has touched: as they are, except beside finer ones.
//!
//! A touched pentahedron's exposed faces have the sub-lattice's points on their edges. A coarse face that shares such
//! an edge takes these points too and is fanned from its middle, so that no crack opens between the two.

use crate::mesh::Mesh;
use crate::points::Points;
use crate::sublattice::{FACES, Sublattice, face_corners};
use crate::surface::Surface;

impl Surface {
    /// Makes anew the coarse pieces beside pentahedra that have just been touched; returns their pentahedra, rising.
    pub(crate) fn join_coarse(&mut self, mesh: &Mesh, sub: &Sublattice, points: &Points, fresh: &[u32]) -> Vec<u32> {
        let mut beside = Vec::new();
        for &pentahedron in fresh {
            for face in (0..FACES).filter(|&face| mesh.is_exposed(pentahedron, face)) {
                for (from, to) in sides(&mesh.face_nodes(pentahedron, face)) {
                    beside.extend(mesh.exposed_at(from, to).map(|(other, _)| other));
                }
            }
        }
        beside.retain(|&pentahedron| points.cell(pentahedron).is_none());
        beside.sort_unstable();
        beside.dedup();
        for &pentahedron in &beside {
            self.renew_coarse(mesh, sub, points, pentahedron);
        }
        beside
    }

    fn renew_coarse(&mut self, mesh: &Mesh, sub: &Sublattice, points: &Points, pentahedron: u32) {
        self.clear(pentahedron);
        let mut piece = self.pieces.remove(&pentahedron).unwrap_or_default();
        for centre in piece.centres.drain(..) {
            self.vertices.remove(centre);
        }
        let shape = mesh.rest_shape(pentahedron);
        for face in (0..FACES).filter(|&face| mesh.is_exposed(pentahedron, face)) {
            let nodes = mesh.face_nodes(pentahedron, face);
            let outline = self.outline(mesh, sub, points, face, &nodes);
            if outline.len() == nodes.len() {
                self.add_face(pentahedron, &nodes);
                continue;
            }
            let centre = self.vertices.add(pentahedron, &mut piece.chunks);
            let kind = mesh.kind(pentahedron, face);
            self.vertices.set(centre, middle(face), &shape, kind, 0.0);
            piece.centres.push(centre);
            for (from, to) in sides(&outline) {
                self.add(pentahedron, [centre, from, to]);
            }
        }
        self.pieces.insert(pentahedron, piece);
    }

    /// The slots around a face: its nodes, and the points on those edges that a touched pentahedron's exposed face
    /// shares.
    fn outline(&self, mesh: &Mesh, sub: &Sublattice, points: &Points, face: usize, nodes: &[u32]) -> Vec<u32> {
        let mut outline = Vec::new();
        for (side, (from, to)) in sides(nodes).enumerate() {
            outline.push(from);
            if !mesh.exposed_at(from, to).any(|(other, _)| points.cell(other).is_some()) {
                continue;
            }
            // A quadrilateral's first and third side run along the axis.
            let divisions = if face >= 2 && side % 2 == 0 { sub.s } else { sub.r };
            let inside = (1..divisions).filter_map(|step| points.inside_edge(from, to, step, divisions));
            outline.extend(inside.filter_map(|point| self.point_slots.get(&point)));
        }
        outline
    }
}

fn sides(cycle: &[u32]) -> impl Iterator<Item = (u32, u32)> + '_ {
    cycle.iter().copied().zip(cycle.iter().copied().cycle().skip(1))
}

/// Local coordinates of the middle of a face.
fn middle(face: usize) -> [f64; 3] {
    let corners = face_corners(face);
    let mut sum = [0.0; 3];
    for corner in corners {
        let place = [
            f64::from(corner % 3 == 1),
            f64::from(corner % 3 == 2),
            (corner / 3) as f64,
        ];
        sum.iter_mut().zip(place).for_each(|(sum, value)| *sum += value);
    }
    sum.map(|sum| sum / corners.len() as f64)
}
