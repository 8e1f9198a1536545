//! `index.md`: what was measured, how sure it is, who wins, and which method to choose. What it says of results is computed.

use std::fmt::Write;

use super::{
    FRAME_S, Measured, Summary,
    aims::aims,
    machine::processor,
    tables::{number, orders, plain, table},
    verdicts::{percent, product, rules, tally, winners},
};
use crate::{
    choice::{Cost, WANTED},
    conditions::NUDGE_MM,
    measure::{Outcome, Row},
};

const INTRODUCTION: &str = "# Which integrator, for which tissue

Every method here integrates `m x'' + gamma x' = springs + load` from rest under a load switched on at the start, in double
precision, on one force kernel; the implicit ones share one product with the stiffness, one Newton iteration and one
conjugate gradient solver. None is vectorised by hand, none uses more than one thread. The product's own solver (leapfrog,
single precision, vector instructions) runs beside them and takes no part in who wins.

Errors are distances from a reference solution, RMS over all nodes: at 0.02 s, early in the motion, at 0.1 s and, in some
regimes, at 1 s. A wanted error is a share of how far the nodes of the
regime moved, RMS over RMS: without a method at all the error is 100 %. A method's cost for a wanted error is that of its
cheapest step that reaches it; steps were tried in ratios of 1.4 to 4, so costs are known to about that. CPU time is that of
the thread that steps, setting the method up included (of the product stepping alone); runs below 0.08 s are the best of three.

All rows are in [rows.md](rows.md), raw in [results.json](results.json). To repeat:
`cargo run --release -- accuracy`.

How exactly tissue is cut stands in [cuts.md](cuts.md).

";

/// The whole page.
pub fn page(summary: &Summary) -> String {
    let mut text = INTRODUCTION.to_string();
    regimes(&mut text, summary);
    conditioning(&mut text, summary);
    outcomes(&mut text, summary);
    text += "## Winners by springs visited\n\nThe same on every machine. A pass of forces, a product with the stiffness and a \
             sweep of XPBD each visit every spring once; a sweep of VBD visits each from both ends. A visit of a sweep costs \
             more time than one of a pass: it waits for the one before.\n\n";
    winners(&mut text, summary, Cost::SpringVisits);
    let _ = write!(
        text,
        "## Winners by CPU time\n\nOn one core of {}. Below each winner the product's time for the same error, where it \
         reaches it. Where leapfrog and symplectic Euler are within some 15 % at the same step, it is the time of two half kicks \
         over that of one.\n\n",
        processor(),
    );
    winners(&mut text, summary, Cost::CpuTime);
    text += "## A rule for the choice\n\nSought among all rules that name one method, or two and a threshold on one of two \
             numbers that a pass over the nodes gives before the first step: stability bounds in a frame of 1/60 s, and \
             damping rate times bound. A rule that reaches the error in more regimes is better, then one that costs less \
             over the winner of each regime (geometric mean; in brackets the worst). Judged also on each regime left out in \
             turn, because a rule fits what it was sought in. From the regimes of about 1,000 nodes, at their first time.\n\n";
    for cost in [Cost::SpringVisits, Cost::CpuTime] {
        rules(&mut text, summary, cost);
    }
    tally(&mut text, summary);
    product(&mut text, summary);
    aims(&mut text, summary);
    text += "## Charts\n\nDown and to the left is better. At the first time of each regime.\n\n";
    for Measured { regime, .. } in &summary.regimes {
        let _ = write!(
            text,
            "![CPU time against error, {}]({}.svg)\n\n",
            regime.title, regime.key
        );
    }
    text.trim_end().to_string() + "\n"
}

fn regimes(text: &mut String, summary: &Summary) {
    *text += "## What was measured\n\nAnnuli of the gland's size, the outer wall fixed, pulled at a third of the inner wall. The \
              bound is the longest step that leapfrog without damping survives at the start, from the stiffness around each \
              node; the damping ratio is that of the slowest mode at the start. The reference is RK4; its error is about a \
              fifteenth of its difference from itself with twice the step.\n\n";
    let line = |Measured { regime, conditions }: &Measured| {
        let [soft, stiff] = conditions.stiffness;
        vec![
            format!("`{}`: {}", regime.key, regime.title),
            format!("{} / {}", conditions.nodes, conditions.springs),
            if stiff > 1.01 * soft {
                format!("{} to {}", plain(soft), plain(stiff))
            } else {
                plain(soft)
            },
            plain(conditions.damping_rate),
            conditions.damping_ratio.map_or("no slowest mode".into(), plain),
            number(conditions.bound_s),
            plain(FRAME_S / conditions.bound_s),
            plain(conditions.damping_rate * conditions.bound_s),
        ]
    };
    *text += &table(
        &[
            "regime",
            "nodes / springs",
            "stiffness, µN/mm",
            "damping rate, 1/s",
            "damping ratio",
            "bound, s",
            "bounds in a frame",
            "damping rate x bound",
        ],
        summary.regimes.iter().map(line),
    );
}

