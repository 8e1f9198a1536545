//! The score: points line by line, by a formula that stands in the exercise file and is printed in the report.

use bevy::prelude::*;
use serde::Serialize;

use crate::{
    exercise::{Condition, Exercise, Goal, Part, ScoreRule},
    metrics::{MetricId, Metrics},
    pars::{Medal, Pars},
    state::EndReason,
};

/// The score and the goals as they stand; recomputed every step of a run.
#[derive(Resource, Debug, Clone, PartialEq, Default, Serialize)]
pub struct ScoreCard {
    /// One line a rule, in the order of the exercise.
    pub lines: Vec<ScoreLine>,
    /// Points together.
    pub total: f64,
    /// The best total.
    pub out_of: f64,
    /// Subtotals, where lines name their part.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub parts: Vec<PartScore>,
    /// What total earns bronze, silver and gold, where the exercise says so.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub pars: Option<Pars>,
    /// The best that the total earns of them; none where harm reached a limit of the exercise.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub medal: Option<Medal>,
    /// The harm for which no medal is earned.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub harm: Option<EndReason>,
    /// One entry a goal, in the order of the exercise.
    pub goals: Vec<GoalState>,
}

/// The lines of one part together.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct PartScore {
    /// The part.
    pub part: Part,
    /// Points together.
    pub points: f64,
    /// Points at best.
    pub out_of: f64,
}

/// One line of the score.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ScoreLine {
    /// The metric.
    pub metric: MetricId,
    /// The part of the score that it belongs to.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub part: Option<Part>,
    /// Its title.
    pub title: &'static str,
    /// Its unit.
    pub unit: &'static str,
    /// Its value.
    pub value: f64,
    /// Points earned, 0 to `out_of`.
    pub points: f64,
    /// Points at best.
    pub out_of: f64,
    /// What has to be done before the line earns anything, while it is not.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub waits_for: Option<Condition>,
    /// How the points follow from the value.
    pub formula: String,
    /// Where the formula's two values come from.
    pub basis: String,
    /// What earns bronze, silver and gold, where the line says so.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub pars: Option<Pars>,
    /// The best that the value earns of them.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub medal: Option<Medal>,
}

/// A goal and how far it is reached.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct GoalState {
    /// What is to be done, in words.
    pub goal: String,
    /// The metric that tells.
    pub metric: MetricId,
    /// Its value.
    pub value: f64,
    /// The value to reach.
    pub at_least: f64,
    /// Whether it is reached.
    pub reached: bool,
}

impl ScoreCard {
    /// The score of an exercise at these metrics.
    pub fn new(exercise: &Exercise, metrics: &Metrics) -> Self {
        Self::of_values(exercise, |metric| metrics.value(metric))
    }

    /// The score of an exercise where each metric has the value that `value` tells.
    pub fn of_values(exercise: &Exercise, value: impl Fn(MetricId) -> f64 + Copy) -> Self {
        let lines: Vec<ScoreLine> = exercise.scoring.iter().map(|rule| rule.line(value)).collect();
        let total = lines.iter().map(|line| line.points).sum();
        let harm = exercise.limits.reached(value).filter(|reason| reason.is_harm());
        let earned = exercise.total_pars.as_ref().and_then(|pars| pars.medal(total));
        Self {
            total,
            parts: Part::ALL
                .into_iter()
                .filter_map(|part| PartScore::of(part, &lines))
                .collect(),
            medal: earned.filter(|_| harm.is_none()),
            harm,
            pars: exercise.total_pars.clone(),
            out_of: lines.iter().map(|line| line.out_of).sum(),
            goals: (exercise.goals.iter())
                .map(|goal| goal.state(exercise, value))
                .collect(),
            lines,
        }
    }

    /// Whether every goal is reached.
    pub fn goals_reached(&self) -> bool {
        !self.goals.is_empty() && self.goals.iter().all(|goal| goal.reached)
    }
}

impl PartScore {
    /// The lines of a part together; none where there are none.
    fn of(part: Part, lines: &[ScoreLine]) -> Option<Self> {
        let of_part = || lines.iter().filter(|line| line.part == Some(part));
        of_part().next()?;
        Some(Self {
            part,
            points: of_part().map(|line| line.points).sum(),
            out_of: of_part().map(|line| line.out_of).sum(),
        })
    }
}

impl ScoreRule {
    /// Points for these values of the metrics: 0 to `points`, linear between the pars.
    pub fn points_for(&self, value: impl Fn(MetricId) -> f64) -> f64 {
        if self.waits_for(&value).is_some() {
            return 0.0;
        }
        let share = (value(self.metric) - self.from) / (self.to - self.from);
        // Plus zero: a value at `from` earns 0 points, not the -0 that a negative range gives.
        self.points * share.clamp(0.0, 1.0) + 0.0
    }

    /// What the line needs and is not done.
    fn waits_for(&self, value: impl Fn(MetricId) -> f64) -> Option<Condition> {
        self.needs.filter(|needs| !needs.is_met(value))
    }

