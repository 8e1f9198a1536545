//! Why a graphics processor does not move a tissue.

use resecta_solver::{EditError, StepError};

/// Why a graphics processor does not move a tissue. The tissue that it was given is as before: the processor's own solver
/// can take it instead.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum GpuError {
    /// There is no adapter, or it lets nobody in.
    #[error("no graphics processor to compute on: {0}")]
    NoAdapter(String),
    /// The tissue, or the program itself, is larger than the adapter allows.
    #[error("{limit} would have to be {needed}, and the graphics processor allows {allowed}")]
    Limit {
        /// Name of the limit, as WebGPU has it.
        limit: &'static str,
        /// What it would take.
        needed: u64,
        /// What there is.
        allowed: u64,
    },
    /// Pentahedra of the tissue hold their volume, which only the processor's own solver computes.
    #[error("a graphics processor does not compute pentahedra that hold their volume")]
    HoldsVolume,
    /// The device was lost, ran out of memory, or refused something.
    #[error("the graphics processor failed: {0}")]
    Failed(String),
    /// The time to advance was refused.
    #[error(transparent)]
    Step(#[from] StepError),
    /// A number that came back is none that a node can have.
    #[error("the graphics processor gave back what cannot be: {0}")]
    Motion(#[from] EditError),
}
