//! The report of a state that the instrument did not take.

use bevy::prelude::*;

use crate::NotFinite;

/// A request that was not a number: the instrument stayed in its last good state, pedals included.
#[derive(Message, Debug, Clone, Copy, PartialEq)]
pub struct InstrumentRefused {
    /// The instrument.
    pub instrument: Entity,
    /// The field and its value.
    pub reason: NotFinite,
}