    /// The formula in words that a calculator understands.
    pub fn formula(&self) -> String {
        let Self {
            metric,
            points,
            from,
            to,
            needs,
            ..
        } = self;
        let condition = match needs {
            Some(Condition { metric, at_least }) => format!(" if {metric} >= {at_least}, else 0"),
            None => String::new(),
        };
        format!("{points} * clamp(({metric} - {from}) / ({to} - {from}), 0, 1){condition}")
    }

    fn line(&self, value: impl Fn(MetricId) -> f64 + Copy) -> ScoreLine {
        let info = self.metric.info();
        let waits_for = self.waits_for(value);
        ScoreLine {
            waits_for,
            metric: self.metric,
            part: self.part,
            title: info.title,
            unit: info.unit,
            value: value(self.metric),
            medal: (self.pars.as_ref())
                .filter(|_| waits_for.is_none())
                .and_then(|pars| pars.medal(value(self.metric))),
            points: self.points_for(value),
            out_of: self.points,
            formula: self.formula(),
            basis: self.basis.clone(),
            pars: self.pars.clone(),
        }
    }
}

impl Condition {
    fn is_met(self, value: impl Fn(MetricId) -> f64) -> bool {
        value(self.metric) >= self.at_least
    }
}

impl Goal {
    fn state(&self, exercise: &Exercise, value: impl Fn(MetricId) -> f64) -> GoalState {
        let (goal, metric, at_least) = match *self {
            Goal::RemoveMarked { share } => (
                format!("Remove {} % of the {}", tenths(share * 100.0), exercise.marked.words()),
                MetricId::MarkedRemovedShare,
                share,
            ),
            Goal::FinishSteps => {
                let steps = exercise.steps.len();
                let words = match steps {
                    2 => "Do both steps".into(),
                    _ => format!("Do all {steps} steps"),
                };
                (words, MetricId::StepsDone, steps as f64)
            }
            Goal::Extension(goal) => (goal.words().into(), MetricId::Extension(goal.metric()), 1.0),
        };
        GoalState {
            goal,
            metric,
            value: value(metric),
            at_least,
            reached: value(metric) >= at_least,
        }
    }
}

/// A number to the tenth, as briefings write it: 80, 94.5.
fn tenths(value: f64) -> f64 {
    (10.0 * value).round() / 10.0
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn rule(from: f64, to: f64) -> ScoreRule {
        ScoreRule {
            metric: MetricId::Elapsed,
            part: None,
            points: 20.0,
            from,
            to,
            basis: "test".into(),
            pars: None,
            needs: None,
        }
    }

    fn points(rule: &ScoreRule, value: f64) -> f64 {
        rule.points_for(|_| value)
    }

    proptest! {
        #[test]
        fn points_stay_between_nothing_and_all(from in -1e3..1e3, span in 1e-3..1e3, value in -1e9..1e9) {
            for to in [from + span, from - span] {
                let points = points(&rule(from, to), value);
                prop_assert!((0.0..=20.0).contains(&points));
            }
        }

        #[test]
        fn points_are_linear_between_the_pars(from in -1e3..1e3f64, span in 1e-1..1e3f64, share in 0.0..1.0f64) {
            for to in [from + span, from - span] {
                let points = points(&rule(from, to), from + share * (to - from));
                prop_assert!((points - 20.0 * share).abs() < 1e-9, "{points}");
            }
        }
    }

    #[test]
    fn pars_earn_nothing_and_all() {
        for rule in [rule(300.0, 60.0), rule(0.2, 0.8)] {
            assert_eq!(points(&rule, rule.from), 0.0);
            assert_eq!(points(&rule, rule.to), 20.0);
        }
    }

    #[test]
    fn a_medal_needs_what_its_line_needs() {
        let pars = Pars {
            bronze: 125.0,
            silver: 84.0,
            gold: 76.0,
            basis: "test".into(),
        };
        let rule = ScoreRule {
            pars: Some(pars),
            needs: Some(Condition {
                metric: MetricId::MarkedRemovedShare,
                at_least: 0.5,
            }),
            metric: MetricId::BloodLost,
            ..rule(125.0, 0.0)
        };
        let medal = |share: f64, blood_ml: f64| {
            let value = |metric| if metric == MetricId::BloodLost { blood_ml } else { share };
            rule.line(value).medal
        };
        assert_eq!(medal(0.4, 0.0), None);
        assert_eq!(medal(0.5, 126.0), None);
        assert_eq!(medal(0.5, 125.0), Some(Medal::Bronze));
        assert_eq!(medal(0.5, 80.0), Some(Medal::Silver));
        assert_eq!(medal(0.5, 76.0), Some(Medal::Gold));
    }

    #[test]
    fn a_line_that_needs_something_earns_nothing_before() {
        let needs = Some(Condition {
            metric: MetricId::MarkedRemovedShare,
            at_least: 0.5,
        });
        let rule = ScoreRule {
            needs,
            ..rule(10.0, 0.0)
        };
        let at = |share: f64| rule.points_for(|metric| if metric == MetricId::Elapsed { 0.0 } else { share });
        assert_eq!(at(0.49), 0.0);
        assert_eq!(at(0.5), 20.0);
        assert_eq!(
            rule.formula(),
            "20 * clamp((elapsed_s - 10) / (0 - 10), 0, 1) if marked_removed_share >= 0.5, else 0"
        );
    }
}
