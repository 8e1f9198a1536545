//! Points of the tissue that tools are kept out of.
//!
//! Three kinds of points stand for the tissue near a part of a tool. A node stands for the tissue around it, deep inside included: a
//! surface that is held while what lies behind it is pushed through it is turned inside out. A vertex of the fine surface stands for
//! what a cut laid bare. Points of exposed faces stand for those that no cut has reached: before a thick part a grid, as close as its radius
//! asks for, before a thin one mostly those under its axis.

use bevy::prelude::*;
use resecta_solver::{NodeKind, Segment, TissuePoint};

use super::{
    closest::segment_triangle,
    eights::Eight,
    sweep::{Axis, PartSweep},
};
use crate::{components::Tissue, skin::Skin};

/// A face is sampled so finely that a part of its radius sinks in by less than this between two points, mm. Points of a face may lie as
/// deep in the part, so that it makes no difference how many there are.
pub const DIP_MM: f32 = 0.1;

/// How far tissue is expected to go in a step at most, mm: beyond 120 mm/s it is still found, where it is held then.
const FURTHEST_MM: f32 = 2.0;

/// Stretch up to which a pentahedron is still found, relative to its size at rest.
const STRETCH: f32 = 1.25;

/// Which point of the tissue it is, in a given state of its surface.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum SampleId {
    /// A node.
    Node(u32),
    /// A vertex of the fine surface.
    Vertex(u32),
    /// A point of an exposed face.
    Face {
        /// The slot of the face in the solver's surface.
        slot: u32,
        /// Into how many steps its edges are divided for a grid; 0 of a point before a thin part.
        steps: u32,
        /// The point's number in that grid, or among those before thin parts.
        number: u32,
    },
}

/// A point of the tissue.
#[derive(Debug, Clone, Copy)]
pub struct Sample {
    pub id: SampleId,
    /// Where it is, mm.
    pub place: Vec3,
    /// The pentahedron that carries it.
    pub pentahedron: u32,
    /// Unit direction into the tissue, of a point of its surface before a thin part; `None` of others.
    pub inward: Option<Vec3>,
    /// Its weights among the corners of an exposed face; of no other point.
    pub weights: [f32; 3],
}

impl Sample {
    /// A node and a pentahedron around it.
    pub fn of_node(node: u32, pentahedron: u32, place: Vec3) -> Sample {
        Sample {
            id: SampleId::Node(node),
            place,
            pentahedron,
            inward: None,
            weights: [0.0; 3],
        }
    }

    /// The nodes that carry it.
    pub fn carriers(&self, skin: &Skin) -> TissuePoint {
        match self.id {
            SampleId::Node(node) => TissuePoint::node(node),
            SampleId::Vertex(vertex) => skin.carriers(vertex),
            SampleId::Face { slot, .. } => {
                let corners = skin.solver().surface().triangle(slot).unwrap_or_default();
                TissuePoint::on_triangle(corners, self.weights)
            }
        }
    }

    /// What the surface is there.
    pub fn kind(&self, skin: &Skin) -> NodeKind {
        let solver = skin.solver();
        match self.id {
            SampleId::Node(node) => solver.node_kind(node),
            SampleId::Vertex(vertex) => skin.kind(vertex),
            SampleId::Face { slot, .. } => {
                let corners = solver.surface().triangle(slot).unwrap_or_default();
                let [a, b, c] = corners.map(|corner| solver.node_kind(corner));
                // A face of three kinds is of none of them.
                if a == b || a == c {
                    a
                } else if b == c {
                    b
                } else {
                    NodeKind::Inner
                }
            }
        }
    }
}

/// What lies near the parts of a tool.
#[derive(Debug, Default)]
pub struct Near {
    /// Nodes with tissue at them, ascending, a pentahedron around each, and how far it goes in the step by its present velocity, mm.
    pub nodes: Vec<(u32, u32, f32)>,
    /// Their places, looked for as far as they go.
    pub places: Vec<Eight>,
    /// Pentahedra with points on their surface, ascending, and how far a corner goes in the step by its present velocity, mm; 2 at most.
    pub pentahedra: Vec<(u32, f32)>,
    /// The middles of the balls around them, looked for as far as these reach and corners go.
    pub balls: Vec<Eight>,
}

/// The ball around a pentahedron.
struct Ball {
    centre: Vec3,
    radius: f32,
    /// How far a corner goes in the step by its present velocity, mm; 2 at most.
    way: f32,
}

