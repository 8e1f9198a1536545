//! Motion to an aim: over a long time, with an effort chosen while going.
//!
//! Time is divided into spans. In the first the tissue makes the full effort, or what frequencies [`AT_FIRST`] ask for where a
//! few springs are far stiffer than the rest, and a watch looks at its error: most errors come from what is fast, and that is
//! gone first. An aim that this does not meet is not met with softened springs: the span is made again with the full effort.
//! Later, at ever longer intervals, a solution with the least effort is carried beside for a span. What error that one makes
//! says how little effort is enough from there on. As long as less is made, a watch looks again now and then.

use crate::motion::{StepError, StepReport};
use crate::tissue::Tissue;
use crate::watch::Effort;

/// Length of a span, s: a few hundred substeps of soft tissue, and a part of its slowest swing.
const SPAN_S: f64 = 0.025;

/// Squares of frequencies stepped in the first span, over the usual one. In the lattices of glands hardly any is as high.
const AT_FIRST: f64 = 16.0;

/// Spans that the first watch lasts where springs may be softened: what that misses grows as long as the tissue creeps.
const FIRST_SPANS: u64 = 4;

/// Spans from one watch to the next while the effort is not the full one.
const SPANS_TO_WATCH: u64 = 16;

/// What an advance to an aim did.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct AimReport {
    /// All steps together; `substep_s` and `bound_s` are those of the last.
    pub steps: StepReport,
    /// The largest error seen in a span of the tissue's own motion, root mean square over the living nodes, mm; NaN where a
    /// watch could not be made.
    pub error_mm: f64,
}

impl AimReport {
    fn saw(&mut self, error_mm: f64) {
        if error_mm.is_nan() || error_mm > self.error_mm {
            self.error_mm = error_mm;
        }
    }
}

/// What is carried beside the tissue for a span.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Beside {
    Nothing,
    Finer,
    Coarser,
}

impl Tissue {
    /// Moves the tissue on by `duration_s` with as little effort as its aim allows (see [`Tissue::set_error_aim_mm`]): chooses
    /// substeps, inertias and softening itself. Nothing sleeps meanwhile; a watch under way is forgotten.
    ///
    /// # Errors
    ///
    /// As [`Tissue::advance`]; the spans before are made.
    pub fn advance_to_aim(&mut self, duration_s: f64) -> Result<AimReport, StepError> {
        let spans = (duration_s / SPAN_S).ceil().max(1.0);
        let span_s = duration_s / spans;
        let fastest_of_all = self.fastest_of_all();
        let first = if fastest_of_all > AT_FIRST {
            AT_FIRST
        } else {
            f64::INFINITY
        };
        self.set_effort(Effort {
            fastest: first,
            ..Effort::ACCURATE
        });
        let mut report = AimReport::default();
        let mut start = first.is_finite().then(|| self.clone());
        let (mut span, mut next_try, mut missed) = (0, 1, false);
        while span < spans as u64 {
            let slowed = self.effort().fastest < fastest_of_all;
            let beside = if span == 0 || missed || slowed && span.is_multiple_of(SPANS_TO_WATCH) {
                Beside::Finer
            } else if span >= next_try && self.effort() != Effort::ACCURATE {
                Beside::Coarser
            } else {
                Beside::Nothing
            };
            match beside {
                Beside::Nothing => {}
                Beside::Finer => self.begin_watch(),
                Beside::Coarser => self.carry(Effort::ACCURATE),
            }
            let length = match start {
                Some(_) if span == 0 => FIRST_SPANS.min(spans as u64),
                _ => 1,
            };
            let steps = self.advance_steps(span_s * length as f64, 1)?;
            if beside == Beside::Finer {
                let error = self.end_watch().unwrap_or(f64::NAN);
                // Where the aim was missed, the tissue has gone on from the finer solution: watched again till it is met.
                missed = error.is_nan() || error > f64::from(self.error_aim_mm());
                if let Some(start) = start.take().filter(|_| missed) {
                    // Softening is wrong for good: where the aim does not allow it, it is as if it had not been.
                    *self = start;
                    self.set_effort(Effort::FULL);
                    report.steps.substeps_repeated += steps.substeps + steps.substeps_beside;
                    continue;
                }
                report.saw(error);
            } else if beside == Beside::Coarser {
                next_try = 2 * span + 1;
                report.saw(self.lessen_effort());
            }
            report.steps.join(steps);
            span += length;
        }
        Ok(report)
    }

    /// Looks at the solution with the least effort that was carried beside, and makes as little effort as is enough from here
    /// on. Gives the error that this means, mm.
    fn lessen_effort(&mut self) -> f64 {
        let error = self.watched_error_mm();
        let Some((error, watch)) = error.zip(self.watch.take()) else {
            return 0.0;
        };
        let enough = 0.5 * f64::from(self.error_aim_mm());
        // As in `watch.rs`: the error of raised inertias falls a little faster than with the first power of the square. That of
        // softened springs follows no such law: it is small enough as it is, or it is not.
        let fastest = Effort::ACCURATE.fastest * (error / enough).max(1.0);
        let is_known = error <= enough || watch.other.softened_springs() == 0;
        if is_known && fastest < self.effort().fastest.min(self.fastest_of_all()) {
            self.set_effort(Effort {
                fastest,
                ..Effort::ACCURATE
            });
            return error.min(enough);
        }
        0.0
    }
}
