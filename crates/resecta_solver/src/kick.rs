//! What a kick does to velocities, with the damping integrated exactly.
//!
//! Over a time t the velocity obeys `v' = -r v + a` with constant acceleration a and rate `r = gamma / m`, so
//! `v <- e^(-r t) v + t phi(r t) a` with `phi(x) = (1 - e^(-x)) / x`.

use std::ops::Range;

use fearless_simd::Simd;

use crate::sites::{LANES, Lanes, Sites};
use crate::tissue::Nodes;
use crate::vectors::{Registers, SiteVectors, Vectors, load};

/// What a kick over some time does to the velocities of a site.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Kick {
    /// Factor left of the velocity.
    pub decay: Lanes,
    /// Velocity gained per force, s/g.
    pub push: Lanes,
}

/// The kicks of an advance, by site.
#[derive(Debug, Clone)]
pub(crate) struct Kicks {
    /// Over half a substep.
    pub half: Vec<Kick>,
    /// Over a whole substep.
    pub whole: Vec<Kick>,
    /// The substep, s, and the round of inertias that they hold for.
    made_for: (f64, u64),
    sites: Sites,
}

impl Kick {
    /// The velocities after it.
    #[inline(always)]
    pub fn applied<S: Simd>(&self, simd: S, velocities: &SiteVectors, forces: &SiteVectors) -> Registers<S> {
        let gained = Registers::load(simd, forces).times(load(simd, &self.push));
        Registers::load(simd, velocities).times_plus(load(simd, &self.decay), gained)
    }
}

impl Kicks {
    pub fn zero(sites: Sites) -> Kicks {
        let kicks = vec![Kick::default(); sites.count()];
        Kicks {
            half: kicks.clone(),
            whole: kicks,
            made_for: (f64::NAN, 0),
            sites,
        }
    }

    /// Lets no force move a node.
    pub fn stop(&mut self, node: u32) {
        let (site, lane) = self.sites.place(node);
        for kicks in [&mut self.half, &mut self.whole] {
            kicks[site].push.0[lane] = 0.0;
        }
    }

    /// Velocity that a node gains per force in a whole substep, s/g.
    pub fn whole_push(&self, node: u32) -> f32 {
        let (site, lane) = self.sites.place(node);
        self.whole[site].push.0[lane]
    }

    /// Half a kick for some sites.
    #[inline(always)]
    pub fn apply_half<S: Simd>(&self, simd: S, sites: Range<usize>, forces: &Vectors, velocities: &mut Vectors) {
        let (kicks, forces) = (&self.half[sites.clone()], &forces.values[sites.clone()]);
        for ((kick, forces), velocities) in kicks.iter().zip(forces).zip(&mut velocities.values[sites]) {
            *velocities = kick.applied(simd, velocities, forces).stored();
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
        for site in 0..self.half.len() {
            let (damping, mass) = (&nodes.damping_rate.values[site].0, &nodes.mass.values[site].0);
            let inverse_inertia = &nodes.inverse_inertia.values[site].0;
            let (half, whole) = (&mut self.half[site], &mut self.whole[site]);
            let (mut half_lost, mut phis) = ([0.0f64; LANES], [0.0f64; LANES]);
            let mut largest = 0.0f64;
            for n in 0..LANES {
                half_lost[n] = half_s * f64::from(damping[n] * mass[n] * inverse_inertia[n]);
                largest = largest.max(half_lost[n]);
            }
            if largest <= LARGEST_OF_SERIES {
                for n in 0..LANES {
                    phis[n] = phi_series(half_lost[n]);
                }
            } else {
                for n in 0..LANES {
                    phis[n] = phi(half_lost[n]);
                }
            }
            for n in 0..LANES {
                let (decay, gain) = ((-half_lost[n]).mul_add(phis[n], 1.0), half_s * phis[n]);
                let inverse_inertia = f64::from(inverse_inertia[n]);
                half.decay.0[n] = decay as f32;
                half.push.0[n] = (gain * inverse_inertia) as f32;
                // Two halves in a row.
                whole.decay.0[n] = (decay * decay) as f32;
                whole.push.0[n] = (decay.mul_add(gain, gain) * inverse_inertia) as f32;
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