fn conditioning(text: &mut String, summary: &Summary) {
    let finest = WANTED.iter().copied().fold(f64::INFINITY, f64::min);
    let margins = summary.regimes.iter().flat_map(|Measured { conditions, .. }| {
        let times = conditions.moved_mm.iter().zip(&conditions.self_difference_mm);
        times.map(|(moved, difference)| finest * moved[0] / difference)
    });
    let _ = write!(
        text,
        "## How far a result can be trusted\n\n`amplified` is how far apart, over how far apart at the start, two runs end of \
         which one started with every free node moved by {NUDGE_MM:.0e} mm. The finest wanted \
         error, {}, is at least {:.0} times the reference's difference from itself in every regime.\n\n",
        percent(finest),
        margins.fold(f64::INFINITY, f64::min)
    );
    let lines = summary.regimes.iter().flat_map(|Measured { regime, conditions }| {
        regime.times_s.iter().enumerate().map(move |(time, time_s)| {
            vec![
                format!("`{}`", regime.key),
                plain(*time_s),
                number(conditions.moved_mm[time][0]),
                number(conditions.moved_mm[time][1]),
                number(conditions.reference_step_s),
                number(conditions.self_difference_mm[time]),
                plain(conditions.nudged_mm[time] / NUDGE_MM),
            ]
        })
    });
    *text += &table(
        &[
            "regime",
            "time, s",
            "moved, mm RMS",
            "moved, mm at most",
            "reference's step, s",
            "reference's difference from itself, mm RMS",
            "amplified",
        ],
        lines,
    );
}

/// Without regard to the machine: how runs ended, and the orders seen.
fn outcomes(text: &mut String, summary: &Summary) {
    *text += "## How the methods did\n\nRows to the first time of each regime. The order is the median over regimes between \
              the two shortest steps that arrived. A run is given up beyond 4e8 \
              springs visited for each 0.1 s of motion. `of use` are rows with an error below the movement itself. \
              An order below the method's own says that even these steps are too long to resolve \
              what moves.\n\n";
    let line = |method: &'static str| {
        let of_method = |regime: &Measured| -> Vec<&Row> {
            let (key, time_s) = (regime.regime.key, regime.regime.times_s[0]);
            let rows = summary.rows.iter();
            rows.filter(|row| row.method == method && row.regime == key && row.time_s == time_s)
                .collect()
        };
        let rows: Vec<&Row> = summary.regimes.iter().flat_map(of_method).collect();
        let below = |regime: &Measured| {
            let rows = of_method(regime).into_iter();
            rows.filter(|row| row.reaches(regime.conditions.moved_mm[0][0])).count()
        };
        let of_use: usize = summary.regimes.iter().map(below).sum();
        let count = |test: fn(Outcome) -> bool| rows.iter().filter(|row| test(row.outcome)).count().to_string();
        let shortest = summary
            .regimes
            .iter()
            .filter_map(|regime| Some(orders(&of_method(regime)).first()?.1));
        let mut seen: Vec<f64> = shortest.collect();
        seen.sort_by(f64::total_cmp);
        vec![
            method.to_string(),
            rows.len().to_string(),
            count(|outcome| outcome == Outcome::Arrived),
            count(|outcome| matches!(outcome, Outcome::Diverged(_))),
            count(|outcome| matches!(outcome, Outcome::NotConverged(_))),
            count(|outcome| matches!(outcome, Outcome::GivenUp(_))),
            of_use.to_string(),
            seen.get(seen.len() / 2)
                .map_or(String::new(), |order| format!("{order:.1}")),
        ]
    };
    *text += &table(
        &[
            "method",
            "rows",
            "arrived",
            "diverged",
            "equations not solved",
            "too dear",
            "of use",
            "order seen",
        ],
        methods(summary).into_iter().map(line),
    );
}

/// Names in the order in which they were measured.
fn methods(summary: &Summary) -> Vec<&'static str> {
    let mut names = Vec::new();
    for row in &summary.rows {
        if !names.contains(&row.method) {
            names.push(row.method);
        }
    }
    names
}
