//! What follows from the rows: winners, rules, methods that win nothing.

use serde::Serialize;

use super::FRAME_S;
use crate::{
    aims::{Aimed, Watched},
    choice::{Cost, WANTED, Winner, cheapest, winner},
    conditions::Conditions,
    measure::Row,
    regimes::Regime,
    rule::{Case, Numbers, Rule, Score, left_out, seek},
};

/// A regime with its numbers.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Measured {
    /// The scene, and what was measured on it.
    pub regime: Regime,
    /// Its numbers.
    pub conditions: Conditions,
}

/// The rule for a wanted error.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Advice {
    /// Wanted error, share of the movement.
    pub wanted: f64,
    /// What is to be least.
    pub cost: Cost,
    /// The rule.
    pub rule: Rule,
    /// On the regimes that it was sought in.
    pub score: Score,
    /// On regimes that were left out.
    pub left_out: Score,
    /// Regimes in which no method reached the error.
    pub out_of_reach: Vec<&'static str>,
    /// Steps over the bound of the methods it names, least and largest, in the regimes it names them for.
    pub steps_in_bounds: Vec<(&'static str, [f64; 2])>,
}

/// All that was measured, and what follows.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Summary {
    /// The regimes.
    pub regimes: Vec<Measured>,
    /// Every method, step and time.
    pub rows: Vec<Row>,
    /// What the product said of its own error.
    pub watched: Vec<Watched>,
    /// What the product took to reach aims.
    pub aimed: Vec<Aimed>,
    /// The winner of every regime, time and wanted error, by either cost.
    pub winners: Vec<Winner>,
    /// The rules.
    pub advice: Vec<Advice>,
    /// Methods on equal footing that are winner of nothing, by each cost.
    pub win_nowhere: [(Cost, Vec<&'static str>); 2],
}

/// Draws the conclusions.
pub fn summarise(regimes: Vec<Measured>, rows: Vec<Row>, (watched, aimed): (Vec<Watched>, Vec<Aimed>)) -> Summary {
    let costs = [Cost::SpringVisits, Cost::CpuTime];
    let mut winners = Vec::new();
    for measured in &regimes {
        let times = measured.regime.times_s.iter().zip(&measured.conditions.moved_mm);
        for (time_s, moved) in times {
            for (cost, wanted) in costs.iter().flat_map(|cost| WANTED.map(|wanted| (*cost, wanted))) {
                winners.push(winner(&rows, measured.regime.key, *time_s, moved[0], wanted, cost));
            }
        }
    }
    let mut advice = Vec::new();
    for (cost, wanted) in costs.iter().flat_map(|cost| WANTED.map(|wanted| (*cost, wanted))) {
        advice.extend(advise(&regimes, &rows, wanted, cost));
    }
    let mut methods: Vec<&'static str> = Vec::new();
    for row in rows.iter().filter(|row| !row.product) {
        if !methods.contains(&row.method) {
            methods.push(row.method);
        }
    }
    let win_nowhere = costs.map(|cost| {
        let wins = |method: &&str| {
            winners
                .iter()
                .any(|winner| winner.cost == cost && winner.method == Some(*method))
        };
        (cost, methods.iter().copied().filter(|method| !wins(method)).collect())
    });
    Summary {
        regimes,
        rows,
        watched,
        aimed,
        winners,
        advice,
        win_nowhere,
    }
}

/// The rule for a wanted error at the first time of every regime of few nodes.
fn advise(regimes: &[Measured], rows: &[Row], wanted: f64, cost: Cost) -> Option<Advice> {
    let (mut cases, mut best, mut out_of_reach) = (Vec::new(), Vec::new(), Vec::new());
    // In the large one not every method ran.
    for Measured { regime, conditions } in regimes.iter().filter(|measured| !measured.regime.large) {
        let reaching = cheapest(
            rows,
            regime.key,
            regime.times_s[0],
            wanted * conditions.moved_mm[0][0],
            cost,
        );
        if reaching.is_empty() {
            out_of_reach.push(regime.key);
            continue;
        }
        cases.push(Case {
            regime: regime.key,
            numbers: Numbers {
                bounds_per_frame: FRAME_S / conditions.bound_s,
                damping_per_bound: conditions.damping_rate * conditions.bound_s,
            },
            costs: reaching.iter().map(|row| (row.method, cost.of(row))).collect(),
        });
        best.push(reaching);
    }
    let (rule, score) = seek(&cases)?;
    let mut steps_in_bounds: Vec<(&'static str, [f64; 2])> = Vec::new();
    for (case, reaching) in cases.iter().zip(&best) {
        let chosen = rule.method(&case.numbers);
        let Some(row) = reaching.iter().find(|row| row.method == chosen) else {
            continue;
        };
        let step = row.step_in_bounds;
        match steps_in_bounds.iter_mut().find(|(method, _)| *method == chosen) {
            Some((_, range)) => *range = [range[0].min(step), range[1].max(step)],
            None => steps_in_bounds.push((chosen, [step, step])),
        }
    }
    Some(Advice {
        wanted,
        cost,
        rule,
        score,
        left_out: left_out(&cases),
        out_of_reach,
        steps_in_bounds,
    })
}
