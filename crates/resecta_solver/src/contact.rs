//! Contacts: a moving plane that a point of the tissue may not pass.

use glam::Vec3;

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
    pub(crate) fn is_finite(&self) -> bool {
        self.normal.is_finite()
            && self.offset_start.is_finite()
            && self.offset_end.is_finite()
            && self.weights.iter().all(|weight| weight.is_finite())
    }
}
