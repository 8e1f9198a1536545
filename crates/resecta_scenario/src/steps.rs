//! Steps of an exercise that teaches by doing: each says what to do and ends when it was done.
//!
//! Steps are taken in order, one at a time. Everything that a trigger asks for is counted from the moment its step began, so
//! that nothing done before is given away; heights of the loop and contents of the bladder are what they are.

use bevy::prelude::*;
use resecta_instrument::{InstrumentAction, InstrumentState};
use serde::{Deserialize, Serialize};

use crate::{
    errors::RuleError,
    exercise::Exercise,
    metrics::{Metrics, StepObservation},
};

/// One step of an exercise.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Step {
    /// What to do, shown to the player.
    pub say: String,
    /// Why, or how it is done best; shown smaller.
    #[serde(default)]
    pub hint: String,
    /// What ends the step.
    pub until: Trigger,
}

/// Something that the player does. All numbers are above 0.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub enum Trigger {
    /// The sheath is this far deeper than when the step began, mm.
    Advanced {
        /// mm.
        mm: f64,
    },
    /// The sheath is this far further out than when the step began, mm.
    Withdrawn {
        /// mm.
        mm: f64,
    },
    /// The tip has turned up, down or sideways this far from where it pointed when the step began, degrees.
    Tilted {
        /// Degrees.
        deg: f64,
    },
    /// The tip has turned up this far from where it pointed when the step began, degrees.
    TipRaised {
        /// Degrees.
        deg: f64,
    },
    /// The instrument has rolled this far from where it was, either way, degrees.
    Rolled {
        /// Degrees.
        deg: f64,
    },
    /// The instrument is rolled by at most this much from upright, either way, degrees.
    Upright {
        /// Degrees.
        deg: f64,
    },
    /// The loop is at least this far out, mm.
    LoopOut {
        /// mm.
        mm: f64,
    },
    /// The loop is at most this far out, mm.
    LoopIn {
        /// mm.
        mm: f64,
    },
    /// This much tissue went in the step, g.
    Cut {
        /// g.
        g: f64,
    },
    /// The coagulating current flowed this long through a loop in contact with tissue, s.
    Coagulated {
        /// s.
        s: f64,
    },
    /// The bladder holds this much or less, ml. Needs `models.water`.
    BladderBelow {
        /// ml.
        ml: f64,
    },
    /// The bladder holds this much or more, ml. Needs `models.water`.
    BladderAbove {
        /// ml.
        ml: f64,
    },
}

impl Trigger {
    /// Its name in files, its number and what the number is in.
    pub fn parts(&self) -> (&'static str, f64, &'static str) {
        match *self {
            Trigger::Advanced { mm } => ("Advanced", mm, "mm"),
            Trigger::Withdrawn { mm } => ("Withdrawn", mm, "mm"),
            Trigger::Tilted { deg } => ("Tilted", deg, "deg"),
            Trigger::TipRaised { deg } => ("TipRaised", deg, "deg"),
            Trigger::Rolled { deg } => ("Rolled", deg, "deg"),
            Trigger::Upright { deg } => ("Upright", deg, "deg"),
            Trigger::LoopOut { mm } => ("LoopOut", mm, "mm"),
            Trigger::LoopIn { mm } => ("LoopIn", mm, "mm"),
            Trigger::Cut { g } => ("Cut", g, "g"),
            Trigger::Coagulated { s } => ("Coagulated", s, "s"),
            Trigger::BladderBelow { ml } => ("BladderBelow", ml, "ml"),
            Trigger::BladderAbove { ml } => ("BladderAbove", ml, "ml"),
        }
    }

