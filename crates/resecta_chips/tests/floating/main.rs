//! Laws of chips in water: how fast they sink, that they come to rest, that none is lost, and that runs repeat.

mod app;
mod heap;
mod leaving;
mod scenes;
mod sinking;
