//! Motion and resection of soft tissue: nodes joined by springs, filled with pentahedra.
//!
//! A [`TissueMesh`] says what is joined to what, a [`Material`] what it is made of, and [`Tissue`] holds the state that
//! moves ([`Tissue::advance`]) and is cut ([`Tissue::resect`]). Nothing here knows of Bevy.
//!
//! | to find | look in |
//! |---|---|
//! | how a spring's force is computed | `springs.rs` |
//! | how a step is made and how long it may be | `motion.rs` |
//! | what leaves when tissue is cut, and how the rest answers | `resect.rs`, `collapse.rs` |
//! | what the loop sweeps over | `sweep.rs` |
//! | the exposed surface | `surface.rs` |
//! | what must always hold | `validate.rs` |
//!
//! Units are mm, g and s throughout, so pressure and modulus are in Pa, force in µN and stiffness in µN/mm = mN/m.

mod assemble;
mod collapse;
mod contact;
mod energy;
mod material;
mod mesh;
mod motion;
pub mod reference;
mod resect;
mod springs;
mod surface;
mod sweep;
mod tissue;
mod validate;
mod vectors;

pub use collapse::CollapseLaw;
pub use contact::Contact;
pub use energy::Energy;
pub use material::{Material, ShearResistance};
pub use mesh::{MeshError, Share, TissueMesh};
pub use motion::{MOST_SUBSTEPS, PutAside, StepError, StepReport};
pub use resect::Resection;
pub use resecta_anatomy::Zone;
pub use surface::{Surface, SurfaceChange};
pub use sweep::{LoopPose, LoopSweep};
pub use tissue::{EditError, NodeKind, SpringState, Tissue};
pub use validate::Inconsistency;
