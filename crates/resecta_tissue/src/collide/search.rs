//! Finds the points near a tool that its parts may touch in a step.
//!
//! A part is held off by every node, by every point of a face that no cut has reached, and by few of the many points of a pentahedron's
//! cut surface: what a pentahedron carries moves with it. Before a thick part these are as far apart as points of a face, and only the
//! deepest of a pentahedron that the part has pierced. Before a thin one it is one: a slit that is narrower than
//! the pentahedron has two walls, and a part between them cannot hold off both. Of faces that no cut has reached it is all points of one
//! side.

use bevy::{
    platform::collections::{HashMap, HashSet},
    prelude::*,
};
use resecta_field::CHUNK;
use resecta_solver::{Touch, with_widest_registers};

use super::{
    contacts::{Found, MARGIN_MM},
    eights::Eight,
    overlap::Overlap,
    samples::{self, Near, Sample, SampleId},
    sweep::PartSweep,
};
use crate::{fine::Fine, skin::Skin, tool::ToolPartKind};

/// What held a pentahedron in the last step goes on to do so unless another point comes nearer, or lies further out, by this much, mm: by
/// turns, tissue around an instrument at rest would tremble.
const KEEPS_MM: f32 = 0.2;
/// A surface faces a thin part if the cosine between the way to it and the way into it is at least this.
const FACES: f32 = 0.3;
/// Faces of a pentahedron look the same way if the cosine between their normals is above this.
const SAME_SIDE: f32 = 0.8;
/// A grid on a face stays as fine as it was until this share of its steps would do.
const KEEPS_GRID: f32 = 0.4;
/// A thin part goes on to push a pentahedron the way that it did before unless another way is deeper by this much, mm, for one that turns
/// by 60 degrees: pushed now here, now there it would turn to and fro.
const KEEPS_WAY_MM: f32 = 0.5;
/// A pentahedron with a corner that goes further than this in a step turns, mm: what it comes to lie on the part with is not what was nearest.
/// Such a one is held by points twice as close. With fewer, light cells that a cut left beside the sheath swung by millimetres from step to
/// step, and lay up to 1.8 mm deep in it.
const TURNS_MM: f32 = 0.5;
/// A pentahedron with a point deeper than this share of a thick part's radius is pierced by it, and goes out as a whole: pushed to both sides
/// of the axis it would be stretched without end.
const PIERCED: f32 = 0.6;

/// What tools pushed in a step: points by tool and part, and pentahedra with the way in which they were pushed.
#[derive(Debug, Default)]
pub struct Before {
    points: HashSet<(u32, u32, SampleId)>,
    pentahedra: HashMap<(u32, u32, u32), Vec3>,
    /// Into how many steps edges of exposed faces were divided, by tool, part and slot.
    grids: HashMap<(u32, u32, u32), u32>,
}

impl Before {
    /// Replaces what it holds by what became of the contacts of a step.
    pub fn renew(&mut self, found: &[Found], touches: impl Iterator<Item = Touch>) {
        self.points.clear();
        self.pentahedra.clear();
        self.grids.clear();
        for (found, touch) in found.iter().zip(touches) {
            self.add(found, &touch);
        }
    }

    /// The number of steps along the edges of a face, `least` or more: the number of the last step, unless that is too small or far too large.
    /// A number that changed to and fro would move the points.
    fn grid(&self, key: (u32, u32, u32), least: f32) -> u32 {
        let fresh = least.ceil().max(1.0) as u32;
        let kept = |steps: &u32| least <= *steps as f32 && least > KEEPS_GRID * *steps as f32;
        self.grids.get(&key).copied().filter(kept).unwrap_or(fresh)
    }

    fn add(&mut self, found: &Found, touch: &Touch) {
        if touch.normal == Vec3::ZERO {
            return;
        }
        self.points.insert(found.key());
        if let SampleId::Face { slot, steps, .. } = found.id {
            self.grids.insert((found.tool, found.part, slot), steps);
        }
        if !matches!(found.id, SampleId::Node(_)) {
            self.pentahedra
                .insert((found.tool, found.part, found.pentahedron), touch.normal);
        }
    }
}

/// Parts of a tool on their way through the step, with what it needs to find contacts.
pub struct Search<'a> {
    pub skin: &'a Skin<'a>,
    pub fine: Option<&'a Fine>,
    pub near: &'a Near,
    /// Index of the tool among those of the step.
    pub tool: u32,
    /// The parts with their indices in the tool.
    pub parts: &'a [(u32, PartSweep)],
    /// What was pushed in the last step.
    pub before: &'a Before,
}

/// A point that may become a contact.
#[derive(Debug, Clone, Copy)]
struct Candidate {
    sample: Sample,
    /// Distance from the part when the step begins, and the least one on its way.
    gap: f32,
    nearest: f32,
}

