//! From a part's way and a face to a contact that the solver enforces.

use bevy::prelude::*;
use resecta_solver::{Contact, NodeKind};

use super::{
    closest::{ClosestPoints, segment_triangle},
    collider::{Collider, DEPTH_LIMIT_MM, Face, Nearest},
    sweep::{Axis, PartSweep},
};
use crate::{skin::Skin, tool::ToolPartKind};

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

/// Faces whose middle dips less than this between corners that are held need no contact of their own, mm.
const DIP_MM: f32 = 0.1;

/// A point of a face with this weight at a corner is the corner.
const CORNER_WEIGHT: f32 = 0.999;
/// A face runs along a sheath if the cosine between its normal and the sheath's axis is below this (45 degrees).
const WALL_SLOPE: f32 = 0.7;
/// The face nearest to a point of an axis inside the tissue is looked up for points this far apart, mm.
const APART_MM: f32 = 0.5;
/// Points ahead of a round tip and nearer to its axis than this share of its radius are pushed ahead.
const NO_SIDE_SHARE: f32 = 0.2;

/// What a contact holds.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Held {
    /// The point of a face nearest to the part. Told in messages.
    Face {
        /// Slot of the face in the surface.
        slot: u32,
    },
    /// A corner of faces.
    Corner {
        /// The vertex.
        vertex: u32,
    },
}

/// A contact with what it came from.
#[derive(Debug, Clone, Copy)]
pub struct Found {
    /// Index of the tool among those of the step.
    pub tool: u32,
    /// Index of the part in its tool.
    pub part: u32,
    pub kind: ToolPartKind,
    pub held: Held,
    /// The vertices of the face; of a corner thrice the corner.
    pub vertices: [u32; 3],
    /// The pentahedron that carries the face, and what the face is.
    pub pentahedron: u32,
    pub surface: NodeKind,
    pub point: Vec3,
    /// Unit direction in which tissue gives way.
    pub normal: Vec3,
    /// How far the part would reach past the point, mm; negative where it only comes near.
    pub depth: f32,
    /// What the solver is to enforce; a face whose corners are held is only told.
    pub contact: Option<Contact>,
}

impl Found {
    /// Whether the part touches a face, rather than merely being near.
    pub fn touches(&self) -> bool {
        self.depth > -TOUCH_MM && matches!(self.held, Held::Face { .. })
    }
}

