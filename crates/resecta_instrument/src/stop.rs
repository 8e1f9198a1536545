//! The end of the way: told when a request presses against a limit of the instrument, so that a player can feel it.

use bevy::prelude::*;

use crate::{InstrumentField, InstrumentLimits, InstrumentState};

/// A field was asked in this fixed step for what it cannot do; the instrument stays at the end of its way, or where the body
/// holds it.
///
/// Told for every field and every step in which it presses, by sources that may ask for more than there is: hands and
/// requests. Scripts are within the limits, but tissue may hold them, too; recordings are what was left when it had.
#[derive(Message, Reflect, Debug, Clone, Copy, PartialEq)]
pub struct InstrumentStopped {
    /// The instrument.
    pub instrument: Entity,
    /// The field.
    pub field: InstrumentField,
    /// Whether it was asked for more than it can do, else for less.
    pub above: bool,
    /// How hard: how far the request went past the end in this step, as a share of what the field can move in a step at
    /// its fastest; above 0, 1 at most.
    pub push: f32,
    /// What stopped it.
    pub by: StoppedBy,
}

/// What stops an instrument.
#[derive(Reflect, Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum StoppedBy {
    /// The end of its own way.
    Limits,
    /// The body around it: told by who knows it.
    Body,
    /// The tissue that it presses on: see [`TissueLoad`](crate::TissueLoad).
    Tissue,
}

impl InstrumentLimits {
    /// Where a request goes past the ends: the field, by how much (its unit, negative below the smallest value), and that as
    /// a share of its fastest step of `dt_s` seconds, 1 at most. A number that is none passes none.
    pub fn past_ends(&self, wanted: &InstrumentState, dt_s: f32) -> impl Iterator<Item = (InstrumentField, f32, f32)> {
        InstrumentField::ALL.into_iter().filter_map(move |field| {
            let (limit, value) = (self.of(field), wanted.get(field));
            let past = (value - limit.max).max(0.0) + (value - limit.min).min(0.0);
            let push = (past.abs() / (limit.max_speed * dt_s)).min(1.0);
            (past != 0.0).then_some((field, past, push))
        })
    }

    /// What tissue held of a step of `dt_s` seconds: the field, whether it was to become more, and how much of its fastest step was held,
    /// 1 at most.
    pub(crate) fn held(
        &self,
        wanted: &InstrumentState,
        held: &InstrumentState,
        dt_s: f32,
    ) -> impl Iterator<Item = (InstrumentField, bool, f32)> {
        InstrumentField::ALL.into_iter().filter_map(move |field| {
            let past = wanted.get(field) - held.get(field);
            let push = (past.abs() / (self.of(field).max_speed * dt_s)).min(1.0);
            (push > LEAST_PUSH).then_some((field, past > 0.0, push))
        })
    }
}

/// Smaller holds than this share of a field's fastest step are not reported: they are rounding of the conversion from tip to fields.
const LEAST_PUSH: f32 = 1e-3;
