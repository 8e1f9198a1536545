//! What a run was like over time, a sample every half second: for plots of it. [`Trace`](crate::Trace) has every step.

use bevy::prelude::*;

use crate::metrics::{Metrics, StepObservation};

/// Steps from one sample to the next: half a second at 60 Hz.
pub const STEPS_A_SAMPLE: u64 = 30;

/// Samples of a run. Insert it to have them kept; it is emptied when an exercise is spawned.
#[derive(Resource, Debug, Clone, PartialEq, Default)]
pub struct RunLog {
    /// In order of time, the first after one step, then every [`STEPS_A_SAMPLE`].
    pub samples: Vec<LogSample>,
}

/// How a run stood at one time.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct LogSample {
    /// Simulated time, s.
    pub time_s: f64,
    /// Length of the path of the sheath's tip so far, mm.
    pub path_mm: f64,
    /// Steps of the exercise that are done.
    pub steps_done: u32,
    /// Tissue removed so far, ml at rest.
    pub removed_ml: f64,
    /// Blood lost so far, ml.
    pub blood_ml: f64,
    /// Pressure in the bladder, cmH2O; 0 in a dry scene.
    pub pressure_cmh2o: f64,
    /// Least share of the light that came back to the lens since the sample before, 0 to 1; 1 in a dry scene.
    pub visibility: f64,
    /// Whether the loop met the capsule with current on since the sample before.
    pub capsule: bool,
}

impl RunLog {
    /// Takes one step into account, after the metrics.
    pub fn observe(&mut self, step: &StepObservation, metrics: &Metrics) {
        let sample = LogSample {
            time_s: metrics.elapsed_s(),
            path_mm: metrics.motion.path_mm,
            steps_done: metrics.steps_done,
            removed_ml: metrics.removal.volume_mm3 / 1000.0,
            blood_ml: metrics.water.blood_ml,
            pressure_cmh2o: step.water.pressure_cmh2o,
            visibility: step.water.visibility,
            capsule: step.current_on_capsule,
        };
        let begins = metrics.steps % STEPS_A_SAMPLE == 1;
        match self.samples.last_mut() {
            Some(last) if !begins => {
                *last = LogSample {
                    visibility: last.visibility.min(sample.visibility),
                    capsule: last.capsule || sample.capsule,
                    ..sample
                };
            }
            _ => self.samples.push(sample),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn samples_keep_the_worst_view_and_the_last_of_everything_else() {
        let mut log = RunLog::default();
        let mut metrics = Metrics::default();
        for number in 1..=65u64 {
            let mut step = StepObservation::idle(1.0 / 60.0, default(), Vec3::ZERO);
            step.water.visibility = if number == 40 { 0.2 } else { 0.9 };
            step.current_on_capsule = number == 2;
            step.removed_mm3 = 10.0;
            metrics.count_step(&step);
            metrics.removal.observe(&step);
            log.observe(&step, &metrics);
        }
        let seen: Vec<_> = log
            .samples
            .iter()
            .map(|sample| (sample.visibility, sample.capsule))
            .collect();
        assert_eq!(seen, [(0.9, true), (0.2, false), (0.9, false)]);
        assert!((log.samples.last().unwrap().removed_ml - 0.65).abs() < 1e-12);
        assert!(log.samples.is_sorted_by(|a, b| a.time_s < b.time_s));
    }
}
