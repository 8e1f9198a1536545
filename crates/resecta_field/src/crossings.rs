//! Where the surface's vertices lie: in the middle of the places where the value changes its sign.
//!
//! One vertex in every sub-prism with a change of sign, and one in every exposed fine triangle with one: the rim of the
//! cut. Each is a mean of places on edges, so it lies inside. Kept points of the exposed surface are vertices too.
//!
//! A normal in a cut is the value's gradient, which a prism's corners give in local coordinates: all that is needed to
//! carry it. One on the former surface is the mean of its nodes' normals, as on faces that nothing touched; on a rim it
//! is the mean of the two.

use resecta_anatomy::wedge;

use crate::mesh::Mesh;
use crate::points::Points;
use crate::shape::Shape;
use crate::sublattice::{BoundaryCell, FACES, Place, Sublattice, face_corners};
use crate::surface::{NONE, Piece, Surface, SurfaceKind};
use crate::vertices::{Vertex, Vertices};

/// Edges of a triangle.
const SIDES: [[usize; 2]; 3] = [[0, 1], [1, 2], [2, 0]];

/// What an update is given of a point.
#[derive(Debug, Clone, Copy)]
pub struct Sample {
    pub value: f32,
    /// Whether it was changed since the last update, and whether it was removed.
    pub is_changed: bool,
    pub is_turned: bool,
}

/// The fine triangles of a cell on the boundary, as local points, outward. Quadrilaterals are cut as the tetrahedra
/// are: through the smallest number.
pub fn fine_triangles(sub: &Sublattice, cell: &BoundaryCell, points: &[u32]) -> ([[u32; 3]; 2], usize) {
    let prism = sub.prism(cell.prism());
    let corners = face_corners(cell.face());
    let at = |n: usize| prism[corners[n]];
    if cell.face() < 2 {
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
    values: &'a [f32],
    is_changed: &'a [bool],
    /// Empty where nothing coagulated.
    coagulation: &'a [f32],
}

/// Room for one pentahedron's values after the other.
#[derive(Debug, Default)]
pub struct Gathered {
    values: Vec<f32>,
    is_changed: Vec<bool>,
    coagulation: Vec<f32>,
}

impl Gathered {
    fn fill(&mut self, points: &Points, sample: impl Fn(u32) -> Sample, ids: &[u32], is_new: bool) {
        self.values.clear();
        self.is_changed.clear();
        for &point in ids {
            let sample = sample(point);
            self.values.push(sample.value);
            self.is_changed.push(is_new || sample.is_changed);
        }
        self.coagulation.clear();
        if !points.coagulation.is_empty() {
            self.coagulation
                .extend(ids.iter().map(|&point| points.coagulation[point as usize]));
        }
    }
}

impl Local<'_> {
    fn is_changed(&self, points: &[u32]) -> bool {
        points
            .iter()
            .fold(false, |any, &point| any | self.is_changed[point as usize])
    }

    fn value(&self, point: u32) -> f32 {
        self.values[point as usize]
    }

    /// Whether the sign changes among these points.
    fn is_mixed(&self, points: &[u32]) -> bool {
        let positive = (points.iter()).fold(0, |count, &point| count + usize::from(self.value(point) > 0.0));
        positive > 0 && positive < points.len()
    }

    fn place(&self, point: u32) -> [f32; 3] {
        self.sub.near_place(point as usize)
    }

    fn depth(&self, point: u32) -> f32 {
        self.coagulation.get(point as usize).copied().unwrap_or(0.0)
    }

    /// Mean place, and mean depth of coagulation, of the changes of sign on the edges.
    fn crossing(&self, points: &[u32], edges: &[[usize; 2]]) -> ([f32; 3], f32) {
        let (mut place, mut depth, mut count) = ([0.0; 3], 0.0, 0.0);
        for &[a, b] in edges {
            let (a, b) = (points[a], points[b]);
            let [from, to] = [self.value(a), self.value(b)];
            if (from > 0.0) == (to > 0.0) {
                continue;
            }
            let share = from / (from - to);
            let (start, end) = (self.place(a), self.place(b));
            for axis in 0..3 {
                place[axis] += start[axis] + (end[axis] - start[axis]) * share;
            }
            if !self.coagulation.is_empty() {
                depth += self.depth(a) + (self.depth(b) - self.depth(a)) * share;
            }
            count += 1.0;
        }
        (place.map(|sum| sum / count), depth / count)
    }

    /// How steeply the value falls along the local coordinates.
    fn fall(&self, prism: &[u32; 6]) -> [f32; 3] {
        let mut v = [0.0; 6];
        for (value, &point) in v.iter_mut().zip(prism) {
            *value = self.value(point);
        }
        let p = [
            self.place(prism[0]),
            self.place(prism[1]),
            self.place(prism[2]),
            self.place(prism[3]),
        ];
        let [ax, ay] = [p[1][0] - p[0][0], p[1][1] - p[0][1]];
        let [bx, by] = [p[2][0] - p[0][0], p[2][1] - p[0][1]];
        let rise = |corner: usize| 0.5 * (v[corner] - v[0] + v[corner + 3] - v[3]);
        let (a, b) = (rise(1), rise(2));
        let area = ax * by - ay * bx;
        let along = (v[3] + v[4] + v[5] - v[0] - v[1] - v[2]) / (3.0 * (p[3][2] - p[0][2]));
        [(b * ay - a * by) / area, (a * bx - b * ax) / area, -along]
    }
}