impl Ball {
    /// The ball around a pentahedron's nodes.
    fn around(solver: &resecta_solver::Tissue, pentahedron: u32, step_s: f32) -> Ball {
        let (mut corners, mut fastest) = ([Vec3::ZERO; 6], 0.0f32);
        for (corner, node) in corners.iter_mut().zip(solver.pentahedron_nodes(pentahedron)) {
            *corner = solver.position(node);
            fastest = fastest.max(solver.velocity(node).length_squared());
        }
        let centre = corners.iter().sum::<Vec3>() / 6.0;
        let squared = corners
            .iter()
            .map(|corner| corner.distance_squared(centre))
            .fold(0.0, f32::max);
        Ball {
            centre,
            radius: squared.sqrt(),
            way: (fastest.sqrt() * step_s).min(FURTHEST_MM),
        }
    }
}

impl Near {
    /// Finds what may come within reach of some parts in a step of that length.
    pub fn of(tissue: &Tissue, parts: &[(u32, PartSweep)], step_s: f32) -> Near {
        let (solver, fine) = (&tissue.solver, tissue.fine.as_ref());
        let segments = |more: f32| -> Vec<Segment> {
            let segment = |part: &PartSweep| Segment {
                ends: [part.to.a, part.to.b],
                radius_mm: part.reach_mm() + FURTHEST_MM + more,
            };
            let mut segments: Vec<Segment> = parts.iter().map(|(_, part)| segment(part)).collect();
            join_short(&mut segments);
            segments
        };
        let has_surface = |pentahedron: &u32| match fine.filter(|fine| fine.field().is_touched(*pentahedron)) {
            Some(fine) => !fine.field().chunks_of(*pentahedron).is_empty(),
            None => solver.surface().is_exposed(*pentahedron),
        };
        let around = solver.nodes_near(&segments(STRETCH * solver.reach_mm()));
        let balls: Vec<(u32, Ball)> = (pentahedra_around(solver, &around).filter(has_surface))
            .map(|pentahedron| (pentahedron, Ball::around(solver, pentahedron, step_s)))
            .collect();
        let is_kept = |node: &u32| fine.is_none_or(|fine| fine.field().is_node_kept(*node));
        let nodes = solver.nodes_near(&segments(0.0)).into_iter().filter(is_kept);
        let nodes: Vec<(u32, u32, f32)> = nodes
            .filter_map(|node| {
                let way = (solver.velocity(node).length() * step_s).min(FURTHEST_MM);
                Some((node, solver.pentahedra_around(node).next()?, way))
            })
            .collect();
        Near {
            places: Eight::all(nodes.iter().map(|&(node, _, way)| (solver.position(node), way))),
            nodes,
            balls: Eight::all(balls.iter().map(|(_, ball)| (ball.centre, ball.radius + ball.way))),
            pentahedra: (balls.iter())
                .map(|(pentahedron, ball)| (*pentahedron, ball.way))
                .collect(),
        }
    }
}

/// The pentahedra around some nodes, ascending, each once: nodes share most of theirs.
fn pentahedra_around(solver: &resecta_solver::Tissue, nodes: &[u32]) -> impl Iterator<Item = u32> + use<> {
    let mut seen: Vec<u64> = vec![0; solver.pentahedron_count().div_ceil(64)];
    for pentahedron in nodes.iter().flat_map(|&node| solver.pentahedra_around(node)) {
        seen[pentahedron as usize / 64] |= 1 << (pentahedron % 64);
    }
    let numbers = |(word, bits): (u32, u64)| {
        (0..64)
            .filter(move |bit| bits >> bit & 1 == 1)
            .map(move |bit| 64 * word + bit)
    };
    (0..).zip(seen).filter(|(_, bits)| *bits != 0).flat_map(numbers)
}

/// Joins segments that are much shorter than they are thick, as the pieces of a wire, into one around all of them: all are looked at for
/// every node.
fn join_short(segments: &mut Vec<Segment>) {
    let is_short = |segment: &Segment| segment.ends[0].distance(segment.ends[1]) < segment.radius_mm;
    let short: Vec<Segment> = segments.iter().filter(|segment| is_short(segment)).copied().collect();
    if short.len() < 2 {
        return;
    }
    let ends = || short.iter().flat_map(|segment| segment.ends);
    let centre = ends().sum::<Vec3>() / (2.0 * short.len() as f32);
    let reach = ends().map(|end| end.distance(centre)).fold(0.0, f32::max);
    let radius = short.iter().map(|segment| segment.radius_mm).fold(0.0, f32::max);
    segments.retain(|segment| !is_short(segment));
    segments.push(Segment {
        ends: [centre; 2],
        radius_mm: reach + radius,
    });
}

