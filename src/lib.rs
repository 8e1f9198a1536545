//! Resecta: an open, moddable trainer for transurethral resection of the prostate.
//!
//! This package is a facade over its crates, and the game and the command line made of them:
//!
//! | crate | what it owns |
//! |---|---|
//! | [`anatomy`] | cases, contours, the lattice, import and export |
//! | [`annotate`] | ultrasound images to contours: a model that is trained, a genetic search |
//! | [`solver`] | motion and resection on dense arrays, without Bevy |
//! | [`tissue`] | tissue as entities: nodes, springs, pentahedra, collision, visible mesh |
//! | [`chips`] | what strokes cut free, floating in the irrigant |
//! | [`fluid`] | blood and water: irrigation, bleeding, turbidity, absorption |
//! | [`instrument`] | the resectoscope and where its input comes from |
//! | [`sound`] | samples of what is heard, without a device |
//! | [`scenario`] | exercises, metrics, score, the report of a run |
//! | [`records`] | runs as files that play again to the same bits; progress of trainees |
//!
//! [`ResectaPlugins`] is all of the simulation and nothing of the picture; any app can hold it:
//!
//! ```
//! use resecta::prelude::*;
//! use resecta::{assets, headless};
//!
//! let library = Library::new(assets::find()?);
//! let prepared = library.load("first_cuts")?.prepare()?;
//! let mut app = headless::app(None);
//! headless::start(&mut app, prepared, InstrumentSource::Requests);
//! app.update(); // the first update sets the clocks, each one after it is a step of 1/60 s
//! app.update();
//! assert_eq!(app.world().resource::<Metrics>().steps, 1);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! Not validated for training.

pub mod budget;
pub mod export;
pub mod game;
pub mod key_pictures;
pub mod lumen;
pub mod measured;
pub mod page;
pub mod players;
pub mod rates;
pub mod spring_scene;
pub mod strokes;
pub mod view;

pub use resecta_anatomy as anatomy;
pub use resecta_annotate as annotate;
pub use resecta_chips as chips;
pub use resecta_fluid as fluid;
pub use resecta_instrument as instrument;
pub use resecta_records as records;
pub use resecta_scenario as scenario;
pub use resecta_solver as solver;
pub use resecta_sound as sound;
pub use resecta_tissue as tissue;

pub use resecta_scenario::{FixedStepPlugin, ResectaPlugins, STEP_HZ, assets, headless, testing};

/// What a user types daily. Goes together with `bevy::prelude::*` in one glob import each.
pub mod prelude {
    pub use crate::ResectaPlugins;
    pub use resecta_anatomy::{Case, Lattice, LatticeOptions, Zone};
    pub use resecta_chips::prelude::*;
    pub use resecta_fluid::prelude::*;
    pub use resecta_instrument::prelude::*;
    pub use resecta_scenario::prelude::*;
    // Under a name of its own: Bevy's prelude has a `Material`.
    pub use resecta_solver::{CollapseLaw, Material as TissueMaterial, ShearResistance, TissueMesh};
    pub use resecta_tissue::prelude::*;
}
