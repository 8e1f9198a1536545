//! How much tissue lies inside of a tool: the error of the contacts.

use bevy::prelude::*;

/// How far tissue lies inside the parts of tools that push it.
#[derive(Reflect, Debug, Clone, Copy, Default, PartialEq)]
pub struct Overlap {
    /// The deepest point of the tissue in a part thick enough to see, mm; points of inner tissue count.
    pub deepest_mm: f32,
    /// The same in thin parts: arms and wires.
    pub deepest_in_thin_mm: f32,
    /// Volume of tissue in thick parts, mm³.
    pub volume_mm3: f32,
}

impl Overlap {
    /// Adds what lies in other parts.
    pub fn join(&mut self, other: Overlap) {
        self.deepest_mm = self.deepest_mm.max(other.deepest_mm);
        self.deepest_in_thin_mm = self.deepest_in_thin_mm.max(other.deepest_in_thin_mm);
        self.volume_mm3 += other.volume_mm3;
    }
}
