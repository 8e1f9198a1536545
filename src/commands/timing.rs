//! How long a run took: the only result that may differ between two equal runs.

use std::{
    num::NonZeroUsize,
    time::{Duration, Instant},
};

use resecta::tissue::TissueDiagnostics;
use serde::Serialize;

/// Stop watch of a run.
pub struct Stopwatch {
    begun: Instant,
    last: Instant,
    steps: Vec<Duration>,
    stages: TissueDiagnostics,
    substeps: u64,
    contacts: u64,
}

/// What `timing.json` says, wall times in the unit of the field's name.
#[derive(Debug, Serialize)]
pub struct Timing {
    /// Threads asked for; none: as many as the machine has.
    pub threads: Option<usize>,
    /// Reading the files and building the gland.
    pub prepare_s: f64,
    /// All steps.
    pub simulate_s: f64,
    /// Taking pictures, with a second simulation to take them of.
    pub pictures_s: Option<f64>,
    /// Number of steps.
    pub steps: usize,
    /// Simulated time over wall time of the steps; above 1 is faster than real time.
    pub times_real_time: f64,
    /// One step.
    pub step_ms: StepTimes,
    /// Substeps of a step, mean.
    pub substeps: f64,
    /// Contacts of a step, mean.
    pub contacts: f64,
    /// Where the steps' time went, together.
    pub stages_s: Stages,
}

/// Wall time of one step, ms.
#[derive(Debug, Serialize)]
pub struct StepTimes {
    /// Mean.
    pub mean: f64,
    /// Half of the steps took at most this.
    pub median: f64,
    /// 99 of 100 steps took at most this.
    pub percentile_99: f64,
    /// The slowest step.
    pub largest: f64,
}

/// Wall time by stage of the tissue's step, s.
#[derive(Debug, Serialize)]
pub struct Stages {
    prepare: f64,
    collide: f64,
    resect: f64,
    integrate: f64,
    write_back: f64,
    rebuild_mesh: f64,
}

impl Stopwatch {
    pub fn start() -> Self {
        let now = Instant::now();
        Self {
            begun: now,
            last: now,
            steps: Vec::new(),
            stages: TissueDiagnostics::default(),
            substeps: 0,
            contacts: 0,
        }
    }

    /// Ends a step.
    pub fn step(&mut self, stages: &TissueDiagnostics) {
        let now = Instant::now();
        self.steps.push(now - self.last);
        self.last = now;
        let sum = &mut self.stages;
        sum.prepare += stages.prepare;
        sum.collide += stages.collide;
        sum.resect += stages.resect;
        sum.integrate += stages.integrate;
        sum.write_back += stages.write_back;
        sum.rebuild_mesh += stages.rebuild_mesh;
        self.substeps += u64::from(stages.substeps);
        self.contacts += stages.contacts as u64;
    }

    /// The times, of steps of `step_s` simulated seconds.
    pub fn timing(mut self, threads: Option<NonZeroUsize>, prepare: Duration, step_s: f64) -> Timing {
        let simulate_s = (self.last - self.begun).as_secs_f64();
        self.steps.sort_unstable();
        let count = self.steps.len();
        let at = |share: f64| {
            let place = (share * count as f64).ceil() as usize;
            let step = self.steps.get(place.clamp(1, count.max(1)) - 1);
            step.map_or(0.0, |step| step.as_secs_f64() * 1e3)
        };
        let stages = &self.stages;
        Timing {
            threads: threads.map(NonZeroUsize::get),
            prepare_s: prepare.as_secs_f64(),
            simulate_s,
            pictures_s: None,
            steps: count,
            times_real_time: count as f64 * step_s / simulate_s.max(f64::MIN_POSITIVE),
            step_ms: StepTimes {
                mean: simulate_s * 1e3 / count.max(1) as f64,
                median: at(0.5),
                percentile_99: at(0.99),
                largest: at(1.0),
            },
            substeps: self.substeps as f64 / count.max(1) as f64,
            contacts: self.contacts as f64 / count.max(1) as f64,
            stages_s: Stages {
                prepare: stages.prepare.as_secs_f64(),
                collide: stages.collide.as_secs_f64(),
                resect: stages.resect.as_secs_f64(),
                integrate: stages.integrate.as_secs_f64(),
                write_back: stages.write_back.as_secs_f64(),
                rebuild_mesh: stages.rebuild_mesh.as_secs_f64(),
            },
        }
    }
}

impl Timing {
    /// The text of `timing.json`.
    pub fn to_json(&self) -> String {
        // Plain data with string keys: JSON writes all of it.
        let mut text = serde_json::to_string_pretty(self).expect("times are plain data");
        text.push('\n');
        text
    }
}
