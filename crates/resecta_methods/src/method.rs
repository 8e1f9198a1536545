//! What a method is, and the list of those that are compared.

use crate::{
    methods::{
        bdf2::Bdf2, chebyshev::Chebyshev, implicit_euler::ImplicitEuler, leapfrog::Leapfrog, midpoint::Midpoint,
        rk4::Rk4, symplectic_euler::SymplecticEuler, vbd::Vbd, xpbd::Xpbd,
    },
    system::{State, System, Work},
};

/// Why a step was not made. The state is then of no use.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum StepError {
    /// A number is NaN or infinite, or a node is further out than 1e6 mm.
    #[error("the motion diverged")]
    Diverged,
    /// The equations of an implicit step were not solved.
    #[error("{corrections} Newton corrections left the equations of a step unsolved")]
    NotConverged {
        /// Corrections made.
        corrections: u32,
    },
}

/// A method with a fixed step length, at one place of one scene.
pub trait Method {
    /// Its name in reports.
    fn name(&self) -> &'static str;

    /// Order of convergence in the step length, of positions at a fixed time.
    fn order(&self) -> u32;

    /// Makes a step. State and system must be those of the last step: methods keep forces or states between steps.
    ///
    /// # Errors
    ///
    /// [`StepError`] when the motion diverged or the equations were not solved.
    fn step(&mut self, system: &System, state: &mut State, work: &mut Work) -> Result<(), StepError>;
}

/// A method that can be compared.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Choice {
    /// [`Leapfrog`].
    Leapfrog,
    /// [`SymplecticEuler`].
    SymplecticEuler,
    /// [`Rk4`].
    Rk4,
    /// [`Chebyshev`].
    Chebyshev,
    /// [`ImplicitEuler`].
    ImplicitEuler,
    /// [`Bdf2`].
    Bdf2,
    /// [`Midpoint`].
    Midpoint,
    /// [`Xpbd`] with one iteration.
    XpbdOnce,
    /// [`Xpbd`] with ten iterations.
    Xpbd10,
    /// [`Vbd`] with two iterations.
    Vbd2,
    /// [`Vbd`] with ten iterations.
    Vbd10,
}

/// Newton corrections end when one is smaller than this share of a step's movement; see [`crate::implicit`].
const TOLERANCE: f64 = 1e-2;

impl Choice {
    /// All of them, explicit ones first.
    pub const ALL: [Choice; 11] = [
        Choice::Leapfrog,
        Choice::SymplecticEuler,
        Choice::Rk4,
        Choice::Chebyshev,
        Choice::ImplicitEuler,
        Choice::Bdf2,
        Choice::Midpoint,
        Choice::XpbdOnce,
        Choice::Xpbd10,
        Choice::Vbd2,
        Choice::Vbd10,
    ];

    /// The method for a system, with steps of `step_s` seconds, above 0.
    pub fn build(self, system: &System, step_s: f64) -> Box<dyn Method> {
        match self {
            Choice::Leapfrog => Box::new(Leapfrog::new(system, step_s)),
            Choice::SymplecticEuler => Box::new(SymplecticEuler::new(system, step_s)),
            Choice::Rk4 => Box::new(Rk4::new(system, step_s)),
            Choice::Chebyshev => Box::new(Chebyshev::new(system, step_s)),
            Choice::ImplicitEuler => Box::new(ImplicitEuler::new(step_s, TOLERANCE)),
            Choice::Bdf2 => Box::new(Bdf2::new(step_s, TOLERANCE)),
            Choice::Midpoint => Box::new(Midpoint::new(step_s, TOLERANCE)),
            Choice::XpbdOnce => Box::new(Xpbd::new(system, step_s, 1)),
            Choice::Xpbd10 => Box::new(Xpbd::new(system, step_s, 10)),
            Choice::Vbd2 => Box::new(Vbd::new(system, step_s, 2)),
            Choice::Vbd10 => Box::new(Vbd::new(system, step_s, 10)),
        }
    }

    /// Passes over the springs that each step takes; none where that depends on the step or the scene.
    pub fn passes_a_step(self) -> Option<u64> {
        match self {
            Choice::Leapfrog | Choice::SymplecticEuler | Choice::XpbdOnce => Some(1),
            Choice::Rk4 | Choice::Vbd2 => Some(4),
            Choice::Xpbd10 => Some(10),
            Choice::Vbd10 => Some(20),
            Choice::Chebyshev | Choice::ImplicitEuler | Choice::Bdf2 | Choice::Midpoint => None,
        }
    }
}
