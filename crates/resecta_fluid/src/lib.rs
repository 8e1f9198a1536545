//! Blood and water: what flows in and out of a bladder, for a game to draw and an exercise to score.

mod balance;
mod bladder;
mod irrigation;
mod plugin;
mod refused;

pub use bladder::{Bladder, BladderSettings, BladderTotals};
pub use irrigation::{Irrigation, IrrigationPlugin};
pub use plugin::{FluidPlugins, FluidSystems};
pub use refused::{FluidError, FluidRefused};

/// Pascals in a centimetre of water (4 °C, standard gravity).
pub const PA_PER_CMH2O: f64 = 98.0665;
