//! Chips: what strokes cut free, as rigid bodies that float in the irrigant.
//!
//! A chip ([`TissueChip`](resecta_tissue::TissueChip)) drifts with the stream from the scope's tip, sinks slowly, lies down in
//! the bladder on others, and leaves through an open sheath. [`ChipsPlugin`] moves chips in fixed steps while the app has
//! [`Chips`], and needs no renderer. Without that resource nothing runs.
//!
//! | to find | look in |
//! |---|---|
//! | drag, buoyancy, added mass | `drag.rs` |
//! | where the irrigant goes | `flow.rs` |
//! | a chip's mass, inertia and convex hull | `body.rs` |
//! | the part of its surface that this is made of | `sound.rs` |
//! | bladder, sheath and tissue as walls | `walls.rs` |
//! | contacts, friction and rest, which are [rapier](rapier3d)'s | `world.rs` |
//! | a step; who leaves; the books of mass | `pool.rs` |
//! | who is held when too many move | `most.rs` |
//! | systems, entities and messages | `plugin.rs` |
//!
//! Lengths are mm, masses g, times s; posterior (`+y`) is down, for the patient lies on the back. Bodies are moved on one
//! thread, in the order of their numbers: the same input gives the same bits. `told = in the body + flushed` holds for mass
//! ([`ChipTotals`]).
//!
//! Walls are as coarse as a chip needs them: the bladder is a sphere of triangles, the sheath a capsule, and tissue is what a probe at the
//! chip's centre tells, which pushes it out softly, for tissue gives way and is not moved by chips. The loop meets no chip.
//!
//! A chip that moves costs some 5 to 7 µs a step on one core (`benches/chips.rs`), one that rests 0.05 µs. With that go these
//! errors: a chip sinks at the velocity of the law to a few millionths; chips that lie on each other overlap by 0.03 mm on
//! average, and in a heap of 100 nowhere by more than 0.6 mm.

mod body;
mod drag;
mod flow;
mod most;
mod plugin;
mod pool;
mod settings;
mod sound;
mod walls;
mod world;

pub use body::Body;
pub use drag::{DOWN, Float, GRAVITY_MM_PER_S2, Water};
pub use flow::{Channel, Flow, Mouth};
pub use plugin::{ChipHeld, ChipSystems, Chips, ChipsPlugin, FloatingChip};
pub use pool::{ChipTotals, Happened, HeldReason, Pool, Surroundings};
pub use settings::{ChipError, ChipSettings};
pub use walls::{Cavity, Outline, Sheath, TissueAt, TissueNear};

/// What a user types daily.
pub mod prelude {
    pub use crate::{ChipSettings, ChipSystems, ChipTotals, Chips, ChipsPlugin, FloatingChip};
}
