//! From a part's way and a face to a contact that the solver enforces.

use std::ops::Range;

use bevy::{
    platform::{
        collections::{HashMap, hash_map::Entry},
        hash::FixedHasher,
    },
    prelude::*,
};
use indexmap::{IndexMap, map};
use resecta_solver::{Contact, NodeKind, with_widest_registers};

use super::{
    closest::{ClosestPoints, segment_triangle},
    collider::{Collider, DEPTH_LIMIT_MM, Face, NearRun, Nearby},
    patches::ChunkPart,
    steady::Steady,
    surroundings::{Side, Surroundings, passes_through},
    sweep::PartSweep,
    touch::{self, AT_REST_MM, Touch},
};
use crate::{skin::Skin, tool::ToolPartKind};

/// Faces this much further away than they touch become contacts too, mm: tissue that springs back during a pass finds
/// the tool there.
pub const MARGIN_MM: f32 = 0.5;
/// Tissue this close counts as touched, mm: it rests on the tool to within rounding.
const TOUCH_MM: f32 = 0.02;

/// Faces whose edges dip less than this between corners that are held need no contact of their own, mm.
const DIP_MM: f32 = 0.1;
/// The same along a shaft. A face is held at its point nearest to the part, which is another one in the next step: the
/// points take turns, and tissue around a sheath at rest trembles. Corners stay what they are.
const SHAFT_DIP_MM: f32 = 0.25;

/// Small faces all of whose edges dip less than this between their corners are not looked at themselves, mm: the surface is
/// no truer than that at half a millimetre's spacing.
const POINT_DIP_MM: f32 = 0.25;

/// What a pentahedron carries is pushed the way that it was pushed before unless another way is deeper by this much, mm, for
/// one that turns by 60 degrees: pushed now here, now there it would turn to and fro.
const KEEPS_MM: f32 = 0.5;

/// An arm is thinner than this, mm of its radius.
const THIN_MM: f32 = 1.0;

/// A point of a face with this weight at a corner is the corner.
const CORNER_WEIGHT: f32 = 0.999;

/// A table of what lies in memory in the order in which it came, as what is looked up does mostly: of a table in no order each look-up
/// waits for memory.
pub type InOrder<K, V> = IndexMap<K, V, FixedHasher>;

/// What a contact holds.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Held {
    /// The point of a face nearest to the part.
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
#[derive(Debug, Clone)]
pub struct Found {
    /// Index of the tool among those of the step.
    pub tool: u32,
    /// Index of the part in its tool.
    pub part: u32,
    pub kind: ToolPartKind,
    /// The vertices of the face; of a corner thrice the corner.
    pub vertices: [u32; 3],
    /// The pentahedron that carries the face or, where it is no node, the corner; and what is there.
    pub pentahedron: Option<u32>,
    pub surface: NodeKind,
    pub point: Vec3,
    /// Unit direction in which tissue gives way.
    pub normal: Vec3,
    /// How far the part would reach past the point, mm; negative where it only comes near.
    pub depth: f32,
    /// The pentahedron inside of which all vertices are.
    pub inside: Option<u32>,
    /// The passes of the step that it is for.
    pub passes: Range<u32>,
    /// How far the part moves in these, mm.
    pub motion_mm: f32,
    /// What the solver is to enforce in the course of them; a face whose corners are held is only told.
    pub contact: Option<Contact>,
}

impl Found {
    /// The pentahedron that the part touches; none if it is merely near.
    pub fn touched(&self) -> Option<u32> {
        self.pentahedron.filter(|_| self.depth > -TOUCH_MM)
    }

    /// What the solver is to enforce in one of its passes.
    pub fn contact_in(&self, pass: u32) -> Option<Contact> {
        let contact = self.contact?;
        let passes = self.passes.len() as f32;
        let offset = |pass: u32| {
            let share = (pass - self.passes.start) as f32 / passes;
            contact.offset_start + share * (contact.offset_end - contact.offset_start)
        };
        Some(match self.passes.len() {
            1 => contact,
            _ => Contact {
                offset_start: offset(pass),
                offset_end: offset(pass + 1),
                ..contact
            },
        })
    }
}