/// Puts the contacts of one part during one pass at the end of `found`: faces by ascending slot, at most one each, then
/// corners by ascending vertex, since later contacts win; of a part that does not push only faces. Of the corners that a pentahedron carries inside it the deepest is
/// enough: it moves as one.
pub fn find(
    collider: &Collider,
    skin: &Skin,
    part: &PartSweep,
    (tool, part_index): (u32, u32),
    pushes: bool,
    pass_s: f32,
    faces: &mut Vec<Face>,
    found: &mut Vec<Found>,
) {
    let motion = part.from.motion(&part.to);
    let near = part.radius + MARGIN_MM;
    collider.near_axis(skin, &part.to, near + motion, faces);
    let closest = faces
        .iter()
        .map(|face| segment_triangle(part.to.a, part.to.b, face.corners));
    let closest: Vec<ClosestPoints> = closest.collect();
    let crossings = closest.iter().filter(|closest| passes_through(closest));
    let mut surroundings = Surroundings::new(
        collider,
        skin,
        part.to,
        crossings.map(|closest| closest.share).collect(),
    );
    let first = found.len();
    let mut corners: Vec<(u32, Touch)> = Vec::new();
    let record = |held: Held, enforced: bool, vertices: [u32; 3], touch: &Touch| {
        let contact = enforced.then(|| touch.contact(skin, part, vertices, pass_s));
        let (goal, now) = touch.goal_and_now();
        let (pentahedron, surface) = match held {
            Held::Face { slot } => (
                skin.pentahedron(slot, vertices),
                most_of(vertices.map(|vertex| skin.kind(vertex))),
            ),
            Held::Corner { vertex } => (u32::MAX, skin.kind(vertex)),
        };
        Found {
            tool,
            part: part_index,
            kind: part.kind,
            held,
            vertices,
            pentahedron,
            surface,
            point: touch.closest.on_triangle,
            normal: touch.normal,
            depth: goal - now,
            contact,
        }
    };
    for (face, closest) in faces.iter().zip(closest) {
        let Some(push) = push(&mut surroundings, part, face, closest) else {
            continue;
        };
        let mut covered = false;
        if push.outside && pushes {
            let near = corners_near(part, face);
            let at_corner = push.touch.closest.weights.iter().any(|weight| *weight > CORNER_WEIGHT);
            covered = at_corner || near.iter().all(Option::is_some) && dip(part.radius, face) < DIP_MM;
            let near = face.vertices.into_iter().zip(near);
            corners.extend(near.filter_map(|(vertex, touch)| Some((vertex, touch?))));
        }
        found.push(record(
            Held::Face { slot: push.face.slot },
            pushes && !covered,
            push.face.vertices,
            &push.touch,
        ));
    }
    for nearest in surroundings.nearest_from_within() {
        let push = Push::inward(part, &nearest.face, nearest.closest);
        let held = Held::Face {
            slot: nearest.face.slot,
        };
        found.push(record(held, pushes, nearest.face.vertices, &push.touch));
    }
    // Several faces may lead to the same nearest face: the deepest stays.
    found[first..].sort_by(|a, b| a.held.cmp(&b.held).then(b.depth.total_cmp(&a.depth)));
    let mut kept = first;
    for i in first..found.len() {
        if i == first || found[i].held != found[kept - 1].held {
            found[kept] = found[i];
            kept += 1;
        }
    }
    found.truncate(kept);
    // Of the faces around a corner, the one that lets it slip furthest aside counts: it asks for the shortest way.
    corners.sort_by(|(a, first), (b, second)| a.cmp(b).then(first.reach.total_cmp(&second.reach)));
    corners.dedup_by_key(|(vertex, _)| *vertex);
    keep_deepest(skin, &mut corners);
    found.extend(
        corners
            .iter()
            .map(|(vertex, touch)| record(Held::Corner { vertex: *vertex }, true, [*vertex; 3], touch)),
    );
}

/// Keeps, of the vertices inside of each pentahedron, the one that is pushed furthest, and all that are nodes.
fn keep_deepest(skin: &Skin, corners: &mut Vec<(u32, Touch)>) {
    let mut inside: Vec<(u32, f32, u32)> = Vec::new();
    for (vertex, touch) in corners.iter() {
        if let Some(pentahedron) = skin.home(*vertex) {
            let (goal, now) = touch.goal_and_now();
            inside.push((pentahedron, goal - now, *vertex));
        }
    }
    if inside.is_empty() {
        return;
    }
    inside.sort_by(|a, b| a.0.cmp(&b.0).then(b.1.total_cmp(&a.1)).then(a.2.cmp(&b.2)));
    inside.dedup_by_key(|(pentahedron, ..)| *pentahedron);
    let mut deepest: Vec<u32> = inside.into_iter().map(|(.., vertex)| vertex).collect();
    deepest.sort_unstable();
    corners.retain(|(vertex, _)| skin.home(*vertex).is_none() || deepest.binary_search(vertex).is_ok());
}

/// The kind that most corners of a triangle have; where all differ, that of the inside.
fn most_of([a, b, c]: [NodeKind; 3]) -> NodeKind {
    if a == b || a == c {
        a
    } else if b == c {
        b
    } else {
        NodeKind::Inner
    }
}

/// Whether the axis passes through the face that these points are of.
fn passes_through(closest: &ClosestPoints) -> bool {
    closest.distance() <= NO_DIRECTION_MM
}

/// The points of a part and of the tissue that touch, and the direction in which the tissue gives way.
#[derive(Debug, Clone, Copy)]
struct Touch {
    closest: ClosestPoints,
    normal: Vec3,
    /// How far from the point of the axis, along the normal, the part's surface is, mm.
    reach: f32,
}

