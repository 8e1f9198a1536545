//! Apps without a window: what the plugin promises, checked through components and messages.
//!
//! One binary, so that Bevy is linked once.

mod between;
mod collision;
mod cost;
mod cutting;
mod edits;
mod fine;
mod mesh;
mod probe;
mod rays;
mod scenes;
mod schedule;
mod strokes;
