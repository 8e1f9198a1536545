//! What a kick does to velocities, with the damping integrated exactly.
//!
//! Over a time t the velocity obeys `v' = -r v + a` with constant acceleration a and rate `r = gamma / m`, so
//! `v <- e^(-r t) v + t phi(r t) a` with `phi(x) = (1 - e^(-x)) / x`.

use crate::aligned::{Aligned, CHUNK};
use crate::tissue::Nodes;
use crate::vectors::Vectors;

/// What a kick over some time does to the velocity of every node.
#[derive(Debug, Clone)]
pub(crate) struct Kick {
    /// Factor left of the velocity.
    pub decay: Aligned,
    /// Velocity gained per force, s/g.
    pub push: Aligned,
}

/// The kicks of an advance.
#[derive(Debug, Clone)]
pub(crate) struct Kicks {
    /// Over half a substep.
    pub half: Kick,
    /// Over a whole substep.
    pub whole: Kick,
    /// The substep, s, and the round of inertias that they hold for.
    made_for: (f64, u64),
}

impl Kick {
    fn zero(count: usize) -> Kick {
        Kick {
            decay: Aligned::filled(count, 0.0),
            push: Aligned::filled(count, 0.0),
        }
    }

    #[inline(always)]
    pub fn apply(&self, forces: &Vectors, velocities: &mut Vectors) {
        for (velocities, forces) in velocities.each_mut().into_iter().zip(forces.each()) {
            let count = velocities.len();
            let (decay, push, forces) = (&self.decay[..count], &self.push[..count], &forces[..count]);
            for n in 0..count {
                velocities[n] = decay[n].mul_add(velocities[n], push[n] * forces[n]);
            }
        }
    }
}

impl Kicks {
    pub fn zero(count: usize) -> Kicks {
        Kicks {
            half: Kick::zero(count),
            whole: Kick::zero(count),
            made_for: (f64::NAN, 0),
        }
    }

    /// Makes them the kicks of such substeps. `round` tells one set of inertias and dampings from another.
    #[inline(always)]
    pub fn prepare(&mut self, substep_s: f64, round: u64, nodes: &Nodes) {
        if self.made_for == (substep_s, round) {
            return;
        }
        self.made_for = (substep_s, round);
        let half_s = 0.5 * substep_s;
        let count = nodes.mass.len();
        for first in (0..count).step_by(CHUNK) {
            let chunk = first..(first + CHUNK).min(count);
            let (damping, mass) = (&nodes.damping_rate[chunk.clone()], &nodes.mass[chunk.clone()]);
            let inverse_inertia = &nodes.inverse_inertia[chunk.clone()];
            let (mut half_lost, mut phis) = ([0.0f64; CHUNK], [0.0f64; CHUNK]);
            let lanes = chunk.len();
            let mut largest = 0.0f64;
            for n in 0..lanes {
                half_lost[n] = half_s * f64::from(damping[n] * mass[n] * inverse_inertia[n]);
                largest = largest.max(half_lost[n]);
            }
            if largest <= LARGEST_OF_SERIES {
                for n in 0..lanes {
                    phis[n] = phi_series(half_lost[n]);
                }
            } else {
                for n in 0..lanes {
                    phis[n] = phi(half_lost[n]);
                }
            }
            for n in 0..lanes {
                let (decay, gain) = ((-half_lost[n]).mul_add(phis[n], 1.0), half_s * phis[n]);
                let inverse_inertia = f64::from(inverse_inertia[n]);
                self.half.decay[first + n] = decay as f32;
                self.half.push[first + n] = (gain * inverse_inertia) as f32;
                // Two halves in a row.
                self.whole.decay[first + n] = (decay * decay) as f32;
                self.whole.push[first + n] = (decay.mul_add(gain, gain) * inverse_inertia) as f32;
            }
        }
    }
}

/// Up to here [`phi_series`] is exact to 1e-10.
const LARGEST_OF_SERIES: f64 = 0.5;

/// `(1 - e^(-x)) / x`, 1 at 0.
fn phi(x: f64) -> f64 {
    if x <= LARGEST_OF_SERIES {
        phi_series(x)
    } else {
        -(-x).exp_m1() / x
    }
}

/// The series of [`phi`], `Σ (-x)^n / (n + 1)!`; plain arithmetic, for many at a time.
#[inline(always)]
fn phi_series(x: f64) -> f64 {
    const TERMS: [f64; 10] = [
        1.0,
        -1.0 / 2.0,
        1.0 / 6.0,
        -1.0 / 24.0,
        1.0 / 120.0,
        -1.0 / 720.0,
        1.0 / 5_040.0,
        -1.0 / 40_320.0,
        1.0 / 362_880.0,
        -1.0 / 3_628_800.0,
    ];
    let mut sum = 0.0;
    for n in (0..TERMS.len()).rev() {
        sum = x.mul_add(sum, TERMS[n]);
    }
    sum
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_series_and_the_exponential_agree() {
        assert_eq!(phi(0.0), 1.0);
        for n in 1..=500 {
            let x = f64::from(n) * 1e-3;
            let exact = -(-x).exp_m1() / x;
            assert!((phi_series(x) / exact - 1.0).abs() < 1e-10, "{x}");
        }
        assert!((phi(30.0) - 1.0 / 30.0).abs() < 1e-14);
    }
}
