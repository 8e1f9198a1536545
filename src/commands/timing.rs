//! How long a run took: the only result that may differ between two equal runs.

use std::{
    num::NonZeroUsize,
    time::{Duration, Instant},
};

use bevy::prelude::*;
use cpu_time::ProcessTime;
use resecta::{
    chips::ChipSystems,
    fluid::FluidSystems,
    scenario::ScenarioSystems,
    tissue::{TissueDiagnostics, TissueSystems},
};
use serde::Serialize;

use super::minutes::{MinuteTime, Minutes};

/// Number of the slowest steps that are listed.
const SLOWEST: usize = 10;

/// Stop watch of a run. Add [`StageClockPlugin`] to the app whose steps it times.
pub struct Stopwatch {
    begun: Instant,
    last: Instant,
    /// CPU time of all threads when it began and at the end of the last step.
    cpu: [ProcessTime; 2],
    steps: Vec<Step>,
    minutes: Minutes,
    stages: [Spent; Stage::ALL.len()],
    substeps: u64,
    contacts: u64,
}

/// What one step took.
#[derive(Debug, Clone, Copy)]
struct Step {
    number: usize,
    all: Duration,
    tissue: TissueTimes,
    substeps: u32,
    contacts: usize,
}

/// What `timing.json` says, times in the unit of the field's name.
#[derive(Debug, Serialize)]
pub struct Timing {
    /// Threads asked for; none: as many as the machine has.
    pub threads: Option<usize>,
    /// Reading the files and building the gland.
    pub prepare_s: f64,
    /// All steps.
    pub simulate_s: f64,
    /// CPU time of all threads for all steps.
    pub simulate_cpu_s: f64,
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
    /// Where the steps' time went, stage by stage.
    pub stages: Vec<StageTime>,
    /// Where the tissue's went, wall time of all steps together.
    pub tissue_s: TissueTimes,
    /// Every simulated minute: whether a long operation becomes slower, or needs more memory.
    pub minutes: Vec<MinuteTime>,
    /// The slowest steps, the slowest first.
    pub slowest: Vec<SlowStep>,
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

/// Time of one stage in all steps.
#[derive(Debug, Serialize)]
pub struct StageTime {
    stage: Stage,
    wall_s: f64,
    /// Of all threads.
    cpu_s: f64,
}

/// Time by stage of the tissue's step, in the unit of the field's name.
#[derive(Debug, Clone, Copy, Default, Serialize)]
pub struct TissueTimes {
    prepare: f64,
    collide: f64,
    resect: f64,
    integrate: f64,
    write_back: f64,
    probe: f64,
    rebuild_mesh: f64,
}

/// A step that took long.
#[derive(Debug, Serialize)]
pub struct SlowStep {
    /// Its number, from 1.
    step: usize,
    /// All of it, wall time.
    ms: f64,
    /// The tissue's stages.
    tissue_ms: TissueTimes,
    /// Its substeps, repeated ones included: far more than in other steps if tissue was squeezed.
    substeps: u32,
    /// Its contacts, near ones that pushed nothing included.
    contacts: usize,
}

/// A stage of a step: what runs from the end of the one before to its own.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
enum Stage {
    /// Players and instrument.
    Instrument,
    Tissue,
    /// Blood and water.
    Fluid,
    Chips,
    /// Metrics, score, trace and records.
    Scenario,
    /// What Bevy does between two steps.
    Rest,
}

impl Stage {
    const ALL: [Stage; 6] = [
        Stage::Instrument,
        Stage::Tissue,
        Stage::Fluid,
        Stage::Chips,
        Stage::Scenario,
        Stage::Rest,
    ];
}

/// Time by both clocks.
#[derive(Debug, Clone, Copy, Default)]
struct Spent {
    wall: Duration,
    /// Of all threads.
    cpu: Duration,
}

/// Times the stages of every step.
pub struct StageClockPlugin;

/// The time of each stage so far, by [`Stage::ALL`].
#[derive(Resource)]
struct StageClock {
    at: (Instant, ProcessTime),
    spent: [Spent; Stage::ALL.len()],
}

impl Plugin for StageClockPlugin {
    fn build(&self, app: &mut App) {
        app.insert_resource(StageClock {
            at: (Instant::now(), ProcessTime::now()),
            spent: default(),
        })
        .add_systems(FixedFirst, end(Stage::Rest))
        .add_systems(
            FixedPostUpdate,
            (
                end(Stage::Instrument).before(TissueSystems::First),
                end(Stage::Tissue)
                    .after(TissueSystems::Last)
                    .before(FluidSystems::First),
                end(Stage::Fluid).after(FluidSystems::Last).before(ChipSystems::First),
                end(Stage::Chips)
                    .after(ChipSystems::Last)
                    .before(ScenarioSystems::First),
                end(Stage::Scenario).after(ScenarioSystems::Last),
            ),
        );
    }
}

/// A system that runs where a stage ends.
fn end(stage: Stage) -> impl Fn(ResMut<StageClock>) {
    move |mut clock: ResMut<StageClock>| {
        let (wall, cpu) = std::mem::replace(&mut clock.at, (Instant::now(), ProcessTime::now()));
        let (wall, cpu) = (clock.at.0 - wall, clock.at.1.duration_since(cpu));
        let spent = &mut clock.spent[stage as usize];
        spent.wall += wall;
        spent.cpu += cpu;
    }
}

impl TissueTimes {
    /// Of one step, ms.
    fn of(stages: &TissueDiagnostics) -> Self {
        Self {
            prepare: ms(stages.prepare),
            collide: ms(stages.collide),
            resect: ms(stages.resect),
            integrate: ms(stages.integrate),
            write_back: ms(stages.write_back),
            probe: ms(stages.probe),
            rebuild_mesh: ms(stages.rebuild_mesh),
        }
    }

