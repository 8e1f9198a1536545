//! How much of a tissue's surface lies inside of the tissue itself.
//!
//! Nothing keeps parts of a tissue out of each other: lobes that fall together, flaps that a cut left. This measures how much they do.

use bevy::prelude::*;
use parry3d::{
    query::{Ray, RayCast},
    shape::{FeatureId, TriMesh},
};

use crate::components::Tissue;

/// Most triangles that are tested. With these, a share of 1 % has a standard error of 0.07 % (binomial, equal areas).
const MOST: usize = 20_000;
/// Distance of the tested point in front of its triangle, mm. Shallower overlaps are not found; they are too small to be seen.
const BEFORE_MM: f32 = 0.05;
/// Overlaps that are deeper are not looked for, mm: more than the widest lobe.
const DEEP_MM: f32 = 40.0;
/// A triangle of less area than this has no side, mm².
const LEAST_MM2: f32 = 1e-4;

/// How much of a surface lies inside of what it bounds.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct SelfOverlap {
    /// Area that was looked at, mm².
    pub exposed_mm2: f64,
    /// Of that, inside of the tissue, mm².
    pub inside_mm2: f64,
}

impl SelfOverlap {
    /// That of a tissue as it lies now. Takes a quarter of a second for a gland late in an operation.
    pub fn of(tissue: &Tissue) -> Self {
        let (places, triangles) = tissue.surface();
        Self::of_surface(places, triangles)
    }

    /// Area inside over area.
    pub fn share(&self) -> f64 {
        if self.exposed_mm2 > 0.0 {
            self.inside_mm2 / self.exposed_mm2
        } else {
            0.0
        }
    }

    /// That of a closed surface, outward by the right-hand rule.
    fn of_surface(places: Vec<Vec3>, triangles: Vec<[u32; 3]>) -> Self {
        let mut overlap = Self::default();
        let every = triangles.len().div_ceil(MOST).max(1);
        let Ok(mesh) = TriMesh::new(places, triangles) else {
            return overlap;
        };
        let count = mesh.num_triangles();
        for triangle in mesh.triangles().step_by(every) {
            let twice = (triangle.b - triangle.a).cross(triangle.c - triangle.a);
            let area = 0.5 * twice.length();
            if area < LEAST_MM2 {
                continue;
            }
            overlap.exposed_mm2 += f64::from(area);
            let normal = twice.normalize();
            let ray = Ray::new(triangle.center() + BEFORE_MM * normal, normal);
            // Where the ray leaves tissue before it enters any, it began in tissue. parry numbers triangles hit from behind from `count` on.
            let next = mesh.cast_local_ray_and_get_normal(&ray, DEEP_MM, false);
            let leaves = next.is_some_and(|hit| matches!(hit.feature, FeatureId::Face(face) if face as usize >= count));
            if leaves {
                overlap.inside_mm2 += f64::from(area);
            }
        }
        overlap
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use parry3d::shape::Cuboid;

    /// Boxes 10 mm wide whose middles are at these places, as one surface.
    fn boxes(middles: &[Vec3]) -> SelfOverlap {
        let (mut places, mut triangles) = (Vec::new(), Vec::new());
        for middle in middles {
            let (vertices, faces) = Cuboid::new(Vec3::splat(5.0)).to_trimesh();
            let first = places.len() as u32;
            places.extend(vertices.into_iter().map(|vertex| vertex + *middle));
            triangles.extend(faces.into_iter().map(|face| face.map(|corner| corner + first)));
        }
        SelfOverlap::of_surface(places, triangles)
    }

    #[test]
    fn what_is_apart_does_not_overlap_and_what_is_inside_does() {
        assert_eq!(boxes(&[Vec3::ZERO]).share(), 0.0);
        let apart = boxes(&[Vec3::ZERO, Vec3::X * 10.5]);
        assert_eq!((apart.exposed_mm2, apart.inside_mm2), (1200.0, 0.0));
        // One face of each lies in the other.
        let pushed = boxes(&[Vec3::ZERO, Vec3::X * 9.0]);
        assert_eq!((pushed.exposed_mm2, pushed.inside_mm2), (1200.0, 200.0));
        assert_eq!(SelfOverlap::of_surface(Vec::new(), Vec::new()).share(), 0.0);
    }
}
