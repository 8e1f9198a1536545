//! Pars of a score line: the values that earn bronze, silver and gold. They earn no points; they tell a player where a value
//! stands among what others have reached.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Values of a line's metric, each better than the one before, and where they come from.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Pars {
    /// The least that earns bronze, in the metric's unit.
    pub bronze: f64,
    /// The same for silver; better than `bronze`.
    pub silver: f64,
    /// The same for gold; better than `silver`.
    pub gold: f64,
    /// Where the three come from.
    pub basis: String,
}

/// What a value earns against [`Pars`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Medal {
    /// At least as good as `bronze`.
    Bronze,
    /// At least as good as `silver`.
    Silver,
    /// At least as good as `gold`.
    Gold,
}

impl Medal {
    /// Every medal, rising.
    pub const ALL: [Medal; 3] = [Medal::Bronze, Medal::Silver, Medal::Gold];

    /// Its name.
    pub const fn name(self) -> &'static str {
        match self {
            Medal::Bronze => "bronze",
            Medal::Silver => "silver",
            Medal::Gold => "gold",
        }
    }
}

impl Pars {
    /// The value that earns a medal.
    pub fn of(&self, medal: Medal) -> f64 {
        match medal {
            Medal::Bronze => self.bronze,
            Medal::Silver => self.silver,
            Medal::Gold => self.gold,
        }
    }

    /// The best medal that a value earns. Which way is better follows from the order of the pars.
    pub fn medal(&self, value: f64) -> Option<Medal> {
        let more_is_better = self.gold > self.bronze;
        let earns = |medal: &Medal| {
            let par = self.of(*medal);
            if more_is_better { value >= par } else { value <= par }
        };
        Medal::ALL.into_iter().rev().find(earns)
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn pars(bronze: f64, silver: f64, gold: f64) -> Pars {
        Pars {
            bronze,
            silver,
            gold,
            basis: "test".into(),
        }
    }

    #[test]
    fn a_par_itself_earns_its_medal() {
        for pars in [pars(0.85, 0.9, 0.945), pars(125.0, 84.0, 76.0)] {
            for medal in Medal::ALL {
                assert_eq!(pars.medal(pars.of(medal)), Some(medal));
            }
        }
    }

    proptest! {
        #[test]
        fn better_values_never_earn_less(a in -10.0..300.0f64, b in -10.0..300.0f64) {
            let (low, high) = (a.min(b), a.max(b));
            let less = pars(125.0, 84.0, 76.0);
            prop_assert!(less.medal(low) >= less.medal(high));
            let more = pars(10.0, 20.0, 100.0);
            prop_assert!(more.medal(high) >= more.medal(low));
        }
    }
}
