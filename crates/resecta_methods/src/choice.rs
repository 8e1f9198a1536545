//! Which method reaches a wanted error at least cost, from measured rows.

use crate::measure::Row;

/// Wanted errors, as shares of how far the nodes moved, RMS over RMS.
pub const WANTED: [f64; 4] = [1e-1, 1e-2, 1e-3, 1e-4];

/// What is to be least.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Cost {
    /// Springs visited: the same on every machine.
    SpringVisits,
    /// CPU time of this machine.
    CpuTime,
}

impl Cost {
    /// Of a row: a count, or s.
    pub fn of(self, row: &Row) -> f64 {
        match self {
            Cost::SpringVisits => row.work.spring_visits as f64,
            Cost::CpuTime => row.cpu_s,
        }
    }
}

/// The cheapest row of every method on equal footing that reaches `error_mm` at a time of a regime, cheapest first.
pub fn cheapest<'a>(rows: &'a [Row], regime: &str, time_s: f64, error_mm: f64, cost: Cost) -> Vec<&'a Row> {
    let mut reaching: Vec<&Row> = rows
        .iter()
        .filter(|row| row.regime == regime && row.time_s == time_s && !row.product && row.reaches(error_mm))
        .collect();
    reaching.sort_by(|a, b| cost.of(a).total_cmp(&cost.of(b)));
    let mut best: Vec<&Row> = Vec::new();
    for row in reaching {
        if best.iter().all(|known| known.method != row.method) {
            best.push(row);
        }
    }
    best
}

/// The product's cheapest row that reaches `error_mm` at a time of a regime.
pub fn product<'a>(rows: &'a [Row], regime: &str, time_s: f64, error_mm: f64) -> Option<&'a Row> {
    let reaching = rows
        .iter()
        .filter(|row| row.regime == regime && row.time_s == time_s && row.product && row.reaches(error_mm));
    reaching.min_by(|a, b| a.cpu_s.total_cmp(&b.cpu_s))
}

/// A method that got there first.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct Winner {
    /// Key of the regime.
    pub regime: &'static str,
    /// When, s.
    pub time_s: f64,
    /// Wanted error, share of the movement.
    pub wanted: f64,
    /// Wanted error, mm RMS.
    pub error_mm: f64,
    /// What was to be least.
    pub cost: Cost,
    /// Its name; none when no method got there.
    pub method: Option<&'static str>,
    /// Its step over the stability bound.
    pub step_in_bounds: Option<f64>,
    /// What it cost: springs visited, or s.
    pub least: Option<f64>,
    /// The next method and how many times the cost it took.
    pub second: Option<(&'static str, f64)>,
    /// CPU time of the product for the same error, s.
    pub product_cpu_s: Option<f64>,
}

/// The winner at a time of a regime whose nodes moved by `moved_mm` RMS.
pub fn winner(rows: &[Row], regime: &'static str, time_s: f64, moved_mm: f64, wanted: f64, cost: Cost) -> Winner {
    let error_mm = wanted * moved_mm;
    let best = cheapest(rows, regime, time_s, error_mm, cost);
    let first = best.first();
    Winner {
        regime,
        time_s,
        wanted,
        error_mm,
        cost,
        method: first.map(|row| row.method),
        step_in_bounds: first.map(|row| row.step_in_bounds),
        least: first.map(|row| cost.of(row)),
        second: first
            .zip(best.get(1))
            .map(|(first, second)| (second.method, cost.of(second) / cost.of(first))),
        product_cpu_s: product(rows, regime, time_s, error_mm).map(|row| row.cpu_s),
    }
}
