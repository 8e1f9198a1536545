//! The equations that one stage of an implicit method poses, and how they are solved.
//!
//! Backward Euler, BDF2 and the implicit midpoint rule all ask for velocities u with
//! `(m + s gamma) u = m w + s F(x + s u)`: a step of backward Euler of length s from positions x and velocities w, which
//! differ between the methods. With K positive semidefinite u is where `(m + s gamma) u² / 2 - m w u + E(x + s u)` is least.
//! Newton's method with the stiffness of [`crate::stiffness`], its linear equations by conjugate gradients to 1 % (inexact
//! Newton: Dembo, Eisenstat and Steihaug 1982); a correction that raises both the residual and that sum is halved.

use glam::DVec3;

use crate::{
    conjugate::{ConjugateGradients, Operator, dot},
    method::StepError,
    stiffness::Stiffness,
    system::{State, System, Work},
};

/// Newton corrections after which a stage is given up.
const MOST_CORRECTIONS: u32 = 60;
/// Halvings of a correction after which a stage is given up.
const MOST_HALVINGS: u32 = 12;
/// Tolerance of the linear equations.
const LINEAR_TOLERANCE: f64 = 1e-2;
/// A correction that moves nodes by less than this, mm RMS, is the last in any case.
const LEAST_MOVE: f64 = 1e-10;

/// Solves stages; keeps its arrays between them.
#[derive(Debug, Clone, Default)]
pub struct Stage {
    tolerance: f64,
    stiffness: Stiffness,
    gradients: ConjugateGradients,
    diagonal: Vec<f64>,
    places: Vec<DVec3>,
    forces: Vec<DVec3>,
    residual: Vec<DVec3>,
    correction: Vec<DVec3>,
    trial: Vec<DVec3>,
}

impl Stage {
    /// Corrections end when one moves the nodes by less than `tolerance` (0 to 1) times what the stage moves them, RMS. As
    /// each correction leaves some hundredth of the one before, the error left is about `tolerance / 100` of the movement.
    pub fn new(tolerance: f64) -> Stage {
        Stage {
            tolerance,
            ..Stage::default()
        }
    }

    /// Solves a stage of length `length_s` from `base`; `velocities` holds the guess, and the solution afterwards.
    ///
    /// # Errors
    ///
    /// [`StepError::Diverged`] on NaN, [`StepError::NotConverged`] when 60 corrections or 12 halvings of one do not do.
    pub fn solve(
        &mut self,
        system: &System,
        length_s: f64,
        base: &State,
        velocities: &mut Vec<DVec3>,
        work: &mut Work,
    ) -> Result<(), StepError> {
        let inertia = system.masses.iter().zip(&system.damping);
        self.diagonal.clear();
        self.diagonal
            .extend(inertia.map(|(mass, damping)| mass + length_s * damping));
        let mut norm = self.measure(system, length_s, base, velocities, work);
        for corrections in 0..MOST_CORRECTIONS {
            if !norm.is_finite() {
                return Err(StepError::Diverged);
            }
            self.stiffness.linearise(system, &self.places, work);
            let operator = Operator {
                system,
                stiffness: &self.stiffness,
                diagonal: &self.diagonal,
                square: length_s * length_s,
            };
            self.gradients
                .solve(operator, &self.residual, &mut self.correction, LINEAR_TOLERANCE, work);
            let correction = rms(&self.correction);
            self.set_trial(velocities, 1.0);
            if correction <= self.tolerance * rms(&self.trial) || length_s * correction <= LEAST_MOVE {
                std::mem::swap(velocities, &mut self.trial);
                return Ok(());
            }
            norm = self
                .search(system, length_s, base, velocities, norm, work)
                .ok_or(StepError::NotConverged {
                    corrections: corrections + 1,
                })?;
        }
        Err(StepError::NotConverged {
            corrections: MOST_CORRECTIONS,
        })
    }

    /// Takes the correction, halved until the residual or the potential does not rise. The norm of the residual after it.
    fn search(
        &mut self,
        system: &System,
        length_s: f64,
        base: &State,
        velocities: &mut Vec<DVec3>,
        before: f64,
        work: &mut Work,
    ) -> Option<f64> {
        let mut potential = None;
        let mut share = 1.0;
        for _ in 0..MOST_HALVINGS {
            self.set_trial(velocities, share);
            let trial = std::mem::take(&mut self.trial);
            let norm = self.measure(system, length_s, base, &trial, work);
            let falls = norm <= before || {
                let after = self.potential(system, length_s, base, &trial, work);
                after <= *potential.get_or_insert_with(|| self.potential(system, length_s, base, velocities, work))
            };
            self.trial = trial;
            if falls {
                std::mem::swap(velocities, &mut self.trial);
                return Some(norm);
            }
            share *= 0.5;
        }
        None
    }

    fn set_trial(&mut self, velocities: &[DVec3], share: f64) {
        self.trial.clear();
        let pairs = velocities.iter().zip(&self.correction);
        self.trial
            .extend(pairs.map(|(velocity, correction)| *velocity + *correction * share));
    }

    /// Places, forces and residual `m w + s F - (m + s gamma) u` for these velocities; the residual's norm, squared.
    fn measure(&mut self, system: &System, length_s: f64, base: &State, velocities: &[DVec3], work: &mut Work) -> f64 {
        self.places.clear();
        let pairs = base.positions.iter().zip(velocities);
        self.places
            .extend(pairs.map(|(place, velocity)| *place + *velocity * length_s));
        self.forces.resize(system.node_count(), DVec3::ZERO);
        system.forces(&self.places, &mut self.forces, work);
        self.residual.clear();
        self.residual.extend((0..system.node_count()).map(|node| {
            base.velocities[node] * system.masses[node] + self.forces[node] * length_s
                - velocities[node] * self.diagonal[node]
        }));
        system.hold(&mut self.residual);
        let weighed = self.residual.iter().zip(&self.diagonal);
        weighed
            .map(|(residual, diagonal)| residual.length_squared() / diagonal)
            .sum()
    }

    fn potential(&self, system: &System, length_s: f64, base: &State, velocities: &[DVec3], work: &mut Work) -> f64 {
        let pairs = base.positions.iter().zip(velocities);
        let places: Vec<DVec3> = pairs.map(|(place, velocity)| *place + *velocity * length_s).collect();
        let inertial: f64 = (0..velocities.len())
            .map(|node| {
                let velocity = velocities[node];
                0.5 * self.diagonal[node] * velocity.length_squared()
                    - system.masses[node] * base.velocities[node].dot(velocity)
            })
            .sum();
        inertial + system.potential(&places, work)
    }
}

fn rms(vectors: &[DVec3]) -> f64 {
    (dot(vectors, vectors) / vectors.len().max(1) as f64).sqrt()
}
