//! The substeps of a [`Tissue`](resecta_solver::Tissue) on a graphics processor, for lattices too large for one core.
//!
//! The equations, the scheme and the division of time are those of `resecta_solver`, which this crate drives as a
//! [`Machine`](resecta_solver::Machine): only forces, kicks, drifts and what the stability bound follows from are computed
//! elsewhere, in single precision with compensated positions as there. Sums have another order, so the motion differs by
//! rounding; the tests say by how much. Nothing here knows of Bevy, and nothing uses this crate unless it is asked to.
//!
//! ```no_run
//! use resecta_gpu::{Gpu, GpuTissue};
//! # fn simulate(tissue: &resecta_solver::Tissue) -> Result<(), resecta_gpu::GpuError> {
//! let gpu = Gpu::open()?;
//! let mut moving = GpuTissue::new(&gpu, tissue)?;
//! let report = moving.advance_steps(1e-4, 10_000)?;
//! println!("{}: {} substeps of {} s", gpu.adapter(), report.substeps, report.substep_s);
//! let places = moving.positions()?;
//! # Ok(())
//! # }
//! ```
//!
//! | to find | look in |
//! |---|---|
//! | what an invocation computes | `substep.wgsl` |
//! | where springs lie, and why | `layout.rs` |
//! | buffers, and what is recorded for a stretch of substeps | `motion.rs` |
//! | the adapter, and how its failures become errors | `device.rs` |

mod device;
mod error;
mod layout;
mod motion;
mod tissue;

pub use device::Gpu;
pub use error::GpuError;
pub use tissue::GpuTissue;
