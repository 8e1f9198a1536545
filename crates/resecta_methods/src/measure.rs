//! Runs a method over a regime and measures its error and what it costs.

use cpu_time::ThreadTime;
use glam::DVec3;
use resecta_solver::{Network, Tissue};

use crate::{
    conditions::Reference,
    method::{Choice, StepError},
    regimes::Regime,
    system::{State, System, Work},
};

/// A run that visits more springs than this, for every 0.1 s of motion it is to make, is given up; it is not begun where each
/// step of its method visits the same number and that is known.
pub const MOST_VISITS: f64 = 4e8;
/// Runs shorter than this, s, are timed again.
const SHORT_S: f64 = 0.08;
/// How often a short run is timed.
const REPEATS: usize = 3;

/// How a run ended.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Outcome {
    /// It arrived.
    Arrived,
    /// A number was no longer finite, or a node was further out than 1e6 mm, after so many seconds of motion; of the product:
    /// it put nodes aside or refused the step.
    Diverged(f64),
    /// The equations of an implicit step were not solved, after so many seconds of motion.
    NotConverged(f64),
    /// It visited too many springs, and got so far, s.
    GivenUp(f64),
}

/// One method with one step at one time of one regime.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct Row {
    /// Key of the regime.
    pub regime: &'static str,
    /// Name of the method.
    pub method: &'static str,
    /// Whether it is the product's solver and not one of the methods on equal footing.
    pub product: bool,
    /// Step length, s.
    pub step_s: f64,
    /// Step length over the stability bound of the start.
    pub step_in_bounds: f64,
    /// When the error was taken, s.
    pub time_s: f64,
    /// Error, mm RMS over the nodes; only of what arrived.
    pub rms_mm: Option<f64>,
    /// Largest distance of a node from where it should be, mm.
    pub largest_mm: Option<f64>,
    /// CPU time from the start to here, s.
    pub cpu_s: f64,
    /// What it computed from the start to here.
    pub work: Work,
    /// How it ended.
    pub outcome: Outcome,
}

impl Row {
    /// Whether the row has an error of at most `error_mm`, RMS.
    pub fn reaches(&self, error_mm: f64) -> bool {
        self.rms_mm.is_some_and(|rms| rms <= error_mm)
    }
}

/// What a run has to say at one of the times.
struct Station {
    cpu_s: f64,
    work: Work,
    outcome: Outcome,
    positions: Vec<DVec3>,
}

/// Runs a method with about `step_s`: the first time is a whole number of steps.
pub fn run(regime: &Regime, scene: &(System, State), reference: &Reference, choice: Choice, step_s: f64) -> Vec<Row> {
    let first_s = regime.times_s[0];
    let step_s = first_s / (first_s / step_s).ceil();
    let name = choice.build(&scene.0, step_s).name();
    let attempt = || attempt(regime, scene, choice, step_s);
    rows(regime, reference, name, false, step_s, fastest(attempt))
}

/// Runs the product's solver with about `step_s`. It divides steps beyond its own bound.
pub fn run_product(regime: &Regime, network: &Network, reference: &Reference, step_s: f64) -> Vec<Row> {
    let first_s = regime.times_s[0];
    let step_s = first_s / (first_s / step_s).ceil();
    let attempt = || attempt_product(regime, network, step_s);
    rows(regime, reference, "product (f32)", true, step_s, fastest(attempt))
}

/// A run; a short one is made again and the least time at each station counts.
fn fastest(mut attempt: impl FnMut() -> Vec<Station>) -> Vec<Station> {
    let mut best = attempt();
    if best.last().is_some_and(|station| station.cpu_s < SHORT_S) {
        for _ in 1..REPEATS {
            for (station, again) in best.iter_mut().zip(attempt()) {
                station.cpu_s = station.cpu_s.min(again.cpu_s);
            }
        }
    }
    best
}

/// The time of a run, s; of a short one that of the fastest of a few.
pub(crate) fn fastest_of(mut run: impl FnMut() -> f64) -> f64 {
    let mut least = run();
    if least < SHORT_S {
        for _ in 1..REPEATS {
            least = least.min(run());
        }
    }
    least
}

