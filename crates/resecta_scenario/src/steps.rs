//! Steps of an exercise that teaches by doing: each says what to do and ends when it was done.
//!
//! Steps are taken in order, one at a time. Everything that a trigger asks for is counted from the moment its step began, so
//! that nothing done before is given away; heights of the loop and contents of the bladder are what they are. A way, and what is to
//! enter or leave the bladder, is counted from where the step began or, for whoever went too far before and comes back first, from the
//! furthest back since. Where the roll or the loop is to be somewhere, the hands have to come to rest there: whoever passes by, on the
//! way back too far, say, has not done it.

use bevy::prelude::*;
use resecta_instrument::InstrumentAction;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::{
    errors::RuleError,
    exercise::Exercise,
    metrics::{Metrics, StepObservation},
    reach,
    rules::Faults,
    sight::FAR_MM,
    trigger::{Moment, Trigger},
};

/// The least that [`Step::near_marked_mm`] may be: a wire that lies on a pentahedron is up to about so far from its middle.
const LEAST_NEAR_MM: f64 = 5.0;

/// For how long hands rest where they are to be before a step is done, s: our choice, long enough for who passes by.
const REST_S: f64 = 0.2;

/// Whoever is to turn in place and is blind goes back to where the step began, if that is further than this, mm: our choice.
const STRAYED_MM: f32 = 3.0;

/// One step of an exercise.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Step {
    /// What to do, shown to the player.
    pub say: String,
    /// Why, or how it is done best; shown smaller.
    #[serde(default)]
    pub hint: String,
    /// What ends the step.
    pub until: Trigger,
    /// What else the player does on the way, as in settings files: `TipUp` for one. Its keys are shown beside those of `until`.
    #[serde(default)]
    pub also: Vec<InstrumentAction>,
    /// What is done counts only while the wire is so near to the middle of a marked pentahedron, mm, at least 5: whoever is
    /// elsewhere is told the way back. Without it a step counts anywhere, as it does once nothing marked is left.
    #[serde(default)]
    #[schemars(extend("minimum" = LEAST_NEAR_MM))]
    pub near_marked_mm: Option<f64>,
    /// What is done counts only while the lens sees so far somewhere in its picture, in the middle or two thirds of the way to the rim,
    /// mm, above 0 and at most 45: whoever works blind is told so. 3 is less than what a lens sees in a urethra that lies open before it, 4 to 10,
    /// and more than one that lies on tissue does, 2 at most.
    #[serde(default)]
    #[schemars(extend("exclusiveMinimum" = 0, "maximum" = FAR_MM))]
    pub seeing_mm: Option<f64>,
}

/// How far the steps of the exercise in play have come. Empty for an exercise without steps.
#[derive(Resource, Debug, Clone, PartialEq, Default)]
pub struct StepProgress {
    /// When each step that is done was done, simulated s, in order.
    pub done_at_s: Vec<f64>,
    /// How far the present step has come, 0 to 1.
    pub share: f64,
    /// The way to the marked tissue, as of [`StepObservation::marked_way`], for whoever is too far from it for what they do to
    /// count; none for all others.
    pub away: Option<Vec3>,
    /// Whether the lens sees less far than the step asks for, so that nothing counts.
    pub is_blind: bool,
    /// Whether the loop or the roll is where the step wants it, and the hands have yet to come to rest there.
    pub is_there: bool,
    /// The way back to where the step began, for whoever is blind in one that is done by turning in place and has left the place.
    pub back: Option<InstrumentAction>,
    from: Option<Moment>,
    /// What was so in the fixed step before.
    before: Option<Moment>,
    /// For how long what the step asks for has been so, s.
    held_s: f64,
    /// For how long the hands have rested where it asks for that, s.
    rest_s: f64,
}

impl StepProgress {
    /// The number of the present step, from 0; none when all are done or there are none.
    pub fn current(&self, exercise: &Exercise) -> Option<usize> {
        let next = self.done_at_s.len();
        (next < exercise.steps.len()).then_some(next)
    }