/// A part on its way through one pass, with what it needs to find contacts.
pub struct Search<'a> {
    pub collider: &'a Collider,
    pub skin: &'a Skin<'a>,
    pub part: &'a PartSweep,
    /// All that may come within the part's range.
    pub runs: &'a [NearRun],
    /// Indices of the tool and of the part in it.
    pub number: (u32, u32),
    /// Whether the part pushes; else contacts are only told.
    pub pushes: bool,
    /// The passes of the step in which the part goes its way, and how long they take together.
    pub passes: Range<u32>,
    pub pass_s: f32,
}

impl PartSweep {
    /// How far from the axis anything is looked at for this part, mm.
    pub fn range(&self) -> f32 {
        (self.radius + MARGIN_MM + self.motion()).max(DEPTH_LIMIT_MM)
    }

    /// Whether tissue that it lies in is left as it is: an arm at rest is wrapped in flaps that strokes left, which one face would
    /// move past it and another one back. A wire that dents tissue stays outside of it.
    fn may_lie_in_tissue(&self) -> bool {
        self.kind == ToolPartKind::Sheath && self.radius < THIN_MM && self.motion() < AT_REST_MM
    }

    /// Whether faces with edges this long are so small that their corners stand for them.
    fn are_points(&self, longest_mm: f32) -> bool {
        longest_mm <= 2.0 * self.radius && dip(self.radius, longest_mm) < POINT_DIP_MM
    }
}

