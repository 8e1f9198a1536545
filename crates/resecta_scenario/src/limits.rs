//! What ends a run before its goal: time, and harm that nobody would operate on after.
//!
//! A limit is a value of a metric. A run ends in the step in which the metric reaches it; where several do, the first in the order
//! of [`Limits`] is named. Values are those of the table of metrics, so that the report tells how far each was.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::{errors::RuleError, exercise::Models, metrics::MetricId, rules::Faults, state::EndReason};

/// What ends a run early. Those left out never do.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Limits {
    /// Simulated time, s, above 0.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub time_s: f64,
    /// Perforation: share of the capsule's surface that is cut out, above 0 and at most 1.
    #[serde(default)]
    #[schemars(extend("exclusiveMinimum" = 0, "maximum" = 1))]
    pub capsule_cut_share: Option<f64>,
    /// Times that the loop met tissue below the verumontanum with current on, 1 or more.
    #[serde(default)]
    #[schemars(range(min = 1))]
    pub sphincter_injuries: Option<u32>,
    /// Blood lost, ml, above 0. Needs `models.water.bleeding`.
    #[serde(default)]
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub blood_lost_ml: Option<f64>,
    /// Irrigant that got into opened veins, ml, above 0. Needs `models.water.absorption`.
    #[serde(default)]
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub absorbed_ml: Option<f64>,
}

impl Limits {
    /// No limit but time, s.
    pub fn of_time(time_s: f64) -> Self {
        Self {
            time_s,
            capsule_cut_share: None,
            sphincter_injuries: None,
            blood_lost_ml: None,
            absorbed_ml: None,
        }
    }

    /// The limits that are set: the metric, the value that ends the run, and what the end is called.
    pub fn set(&self) -> impl Iterator<Item = (MetricId, f64, EndReason)> {
        let limits = [
            (MetricId::CapsuleCutShare, self.capsule_cut_share, EndReason::Perforated),
            (
                MetricId::SphincterInjuries,
                self.sphincter_injuries.map(f64::from),
                EndReason::SphincterInjured,
            ),
            (MetricId::BloodLost, self.blood_lost_ml, EndReason::BloodLost),
            (MetricId::Absorbed, self.absorbed_ml, EndReason::Absorbed),
            (MetricId::Elapsed, Some(self.time_s), EndReason::TimeUp),
        ];
        let set = |(metric, limit, reason): (MetricId, Option<f64>, EndReason)| Some((metric, limit?, reason));
        limits.into_iter().filter_map(set)
    }

    /// Why the run is over, if a limit is reached where each metric has the value that `value` tells.
    pub(crate) fn reached(&self, value: impl Fn(MetricId) -> f64) -> Option<EndReason> {
        let is_reached = |(metric, limit, _): &(MetricId, f64, EndReason)| value(*metric) >= *limit;
        self.set().find(is_reached).map(|(_, _, reason)| reason)
    }

    /// Checks the limits against their ranges and against what the exercise models.
    pub(crate) fn check(&self, models: &Models, faults: &mut Faults) {
        let above_zero = |value: f64| value > 0.0 && value.is_finite();
        faults.require(above_zero(self.time_s), || {
            RuleError::new("limits.time_s", self.time_s, "a finite number of s above 0")
        });
        if let Some(share) = self.capsule_cut_share {
            faults.require(share > 0.0 && share <= 1.0, || {
                RuleError::new("limits.capsule_cut_share", share, "a share above 0 and at most 1")
            });
        }
        faults.require(self.sphincter_injuries != Some(0), || {
            RuleError::new("limits.sphincter_injuries", 0, "1 or more")
        });
        let water = models.water.as_ref();
        for (field, value, is_modelled, model) in [
            (
                "limits.blood_lost_ml",
                self.blood_lost_ml,
                water.is_some_and(|water| water.bleeding.is_some()),
                "bleeding",
            ),
            (
                "limits.absorbed_ml",
                self.absorbed_ml,
                water.is_some_and(|water| water.absorption.is_some()),
                "absorption",
            ),
        ] {
            let Some(value) = value else { continue };
            faults.require(above_zero(value), || {
                RuleError::new(field, value, "a finite number of ml above 0")
            });
            faults.require(is_modelled, || {
                let expected =
                    format!("nothing, or `models: (water: ({model}: (..)))`: without it the limit is never reached");
                RuleError::new(field, value, expected)
            });
        }
    }
}