    /// Adds a share of others.
    fn add(&mut self, share: f64, other: &Self) {
        self.prepare += share * other.prepare;
        self.collide += share * other.collide;
        self.resect += share * other.resect;
        self.integrate += share * other.integrate;
        self.write_back += share * other.write_back;
        self.probe += share * other.probe;
        self.rebuild_mesh += share * other.rebuild_mesh;
    }
}

fn ms(time: Duration) -> f64 {
    time.as_secs_f64() * 1e3
}

impl Stopwatch {
    /// Starts timing the steps of the app that has this world.
    pub fn start(world: &World) -> Self {
        let now = Instant::now();
        Self {
            begun: now,
            last: now,
            cpu: [ProcessTime::now(); 2],
            steps: Vec::new(),
            minutes: Minutes::start(),
            stages: Self::stages(world),
            substeps: 0,
            contacts: 0,
        }
    }

    fn stages(world: &World) -> [Spent; Stage::ALL.len()] {
        (world.get_resource::<StageClock>()).map_or_else(default, |clock| clock.spent)
    }

    /// Ends a step.
    pub fn step(&mut self, world: &World) {
        let now = Instant::now();
        self.cpu[1] = ProcessTime::now();
        let stages = world.resource::<TissueDiagnostics>();
        self.steps.push(Step {
            number: self.steps.len() + 1,
            all: now - self.last,
            tissue: TissueTimes::of(stages),
            substeps: stages.substeps,
            contacts: stages.contacts,
        });
        self.minutes.step(now - self.last);
        self.last = now;
        self.substeps += u64::from(stages.substeps);
        self.contacts += stages.contacts as u64;
    }

    /// The times, of steps of `step_s` simulated seconds.
    pub fn timing(mut self, world: &World, threads: Option<NonZeroUsize>, prepare: Duration, step_s: f64) -> Timing {
        let simulate_s = (self.last - self.begun).as_secs_f64();
        let count = self.steps.len();
        let mut tissue_s = TissueTimes::default();
        for step in &self.steps {
            tissue_s.add(1e-3, &step.tissue);
        }
        self.steps.sort_by_key(|step| step.all);
        let at = |share: f64| {
            let place = (share * count as f64).ceil() as usize;
            let step = self.steps.get(place.clamp(1, count.max(1)) - 1);
            step.map_or(0.0, |step| ms(step.all))
        };
        let stages = Stage::ALL.into_iter().zip(Self::stages(world)).zip(self.stages);
        Timing {
            threads: threads.map(NonZeroUsize::get),
            prepare_s: prepare.as_secs_f64(),
            simulate_s,
            simulate_cpu_s: self.cpu[1].duration_since(self.cpu[0]).as_secs_f64(),
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
            stages: stages
                .map(|((stage, now), before)| StageTime {
                    stage,
                    wall_s: (now.wall - before.wall).as_secs_f64(),
                    cpu_s: (now.cpu - before.cpu).as_secs_f64(),
                })
                .collect(),
            tissue_s,
            minutes: self.minutes.finish(),
            slowest: (self.steps.iter().rev().take(SLOWEST))
                .map(|step| SlowStep {
                    step: step.number,
                    ms: ms(step.all),
                    tissue_ms: step.tissue,
                    substeps: step.substeps,
                    contacts: step.contacts,
                })
                .collect(),
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
