//! From a part's way and a face to a contact that the solver enforces.

use bevy::prelude::*;
use resecta_solver::Contact;

use super::{
    closest::{ClosestPoints, segment_triangle},
    collider::{Collider, DEPTH_LIMIT_MM, Face},
    sweep::PartSweep,
};
use crate::tool::ToolPartKind;

/// Faces this much further away than they touch become contacts too, mm: tissue that springs back during a pass finds
/// the tool there.
pub const MARGIN_MM: f32 = 0.5;
/// Tissue this close counts as touched, mm: it rests on the tool to within rounding.
const TOUCH_MM: f32 = 0.02;
/// How fast tissue that a tool already overlaps is moved out of it, mm/s, on top of the tool's own motion. A tool that is
/// put into tissue at once distends it in some steps instead of throwing it aside in one.
const RECOVERY_MM_PER_S: f32 = 60.0;
/// Below this distance the direction between two points is noise, mm.
const NO_DIRECTION_MM: f32 = 1e-4;

/// A contact with what it came from.
#[derive(Debug, Clone, Copy)]
pub struct Found {
    /// Index of the tool among those of the step.
    pub tool: u32,
    /// Index of the part in its tool.
    pub part: u32,
    pub kind: ToolPartKind,
    pub slot: u32,
    pub point: Vec3,
    /// How far the part would reach past the face, mm; negative where it only comes near.
    pub depth: f32,
    pub contact: Contact,
}

impl Found {
    /// Whether the part touches, rather than merely being near.
    pub fn touches(&self) -> bool {
        self.depth > -TOUCH_MM
    }
}

/// Puts the contacts of one part during one pass at the end of `found`, by ascending slot, at most one a face.
pub fn find(
    collider: &Collider,
    tissue: &resecta_solver::Tissue,
    part: &PartSweep,
    (tool_index, part_index): (u32, u32),
    pass_s: f32,
    faces: &mut Vec<Face>,
    found: &mut Vec<Found>,
) {
    let motion = part.from.motion(&part.to);
    let range = (part.radius + MARGIN_MM).max(DEPTH_LIMIT_MM) + motion;
    collider.near_axis(tissue, &part.to, range, faces);
    let first = found.len();
    for face in faces.iter() {
        let Some((face, closest, normal)) = push(collider, tissue, part, face) else {
            continue;
        };
        let start = part.from.at(closest.share);
        let at = |point: Vec3| normal.dot(point) + part.radius;
        let (now, goal) = (normal.dot(closest.on_triangle), at(closest.on_segment));
        let offset_start = now.min(at(start));
        let reach = normal.dot(closest.on_segment - start).max(0.0) + RECOVERY_MM_PER_S * pass_s;
        found.push(Found {
            tool: tool_index,
            part: part_index,
            kind: part.kind,
            slot: face.slot,
            point: closest.on_triangle,
            depth: goal - now,
            contact: Contact {
                nodes: face.nodes,
                weights: closest.weights,
                normal,
                offset_start,
                offset_end: goal.min(offset_start + reach),
            },
        });
    }
    // Several faces may lead to the same nearest face.
    found[first..].sort_by(|a, b| {
        (a.slot, b.depth)
            .partial_cmp(&(b.slot, a.depth))
            .unwrap_or(std::cmp::Ordering::Equal)
    });
    let mut kept = first;
    for i in first..found.len() {
        if i == first || found[i].slot != found[kept - 1].slot {
            found[kept] = found[i];
            kept += 1;
        }
    }
    found.truncate(kept);
}

/// Which face the part pushes on account of a face near it, from where, and in which direction.
fn push(
    collider: &Collider,
    tissue: &resecta_solver::Tissue,
    part: &PartSweep,
    face: &Face,
) -> Option<(Face, ClosestPoints, Vec3)> {
    let outward = face.normal();
    if outward == Vec3::ZERO {
        return None;
    }
    let closest = segment_triangle(part.to.a, part.to.b, face.corners);
    let distance = closest.distance();
    let side = outward.dot(closest.on_segment - closest.on_triangle);
    let separated = || {
        let normal = (closest.on_triangle - closest.on_segment) / distance;
        (distance <= part.radius + MARGIN_MM).then_some((*face, closest, normal))
    };
    if distance <= NO_DIRECTION_MM {
        // The axis passes through the face: tissue goes inward, out of its way.
        return Some((*face, closest, -outward));
    }
    if side >= 0.0 {
        return separated();
    }
    // The axis is behind the face's plane: it is inside the tissue, or outside beyond an edge of the face.
    if distance > DEPTH_LIMIT_MM {
        return None;
    }
    let nearest = collider.nearest_face(tissue, closest.on_segment)?;
    if !nearest.inside {
        return separated();
    }
    // Inside. If the pass began before this face, it was passed on the way: it is pushed ahead of the part.
    let before = segment_triangle(part.from.a, part.from.b, face.corners);
    if outward.dot(before.on_segment - before.on_triangle) >= 0.0 {
        return Some((*face, closest, -outward));
    }
    // Otherwise the nearest face is moved past the part.
    let closest = ClosestPoints {
        share: closest.share,
        ..nearest.closest
    };
    Some((nearest.face, closest, -nearest.face.normal()))
}