    /// The present step of the exercise in play; none when all are done or there are none.
    pub fn present<'a>(&self, exercise: &'a Exercise) -> Option<&'a Step> {
        exercise.steps.get(self.done_at_s.len())
    }

    /// Takes one fixed step into account, after the metrics. At most one step ends in it.
    pub fn observe(&mut self, steps: &[Step], observed: &StepObservation, metrics: &Metrics) {
        let Some(step) = steps.get(self.done_at_s.len()) else {
            return;
        };
        let now = Moment::new(observed, metrics, &step.until);
        let from = self.from.get_or_insert(now);
        let before = self.before.replace(now).unwrap_or(now);
        let near_mm = step.near_marked_mm.unwrap_or(f64::INFINITY);
        self.away = (observed.marked_way).filter(|way| f64::from(way.length()) > near_mm);
        self.is_blind = (step.seeing_mm.zip(observed.sees_mm)).is_some_and(|(least_mm, mm)| mm < least_mm);
        (self.is_there, self.back) = (false, None);
        if self.away.is_some() || self.is_blind {
            from.pass_over(&before, &now);
            (self.held_s, self.rest_s) = (0.0, 0.0);
            if self.is_blind && step.until.is_done_in_place() {
                self.back = now.back_to(from, STRAYED_MM);
            }
            return;
        }
        step.until.begin_further_back(from, &now);
        let from = *from;
        self.held_s = if step.until.holds(&now) {
            self.held_s + observed.step_s
        } else {
            0.0
        };
        self.share = step.until.share(&from, &now, self.held_s);
        let (resting, is_there) = (step.until.rests(), self.share >= 1.0);
        self.rest_s = if is_there && now.rests(&before, resting, observed.step_s) {
            self.rest_s + observed.step_s
        } else {
            0.0
        };
        if is_there && (resting.is_empty() || self.rest_s >= REST_S) {
            self.done_at_s.push(metrics.elapsed_s());
            self.from = Some(now);
            (self.share, self.held_s, self.rest_s) = (0.0, 0.0, 0.0);
        } else {
            self.is_there = is_there;
        }
    }
}

