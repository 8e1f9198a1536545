//! Contacts: a moving plane that a point of the tissue may not pass.

use glam::Vec3;

use crate::ranges::{FURTHEST_MM, within};
use crate::tissue::Motion;
use crate::vectors::{Place, Scalars, Vectors};

/// A point of the tissue: where the weighted mean of some nodes is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TissuePoint {
    nodes: [u32; 6],
    /// Together 1; 0 past the last node.
    weights: [f32; 6],
}

impl TissuePoint {
    /// A node.
    pub fn node(node: u32) -> TissuePoint {
        TissuePoint::on_triangle([node; 3], [1.0, 0.0, 0.0])
    }

    /// A point of a triangle, by barycentric weights; 0 to 1, together 1.
    pub fn on_triangle([a, b, c]: [u32; 3], [at_a, at_b, at_c]: [f32; 3]) -> TissuePoint {
        TissuePoint::in_pentahedron([a, b, c, a, a, a], [at_a, at_b, at_c, 0.0, 0.0, 0.0])
    }

    /// A point of a pentahedron, by the weights of its corners; 0 to 1, together 1.
    pub fn in_pentahedron(nodes: [u32; 6], weights: [f32; 6]) -> TissuePoint {
        TissuePoint { nodes, weights }
    }

    /// The point a share (0 to 1) of the way to another one that is told by the same nodes; none if it is not.
    pub fn towards(&self, other: &TissuePoint, share: f32) -> Option<TissuePoint> {
        let weights = std::array::from_fn(|n| self.weights[n] + share * (other.weights[n] - self.weights[n]));
        (self.nodes == other.nodes).then_some(TissuePoint { weights, ..*self })
    }

    /// The nodes that count, and their weights.
    #[inline]
    pub fn parts(&self) -> impl Iterator<Item = (u32, f32)> + Clone {
        self.nodes
            .into_iter()
            .zip(self.weights)
            .filter(|(_, weight)| *weight != 0.0)
    }
}

/// Keeps one point of the tissue on one side of a plane during one advance.
///
/// The rule is `normal · Σ weight·position >= offset`; the offset moves linearly from `offset_start` to `offset_end` over
/// the advance, so that a fast tool pushes rather than hits.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Contact {
    /// The point touched.
    pub point: TissuePoint,
    /// Unit direction in which the tissue is pushed.
    pub normal: Vec3,
    /// Offset of the plane along the normal when the advance begins, mm.
    pub offset_start: f32,
    /// The same when it ends, mm.
    pub offset_end: f32,
}

impl Contact {
    /// Whether it can be held: its numbers are finite, and the plane lies within the range of places.
    pub(crate) fn is_usable(&self) -> bool {
        let near = |offset: f32| within(offset, -FURTHEST_MM, FURTHEST_MM);
        self.normal.is_finite()
            && near(self.offset_start)
            && near(self.offset_end)
            && self.point.weights.iter().all(|weight| weight.is_finite())
    }
}

/// A contact made ready for an advance: where its nodes lie and how they share its way are looked up once, not every substep.
#[derive(Debug, Clone)]
pub(crate) struct Hold {
    /// The nodes that count, so many of them.
    parts: [Part; 6],
    count: usize,
    /// The sum of weight times share, 1/g; above 0.
    compliance: f32,
    normal: Vec3,
    /// Of the plane when the advance begins, mm.
    offset_start: f32,
    /// How far the plane goes in the advance, mm, and how fast, mm/s.
    way: f32,
    speed: f32,
}

/// A node of a contact.
#[derive(Debug, Clone, Copy, Default)]
struct Part {
    place: Place,
    weight: f32,
    /// Its weight times its inverse inertia, 1/g: over the compliance, which part of the contact's way it goes.
    share: f32,
}

impl Hold {
    /// The contact, in an advance of that duration, the nodes sharing its way by weight and inverse inertia; none if it has
    /// none that moves.
    pub fn new(contact: &Contact, duration_s: f32, inverse_inertia: &Scalars) -> Option<Hold> {
        let (mut parts, mut count) = ([Part::default(); 6], 0);
        for ((node, weight), part) in contact.point.parts().zip(&mut parts) {
            *part = Part {
                place: inverse_inertia.place(node),
                weight,
                share: weight * inverse_inertia.at(node),
            };
            count += 1;
        }
        let compliance: f32 = parts[..count].iter().map(|part| part.share * part.weight).sum();
        if compliance <= 0.0 {
            return None;
        }
        let way = contact.offset_end - contact.offset_start;
        Some(Hold {
            parts,
            count,
            compliance,
            normal: contact.normal,
            offset_start: contact.offset_start,
            way,
            speed: way / duration_s,
        })
    }
}

impl Motion {
    /// Brings a contact's point to its side of the plane at `time` (0 to 1 over the advance) and takes the velocity that goes
    /// against the plane's own.
    #[inline(always)]
    pub(crate) fn hold(&mut self, held: &Hold, time: f32) {
        let (normal, parts, compliance) = (held.normal, &held.parts[..held.count], held.compliance);
        let along = |vectors: &Vectors| -> f32 {
            let parts = parts.iter();
            parts
                .map(|part| part.weight * vectors.at_place(part.place).dot(normal))
                .sum()
        };
        // Most contacts only come near: this first.
        let depth = (held.offset_start + time * held.way) - along(&self.positions);
        if depth <= 0.0 {
            return;
        }
        let against = held.speed - along(&self.velocities);
        for part in parts {
            self.positions
                .add_at(part.place, normal * (depth * part.share / compliance));
            if against > 0.0 {
                self.velocities
                    .add_at(part.place, normal * (against * part.share / compliance));
            }
        }
    }
}