impl Search<'_> {
    /// Puts the contacts of the part at the end of `found`: faces by ascending slot, at most one each, then corners by
    /// ascending vertex, since later contacts win. Of what a pentahedron carries inside it the deepest is enough.
    pub fn find(&self, nearby: &mut Nearby, found: &mut Vec<Found>) {
        with_widest_registers(
            #[inline(always)]
            || self.find_all(nearby, found),
        );
    }

    #[inline(always)]
    fn find_all(&self, nearby: &mut Nearby, found: &mut Vec<Found>) {
        let Search {
            collider, skin, part, ..
        } = *self;
        let motion = part.motion();
        let near = part.radius + if self.pushes { MARGIN_MM } else { TOUCH_MM };
        // What is inside of a part, or was passed on its way.
        let crossed = part.radius.max(motion + TOUCH_MM);
        let near_or_crossed = near.max(crossed);
        let are_points = |longest_mm| part.are_points(longest_mm);
        collider.near_axis(
            skin,
            (&part.to, self.runs),
            (near_or_crossed, crossed),
            are_points,
            nearby,
        );
        // A plain loop: what collects is compiled for itself, for narrow registers.
        let mut faces: Vec<(Face, ClosestPoints)> = Vec::with_capacity(nearby.faces().len());
        for face in nearby.faces() {
            faces.push((*face, segment_triangle(part.to.a, part.to.b, face.corners)));
        }
        let known = match nearby.points.is_empty() {
            true => near_or_crossed,
            false => crossed,
        };
        let mut surroundings = Surroundings::new(collider, skin, part.to, (&faces, &nearby.points), known);
        let mut candidates = Candidates::new(&collider.steady, self.number, faces.len());
        let mut corners = Corners::new(part, faces.len());
        for (face, closest) in &faces {
            let outward = face.normal();
            let Some(push) = push(&mut surroundings, part, near, (face, outward), *closest) else {
                continue;
            };
            let mut is_covered = false;
            if push.outside && self.pushes {
                let near = corners.near(face, outward, |vertex, touch| {
                    candidates.add(self.corner(vertex, touch));
                });
                let at_corner = push.touch.closest.weights.iter().any(|weight| *weight > CORNER_WEIGHT);
                is_covered = at_corner || is_held_by(part, face, near);
            }
            // Neither enforced nor told otherwise.
            if !is_covered || push.touch.depth() > -TOUCH_MM {
                candidates.add(self.face(&push.face, push.touch, !is_covered));
            }
        }
        let within = match part.may_lie_in_tissue() {
            true => Vec::new(),
            false => surroundings.nearest_from_within(),
        };
        for nearest in within {
            let face = (&nearest.face, nearest.face.normal());
            let push = Push::inward(part, face, nearest.closest);
            candidates.add(self.face(&nearest.face, push.touch, true));
        }
        for points in &nearby.points {
            if let Some((vertex, touch)) = self.deepest_of(points) {
                candidates.add(self.corner(vertex, touch));
            }
        }
        for candidate in candidates.chosen() {
            found.push(self.record(candidate));
        }
    }

    /// Of some vertices of a chunk that the part touches or nearly does, the one that it pushes furthest.
    #[inline(always)]
    fn deepest_of(&self, points: &ChunkPart) -> Option<(u32, Touch)> {
        let (skin, part) = (self.skin, self.part);
        let range = part.radius + MARGIN_MM;
        let is_near = |place: Vec3| part.to.at(part.to.share_nearest(place)).distance_squared(place) <= range * range;
        // Normals cost more than places, and most chunks have no vertex near enough.
        if !points.vertices(skin).any(|(_, vertex)| is_near(skin.place(vertex))) {
            return None;
        }
        let normals = skin.chunk_normals(points.chunk)?;
        let touches = points.vertices(skin).filter_map(|(number, vertex)| {
            let touch = Touch::of_vertex(part, skin.place(vertex), normals[number], range)?;
            Some((vertex, touch))
        });
        // Of equal ones the first.
        touches.reduce(|best, other| if other.1.depth() > best.1.depth() { other } else { best })
    }

    #[inline(always)]
    fn face(&self, face: &Face, touch: Touch, is_held: bool) -> Candidate {
        Candidate {
            held: Held::Face { slot: face.slot },
            vertices: face.vertices,
            pentahedron: Some(self.skin.pentahedron(face.slot, face.vertices)),
            is_inside: !face.vertices.iter().any(|&vertex| self.skin.is_node(vertex)),
            touch,
            is_held,
        }
    }

    #[inline(always)]
    fn corner(&self, vertex: u32, touch: Touch) -> Candidate {
        let pentahedron = self.skin.home(vertex);
        Candidate {
            held: Held::Corner { vertex },
            vertices: [vertex; 3],
            pentahedron,
            is_inside: pentahedron.is_some(),
            touch,
            is_held: true,
        }
    }

    #[inline(always)]
    fn record(&self, candidate: &Candidate) -> Found {
        let Candidate { vertices, touch, .. } = *candidate;
        let enforced = candidate.is_held && self.pushes;
        let (tool, part) = self.number;
        Found {
            tool,
            part,
            kind: self.part.kind,
            vertices,
            pentahedron: candidate.pentahedron,
            surface: most_of(vertices.map(|vertex| self.skin.kind(vertex))),
            point: touch.closest.on_triangle,
            normal: touch.normal,
            inside: candidate.pentahedron.filter(|_| candidate.is_inside),
            passes: self.passes.clone(),
            motion_mm: self.part.motion(),
            depth: touch.depth(),
            contact: enforced.then(|| touch.contact(self.skin, self.part, vertices, self.pass_s)),
        }
    }
}

/// What may become a contact.
#[derive(Debug, Clone, Copy)]
struct Candidate {
    held: Held,
    vertices: [u32; 3],
    pentahedron: Option<u32>,
    /// Whether none of its vertices is a node.
    is_inside: bool,
    touch: Touch,
    /// Whether it is to be enforced, if the part pushes.
    is_held: bool,
}

/// What may become contacts of one part.
struct Candidates<'a> {
    /// The contacts of the pass before, and which part of which tool is looked at.
    before: &'a Steady,
    number: (u32, u32),
    /// Those with a node among their vertices, one for each face and corner.
    at_nodes: InOrder<Held, Candidate>,
    /// Of those inside of a pentahedron, the one that is pushed furthest: the pentahedron moves as one.
    inside: HashMap<Option<u32>, Inside>,
}

/// What may become the contact of a pentahedron, and which way it was pushed before.
struct Inside {
    deepest: Candidate,
    before: Option<Vec3>,
}

impl<'a> Candidates<'a> {
    fn new(before: &'a Steady, number: (u32, u32), faces: usize) -> Self {
        Candidates {
            before,
            number,
            at_nodes: InOrder::with_capacity_and_hasher(faces, FixedHasher),
            inside: HashMap::default(),
        }
    }