    /// What the player does it with.
    pub fn actions(&self) -> &'static [InstrumentAction] {
        use InstrumentAction as Action;
        match self {
            Trigger::Advanced { .. } => &[Action::Advance],
            Trigger::Withdrawn { .. } => &[Action::Withdraw],
            Trigger::Tilted { .. } => &[Action::TipUp, Action::TipDown, Action::TipLeft, Action::TipRight],
            Trigger::TipRaised { .. } => &[Action::TipUp],
            Trigger::Rolled { .. } | Trigger::Upright { .. } => &[Action::RollLeft, Action::RollRight],
            Trigger::LoopOut { .. } => &[Action::LoopOut],
            Trigger::LoopIn { .. } => &[Action::LoopIn],
            Trigger::Cut { .. } => &[Action::TipDown, Action::Cut, Action::LoopIn],
            Trigger::Coagulated { .. } => &[Action::LoopOut, Action::TipDown, Action::Coagulate],
            Trigger::BladderAbove { .. } => &[Action::InflowOpen, Action::OutflowClose],
            Trigger::BladderBelow { .. } => &[Action::InflowClose, Action::OutflowOpen],
        }
    }

    /// How far a step has come, 0 to 1 at its end, with what was so at its beginning and what is so now.
    fn share(&self, from: &Moment, now: &Moment) -> f64 {
        let (was, is) = (&from.instrument, &now.instrument);
        let apart = |a: f32, b: f32| f64::from(a) - f64::from(b);
        match *self {
            Trigger::Advanced { mm } => apart(is.insertion_mm, was.insertion_mm) / mm,
            Trigger::Withdrawn { mm } => apart(was.insertion_mm, is.insertion_mm) / mm,
            Trigger::Tilted { deg } => apart(is.pitch_deg, was.pitch_deg).hypot(apart(is.yaw_deg, was.yaw_deg)) / deg,
            Trigger::TipRaised { deg } => apart(is.pitch_deg, was.pitch_deg) / deg,
            Trigger::Rolled { deg } => apart(is.roll_deg, was.roll_deg).abs() / deg,
            Trigger::Upright { deg } => downwards(f64::from(was.roll_deg).abs(), f64::from(is.roll_deg).abs(), deg),
            Trigger::LoopOut { mm } => f64::from(is.stroke_mm) / mm,
            Trigger::LoopIn { mm } => downwards(f64::from(was.stroke_mm), f64::from(is.stroke_mm), mm),
            Trigger::Cut { g } => (now.removed_g - from.removed_g) / g,
            Trigger::Coagulated { s } => (now.coagulated_s - from.coagulated_s) / s,
            Trigger::BladderBelow { ml } => downwards(from.bladder_ml, now.bladder_ml, ml),
            // As far up as below it is down.
            Trigger::BladderAbove { ml } => downwards(-from.bladder_ml, -now.bladder_ml, -ml),
        }
        .clamp(0.0, 1.0)
    }

    fn needs_water(&self) -> bool {
        matches!(self, Trigger::BladderBelow { .. } | Trigger::BladderAbove { .. })
    }
}

/// How much of the way down to `to` is done.
fn downwards(from: f64, now: f64, to: f64) -> f64 {
    if now <= to {
        1.0
    } else if from <= to {
        // It was there when the step began.
        0.0
    } else {
        // Short of it by however little is not there.
        ((from - now) / (from - to)).clamp(0.0, 0.999)
    }
}

/// What triggers look at, at one time.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
struct Moment {
    instrument: InstrumentState,
    removed_g: f64,
    coagulated_s: f64,
    bladder_ml: f64,
}

impl Moment {
    fn new(step: &StepObservation, metrics: &Metrics) -> Self {
        Self {
            instrument: step.instrument,
            removed_g: metrics.removal.mass_g(),
            coagulated_s: metrics.current.coagulation_in_contact_s,
            bladder_ml: step.water.bladder_ml,
        }
    }
}

/// How far the steps of the exercise in play have come. Empty for an exercise without steps.
#[derive(Resource, Debug, Clone, PartialEq, Default)]
pub struct StepProgress {
    /// When each step that is done was done, simulated s, in order.
    pub done_at_s: Vec<f64>,
    /// How far the present step has come, 0 to 1.
    pub share: f64,
    from: Option<Moment>,
}

impl StepProgress {
    /// The number of the present step, from 0; none when all are done or there are none.
    pub fn current(&self, exercise: &Exercise) -> Option<usize> {
        let next = self.done_at_s.len();
        (next < exercise.steps.len()).then_some(next)
    }

    /// Takes one fixed step into account, after the metrics. At most one step ends in it.
    pub fn observe(&mut self, steps: &[Step], observed: &StepObservation, metrics: &Metrics) {
        let Some(step) = steps.get(self.done_at_s.len()) else {
            return;
        };
        let now = Moment::new(observed, metrics);
        let from = *self.from.get_or_insert(now);
        self.share = step.until.share(&from, &now);
        if self.share >= 1.0 {
            self.done_at_s.push(metrics.elapsed_s());
            self.from = Some(now);
            self.share = 0.0;
        }
    }
}

