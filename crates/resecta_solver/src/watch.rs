//! How large the error of the motion is, and what is done about it.
//!
//! A *watch* carries a second solution beside a tissue's: from the same start, under the same loads, contacts, cuts and
//! edits, but with the true masses instead of the raised inertias of `bound.rs`, and with half as long substeps. The two
//! drift apart by the error of the tissue's own solution, raised inertias included, less that of the finer one: for a method
//! of order 2 a quarter of the part that the substeps make. A watch costs as much as both solutions; a scene that watches a
//! step now and then pays little. What ends within a substep neither solution sees: in tissue so viscous that a velocity is
//! lost at once, the way it would still have gone is missing from both.
//!
//! A tissue has an *aim* for its error. When a watch ends with a larger error, the tissue puts more *effort* in: first it
//! steps with its true masses, then with shorter substeps. When the error stays far below the aim for a while, it takes a
//! part of the effort back.

use crate::tissue::{EditError, Tissue, check_range};

/// Error that a tissue aims for unless told otherwise, mm.
pub const DEFAULT_ERROR_AIM_MM: f32 = 0.01;

/// Most substeps for one that stability asks for.
const MOST_EFFORT: f64 = 16.0;

/// After so many watches in a row with an error below [`CALM`] times the aim, effort is taken back.
const CALM_WATCHES: u32 = 8;
const CALM: f64 = 0.1;

/// A solution with less error beside that of a tissue.
#[derive(Debug, Clone)]
pub(crate) struct Watch {
    finer: Box<Tissue>,
}

/// What a tissue does beyond what stability asks for.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Effort {
    /// Substeps for one that stability asks for, 1 to 16.
    pub substeps: f64,
    /// Whether every node moves by its mass, none by more.
    pub true_masses: bool,
}

/// The aim of a tissue and what it does for it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Accuracy {
    pub aim_mm: f32,
    pub effort: Effort,
    /// Watches in a row with an error far below the aim.
    calm: u32,
}

impl Accuracy {
    pub fn new() -> Accuracy {
        Accuracy {
            aim_mm: DEFAULT_ERROR_AIM_MM,
            effort: Effort {
                substeps: 1.0,
                true_masses: false,
            },
            calm: 0,
        }
    }

    /// Draws the conclusion from an error seen, mm.
    fn heed(&mut self, error_mm: f64) {
        let aim = f64::from(self.aim_mm);
        let effort = &mut self.effort;
        if error_mm.is_nan() || error_mm > aim {
            self.calm = 0;
            if effort.true_masses {
                // The error falls with the square of the substep; half the aim leaves room.
                let missing = (error_mm / (0.5 * aim)).sqrt().clamp(1.0, 4.0);
                effort.substeps = (effort.substeps * missing).min(MOST_EFFORT);
            }
            effort.true_masses = true;
        } else if error_mm > CALM * aim {
            self.calm = 0;
        } else {
            self.calm += 1;
            if self.calm >= CALM_WATCHES {
                self.calm = 0;
                effort.true_masses &= effort.substeps > 1.0;
                effort.substeps = (0.5 * effort.substeps).max(1.0);
            }
        }
    }
}

impl Tissue {
    /// The error that the tissue aims for, root mean square over the nodes, mm.
    pub fn error_aim_mm(&self) -> f32 {
        self.accuracy.aim_mm
    }

    /// Sets the aim, mm; above 0. It is met as far as watches tell.
    pub fn set_error_aim_mm(&mut self, aim_mm: f32) -> Result<(), EditError> {
        check_range(
            "tissue",
            0,
            "error_aim_mm",
            aim_mm,
            f32::MIN_POSITIVE..=f32::MAX,
            "a finite number above 0",
        )?;
        self.accuracy.aim_mm = aim_mm;
        Ok(())
    }

    /// What the tissue does for its aim at present.
    pub fn effort(&self) -> Effort {
        self.accuracy.effort
    }

    /// Begins to watch the error; a watch under way is forgotten.
    pub fn begin_watch(&mut self) {
        self.watch = None;
        let mut finer = self.clone();
        finer.make_effort(Effort {
            substeps: 2.0 * self.accuracy.effort.substeps,
            true_masses: true,
        });
        self.watch = Some(Watch { finer: Box::new(finer) });
    }

    /// The error that has come about since the watch began, root mean square over the living nodes, mm. None where there is
    /// no watch: none was begun, or its finer steps were refused.
    pub fn watched_error_mm(&self) -> Option<f64> {
        let Watch { finer } = self.watch.as_ref()?;
        let living = (0..self.node_count() as u32).filter(|&node| self.is_node_alive(node));
        let apart = |node| {
            self.precise_position(node)
                .distance_squared(finer.precise_position(node))
        };
        let sum: f64 = living.map(apart).sum();
        Some((sum / self.living.nodes.max(1) as f64).sqrt())
    }

    /// Ends the watch, and changes the effort if the error asks for it. Gives the error as [`Tissue::watched_error_mm`] does.
    pub fn end_watch(&mut self) -> Option<f64> {
        let error = self.watched_error_mm();
        self.watch = None;
        if let Some(error) = error {
            self.accuracy.heed(error);
            self.make_effort(self.accuracy.effort);
        }
        error
    }

    /// Does the same to the solution of a watch as was done to the tissue.
    pub(crate) fn watch_does<T>(&mut self, what: impl FnOnce(&mut Tissue) -> T) -> Option<T> {
        self.watch.as_mut().map(|watch| what(&mut watch.finer))
    }

    fn make_effort(&mut self, effort: Effort) {
        let inertias_change = effort.true_masses != self.accuracy.effort.true_masses;
        self.accuracy.effort = effort;
        if inertias_change {
            self.forget_inertias();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn effort_rises_with_errors_and_falls_when_it_is_not_needed() {
        let mut accuracy = Accuracy::new();
        accuracy.heed(0.02);
        assert_eq!((accuracy.effort.true_masses, accuracy.effort.substeps), (true, 1.0));
        accuracy.heed(0.02);
        assert!((accuracy.effort.substeps - 2.0).abs() < 1e-6, "{accuracy:?}");
        for _ in 0..100 {
            accuracy.heed(f64::NAN);
        }
        assert!(accuracy.effort.substeps <= MOST_EFFORT, "{accuracy:?}");
        for _ in 0..100 {
            accuracy.heed(1e-5);
        }
        assert_eq!(accuracy.effort, Accuracy::new().effort);
    }
}
