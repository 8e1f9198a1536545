//! Where a part and the tissue touch, and which way the tissue gives way.

use bevy::prelude::*;
use resecta_solver::Contact;

use super::{closest::ClosestPoints, sweep::PartSweep};
use crate::{skin::Skin, tool::ToolPartKind};

/// How fast tissue that a tool already overlaps is moved out of it, mm/s, on top of the tool's own motion. A tool that is
/// put into tissue at once distends it in some steps instead of throwing it aside in one.
const RECOVERY_MM_PER_S: f32 = 60.0;
/// The same for a tool at rest.
const RECOVERY_AT_REST_MM_PER_S: f32 = 20.0;
/// The same at rest for tissue that surrounds a tool's axis and is to be moved past it: what holds it there may not let it
/// go, and it comes back each step.
const PASSING_AT_REST_MM_PER_S: f32 = 3.0;
/// A part that moves less than this in a pass is at rest, mm.
pub const AT_REST_MM: f32 = 0.1;
/// Below this distance the direction between two points is noise, mm.
pub const NO_DIRECTION_MM: f32 = 1e-4;
/// A face runs along a sheath if the cosine between its normal and the sheath's axis is below this (45 degrees).
const WALL_SLOPE: f32 = 0.7;
/// Points ahead of a round tip and nearer to its axis than this share of its radius are pushed ahead.
const NO_SIDE_SHARE: f32 = 0.2;

/// Whether what a part touches there gives way straight from the axis, whichever way it faces: all but what a sheath has ahead.
pub fn is_straight(part: &PartSweep, share: f32) -> bool {
    part.kind != ToolPartKind::Sheath || share > 0.0 && share < 1.0
}

/// Whether tissue faces the point of the axis nearest to one of it, `outward` being the direction out of the tissue there.
pub fn faces(closest: &ClosestPoints, outward: Vec3) -> bool {
    outward.dot(closest.on_triangle - closest.on_segment) <= 0.0
}

/// The points of a part and of the tissue that touch, and the direction in which the tissue gives way.
#[derive(Debug, Clone, Copy)]
pub struct Touch {
    pub closest: ClosestPoints,
    pub normal: Vec3,
    /// How far from the point of the axis, along the normal, the part's surface is, mm.
    pub reach: f32,
    /// Whether the tissue around the axis is moved past it.
    pub is_inward: bool,
}

impl Touch {
    /// How a part outside of the tissue touches a vertex of it, if it comes within `range` of its axis. `outward` is the
    /// direction out of the tissue there.
    #[inline(always)]
    pub fn of_vertex(part: &PartSweep, point: Vec3, outward: Vec3, range: f32) -> Option<Touch> {
        let closest = Touch::closest_to_vertex(part, point, range)?;
        faces(&closest, outward).then(|| Touch::outside(part, closest, outward))
    }

    /// The point of a part nearest to a vertex, if the vertex is within `range` of its axis and not on it.
    #[inline(always)]
    pub fn closest_to_vertex(part: &PartSweep, point: Vec3, range: f32) -> Option<ClosestPoints> {
        let share = part.to.share_nearest(point);
        let on_segment = part.to.at(share);
        let squared = (point - on_segment).length_squared();
        if squared > range * range || squared <= NO_DIRECTION_MM * NO_DIRECTION_MM {
            return None;
        }
        // All three vertices of the contact are this one, so one weight is enough.
        Some(ClosestPoints {
            share,
            on_segment,
            weights: [1.0, 0.0, 0.0],
            on_triangle: point,
        })
    }

    /// Tissue gives way straight from the axis; but a wall that runs along a sheath is spread by the sheath's round tip
    /// rather than driven ahead of it, as a lumen is that a sheath enters.
    #[inline(always)]
    pub fn outside(part: &PartSweep, closest: ClosestPoints, outward: Vec3) -> Touch {
        let away = closest.on_triangle - closest.on_segment;
        let straight = Touch {
            closest,
            normal: away.normalize_or(-outward),
            reach: part.radius,
            is_inward: false,
        };
        let forward = match closest.share {
            _ if is_straight(part, closest.share) => return straight,
            0.0 => (part.to.a - part.to.b).normalize_or_zero(),
            _ => (part.to.b - part.to.a).normalize_or_zero(),
        };
        let ahead = forward.dot(away);
        let sideways = away - forward * ahead;
        let runs_along = outward.dot(forward).abs() < WALL_SLOPE;
        if !runs_along || ahead >= part.radius || sideways.length() < part.radius * NO_SIDE_SHARE {
            return straight;
        }
        let reach = (part.radius * part.radius - ahead * ahead).max(0.0).sqrt();
        Touch {
            closest,
            normal: sideways.normalize(),
            reach,
            is_inward: false,
        }
    }

    /// Where the point is to be along the normal at the end of the pass, and where it is, mm.
    fn goal_and_now(&self) -> (f32, f32) {
        (
            self.normal.dot(self.closest.on_segment) + self.reach,
            self.normal.dot(self.closest.on_triangle),
        )
    }

    /// How far the part would reach past the point, mm.
    pub fn depth(&self) -> f32 {
        let (goal, now) = self.goal_and_now();
        goal - now
    }

    pub fn contact(&self, skin: &Skin, part: &PartSweep, vertices: [u32; 3], pass_s: f32) -> Contact {
        let (point, off) = skin.point(vertices, self.closest.weights);
        let off = self.normal.dot(off);
        let (goal, now) = self.goal_and_now();
        let start = part.from.at(self.closest.share);
        let offset_start = now.min(self.normal.dot(start) + self.reach).min(goal);
        // A round tip spreads tissue at most about as fast as it moves, until it is deep in it.
        let motion = start.distance(self.closest.on_segment);
        let recovery = match self.is_inward {
            _ if motion >= AT_REST_MM => RECOVERY_MM_PER_S,
            true => PASSING_AT_REST_MM_PER_S,
            false => RECOVERY_AT_REST_MM_PER_S,
        };
        let offset_end = goal.min(offset_start + 2.0 * motion + recovery * pass_s);
        Contact {
            point,
            normal: self.normal,
            offset_start: offset_start + off,
            offset_end: offset_end + off,
        }
    }
}
