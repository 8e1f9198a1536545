//! Motion and resection of soft tissue: nodes joined by springs, filled with pentahedra.
//!
//! A [`TissueMesh`] says what is joined to what, a [`Material`] what it is made of, and [`Tissue`] holds the state that
//! moves ([`Tissue::advance`]) and is cut ([`Tissue::resect`], [`Tissue::thin`]). Nothing here knows of Bevy.
//!
//! | to find | look in |
//! |---|---|
//! | how a spring's force is computed | `springs.rs`, laid out in `sites.rs` and `runs.rs` |
//! | how pentahedra hold their volume | `pressure.rs`, computed in `volumes.rs` and `volume_effects.rs` |
//! | how water presses on the surface | `pressed.rs` |
//! | what holds the organ, and how it gives way as a whole | `bed.rs`, `mobility.rs` |
//! | a scene of nodes and springs alone | `network.rs` |
//! | how a step is made | `motion.rs` |
//! | how long it may be | `bound.rs`, `held.rs` |
//! | how large its error is | `watch.rs` |
//! | how another machine makes the substeps | `machine.rs` |
//! | what is inside out or drawn out | `shape.rs` |
//! | what sleeps | `sleep.rs` |
//! | what leaves when tissue is cut, and how the rest answers | `resect.rs`, `cavity.rs`, `pieces.rs`, `collapse.rs` |
//! | what the loop sweeps over | `sweep.rs` |
//! | the exposed surface | `surface.rs` |
//! | what must always hold | `validate.rs` |
//!
//! Units are mm, g and s throughout, so pressure and modulus are in Pa, force in µN and stiffness in µN/mm = mN/m.

mod aim;
mod assemble;
mod bed;
mod bound;
mod cavity;
mod collapse;
mod contact;
mod energy;
mod follow;
mod held;
mod kick;
mod machine;
mod marks;
mod material;
mod mesh;
mod mobility;
mod motion;
mod network;
mod pairs;
mod pieces;
mod pressed;
mod pressure;
mod quarantine;
mod ranges;
pub mod reference;
mod resect;
mod runs;
mod shape;
mod sites;
mod sleep;
mod soften;
mod springs;
mod surface;
mod sweep;
mod team;
mod tissue;
mod validate;
mod vectors;
mod viscosity;
mod volume_effects;
mod volume_runs;
mod volumes;
mod watch;
mod widest;

pub use aim::AimReport;
pub use bound::MOST_SUBSTEPS;
pub use collapse::CollapseLaw;
pub use contact::{Contact, Pusher, TissuePoint, Touch};
pub use energy::Energy;
pub use follow::Followed;
pub use machine::{Machine, Measured, NodeKick, Stretch};
pub use material::{Material, ShearResistance};
pub use mesh::{MeshError, Share, TissueMesh};
pub use mobility::Mobility;
pub use motion::{StepError, StepReport};
pub use network::{Network, NetworkError};
pub use quarantine::PutAside;
pub use resect::Resection;
pub use resecta_anatomy::Zone;
pub use surface::{Surface, SurfaceChange};
pub use sweep::{LoopPose, LoopSweep};
pub use tissue::{EditError, NodeKind, SpringState, Tissue};
pub use validate::Inconsistency;
pub use vectors::Segment;
pub use watch::{DEFAULT_ERROR_AIM_MM, Effort};
pub use widest::with_widest_registers;