/// Calls back with points of the exposed faces of a pentahedron, as a part asks for.
///
/// Before a thick part they are those of a grid. So they are before a thin one that goes far in the step: a face that it meets turns, and what
/// comes to lie under it cannot be told. Before others they lie under its axis. `number` tells the part from others of its tool. `grid`
/// makes a whole number of steps along the edges of a face, known by its slot, of the number that they are to be at least.
pub fn of_faces(
    skin: &Skin,
    pentahedron: u32,
    (number, part): (u32, &PartSweep),
    grid: impl Fn(u32, f32) -> u32,
    mut found: impl FnMut(Sample),
) {
    let solver = skin.solver();
    let apart_mm = apart_mm(part.contact_radius());
    if part.is_thin() && part.motion() < apart_mm {
        return under_axis(skin, pentahedron, (number, part), found);
    }
    for (slot, triangle) in solver.surface().triangles_of(pentahedron) {
        let [a, b, c] = triangle.map(|node| solver.position(node));
        let longest = part.longest_across([a, b, c]);
        let steps = grid(slot, (longest / apart_mm).min(MOST_STEPS));
        let inward = part.is_thin().then(|| inward_of([a, b, c]));
        let mut number = 0;
        for u in 0..=steps {
            for v in 0..=steps - u {
                let w = steps - u - v;
                // The corners are nodes, which stand for themselves.
                if [u, v, w].contains(&steps) {
                    continue;
                }
                let weights = [u, v, w].map(|share| share as f32 / steps as f32);
                found(Sample {
                    id: SampleId::Face { slot, steps, number },
                    place: a * weights[0] + b * weights[1] + c * weights[2],
                    pentahedron,
                    inward,
                    weights,
                });
                number += 1;
            }
        }
    }
}

/// Calls back with the points of the exposed faces of a pentahedron that lie under the axis of a part. Face and axis are straight, so that a
/// face that is held where it begins and ends to lie under the axis is held in between. One that does not lie under it is held where it is
/// nearest.
fn under_axis(skin: &Skin, pentahedron: u32, (number, part): (u32, &PartSweep), mut found: impl FnMut(Sample)) {
    let solver = skin.solver();
    // A part that goes on along its own axis, or hardly goes, asks for the same points twice.
    let is_apart = |place: Vec3, others: &[Vec3]| others.iter().all(|other| other.distance(place) > SAME_MM);
    for (slot, triangle) in solver.surface().triangles_of(pentahedron) {
        let corners = triangle.map(|node| solver.position(node));
        let [a, b, c] = corners;
        let inward = inward_of(corners);
        let (mut places, mut count) = ([Vec3::INFINITY; MOST_UNDER], 0);
        for weights in [&part.to, &part.from].into_iter().flat_map(|axis| under(axis, corners)) {
            let place = a * weights[0] + b * weights[1] + c * weights[2];
            if is_apart(place, &places) {
                let number = number * MOST_UNDER as u32 + count as u32;
                places[count] = place;
                count += 1;
                let id = SampleId::Face { slot, steps: 0, number };
                found(Sample {
                    id,
                    place,
                    pentahedron,
                    inward: Some(inward),
                    weights,
                });
            }
        }
    }
}

/// The unit direction into the tissue at a face.
fn inward_of([a, b, c]: [Vec3; 3]) -> Vec3 {
    -(b - a).cross(c - a).normalize_or_zero()
}

/// Most points of a face that lie under the axis where a step begins and where it ends.
const MOST_UNDER: usize = 4;
/// Points nearer to each other than this hold the same, mm.
const SAME_MM: f32 = 0.1;

