//! How large the error of the motion is, and what is done about it.
//!
//! A tissue makes an *effort*: how far its frequencies may be held down by raised inertias (`bound.rs`) and softened springs
//! (`soften.rs`), and how many substeps it makes for one that stability asks for. It has an *aim* for its error.
//!
//! A *watch* carries a second solution beside a tissue's: from the same start, under the same loads, contacts, cuts and
//! edits, but with an effort that allows twice the frequencies and four times the stiffness, or else half as long substeps.
//! The two drift apart by the error of the tissue's own solution, less that of the finer one: for a method of order 2 a
//! quarter of the part that the substeps make. A watch costs about twice as much as the steps it watches, three times with
//! them; a scene that watches a step now and then pays little. What ends within a substep neither solution sees: in tissue so
//! viscous that a velocity is lost at once, the way it would still have gone is missing from both.
//!
//! A watch may be dropped: its error is then told, and nothing done. When one ends with an error above the aim, the tissue goes on
//! from where the finer solution is, and puts more effort in: it allows higher frequencies till nothing is held down, then makes
//! shorter substeps. When the error stays far below the aim for a while, it takes a part of the effort back.

use crate::bound::Usual;
use crate::tissue::{EditError, Tissue, check_range};

/// Error that a tissue aims for unless told otherwise, mm.
pub const DEFAULT_ERROR_AIM_MM: f32 = 0.01;

/// Most substeps for one that stability asks for.
const MOST_EFFORT: f64 = 16.0;

/// After so many watches in a row with an error below [`CALM`] times the aim, effort is taken back.
const CALM_WATCHES: u32 = 8;
const CALM: f64 = 0.1;

/// Squares of frequencies are held down to at most this many times the usual one. By measurement on the lattice of the
/// papers' size (10,800 nodes) after a dozen cuts, this saves three of five substeps that the masses would ask for (half of
/// them with diagonals), and the error over 1/60 s is 8e-3 mm RMS (3e-4 mm with diagonals): `resecta rates` prints it for
/// every lattice.
const ACCURATE_FASTEST: f64 = 1.25;

/// The same where speed matters more, in tissue of [`FAST_MODULUS_PA`]. Every node then has several times its mass, and moves as slowly as
/// tissue so viscous does anyway. Half of it would save 15 % and moves the surface no further (docs/accuracy/budget.md), but tissue then
/// resists the arms of a loop that goes out quickly so much that one of them pierces it (`tests/pictures.rs`).
const FAST_FASTEST: f64 = 0.12;
/// That of `palpation_5hz`, Pa.
const FAST_MODULUS_PA: f64 = 4_610.0;
/// The most of it, in tissue however soft: well below 1, above which nothing damps what rings.
const MOST_FAST_FASTEST: f64 = 0.5;

/// Substeps for one that stability asks for: tools squeeze tissue within a step, and one that outran its bound is made again.
const FAST_SUBSTEPS: f64 = 1.1;

/// The least that may be asked for: far below it tissue is slower than any hand.
const LEAST_FASTEST: f64 = 0.01;

/// Nodes are softened down to at least this many times the usual stiffness (`soften.rs`). Measured on a shell 10,000 times
/// stiffer inside the common scene of 10,800 nodes (moved 0.52 mm RMS after 0.1 s): 5, 10, 20 and 100 times all miss the true
/// motion by 0.065 to 0.067 mm, 2 times by 0.078 mm, not at all stiffer by 0.088 mm; each step up costs 1.4 times the
/// substeps.
const LEAST_STIFFEST: f64 = 10.0;

/// A second solution beside that of a tissue.
#[derive(Debug, Clone)]
pub(crate) struct Watch {
    pub other: Box<Tissue>,
}

/// What a tissue does for its accuracy.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Effort {
    /// The largest square of a frequency that is stepped, over the usual one (the median of the nodes as built): 0.01 and up.
    /// Infinite: every node moves by its mass, every spring has its stiffness. Otherwise what is faster is slowed down, by
    /// more inertia and, where springs are far stiffer than usual, by less stiffness. Below 1 even the usual node is; then tissue
    /// has internal viscosity besides (`viscosity.rs`), without which it would ring.
    pub fastest: f64,
    /// To what slower springs may be softened: how stiffly a node is held, over the usual; 10 and up.
    pub stiffest: f64,
    /// Substeps for one that stability asks for, 1 to 16.
    pub substeps: f64,
}

