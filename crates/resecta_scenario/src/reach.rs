//! Steps that can never end: what they wait for is out of the instrument's reach, or the run is over before.

use resecta_instrument::{FieldLimit, InstrumentLimits};

use crate::{
    errors::RuleError,
    exercise::{Exercise, Goal},
    rules::Faults,
    trigger::Trigger,
};

/// Checks that each step can end. What takes time, takes it from `limits.time_s`.
pub(crate) fn check(exercise: &Exercise, faults: &mut Faults) {
    let mut left_s = exercise.limits.time_s;
    for (index, step) in exercise.steps.iter().enumerate() {
        let (name, numbers) = step.until.parts();
        let field = |unit: &str| format!("steps[{index}].until.{name}.{unit}");
        if let Some((unit, most, of)) = most(&step.until, exercise) {
            for &(_, number) in numbers.iter().filter(|&&(named, _)| named == unit) {
                // What is no number or below 0 is told already.
                faults.require(number <= most || number.is_nan(), || {
                    RuleError::new(field(unit), number, format!("at most {most}, {of}"))
                });
            }
        }
        for &(_, number) in numbers.iter().filter(|&&(unit, number)| unit == "s" && number > 0.0) {
            faults.require(number < left_s, || {
                let expected = format!(
                    "less than {} s, which is what `limits.time_s` and the steps before leave",
                    left_s.max(0.0)
                );
                RuleError::new(field("s"), number, expected)
            });
            left_s -= number;
        }
    }
}

/// The field of a trigger that has a most, the most, and whose it is.
fn most(trigger: &Trigger, exercise: &Exercise) -> Option<(&'static str, f64, &'static str)> {
    let limits = InstrumentLimits::default();
    let way = |limit: FieldLimit| f64::from(limit.max - limit.min);
    match trigger {
        Trigger::Advanced { .. } | Trigger::Withdrawn { .. } => {
            Some(("mm", way(limits.insertion_mm), "the whole way of the sheath"))
        }
        Trigger::Tilted { .. } => {
            let corners = way(limits.pitch_deg).hypot(way(limits.yaw_deg));
            Some(("deg", corners.floor(), "the farthest that the tip turns"))
        }
        Trigger::TipRaised { .. } => Some(("deg", way(limits.pitch_deg), "the farthest that the tip turns up")),
        Trigger::Rolled { .. } => Some(("deg", way(limits.roll_deg), "the whole way of the roll")),
        Trigger::LoopOut { .. } => Some(("mm", f64::from(limits.stroke_mm.max), "as far as the loop goes")),
        Trigger::MarkedRemoved { .. } => {
            let share = |goal: &Goal| match goal {
                Goal::RemoveMarked { share } => Some(*share),
                Goal::FinishSteps | Goal::Extension(_) => None,
            };
            // The run waits for its steps only where they are a goal.
            let shares: Option<Vec<f64>> = exercise.goals.iter().map(share).collect();
            let most = shares?.into_iter().reduce(f64::max)?;
            Some(("share", most, "for the goals are reached then and the run ends"))
        }
        _ => None,
    }
}
