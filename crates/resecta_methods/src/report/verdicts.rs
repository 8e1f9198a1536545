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

/// Where the product's own solver stands among the winners.
pub fn product(text: &mut String, summary: &Summary) {
    *text += "## Where the product stands\n\nThe product has one method, leapfrog in single precision and vector instructions, \
              here with true masses and springs and substeps from its stability bound. An implicit method beside it would \
              have to win where a scene asks for it: `slower` names those regimes, with how many times less the winner took.";
    let missed = summary
        .winners
        .iter()
        .filter(|winner| winner.cost == Cost::CpuTime && winner.least.is_some() && winner.product_cpu_s.is_none());
    let largest = missed.map(|winner| winner.error_mm).fold(0.0, f64::max);
    if largest > 0.0 {
        let _ = write!(
            text,
            " The largest error that some method reached and the product did not is {} mm RMS.",
            number(largest)
        );
    }
    *text += "\n\n";
    let line = |wanted: &f64| {
        let asked: Vec<(&Winner, f64)> = summary
            .winners
            .iter()
            .filter(|winner| winner.cost == Cost::CpuTime && winner.wanted == *wanted)
            .filter_map(|winner| winner.least.map(|least| (winner, least)))
            .collect();
        let mut reached: Vec<(&Winner, f64)> = asked
            .iter()
            .filter_map(|(winner, least)| winner.product_cpu_s.map(|product| (*winner, least / product)))
            .collect();
        reached.sort_by(|one, other| one.1.total_cmp(&other.1));
        let median = reached
            .get(reached.len() / 2)
            .map_or("none".into(), |(_, times)| plain(*times));
        let slower = reached.iter().filter(|(_, times)| *times < 1.0);
        let slower = slower.map(|(winner, times)| {
            format!(
                "`{}` at {} s: {}",
                winner.regime,
                plain(winner.time_s),
                plain(1.0 / times)
            )
        });
        vec![
            percent(*wanted),
            asked.len().to_string(),
            reached.len().to_string(),
            median,
            slower.collect::<Vec<String>>().join("<br>"),
        ]
    };
    *text += &table(
        &[
            "wanted error",
            "questions",
            "reached",
            "times faster than the winner, median",
            "slower",
        ],
        WANTED.iter().map(line),
    );
}

/// A share in per cent.
pub fn percent(share: f64) -> String {
    format!("{} %", 100.0 * share)
}
