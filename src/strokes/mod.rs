//! Standard strokes of the loop, and what each leaves: the trough beside the wire's path, thin tissue, the chip.
//!
//! | to find | look in |
//! |---|---|
//! | which strokes | `catalogue.rs` |
//! | how one is made, its chip | `make.rs` |
//! | the surface and rays at it | `surface.rs` |
//! | depth, width, roughness, sheets | `measure.rs` |
//! | the page | `page.rs` |

mod catalogue;
mod make;
mod measure;
mod page;
mod surface;

pub use catalogue::{StandardStroke, standard_strokes};
pub use make::{ChipSize, Stroked, stroke};
pub use measure::{THIN_MM, Trough};
pub use page::write_strokes;