impl Surface {
    /// Puts a touched pentahedron's vertices where its values want them.
    pub(crate) fn place_vertices(
        &mut self,
        mesh: &Mesh,
        points: &Points,
        sample: impl Fn(u32) -> Sample,
        gathered: &mut Gathered,
        pentahedron: u32,
    ) {
        let Some(index) = points.index(pentahedron) else {
            return;
        };
        let sub = mesh.sub(pentahedron);
        let mut piece = std::mem::take(&mut self.pieces[index]);
        let exposed: [bool; FACES] = std::array::from_fn(|face| mesh.is_exposed(pentahedron, face));
        let is_exposed = exposed.contains(&true);
        let is_new = piece.duals.is_empty();
        if is_new {
            piece.duals = vec![NONE; sub.prism_count()].into();
            let rims = if is_exposed { sub.boundary_triangles } else { 0 };
            piece.rims = vec![NONE; rims].into();
        }
        let ids = points.of(pentahedron);
        gathered.fill(points, &sample, ids, is_new);
        let local = Local {
            sub,
            values: &gathered.values,
            is_changed: &gathered.is_changed,
            coagulation: &gathered.coagulation,
        };
        let shape = mesh.rest_shape(pentahedron);
        let mut home = Home {
            pentahedron,
            shape: &shape,
            vertices: &mut self.vertices,
            chunks: &mut piece.chunks,
        };
        for (prism, slot) in sub.prisms().zip(piece.duals.iter_mut()) {
            if !local.is_changed(&prism) {
                continue;
            }
            let vertex = local.is_mixed(&prism).then(|| {
                let (place, coagulation) = local.crossing(&prism, &wedge::EDGES);
                Vertex {
                    place,
                    normal: local.fall(&prism),
                    kind: SurfaceKind::Cut,
                    coagulation,
                }
            });
            home.put(slot, vertex);
        }
        if is_exposed {
            self.place_exposed(mesh, &local, ids, exposed, &shape, pentahedron, &mut piece);
        }
        self.pieces[index] = piece;
    }

    /// The vertices on the former surface.
    fn place_exposed(
        &mut self,
        mesh: &Mesh,
        local: &Local,
        ids: &[u32],
        exposed: [bool; FACES],
        shape: &Shape,
        pentahedron: u32,
        piece: &mut Piece,
    ) {
        let sub = local.sub;
        let mut home = Home {
            pentahedron,
            shape,
            vertices: &mut self.vertices,
            chunks: &mut piece.chunks,
        };
        for cell in sub.boundary.iter().filter(|cell| exposed[cell.face()]) {
            let prism = sub.prism(cell.prism());
            if !local.is_changed(&prism) {
                continue;
            }
            let kind = mesh.kind(pentahedron, cell.face());
            let (triangles, count) = fine_triangles(sub, cell, ids);
            for (n, triangle) in triangles[..count].iter().enumerate() {
                let vertex = local.is_mixed(triangle).then(|| {
                    let (place, coagulation) = local.crossing(triangle, &SIDES);
                    let surface = home.vertices.surface_normal(mesh, pentahedron, place);
                    let axes = shape.jacobian(place.map(f64::from)).map(|axis| axis.as_vec3());
                    let cut = crate::vertices::carry(local.fall(&prism), axes);
                    let normal = (surface + cut).normalize_or(surface);
                    Vertex {
                        place,
                        normal: axes.map(|axis| axis.dot(normal)),
                        kind,
                        coagulation,
                    }
                });
                home.put(&mut piece.rims[cell.triangle() + n], vertex);
            }
            for &corner in triangles[..count].iter().flatten() {
                let slot = &mut self.point_slots[ids[corner as usize] as usize];
                if local.value(corner) <= 0.0 {
                    if *slot != NONE && !home.vertices.is_node(*slot) {
                        home.vertices.remove(*slot);
                    }
                    *slot = NONE;
                    continue;
                }
                let depth = local.depth(corner);
                if let Place::Node(node) = sub.parts[corner as usize] {
                    *slot = mesh.pentahedra[pentahedron as usize][usize::from(node)];
                    home.vertices.renew(*slot, SurfaceKind::Cut, depth);
                } else if *slot != NONE {
                    home.vertices.renew(*slot, kind, depth);
                } else {
                    let place = local.place(corner);
                    let normal = home.vertices.surface_normal(mesh, pentahedron, place);
                    let axes = shape.jacobian(place.map(f64::from));
                    let normal = axes.map(|axis| axis.as_vec3().dot(normal));
                    let vertex = Vertex {
                        place,
                        normal,
                        kind,
                        coagulation: depth,
                    };
                    home.put(slot, Some(vertex));
                }
            }
        }
    }
}

/// Where a pentahedron's vertices go.
struct Home<'a> {
    pentahedron: u32,
    shape: &'a Shape,
    vertices: &'a mut Vertices,
    chunks: &'a mut Vec<u32>,
}

impl Home<'_> {
    /// Sets a vertex, in a slot of its own if it has none yet, or frees its slot.
    fn put(&mut self, slot: &mut u32, vertex: Option<Vertex>) {
        match vertex {
            Some(vertex) => {
                if *slot == NONE {
                    *slot = self.vertices.add(self.pentahedron, self.chunks);
                }
                self.vertices.set(*slot, &vertex, self.shape);
            }
            None if *slot != NONE => self.vertices.remove(std::mem::replace(slot, NONE)),
            None => {}
        }
    }
}
