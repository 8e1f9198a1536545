//! Learning curves: how each metric of an exercise went from run to run.

use std::fmt::Write as _;

use resecta_scenario::{Better, EndReason, MetricId};

use super::{PastRun, run::SCORE};

/// Runs that a table shows: the last ones, in columns.
const COLUMNS: usize = 8;

/// A metric of one exercise over the runs of one trainee.
#[derive(Debug, Clone, PartialEq)]
pub struct Curve {
    /// The metric's id; `score` for the points.
    pub metric: String,
    /// Its title.
    pub title: String,
    /// Its unit; `1` for shares and counts.
    pub unit: String,
    /// Which way it improves.
    pub better: Better,
    /// Number of the run, from 1, and the value.
    pub points: Vec<(usize, f64)>,
    /// The best value of runs that reached every goal, or of all where none did: who stops at once needs the least time. None of a
    /// metric that has no better.
    pub best: Option<f64>,
}

/// The curves of runs of one exercise by one trainee, in the order of reports, the score first. Metrics that were 0 in every run are
/// left out.
pub fn curves(runs: &[&PastRun]) -> Vec<Curve> {
    let built_in = MetricId::ALL.iter().map(|metric| metric.info());
    let mut metrics: Vec<(String, String, String, Better)> = vec![(
        SCORE.into(),
        "Score".into(),
        runs.last().map_or(String::new(), |run| format!("of {:.0}", run.out_of)),
        Better::More,
    )];
    metrics.extend(built_in.map(|info| (info.id.into(), info.title.into(), info.unit.into(), info.better)));
    // What extensions measured, whether or not they are here now.
    let mut others: Vec<&String> = runs.iter().flat_map(|run| run.metrics.keys()).collect();
    others.retain(|id| MetricId::from_id(id).is_none());
    others.sort();
    others.dedup();
    metrics.extend(
        others
            .iter()
            .map(|&id| (id.clone(), id.clone(), "1".into(), Better::Neither)),
    );
    let is_whole = |run: &&PastRun| run.ended == Some(EndReason::GoalsReached);
    let any_is_whole = runs.iter().any(is_whole);
    let curve = |(metric, title, unit, better): (String, String, String, Better)| {
        let points = (runs.iter().zip(1..)).filter_map(|(run, number)| Some((number, run.value(&metric)?)));
        let counted = runs.iter().filter(|run| is_whole(run) || !any_is_whole);
        let values = counted.filter_map(|run| run.value(&metric));
        let best = match better {
            Better::More => values.reduce(f64::max),
            Better::Less => values.reduce(f64::min),
            Better::Neither => None,
        };
        Curve {
            points: points.collect(),
            best,
            metric,
            title,
            unit,
            better,
        }
    };
    let curves = metrics.into_iter().map(curve);
    curves
        .filter(|curve| curve.metric == SCORE || curve.points.iter().any(|point| point.1 != 0.0))
        .collect()
}

/// The learning curves as text: for each trainee and exercise a table with a row a metric and a column a run, the last runs last.
pub fn table(runs: &[PastRun]) -> String {
    let mut groups: Vec<(&str, &str)> = runs
        .iter()
        .map(|run| (run.trainee.as_str(), run.exercise.as_str()))
        .collect();
    groups.sort_unstable();
    groups.dedup();
    let mut text = String::new();
    for (trainee, exercise) in groups {
        let of_group = |run: &&PastRun| run.trainee == trainee && run.exercise == exercise;
        let runs: Vec<&PastRun> = runs.iter().filter(of_group).collect();
        let title = runs.last().map_or(exercise, |run| &run.title);
        let plural = if runs.len() == 1 { "" } else { "s" };
        // Writing to a string cannot fail.
        let _ = writeln!(text, "{trainee}: {title} ({exercise}), {} run{plural}", runs.len());
        let hashes = runs
            .iter()
            .map(|run| &run.exercise_hash)
            .filter(|hash| !hash.is_empty());
        let mut hashes: Vec<&String> = hashes.collect();
        hashes.sort();
        hashes.dedup();
        if hashes.len() > 1 {
            let _ = writeln!(
                text,
                "  (the exercise changed on the way: {} versions of it)",
                hashes.len()
            );
        }
        let first = runs.len().saturating_sub(COLUMNS);
        let _ = write!(text, "  {:<28}{:>8}", "run", "");
        for number in first..runs.len() {
            let _ = write!(text, "{:>10}", number + 1);
        }
        let _ = writeln!(text, "{:>10}", "best");
        for curve in curves(&runs) {
            let unit = if curve.unit == "1" { "" } else { &curve.unit };
            let _ = write!(text, "  {:<28}{unit:>8}", curve.title);
            for number in first + 1..=runs.len() {
                let point = curve.points.iter().find(|point| point.0 == number);
                let _ = write!(text, "{:>10}", point.map_or("-".into(), |point| short(point.1)));
            }
            let _ = writeln!(text, "{:>10}", curve.best.map_or("-".into(), short));
        }
        let _ = write!(text, "  {:<28}{:>8}", "Medal", "");
        for run in &runs[first..] {
            let _ = write!(text, "{:>10}", run.medal.map_or("-", |medal| medal.name()));
        }
        text.push_str("\n\n");
    }
    text.truncate(text.trim_end().len());
    text
}

/// A number in at most nine letters.
fn short(value: f64) -> String {
    match value.abs() {
        size if size >= 1000.0 => format!("{value:.0}"),
        size if size >= 10.0 => format!("{value:.1}"),
        _ if value == value.trunc() => format!("{value:.0}"),
        _ => format!("{value:.3}"),
    }
}
