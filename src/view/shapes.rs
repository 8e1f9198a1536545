//! Meshes made here: tubes, shells, rings.

use std::f32::consts::{PI, TAU};

use bevy::{
    asset::RenderAssetUsages,
    mesh::{Indices, PrimitiveTopology},
    prelude::*,
};
use resecta_instrument::ResectoscopeGeometry;

/// Corners of a tube's cross-section.
const SIDES: usize = 36;

/// Vertices and triangles on their way to a [`Mesh`].
#[derive(Default)]
pub struct Shape {
    positions: Vec<[f32; 3]>,
    normals: Vec<[f32; 3]>,
    indices: Vec<u32>,
}

impl Shape {
    /// Adds a vertex and returns its index.
    pub fn vertex(&mut self, position: Vec3, normal: Vec3) -> u32 {
        self.positions.push(position.to_array());
        self.normals.push(normal.normalize_or(Vec3::Z).to_array());
        (self.positions.len() - 1) as u32
    }

    /// Adds a quadrilateral, corners in cyclic order.
    pub fn quad(&mut self, [a, b, c, d]: [u32; 4]) {
        self.indices.extend([a, b, c, a, c, d]);
    }

    /// Adds a tube around a line, with a radius at each of its points; its ends are open.
    pub fn tube(&mut self, line: &[Vec3], radius: impl Fn(usize) -> f32) {
        let Some(last) = line.len().checked_sub(1).filter(|&last| last > 0) else {
            return;
        };
        let direction = |point: usize| {
            let (before, after) = (line[point.saturating_sub(1)], line[(point + 1).min(last)]);
            (after - before).normalize_or(Vec3::Z)
        };
        // Carried along the line, so that the tube does not twist.
        let mut side = direction(0).any_orthonormal_vector();
        let mut before: Option<Vec<u32>> = None;
        for (point, &centre) in line.iter().enumerate() {
            let along = direction(point);
            side = (side - along * side.dot(along)).normalize_or(along.any_orthonormal_vector());
            let other = along.cross(side);
            let ring: Vec<u32> = (0..SIDES)
                .map(|corner| {
                    let (sin, cos) = (TAU * corner as f32 / SIDES as f32).sin_cos();
                    let outward = side * cos + other * sin;
                    self.vertex(centre + outward * radius(point), outward)
                })
                .collect();
            if let Some(before) = before {
                self.join(&before, &ring);
            }
            before = Some(ring);
        }
    }

    /// Joins two rings of equal length by a band.
    pub fn join(&mut self, first: &[u32], second: &[u32]) {
        let count = first.len();
        for corner in 0..count {
            let next = (corner + 1) % count;
            self.quad([first[corner], first[next], second[next], second[corner]]);
        }
    }

    /// The mesh.
    pub fn mesh(self) -> Mesh {
        let mut mesh = Mesh::new(PrimitiveTopology::TriangleList, RenderAssetUsages::default());
        mesh.insert_attribute(Mesh::ATTRIBUTE_POSITION, self.positions);
        mesh.insert_attribute(Mesh::ATTRIBUTE_NORMAL, self.normals);
        mesh.insert_indices(Indices::U32(self.indices));
        mesh
    }
}

/// A tube of one radius.
pub fn tube(line: &[Vec3], radius: f32) -> Mesh {
    let mut shape = Shape::default();
    shape.tube(line, |_| radius);
    shape.mesh()
}

/// A surface of revolution about `+Z`: a line of (radius, z) turned around.
pub fn turned(profile: &[Vec2]) -> Mesh {
    let line: Vec<Vec3> = profile.iter().map(|point| Vec3::new(0.0, 0.0, point.y)).collect();
    let mut shape = Shape::default();
    let mut before: Option<Vec<u32>> = None;
    for (point, centre) in line.iter().enumerate() {
        let (from, to) = (
            profile[point.saturating_sub(1)],
            profile[(point + 1).min(profile.len() - 1)],
        );
        let along = (to - from).normalize_or(Vec2::Y);
        let ring: Vec<u32> = (0..2 * SIDES)
            .map(|corner| {
                let (sin, cos) = (TAU * corner as f32 / (2 * SIDES) as f32).sin_cos();
                let outward = Vec3::new(cos, sin, 0.0);
                shape.vertex(
                    *centre + outward * profile[point].x,
                    outward * along.y - Vec3::Z * along.x,
                )
            })
            .collect();
        if let Some(before) = before {
            shape.join(&before, &ring);
        }
        before = Some(ring);
    }
    shape.mesh()
}

