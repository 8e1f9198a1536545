//! Settings that make no sense: named, put aside, and the last good ones kept.

use std::ops::RangeInclusive;

use bevy::prelude::*;

use crate::{
    absorption::Absorption, bladder::Bladder, circulation::Circulation, irrigation::Irrigation, turbidity::Turbidity,
};

/// A value that is not finite or out of its range; nothing was changed.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
#[error("{field} is {value}, expected {expected}")]
pub struct FluidError {
    /// Name of the field.
    pub field: &'static str,
    /// Its value; of a vector the first offending component.
    pub value: f64,
    /// What was expected.
    pub expected: &'static str,
}

/// Something that was written into a resource or component made no sense: it was put aside, and what was there in the step
/// before is there again.
#[derive(Message, Debug, Clone, Copy, PartialEq)]
pub struct FluidRefused {
    /// Name of the resource or component.
    pub what: &'static str,
    /// The entity, of a component.
    pub entity: Option<Entity>,
    /// The value and what was expected.
    pub error: FluidError,
}

/// Refuses a value outside of a range; NaN is outside of every range.
pub(crate) fn check(
    field: &'static str,
    value: f64,
    range: RangeInclusive<f64>,
    expected: &'static str,
) -> Result<(), FluidError> {
    if range.contains(&value) {
        return Ok(());
    }
    Err(FluidError { field, value, expected })
}

/// A resource with settings that anyone may write.
pub(crate) trait Checked: Resource<Mutability = bevy::ecs::component::Mutable> {
    type Settings: Clone + Default;
    const NAME: &'static str;

    fn settings(&self) -> &Self::Settings;
    fn set(&mut self, settings: Self::Settings);
    fn check(settings: &Self::Settings) -> Result<(), FluidError>;
}

/// The last settings that made sense.
#[derive(Default)]
pub(crate) struct Good {
    bladder: <Bladder as Checked>::Settings,
    irrigation: <Irrigation as Checked>::Settings,
    circulation: <Circulation as Checked>::Settings,
    turbidity: <Turbidity as Checked>::Settings,
    absorption: <Absorption as Checked>::Settings,
}

/// Looks at the settings of all models and puts back those that make no sense. One system, so that what it tells has an order.
pub(crate) fn keep_good(
    bladder: Option<ResMut<Bladder>>,
    irrigation: Option<ResMut<Irrigation>>,
    circulation: Option<ResMut<Circulation>>,
    turbidity: Option<ResMut<Turbidity>>,
    absorption: Option<ResMut<Absorption>>,
    mut good: Local<Good>,
    mut refused: MessageWriter<FluidRefused>,
) {
    let good = &mut *good;
    keep(bladder, &mut good.bladder, &mut refused);
    keep(irrigation, &mut good.irrigation, &mut refused);
    keep(circulation, &mut good.circulation, &mut refused);
    keep(turbidity, &mut good.turbidity, &mut refused);
    keep(absorption, &mut good.absorption, &mut refused);
}

fn keep<R: Checked>(resource: Option<ResMut<R>>, good: &mut R::Settings, refused: &mut MessageWriter<FluidRefused>) {
    let Some(mut resource) = resource else {
        return;
    };
    match R::check(resource.settings()) {
        Ok(()) => *good = resource.settings().clone(),
        Err(error) => {
            resource.set(good.clone());
            refused.write(FluidRefused {
                what: R::NAME,
                entity: None,
                error,
            });
        }
    }
}
