//! Exercises made in Rust.

use resecta_anatomy::Zone;

use crate::{
    exercise::{Exercise, InstrumentSetup, Marked, Models, ScoreRule, default_alpha_deg},
    limits::Limits,
    metrics::MetricId,
};

impl Exercise {
    /// An exercise of both lobes of a case, ended by time (s), with all else as in a file that leaves it out. It needs a goal and a
    /// line of score before it keeps the rules.
    pub fn new(title: &str, briefing: &str, case: &str, time_s: f64) -> Self {
        Self {
            title: title.into(),
            briefing: briefing.into(),
            case: case.into(),
            alpha_deg: default_alpha_deg(),
            material: None,
            begun: None,
            models: Models::default(),
            instrument: InstrumentSetup::default(),
            marked: Marked {
                zones: vec![Zone::LateralLobe, Zone::MiddleLobe],
                clock: None,
                height: None,
                depth_mm: None,
                dyed: true,
            },
            steps: Vec::new(),
            goals: Vec::new(),
            limits: Limits::of_time(time_s),
            scoring: Vec::new(),
            total_pars: None,
            shown_by: None,
        }
    }
}

impl ScoreRule {
    /// A line of so many points for a metric that goes from the one value to the other, and where the two come from.
    pub fn new(metric: MetricId, points: f64, from: f64, to: f64, basis: &str) -> Self {
        Self {
            metric,
            part: None,
            points,
            from,
            to,
            basis: basis.into(),
            pars: None,
            needs: None,
        }
    }
}