impl Effort {
    /// What a tissue built from pentahedra starts with.
    pub const ACCURATE: Effort = Effort {
        fastest: ACCURATE_FASTEST,
        stiffest: LEAST_STIFFEST,
        substeps: 1.0,
    };
    /// Nothing is slowed down: what nodes and springs alone start with.
    pub const FULL: Effort = Effort {
        fastest: f64::INFINITY,
        stiffest: f64::INFINITY,
        substeps: 1.0,
    };

    /// Few substeps, each of which errs by some hundredths of a millimetre, in tissue of such a modulus, Pa, above 0: for scenes that are to
    /// run in real time. From 1.1 to 55 kPa the highest frequency is the same, and so is the number of substeps but for what the medium damps:
    /// stiffer tissue gets more inertia instead, for its own frequencies are too high for a hand to feel. Beyond, substeps go with the root of
    /// the modulus.
    pub fn fast(modulus_pa: f64) -> Effort {
        let fastest = FAST_FASTEST * (FAST_MODULUS_PA / modulus_pa);
        Effort {
            fastest: fastest.clamp(LEAST_FASTEST, MOST_FAST_FASTEST),
            stiffest: LEAST_STIFFEST,
            substeps: FAST_SUBSTEPS,
        }
    }

    /// Whether nodes exchange velocity: see [`Effort::fastest`].
    pub(crate) fn is_viscous(&self) -> bool {
        self.fastest < 1.0
    }

    /// So many times the frequencies and stiffnesses, squared; all of them where that is more than there are.
    fn times(self, factor: f64, fastest_of_all: f64) -> Effort {
        let fastest = factor * self.fastest;
        if fastest < fastest_of_all {
            Effort {
                fastest,
                stiffest: factor * self.stiffest,
                ..self
            }
        } else {
            Effort {
                substeps: self.substeps,
                ..Effort::FULL
            }
        }
    }

    /// The effort of a watch: frequencies twice as high, or else substeps half as long.
    fn finer(self, fastest_of_all: f64) -> Effort {
        let finer = self.times(4.0, fastest_of_all);
        if finer.fastest.is_finite() {
            return finer;
        }
        Effort {
            // Where letting go of the frequencies halves the substeps by itself, that is enough.
            substeps: self.substeps * (2.0 / (fastest_of_all / self.fastest).sqrt()).clamp(1.0, 2.0),
            ..finer
        }
    }

    /// More, for an error so many times what it should be.
    fn raised(self, missing: f64, fastest_of_all: f64) -> Effort {
        if self.fastest < fastest_of_all {
            // By measurement the error falls a little faster than with the first power of the square.
            self.times(missing.clamp(2.0, 16.0), fastest_of_all)
        } else {
            // With the square of the substep.
            let substeps = self.substeps * missing.sqrt().clamp(1.0, 4.0);
            Effort {
                substeps: substeps.min(MOST_EFFORT),
                ..Effort::FULL
            }
        }
    }

    /// Less, by a step, but no less than a base.
    fn lowered(self, usual: Option<Usual>, base: Effort) -> Effort {
        if self.substeps > base.substeps {
            return Effort {
                substeps: (0.5 * self.substeps).max(base.substeps),
                ..self
            };
        }
        let half = |value: f64, of_all: fn(Usual) -> f32, least: f64| {
            let of_all = usual.map_or(1.0, |usual| f64::from(of_all(usual)));
            (0.5 * value.min(of_all)).max(least)
        };
        Effort {
            fastest: half(self.fastest, |usual| usual.fastest, base.fastest),
            stiffest: half(self.stiffest, |usual| usual.stiffest, base.stiffest),
            ..self
        }
    }
}

/// The aim of a tissue and what it does for it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Accuracy {
    pub aim_mm: f32,
    pub effort: Effort,
    /// The effort that was asked for: watches add to it and take that back.
    base: Effort,
    /// Watches in a row with an error far below the aim.
    calm: u32,
}

impl Accuracy {
    pub fn new() -> Accuracy {
        Accuracy {
            aim_mm: DEFAULT_ERROR_AIM_MM,
            effort: Effort::ACCURATE,
            base: Effort::ACCURATE,
            calm: 0,
        }
    }

