//! Every sound in turn, to be listened to and to be tested.

use crate::{
    state::SoundState,
    synth::{RateError, Synth},
    water::FULL_FLOW_ML_PER_S,
};

/// How long a sound is on, and the silence after it, s.
const ON_S: f64 = 2.0;
const OFF_S: f64 = 1.0;

const NOTHING: SoundState = SoundState::NOTHING;

/// The sounds, each with its name.
pub const TOUR: [(&str, SoundState); 10] = [
    ("cutting current", SoundState { cut: true, ..NOTHING }),
    (
        "cutting current in tissue",
        SoundState {
            cut: true,
            contact: 1.0,
            ..NOTHING
        },
    ),
    (
        "coagulating current",
        SoundState {
            coagulate: true,
            ..NOTHING
        },
    ),
    (
        "coagulating current in tissue",
        SoundState {
            coagulate: true,
            contact: 1.0,
            ..NOTHING
        },
    ),
    (
        "inflow, a quarter open",
        SoundState {
            inflow_ml_per_s: FULL_FLOW_ML_PER_S / 4.0,
            ..NOTHING
        },
    ),
    (
        "inflow, full",
        SoundState {
            inflow_ml_per_s: FULL_FLOW_ML_PER_S,
            ..NOTHING
        },
    ),
    (
        "outflow, full",
        SoundState {
            outflow_ml_per_s: FULL_FLOW_ML_PER_S,
            ..NOTHING
        },
    ),
    (
        "alarm: capsule touched",
        SoundState {
            capsule_touched: true,
            ..NOTHING
        },
    ),
    (
        "alarm: pressure in the bladder",
        SoundState {
            pressure_high: true,
            ..NOTHING
        },
    ),
    (
        "alarm: view clouded",
        SoundState {
            view_clouded: true,
            ..NOTHING
        },
    ),
];

/// One sound of the tour.
#[derive(Debug, Clone, PartialEq)]
pub struct TourStop {
    /// What it is.
    pub name: &'static str,
    /// 2 s of it, and 1 s after it.
    pub samples: Vec<f32>,
}

/// The sounds of [`TOUR`], one after the other.
///
/// # Errors
/// [`RateError`] as [`Synth::new`].
pub fn tour(rate_hz: u32, seed: u64) -> Result<Vec<TourStop>, RateError> {
    let mut synth = Synth::new(rate_hz, seed)?;
    let samples = |seconds: f64| (seconds * f64::from(rate_hz)) as usize;
    let stops = TOUR.map(|(name, heard)| {
        let mut sound = vec![0.0; samples(ON_S + OFF_S)];
        let (on, off) = sound.split_at_mut(samples(ON_S));
        synth.render(&heard, on);
        synth.render(&NOTHING, off);
        TourStop { name, samples: sound }
    });
    Ok(stops.into())
}
