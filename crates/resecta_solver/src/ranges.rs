//! What single precision can compute with: larger numbers than these are refused by name where they come in.
//!
//! Lengths, stiffnesses and forces are squared and multiplied on the way; within these limits nothing overflows. They lie
//! far outside of what any organ has.

/// Furthest coordinate of a node, and longest rest length, mm: 10 m.
pub(crate) const FURTHEST_MM: f32 = 1e4;

/// Shortest rest length of a spring of a tissue that is built from pentahedra, mm.
pub(crate) const SHORTEST_MM: f32 = 1e-6;

/// Least and largest rest volume of a pentahedron that holds it, mm³.
pub(crate) const SMALLEST_MM3: f32 = 1e-18;
pub(crate) const LARGEST_MM3: f32 = 1e12;

/// Stiffest spring and bed, µN/mm.
pub(crate) const STIFFEST: f32 = 1e18;

/// Heaviest node, g.
pub(crate) const HEAVIEST_G: f32 = 1e12;

/// Largest damping over mass, 1/s.
pub(crate) const MOST_DAMPED: f32 = 1e24;

/// Largest force by which tissue collapses into a cut, a node, µN: the weight of 100 kg.
pub(crate) const STRONGEST_COLLAPSE_UN: f32 = 1e9;

/// Whether a number lies in a range; NaN lies in none.
pub(crate) fn within(value: f32, least: f32, most: f32) -> bool {
    value >= least && value <= most
}
