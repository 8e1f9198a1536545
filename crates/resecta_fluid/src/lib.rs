//! Blood and water: irrigation, bleeding, turbidity and absorption, for a game to draw and an exercise to score.
//!
//! Four models, each a plugin of its own ([`FluidPlugins`] is all of them), each at work only where the app has its resources or
//! components. None needs a renderer. What they tell comes as messages: [`VesselOpened`], [`VesselClosed`], [`AbsorptionAlarm`],
//! [`FluidRefused`].
//!
//! | model | plugin | works with | look in |
//! |---|---|---|---|
//! | the bladder, its pressure, the books | all | [`Bladder`] | `bladder.rs`, solved in `balance.rs` |
//! | bag, taps, outflow | [`IrrigationPlugin`] | [`Irrigation`] | `irrigation.rs` |
//! | how the water presses on the tissue's surface | all | [`Bladder`], `WaterPressure` on a tissue | `lumen.rs` |
//! | vessels that open, bleed, clot, are coagulated | [`BleedingPlugin`] | [`Circulation`], [`Vessels`] on a tissue | `bleeding.rs`, `circulation.rs`, `carrier.rs` |
//! | where a gland has its vessels | | [`Vessels::generate`] | `generate.rs` |
//! | blood in the water, jets at the lens | [`TurbidityPlugin`] | [`Turbidity`], [`Lens`] | `turbidity.rs`, `mixing.rs`, `red_out.rs` |
//! | irrigant in opened veins | [`AbsorptionPlugin`] | [`Absorption`] | `absorption.rs` |
//!
//! The modules' own docs have equations, units and the basis of every constant. One patient an app: one [`Bladder`], one
//! [`Circulation`], any number of tissues with [`Vessels`]. Everything is integrated exactly within a step as far as what flows
//! is linear, in `f64`; the same steps give the same bits. Volumes are ml, flows ml/s, pressures cmH2O (98.0665 Pa) unless a name
//! says otherwise, lengths mm, times s.
//!
//! ```
//! use bevy::prelude::*;
//! use resecta_fluid::prelude::*;
//!
//! let mut app = App::new();
//! app.add_plugins((MinimalPlugins, FluidPlugins::new(Update)))
//!     .init_resource::<Bladder>()
//!     .init_resource::<Turbidity>()
//!     .insert_resource(Irrigation { outflow_tap: 0.0, ..default() });
//! # app.insert_resource(bevy::time::TimeUpdateStrategy::ManualDuration(std::time::Duration::from_millis(100)));
//! app.update(); // the first update sets the clocks
//! for _ in 0..100 {
//!     app.update(); // 0.1 s each
//! }
//! // 300 ml/min into an empty bladder.
//! let bladder = app.world().resource::<Bladder>();
//! assert!((bladder.volume_ml() - 50.0).abs() < 1e-9);
//! assert_eq!(app.world().resource::<Turbidity>().visibility(), 1.0);
//! ```
//!
//! Not validated for training: constants marked "ours" are choices, not measurements.

mod absorption;
mod balance;
mod bladder;
mod bleeding;
mod carrier;
mod circulation;
mod generate;
mod irrigation;
mod lumen;
mod mixing;
mod plugin;
mod red_out;
mod refused;
mod turbidity;
mod vessels;

pub use absorption::{Absorption, AbsorptionAlarm, AbsorptionLevel, AbsorptionPlugin, AbsorptionSettings, Irrigant};
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

/// What a user of the crate types daily.
pub mod prelude {
    pub use crate::{
        Absorption, AbsorptionAlarm, AbsorptionLevel, Bladder, Circulation, FluidPlugins, FluidRefused, FluidSystems,
        Irrigation, Lens, RedOut, Turbidity, Vessel, VesselClosed, VesselKind, VesselOpened, VesselState, Vessels,
    };
}
