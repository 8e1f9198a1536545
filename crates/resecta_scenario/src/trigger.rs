//! What ends a step: something that the player does, or that comes of it.
//!
//! Most triggers count from the moment their step began. Those with a time hold only while what they ask for is so, without a break.

use resecta_anatomy::{Landmark, Zone};
use resecta_instrument::{InstrumentAction, InstrumentField, InstrumentState};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::{
    errors::RuleError,
    exercise::Exercise,
    extension::GoalId,
    metrics::{Metrics, StepObservation},
    sight::LandmarkObservation,
};

/// A part of the instrument that moves no faster than this rests, mm/s or degrees/s: our choice, a tenth of what held keys move it.
const TREMOR_PER_S: f64 = 2.0;

/// Something that the player does, or that comes of it. All numbers are above 0.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub enum Trigger {
    /// The sheath is this far deeper than when the step began, or where it was furthest out since, mm.
    Advanced {
        /// mm.
        #[schemars(extend("exclusiveMinimum" = 0))]
        mm: f64,
    },
    /// The sheath is this far further out than when the step began, or where it was deepest since, mm.
    Withdrawn {
        /// mm.
        #[schemars(extend("exclusiveMinimum" = 0))]
        mm: f64,
    },
    /// The middle of the sheath's tip is this near to a landmark, mm.
    Reached {
        /// `Verumontanum`, `BladderNeck`, `ExternalSphincter`, `LeftOrifice` or `RightOrifice`.
        landmark: Landmark,
        /// mm.
        #[schemars(extend("exclusiveMinimum" = 0))]
        mm: f64,
    },
    /// The lens has seen a landmark for so long: in the round field, within 45 mm, hidden by neither tissue nor murk.
    LookedAt {
        /// As of `Reached`.
        landmark: Landmark,
        /// s.
        #[schemars(extend("exclusiveMinimum" = 0))]
        s: f64,
    },
    /// The tip has turned up, down or sideways this far from where it pointed when the step began, degrees.
    Tilted {
        /// Degrees.
        #[schemars(extend("exclusiveMinimum" = 0))]
        deg: f64,
    },
    /// The tip has turned up this far from where it pointed when the step began, or at its lowest since, degrees.
    TipRaised {
        /// Degrees.
        #[schemars(extend("exclusiveMinimum" = 0))]
        deg: f64,
    },
    /// The instrument has rolled this far from where it was, either way, degrees.
    Rolled {
        /// Degrees.
        #[schemars(extend("exclusiveMinimum" = 0))]
        deg: f64,
    },
    /// The instrument has come to rest rolled by at most this much from upright, either way, degrees.
    Upright {
        /// Degrees.
        #[schemars(extend("exclusiveMinimum" = 0))]
        deg: f64,
    },
    /// The loop has come to rest at least this far out, and the sheath with it, mm.
    LoopOut {
        /// mm.
        #[schemars(extend("exclusiveMinimum" = 0))]
        mm: f64,
    },
    /// The loop has come to rest at most this far out, mm.
    LoopIn {
        /// mm.
        #[schemars(extend("exclusiveMinimum" = 0))]
        mm: f64,
    },
    /// This much tissue went in the step, g.
    Cut {
        /// g.
        #[schemars(extend("exclusiveMinimum" = 0))]
        g: f64,
    },
    /// The coagulating current flowed this long through a loop in contact with tissue, s.
    Coagulated {
        /// s.
        #[schemars(extend("exclusiveMinimum" = 0))]
        s: f64,
    },
    /// This share of the marked region is gone, however long since; at most 1.
    MarkedRemoved {
        /// Share of its volume at rest.
        #[schemars(extend("exclusiveMinimum" = 0, "maximum" = 1))]
        share: f64,
    },
    /// This share of a zone is gone, however long since; at most 1.
    ZoneRemoved {
        /// `LateralLobe`, `MiddleLobe`, `Peripheral` or `Other`.
        zone: Zone,
        /// Share of its volume at rest.
        #[schemars(extend("exclusiveMinimum" = 0, "maximum" = 1))]
        share: f64,
    },
    /// No vessel has bled for this long, s. Needs `models.water.bleeding`.
    NothingBleeds {
        /// s.
        #[schemars(extend("exclusiveMinimum" = 0))]
        s: f64,
    },
    /// The pressure in the bladder has been this or less for so long. Needs `models.water`.
    PressureKept {
        /// cmH2O.
        #[schemars(extend("exclusiveMinimum" = 0))]
        cmh2o: f64,
        /// s.
        #[schemars(extend("exclusiveMinimum" = 0))]
        s: f64,
    },
    /// At least this share of the light has come back to the lens for so long; at most 1. Needs `models.water.turbidity`.
    ViewClear {
        /// Share of the light.
        #[schemars(extend("exclusiveMinimum" = 0, "maximum" = 1))]
        share: f64,
        /// s.
        #[schemars(extend("exclusiveMinimum" = 0))]
        s: f64,
    },
    /// So much time has passed in the step, s.
    Waited {
        /// s.
        #[schemars(extend("exclusiveMinimum" = 0))]
        s: f64,
    },
    /// The bladder holds this much or less, ml. Needs `models.water`.
    BladderBelow {
        /// ml.
        #[schemars(extend("exclusiveMinimum" = 0))]
        ml: f64,
    },
    /// The bladder holds this much or more, ml. Needs `models.water`.
    BladderAbove {
        /// ml.
        #[schemars(extend("exclusiveMinimum" = 0))]
        ml: f64,
    },
    /// The bladder holds this much less than when the step began, or when it was fullest since, ml. Needs `models.water`.
    Drained {
        /// ml.
        #[schemars(extend("exclusiveMinimum" = 0))]
        ml: f64,
    },
    /// The bladder holds this much more than when the step began, or when it was emptiest since, ml. Needs `models.water`.
    Filled {
        /// ml.
        #[schemars(extend("exclusiveMinimum" = 0))]
        ml: f64,
    },
    /// A goal of an extension is reached, counted from the start of the run: `Extension("its_name")`.
    Extension(GoalId),
}

