//! Cases of the prostate and the lattice built from them.
//!
//! A [`Case`] holds what a clinician drew: closed contours of capsule, urethra and transition zone on transverse slices,
//! and landmarks. [`Lattice::build`] turns a case into a volumetric lattice of nodes and pentahedra (papers: 2003, II.B;
//! second paper, 3). Nothing here knows of Bevy, and nothing here moves: motion is `resecta_solver`.
//!
//! Axes, for every case: `+x` patient left, `+y` posterior, `+z` towards the bladder. Lengths are millimetres.

mod case;
pub mod wedge;
mod zone;

pub use case::{Approximation, Case, CaseSource, Contour, Landmarks, Slice, Unit};
pub use zone::Zone;
