//! Points of the tissue that tools are kept out of.
//!
//! Three kinds of points stand for the tissue near a part of a tool. A node stands for the tissue around it, deep inside included: a
//! surface that is held while what lies behind it is pushed through it is turned inside out. A vertex of the fine surface stands for
//! what a cut laid bare. Points of a grid stand for exposed faces that no cut has reached, as close as the part's radius asks for.

use bevy::prelude::*;
use resecta_solver::{NodeKind, Segment, TissuePoint};

use super::sweep::PartSweep;
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
        /// Into how many steps its edges are divided.
        steps: u32,
        /// The point's number in that grid.
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
    /// Pentahedra with points on their surface, and a ball around each.
    pub pentahedra: Vec<(u32, Ball)>,
}

/// The ball around a pentahedron.
#[derive(Debug, Clone, Copy)]
pub struct Ball {
    pub centre: Vec3,
    pub radius: f32,
    /// How far a corner goes in the step by its present velocity, mm; 2 at most.
    pub way: f32,
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
        let around = solver.nodes_near(&segments(STRETCH * solver.reach_mm()));
        let has_surface = |pentahedron: &u32| match fine.filter(|fine| fine.field().is_touched(*pentahedron)) {
            Some(fine) => !fine.field().chunks_of(*pentahedron).is_empty(),
            None => solver.surface().is_exposed(*pentahedron),
        };
        let mut pentahedra: Vec<u32> = (around.iter())
            .flat_map(|&node| solver.pentahedra_around(node))
            .filter(has_surface)
            .collect();
        pentahedra.sort_unstable();
        pentahedra.dedup();
        let is_near = |ball: &Ball| {
            let mut parts = parts.iter();
            parts.any(|(_, part)| {
                part.gaps(ball.centre).1 < ball.radius + ball.way + part.reach_mm() - part.contact_radius()
            })
        };
        let pentahedra = pentahedra
            .into_iter()
            .map(|pentahedron| (pentahedron, Ball::around(solver, pentahedron, step_s)));
        let is_kept = |node: &u32| fine.is_none_or(|fine| fine.field().is_node_kept(*node));
        let nodes = solver.nodes_near(&segments(0.0)).into_iter().filter(is_kept);
        Near {
            nodes: nodes
                .filter_map(|node| {
                    let way = (solver.velocity(node).length() * step_s).min(FURTHEST_MM);
                    Some((node, solver.pentahedra_around(node).next()?, way))
                })
                .collect(),
            pentahedra: pentahedra.filter(|(_, ball)| is_near(ball)).collect(),
        }
    }
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

/// Calls back with points of the exposed faces of a pentahedron, as close as a part asks for. `grid` makes a whole number of steps along
/// the edges of a face, known by its slot, of the number that they are to be at least.
pub fn of_faces(
    skin: &Skin,
    pentahedron: u32,
    part: &PartSweep,
    grid: impl Fn(u32, f32) -> u32,
    mut found: impl FnMut(Sample),
) {
    let solver = skin.solver();
    let apart_mm = apart_mm(part.contact_radius());
    for (slot, triangle) in solver.surface().triangles_of(pentahedron) {
        let [a, b, c] = triangle.map(|node| solver.position(node));
        let longest = part.longest_across([a, b, c]);
        let steps = grid(slot, (longest / apart_mm).min(MOST_STEPS));
        let inward = part.is_thin().then(|| -(b - a).cross(c - a).normalize_or_zero());
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

/// A face as long as this many times what its points are apart has no more of them.
const MOST_STEPS: f32 = 24.0;

/// How far points of a surface may be apart before a part of such a radius, mm: the chord that dips by [`DIP_MM`].
pub fn apart_mm(radius_mm: f32) -> f32 {
    2.0 * (2.0 * radius_mm * DIP_MM - DIP_MM * DIP_MM).max(DIP_MM * DIP_MM).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_points_of_a_face_are_as_near_as_the_radius_asks_for() {
        for radius in [0.2, 0.4, 1.0, 4.0] {
            let half = 0.5 * apart_mm(radius);
            let dip = radius - (radius * radius - half * half).sqrt();
            assert!((dip - DIP_MM).abs() < 1e-4, "{radius}: {dip}");
        }
    }
}
