//! Cases of the prostate and the lattice built from them.
//!
//! A [`Case`] holds what a clinician drew: closed contours of capsule, urethra and transition zone on transverse slices,
//! and landmarks. [`Lattice::build`] turns a case into a volumetric lattice of nodes and pentahedra (papers: 2003, II.B;
//! second paper, 3). Nothing here knows of Bevy, and nothing here moves: motion is `resecta_solver`.
//!
//! Axes, for every case: `+x` patient left, `+y` posterior, `+z` towards the bladder. Lengths are millimetres.

mod bladder;
mod case;
mod case_file;
mod complete;
pub mod contour;
pub mod generate;
pub mod import;
mod landmark;
mod lattice;
mod lattice_error;
pub mod quality;
pub mod random;
pub mod reference;
mod sampling;
mod shape;
mod spline;
mod transition_zone;
mod validate;
pub mod vtu;
pub mod wedge;
mod zone;
mod zoning;

pub use bladder::BladderShape;
pub use case::{Approximation, Case, CaseSource, Contour, Landmarks, Slice, Unit};
pub use case_file::{CaseError, MAX_FILE_BYTES};
pub use complete::LUMEN_RADIUS_MM;
pub use landmark::Landmark;
pub use lattice::{Lattice, LatticeOptions, MAX_NODES, Section};
pub use lattice_error::{Boundary, LatticeError};
pub use quality::LatticeQuality;
pub use shape::{AXIS_STEPS, DIAGONAL_STEPS, LatticeShape};
pub use validate::{
    CaseRuleError, ContourFault, ContourKind, MAX_CASE_CORNERS, MAX_COORDINATE_MM, MAX_CORNERS, MAX_SLICES, MIN_SLICES,
};
pub use zone::Zone;
