//! Whether a point lies in tissue, however the tissue is folded: by how often a ray from it leaves the surface more often than
//! it enters.
//!
//! Also where a ray first meets the surface: what one sees, and what hides it.
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

pub(super) struct Ray {
    from: Vec3,
    direction: Vec3,
    /// 1 over each component of the direction: boxes are many.
    inverse: Vec3,
    /// How far along it boxes are looked for, as a share of the direction.
    reach: f32,
}

impl Collider {
    /// Whether a point lies in tissue. Brings what vertices it needs to where the tissue is.
    pub(crate) fn holds(&mut self, solver: &resecta_solver::Tissue, fine: Option<&mut Fine>, point: Vec3) -> bool {
        // A gland is long and cut all over once most of it is out, and most of what asks then floats beyond it.
        let is_within = |(low, high): (Vec3, Vec3)| point.cmpge(low).all() && point.cmple(high).all();
        if !self.bounds().is_some_and(is_within) {
            return false;
        }
        let mut fine = fine;
        // Away from the middle, which way is shortest out.
        let side = match self.bounds() {
            Some((low, high)) => (point - 0.5 * (low + high)).map(f32::signum),
            None => Vec3::ONE,
        };
        let mut tells_inside = |direction: Vec3| {
            let ray = Ray::new(point, direction * side);
            // How often the ray leaves the surface more often than it enters.
            let mut leaves = 0;
            self.crossings(solver, fine.as_deref_mut(), &ray, |_, outward| leaves += outward);
            leaves > 0
        };
        let [one, another, third] = DIRECTIONS;
        let told = tells_inside(one);
        if tells_inside(another) == told {
            told
        } else {
            tells_inside(third)
        }
    }

    /// How far from a point, in a direction of any length and in units of it, a ray first meets the surface, and 1 where it leaves
    /// the tissue there, -1 where it enters; none if it does not. What lies further than `reach`, in units of the direction, may be passed over.
    /// Brings what vertices it needs to where the tissue is.
    pub(crate) fn first_hit(
        &mut self,
        solver: &resecta_solver::Tissue,
        fine: Option<&mut Fine>,
        from: Vec3,
        direction: Vec3,
        reach: f32,
    ) -> Option<(f32, i32)> {
        let ray = Ray {
            reach,
            ..Ray::new(from, direction)
        };
        let mut first = None;
        self.crossings(solver, fine, &ray, |share, outward| {
            let hit = (share, outward);
            // Of what is met at once, what is entered counts, in whatever order faces come.
            first = Some(first.map_or(hit, |first: (f32, i32)| if hit < first { hit } else { first }));
        });
        first
    }

    /// Calls back for each triangle that a ray meets: how far on, as a share of the direction, and 1 where it leaves the tissue
    /// there, -1 where it enters.
    fn crossings(
        &mut self,
        solver: &resecta_solver::Tissue,
        mut fine: Option<&mut Fine>,
        ray: &Ray,
        mut met: impl FnMut(f32, i32),
    ) {
        let runs = self.runs_along(&Skin::new(solver, fine.as_deref()), ray);
        if let Some(fine) = &mut fine {
            let chunks = runs.iter().flat_map(|run| &run.chunks);
            fine.bring(solver, chunks.map(|part| part.chunk));
        }
        let skin = Skin::new(solver, fine.as_deref());
        for run in runs {
            for face in faces(run, &skin) {
                if let Some((share, outward)) = ray.crossing(face.corners) {
                    met(share, outward);
                }
            }
        }
    }

    fn runs_along(&mut self, skin: &Skin, ray: &Ray) -> Vec<&Run> {
        let patches = self.leaves(skin, |low, high| ray.meets_box(low, high));
        let runs = patches.iter().flat_map(|&patch| &self.patch(patch).runs);
        let slack = Vec3::splat(LOOSENED_MM);
        runs.filter(|run| ray.meets_box(run.bounds.0 - slack, run.bounds.1 + slack))
            .collect()
    }
}

impl Ray {
    pub fn new(from: Vec3, direction: Vec3) -> Self {
        Self {
            from,
            direction,
            inverse: 1.0 / direction,
            reach: f32::INFINITY,
        }
    }

    fn meets_box(&self, low: Vec3, high: Vec3) -> bool {
        let (one, other) = ((low - self.from) * self.inverse, (high - self.from) * self.inverse);
        let (enters, leaves) = (one.min(other).max_element(), one.max(other).min_element());
        enters <= leaves.min(self.reach) && leaves >= 0.0
    }

    /// Where the ray meets a triangle that is outward by the right-hand rule, as a share of its direction, and 1 where it leaves
    /// through it, -1 where it enters (Möller and Trumbore's test).
    #[inline]
    pub fn crossing(&self, [a, b, c]: [Vec3; 3]) -> Option<(f32, i32)> {
        let (along, across) = (b - a, c - a);
        let normal = self.direction.cross(across);
        let volume = along.dot(normal);
        if volume == 0.0 {
            return None;
        }
        let to_ray = self.from - a;
        let u = to_ray.dot(normal) / volume;
        // Most triangles are passed on this side already.
        if !(0.0..=1.0).contains(&u) {
            return None;
        }
        let turned = to_ray.cross(along);
        let v = self.direction.dot(turned) / volume;
        let t = across.dot(turned) / volume;
        // The triple product of the edges and the ray is less than 0 where the ray goes with the normal.
        let outward = if volume < 0.0 { 1 } else { -1 };
        (v >= 0.0 && u + v <= 1.0 && t > 0.0).then_some((t, outward))
    }
}
