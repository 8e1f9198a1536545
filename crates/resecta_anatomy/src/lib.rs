//! Cases of the prostate and the lattice built from them.
//!
//! A [`Case`] holds what a clinician drew: closed contours of capsule, urethra and transition zone on transverse slices,
//! and landmarks. [`Lattice::build`] turns a case into a volumetric lattice of nodes and pentahedra (papers: 2003, II.B;
//! second paper, 3). Nothing here knows of Bevy, and nothing here moves: motion is `resecta_solver`.
//!
//! Axes, for every case: `+x` patient left, `+y` posterior, `+z` towards the bladder. Lengths are millimetres.

mod case;
mod lattice;
pub mod quality;
mod sampling;
mod shape;
mod spline;
pub mod wedge;
mod zone;
mod zoning;

pub use case::{Approximation, Case, CaseSource, Contour, Landmarks, Slice, Unit};
pub use lattice::{Boundary, Lattice, LatticeError, LatticeOptions, MAX_NODES, Section};
pub use quality::LatticeQuality;
pub use shape::{AXIS_STEPS, DIAGONAL_STEPS, LatticeShape};
pub use zone::Zone;
