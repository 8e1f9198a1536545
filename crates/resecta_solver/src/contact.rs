//! Contacts: a moving plane that a point of the tissue may not pass.

use glam::Vec3;

use crate::ranges::{FURTHEST_MM, within};
use crate::tissue::Motion;
use crate::vectors::{Scalars, Vectors};

/// Keeps one point of the tissue, given by three nodes and weights, on one side of a plane during one advance.
///
/// The rule is `normal · Σ weight·position >= offset`; the offset moves linearly from `offset_start` to `offset_end` over
/// the advance, so that a fast tool pushes rather than hits.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Contact {
    /// The nodes of the surface triangle touched.
    pub nodes: [u32; 3],
    /// Barycentric weights of the point touched; 0 to 1, together 1.
    pub weights: [f32; 3],
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
            && self.weights.iter().all(|weight| weight.is_finite())
    }
}

impl Motion {
    /// Brings a contact's point to its side of the plane at `time` (0 to 1 over an advance of that duration), the nodes
    /// sharing the way by weight and inverse inertia, and takes the velocity that goes against the plane's own.
    pub(crate) fn hold(&mut self, contact: &Contact, time: f32, duration_s: f32, inverse_inertia: &Scalars) {
        let Contact {
            nodes, weights, normal, ..
        } = *contact;
        let share = [0, 1, 2].map(|corner| weights[corner] * inverse_inertia.at(nodes[corner]));
        let compliance: f32 = share.iter().zip(&weights).map(|(share, weight)| share * weight).sum();
        if compliance <= 0.0 {
            return;
        }
        let along = |vectors: &Vectors| -> f32 {
            nodes
                .iter()
                .zip(&weights)
                .map(|(&node, weight)| weight * vectors.at(node).dot(normal))
                .sum()
        };
        let offset = contact.offset_start + time * (contact.offset_end - contact.offset_start);
        let depth = offset - along(&self.positions);
        if depth <= 0.0 {
            return;
        }
        let against = (contact.offset_end - contact.offset_start) / duration_s - along(&self.velocities);
        for (&node, share) in nodes.iter().zip(share) {
            self.positions.add(node, normal * (depth * share / compliance));
            if against > 0.0 {
                self.velocities.add(node, normal * (against * share / compliance));
            }
        }
    }
}
