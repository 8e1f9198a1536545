//! The face nearest to a point, and on which side of it the point is.

use bevy::prelude::*;
use parry3d::partitioning::TraversalAction;

use super::{
    closest::{ClosestPoints, point_triangle},
    collider::{Collider, DEPTH_LIMIT_MM, Face, LOOSENED_MM, TIE_MM, faces},
};
use crate::skin::Skin;

/// The face nearest to a point.
#[derive(Debug, Clone, Copy)]
pub struct Nearest {
    pub face: Face,
    pub closest: ClosestPoints,
    /// Whether the point lies inside the tissue.
    pub inside: bool,
}

/// How far from a point the face nearest to it may be, mm, if one is known.
pub(crate) fn reach_mm(point: Vec3, known: Option<&Face>) -> f32 {
    known.map_or(DEPTH_LIMIT_MM, |face| {
        point_triangle(point, face.corners).distance().min(DEPTH_LIMIT_MM)
    })
}

impl Collider {
    /// Whether a point lies inside the tissue, and the face that is nearest to it; none if no face is within `reach`, mm, or the depth
    /// limit.
    ///
    /// Where several faces share the nearest point (an edge, a corner), the one that faces the point most squarely says
    /// which side it is on.
    pub(crate) fn nearest_face_within(&self, skin: &Skin, point: Vec3, reach: f32) -> Option<Nearest> {
        let away = |face: &Face| point_triangle(point, face.corners);
        let mut nearest = reach;
        // Those that were as near as any when they were looked at.
        let mut candidates: Vec<(Face, ClosestPoints)> = Vec::new();
        let to_box = |low: Vec3, high: Vec3| point.distance(point.clamp(low, high));
        self.bvh().traverse(|node| {
            if to_box(node.mins(), node.maxs()) > nearest + TIE_MM {
                return TraversalAction::Prune;
            }
            let Some(patch) = node.leaf_data() else {
                return TraversalAction::Continue;
            };
            for run in &self.patch(patch).runs {
                if to_box(run.bounds.0, run.bounds.1) > nearest + TIE_MM + LOOSENED_MM {
                    continue;
                }
                for face in faces(run, skin) {
                    // No point of a face is further from one corner than its longer edge there: most are too far at a glance.
                    let [a, b, c] = face.corners;
                    let size = a.distance_squared(b).max(a.distance_squared(c)).sqrt();
                    if a.distance(point) - size > nearest + TIE_MM {
                        continue;
                    }
                    let closest = away(&face);
                    if closest.distance() <= nearest + TIE_MM {
                        nearest = nearest.min(closest.distance());
                        candidates.push((face, closest));
                    }
                }
            }
            TraversalAction::Continue
        });
        candidates.retain(|(_, closest)| closest.distance() <= (nearest + TIE_MM).min(DEPTH_LIMIT_MM));
        candidates.sort_unstable_by_key(|(face, _)| face.slot);
        let mut best: Option<(f32, Nearest)> = None;
        for (face, closest) in candidates {
            let side = face.normal().dot((point - closest.on_triangle).normalize_or_zero());
            if best.as_ref().is_none_or(|(squarest, _)| side.abs() > *squarest) {
                best = Some((
                    side.abs(),
                    Nearest {
                        face,
                        closest,
                        inside: side < 0.0,
                    },
                ));
            }
        }
        best.map(|(_, nearest)| nearest)
    }
}
