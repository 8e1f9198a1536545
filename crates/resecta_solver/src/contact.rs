//! Contacts: a moving plane that a point of the tissue may not pass.

use glam::Vec3;

use crate::ranges::{FURTHEST_MM, within};
use crate::tissue::Motion;
use crate::vectors::{Scalars, Vectors};

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

impl Motion {
    /// Brings a contact's point to its side of the plane at `time` (0 to 1 over an advance of that duration), the nodes
    /// sharing the way by weight and inverse inertia, and takes the velocity that goes against the plane's own.
    pub(crate) fn hold(&mut self, contact: &Contact, time: f32, duration_s: f32, inverse_inertia: &Scalars) {
        let &Contact { point, normal, .. } = contact;
        let along = |vectors: &Vectors| -> f32 {
            let parts = point.parts();
            parts.map(|(node, weight)| weight * vectors.at(node).dot(normal)).sum()
        };
        // Most contacts only come near: this first.
        let offset = contact.offset_start + time * (contact.offset_end - contact.offset_start);
        let depth = offset - along(&self.positions);
        if depth <= 0.0 {
            return;
        }
        let shares = point
            .parts()
            .map(|(node, weight)| (node, weight, weight * inverse_inertia.at(node)));
        let compliance: f32 = shares.clone().map(|(_, weight, share)| share * weight).sum();
        if compliance <= 0.0 {
            return;
        }
        let against = (contact.offset_end - contact.offset_start) / duration_s - along(&self.velocities);
        for (node, _, share) in shares {
            self.positions.add(node, normal * (depth * share / compliance));
            if against > 0.0 {
                self.velocities.add(node, normal * (against * share / compliance));
            }
        }
    }
}