impl Trigger {
    /// Its name in files, and its numbers by their fields.
    pub(crate) fn parts(&self) -> (&'static str, Vec<(&'static str, f64)>) {
        match *self {
            Trigger::Advanced { mm } => ("Advanced", vec![("mm", mm)]),
            Trigger::Withdrawn { mm } => ("Withdrawn", vec![("mm", mm)]),
            Trigger::Reached { mm, .. } => ("Reached", vec![("mm", mm)]),
            Trigger::LookedAt { s, .. } => ("LookedAt", vec![("s", s)]),
            Trigger::Tilted { deg } => ("Tilted", vec![("deg", deg)]),
            Trigger::TipRaised { deg } => ("TipRaised", vec![("deg", deg)]),
            Trigger::Rolled { deg } => ("Rolled", vec![("deg", deg)]),
            Trigger::Upright { deg } => ("Upright", vec![("deg", deg)]),
            Trigger::LoopOut { mm } => ("LoopOut", vec![("mm", mm)]),
            Trigger::LoopIn { mm } => ("LoopIn", vec![("mm", mm)]),
            Trigger::Cut { g } => ("Cut", vec![("g", g)]),
            Trigger::Coagulated { s } => ("Coagulated", vec![("s", s)]),
            Trigger::MarkedRemoved { share } => ("MarkedRemoved", vec![("share", share)]),
            Trigger::ZoneRemoved { share, .. } => ("ZoneRemoved", vec![("share", share)]),
            Trigger::NothingBleeds { s } => ("NothingBleeds", vec![("s", s)]),
            Trigger::PressureKept { cmh2o, s } => ("PressureKept", vec![("cmh2o", cmh2o), ("s", s)]),
            Trigger::ViewClear { share, s } => ("ViewClear", vec![("share", share), ("s", s)]),
            Trigger::Waited { s } => ("Waited", vec![("s", s)]),
            Trigger::BladderBelow { ml } => ("BladderBelow", vec![("ml", ml)]),
            Trigger::BladderAbove { ml } => ("BladderAbove", vec![("ml", ml)]),
            Trigger::Drained { ml } => ("Drained", vec![("ml", ml)]),
            Trigger::Filled { ml } => ("Filled", vec![("ml", ml)]),
            Trigger::Extension(_) => ("Extension", Vec::new()),
        }
    }

    /// The landmark that it is about; none for most.
    pub fn landmark(&self) -> Option<Landmark> {
        match *self {
            Trigger::Reached { landmark, .. } | Trigger::LookedAt { landmark, .. } => Some(landmark),
            _ => None,
        }
    }

    /// What the player does it with.
    pub fn actions(&self) -> &'static [InstrumentAction] {
        use InstrumentAction as Action;
        match self {
            Trigger::Advanced { .. } => &[Action::Advance],
            Trigger::Withdrawn { .. } => &[Action::Withdraw],
            Trigger::Reached { .. } => &[Action::Advance, Action::Withdraw],
            Trigger::LookedAt { .. } => &[
                Action::Advance,
                Action::Withdraw,
                Action::TipUp,
                Action::TipDown,
                Action::RollLeft,
                Action::RollRight,
            ],
            Trigger::Tilted { .. } => &[Action::TipUp, Action::TipDown, Action::TipLeft, Action::TipRight],
            Trigger::TipRaised { .. } => &[Action::TipUp],
            Trigger::Rolled { .. } | Trigger::Upright { .. } => &[Action::RollLeft, Action::RollRight],
            Trigger::LoopOut { .. } => &[Action::LoopOut],
            Trigger::LoopIn { .. } => &[Action::LoopIn],
            Trigger::Cut { .. } => &[Action::TipDown, Action::Cut, Action::LoopIn],
            Trigger::Coagulated { .. } => &[Action::LoopOut, Action::TipDown, Action::Coagulate],
            Trigger::MarkedRemoved { .. } | Trigger::ZoneRemoved { .. } => {
                &[Action::TipDown, Action::Cut, Action::LoopIn]
            }
            Trigger::NothingBleeds { .. } => &[Action::LoopOut, Action::Coagulate],
            Trigger::PressureKept { .. } => &[Action::InflowClose, Action::OutflowOpen],
            Trigger::ViewClear { .. } => &[Action::InflowOpen, Action::OutflowOpen],
            Trigger::Waited { .. } => &[],
            Trigger::BladderAbove { .. } | Trigger::Filled { .. } => &[Action::InflowOpen, Action::OutflowClose],
            Trigger::BladderBelow { .. } | Trigger::Drained { .. } => &[Action::InflowClose, Action::OutflowOpen],
            Trigger::Extension(goal) => goal.actions(),
        }
    }

    /// Whether what it asks for is so now; for triggers that want it for a time.
    pub(crate) fn holds(&self, now: &Moment) -> bool {
        match *self {
            Trigger::LookedAt { .. } => now.landmark.is_some_and(|landmark| landmark.unseen.is_none()),
            Trigger::NothingBleeds { .. } => now.bleeders == 0,
            Trigger::PressureKept { cmh2o, .. } => now.pressure_cmh2o <= cmh2o,
            Trigger::ViewClear { share, .. } => now.visibility >= share,
            _ => false,
        }
    }

    /// The parts of the instrument that have to rest where the trigger wants them: what is only passed by is not reached. None for
    /// triggers that ask for something done.
    pub(crate) fn rests(&self) -> &'static [InstrumentField] {
        match self {
            Trigger::Upright { .. } => &[InstrumentField::Roll],
            Trigger::LoopOut { .. } => &[InstrumentField::Stroke, InstrumentField::Insertion],
            Trigger::LoopIn { .. } => &[InstrumentField::Stroke],
            _ => &[],
        }
    }

    /// Whether it asks for a turn alone, where the sheath is.
    pub(crate) fn is_done_in_place(&self) -> bool {
        use Trigger::{Rolled, Tilted, TipRaised, Upright};
        matches!(self, Rolled { .. } | Tilted { .. } | TipRaised { .. } | Upright { .. })
    }

    /// Moves the beginning of a way that is counted in one sense to where it would be longest.
    pub(crate) fn begin_further_back(&self, from: &mut Moment, now: &Moment) {
        let (was, is) = (&mut from.instrument, &now.instrument);
        match self {
            Trigger::Advanced { .. } => was.insertion_mm = was.insertion_mm.min(is.insertion_mm),
            Trigger::Withdrawn { .. } => was.insertion_mm = was.insertion_mm.max(is.insertion_mm),
            Trigger::TipRaised { .. } => was.pitch_deg = was.pitch_deg.min(is.pitch_deg),
            Trigger::Drained { .. } => from.bladder_ml = from.bladder_ml.max(now.bladder_ml),
            Trigger::Filled { .. } => from.bladder_ml = from.bladder_ml.min(now.bladder_ml),
            _ => {}
        }
    }

    /// How far a step has come, 0 to 1 at its end, with what was so at its beginning, what is so now, and for how long it held.
    pub(crate) fn share(&self, from: &Moment, now: &Moment, held_s: f64) -> f64 {
        let (was, is) = (&from.instrument, &now.instrument);
        let apart = |a: f32, b: f32| f64::from(a) - f64::from(b);
        match *self {
            Trigger::Advanced { mm } => apart(is.insertion_mm, was.insertion_mm) / mm,
            Trigger::Withdrawn { mm } => apart(was.insertion_mm, is.insertion_mm) / mm,
            // From wherever the step began: how far that was from the landmark is not known then.
            Trigger::Reached { mm, .. } => now.landmark.map_or(0.0, |landmark| mm / landmark.tip_mm()),
            Trigger::Tilted { deg } => apart(is.pitch_deg, was.pitch_deg).hypot(apart(is.yaw_deg, was.yaw_deg)) / deg,
            Trigger::TipRaised { deg } => apart(is.pitch_deg, was.pitch_deg) / deg,
            Trigger::Rolled { deg } => apart(is.roll_deg, was.roll_deg).abs() / deg,
            Trigger::Upright { deg } => downwards(f64::from(was.roll_deg).abs(), f64::from(is.roll_deg).abs(), deg),
            Trigger::LoopOut { mm } => f64::from(is.stroke_mm) / mm,
            Trigger::LoopIn { mm } => downwards(f64::from(was.stroke_mm), f64::from(is.stroke_mm), mm),
            Trigger::Cut { g } => (now.removed_g - from.removed_g) / g,
            Trigger::Coagulated { s } => (now.coagulated_s - from.coagulated_s) / s,
            Trigger::MarkedRemoved { share } => now.marked_share / share,
            Trigger::ZoneRemoved { zone, share } => now.zone_shares[zone.index()] / share,
            Trigger::LookedAt { s, .. }
            | Trigger::NothingBleeds { s }
            | Trigger::PressureKept { s, .. }
            | Trigger::ViewClear { s, .. } => held_s / s,
            Trigger::Waited { s } => (now.time_s - from.time_s) / s,
            Trigger::BladderBelow { ml } => downwards(from.bladder_ml, now.bladder_ml, ml),
            // As far up as below it is down.
            Trigger::BladderAbove { ml } => downwards(-from.bladder_ml, -now.bladder_ml, -ml),
            Trigger::Drained { ml } => (from.bladder_ml - now.bladder_ml) / ml,
            Trigger::Filled { ml } => (now.bladder_ml - from.bladder_ml) / ml,
            Trigger::Extension(_) => now.extension_share,
        }
        .clamp(0.0, 1.0)
    }

    /// Checks its numbers, and that the exercise models what it looks at. `field` is where it stands.
    pub(crate) fn check(&self, field: &str, exercise: &Exercise) -> Result<(), RuleError> {
        let (name, numbers) = self.parts();
        for (unit, number) in numbers {
            let field = format!("{field}.{name}.{unit}");
            if !(number > 0.0 && number.is_finite()) {
                let expected = format!("a finite number of {unit} above 0");
                return Err(RuleError::new(field, number, expected));
            }
            if unit == "share" && number > 1.0 {
                return Err(RuleError::new(field, number, "a share above 0 and at most 1"));
            }
        }
        let water = exercise.models.water.as_ref();
        let expected = match self {
            Self::BladderBelow { .. }
            | Self::BladderAbove { .. }
            | Self::Drained { .. }
            | Self::Filled { .. }
            | Self::PressureKept { .. }
            | Self::NothingBleeds { .. }
            | Self::ViewClear { .. }
                if water.is_none() =>
            {
                "a trigger that a dry exercise has, or `models: (water: (..))`"
            }
            Self::NothingBleeds { .. } if water.is_some_and(|water| water.bleeding.is_none()) => {
                "another trigger, or `models: (water: (bleeding: (..)))`"
            }
            Self::ViewClear { .. } if water.is_some_and(|water| water.turbidity.is_none()) => {
                "another trigger, or `models: (water: (turbidity: (..)))`"
            }
            _ => return Ok(()),
        };
        Err(RuleError::new(field, name, expected))
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
pub(crate) struct Moment {
    instrument: InstrumentState,
    time_s: f64,
    removed_g: f64,
    marked_share: f64,
    zone_shares: [f64; Zone::COUNT],
    coagulated_s: f64,
    bladder_ml: f64,
    pressure_cmh2o: f64,
    visibility: f64,
    bleeders: usize,
    landmark: Option<LandmarkObservation>,
    /// Of the goal that the step waits for, where it is an extension's.
    extension_share: f64,
}

impl Moment {
    /// Whether parts of the instrument rest: none has moved since `before`, `step_s` ago, but for a tremor.
    pub fn rests(&self, before: &Self, fields: &[InstrumentField], step_s: f64) -> bool {
        let moved = |field: &InstrumentField| (self.instrument.get(*field) - before.instrument.get(*field)).abs();
        (fields.iter()).all(|field| f64::from(moved(field)) <= TREMOR_PER_S * step_s)
    }

    /// Counts nothing of what was done since `before`: sums that a beginning is subtracted from begin so much higher.
    pub fn pass_over(&mut self, before: &Self, now: &Self) {
        self.time_s += now.time_s - before.time_s;
        self.removed_g += now.removed_g - before.removed_g;
        self.coagulated_s += now.coagulated_s - before.coagulated_s;
    }

    /// How the sheath goes back to where it was; none where it is no further from there than `near_mm`.
    pub fn back_to(&self, before: &Self, near_mm: f32) -> Option<InstrumentAction> {
        let deeper_mm = self.instrument.insertion_mm - before.instrument.insertion_mm;
        let back = if deeper_mm > 0.0 {
            InstrumentAction::Withdraw
        } else {
            InstrumentAction::Advance
        };
        (deeper_mm.abs() > near_mm).then_some(back)
    }

    /// What a step that waits for `trigger` looks at.
    pub fn new(step: &StepObservation, metrics: &Metrics, trigger: &Trigger) -> Self {
        Self {
            instrument: step.instrument,
            time_s: metrics.elapsed_s(),
            removed_g: metrics.removal.mass_g(),
            marked_share: metrics.removal.marked_share(),
            zone_shares: Zone::ALL.map(|zone| metrics.removal.zone_share(zone)),
            pressure_cmh2o: step.water.pressure_cmh2o,
            visibility: step.water.visibility,
            bleeders: step.water.bleeders,
            landmark: step.landmark,
            coagulated_s: metrics.current.coagulation_in_contact_s,
            bladder_ml: step.water.bladder_ml,
            extension_share: match trigger {
                Trigger::Extension(goal) => metrics.extension(goal.metric()),
                _ => 0.0,
            },
        }
    }
}
