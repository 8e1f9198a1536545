//! The resectoscope: kinematics, loop, pedals and where its input comes from.
//!
//! An instrument is an entity with a [`Resectoscope`]: a pivot that the sheath always passes through, a direction and a
//! side that is up. Each fixed step one [`InstrumentState`] comes from its [`InstrumentSource`] (keyboard, mouse and gamepad, a
//! script, a recording, or any system that writes [`InstrumentRequest`]), is brought within [`InstrumentLimits`], and moves
//! the tool that `resecta_tissue` collides and cuts with.
//!
//! ```
//! use bevy::prelude::*;
//! use resecta_instrument::{InstrumentPlugin, InstrumentSource, Resectoscope};
//!
//! fn spawn(mut commands: Commands) -> Result {
//!     // The pivot at the external sphincter, the bladder along +z, anterior along -y.
//!     let scope = Resectoscope::new(Vec3::new(0.0, 0.0, -10.0), Vec3::Z, Vec3::NEG_Y)?;
//!     commands.spawn((scope, InstrumentSource::Live));
//!     Ok(())
//! }
//!
//! App::new().add_plugins((MinimalPlugins, InstrumentPlugin)).add_systems(Startup, spawn).update();
//! ```
//!
//! # Frames
//!
//! World: mm; `+x` patient left, `+y` posterior, `+z` towards the bladder. Instrument: origin at the middle of the
//! sheath's tip, `-Z` forward, `+Y` up (anterior at roll 0), `+X` to the operator's right; the loop hangs along `-Y`.
//!
//! # Scripts
//!
//! A script is a RON file of key frames:
//!
//! ```
//! # use std::path::Path;
//! # use resecta_instrument::{InstrumentLimits, InstrumentScript, InstrumentState};
//! # let text = r#"
//! (
//!     keys: [
//!         (time_s: 0.0, insertion_mm: 40.0, pitch_deg: 0.0, stroke_mm: 0.0),
//!         // Loop out within a second, tip down, then pull with current at 25 mm/s.
//!         (time_s: 1.0, pitch_deg: -8.0, stroke_mm: 25.0, cut: true),
//!         (time_s: 2.0, stroke_mm: 0.0, cut: false),
//!     ],
//! )
//! # "#;
//! # let script = InstrumentScript::from_ron(text, Path::new("example.ron"), &InstrumentLimits::default())?;
//! # let start = InstrumentState { yaw_deg: 3.0, ..Default::default() };
//! # let state = script.sample(1.5, &start);
//! # assert_eq!((state.insertion_mm, state.pitch_deg, state.yaw_deg, state.stroke_mm), (40.0, -8.0, 3.0, 12.5));
//! # assert!(state.cut && !state.coagulate);
//! # Ok::<(), resecta_instrument::ScriptError>(())
//! ```
//!
//! - Every key has a `time_s`, from 0 and rising, and any of `insertion_mm`, `pitch_deg`, `yaw_deg`, `roll_deg`,
//!   `stroke_mm`, `inflow_tap`, `outflow_tap`, `cut`, `coagulate`, in the units of [`InstrumentState`].
//! - A number is linear between the keys that name it, and held before the first and after the last of them. One that no
//!   key names stays as the instrument was spawned.
//! - A pedal stays as the last key left it. Both are up before the first key that names them and after the last key.
//! - Values and speeds must be within the instrument's limits; what is not is refused with file, line, key and field.

mod action;
mod bindings;
mod bound_input;
mod devices;
mod feel;
mod geometry;
mod kinematics;
mod limits;
mod live;
mod plugin;
mod recording;
mod refused;
mod resistance;
mod script;
mod script_error;
mod source;
mod state;
mod stop;
mod tool;

pub use action::InstrumentAction;
pub use bindings::{InstrumentBinding, InstrumentBindings, LiveSpeed};
pub use bound_input::{BoundInput, UnknownInput};
pub use devices::{DeviceParams, Devices, InputCapture};
pub use feel::{FeelError, Handedness, InvertedAxes, LiveFeel, PedalMode};
pub use geometry::ResectoscopeGeometry;
pub use kinematics::{LoopPose, Resectoscope, ResectoscopeError};
pub use limits::{FieldLimit, InstrumentLimits, NotFinite};
pub use live::{LiveCommand, LiveInput};
pub use plugin::{InstrumentPlugin, InstrumentSystems};
pub use recording::{InstrumentRecording, RecordingError};
pub use refused::InstrumentRefused;
pub use resistance::{CREEP_MM_PER_S, InstrumentTore, Patch, TissueLoad};
pub use script::InstrumentScript;
pub use script_error::{ScriptError, ScriptRule};
pub use source::{InstrumentPlayback, InstrumentRequest, InstrumentSource};
pub use state::{InstrumentField, InstrumentState};
pub use stop::{InstrumentStopped, StoppedBy};

/// What a user types daily.
pub mod prelude {
    pub use crate::{
        InstrumentPlugin, InstrumentRecording, InstrumentScript, InstrumentSource, InstrumentState, InstrumentSystems,
        LiveInput, Resectoscope,
    };
}
