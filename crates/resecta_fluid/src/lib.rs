//! Blood and water: what flows in and out of a bladder, for a game to draw and an exercise to score.

mod balance;
mod bladder;
mod bleeding;
mod carrier;
mod circulation;
mod generate;
mod irrigation;
mod mixing;
mod plugin;
mod red_out;
mod refused;
mod turbidity;
mod vessels;

pub use bladder::{Bladder, BladderSettings, BladderTotals};
pub use bleeding::BleedingPlugin;
pub use circulation::{Circulation, CirculationSettings};
pub use generate::VesselOptions;
pub use irrigation::{Irrigation, IrrigationPlugin};
pub use plugin::{FluidPlugins, FluidSystems};
pub use red_out::{Lens, RedOut, RedOutSettings};
pub use refused::{FluidError, FluidRefused};
pub use turbidity::{Turbidity, TurbidityPlugin, TurbiditySettings};
pub use vessels::{
    ClosedBy, OpenVessel, Vessel, VesselClosed, VesselError, VesselKind, VesselOpened, VesselState, Vessels,
};

/// Pascals in a centimetre of water (4 °C, standard gravity).
pub const PA_PER_CMH2O: f64 = 98.0665;
