//! The face nearest to a point, and on which side of it the point is.

use bevy::prelude::*;

use super::{
    closest::{ClosestPoints, point_triangle},
    collider::{Collider, DEPTH_LIMIT_MM, Face, TIE_MM, faces},
};
use crate::{fine::Fine, skin::Skin};

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
    /// limit. Brings what vertices it needs to where the tissue is.
    ///
    /// Where several faces share the nearest point (an edge, a corner), the one that faces the point most squarely says
    /// which side it is on.
    pub(crate) fn nearest_face_within(
        &mut self,
        solver: &resecta_solver::Tissue,
        mut fine: Option<&mut Fine>,
        point: Vec3,
        reach: f32,
    ) -> Option<Nearest> {
        let reach = reach.min(DEPTH_LIMIT_MM);
        let mut runs = self.runs_near(&Skin::new(solver, fine.as_deref()), point, reach + TIE_MM);
        // What is nearest spares a look at the others.
        runs.sort_unstable_by(|(one, _), (other, _)| one.total_cmp(other));
        let mut found = NearestSoFar {
            point,
            distance: reach,
            candidates: Vec::new(),
        };
        for (distance, run) in runs {
            if distance > found.distance + TIE_MM {
                break;
            }
            if let Some(fine) = &mut fine {
                fine.bring(solver, run.chunks.iter().map(|part| part.chunk));
            }
            for face in faces(run, &Skin::new(solver, fine.as_deref())) {
                found.look_at(face);
            }
        }
        found.squarest()
    }
}

/// The faces nearest to a point of those looked at.
struct NearestSoFar {
    point: Vec3,
    distance: f32,
    /// Those that were as near as any when they were looked at.
    candidates: Vec<(Face, ClosestPoints)>,
}

impl NearestSoFar {
    fn look_at(&mut self, face: Face) {
        // No point of a face is further from one corner than its longer edge there: most are too far at a glance.
        let [a, b, c] = face.corners;
        let size = a.distance_squared(b).max(a.distance_squared(c)).sqrt();
        if a.distance(self.point) - size > self.distance + TIE_MM {
            return;
        }
        let closest = point_triangle(self.point, face.corners);
        if closest.distance() <= self.distance + TIE_MM {
            self.distance = self.distance.min(closest.distance());
            self.candidates.push((face, closest));
        }
    }

    /// Of the nearest, the one that faces the point most squarely; of several, that of the lowest slot.
    fn squarest(mut self) -> Option<Nearest> {
        let most = (self.distance + TIE_MM).min(DEPTH_LIMIT_MM);
        self.candidates.retain(|(_, closest)| closest.distance() <= most);
        self.candidates.sort_unstable_by_key(|(face, _)| face.slot);
        let mut best: Option<(f32, Nearest)> = None;
        for (face, closest) in self.candidates {
            let side = face
                .normal()
                .dot((self.point - closest.on_triangle).normalize_or_zero());
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