/// What was found of one part.
#[derive(Default)]
struct OfPart {
    found: Vec<Found>,
    candidates: Vec<Candidate>,
    deepest_mm: f32,
    /// Pentahedra with a point inside the part.
    inside: Vec<u32>,
}

impl Search<'_> {
    /// Puts what the parts may touch at the end of `found`: part by part, nodes, then points of pentahedra, each by ascending index.
    /// Returns how much tissue lies in the parts when the step begins.
    pub fn find(&self, found: &mut Vec<Found>) -> Overlap {
        with_widest_registers(
            #[inline(always)]
            || self.find_all(found),
        )
    }

    #[inline(always)]
    fn find_all(&self, found: &mut Vec<Found>) -> Overlap {
        let mut of_parts: Vec<OfPart> = Vec::new();
        of_parts.resize_with(self.parts.len(), OfPart::default);
        for (number, of_part) in of_parts.iter_mut().enumerate() {
            self.find_nodes(number, of_part);
        }
        let (mut near, mut reached): (Vec<u8>, Vec<usize>) = (Vec::new(), Vec::new());
        for (balls, pentahedra) in self.near.balls.iter().zip(self.near.pentahedra.chunks(CHUNK)) {
            near.clear();
            near.extend(self.parts.iter().map(|(_, part)| part.near_of(balls)));
            for (lane, &(pentahedron, way)) in pentahedra.iter().enumerate() {
                reached.clear();
                reached.extend((0..self.parts.len()).filter(|&number| near[number] >> lane & 1 == 1));
                if reached.is_empty() {
                    continue;
                }
                match self.fine.filter(|fine| fine.field().is_touched(pentahedron)) {
                    Some(fine) => self.find_vertices(fine, (pentahedron, way), &reached, &mut of_parts),
                    None => self.find_points_of_faces((pentahedron, way), &reached, &mut of_parts),
                }
            }
        }
        let mut overlap = Overlap::default();
        let first = found.len();
        for ((_, part), of_part) in self.parts.iter().zip(of_parts) {
            overlap.join(match part.is_thin() {
                true => Overlap {
                    deepest_in_thin_mm: of_part.deepest_mm,
                    ..default()
                },
                false => Overlap {
                    deepest_mm: of_part.deepest_mm,
                    volume_mm3: self.volume_inside_mm3(part, of_part.inside),
                    ..default()
                },
            });
            found.extend(of_part.found);
        }
        keep_nearest_of_wire(found, first);
        overlap
    }

    #[inline(always)]
    fn find_nodes(&self, number: usize, of_part: &mut OfPart) {
        let part = &self.parts[number].1;
        let solver = self.skin.solver();
        for (places, nodes) in self.near.places.iter().zip(self.near.nodes.chunks(CHUNK)) {
            let near = part.near_of(places);
            for (_, &(node, pentahedron, way)) in (nodes.iter().enumerate()).filter(|(lane, _)| near >> lane & 1 == 1) {
                let place = solver.position(node);
                let (gap, nearest) = part.gaps(place);
                if nearest >= self.within(part, way) {
                    continue;
                }
                if gap < 0.0 {
                    of_part.deepest_mm = of_part.deepest_mm.max(-gap);
                    of_part.inside.extend(solver.pentahedra_around(node));
                }
                let sample = Sample::of_node(node, pentahedron, place);
                of_part
                    .found
                    .push(self.record(number, &Candidate { sample, gap, nearest }));
            }
        }
    }

    /// Finds vertices of a pentahedron that a cut has reached.
    #[inline(always)]
    fn find_vertices(&self, fine: &Fine, (pentahedron, way): (u32, f32), reached: &[usize], of_parts: &mut [OfPart]) {
        let (field, solver) = (fine.field(), self.skin.solver());
        reached.iter().for_each(|&number| of_parts[number].candidates.clear());
        for &chunk in field.chunks_of(pentahedron) {
            let Some((places, used)) = field.chunk_lanes(chunk, |node| solver.position(node)) else {
                continue;
            };
            let vertices = Eight {
                places,
                further: [way; CHUNK],
            };
            for &number in reached {
                let part = &self.parts[number].1;
                let within = self.within(part, way);
                let near = part.near_of(&vertices);
                for n in (0..CHUNK).filter(|&n| (used & near) >> n & 1 == 1) {
                    let [x, y, z] = vertices.places;
                    let sample = Sample {
                        id: SampleId::Vertex(fine.surface().chunk_start(chunk) + n as u32),
                        place: Vec3::new(x[n], y[n], z[n]),
                        pentahedron,
                        inward: None,
                        weights: [0.0; 3],
                    };
                    self.consider(number, sample, within, &mut of_parts[number]);
                }
            }
        }
        for &number in reached {
            let of_part = &mut of_parts[number];
            of_part.note_depth(pentahedron);
            let mut candidates = std::mem::take(&mut of_part.candidates);
            self.keep_one_side(number, pentahedron, &mut candidates);
            if !self.parts[number].1.is_thin() {
                self.keep_some(number, way, &mut candidates);
            }
            of_part
                .found
                .extend(candidates.iter().map(|candidate| self.record(number, candidate)));
            of_part.candidates = candidates;
        }
    }

    /// Finds points of the exposed faces of a pentahedron that no cut has reached.
    fn find_points_of_faces(&self, (pentahedron, way): (u32, f32), reached: &[usize], of_parts: &mut [OfPart]) {
        for &number in reached {
            let (index, part) = &self.parts[number];
            let of_part = &mut of_parts[number];
            of_part.candidates.clear();
            let grid = |slot: u32, least: f32| self.before.grid((self.tool, *index, slot), least);
            let within = self.within(part, way);
            samples::of_faces(self.skin, pentahedron, (*index, part), grid, |sample| {
                let faces = |inward: Vec3| part.away(sample.place).dot(inward) >= FACES;
                if sample.inward.is_none_or(faces) {
                    self.consider(number, sample, within, of_part);
                }
            });
            of_part.note_depth(pentahedron);
            let OfPart { found, candidates, .. } = of_part;
            self.keep_one_side(number, pentahedron, candidates);
            found.extend(candidates.iter().map(|candidate| self.record(number, candidate)));
        }
    }

    /// Takes a point for a candidate if it may touch the part.
    #[inline(always)]
    fn consider(&self, number: usize, sample: Sample, within: f32, of_part: &mut OfPart) {
        let part = &self.parts[number].1;
        let (gap, nearest) = match sample.inward {
            None => part.gaps(sample.place),
            Some(inward) => part.gaps_along(sample.place, inward),
        };
        if nearest < within {
            of_part.candidates.push(Candidate { sample, gap, nearest });
        }
    }

    /// How near a point comes that becomes a contact, mm, if it goes such a way by itself.
    fn within(&self, part: &PartSweep, way: f32) -> f32 {
        MARGIN_MM + part.motion() + way
    }

    /// The candidate of a pentahedron that a thin part pushes furthest, the way that it did before.
    fn deepest(&self, number: usize, pentahedron: u32, candidates: &[Candidate]) -> Option<Candidate> {
        let (index, part) = &self.parts[number];
        let before = self.before.pentahedra.get(&(self.tool, *index, pentahedron));
        let depth = |candidate: &Candidate| {
            let kept = before.map_or(0.0, |before| before.dot(part.away(candidate.sample.place)));
            2.0 * KEEPS_WAY_MM * kept - candidate.nearest
        };
        let deeper = |one: &&Candidate, other: &&Candidate| depth(one).total_cmp(&depth(other));
        candidates.iter().max_by(deeper).copied()
    }

    /// Keeps of a pentahedron's candidates those that a part pushes to the same side as the deepest: pushed at opposite faces, or to both
    /// sides of an axis, a pentahedron would be turned inside out.
    fn keep_one_side(&self, number: usize, pentahedron: u32, candidates: &mut Vec<Candidate>) {
        let Some(deepest) = self.deepest(number, pentahedron, candidates) else {
            return;
        };
        let part = &self.parts[number].1;
        if !part.is_thin() {
            if -deepest.gap > PIERCED * part.contact_radius() {
                *candidates = vec![deepest];
                return;
            }
            let way = part.away(deepest.sample.place);
            candidates.retain(|candidate| part.away(candidate.sample.place).dot(way) > 0.0);
            return;
        }
        let is_same = |candidate: &Candidate| candidate.sample.id == deepest.sample.id;
        let looks_alike = |candidate: &Candidate| {
            let both = candidate.sample.inward.zip(deepest.sample.inward);
            both.is_some_and(|(one, other)| one.dot(other) > SAME_SIDE)
        };
        candidates.retain(|candidate| is_same(candidate) || looks_alike(candidate));
    }

    /// Keeps of a pentahedron's candidates the one that comes nearest to a thick part, then again the nearest of those that are not close
    /// to one that is kept, as close as points of a face are: a face that is held at its rims only dips in between.
    fn keep_some(&self, number: usize, way: f32, candidates: &mut Vec<Candidate>) {
        let (index, part) = &self.parts[number];
        let at_rest_mm = samples::apart_mm(part.contact_radius());
        let apart_mm = if way < TURNS_MM { at_rest_mm } else { 0.5 * at_rest_mm };
        let is_held = |candidate: &Candidate| self.before.points.contains(&(self.tool, *index, candidate.sample.id));
        let mut ordered: Vec<(f32, Candidate)> = (candidates.drain(..))
            .map(|candidate| {
                let kept = if is_held(&candidate) { KEEPS_MM } else { 0.0 };
                (candidate.nearest - kept, candidate)
            })
            .collect();
        ordered.sort_by(|one, other| one.0.total_cmp(&other.0).then(one.1.sample.id.cmp(&other.1.sample.id)));
        for (_, candidate) in ordered {
            let is_close =
                |kept: &Candidate| kept.sample.place.distance_squared(candidate.sample.place) < apart_mm * apart_mm;
            if !candidates.iter().any(is_close) {
                candidates.push(candidate);
            }
        }
        candidates.sort_unstable_by_key(|candidate| candidate.sample.id);
    }

    /// Roughly how much of some pentahedra lies in a part when the step begins, mm³: by their middles and the points half way from
    /// there to their corners.
    fn volume_inside_mm3(&self, part: &PartSweep, mut pentahedra: Vec<u32>) -> f32 {
        pentahedra.sort_unstable();
        pentahedra.dedup();
        let solver = self.skin.solver();
        let inside_mm3 = |pentahedron: u32| {
            let corners = solver.pentahedron_nodes(pentahedron).map(|node| solver.position(node));
            let centre = corners.iter().sum::<Vec3>() / 6.0;
            let points = corners.iter().map(|corner| 0.5 * (*corner + centre)).chain([centre]);
            let inside = points.filter(|&point| part.gaps(point).0 < 0.0).count();
            let volume_mm3 = solver.volume_of(pentahedron).abs() * solver.fill(pentahedron);
            volume_mm3 as f32 * inside as f32 / 7.0
        };
        pentahedra.into_iter().map(inside_mm3).sum()
    }

    fn record(&self, number: usize, candidate: &Candidate) -> Found {
        let Candidate { sample, gap, .. } = candidate;
        let (index, part) = &self.parts[number];
        Found {
            tool: self.tool,
            part: *index,
            kind: part.kind,
            id: sample.id,
            pentahedron: sample.pentahedron,
            surface: sample.kind(self.skin),
            point: sample.carriers(self.skin),
            place: sample.place,
            away: part.away(sample.place),
            inward: sample.inward,
            gap_mm: *gap,
        }
    }
}

