//! Blood and water against closed forms, in apps without a window.
//!
//! One binary, so that Bevy is linked once.

mod absorption;
mod bleeding;
mod conservation;
mod generated;
mod irrigation;
mod scenes;
mod schedule;
mod tissue;
mod turbidity;
