//! Exposed faces that nothing has touched: as they are, except beside finer ones.
//!
//! A touched pentahedron's exposed faces have the sub-lattice's points on their edges. A coarse face that shares such
//! an edge takes these points too and is fanned from its middle, so that no crack opens between the two.

use resecta_anatomy::wedge;

use crate::mesh::Mesh;
use crate::points::Points;
use crate::sublattice::{FACES, face_corners};
use crate::surface::{Coarse, NONE, Surface};
use crate::vertices::Vertex;

impl Surface {
    /// Makes anew the coarse pieces beside pentahedra that have just been touched.
    pub(crate) fn join_coarse(&mut self, mesh: &Mesh, points: &Points, fresh: &[u32]) {
        let mut beside = Vec::new();
        for &pentahedron in fresh {
            self.remove_centres(pentahedron);
            for face in (0..FACES).filter(|&face| mesh.is_exposed(pentahedron, face)) {
                for (from, to) in sides(&mesh.face_nodes(pentahedron, face)) {
                    beside.extend(mesh.exposed_at(from, to).map(|(other, _)| other));
                }
            }
        }
        beside.retain(|&pentahedron| !points.is_touched(pentahedron));
        beside.sort_unstable();
        beside.dedup();
        for pentahedron in beside {
            self.renew_coarse(mesh, points, pentahedron);
        }
    }

    fn remove_centres(&mut self, pentahedron: u32) {
        if let Some(mut coarse) = self.coarse.remove(&pentahedron) {
            coarse.centres.iter().for_each(|&centre| self.vertices.remove(centre));
            self.vertices.release(&mut coarse.chunks);
        }
    }

    fn renew_coarse(&mut self, mesh: &Mesh, points: &Points, pentahedron: u32) {
        self.drop_triangles(pentahedron, |_| true);
        self.remove_centres(pentahedron);
        let mut coarse = Coarse::default();
        let shape = mesh.rest_shape(pentahedron);
        for face in (0..FACES).filter(|&face| mesh.is_exposed(pentahedron, face)) {
            let outline = self.outline(mesh, points, pentahedron, face);
            if outline.len() == face_corners(face).len() {
                self.add_face(mesh, pentahedron, face);
                continue;
            }
            let place = middle(face);
            let normal = self.vertices.surface_normal(mesh, pentahedron, place);
            let axes = shape.jacobian(place.map(f64::from));
            let vertex = Vertex {
                place,
                normal: axes.map(|axis| axis.as_vec3().dot(normal)),
                kind: mesh.kind(pentahedron, face),
                coagulation: 0.0,
            };
            let centre = self.vertices.add(pentahedron, &mut coarse.chunks);
            self.vertices.set(centre, &vertex, &shape);
            coarse.centres.push(centre);
            for (from, to) in sides(&outline) {
                self.add(pentahedron, NONE, [centre, from, to]);
            }
        }
        self.coarse.insert(pentahedron, coarse);
    }

    /// The slots around a face: its nodes, and the points on those edges that a touched pentahedron's exposed face
    /// shares.
    fn outline(&self, mesh: &Mesh, points: &Points, pentahedron: u32, face: usize) -> Vec<u32> {
        let mut outline = Vec::new();
        let corners = face_corners(face);
        let nodes = &mesh.pentahedra[pentahedron as usize];
        for (from, to) in sides(corners) {
            outline.push(nodes[from]);
            if !mesh
                .exposed_at(nodes[from], nodes[to])
                .any(|(other, _)| points.is_touched(other))
            {
                continue;
            }
            let edge = wedge::EDGES
                .iter()
                .position(|ends| ends.contains(&from) && ends.contains(&to));
            let Some(edge) = edge else { continue };
            let divisions = mesh.sub(pentahedron).divisions.of(edge);
            let steps = 1..divisions;
            let is_forward = wedge::EDGES[edge][0] == from;
            let inside = steps
                .map(|step| if is_forward { step } else { divisions - step })
                .filter_map(|step| points.inside_edge(mesh, pentahedron, edge, step))
                .map(|point| self.point_slots[point as usize]);
            outline.extend(inside.filter(|&slot| slot != NONE));
        }
        outline
    }
}

fn sides<T: Copy>(cycle: &[T]) -> impl Iterator<Item = (T, T)> + '_ {
    cycle.iter().copied().zip(cycle.iter().copied().cycle().skip(1))
}

/// Local coordinates of the middle of a face.
fn middle(face: usize) -> [f32; 3] {
    let corners = face_corners(face);
    let mut sum = [0.0; 3];
    for corner in corners {
        let place = [
            f32::from(corner % 3 == 1),
            f32::from(corner % 3 == 2),
            (corner / 3) as f32,
        ];
        sum.iter_mut().zip(place).for_each(|(sum, value)| *sum += value);
    }
    sum.map(|sum| sum / corners.len() as f32)
}
