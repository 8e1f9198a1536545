//! Cuts finer than the elements (`resecta_field`): what they take against exact solids, and what they cost.
//!
//! | to find | look in |
//! |---|---|
//! | exact solids and the block that they are cut from | `solids.rs` |
//! | errors of volume and of the new surface | `errors.rs` |
//! | a gland cut from end to end: times, memory, what is conserved | `gland.rs` |

pub mod errors;
pub mod gland;
pub mod solids;

use resecta_field::FieldError;

/// Spacings of the field to measure, mm.
pub const SPACINGS_MM: [f64; 5] = [1.0, 0.7, 0.5, 0.35, 0.25];

/// The spacing that targets are set for, mm.
pub const TARGET_SPACING_MM: f64 = 0.5;

/// Why a scene could not be cut.
#[derive(Debug, thiserror::Error)]
pub enum CutError {
    /// The tube is no lattice.
    #[error("the gland is no lattice: {0}")]
    Lattice(#[from] resecta_anatomy::LatticeError),
    /// The field refused the scene or a tool.
    #[error("the field refuses the scene: {0}")]
    Field(#[from] FieldError),
}