    /// Draws the conclusion from an error seen, mm. Says whether it is above the aim.
    fn heed(&mut self, error_mm: f64, usual: Option<Usual>) -> bool {
        let aim = f64::from(self.aim_mm);
        let missed = error_mm.is_nan() || error_mm > aim;
        if missed {
            self.calm = 0;
            // Half the aim leaves room.
            let missing = if error_mm.is_nan() {
                f64::INFINITY
            } else {
                error_mm / (0.5 * aim)
            };
            self.effort = self.effort.raised(missing, fastest_of_all(usual));
        } else if error_mm > CALM * aim {
            self.calm = 0;
        } else {
            self.calm += 1;
            if self.calm >= CALM_WATCHES {
                self.calm = 0;
                self.effort = self.effort.lowered(usual, self.base);
            }
        }
        missed
    }
}

fn fastest_of_all(usual: Option<Usual>) -> f64 {
    usual.map_or(ACCURATE_FASTEST, |usual| f64::from(usual.fastest).max(ACCURATE_FASTEST))
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

    /// Sets what it does for its aim at least: watches add to it and take that back. Where either number is out of its range, the nearest is taken.
    pub fn set_effort(&mut self, effort: Effort) {
        self.change_effort(effort);
        self.accuracy.base = self.accuracy.effort;
    }

    fn change_effort(&mut self, effort: Effort) {
        let within = |value: f64, least: f64, most: f64| if value >= least { value.min(most) } else { least };
        let effort = Effort {
            fastest: within(effort.fastest, LEAST_FASTEST, f64::INFINITY),
            stiffest: within(effort.stiffest, LEAST_STIFFEST, f64::INFINITY),
            substeps: within(effort.substeps, 1.0, MOST_EFFORT),
        };
        let before = self.accuracy.effort;
        let weighs_anew = (effort.fastest, effort.stiffest) != (before.fastest, before.stiffest);
        self.accuracy.effort = effort;
        if weighs_anew {
            self.forget_inertias();
        }
    }

    /// Begins to watch the error; a watch under way is forgotten.
    pub fn begin_watch(&mut self) {
        let other = Box::new(self.finer());
        self.watch = Some(Watch { other });
    }

    /// Begins to carry a second solution with that effort.
    pub(crate) fn carry(&mut self, effort: Effort) {
        self.watch = None;
        let other = Box::new(self.with_effort(effort));
        self.watch = Some(Watch { other });
    }

    fn with_effort(&self, effort: Effort) -> Tissue {
        let mut other = self.clone();
        other.watch = None;
        other.set_effort(effort);
        other
    }

    /// A tissue that from here on is closer to the truth. What a watch carries, for whoever advances it elsewhere.
    pub fn finer(&self) -> Tissue {
        self.with_effort(self.effort().finer(self.fastest_of_all()))
    }

    /// The largest square of a frequency there is, over the usual one, as built; at least 1.25.
    pub(crate) fn fastest_of_all(&self) -> f64 {
        fastest_of_all(self.usual)
    }

    /// The error that has come about since the watch began, root mean square over the living nodes, mm. None where there is
    /// no watch: none was begun, or its steps were refused.
    pub fn watched_error_mm(&self) -> Option<f64> {
        let Watch { other } = self.watch.as_ref()?;
        Some(self.apart_mm(other))
    }

    /// How far the living nodes are from those of another tissue of as many nodes, root mean square, mm.
    pub fn apart_mm(&self, other: &Tissue) -> f64 {
        let living = (0..self.node_count() as u32).filter(|&node| self.is_node_alive(node));
        let apart = |node| {
            self.precise_position(node)
                .distance_squared(other.precise_position(node))
        };
        let sum: f64 = living.map(apart).sum();
        (sum / self.living.nodes.max(1) as f64).sqrt()
    }

    /// Ends the watch. Where the error is above the aim, the tissue goes on from the finer solution with more effort. Gives
    /// the error as [`Tissue::watched_error_mm`] does.
    pub fn end_watch(&mut self) -> Option<f64> {
        let error = self.watched_error_mm();
        let watch = self.watch.take();
        if let Some((error, watch)) = error.zip(watch)
            && self.heed_error(error)
        {
            self.go_on_from(&watch.other);
        }
        error
    }

    /// Ends the watch and does nothing about the error, which it gives as [`Tissue::watched_error_mm`] does: the tissue goes on as if it
    /// had not been watched.
    pub fn drop_watch(&mut self) -> Option<f64> {
        let error = self.watched_error_mm();
        self.watch = None;
        error
    }

    /// Changes the effort if an error that was watched asks for it, mm. Says whether it is above the aim.
    pub fn heed_error(&mut self, error_mm: f64) -> bool {
        let before = self.accuracy.effort;
        let missed = self.accuracy.heed(error_mm, self.usual);
        let effort = std::mem::replace(&mut self.accuracy.effort, before);
        self.change_effort(effort);
        missed
    }

    /// Takes over where the nodes of another solution of the same tissue are and how they move, unless other nodes have been
    /// put aside there.
    pub fn go_on_from(&mut self, other: &Tissue) {
        if other.nodes.put_aside != self.nodes.put_aside {
            return;
        }
        self.motion.copy_from(&other.motion);
        self.motion_version += 1;
        self.sleep.wake_all();
        self.forget_bound();
    }

    /// Does the same to the solution of a watch as was done to the tissue.
    pub(crate) fn watch_does<T>(&mut self, what: impl FnOnce(&mut Tissue) -> T) -> Option<T> {
        self.watch.as_mut().map(|watch| what(&mut watch.other))
    }
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;
    use crate::{Material, TissueMesh};

    const USUAL: Usual = Usual {
        stiffness: 1.0,
        square: 1.0,
        fastest: 8.0,
        stiffest: 4.0,
    };

    #[test]
    fn effort_rises_with_errors_and_falls_when_it_is_not_needed() {
        let (mut accuracy, usual) = (Accuracy::new(), Some(USUAL));
        assert!(accuracy.heed(0.02, usual));
        assert!((accuracy.effort.fastest - 5.0).abs() < 1e-6, "{accuracy:?}");
        assert!((accuracy.effort.stiffest - 40.0).abs() < 1e-5, "{accuracy:?}");
        accuracy.heed(0.02, usual);
        assert_eq!(accuracy.effort, Effort::FULL);
        accuracy.heed(0.02, usual);
        assert!((accuracy.effort.substeps - 2.0).abs() < 1e-6, "{accuracy:?}");
        for _ in 0..100 {
            accuracy.heed(f64::NAN, usual);
        }
        assert!(accuracy.effort.substeps <= MOST_EFFORT, "{accuracy:?}");
        for _ in 0..100 {
            assert!(!accuracy.heed(1e-5, usual));
        }
        assert_eq!(accuracy.effort, Effort::ACCURATE);
    }

    #[test]
    fn a_watch_has_at_least_half_the_substep() {
        // Substeps for one of an effort that slows nothing: by the root of the squares, times those made besides.
        let cost = |effort: Effort, of_all: f64| effort.substeps * effort.fastest.min(of_all).sqrt();
        let some = Effort {
            fastest: 3.0,
            ..Effort::ACCURATE
        };
        for of_all in [1.25, 2.0, 5.0, 30.0, 1e4] {
            for effort in [Effort::fast(FAST_MODULUS_PA), Effort::ACCURATE, some, Effort::FULL] {
                let ratio = cost(effort.finer(of_all), of_all) / cost(effort, of_all);
                assert!((2.0 - 1e-9..2.9).contains(&ratio), "{effort:?} {of_all}: {ratio}");
            }
        }
    }

    #[test]
    fn a_fast_effort_costs_the_same_whatever_the_modulus() {
        let positions = (0..10)
            .flat_map(|n| [[0.0, 0.0], [0.0, 2.0], [2.0, 0.0]].map(|[x, y]| DVec3::new(x, y, 1.5 * f64::from(n))));
        let pentahedra = (0..9).map(|n| [0, 1, 2, 3, 4, 5].map(|corner| 3 * n + corner));
        let mesh = TissueMesh::from_pentahedra(positions.collect(), pentahedra.collect());
        let bound_s = |modulus_pa: f64| {
            let material = Material {
                modulus_pa,
                poisson_ratio: Some(0.45),
                // A medium that damps lengthens steps, the more the lighter the nodes are.
                viscosity_pa_s: 0.0,
                ..Material::default()
            };
            let mut tissue = Tissue::new(&mesh, &material).expect("prisms are a tissue");
            tissue.set_effort(Effort::fast(modulus_pa));
            tissue.bound_s()
        };
        let soft = bound_s(FAST_MODULUS_PA);
        for modulus_pa in [2_000.0, 13_200.0, 24_800.0] {
            let ratio = bound_s(modulus_pa) / soft;
            assert!((ratio - 1.0).abs() < 1e-3, "{modulus_pa} Pa: {ratio}");
        }
    }
}
