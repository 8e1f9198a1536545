//! What guidance fades with which score.

use resecta_scenario::Medal;

/// How much of each part is shown, as opacity from 0 (not at all) to 1.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Parts {
    /// Names of what is in view, and the mark of the next bleeder.
    pub landmarks: f32,
    /// Slice at the loop, row of slices, map.
    pub slice: f32,
    /// Distances from the loop.
    pub distances: f32,
    /// Whether a distance is shown only where it is small.
    pub only_near: bool,
}

impl Parts {
    /// All of it.
    pub const ALL: Parts = Parts {
        landmarks: 1.0,
        slice: 1.0,
        distances: 1.0,
        only_near: false,
    };
    /// None of it.
    pub const NONE: Parts = Parts {
        landmarks: 0.0,
        slice: 0.0,
        distances: 0.0,
        only_near: false,
    };
}

/// Shares of an exercise's points from which a run counts as bronze, silver and gold here: totals of 300 that studies of another
/// simulator report, residents on their first try 196, faculty on theirs 257, residents on their fifth 298. Exercises of this
/// game differ from theirs; only the order matters.
const SHARES: [(Medal, f64); 3] = [
    (Medal::Bronze, 196.0 / 300.0),
    (Medal::Silver, 257.0 / 300.0),
    (Medal::Gold, 298.0 / 300.0),
];

/// What is shown to a player whose best run of the exercise reached this share of its points (none: never played).
///
/// | best run | names of landmarks, mark of the next bleeder | slice, row, map | distances |
/// |---|---|---|---|
/// | none, or below bronze | full | full | full |
/// | bronze | 0.6 | 0.6 | full |
/// | silver | none | 0.35 | full |
/// | gold | none | none | only where they are small |
///
/// Knowing where one is comes first and is what a player learns first; what warns of the capsule goes last, and never wholly.
pub fn by_skill(best: Option<f64>) -> Parts {
    let earned = |(_, share): &&(Medal, f64)| best.is_some_and(|best| best >= *share);
    let medal = SHARES.iter().rev().find(earned).map(|(medal, _)| *medal);
    let (landmarks, slice) = match medal {
        None => (1.0, 1.0),
        Some(Medal::Bronze) => (0.6, 0.6),
        Some(Medal::Silver) => (0.0, 0.35),
        Some(Medal::Gold) => (0.0, 0.0),
    };
    Parts {
        landmarks,
        slice,
        distances: 1.0,
        only_near: medal == Some(Medal::Gold),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn newcomers_see_all_of_it() {
        for best in [None, Some(0.0), Some(0.65), Some(f64::NAN)] {
            assert_eq!(by_skill(best), Parts::ALL, "{best:?}");
        }
    }

    #[test]
    fn the_better_the_best_run_the_less_is_shown_and_every_medal_takes_something() {
        let steps: Vec<Parts> = (0..=1000)
            .map(|step| by_skill(Some(f64::from(step) / 1000.0)))
            .collect();
        for pair in steps.windows(2) {
            let [less, more] = pair else { continue };
            assert!(
                more.landmarks <= less.landmarks && more.slice <= less.slice,
                "{less:?} {more:?}"
            );
            assert!(more.only_near || !less.only_near, "{less:?} {more:?}");
        }
        let mut kinds = steps.clone();
        kinds.dedup();
        assert_eq!(kinds.len(), 4);
    }

    #[test]
    fn the_capsule_is_always_warned_of() {
        assert!((0..=100).all(|step| by_skill(Some(f64::from(step) / 100.0)).distances == 1.0));
    }
}
