//! Whether a point lies in tissue, however the tissue is folded: by how often a ray from it leaves the surface more often than
//! it enters.
//!
//! The surface is closed and oriented, so that number is the same for every ray: 1 in tissue, 0 outside, 2 where tissue
//! overlaps itself. The nearest face tells less: in a fold it may be turned inside out.

use bevy::prelude::*;

use super::{
    collider::{Collider, LOOSENED_MM, faces},
    patches::Run,
};
use crate::{fine::Fine, skin::Skin};

/// Directions of rays; a ray that meets an edge may count it twice or not at all, so most of the three tell. Aslant to
/// everything that a lattice has.
const DIRECTIONS: [Vec3; 3] = [
    Vec3::new(0.3719, 0.5581, 0.7417),
    Vec3::new(-0.6823, 0.2931, 0.6697),
    Vec3::new(0.1637, -0.8831, 0.4397),
];

struct Ray {
    from: Vec3,
    direction: Vec3,
}

impl Collider {
    /// Whether a point lies in tissue. Brings what vertices it needs to where the tissue is.
    pub fn holds(&self, solver: &resecta_solver::Tissue, fine: Option<&mut Fine>, point: Vec3) -> bool {
        // A gland is long and cut all over once most of it is out, and most of what asks then floats beyond it.
        let is_within = |(low, high): (Vec3, Vec3)| point.cmpge(low).all() && point.cmple(high).all();
        if !self.bounds().is_some_and(is_within) {
            return false;
        }
        let mut fine = fine;
        let mut tells_inside = |direction: Vec3| {
            let ray = Ray { from: point, direction };
            let runs: Vec<&Run> = self.runs_along(&ray).collect();
            if let Some(fine) = &mut fine {
                let chunks = runs.iter().flat_map(|run| &run.chunks);
                fine.bring(solver, chunks.map(|part| part.chunk));
            }
            let skin = Skin::new(solver, fine.as_deref());
            let faces = runs.into_iter().flat_map(|run| faces(run, &skin));
            // How often the ray leaves the surface more often than it enters.
            faces.map(|face| ray.crossing(face.corners)).sum::<i32>() > 0
        };
        let [one, another, third] = DIRECTIONS;
        let told = tells_inside(one);
        if tells_inside(another) == told {
            told
        } else {
            tells_inside(third)
        }
    }

    fn runs_along(&self, ray: &Ray) -> impl Iterator<Item = &Run> {
        let patches = self.bvh().leaves(|node| ray.meets_box(node.mins(), node.maxs()));
        let runs = patches.flat_map(|patch| &self.patch(patch).runs);
        let slack = Vec3::splat(LOOSENED_MM);
        runs.filter(move |run| ray.meets_box(run.bounds.0 - slack, run.bounds.1 + slack))
    }
}

impl Ray {
    fn meets_box(&self, low: Vec3, high: Vec3) -> bool {
        let (one, other) = ((low - self.from) / self.direction, (high - self.from) / self.direction);
        let (enters, leaves) = (one.min(other).max_element(), one.max(other).min_element());
        enters <= leaves && leaves >= 0.0
    }

    /// 1 where the ray leaves through a triangle that is outward by the right-hand rule, -1 where it enters, else 0 (Möller and
    /// Trumbore's test).
    fn crossing(&self, [a, b, c]: [Vec3; 3]) -> i32 {
        let (along, across) = (b - a, c - a);
        let normal = self.direction.cross(across);
        let volume = along.dot(normal);
        if volume == 0.0 {
            return 0;
        }
        let to_ray = self.from - a;
        let u = to_ray.dot(normal) / volume;
        let turned = to_ray.cross(along);
        let v = self.direction.dot(turned) / volume;
        let t = across.dot(turned) / volume;
        match u >= 0.0 && v >= 0.0 && u + v <= 1.0 && t > 0.0 {
            // The triple product of the edges and the ray is less than 0 where the ray goes with the normal.
            true if volume < 0.0 => 1,
            true => -1,
            false => 0,
        }
    }
}
