//! What is known of a regime before any method is compared on it: its numbers, its reference and its conditioning.

use glam::DVec3;

use crate::{
    measure::distances,
    method::{Choice, StepError},
    regimes::Regime,
    spectrum::{slowest_rad_per_s, stability_bound_s},
    system::{State, System, Work},
};

/// How far nodes are moved at the start to see what comes of it, mm.
pub const NUDGE_MM: f64 = 1e-6;

/// The numbers of a regime.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct Conditions {
    /// Nodes, the fixed ones among them.
    pub nodes: usize,
    /// Springs.
    pub springs: usize,
    /// Least and largest stiffness of a spring, µN/mm.
    pub stiffness: [f64; 2],
    /// Longest step that is stable for leapfrog without damping, s; see [`stability_bound_s`].
    pub bound_s: f64,
    /// Slowest mode at the start, rad/s.
    pub slowest_rad_per_s: f64,
    /// Damping rate over the critical one of that mode; none of a mechanism.
    pub damping_ratio: Option<f64>,
    /// Damping rate, 1/s.
    pub damping_rate: f64,
    /// Movement of the nodes at each time, mm RMS and largest.
    pub moved_mm: Vec<[f64; 2]>,
    /// Difference between the reference and that with twice its step at each time, mm RMS.
    pub self_difference_mm: Vec<f64>,
    /// Step of the reference, s.
    pub reference_step_s: f64,
    /// How far apart runs end that started [`NUDGE_MM`] apart, at each time, mm RMS.
    pub nudged_mm: Vec<f64>,
}

/// A regime's numbers and where its nodes are at each time.
#[derive(Debug, Clone, PartialEq)]
pub struct Reference {
    /// The numbers.
    pub conditions: Conditions,
    /// Positions at each time, mm.
    pub positions: Vec<Vec<DVec3>>,
}

/// Below this, rad/s, the slowest mode is none that springs hold.
const MECHANISM: f64 = 5.0;

/// Makes the reference of a regime.
///
/// # Errors
///
/// When RK4 diverges at the step that the regime names.
pub fn reference(regime: &Regime, scene: &(System, State)) -> Result<Reference, StepError> {
    let (system, start) = scene;
    let bound_s = stability_bound_s(system, &start.positions);
    let coarse_s = bound_s / regime.reference_division;
    let coarse = follow(regime, system, start, Choice::Rk4, coarse_s)?;
    let fine = follow(regime, system, start, Choice::Rk4, 0.5 * coarse_s)?;
    let mut nudged = start.clone();
    nudge(system, &mut nudged.positions);
    let plain = follow(regime, system, start, Choice::Leapfrog, 0.5 * bound_s)?;
    let nudged = follow(regime, system, &nudged, Choice::Leapfrog, 0.5 * bound_s)?;
    let slowest = slowest_rad_per_s(system, &start.positions);
    let rate = regime.annulus.damping_rate;
    let stiffness = || system.springs.iter().map(|spring| spring.stiffness);
    let rms_between = |a: &[Vec<DVec3>], b: &[Vec<DVec3>]| a.iter().zip(b).map(|(a, b)| distances(a, b)[0]).collect();
    Ok(Reference {
        conditions: Conditions {
            nodes: system.node_count(),
            springs: system.springs.len(),
            stiffness: [
                stiffness().fold(f64::INFINITY, f64::min),
                stiffness().fold(0.0, f64::max),
            ],
            bound_s,
            slowest_rad_per_s: slowest,
            damping_ratio: (slowest > MECHANISM).then(|| rate / (2.0 * slowest)),
            damping_rate: rate,
            moved_mm: fine
                .iter()
                .map(|positions| distances(positions, &start.positions))
                .collect(),
            self_difference_mm: rms_between(&coarse, &fine),
            reference_step_s: 0.5 * coarse_s,
            nudged_mm: rms_between(&plain, &nudged),
        },
        positions: fine,
    })
}

/// Positions at each time.
fn follow(
    regime: &Regime,
    system: &System,
    start: &State,
    choice: Choice,
    step_s: f64,
) -> Result<Vec<Vec<DVec3>>, StepError> {
    let first_s = regime.times_s[0];
    let step_s = first_s / (first_s / step_s).ceil();
    let mut method = choice.build(system, step_s);
    let (mut state, mut work, mut steps) = (start.clone(), Work::default(), 0_u64);
    let mut places = Vec::new();
    for &time_s in regime.times_s {
        let until = (time_s / step_s).round() as u64;
        while steps < until {
            method.step(system, &mut state, &mut work)?;
            steps += 1;
        }
        places.push(state.positions.clone());
    }
    Ok(places)
}

/// Moves every free node by [`NUDGE_MM`], in directions from a fixed sequence.
fn nudge(system: &System, positions: &mut [DVec3]) {
    let mut numbers = 1_u64;
    let mut next = || {
        // Knuth's linear congruential generator.
        numbers = numbers
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        (numbers >> 11) as f64 / (1_u64 << 53) as f64 - 0.5
    };
    let mut moves: Vec<DVec3> = positions
        .iter()
        .map(|_| DVec3::new(next(), next(), next()).normalize_or_zero() * NUDGE_MM)
        .collect();
    system.hold(&mut moves);
    for (place, step) in positions.iter_mut().zip(moves) {
        *place += step;
    }
}
