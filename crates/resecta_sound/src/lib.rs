//! What a resection sounds like, made from numbers: samples that follow from what is to be heard, a seed and a clock of samples.
//!
//! ```
//! use resecta_sound::{SoundState, Synth};
//!
//! let mut synth = Synth::new(48_000, 7)?;
//! let mut samples = [0.0; 480];
//! let heard = SoundState { cut: true, contact: 1.0, ..SoundState::default() };
//! synth.render(&heard, &mut samples); // the next 10 ms
//! assert!(samples.iter().all(|sample| sample.abs() < 1.0));
//! # Ok::<(), resecta_sound::RateError>(())
//! ```
//!
//! | to find | look in |
//! |---|---|
//! | what can be heard | `state.rs` |
//! | the generator's two tones | `current.rs` |
//! | sparks where current meets tissue | `crackle.rs` |
//! | irrigant that runs in and out | `water.rs` |
//! | pedals | `pedal.rs` |
//! | alarms | `alarm.rs` |
//! | how they are mixed and kept in range | `synth.rs`, `limiter.rs` |
//! | oscillator, noise, ramps, filter | `wave.rs` |
//! | a file to listen to | `tour.rs`, `wav.rs` |
//!
//! Nothing here knows a device, a clock on the wall or Bevy. The same states at the same samples give the same samples, in
//! blocks of any length. Every sound begins and ends with a ramp, and none is left once it has ended: silence is 0 exactly.
//! A generator has to tell its two currents apart by ear; which tones it takes, and all other figures here, are ours.

mod alarm;
mod crackle;
mod current;
mod limiter;
mod pedal;
mod state;
mod synth;
mod tour;
mod water;
mod wav;
mod wave;

pub use alarm::{CAPSULE_HZ, CLOUDED_HZ, PRESSURE_HZ};
pub use current::{COAGULATION_HZ, CUTTING_HZ};
pub use state::SoundState;
pub use synth::{RateError, Synth};
pub use tour::{TOUR, TourStop, tour};
pub use water::{FULL_FLOW_ML_PER_S, INFLOW_HZ, OUTFLOW_HZ};
pub use wav::wav;