/// Checks the steps of an exercise.
pub(crate) fn check(exercise: &Exercise) -> Result<(), RuleError> {
    for (index, step) in exercise.steps.iter().enumerate() {
        let field = format!("steps[{index}]");
        if step.say.trim().is_empty() {
            return Err(RuleError::new(format!("{field}.say"), "empty", "some text"));
        }
        let (name, number, unit) = step.until.parts();
        if !(number > 0.0 && number.is_finite()) {
            let expected = format!("a finite number of {unit} above 0");
            return Err(RuleError::new(format!("{field}.until.{name}.{unit}"), number, expected));
        }
        if step.until.needs_water() && exercise.models.water.is_none() {
            let expected = "a trigger that a dry exercise has, or `models: (water: (..))`";
            return Err(RuleError::new(format!("{field}.until"), name, expected));
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn step(until: Trigger) -> Step {
        Step {
            say: "do it".into(),
            hint: String::new(),
            until,
        }
    }

    /// A fixed step with the instrument so.
    fn with(instrument: InstrumentState) -> StepObservation {
        StepObservation::idle(0.1, instrument, Vec3::ZERO)
    }

    fn run(steps: &[Step], observed: impl IntoIterator<Item = StepObservation>) -> StepProgress {
        let mut progress = StepProgress::default();
        let mut metrics = Metrics::default();
        for observed in observed {
            metrics.count_step(&observed);
            metrics.removal.observe(&observed);
            metrics.current.observe(&observed);
            progress.observe(steps, &observed, &metrics);
        }
        progress
    }

    #[test]
    fn movements_count_from_the_beginning_of_their_step() {
        let steps = [
            step(Trigger::Advanced { mm: 10.0 }),
            step(Trigger::Advanced { mm: 10.0 }),
        ];
        let at = |insertion_mm| {
            with(InstrumentState {
                insertion_mm,
                ..default()
            })
        };
        assert_eq!(run(&steps, [at(20.0), at(29.0)]).done_at_s.len(), 0);
        assert_eq!(run(&steps, [at(20.0), at(31.0)]).done_at_s.len(), 1);
        assert_eq!(run(&steps, [at(20.0), at(31.0), at(40.0)]).done_at_s.len(), 1);
        let progress = run(&steps, [at(20.0), at(31.0), at(41.0), at(90.0)]);
        assert_eq!(progress.done_at_s.len(), 2);
        assert!(progress.done_at_s.is_sorted());
    }

    #[test]
    fn upright_is_told_from_where_the_instrument_was_rolled_to() {
        let steps = [step(Trigger::Upright { deg: 5.0 })];
        let rolled = |roll_deg| with(InstrumentState { roll_deg, ..default() });
        let progress = run(&steps, [rolled(-30.0), rolled(17.5)]);
        assert!((progress.share - 0.5).abs() < 1e-6, "{progress:?}");
        assert_eq!(run(&steps, [rolled(-30.0), rolled(5.0)]).done_at_s.len(), 1);
    }

    #[test]
    fn each_trigger_ends_by_what_it_names_and_not_before() {
        let start = InstrumentState {
            insertion_mm: 30.0,
            stroke_mm: 5.0,
            ..default()
        };
        let moved = |change: fn(&mut InstrumentState)| {
            let mut state = start;
            change(&mut state);
            with(state)
        };
        let bladder = |bladder_ml| {
            let mut observed = with(start);
            observed.water.bladder_ml = bladder_ml;
            observed
        };
        let coagulating = |loop_in_tissue| {
            let mut observed = moved(|state| state.coagulate = true);
            observed.loop_in_tissue = loop_in_tissue;
            observed
        };
        let begin = bladder(200.0);
        let cases = [
            (
                Trigger::Withdrawn { mm: 4.0 },
                moved(|s| s.insertion_mm = 27.0),
                moved(|s| s.insertion_mm = 26.0),
            ),
            (
                Trigger::Tilted { deg: 5.0 },
                moved(|s| s.pitch_deg = 3.0),
                moved(|s| (s.pitch_deg, s.yaw_deg) = (3.0, -4.0)),
            ),
            (
                Trigger::TipRaised { deg: 5.0 },
                moved(|s| (s.pitch_deg, s.yaw_deg) = (4.0, 9.0)),
                moved(|s| s.pitch_deg = 5.0),
            ),
            (
                Trigger::Rolled { deg: 30.0 },
                moved(|s| s.roll_deg = 29.0),
                moved(|s| s.roll_deg = -30.0),
            ),
            (
                Trigger::LoopOut { mm: 15.0 },
                moved(|s| s.stroke_mm = 14.0),
                moved(|s| s.stroke_mm = 15.0),
            ),
            (
                Trigger::LoopIn { mm: 2.0 },
                moved(|s| s.stroke_mm = 3.0),
                moved(|s| s.stroke_mm = 2.0),
            ),
            (Trigger::Coagulated { s: 0.1 }, coagulating(false), coagulating(true)),
            (Trigger::BladderBelow { ml: 100.0 }, bladder(101.0), bladder(100.0)),
            (Trigger::BladderAbove { ml: 300.0 }, bladder(299.0), bladder(300.0)),
        ];
        for (trigger, short, enough) in cases {
            let steps = [step(trigger)];
            let progress = run(&steps, [begin.clone(), short.clone()]);
            assert!(progress.done_at_s.is_empty() && progress.share < 1.0, "{trigger:?}");
            let progress = run(&steps, [begin.clone(), short, enough]);
            assert_eq!(progress.done_at_s.len(), 1, "{trigger:?}");
        }
    }

    #[test]
    fn a_cut_is_weighed() {
        let steps = [step(Trigger::Cut { g: 0.5 })];
        let mut observed = with(InstrumentState::default());
        observed.removed_mm3 = 100.0;
        let mut metrics = Metrics::default();
        metrics.removal.density_g_per_mm3 = 1e-3;
        let mut progress = StepProgress::default();
        for cuts in 1..=6 {
            metrics.count_step(&observed);
            metrics.removal.observe(&observed);
            progress.observe(&steps, &observed, &metrics);
            // The first cut is there when the step begins.
            assert_eq!(progress.done_at_s.len(), usize::from(cuts == 6), "{cuts}");
        }
    }
}
