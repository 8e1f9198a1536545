//! What water does to the lumen of a shipped gland: how far each pressure opens it, and what the lens then sees on the way from the
//! verumontanum to the bladder neck.
//!
//! | to find | look in |
//! |---|---|
//! | area of the lumen against pressure, and the closed form | `opening.rs` |
//! | poses on the way, with the taps open and shut | `way.rs` |
//! | the page | `page.rs` |

mod opening;
mod page;
mod way;

pub use opening::Opening;
pub use page::{Lumen, write_lumen};
pub use way::{Look, Sights};
