//! The surface of a tissue as it lies now, with rays at it.

use bevy::math::Vec3;
use parry3d::{
    query::{Ray, RayCast},
    shape::TriMesh,
};
use resecta_instrument::LoopPose;
use resecta_tissue::Tissue;

use crate::budget::Surface;

/// What a ray meets next.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Crossing {
    /// How far along the ray, mm.
    pub at_mm: f32,
    /// Whether the ray goes into the tissue there, or out of it.
    pub enters: bool,
}

/// The frame in which tissue and wire are compared.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum View {
    /// A place that does not move.
    Space,
    /// The organ: the sheath moves it as a whole by millimetres (`resecta_solver::Mobility`), and a surgeon steers by what lies before the
    /// loop.
    Organ,
}

impl View {
    /// Where a place of a tissue is seen, mm: from the organ, where it would be had the bed moved nowhere.
    pub fn place(self, tissue: &Tissue, place: Vec3) -> Vec3 {
        match self {
            View::Space => place,
            View::Organ => unmoved(|rest| tissue.solver().bed_moves(rest), place),
        }
    }

    /// Where a pose of the loop is seen.
    pub fn pose(self, tissue: &Tissue, pose: LoopPose) -> LoopPose {
        let centre = self.place(tissue, pose.centre);
        let turned = |axis: Vec3| (self.place(tissue, pose.centre + axis) - centre).normalize_or(axis);
        LoopPose {
            centre,
            travel: turned(pose.travel),
            down: turned(pose.down),
        }
    }
}

/// The place that a motion brings to another place.
fn unmoved(moves: impl Fn(Vec3) -> Vec3, place: Vec3) -> Vec3 {
    /// A bed turns by some hundredths of a radian: every guess is that much nearer than the one before, the last to micrometres.
    const GUESSES: usize = 4;
    (0..GUESSES).fold(place, |rest, _| place - moves(rest))
}

/// A closed surface, outward by the right-hand rule. Lengths mm.
pub struct TissueSurface {
    mesh: TriMesh,
}

impl TissueSurface {
    /// The surface of a tissue, in the frame of a view. `None` if the tissue is not cut finer than its elements, or nothing is left of it.
    pub fn of(tissue: &Tissue, view: View) -> Option<Self> {
        let Surface { places, triangles } = Surface::of(tissue)?;
        let seen = places.into_iter().map(|place| view.place(tissue, place));
        Self::new(seen.collect(), triangles)
    }

    /// One of these vertices and triangles.
    pub fn new(vertices: Vec<Vec3>, triangles: Vec<[u32; 3]>) -> Option<Self> {
        let mesh = TriMesh::new(vertices, triangles).ok()?;
        Some(Self { mesh })
    }

    /// Corners of every triangle.
    pub fn triangles(&self) -> impl Iterator<Item = [Vec3; 3]> + '_ {
        let vertices = self.mesh.vertices();
        (self.mesh.indices().iter()).map(|corners| corners.map(|corner| vertices[corner as usize]))
    }

    /// Whether a place lies in the tissue: a ray from there that meets the surface leaves it.
    pub fn contains(&self, place: Vec3) -> bool {
        let beyond = self.mesh.local_aabb().extents().length();
        let first = self.crossings(place, Vec3::new(0.36, 0.48, 0.8), beyond);
        first.first().is_some_and(|crossing| !crossing.enters)
    }

    /// What a ray of some length crosses, the nearest first.
    pub fn crossings(&self, from: Vec3, direction: Vec3, length_mm: f32) -> Vec<Crossing> {
        /// Further than a triangle that was met, mm, so that it is not met again.
        const BEYOND_MM: f32 = 1e-3;
        let mut crossings = Vec::new();
        let mut begun = 0.0;
        while begun < length_mm {
            let ray = Ray::new(from + direction * begun, direction);
            let Some(hit) = self.mesh.cast_local_ray_and_get_normal(&ray, length_mm - begun, false) else {
                break;
            };
            let at_mm = begun + hit.time_of_impact;
            // parry turns the normal of a triangle that is met from behind, and tells by the feature that it did.
            let is_behind = matches!(hit.feature, parry3d::shape::FeatureId::Face(face)
                if face as usize >= self.mesh.num_triangles());
            crossings.push(Crossing {
                at_mm,
                enters: !is_behind,
            });
            begun = at_mm + BEYOND_MM;
        }
        crossings
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A box from the origin to (4, 4, 1).
    fn slab() -> TissueSurface {
        let (vertices, triangles) = parry3d::shape::Cuboid::new(Vec3::new(2.0, 2.0, 0.5)).to_trimesh();
        let vertices = vertices.into_iter().map(|v| v + Vec3::new(2.0, 2.0, 0.5)).collect();
        TissueSurface::new(vertices, triangles).expect("a box is a surface")
    }

    #[test]
    fn a_place_is_found_that_a_shift_and_a_turn_bring_to_another() {
        let moves = |rest: Vec3| Vec3::new(0.3, -2.5, 0.1) + Vec3::new(0.05, -0.02, 0.01).cross(rest);
        let rest = Vec3::new(3.0, -8.0, 40.0);
        let found = unmoved(moves, rest + moves(rest));
        assert!(found.distance(rest) < 1e-3, "{found}");
    }

    #[test]
    fn a_ray_enters_and_leaves_a_slab_its_thickness_apart() {
        let crossings = slab().crossings(Vec3::new(1.3, 2.1, -3.0), Vec3::Z, 10.0);
        assert_eq!(crossings.len(), 2);
        assert!(crossings[0].enters && !crossings[1].enters);
        assert!((crossings[1].at_mm - crossings[0].at_mm - 1.0).abs() < 1e-4);
        assert_eq!(slab().crossings(Vec3::new(1.3, 2.1, -3.0), Vec3::Z, 2.0), []);
    }

    #[test]
    fn a_ray_from_within_leaves_only() {
        let crossings = slab().crossings(Vec3::new(1.3, 2.1, 0.4), Vec3::Z, 10.0);
        assert_eq!(crossings.len(), 1);
        assert!(!crossings[0].enters && (crossings[0].at_mm - 0.6).abs() < 1e-4);
        assert!(slab().contains(Vec3::new(1.3, 2.1, 0.4)) && !slab().contains(Vec3::new(1.3, 2.1, 1.4)));
    }
}
