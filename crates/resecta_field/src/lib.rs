//! Cuts finer than the elements: a signed distance inside the pentahedra, and the surface that it bounds.
//!
//! The lattice of 2 to 3 mm elements stays the mechanics. A [`Field`] holds, on a sub-lattice inside those pentahedra
//! that a cut has touched, how far each point lies from what was cut; it moves with the tissue. From it follow what
//! every pentahedron still holds ([`Field::fill`]), a closed surface at the spacing of the sub-lattice ([`Surface`]),
//! the chips that come off ([`Field::take_chip`]) and the pieces that then hang by nothing ([`Field::loose_pieces`]).
//! Nothing here knows of Bevy, and what nothing cut costs nothing.
//!
//! | to find | look in |
//! |---|---|
//! | how finely edges are divided, and pentahedra with them | `divide.rs`, `triangle.rs`, `sublattice.rs` |
//! | which points neighbours share, and the values on them | `points.rs` |
//! | what cuts, and steps of a stroke that join without ridges | `tool.rs`, `stroke.rs` |
//! | how a cut lowers the values | `cut.rs` |
//! | thin tissue that a current leaves | `thin.rs` |
//! | how volume is counted | `volume.rs` |
//! | how much of the capsule is left | `capsule.rs` |
//! | where the surface's vertices lie, and how they are carried | `crossings.rs`, `vertices.rs` |
//! | how they are joined, also on the rim of a cut | `extract.rs` |
//! | faces that nothing touched, beside finer ones | `coarse.rs` |
//! | which slots of the surface to write anew | `changes.rs` |
//! | chips | `chips.rs`, `moments.rs` |
//! | pieces that came loose, and crumbs | `pieces.rs`, `crumbs.rs` |
//! | coagulation | `coagulation.rs` |
//!
//! A step of a stroke, as a caller sees it:
//!
//! 1. [`LoopStroke::step_to`] makes a [`Tool`] of the loop's next pose, and [`Field::cut`] takes it away, the nodes being
//!    where they are. [`Cut`] lists the pentahedra that lost something, what, and those of which nothing is left;
//!    its `capsule_mm2` says that the organ was perforated, and how far.
//! 2. [`Field::fill`] of those, 0 to 1, is what is left of each for its mass and stiffness; it never rises.
//! 3. [`Field::loose_pieces`] around them finds what hangs by nothing, [`Field::empty`] takes it away, and
//!    [`Field::brush_off`] what is too small to be a piece.
//! 4. [`Field::take_changes`] lists the slots of vertices and triangles to write anew; [`Field::move_vertices`] and
//!    [`Field::move_normals`] place all of them. A vertex's pentahedron and weights ([`Surface::carrier`]) are also what a
//!    force on the surface acts on.
//!
//! [`Field::begin_chip`] before the stroke and [`Field::take_chip`] after it make a body of what it took, at once;
//! [`Field::end_chip`] leaves that to be done in parts.
//!
//! Lengths are mm. The same input gives the same bytes: indices alone decide every order.

mod capsule;
mod changes;
mod chip_making;
mod chips;
mod coagulation;
mod coarse;
mod crossings;
mod crumbs;
mod cut;
mod divide;
mod error;
mod extract;
mod field;
mod lanes;
mod lookup;
mod mesh;
mod moments;
mod pieces;
mod points;
mod room;
mod section;
mod shape;
mod stroke;
mod sublattice;
mod surface;
mod thin;
mod tool;
mod triangle;
mod vertices;
mod volume;

pub use changes::Changes;
pub use chip_making::ChipMaking;
pub use chips::Chip;
pub use cut::{Cut, SLIVER_SHARE};
pub use error::FieldError;
pub use field::Field;
pub use pieces::{Holds, Piece};
pub use section::Plane;
pub use stroke::LoopStroke;
pub use surface::{CHUNK, Surface, SurfaceKind};
pub use tool::Tool;
