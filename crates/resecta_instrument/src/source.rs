//! Where the instrument's states come from.

use bevy::prelude::*;

use crate::{InstrumentRecording, InstrumentScript, InstrumentState};

/// Where an instrument's states come from, one a fixed step.
///
/// Setting it (also to the same value again) begins the source anew and *places* the instrument at the source's start:
/// tissue in between is not swept.
#[derive(Component, Reflect, Debug, Clone, PartialEq, Default)]
#[reflect(Component, Default)]
pub enum InstrumentSource {
    /// None of the others: the instrument goes where [`InstrumentRequest`] says, which any system may write between
    /// [`InstrumentSystems::Sample`](crate::InstrumentSystems::Sample) and
    /// [`InstrumentSystems::Apply`](crate::InstrumentSystems::Apply).
    #[default]
    Requests,
    /// A script; it starts with its keys at time 0.
    Script(InstrumentScript),
    /// A recording; it starts where the recording started.
    Recording(InstrumentRecording),
    /// Keyboard, mouse and gamepad, through [`LiveInput`](crate::LiveInput).
    Live,
}

impl InstrumentSource {
    /// Where the source starts, for an instrument that is at `current`. Pedals are up.
    pub fn start(&self, current: &InstrumentState) -> InstrumentState {
        let state = match self {
            InstrumentSource::Requests | InstrumentSource::Live => *current,
            InstrumentSource::Script(script) => script.sample(0.0, current),
            InstrumentSource::Recording(recording) => return recording.completed(&recording.start, current),
        };
        InstrumentState {
            cut: false,
            coagulate: false,
            ..state
        }
    }

    /// Whether a script or recording has nothing left after `steps` steps of `step_s` seconds. Other sources never end.
    pub fn is_over(&self, steps: u64, step_s: f64) -> bool {
        match self {
            InstrumentSource::Requests | InstrumentSource::Live => false,
            InstrumentSource::Script(script) => steps as f64 * step_s > script.duration_s(),
            InstrumentSource::Recording(recording) => steps > recording.states.len() as u64,
        }
    }
}

/// Where the instrument is to go: written by its source each step, approached within its limits.
#[derive(Component, Reflect, Debug, Clone, Copy, PartialEq, Default)]
#[reflect(Component, Default)]
pub struct InstrumentRequest(pub InstrumentState);

/// How far the current source has been played.
#[derive(Component, Reflect, Debug, Clone, Copy, PartialEq, Eq, Default)]
#[reflect(Component, Default)]
pub struct InstrumentPlayback {
    /// Steps since the source began.
    pub steps: u64,
    /// Whether a script or a recording is over; the instrument then stays where it is, with its pedals up.
    pub over: bool,
}