/// Checks the steps of an exercise.
pub(crate) fn check(exercise: &Exercise, faults: &mut Faults) {
    for (index, step) in exercise.steps.iter().enumerate() {
        let field = format!("steps[{index}]");
        faults.require(!step.say.trim().is_empty(), || {
            RuleError::new(format!("{field}.say"), "empty", "some text")
        });
        faults.note(step.until.check(&format!("{field}.until"), exercise));
        if let Some(seeing_mm) = step.seeing_mm {
            faults.require(seeing_mm > 0.0 && seeing_mm <= f64::from(FAR_MM), || {
                let expected = format!("a number of mm above 0, {FAR_MM} at most: the light reaches no further");
                RuleError::new(format!("{field}.seeing_mm"), seeing_mm, expected)
            });
        }
        if let Some(near_mm) = step.near_marked_mm {
            faults.require(near_mm >= LEAST_NEAR_MM && near_mm.is_finite(), || {
                let expected = format!("a finite number of mm, {LEAST_NEAR_MM} or more");
                RuleError::new(format!("{field}.near_marked_mm"), near_mm, expected)
            });
        }
    }
    reach::check(exercise, faults);
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sight::{LandmarkObservation, Unseen};
    use resecta_anatomy::{Landmark, Zone};
    use resecta_instrument::InstrumentState;

    fn step(until: Trigger) -> Step {
        Step {
            say: "do it".into(),
            hint: String::new(),
            until,
            also: Vec::new(),
            near_marked_mm: None,
            seeing_mm: None,
        }
    }

    /// A fixed step with the instrument so.
    fn with(instrument: InstrumentState) -> StepObservation {
        StepObservation::idle(0.1, instrument, Vec3::ZERO)
    }

    /// A landmark so far ahead of the tip.
    fn landmark(tip_mm: f32, unseen: Option<Unseen>) -> LandmarkObservation {
        LandmarkObservation {
            from_tip: Vec3::new(0.0, 0.0, -tip_mm),
            from_lens: Vec3::new(0.0, 0.0, -tip_mm),
            unseen,
        }
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
    fn whoever_went_too_far_before_may_come_back_first() {
        let with = |insertion_mm, pitch_deg| {
            with(InstrumentState {
                insertion_mm,
                pitch_deg,
                ..default()
            })
        };
        let at = |insertion_mm| with(insertion_mm, 0.0);
        let advance = [step(Trigger::Advanced { mm: 12.0 })];
        assert_eq!(run(&advance, [at(78.0), at(34.0), at(45.0)]).done_at_s.len(), 0);
        assert_eq!(run(&advance, [at(78.0), at(34.0), at(46.5)]).done_at_s.len(), 1);
        let withdraw = [step(Trigger::Withdrawn { mm: 12.0 })];
        assert_eq!(run(&withdraw, [at(5.0), at(30.0), at(17.0)]).done_at_s.len(), 1);
        let raise = [step(Trigger::TipRaised { deg: 10.0 })];
        assert_eq!(
            run(&raise, [with(0.0, 30.0), with(0.0, -5.0), with(0.0, 6.0)])
                .done_at_s
                .len(),
            1
        );
    }

    #[test]
    fn upright_is_told_from_where_the_instrument_was_rolled_to() {
        let steps = [step(Trigger::Upright { deg: 5.0 })];
        let rolled = |roll_deg| with(InstrumentState { roll_deg, ..default() });
        let progress = run(&steps, [rolled(-30.0), rolled(17.5)]);
        assert!((progress.share - 0.5).abs() < 1e-6, "{progress:?}");
        let rests_at = |deg| [rolled(-30.0), rolled(deg), rolled(deg), rolled(deg)];
        assert_eq!(run(&steps, rests_at(5.0)).done_at_s.len(), 1);
        assert!(run(&steps, rests_at(6.0)).done_at_s.is_empty());
    }

    #[test]
    fn whoever_passes_by_has_not_done_it_and_whoever_comes_to_rest_has() {
        let loop_at = |stroke_mm, insertion_mm| {
            with(InstrumentState {
                stroke_mm,
                insertion_mm,
                ..default()
            })
        };
        let out = [step(Trigger::LoopOut { mm: 15.0 })];
        let done = |observed: &[StepObservation]| run(&out, observed.iter().cloned()).done_at_s.len();
        let passes = [5.0, 12.0, 19.0, 22.0].map(|mm| loop_at(mm, 40.0));
        assert_eq!(done(&passes), 0);
        // Out, but the sheath is still drawn back.
        let drawn = [40.0, 38.0, 36.0, 34.0].map(|mm| loop_at(20.0, mm));
        assert_eq!(done(&drawn), 0);
        let rests = [19.0, 20.0, 20.0, 20.1].map(|mm| loop_at(mm, 40.0));
        assert_eq!(done(&rests[..3]), 0);
        let is_there = |observed: &[StepObservation]| run(&out, observed.iter().cloned()).is_there;
        assert!(is_there(&passes) && is_there(&rests[..3]) && !is_there(&rests) && !is_there(&passes[..2]));
        assert_eq!(done(&rests), 1);
        let swings = [-30.0, -4.0, 8.0, 4.0, -2.0].map(|roll_deg| with(InstrumentState { roll_deg, ..default() }));
        assert_eq!(run(&[step(Trigger::Upright { deg: 5.0 })], swings).done_at_s.len(), 0);
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
        let coagulating = |current_in_tissue| {
            let mut observed = moved(|state| state.coagulate = true);
            observed.current_in_tissue = current_in_tissue;
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
            // From 200 ml.
            (Trigger::Drained { ml: 40.0 }, bladder(161.0), bladder(160.0)),
            (Trigger::Filled { ml: 15.0 }, bladder(214.0), bladder(215.0)),
            // It went on filling before it was drained.
            (Trigger::Drained { ml: 40.0 }, bladder(300.0), bladder(260.0)),
        ];
        for (trigger, short, enough) in cases {
            let steps = [step(trigger)];
            let progress = run(&steps, [begin.clone(), short.clone()]);
            assert!(progress.done_at_s.is_empty() && progress.share < 1.0, "{trigger:?}");
            let mut observed = vec![begin.clone(), short, enough.clone()];
            if !trigger.rests().is_empty() {
                // And stays there.
                observed.extend([enough.clone(), enough]);
            }
            let progress = run(&steps, observed);
            assert_eq!(progress.done_at_s.len(), 1, "{trigger:?}");
        }
    }

    #[test]
    fn what_is_wanted_for_a_time_is_wanted_without_a_break() {
        let so = |pressure_cmh2o, bleeders, visibility| {
            let mut observed = with(InstrumentState::default());
            observed.water.pressure_cmh2o = pressure_cmh2o;
            observed.water.bleeders = bleeders;
            observed.water.visibility = visibility;
            observed
        };
        let (good, bad) = (so(9.0, 0, 0.9), so(11.0, 1, 0.7));
        let (good, bad) = (
            StepObservation {
                landmark: Some(landmark(20.0, None)),
                ..good
            },
            StepObservation {
                landmark: Some(landmark(20.0, Some(Unseen::BehindTissue))),
                ..bad
            },
        );
        for trigger in [
            Trigger::LookedAt {
                landmark: Landmark::Verumontanum,
                s: 0.25,
            },
            Trigger::PressureKept { cmh2o: 10.0, s: 0.25 },
            Trigger::NothingBleeds { s: 0.25 },
            Trigger::ViewClear { share: 0.8, s: 0.25 },
        ] {
            let steps = [step(trigger)];
            let after = |observed: &[&StepObservation]| run(&steps, observed.iter().copied().cloned());
            // A fixed step is 0.1 s here.
            let interrupted = after(&[&good, &good, &bad, &good, &good]);
            assert!(interrupted.done_at_s.is_empty(), "{trigger:?}");
            assert!((interrupted.share - 0.8).abs() < 1e-6, "{trigger:?}");
            assert_eq!(after(&[&bad, &good, &good, &good]).done_at_s.len(), 1, "{trigger:?}");
        }
        let waited = [step(Trigger::Waited { s: 0.25 })];
        assert!(run(&waited, vec![bad.clone(); 3]).done_at_s.is_empty());
        assert_eq!(run(&waited, vec![bad; 4]).done_at_s.len(), 1);
    }

    #[test]
    fn what_is_done_blind_does_not_count_but_the_way_that_was_gone_does() {
        let seeing = |until| Step {
            seeing_mm: Some(6.0),
            ..step(until)
        };
        let at = |insertion_mm, sees_mm: f64| StepObservation {
            sees_mm: Some(sees_mm),
            ..with(InstrumentState {
                insertion_mm,
                ..default()
            })
        };
        let advance = [seeing(Trigger::Advanced { mm: 10.0 })];
        let progress = run(&advance, [at(20.0, 9.0), at(31.0, 1.0)]);
        assert!(progress.done_at_s.is_empty() && progress.is_blind);
        let progress = run(&advance, [at(20.0, 9.0), at(31.0, 1.0), at(31.0, 7.0)]);
        assert!(progress.done_at_s.len() == 1 && !progress.is_blind);
        let burn = |sees_mm| StepObservation {
            current_in_tissue: true,
            sees_mm: Some(sees_mm),
            ..with(InstrumentState {
                stroke_mm: 5.0,
                coagulate: true,
                ..default()
            })
        };
        let burning = [seeing(Trigger::Coagulated { s: 0.1 })];
        let done = |observed: &[StepObservation]| run(&burning, observed.iter().cloned()).done_at_s.len();
        assert_eq!(done(&[at(20.0, 9.0), burn(2.0), at(20.0, 9.0)]), 0);
        assert_eq!(done(&[at(20.0, 9.0), burn(9.0)]), 1);
    }

    #[test]
    fn whoever_is_blind_where_they_are_to_turn_is_led_back_to_where_the_step_began() {
        let raise = Step {
            seeing_mm: Some(3.0),
            ..step(Trigger::TipRaised { deg: 5.0 })
        };
        let at = |insertion_mm, sees_mm: f64| StepObservation {
            sees_mm: Some(sees_mm),
            ..with(InstrumentState {
                insertion_mm,
                ..default()
            })
        };
        let led = |observed: [StepObservation; 2]| run(std::slice::from_ref(&raise), observed).back;
        assert_eq!(led([at(20.0, 9.0), at(10.0, 1.0)]), Some(InstrumentAction::Advance));
        assert_eq!(led([at(20.0, 9.0), at(30.0, 1.0)]), Some(InstrumentAction::Withdraw));
        assert_eq!(led([at(20.0, 9.0), at(18.0, 1.0)]), None, "the place itself");
        assert_eq!(led([at(20.0, 9.0), at(10.0, 9.0)]), None, "it sees");
        let advance = [Step {
            seeing_mm: Some(3.0),
            ..step(Trigger::Advanced { mm: 10.0 })
        }];
        assert_eq!(run(&advance, [at(20.0, 9.0), at(10.0, 1.0)]).back, None, "a way");
    }

    #[test]
    fn a_landmark_is_reached_by_the_tip() {
        let steps = [step(Trigger::Reached {
            landmark: Landmark::BladderNeck,
            mm: 8.0,
        })];
        let at = |tip_mm| {
            let mut observed = with(InstrumentState::default());
            observed.landmark = Some(landmark(tip_mm, Some(Unseen::OutOfField)));
            observed
        };
        let progress = run(&steps, [at(40.0), at(16.0)]);
        assert!(progress.done_at_s.is_empty() && (progress.share - 0.5).abs() < 1e-9);
        assert_eq!(run(&steps, [at(40.0), at(16.0), at(7.9)]).done_at_s.len(), 1);
        // A case without it, which no completed one is.
        assert_eq!(run(&steps, [with(InstrumentState::default())]).share, 0.0);
    }

    #[test]
    fn shares_of_marked_tissue_and_of_a_zone_count_from_the_start_of_the_run() {
        let mut metrics = Metrics::default();
        metrics.removal.marked_total_mm3 = 200.0;
        metrics.removal.zone_total_mm3[Zone::MiddleLobe.index()] = 400.0;
        let mut observed = with(InstrumentState::default());
        observed.removed_by_zone_mm3[Zone::MiddleLobe.index()] = 50.0;
        observed.marked_removed_mm3 = 50.0;
        let steps = [
            step(Trigger::MarkedRemoved { share: 0.5 }),
            step(Trigger::ZoneRemoved {
                zone: Zone::MiddleLobe,
                share: 0.5,
            }),
        ];
        let mut progress = StepProgress::default();
        for done in [0, 1, 1, 2] {
            metrics.count_step(&observed);
            metrics.removal.observe(&observed);
            progress.observe(&steps, &observed, &metrics);
            assert_eq!(progress.done_at_s.len(), done);
        }
    }

    #[test]
    fn away_from_marked_tissue_nothing_counts_where_it_is_asked_for() {
        let near = |until| Step {
            near_marked_mm: Some(10.0),
            ..step(until)
        };
        let at = |way_mm: f32, insertion_mm, coagulate| {
            let mut observed = with(InstrumentState {
                insertion_mm,
                stroke_mm: 5.0,
                coagulate,
                ..default()
            });
            observed.current_in_tissue = true;
            observed.marked_way = Some(Vec3::Z * way_mm);
            observed
        };
        let advance = [near(Trigger::Advanced { mm: 10.0 })];
        // Begun and advanced in the bladder, then back, and along the marked tissue.
        let on_the_way = [at(20.0, 60.0, false), at(35.0, 75.0, false), at(9.0, 30.0, false)];
        let progress = run(&advance, on_the_way[..2].iter().cloned());
        assert_eq!((progress.away, progress.share), (Some(Vec3::Z * 35.0), 0.0));
        let progress = run(&advance, on_the_way.iter().cloned());
        assert!(progress.away.is_none() && progress.done_at_s.is_empty());
        let there = on_the_way.into_iter().chain([at(5.0, 41.0, false)]);
        assert_eq!(run(&advance, there).done_at_s.len(), 1);

        // What is summed up goes on where it was left.
        let coagulate = [near(Trigger::Coagulated { s: 0.35 })];
        let held = [5.0, 5.0, 5.0, 20.0, 20.0, 20.0, 5.0].map(|way_mm| at(way_mm, 30.0, true));
        assert!(run(&coagulate, held.iter().cloned()).done_at_s.is_empty());
        let held = held.into_iter().chain([at(5.0, 30.0, true)]);
        assert_eq!(run(&coagulate, held).done_at_s.len(), 1);
        // A loop that is drawn in does not count, wherever it is.
        let mut drawn_in = at(5.0, 30.0, true);
        (drawn_in.instrument.stroke_mm, drawn_in.loop_in_tissue) = (0.0, true);
        drawn_in.current_in_tissue = false;
        assert!(run(&coagulate, vec![drawn_in; 9]).done_at_s.is_empty());
        // Nothing marked is left: nobody is led back to it.
        let mut none_left = at(20.0, 60.0, false);
        none_left.marked_way = None;
        assert!(run(&advance, [none_left]).away.is_none());
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
