//! Who wins, by which rule to choose, and what wins nowhere, in words and tables.

use std::fmt::Write;

use super::{
    Advice, Measured, Summary,
    tables::{number, plain, table},
};
use crate::{
    choice::{Cost, WANTED, Winner},
    rule::{Number, Rule, Score},
};

/// The winners of every regime, time and wanted error.
pub fn winners(text: &mut String, summary: &Summary, cost: Cost) {
    let heads: Vec<String> = WANTED.iter().map(|wanted| percent(*wanted)).collect();
    let mut all = vec!["regime", "time, s"];
    all.extend(heads.iter().map(String::as_str));
    let lines = summary.regimes.iter().flat_map(|Measured { regime, .. }| {
        regime.times_s.iter().map(move |time_s| {
            let here =
                |winner: &&Winner| winner.regime == regime.key && winner.time_s == *time_s && winner.cost == cost;
            let cells = summary.winners.iter().filter(here).map(cell);
            [format!("`{}`", regime.key), plain(*time_s)]
                .into_iter()
                .chain(cells)
                .collect()
        })
    });
    *text += &table(&all, lines);
}

/// A winner, what it cost, and the next.
fn cell(winner: &Winner) -> String {
    let (Some(method), Some(least), Some(step)) = (winner.method, winner.least, winner.step_in_bounds) else {
        return "none".into();
    };
    let unit = match winner.cost {
        Cost::SpringVisits => " springs",
        Cost::CpuTime => " s",
    };
    let mut text = format!("**{method}**, {} bounds: {}{unit}", plain(step), number(least));
    if let Some((second, times)) = winner.second {
        let _ = write!(text, "<br>{second}: {} times", plain(times));
    }
    if winner.cost == Cost::CpuTime {
        match winner.product_cpu_s {
            Some(product) => {
                let _ = write!(text, "<br>product: {} s", number(product));
            }
            None => text += "<br>product: not reached",
        }
    }
    text
}

/// The rules.
pub fn rules(text: &mut String, summary: &Summary, cost: Cost) {
    *text += match cost {
        Cost::SpringVisits => "By springs visited:\n\n",
        Cost::CpuTime => "By CPU time:\n\n",
    };
    let line = |advice: &Advice| {
        let steps = advice
            .steps_in_bounds
            .iter()
            .map(|(method, [least, most])| format!("{method} {} to {}", plain(*least), plain(*most)));
        vec![
            percent(advice.wanted),
            in_words(&advice.rule),
            steps.collect::<Vec<String>>().join("<br>"),
            scored(&advice.score),
            scored(&advice.left_out),
            advice
                .out_of_reach
                .iter()
                .map(|key| format!("`{key}`"))
                .collect::<Vec<String>>()
                .join(", "),
        ]
    };
    *text += &table(
        &[
            "wanted error",
            "take",
            "with steps of so many bounds",
            "costs over the winner",
            "on regimes left out",
            "no method reached it in",
        ],
        summary.advice.iter().filter(|advice| advice.cost == cost).map(line),
    );
}

fn in_words(rule: &Rule) -> String {
    match rule {
        Rule::Always(method) => format!("**{method}**"),
        Rule::Split {
            number,
            threshold,
            below,
            above,
        } => {
            let name = match number {
                Number::BoundsPerFrame => "bounds in a frame",
                Number::DampingPerBound => "damping rate x bound",
            };
            format!("**{below}** where {name} <= {}, else **{above}**", plain(*threshold))
        }
    }
}

fn scored(score: &Score) -> String {
    let failures = match score.failures {
        0 => String::new(),
        1 => "; misses the error in 1 regime".into(),
        many => format!("; misses the error in {many} regimes"),
    };
    format!("{:.2} ({:.1}){failures}", score.mean_ratio, score.worst_ratio)
}

/// How often each method wins, and those that never do.
pub fn tally(text: &mut String, summary: &Summary) {
    let asked = summary.winners.len() / 2;
    let _ = write!(
        text,
        "## Who wins how often, and what wins nowhere\n\nOf {asked} questions (regime, time, wanted error) by either cost.\n\n"
    );
    let mut methods: Vec<&str> = summary.winners.iter().filter_map(|winner| winner.method).collect();
    methods.sort_unstable();
    methods.dedup();
    let won = |method: &str, cost: Cost| {
        let winners = summary.winners.iter();
        winners
            .filter(|winner| winner.method == Some(method) && winner.cost == cost)
            .count()
    };
    methods.sort_by_key(|method| std::cmp::Reverse(won(method, Cost::CpuTime)));
    let line = |method: &&str| {
        let counts = [Cost::SpringVisits, Cost::CpuTime].map(|cost| won(method, cost).to_string());
        [method.to_string()].into_iter().chain(counts).collect()
    };
    *text += &table(
        &["method", "by springs visited", "by CPU time"],
        methods.iter().map(line),
    );
    for (cost, methods) in summary.win_nowhere.iter().filter(|(_, methods)| !methods.is_empty()) {
        let name = match cost {
            Cost::SpringVisits => "springs visited",
            Cost::CpuTime => "CPU time",
        };
        let _ = write!(text, "By {name} nothing is won by {}.\n\n", methods.join("; "));
    }
}

/// A share in per cent.
pub fn percent(share: f64) -> String {
    format!("{} %", 100.0 * share)
}
