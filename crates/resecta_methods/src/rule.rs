//! A rule for the choice of a method from a scene's own numbers, sought in measured costs.
//!
//! A rule names one method, or two and a threshold on one number of the scene. All of them are tried; the one kept fails to
//! reach the error in the fewest scenes and then costs least over the best method of each scene (geometric mean). How it
//! does on a scene that it has not seen is asked by leaving out each in turn.

/// A scene's numbers, known before it is stepped.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub struct Numbers {
    /// Stability bounds in a frame of 1/60 s: how stiff its fastest mode is.
    pub bounds_per_frame: f64,
    /// Damping rate times the stability bound: how much of its speed a fast mode loses in a step.
    pub damping_per_bound: f64,
}

/// Which of the numbers.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Number {
    /// [`Numbers::bounds_per_frame`].
    BoundsPerFrame,
    /// [`Numbers::damping_per_bound`].
    DampingPerBound,
}

impl Number {
    /// Its value for a scene.
    pub fn of(self, numbers: &Numbers) -> f64 {
        match self {
            Number::BoundsPerFrame => numbers.bounds_per_frame,
            Number::DampingPerBound => numbers.damping_per_bound,
        }
    }
}

/// A scene with what each method cost there; methods that do not reach the error are missing.
#[derive(Debug, Clone, PartialEq)]
pub struct Case {
    /// Key of the regime.
    pub regime: &'static str,
    /// Its numbers.
    pub numbers: Numbers,
    /// Cost of each method; one or more.
    pub costs: Vec<(&'static str, f64)>,
}

/// Which method to take.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Rule {
    /// This one, whatever the scene.
    Always(&'static str),
    /// One up to a threshold of a number, another above it.
    Split {
        /// The number.
        number: Number,
        /// The threshold.
        threshold: f64,
        /// Up to it.
        below: &'static str,
        /// Above it.
        above: &'static str,
    },
}

/// How well a rule does.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub struct Score {
    /// Scenes in which the method it names does not reach the error.
    pub failures: usize,
    /// Cost over that of the best method, geometric mean over the other scenes.
    pub mean_ratio: f64,
    /// The largest such ratio.
    pub worst_ratio: f64,
}

/// A split is kept over a single method only if it fails less often or lowers the mean ratio by this factor.
const WORTH: f64 = 0.95;

impl Rule {
    /// The method for a scene.
    pub fn method(&self, numbers: &Numbers) -> &'static str {
        match *self {
            Rule::Always(method) => method,
            Rule::Split {
                number,
                threshold,
                below,
                above,
            } => {
                if number.of(numbers) <= threshold {
                    below
                } else {
                    above
                }
            }
        }
    }

    /// Cost over the best in one case; none where it fails.
    pub fn ratio(&self, case: &Case) -> Option<f64> {
        let best = case.costs.iter().map(|(_, cost)| *cost).fold(f64::INFINITY, f64::min);
        let chosen = self.method(&case.numbers);
        case.costs
            .iter()
            .find(|(method, _)| *method == chosen)
            .map(|(_, cost)| cost / best)
    }

    fn score(&self, cases: &[Case]) -> Score {
        score(cases.iter().map(|case| self.ratio(case)))
    }
}

fn score(ratios: impl Iterator<Item = Option<f64>>) -> Score {
    let (mut failures, mut logs, mut worst) = (0, Vec::new(), 1.0_f64);
    for ratio in ratios {
        match ratio {
            Some(ratio) => {
                logs.push(ratio.ln());
                worst = worst.max(ratio);
            }
            None => failures += 1,
        }
    }
    Score {
        failures,
        mean_ratio: (logs.iter().sum::<f64>() / logs.len().max(1) as f64).exp(),
        worst_ratio: worst,
    }
}

/// The best rule for some cases, and how it does on them; none without cases.
pub fn seek(cases: &[Case]) -> Option<(Rule, Score)> {
    let mut methods: Vec<&'static str> = cases
        .iter()
        .flat_map(|case| &case.costs)
        .map(|(method, _)| *method)
        .collect();
    methods.sort_unstable();
    methods.dedup();
    let best = |rules: Vec<Rule>| {
        let scored = rules.into_iter().map(|rule| (rule, rule.score(cases)));
        scored.min_by(|(_, a), (_, b)| a.failures.cmp(&b.failures).then(a.mean_ratio.total_cmp(&b.mean_ratio)))
    };
    let single = best(methods.iter().map(|method| Rule::Always(method)).collect())?;
    let mut splits = Vec::new();
    for number in [Number::BoundsPerFrame, Number::DampingPerBound] {
        let mut values: Vec<f64> = cases.iter().map(|case| number.of(&case.numbers)).collect();
        values.sort_by(f64::total_cmp);
        for pair in values.windows(2).filter(|pair| pair[1] > 1.01 * pair[0]) {
            // Halfway on a logarithmic scale.
            let threshold = (pair[0] * pair[1]).sqrt();
            splits.extend(methods.iter().flat_map(|below| {
                methods
                    .iter()
                    .filter(move |above| *above != below)
                    .map(move |above| Rule::Split {
                        number,
                        threshold,
                        below,
                        above,
                    })
            }));
        }
    }
    let better = best(splits).filter(|(_, split)| {
        split.failures < single.1.failures
            || split.failures == single.1.failures && split.mean_ratio < WORTH * single.1.mean_ratio
    });
    Some(better.unwrap_or(single))
}

/// How rules do on scenes that they have not seen: each case judged by the rule sought without it.
pub fn left_out(cases: &[Case]) -> Score {
    score((0..cases.len()).filter_map(|index| {
        let others: Vec<Case> = cases
            .iter()
            .enumerate()
            .filter(|(other, _)| *other != index)
            .map(|(_, case)| case.clone())
            .collect();
        seek(&others).map(|(rule, _)| rule.ratio(&cases[index]))
    }))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn case(bounds_per_frame: f64, costs: &[(&'static str, f64)]) -> Case {
        Case {
            regime: "a scene",
            numbers: Numbers {
                bounds_per_frame,
                damping_per_bound: 0.1,
            },
            costs: costs.to_vec(),
        }
    }

    #[test]
    fn a_threshold_is_found_where_the_winner_changes() {
        let soft = [("quick", 1.0), ("sturdy", 5.0)];
        let stiff = [("quick", 50.0), ("sturdy", 5.0)];
        let cases = [
            case(10.0, &soft),
            case(30.0, &soft),
            case(1000.0, &stiff),
            case(4000.0, &stiff),
        ];
        let (rule, score) = seek(&cases).expect("there are cases");
        assert_eq!((score.failures, score.worst_ratio), (0, 1.0));
        assert!(matches!(rule, Rule::Split { threshold, .. } if (30.0..1000.0).contains(&threshold)));
        assert_eq!(rule.method(&cases[0].numbers), "quick");
        assert_eq!(left_out(&cases).worst_ratio, 1.0);
    }

    #[test]
    fn a_method_that_always_wins_needs_no_threshold() {
        let costs = [("quick", 1.0), ("sturdy", 5.0)];
        let cases = [case(10.0, &costs), case(30.0, &costs)];
        assert_eq!(seek(&cases).expect("there are cases").0, Rule::Always("quick"));
    }

    #[test]
    fn reaching_the_error_counts_before_the_cost() {
        let cases = [
            case(10.0, &[("quick", 1.0), ("sturdy", 5.0)]),
            case(10.0, &[("quick", 1.0), ("sturdy", 5.0)]),
            case(10.0, &[("sturdy", 5.0)]),
        ];
        assert_eq!(seek(&cases).expect("there are cases").0, Rule::Always("sturdy"));
    }
}
