//! How the product does on its own: what it says of its error against the true one, and what it takes to reach an aim.

use cpu_time::ThreadTime;
use glam::DVec3;
use resecta_solver::{Effort, Network, Tissue};

use crate::{
    conditions::Reference,
    measure::{distances, fastest_of},
    regimes::Regime,
};

/// Aims, shares of how far the nodes moved.
pub const AIMS: [f64; 3] = [0.1, 0.01, 0.001];

/// What a watch said from the start on, and what was true.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct Watched {
    /// Key of the regime.
    pub regime: &'static str,
    /// The effort of the tissue: squares of frequencies up to this many times the usual; none where nothing was slowed down.
    pub fastest: Option<f64>,
    /// How long it was watched, s.
    pub time_s: f64,
    /// The error that the watch told, mm RMS.
    pub told_mm: f64,
    /// The error against the reference, mm RMS.
    pub true_mm: f64,
}

/// A run to an aim.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct Aimed {
    /// Key of the regime.
    pub regime: &'static str,
    /// The aim, mm RMS.
    pub aim_mm: f64,
    /// The aim over how far the nodes moved.
    pub share: f64,
    /// How long it ran, s.
    pub time_s: f64,
    /// The largest error that it saw, mm RMS.
    pub told_mm: f64,
    /// The error against the reference at the end, mm RMS.
    pub true_mm: f64,
    /// Springs softened at the end.
    pub softened: usize,
    /// Substeps, those of solutions carried beside included.
    pub substeps: u32,
    /// CPU time, s.
    pub cpu_s: f64,
    /// CPU time of the full effort with the longest substeps that are stable, s.
    pub full_cpu_s: f64,
}

/// All of a regime. What the solver refuses is left out.
pub fn measure(regime: &Regime, network: &Network, reference: &Reference) -> (Vec<Watched>, Vec<Aimed>) {
    let tissue = Tissue::from_network(network).expect("the same network made the system");
    let mut watched = Vec::new();
    for (&time_s, exact) in regime.times_s.iter().zip(&reference.positions) {
        for effort in [Effort::ACCURATE, Effort::FULL] {
            let mut tissue = tissue.clone();
            tissue.set_effort(effort);
            tissue.begin_watch();
            let arrived = tissue.advance_steps(time_s, 1).is_ok();
            let told = tissue.watched_error_mm().filter(|_| arrived);
            watched.extend(told.map(|told_mm| Watched {
                regime: regime.key,
                fastest: effort.fastest.is_finite().then_some(effort.fastest),
                time_s,
                told_mm,
                true_mm: distances(&positions(&tissue), exact)[0],
            }));
        }
    }
    let last = regime.times_s.len() - 1;
    let (time_s, exact) = (regime.times_s[last], &reference.positions[last]);
    let moved_mm = reference.conditions.moved_mm[last][0];
    let full_cpu_s = fastest_of(|| {
        let mut tissue = tissue.clone();
        let clock = ThreadTime::now();
        // What is refused took no time worth the name, and shows as such.
        let _ = tissue.advance_steps(time_s, 1);
        clock.elapsed().as_secs_f64()
    });
    let aimed = AIMS.iter().filter_map(|&share| {
        let aim_mm = share * moved_mm;
        let mut end = None;
        let cpu_s = fastest_of(|| {
            let mut tissue = tissue.clone();
            tissue.set_error_aim_mm(aim_mm as f32).ok();
            let clock = ThreadTime::now();
            let report = tissue.advance_to_aim(time_s);
            let cpu_s = clock.elapsed().as_secs_f64();
            end = report.ok().map(|report| (report, tissue));
            cpu_s
        });
        let (report, tissue) = end?;
        Some(Aimed {
            regime: regime.key,
            aim_mm,
            share,
            time_s,
            told_mm: report.error_mm,
            true_mm: distances(&positions(&tissue), exact)[0],
            softened: tissue.softened_springs(),
            substeps: report.steps.substeps + report.steps.substeps_beside,
            cpu_s,
            full_cpu_s,
        })
    });
    (watched, aimed.collect())
}

fn positions(tissue: &Tissue) -> Vec<DVec3> {
    (0..tissue.node_count() as u32)
        .map(|node| tissue.precise_position(node))
        .collect()
}
