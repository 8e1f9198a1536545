//! `rows.md`: every row of every regime, and how numbers are written.

use std::fmt::Write;

use super::Summary;
use crate::measure::{Outcome, Row};

/// A number with two digits after the first: `1.23e-4`.
pub fn number(value: f64) -> String {
    if value == 0.0 {
        "0".into()
    } else {
        format!("{value:.2e}")
    }
}

/// A number between 0.01 and 10,000 in plain digits, others as `1.23e-4`.
pub fn plain(value: f64) -> String {
    match value.abs() {
        size if !(0.01..10_000.0).contains(&size) => number(value),
        size if size < 1.0 => format!("{value:.3}"),
        size if size < 10.0 => format!("{value:.2}"),
        size if size < 100.0 => format!("{value:.1}"),
        _ => format!("{value:.0}"),
    }
}

/// Lines of a Markdown table.
pub fn table(heads: &[&str], lines: impl IntoIterator<Item = Vec<String>>) -> String {
    let mut text = format!("| {} |\n|{}\n", heads.join(" | "), "---|".repeat(heads.len()));
    for line in lines {
        text += &format!("| {} |\n", line.join(" | "));
    }
    text + "\n"
}

/// Orders of convergence that a method's rows of one regime and time show: between each row that arrived and that with the
/// next shorter step.
pub fn orders(rows: &[&Row]) -> Vec<(f64, f64)> {
    let mut arrived: Vec<(f64, f64)> = rows
        .iter()
        .filter_map(|row| Some((row.step_s, row.rms_mm.filter(|rms| *rms > 0.0)?)))
        .collect();
    arrived.sort_by(|a, b| a.0.total_cmp(&b.0));
    let pairs = arrived.windows(2);
    pairs
        .map(|pair| (pair[1].0, (pair[1].1 / pair[0].1).ln() / (pair[1].0 / pair[0].0).ln()))
        .collect()
}

fn outcome(outcome: Outcome) -> String {
    match outcome {
        Outcome::Arrived => "arrived".into(),
        Outcome::Diverged(at_s) => format!("diverged after {} s", plain(at_s)),
        Outcome::NotConverged(at_s) => format!("equations not solved after {} s", plain(at_s)),
        Outcome::GivenUp(0.0) => "too dear, not begun".into(),
        Outcome::GivenUp(at_s) => format!("too dear, given up after {} s", plain(at_s)),
    }
}

/// The page of all rows.
pub fn rows(summary: &Summary) -> String {
    let mut text = String::from(
        "# All rows\n\nErrors are against the reference of the regime, over all nodes. `order` is between the row and the \
         same method with the next shorter step. Counts and CPU time run from the start.\n\n",
    );
    for measured in &summary.regimes {
        let regime = &measured.regime;
        for (time_s, moved) in regime.times_s.iter().zip(&measured.conditions.moved_mm) {
            let _ = write!(
                text,
                "## `{}` at {time_s} s\n\nThe nodes moved by {} mm RMS, at most {} mm.\n\n",
                regime.key,
                number(moved[0]),
                number(moved[1])
            );
            let here: Vec<&Row> = summary
                .rows
                .iter()
                .filter(|row| row.regime == regime.key && row.time_s == *time_s)
                .collect();
            let line = |row: &&Row| {
                let alike: Vec<&Row> = here
                    .iter()
                    .copied()
                    .filter(|other| other.method == row.method)
                    .collect();
                let order = orders(&alike)
                    .into_iter()
                    .find(|(step_s, _)| *step_s == row.step_s && row.rms_mm.is_some());
                let optional = |value: Option<f64>| value.map_or(String::new(), number);
                vec![
                    row.method.to_string(),
                    number(row.step_s),
                    plain(row.step_in_bounds),
                    outcome(row.outcome),
                    optional(row.rms_mm),
                    optional(row.largest_mm),
                    order.map_or(String::new(), |(_, order)| format!("{order:.1}")),
                    row.work.force_passes.to_string(),
                    row.work.product_passes.to_string(),
                    row.work.sweeps.to_string(),
                    number(row.work.spring_visits as f64),
                    number(row.cpu_s),
                ]
            };
            text += &table(
                &[
                    "method",
                    "step, s",
                    "step / bound",
                    "outcome",
                    "error, mm RMS",
                    "largest, mm",
                    "order",
                    "force passes",
                    "products",
                    "sweeps",
                    "springs visited",
                    "CPU, s",
                ],
                here.iter().map(line),
            );
        }
    }
    text.trim_end().to_string() + "\n"
}