fn attempt(regime: &Regime, scene: &(System, State), choice: Choice, step_s: f64) -> Vec<Station> {
    let (system, start) = scene;
    let (mut state, mut work, mut steps) = (start.clone(), Work::default(), 0_u64);
    let mut stations: Vec<Station> = Vec::new();
    let mut failed = None;
    let most_visits = |time_s: f64| (MOST_VISITS * time_s / 0.1) as u64;
    if let Some(passes) = choice.passes_a_step() {
        let visits = passes * system.springs.len() as u64 * (regime.times_s[0] / step_s).round() as u64;
        failed = (visits > most_visits(regime.times_s[0])).then_some(Outcome::GivenUp(0.0));
    }
    let clock = ThreadTime::now();
    let mut method = choice.build(system, step_s);
    for &time_s in regime.times_s {
        let until = (time_s / step_s).round() as u64;
        let most = most_visits(time_s);
        while failed.is_none() && steps < until {
            let here_s = steps as f64 * step_s;
            failed = match method.step(system, &mut state, &mut work) {
                Ok(()) if work.spring_visits > most => Some(Outcome::GivenUp(here_s)),
                Ok(()) => None,
                Err(StepError::Diverged) => Some(Outcome::Diverged(here_s)),
                Err(StepError::NotConverged { .. }) => Some(Outcome::NotConverged(here_s)),
            };
            steps += 1;
        }
        stations.push(Station {
            cpu_s: clock.elapsed().as_secs_f64(),
            work,
            outcome: failed.unwrap_or(Outcome::Arrived),
            positions: state.positions.clone(),
        });
    }
    stations
}

fn attempt_product(regime: &Regime, network: &Network, step_s: f64) -> Vec<Station> {
    let mut tissue = Tissue::from_network(network).expect("the same network made the system");
    let (mut work, mut steps, mut cpu_s) = (Work::default(), 0_u64, 0.0);
    let mut stations = Vec::new();
    for &time_s in regime.times_s {
        let until = (time_s / step_s).round() as u64;
        let clock = ThreadTime::now();
        let report = tissue.advance_steps(step_s, until - steps);
        cpu_s += clock.elapsed().as_secs_f64();
        let outcome = match &report {
            Ok(report) if report.put_aside.is_empty() => Outcome::Arrived,
            _ => Outcome::Diverged(steps as f64 * step_s),
        };
        let substeps = report.map_or(0, |report| {
            u64::from(report.substeps) + u64::from(report.substeps_repeated)
        });
        work.force_passes += substeps;
        work.spring_visits += substeps * network.springs.len() as u64;
        steps = until;
        stations.push(Station {
            cpu_s,
            work,
            outcome,
            positions: (0..network.positions.len() as u32)
                .map(|node| tissue.precise_position(node))
                .collect(),
        });
    }
    stations
}

fn rows(
    regime: &Regime,
    reference: &Reference,
    method: &'static str,
    product: bool,
    step_s: f64,
    stations: Vec<Station>,
) -> Vec<Row> {
    let ends = regime.times_s.iter().zip(&reference.positions).zip(stations);
    ends.map(|((time_s, exact), station)| {
        let [rms, largest] = distances(&station.positions, exact);
        let arrived = station.outcome == Outcome::Arrived;
        Row {
            regime: regime.key,
            method,
            product,
            step_s,
            step_in_bounds: step_s / reference.conditions.bound_s,
            time_s: *time_s,
            rms_mm: arrived.then_some(rms),
            largest_mm: arrived.then_some(largest),
            cpu_s: station.cpu_s,
            work: station.work,
            outcome: station.outcome,
        }
    })
    .collect()
}

/// Distances between the nodes of two states, mm: RMS and largest.
pub fn distances(a: &[DVec3], b: &[DVec3]) -> [f64; 2] {
    let squares = || a.iter().zip(b).map(|(a, b)| a.distance_squared(*b));
    let mean = squares().sum::<f64>() / a.len().max(1) as f64;
    [mean.sqrt(), squares().fold(0.0, f64::max).sqrt()]
}