impl Touch {
    /// Tissue gives way straight from the axis; but a wall that runs along a sheath is spread by the sheath's round tip
    /// rather than driven ahead of it, as a lumen is that a sheath enters.
    fn outside(part: &PartSweep, closest: ClosestPoints, outward: Vec3) -> Touch {
        let away = closest.on_triangle - closest.on_segment;
        let straight = Touch {
            closest,
            normal: away.normalize_or(-outward),
            reach: part.radius,
        };
        let forward = match closest.share {
            _ if part.kind != ToolPartKind::Sheath => return straight,
            0.0 => (part.to.a - part.to.b).normalize_or_zero(),
            1.0 => (part.to.b - part.to.a).normalize_or_zero(),
            _ => return straight,
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
        }
    }

    /// Where the point is to be along the normal at the end of the pass, and where it is, mm.
    fn goal_and_now(&self) -> (f32, f32) {
        (
            self.normal.dot(self.closest.on_segment) + self.reach,
            self.normal.dot(self.closest.on_triangle),
        )
    }

    fn contact(&self, skin: &Skin, part: &PartSweep, vertices: [u32; 3], pass_s: f32) -> Contact {
        let (point, off) = skin.point(vertices, self.closest.weights);
        let off = self.normal.dot(off);
        let (goal, now) = self.goal_and_now();
        let start = part.from.at(self.closest.share);
        let offset_start = now.min(self.normal.dot(start) + self.reach).min(goal);
        // A round tip spreads tissue at most about as fast as it moves, until it is deep in it.
        let motion = start.distance(self.closest.on_segment);
        let offset_end = goal.min(offset_start + 2.0 * motion + RECOVERY_MM_PER_S * pass_s);
        Contact {
            point,
            normal: self.normal,
            offset_start: offset_start + off,
            offset_end: offset_end + off,
        }
    }
}

/// The corners of a face that a part outside of it holds.
fn corners_near(part: &PartSweep, face: &Face) -> [Option<Touch>; 3] {
    let outward = face.normal();
    [0, 1, 2].map(|corner| {
        let point = face.corners[corner];
        let share = part.to.share_nearest(point);
        let on_segment = part.to.at(share);
        let away = point - on_segment;
        let distance = away.length();
        let held = distance > NO_DIRECTION_MM && distance <= part.radius + MARGIN_MM && outward.dot(away) <= 0.0;
        held.then(|| {
            // All three vertices of the contact are this corner, so one weight is enough.
            let closest = ClosestPoints {
                share,
                on_segment,
                weights: [1.0, 0.0, 0.0],
                on_triangle: point,
            };
            Touch::outside(part, closest, outward)
        })
    })
}

/// How far the middle of a face's longest edge lies within a cylinder whose surface holds the edge's ends, mm.
fn dip(radius: f32, face: &Face) -> f32 {
    let [a, b, c] = face.corners;
    let half = 0.25
        * a.distance_squared(b)
            .max(b.distance_squared(c))
            .max(c.distance_squared(a));
    radius - (radius * radius - half).max(0.0).sqrt()
}

/// Which stretches of one part's axis are outside the tissue, and the faces nearest to those inside.
///
/// The surface is closed, so an axis is on one side of it from each face it passes through to the next: what was found for
/// one point of such a stretch holds for all of it.
struct Surroundings<'a> {
    collider: &'a Collider,
    skin: &'a Skin<'a>,
    /// Where the axis passes through faces, shares, rising.
    crossings: Vec<f32>,
    /// Whether a stretch is known to be outside, from before the first crossing to past the last.
    is_outside: Vec<bool>,
    axis: Axis,
    /// The faces nearest to points of the axis from end to end, as far as they have been looked up.
    nearest: Vec<Option<Option<Nearest>>>,
}

impl<'a> Surroundings<'a> {
    fn new(collider: &'a Collider, skin: &'a Skin, axis: Axis, mut crossings: Vec<f32>) -> Self {
        crossings.sort_unstable_by(f32::total_cmp);
        Self {
            collider,
            skin,
            is_outside: vec![false; crossings.len() + 1],
            crossings,
            axis,
            nearest: vec![None; 2 + (axis.a.distance(axis.b) / APART_MM) as usize],
        }
    }