    fn add(&mut self, candidate: Candidate) {
        if !candidate.is_inside {
            self.add_at_node(candidate);
            return;
        }
        let Inside { deepest, before } = match self.inside.entry(candidate.pentahedron) {
            Entry::Occupied(known) => known.into_mut(),
            Entry::Vacant(free) => {
                free.insert(Inside {
                    deepest: candidate,
                    before: self.before.direction(self.number, candidate.pentahedron),
                });
                return;
            }
        };
        let depth = |candidate: &Candidate| {
            let kept = before.map_or(0.0, |before| before.dot(candidate.touch.normal));
            candidate.touch.depth() + 2.0 * KEEPS_MM * kept
        };
        let by_depth = |a: &Candidate, b: &Candidate| {
            let by_depth = || depth(a).total_cmp(&depth(b));
            // Of equally deep ones the same one in whatever order they come.
            a.is_held
                .cmp(&b.is_held)
                .then_with(by_depth)
                .then_with(|| b.held.cmp(&a.held))
        };
        if by_depth(&candidate, deepest).is_gt() {
            *deepest = candidate;
        }
    }

    fn add_at_node(&mut self, candidate: Candidate) {
        let known = match self.at_nodes.entry(candidate.held) {
            map::Entry::Occupied(known) => known.into_mut(),
            map::Entry::Vacant(free) => {
                free.insert(candidate);
                return;
            }
        };
        let is_better = match candidate.held {
            // Several faces may lead to the same nearest face: the deepest counts.
            Held::Face { .. } => candidate.touch.depth().total_cmp(&known.touch.depth()).is_gt(),
            // Of the faces around a corner, the one that lets it slip furthest aside: it asks for the shortest way.
            Held::Corner { .. } => candidate.touch.reach.total_cmp(&known.touch.reach).is_lt(),
        };
        if is_better {
            *known = candidate;
        }
    }

    /// All of them, ordered by face and corner.
    fn chosen(&self) -> impl Iterator<Item = &Candidate> {
        let inside = self.inside.values().map(|inside| &inside.deepest);
        let chosen = self.at_nodes.values().chain(inside);
        let mut chosen: Vec<(Held, &Candidate)> = chosen.map(|candidate| (candidate.held, candidate)).collect();
        chosen.sort_unstable_by_key(|(held, _)| *held);
        chosen.into_iter().map(|(_, candidate)| candidate)
    }
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

/// The corners of faces that a part outside of them holds, each looked at once: some six faces share one.
struct Corners<'a> {
    part: &'a PartSweep,
    /// By vertex. Faces come in the order of their patches, and one shares most corners with those just before it.
    known: InOrder<u32, Corner>,
}

/// A corner of faces.
struct Corner {
    /// Where the part is nearest to it; none out of its reach.
    closest: Option<ClosestPoints>,
    /// Whether it was told, and no other face around it tells anything else.
    is_told: bool,
}

impl<'a> Corners<'a> {
    fn new(part: &'a PartSweep, faces: usize) -> Self {
        Self {
            part,
            // About as many as half of the faces.
            known: InOrder::with_capacity_and_hasher(faces / 2, FixedHasher),
        }
    }

    /// Where along the part's axis it holds the corners of a face, `outward` being the face's normal: shares, none for a corner
    /// that it does not hold. Calls back with what has not been told of them for another face.
    #[inline(always)]
    fn near(&mut self, face: &Face, outward: Vec3, mut told: impl FnMut(u32, Touch)) -> [Option<f32>; 3] {
        let part = self.part;
        let mut shares = [None; 3];
        for (share, (vertex, place)) in shares.iter_mut().zip(face.vertices.into_iter().zip(face.corners)) {
            let corner = self.known.entry(vertex).or_insert_with(|| Corner {
                closest: Touch::closest_to_vertex(part, place, part.radius + MARGIN_MM),
                is_told: false,
            });
            let Some(closest) = corner.closest.filter(|closest| touch::faces(closest, outward)) else {
                continue;
            };
            *share = Some(closest.share);
            if !corner.is_told {
                corner.is_told = touch::is_straight(part, closest.share);
                told(vertex, Touch::outside(part, closest, outward));
            }
        }
        shares
    }
}

