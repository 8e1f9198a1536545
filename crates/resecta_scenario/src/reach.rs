//! Steps that can never end: what they wait for is out of the instrument's reach, more than gland or bladder hold, or the run is
//! over before.

use resecta_anatomy::Zone;
use resecta_instrument::{FieldLimit, InstrumentLimits};

use crate::{
    errors::RuleError,
    exercise::{Exercise, Goal},
    rules::{Checked, Faults},
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

/// Checks that each step can end on a gland, by the mass of all of it and the volumes of its zones at the start.
pub(crate) fn check_on_gland(exercise: &Exercise, mass_g: f64, zone_mm3: &[f64; Zone::COUNT]) -> Checked {
    for (index, step) in exercise.steps.iter().enumerate() {
        let field = format!("steps[{index}].until");
        match step.until {
            Trigger::Cut { g } if g > mass_g => {
                let expected = format!("at most {mass_g:.1}, the mass of the gland");
                return Err(RuleError::new(format!("{field}.Cut.g"), g, expected));
            }
            Trigger::ZoneRemoved { zone, .. } if zone_mm3[zone.index()] <= 0.0 => {
                let has = |zone: &Zone| zone_mm3[zone.index()] > 0.0;
                let zones: Vec<&str> = Zone::ALL.into_iter().filter(has).map(Zone::name).collect();
                let expected = format!("a zone that this gland has ({})", zones.join(", "));
                return Err(RuleError::new(
                    format!("{field}.ZoneRemoved.zone"),
                    zone.name(),
                    expected,
                ));
            }
            _ => {}
        }
    }
    Ok(())
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
        Trigger::BladderAbove { .. } | Trigger::Filled { .. } | Trigger::Drained { .. } => {
            let water = exercise.models.water.as_ref()?;
            // Nothing flows in against the pressure of the bag; what is in at the start is in.
            let filled = water.bladder.volume_at(water.irrigation.bag_height_cmh2o);
            let most = filled.max(water.bladder_ml).floor();
            Some(("ml", most, "what the bag fills the bladder to at its height"))
        }
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