    /// Whether all of the axis is known to be outside. Asked of its ends first: they are the furthest from what it touches.
    fn are_outside(&mut self) -> bool {
        self.crossings.is_empty()
            && [0.0, 1.0]
                .into_iter()
                .any(|end| matches!(self.nearest_from_inside(end), Ok(None)))
    }

    /// The faces nearest to points of the axis that are inside the tissue: they are moved past the part.
    fn nearest_from_within(&mut self) -> Vec<Nearest> {
        let last = self.nearest.len() - 1;
        let mut is_near = vec![false; last + 1];
        self.collider.stretches_near(&self.axis, DEPTH_LIMIT_MM, |from, to| {
            let numbers = (from * last as f32).ceil() as usize..=(to * last as f32) as usize;
            if let Some(numbers) = is_near.get_mut(numbers) {
                numbers.fill(true);
            }
        });
        if !is_near.contains(&true) || self.are_outside() {
            return Vec::new();
        }
        let shares = (0..=last)
            .filter(|&number| is_near[number])
            .map(|number| number as f32 / last as f32);
        shares
            .filter_map(|share| self.nearest_from_inside(share).ok()?)
            .collect()
    }

    /// The face nearest to a point of the axis at or near `share`, if that point is inside the tissue; `Err` if it is too
    /// deep for any to be near.
    fn nearest_from_inside(&mut self, share: f32) -> Result<Option<Nearest>, TooDeep> {
        let stretch_of = |share: f32| self.crossings.partition_point(|crossing| *crossing < share);
        let stretch = stretch_of(share);
        if self.is_outside[stretch] {
            return Ok(None);
        }
        let find = |share: f32| {
            let nearest = self.collider.nearest_face(self.skin, self.axis.at(share))?;
            let closest = ClosestPoints {
                share,
                ..nearest.closest
            };
            Some(Nearest { closest, ..nearest })
        };
        let last = (self.nearest.len() - 1) as f32;
        let number = (share * last).round();
        let nearest = if stretch_of(number / last) == stretch {
            *self.nearest[number as usize].get_or_insert_with(|| find(number / last))
        } else {
            find(share)
        };
        let nearest = nearest.ok_or(TooDeep)?;
        self.is_outside[stretch] = !nearest.inside;
        Ok(nearest.inside.then_some(nearest))
    }
}

/// No face is within the depth limit of a point.
struct TooDeep;

/// A face that a part pushes.
struct Push {
    face: Face,
    touch: Touch,
    /// Whether the part's axis is outside the tissue.
    outside: bool,
}

impl Push {
    /// Tissue goes inward, behind the part.
    fn inward(part: &PartSweep, face: &Face, closest: ClosestPoints) -> Push {
        let touch = Touch {
            closest,
            normal: -face.normal(),
            reach: part.radius,
        };
        Push {
            face: *face,
            touch,
            outside: false,
        }
    }
}

/// How the part pushes a face near it: from where, and in which direction.
fn push(surroundings: &mut Surroundings, part: &PartSweep, face: &Face, closest: ClosestPoints) -> Option<Push> {
    let outward = face.normal();
    if outward == Vec3::ZERO {
        return None;
    }
    let distance = closest.distance();
    let side = outward.dot(closest.on_segment - closest.on_triangle);
    let separated = || {
        let near = distance <= part.radius + MARGIN_MM;
        near.then(|| Push {
            face: *face,
            touch: Touch::outside(part, closest, outward),
            outside: true,
        })
    };
    if passes_through(&closest) {
        // The axis passes through the face: tissue goes inward, out of its way.
        return Some(Push::inward(part, face, closest));
    }
    if side >= 0.0 {
        return separated();
    }
    // The axis is behind the face's plane: it is inside the tissue, or outside beyond an edge of the face.
    if surroundings.nearest_from_inside(closest.share).ok()?.is_none() {
        return separated();
    }
    // Inside. If the pass began before this face, it was passed on the way: it is pushed ahead of the part.
    let before = segment_triangle(part.from.a, part.from.b, face.corners);
    // Otherwise it may be the nearest to some point of the axis, and is moved past the part on that account.
    (outward.dot(before.on_segment - before.on_triangle) >= 0.0).then(|| Push::inward(part, face, closest))
}