/// Whether corners that a part holds at shares of its axis keep all of their face out of it.
#[inline(always)]
fn is_held_by(part: &PartSweep, face: &Face, corners: [Option<f32>; 3]) -> bool {
    if corners.iter().any(Option::is_none) {
        return false;
    }
    let is_at_shaft = |share: &f32| *share > 0.0 && *share < 1.0;
    let [a, b, c] = face.corners;
    let longest = |along: Vec3| {
        let across = |edge: Vec3| (edge - along * edge.dot(along)).length();
        across(b - a).max(across(c - b)).max(across(a - c))
    };
    match corners.iter().flatten().all(is_at_shaft) {
        true => dip(part.radius, longest((part.to.b - part.to.a).normalize_or_zero())) < SHAFT_DIP_MM,
        false => dip(part.radius, longest(Vec3::ZERO)) < DIP_MM,
    }
}

/// How far the middle of an edge lies within a cylinder whose surface holds the edge's ends, mm.
fn dip(radius: f32, edge: f32) -> f32 {
    radius - (radius * radius - 0.25 * edge * edge).max(0.0).sqrt()
}

/// A face that a part pushes.
struct Push {
    face: Face,
    touch: Touch,
    /// Whether the part's axis is outside the tissue.
    outside: bool,
}

impl Push {
    /// Tissue goes inward, behind the part.
    fn inward(part: &PartSweep, (face, outward): (&Face, Vec3), closest: ClosestPoints) -> Push {
        let touch = Touch {
            closest,
            normal: -outward,
            reach: part.radius,
            is_inward: true,
        };
        Push {
            face: *face,
            touch,
            outside: false,
        }
    }
}

/// How the part pushes a face near it: from where, and in which direction.
#[inline(always)]
fn push(
    surroundings: &mut Surroundings,
    part: &PartSweep,
    near: f32,
    (face, outward): (&Face, Vec3),
    closest: ClosestPoints,
) -> Option<Push> {
    if outward == Vec3::ZERO {
        return None;
    }
    let distance = closest.distance();
    let side = outward.dot(closest.on_segment - closest.on_triangle);
    let separated = || {
        (distance <= near).then(|| Push {
            face: *face,
            touch: Touch::outside(part, closest, outward),
            outside: true,
        })
    };
    if passes_through(&closest) {
        // The axis passes through the face: tissue goes inward, out of its way.
        let was_through = || passes_through(&segment_triangle(part.from.a, part.from.b, face.corners));
        return (!part.may_lie_in_tissue() || !was_through()).then(|| Push::inward(part, (face, outward), closest));
    }
    if side >= 0.0 {
        return separated();
    }
    // The axis is behind the face's plane: it is inside the tissue, or outside beyond an edge of the face.
    if surroundings.side(closest.share)? == Side::Outside {
        return separated();
    }
    // Inside. If the pass began before this face, it was passed on the way: it is pushed ahead of the part.
    let before = segment_triangle(part.from.a, part.from.b, face.corners);
    // Otherwise it may be the nearest to some point of the axis, and is moved past the part on that account.
    (outward.dot(before.on_segment - before.on_triangle) >= 0.0).then(|| Push::inward(part, (face, outward), closest))
}

#[cfg(test)]
mod tests {
    use super::*;
    use resecta_solver::TissuePoint;

    #[test]
    fn what_a_contact_asks_for_in_its_passes_makes_up_what_it_asks_for() {
        let contact = Contact {
            point: TissuePoint::node(0),
            normal: Vec3::X,
            offset_start: -1.0,
            offset_end: 0.5,
        };
        let found = Found {
            tool: 0,
            part: 0,
            kind: ToolPartKind::Sheath,
            vertices: [0; 3],
            pentahedron: None,
            surface: NodeKind::Inner,
            point: Vec3::ZERO,
            normal: Vec3::X,
            depth: 0.0,
            inside: None,
            passes: 2..5,
            motion_mm: 1.0,
            contact: Some(contact),
        };
        let offsets = (2..5).map(|pass| {
            let in_pass = found.contact_in(pass).unwrap();
            (in_pass.offset_start, in_pass.offset_end)
        });
        assert!(offsets.eq([(-1.0, -0.5), (-0.5, 0.0), (0.0, 0.5)]));
    }
}
