//! Soft tissue for Bevy that deforms, collides and can be cut.
//!
//! A [`Tissue`] component owns the state of `resecta_solver`; its nodes, springs and pentahedra are entities of their own
//! ([`TissueNode`], [`Spring`], [`Pentahedron`]) that any system reads and edits: a load on a node, another stiffness, a
//! despawned pentahedron (a resection). A [`TissueTool`] pushes and cuts. [`TissuePlugin`] runs the step; its order is
//! [`TissueSystems`]. What happened is told by messages: [`TissueContact`], [`TissueResected`],
//! [`TissueChip`], [`TissuePutAside`].
//!
//! ```
//! use bevy::prelude::*;
//! use resecta_solver::{Material, TissueMesh};
//! use resecta_tissue::prelude::*;
//!
//! fn press(mut nodes: Query<&mut TissueNode>) {
//!     for mut node in &mut nodes {
//!         if node.index == 0 {
//!             node.load = Vec3::new(0.0, 0.0, 500.0); // µN
//!         }
//!     }
//! }
//!
//! let mut app = App::new();
//! app.add_plugins((MinimalPlugins, TissuePlugin::default()));
//! app.add_systems(FixedUpdate, press);
//! # let positions = [[0., 0., 0.], [0., 1., 0.], [1., 0., 0.], [0., 0., 1.], [0., 1., 1.], [1., 0., 1.]];
//! # let positions = positions.map(bevy::math::DVec3::from_array).to_vec();
//! let mesh = TissueMesh::from_pentahedra(positions, vec![[0, 1, 2, 3, 4, 5]]);
//! let tissue = resecta_solver::Tissue::new(&mesh, &Material::default()).unwrap();
//! app.world_mut().spawn(Tissue::new(tissue));
//! app.update();
//! ```
//!
//! | to find | look in |
//! |---|---|
//! | the order of a step | `plugin.rs` |
//! | how edits reach the solver and results the components | `gather.rs`, `write_back.rs` |
//! | how tools push | `collide/`: which points are near in `samples.rs` and `search.rs`, what the solver holds of them in `contacts.rs` |
//! | how loops cut, and how finely | `cut.rs`, `fine.rs` |
//! | what is gone before the first step | `begun.rs` |
//! | the surface that is touched and drawn, and what cuts changed of it | `skin.rs`, `change_log.rs` |
//! | how far a point is from the surface | `probe.rs` |
//! | where a ray meets the surface | `rays.rs`, `collide/winding.rs` |
//! | how far a line is from the capsule | `capsule.rs` |
//! | the visible mesh | `surface_mesh.rs`, `numbering.rs`; between two steps: `between_steps.rs` |
//!
//! What is off costs nothing: [`TissueSettings`] switches collapse, collision and the mesh a tissue, and an app without
//! `Assets<Mesh>` builds none. The crate gives [`Mesh3d`](bevy::prelude::Mesh3d) with vertex colours; the material is the
//! app's.

mod begun;
mod between_steps;
mod capsule;
mod change_log;
mod collide;
mod components;
mod cut;
mod diagnostics;
mod fine;
mod gather;
mod messages;
mod numbering;
mod plugin;
mod probe;
mod rays;
mod self_overlap;
mod settings;
mod skin;
mod surface_mesh;
mod tool;
mod write_back;

pub use between_steps::DrawnBetweenSteps;
pub use capsule::{Capsule, CapsuleDistance};
pub use collide::Overlap;
pub use components::{Pentahedron, Spring, Tissue, TissueNode, WaterPressure};
pub use diagnostics::{TissueDiagnostics, TissueDiagnosticsPlugin};
pub use messages::{
    PutAsideReason, PutAsideSubject, TissueChip, TissueContact, TissueInconsistent, TissuePutAside, TissueResected,
};
pub use plugin::{TissuePlugin, TissueSystems};
pub use probe::TissueProbe;
pub use rays::TissueRays;
pub use resecta_field::{Chip, Field, FieldError, LoopStroke, Plane, SurfaceKind, Tool};
pub use self_overlap::SelfOverlap;
pub use settings::{CutDetail, CuttingRule, TissueSettings};
pub use surface_mesh::{TissueColours, TissueTint};
pub use tool::{Kerf, LoopCutter, TissueTool, ToolLoad, ToolPart, ToolPartKind, ToolPlacement};

/// What a user of the crate types daily.
pub mod prelude {
    pub use crate::{
        CutDetail, CuttingRule, Kerf, LoopCutter, Pentahedron, Spring, Tissue, TissueChip, TissueContact,
        TissueDiagnostics, TissueNode, TissuePlugin, TissueProbe, TissuePutAside, TissueRays, TissueResected,
        TissueSettings, TissueSystems, TissueTint, TissueTool, ToolPart, ToolPartKind,
    };
}
