//! Internal viscosity: nodes that a spring joins lose velocity against each other.
//!
//! Between kick and drift of a substep each velocity goes part of the way to the mean of its neighbours':
//!
//! ```text
//! v_i <- v_i + Σ_j w_ij (v_j - v_i) / M_i        w_ij = min(M_i / d_i, M_j / d_j) / 2
//! ```
//!
//! over the living springs of node i, d_i of them, with the inertias M. The exchange is symmetric, so momentum stays. Its rows sum to at
//! most half of an inertia, so that no wave changes its sign: what it does is what an implicit viscous force would do, and it
//! makes no step unstable that is stable without it.

use fearless_simd::{Simd, f32x8, prelude::*};

use crate::runs::{Run, with_turn};
use crate::sites::{LANES, Lanes, Sites};
use crate::springs::{Springs, gather};
use crate::vectors::{Registers, Scalars, SiteVectors, Vectors, load};

/// Arrays for the exchange of velocities.
#[derive(Debug, Clone)]
pub(crate) struct Viscosity {
    /// Half of a node's inertia over the number of its springs, g; very large for one that does not move.
    shares: Scalars,
    sums: Vectors,
    /// Living springs of each node, and the version of the springs that were counted.
    counts: Scalars,
    counted: Option<u64>,
}

/// What a node that does not move lends its springs, g: more than any that moves.
const UNMOVED: f32 = 1e30;

impl Viscosity {
    pub fn new(sites: Sites) -> Viscosity {
        Viscosity {
            shares: Scalars::zero(sites),
            sums: Vectors::zero(sites),
            counts: Scalars::zero(sites),
            counted: None,
        }
    }

    /// Makes it ready for inertias and springs as they are.
    pub fn prepare(&mut self, springs: &Springs, inverse_inertia: &Scalars) {
        let version = Some(springs.presence_version());
        if self.counted != version {
            self.counted = version;
            self.count(springs);
        }
        let all = self
            .shares
            .values
            .iter_mut()
            .zip(&self.counts.values)
            .zip(&inverse_inertia.values);
        for ((share, count), inverse) in all {
            for n in 0..LANES {
                let moves = inverse.0[n] > 0.0;
                share.0[n] = if moves {
                    0.5 / (inverse.0[n] * count.0[n].max(1.0))
                } else {
                    UNMOVED
                };
            }
        }
    }

    fn count(&mut self, springs: &Springs) {
        self.counts.values.fill(Lanes::default());
        for (spring, ends) in (0u32..).zip(&springs.nodes) {
            if springs.stepped_stiffness(spring) > 0.0 {
                ends.iter()
                    .for_each(|&end| self.counts.set(end, self.counts.at(end) + 1.0));
            }
        }
    }

    /// Lets the nodes exchange velocity once.
    #[inline(always)]
    pub fn apply<S: Simd>(&mut self, simd: S, springs: &Springs, inverse_inertia: &Scalars, velocities: &mut Vectors) {
        self.sums.values.fill(SiteVectors::default());
        for block in springs.layout().blocks() {
            for run in springs.layout().runs(block) {
                with_turn!(run.turn, self.add_run(simd, run, springs, velocities));
            }
            for loose in springs.layout().loose(block) {
                let [a, b] = gather(loose, velocities.view());
                let stiffness = &springs.loose_bundle(loose).stiffness;
                for (lane, &[low, high]) in loose.ends.iter().enumerate() {
                    if stiffness.0[lane] > 0.0 {
                        let weight = self.shares.at(low).min(self.shares.at(high));
                        let of =
                            |vectors: &SiteVectors| glam::Vec3::from_array(vectors.map(|component| component.0[lane]));
                        let lost = (of(&b) - of(&a)) * weight;
                        self.sums.add(low, lost);
                        self.sums.add(high, -lost);
                    }
                }
            }
        }
        let all = velocities
            .values
            .iter_mut()
            .zip(&self.sums.values)
            .zip(&inverse_inertia.values);
        for ((velocity, sum), inverse) in all {
            let now = Registers::load(simd, sum).times_plus(load(simd, inverse), Registers::load(simd, velocity));
            *velocity = now.stored();
        }
    }

    #[inline(always)]
    fn add_run<const TURN: usize, const BACK: usize, S: Simd>(
        &mut self,
        simd: S,
        run: &Run,
        springs: &Springs,
        velocities: &Vectors,
    ) {
        let bundles = springs.bundles(run);
        let ends = [run.low, run.low + run.span];
        let [lows, highs] = ends.map(|first| &velocities.values[first..][..bundles.len()]);
        let [low_shares, high_shares] = ends.map(|first| &self.shares.values[first..][..bundles.len()]);
        let [low_sums, high_sums] = self.sums.shared(ends, bundles.len());
        let zero = f32x8::splat(simd, 0.0);
        for n in 0..bundles.len() {
            let (low, high) = (Registers::load(simd, &lows[n]), Registers::load(simd, &highs[n]));
            let high_share = load(simd, &high_shares[n]);
            let high_share = if TURN == 0 {
                high_share
            } else {
                high_share.slide::<TURN>(high_share)
            };
            let share = load(simd, &low_shares[n]).min(high_share);
            let weight = load(simd, &bundles[n].stiffness).simd_gt(zero).select(share, zero);
            let exchanged = (high.turned::<TURN>() - low).times(weight);
            let sum = Registers::load(simd, &low_sums[n].get());
            low_sums[n].set((sum + exchanged).stored());
            let sum = Registers::load(simd, &high_sums[n].get());
            high_sums[n].set((sum - exchanged.turned::<BACK>()).stored());
        }
    }
}