/// Where the part of a triangle that lies under an axis begins and ends, as weights of its corners; where none does, its point nearest to
/// the axis.
fn under(axis: &Axis, corners: [Vec3; 3]) -> impl Iterator<Item = [f32; 3]> {
    let [a, b, c] = corners;
    let normal = (b - a).cross(c - a);
    let doubled = normal.length_squared();
    // A weight is linear along the axis: less than 0 where the axis lies beyond the edge across from the corner.
    let weights_at = |place: Vec3| {
        let weight = |from: Vec3, to: Vec3| (to - from).cross(place - from).dot(normal) / doubled;
        [weight(b, c), weight(c, a), weight(a, b)]
    };
    let (first, last) = (weights_at(axis.a), weights_at(axis.b));
    let (mut begins, mut ends) = (0.0f32, 1.0f32);
    for (first, last) in first.into_iter().zip(last) {
        let leaves = first / (first - last);
        match (first < 0.0, last < 0.0) {
            (true, true) => ends = f32::NEG_INFINITY,
            (true, false) => begins = begins.max(leaves),
            (false, true) => ends = ends.min(leaves),
            (false, false) => {}
        }
    }
    let lies_under = doubled > 0.0 && begins <= ends;
    let at = |share: f32| {
        let [u, v, w] = [0, 1, 2].map(|corner| (first[corner] + (last[corner] - first[corner]) * share).max(0.0));
        [u, v, w].map(|weight| weight / (u + v + w))
    };
    let nearest = || segment_triangle(axis.a, axis.b, corners).weights;
    let points = if lies_under {
        [Some(at(begins)), Some(at(ends))]
    } else {
        [Some(nearest()), None]
    };
    points.into_iter().flatten()
}

/// A face as long as this many times what its points are apart has no more of them.
const MOST_STEPS: f32 = 24.0;

/// How far points of a surface may be apart before a part of such a radius, mm: the chord that dips by [`DIP_MM`].
pub fn apart_mm(radius_mm: f32) -> f32 {
    2.0 * (2.0 * radius_mm * DIP_MM - DIP_MM * DIP_MM).max(DIP_MM * DIP_MM).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn place() -> impl Strategy<Value = Vec3> {
        let axis = || -3.0..3.0f32;
        (axis(), axis(), axis()).prop_map(Vec3::from)
    }

    proptest! {
        #[test]
        fn a_face_comes_nowhere_nearer_under_an_axis_than_at_the_points_told(
            (a, b, c) in (place(), place(), place()),
            (from, to) in (place(), place()),
        ) {
            let normal = (b - a).cross(c - a);
            prop_assume!(normal.length() > 0.5);
            let normal = normal.normalize();
            let axis = Axis { a: from, b: to };
            let height = |point: Vec3| normal.dot(point - a);
            let told: Vec<Vec3> = under(&axis, [a, b, c])
                .map(|weights| a * weights[0] + b * weights[1] + c * weights[2])
                .collect();
            let foot = |point: Vec3| point - normal * height(point);
            let under: Vec<Vec3> = (0..=50)
                .map(|share| axis.at(share as f32 / 50.0))
                .filter(|&point| {
                    let sides = [(a, b), (b, c), (c, a)];
                    sides.iter().all(|(p, q)| (q - p).cross(foot(point) - p).dot(normal) > 0.0)
                })
                .collect();
            for point in under {
                // The heights of the axis above the points told enclose those in between.
                let heights: Vec<f32> = told.iter().map(|&told| {
                    let along = foot(to) - foot(from);
                    let share = (told - foot(from)).dot(along) / along.length_squared().max(1e-6);
                    height(axis.at(share.clamp(0.0, 1.0)))
                }).collect();
                let (low, high) = heights.iter().fold((f32::INFINITY, f32::NEG_INFINITY), |(low, high), &height| {
                    (low.min(height), high.max(height))
                });
                let steep = (to - from).dot(normal).abs() / (foot(to) - foot(from)).length().max(1e-3);
                let spare = 1e-3 * (1.0 + steep);
                prop_assert!(height(point) > low - spare && height(point) < high + spare, "{} of {:?}", height(point), heights);
            }
            for point in told {
                prop_assert!(height(point).abs() < 1e-3, "{point} is not of the face");
            }
        }
    }

    #[test]
    fn the_points_of_a_face_are_as_near_as_the_radius_asks_for() {
        for radius in [0.2, 0.4, 1.0, 4.0] {
            let half = 0.5 * apart_mm(radius);
            let dip = radius - (radius * radius - half * half).sqrt();
            assert!((dip - DIP_MM).abs() < 1e-4, "{radius}: {dip}");
        }
    }
}
