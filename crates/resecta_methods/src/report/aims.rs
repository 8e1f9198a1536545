//! The part of `index.md` on errors told and aims reached.

use std::fmt::Write;

use super::{
    Summary,
    tables::{number, plain, table},
    verdicts::percent,
};

/// A watch is held to tell the true error within this factor.
const FACTOR: f64 = 3.0;
/// Below this, mm, single precision is what two solutions are told apart by.
const ROUNDING_MM: f64 = 2e-6;

/// Errors told against true ones, and what aims cost.
pub fn aims(text: &mut String, summary: &Summary) {
    let telling = summary
        .watched
        .iter()
        .filter(|watched| watched.true_mm.max(watched.told_mm) > ROUNDING_MM);
    let ratios: Vec<f64> = telling.map(|watched| watched.told_mm / watched.true_mm).collect();
    let within = ratios
        .iter()
        .filter(|ratio| (1.0 / FACTOR..=FACTOR).contains(*ratio))
        .count();
    let _ = write!(
        text,
        "## What the product says of its own error\n\nA watch from the start on, at the least effort (frequencies held down \
         by raised inertias and softened springs) and at the full one, with the longest substeps that are stable. The error \
         told is within a factor of {FACTOR} of the true one in {within} of {} cases ({} more are below rounding): \
         told over true {} to {}.\n\n",
        ratios.len(),
        summary.watched.len() - ratios.len(),
        plain(ratios.iter().copied().fold(f64::INFINITY, f64::min)),
        plain(ratios.iter().copied().fold(0.0, f64::max)),
    );
    let lines = summary.watched.iter().map(|watched| {
        vec![
            format!("`{}`", watched.regime),
            watched.fastest.map_or("full", |_| "least").into(),
            plain(watched.time_s),
            number(watched.told_mm),
            number(watched.true_mm),
            plain(watched.told_mm / watched.true_mm),
        ]
    });
    *text += &table(
        &[
            "regime",
            "effort",
            "time, s",
            "told, mm RMS",
            "true, mm RMS",
            "told / true",
        ],
        lines,
    );
    *text += "## What an aim costs the product\n\nThe product chooses substeps, inertias and softening itself; aims are shares of \
              how far the nodes moved by the end. `told` is the largest error that it saw on the way (above the aim, it went on \
              from the finer solution), `true` that of the end. CPU time is set against that of the full effort with the \
              longest stable substeps, whatever its error.\n\n";
    let lines = summary.aimed.iter().map(|aimed| {
        vec![
            format!("`{}`", aimed.regime),
            plain(aimed.time_s),
            percent(aimed.share),
            number(aimed.aim_mm),
            number(aimed.told_mm),
            number(aimed.true_mm),
            aimed.softened.to_string(),
            aimed.substeps.to_string(),
            number(aimed.cpu_s),
            plain(aimed.cpu_s / aimed.full_cpu_s),
            plain(aimed.time_s / aimed.cpu_s),
        ]
    });
    *text += &table(
        &[
            "regime",
            "time, s",
            "aim",
            "aim, mm",
            "told, mm",
            "true, mm",
            "springs softened",
            "substeps",
            "CPU time, s",
            "over full effort",
            "times real time",
        ],
        lines,
    );
}