impl OfPart {
    /// Notes how deep the candidates of a pentahedron lie.
    fn note_depth(&mut self, pentahedron: u32) {
        let deepest = self
            .candidates
            .iter()
            .map(|candidate| -candidate.gap)
            .fold(0.0, f32::max);
        if deepest > 0.0 {
            self.deepest_mm = self.deepest_mm.max(deepest);
            self.inside.push(pentahedron);
        }
    }
}

impl PartSweep {
    /// How far a point is from the part's surface, mm: when the step begins, and at the nearer end of its way.
    #[inline(always)]
    pub fn gaps(&self, place: Vec3) -> (f32, f32) {
        let radius = self.contact_radius();
        let first = self.from.at(self.from.share_nearest(place)).distance(place) - radius;
        let last = self.to.at(self.to.share_nearest(place)).distance(place) - radius;
        (first, first.min(last))
    }

    /// The same of a thin part, which may have passed a point that goes out in a direction of its own.
    #[inline(always)]
    fn gaps_along(&self, place: Vec3, inward: Vec3) -> (f32, f32) {
        let radius = self.contact_radius();
        let [first, last] = [&self.from, &self.to].map(|axis| {
            let away = place - axis.at(axis.share_nearest(place));
            let deep = away.dot(inward);
            // Passed only if it lies straight behind.
            let is_passed = deep < 0.0 && away.length_squared() - deep * deep < radius * radius;
            if is_passed {
                deep - radius
            } else {
                away.length() - radius
            }
        });
        (first, first.min(last))
    }

    /// The unit direction from the axis to a place when the step begins.
    #[inline(always)]
    fn away(&self, place: Vec3) -> Vec3 {
        (place - self.from.at(self.from.share_nearest(place))).normalize_or(Vec3::Y)
    }
}

/// Of what was found from `first` on, keeps for each point the two pieces of a wire that are nearest to it: all pieces are within reach
/// of it, and those further on say nothing that these do not.
fn keep_nearest_of_wire(found: &mut Vec<Found>, first: usize) {
    let is_wire = |found: &Found| found.kind == ToolPartKind::Loop;
    let start = first + found[first..].iter().position(is_wire).unwrap_or(found.len() - first);
    let mut wire = found.split_off(start);
    wire.sort_by(|one, other| one.id.cmp(&other.id).then(one.gap_mm.total_cmp(&other.gap_mm)));
    let mut count = (None, 0);
    wire.retain(|found| {
        count = if count.0 == Some(found.id) {
            (count.0, count.1 + 1)
        } else {
            (Some(found.id), 1)
        };
        count.1 <= 2
    });
    wire.sort_by_key(|found| (found.part, found.id));
    found.extend(wire);
}
