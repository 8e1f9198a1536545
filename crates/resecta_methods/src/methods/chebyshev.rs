//! Runge-Kutta-Chebyshev of order 2 (RKC2) on positions and velocities: explicit, with as many stages as the step needs.
//!
//! Source: Sommeijer, Shampine and Verwer 1998, equations (2.1) to (2.7), damping 2/13. With s stages it is stable on
//! `[-0.65 (s² - 1), 0]` of the real axis and a narrow strip around it: made for overdamped motion, where eigenvalues are
//! real. Underdamped fast modes lie outside the strip.

use glam::DVec3;

use super::sound;
use crate::{
    method::{Method, StepError},
    spectrum::radius_per_s,
    system::{State, System, Work},
};

/// Coefficients of a stage.
#[derive(Debug, Clone, Copy)]
struct Row {
    start: f64,
    last: f64,
    before: f64,
    slope: f64,
    first_slope: f64,
}

/// RKC2.
#[derive(Debug, Clone)]
pub struct Chebyshev {
    rates: Vec<f64>,
    /// Share of the first slope in the first stage, s.
    first_s: f64,
    /// The stages after the first; slopes in s.
    rows: Vec<Row>,
    forces: Vec<DVec3>,
    first_slope: State,
    last: State,
    before: State,
}

impl Chebyshev {
    /// For steps of `step_s`, s, above 0. The stages follow from a bound of the spectral radius that holds for any shape.
    pub fn new(system: &System, step_s: f64) -> Chebyshev {
        let extent = step_s * radius_per_s(system);
        let stages = 1 + (1.0 + 1.54 * extent).sqrt().floor().max(1.0) as usize;
        let (first, rows) = coefficients(stages);
        let scaled = |row: Row| Row {
            slope: row.slope * step_s,
            first_slope: row.first_slope * step_s,
            ..row
        };
        Chebyshev {
            rates: (0..system.node_count()).map(|node| system.damping_rate(node)).collect(),
            first_s: first * step_s,
            rows: rows.into_iter().map(scaled).collect(),
            forces: vec![DVec3::ZERO; system.node_count()],
            first_slope: State::default(),
            last: State::default(),
            before: State::default(),
        }
    }

    /// Acceleration of a node, mm/s².
    fn acceleration(&self, system: &System, node: usize, velocity: DVec3) -> DVec3 {
        self.forces[node] * system.inverse_masses[node] - velocity * self.rates[node]
    }
}

/// First share of the slope, and the rows after it, for two or more stages.
fn coefficients(stages: usize) -> (f64, Vec<Row>) {
    let w0 = 1.0 + 2.0 / 13.0 / (stages * stages) as f64;
    // Chebyshev polynomials at w0 with two derivatives.
    let mut values = vec![[1.0, 0.0, 0.0], [w0, 1.0, 0.0]];
    for j in 2..=stages {
        let ([t, d, dd], [t0, d0, dd0]) = (values[j - 1], values[j - 2]);
        values.push([
            2.0 * w0 * t - t0,
            2.0 * t + 2.0 * w0 * d - d0,
            4.0 * d + 2.0 * w0 * dd - dd0,
        ]);
    }
    let w1 = values[stages][1] / values[stages][2];
    // b of stages 0 and 1 is that of stage 2.
    let b = |j: usize| values[j.max(2)][2] / values[j.max(2)][1].powi(2);
    let rows = (2..=stages).map(|j| {
        let (last, before) = (2.0 * b(j) * w0 / b(j - 1), -b(j) / b(j - 2));
        let slope = 2.0 * b(j) * w1 / b(j - 1);
        Row {
            start: 1.0 - last - before,
            last,
            before,
            slope,
            first_slope: -(1.0 - b(j - 1) * values[j - 1][0]) * slope,
        }
    });
    (b(1) * w1, rows.collect())
}

impl Method for Chebyshev {
    fn name(&self) -> &'static str {
        "RKC2"
    }

    fn order(&self) -> u32 {
        2
    }

    fn step(&mut self, system: &System, state: &mut State, work: &mut Work) -> Result<(), StepError> {
        system.forces(&state.positions, &mut self.forces, work);
        self.before.clone_from(state);
        self.last.clone_from(state);
        self.first_slope.clone_from(state);
        for node in 0..system.node_count() {
            let velocity = state.velocities[node];
            let acceleration = self.acceleration(system, node, velocity);
            self.first_slope.positions[node] = velocity;
            self.first_slope.velocities[node] = acceleration;
            self.last.positions[node] += velocity * self.first_s;
            self.last.velocities[node] += acceleration * self.first_s;
        }
        for row in &self.rows {
            system.forces(&self.last.positions, &mut self.forces, work);
            for node in 0..system.node_count() {
                let velocity = self.last.velocities[node];
                let acceleration = self.acceleration(system, node, velocity);
                let place = state.positions[node] * row.start
                    + self.last.positions[node] * row.last
                    + self.before.positions[node] * row.before
                    + velocity * row.slope
                    + self.first_slope.positions[node] * row.first_slope;
                // The stage before the last is needed no more.
                self.before.positions[node] = place;
                self.before.velocities[node] = state.velocities[node] * row.start
                    + velocity * row.last
                    + self.before.velocities[node] * row.before
                    + acceleration * row.slope
                    + self.first_slope.velocities[node] * row.first_slope;
            }
            std::mem::swap(&mut self.last, &mut self.before);
        }
        std::mem::swap(state, &mut self.last);
        sound(state)
    }
}
