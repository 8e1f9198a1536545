//! Two sites abreast, where registers hold sixteen numbers.
//!
//! The vectors of two neighbouring sites fill three such registers as they lie in memory: x y of the first, its z and x of the
//! second, y z of the second. They are added and multiplied like that; for their lengths, components come together in three
//! others. On processors whose units are so wide, forces of springs take two thirds of the time that they take with half as wide
//! registers (measured in a loop on its own; in a whole substep, `docs/benchmarks.md`). What is done to two sites is done to each as if alone: the bits are the same.

use std::cell::Cell;
use std::ops::{Add, Sub};

use fearless_simd::{Simd, f32x16, mask32x16, prelude::*};

use crate::sites::{LANES, Lanes};
use crate::vectors::{SiteVectors, load, stored};

/// The vectors of two sites.
#[derive(Clone, Copy)]
pub(crate) struct Pair<S: Simd> {
    xy: f32x16<S>,
    zx: f32x16<S>,
    yz: f32x16<S>,
}

/// Whether registers hold sixteen numbers, so that two sites at a time are faster than one.
#[inline(always)]
pub(crate) fn has_pairs<S: Simd>(simd: S) -> bool {
    #[cfg(target_arch = "x86_64")]
    return matches!(simd.level(), fearless_simd::Level::Avx512(_));
    #[cfg(not(target_arch = "x86_64"))]
    return false;
}

/// The numbers of two sites in a register.
#[inline(always)]
pub(crate) fn load_two<S: Simd>(simd: S, first: &Lanes, second: &Lanes) -> f32x16<S> {
    load(simd, first).combine(load(simd, second))
}

impl<S: Simd> Pair<S> {
    /// Those of the first two sites.
    #[inline(always)]
    pub fn load(simd: S, [first, second]: [&SiteVectors; 2]) -> Pair<S> {
        Pair {
            xy: load_two(simd, &first[0], &first[1]),
            zx: load_two(simd, &first[2], &second[0]),
            yz: load_two(simd, &second[1], &second[2]),
        }
    }

    #[inline(always)]
    pub fn store(self, [first, second]: [&Cell<SiteVectors>; 2]) {
        let [(x0, y0), (z0, x1), (y1, z1)] = [self.xy.split(), self.zx.split(), self.yz.split()];
        first.set([stored(x0), stored(y0), stored(z0)]);
        second.set([stored(x1), stored(y1), stored(z1)]);
    }

    /// Each vector times its factor.
    #[inline(always)]
    pub fn times(self, factors: f32x16<S>) -> Pair<S> {
        let (first, second) = factors.split();
        Pair {
            xy: self.xy * first.combine(first),
            zx: self.zx * factors,
            yz: self.yz * second.combine(second),
        }
    }

    #[inline(always)]
    pub fn length_squared(self) -> f32x16<S> {
        let [(x0, y0), (z0, x1), (y1, z1)] = [self.xy.split(), self.zx.split(), self.yz.split()];
        let (x, y, z) = (x0.combine(x1), y0.combine(y1), z0.combine(z1));
        x.mul_add_precise(x, y.mul_add_precise(y, z * z))
    }

    /// Turned on: lane `n` of each site gets what its lane `(n + TURN) % 8` held.
    #[inline(always)]
    pub fn turned<const TURN: usize>(self) -> Pair<S> {
        if TURN == 0 {
            return self;
        }
        Pair {
            xy: turned::<TURN, S>(self.xy),
            zx: turned::<TURN, S>(self.zx),
            yz: turned::<TURN, S>(self.yz),
        }
    }
}

/// Turned on within each half.
#[inline(always)]
fn turned<const TURN: usize, S: Simd>(numbers: f32x16<S>) -> f32x16<S> {
    // Turned on among all sixteen, lanes come to their place or eight from it. The compiler makes one instruction of this, which
    // it does not of two halves turned and put together.
    let around = numbers.slide::<TURN>(numbers);
    let in_place = ((1 << (LANES - TURN)) - 1) * 0x0101;
    mask32x16::from_bitmask(numbers.simd, in_place).select(around, around.slide::<LANES>(around))
}

impl<S: Simd> Add for Pair<S> {
    type Output = Pair<S>;

    #[inline(always)]
    fn add(self, other: Pair<S>) -> Pair<S> {
        Pair {
            xy: self.xy + other.xy,
            zx: self.zx + other.zx,
            yz: self.yz + other.yz,
        }
    }
}

impl<S: Simd> Sub for Pair<S> {
    type Output = Pair<S>;

    #[inline(always)]
    fn sub(self, other: Pair<S>) -> Pair<S> {
        Pair {
            xy: self.xy - other.xy,
            zx: self.zx - other.zx,
            yz: self.yz - other.yz,
        }
    }
}