/// A sphere's shell without what lies below `open_z`, measured from its centre; normals point inwards.
pub fn open_shell(radius: f32, open_z: f32) -> Mesh {
    const RINGS: usize = 40;
    let open_at = (open_z / radius).clamp(-1.0, 1.0).acos();
    let mut shape = Shape::default();
    let mut before: Option<Vec<u32>> = None;
    for ring in 0..=RINGS {
        let (sin, cos) = (open_at * ring as f32 / RINGS as f32).sin_cos();
        let ring: Vec<u32> = (0..3 * SIDES)
            .map(|corner| {
                let (east, north) = (TAU * corner as f32 / (3 * SIDES) as f32).sin_cos();
                let outward = Vec3::new(sin * north, sin * east, cos);
                shape.vertex(outward * radius, -outward)
            })
            .collect();
        if let Some(before) = before {
            shape.join(&before, &ring);
        }
        before = Some(ring);
    }
    shape.mesh()
}

/// A ring in the plane across `Z`.
pub fn ring(radius: f32, thickness: f32) -> Mesh {
    const POINTS: usize = 48;
    let line: Vec<Vec3> = (0..=POINTS)
        .map(|point| {
            let (sin, cos) = (TAU * point as f32 / POINTS as f32).sin_cos();
            Vec3::new(cos, sin, 0.0) * radius
        })
        .collect();
    tube(&line, thickness)
}

/// The beak: the lower part of a ring, towards `-Z`, its edge rounded off to the sides.
pub fn beak(geometry: &ResectoscopeGeometry) -> Mesh {
    const STEPS: usize = 96;
    let [from_mm, to_mm] = geometry.beak_radii_mm();
    let mut shape = Shape::default();
    let mut before: Option<[u32; 2]> = None;
    for step in 0..=STEPS {
        let share = step as f32 / STEPS as f32;
        let angle = PI * (1.1 + 0.8 * share);
        let (sin, cos) = angle.sin_cos();
        let outward = Vec3::new(cos, sin, 0.0);
        let reach_mm = ResectoscopeGeometry::beak_reach_mm(outward.truncate());
        let edge = [
            shape.vertex(outward * from_mm, -outward),
            shape.vertex(outward * to_mm - Vec3::Z * reach_mm, -outward),
        ];
        if let Some(before) = before {
            shape.quad([before[0], edge[0], edge[1], before[1]]);
        }
        before = Some(edge);
    }
    shape.mesh()
}

#[cfg(test)]
mod tests {
    use bevy::mesh::VertexAttributeValues;

    use super::*;

    fn positions(mesh: &Mesh) -> Vec<Vec3> {
        match mesh.attribute(Mesh::ATTRIBUTE_POSITION) {
            Some(VertexAttributeValues::Float32x3(positions)) => positions.iter().copied().map(Vec3::from).collect(),
            other => panic!("{other:?}"),
        }
    }

    #[test]
    fn a_tube_keeps_its_radius_around_a_bend() {
        let line = [Vec3::ZERO, Vec3::X, Vec3::new(2.0, 0.5, 0.0), Vec3::new(2.5, 1.5, 0.0)];
        let mesh = tube(&line, 0.25);
        for (index, position) in positions(&mesh).into_iter().enumerate() {
            let centre = line[index / SIDES];
            assert!((position.distance(centre) - 0.25).abs() < 1e-5, "{position}");
        }
    }

    #[test]
    fn an_open_shell_lies_on_its_sphere_and_above_its_opening() {
        for position in positions(&open_shell(30.0, -20.0)) {
            assert!(
                (position.length() - 30.0).abs() < 1e-3 && position.z > -20.001,
                "{position}"
            );
        }
    }
}
