//! What pentahedra that hold their volume do to their corners, in registers: their forces, and bounds of their stiffness.
//!
//! # One formula
//!
//! V is the volume of `resecta_anatomy::wedge`. With `p_i = x_i - x_0`
//!
//! ```text
//! 12 V = p5 · g5 + p4 · h,    h = p1 × (p3 - p2)
//! g1 = p4 × (p5 + p2 - p3) + p5 × p2         g4 = p5 × (p1 + p2 - 2 p3) + h
//! g2 = p1 × (p4 + p5) + p5 × (p3 - p4)       g5 = p4 × (2 p3 - p1 - p2) + p2 × (p1 - p3)
//! g3 = p4 × (p1 - 2 p5) + p2 × p5            g0 = -(g1 + g2 + g3 + g4 + g5)
//! ```
//!
//! where g_i is twelve times the gradient at corner i. The six forces have no resultant and no moment.
//!
//! # Stiffness
//!
//! For the bound of `bound.rs`: with corner gradients g_i, `(Σ g_i · u_i)² <= (Σ |g_i|²) (Σ (g_i · u_i)² / |g_i|²)`, so
//! the first part of the second derivative holds corner i with no more than `p' V0⁻¹ Σ |g|²` along g_i; on lattices
//! closer than with other weights (1 or |g_i|). The second part, p d²V/dx², couples corners i and j by a cross product with
//! a twelfth of a vector s_ij, and so holds corner i with no more than `|p| Σ_j |s_ij| / 12` in any direction. With j and k the other corners
//! of the triangle of i, and i' the one opposite i: s_ij is the sum of the ways from k to i' and j', s_ii' that of the edges jk and j'k', and
//! s_ij' the diagonal from j to i'.

use fearless_simd::{Simd, f32x8, prelude::*};

use crate::pressure::{SQUEEZED, STIFFENING};
use crate::sites::Lanes;
use crate::vectors::{Registers, load};
use crate::widest::fused;

/// Up to eight pentahedra, a lane each.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Bundle {
    /// A twelfth of K, Pa; 0 for one that has been removed and where there is none.
    pub stiffness: Lanes,
    /// One over twelve times the rest volume, 1/mm³.
    pub per_volume: Lanes,
}

/// What pentahedra do to their corners: `N` vectors each.
pub(crate) trait Effect<const N: usize> {
    fn on<S: Simd>(simd: S, bundle: &Bundle, corners: [Registers<S>; 6]) -> [[Registers<S>; 6]; N];
}

/// Share of its volume that a pentahedron is expected to lose in a step: tools move by a millimetre, and cells are some wide.
const AHEAD: f32 = 0.1;

/// Pressure times gradient, µN.
pub(crate) struct Forces;

/// Half of the tensor that bounds how a corner is held, µN/mm: xx, yy, zz, then yz, xz, xy.
pub(crate) struct Tensors;

/// Twelve times the volumes, and twelve times their gradients: see the top of the file.
struct Twelvefold<S: Simd> {
    volumes: f32x8<S>,
    gradients: [Registers<S>; 6],
}

impl<S: Simd> Twelvefold<S> {
    #[inline(always)]
    fn of(simd: S, [x0, x1, x2, x3, x4, x5]: [Registers<S>; 6]) -> Twelvefold<S> {
        let [p1, p2, p4, p5] = [x1 - x0, x2 - x0, x4 - x0, x5 - x0];
        let h = p1.cross(x3 - x2);
        // 2 p3 - p1 - p2.
        let across = (x3 - x1) + (x3 - x2);
        let g1 = p4.cross_plus(p5 + (x2 - x3), p5.cross(p2));
        let g2 = p1.cross_plus(p4 + p5, p5.cross(x3 - x4));
        let g3 = p4.cross_plus((x1 - x5) - p5, p2.cross(p5));
        let g4 = h - p5.cross(across);
        let g5 = p4.cross_plus(across, p2.cross(x1 - x3));
        let g0 = Registers::zero(simd) - (((g1 + g2) + (g3 + g4)) + g5);
        let of_h = fused(p4.x, h.x, fused(p4.y, h.y, p4.z * h.z));
        Twelvefold {
            volumes: fused(p5.x, g5.x, fused(p5.y, g5.y, fused(p5.z, g5.z, of_h))),
            gradients: [g0, g1, g2, g3, g4, g5],
        }
    }
}

/// The barrier's pressure over bulk stiffness, at a share of the volume at rest: see `pressure.rs`.
#[inline(always)]
fn barrier<S: Simd>(simd: S, ratio: f32x8<S>) -> f32x8<S> {
    let [zero, squeezed, twice] = [0.0, SQUEEZED, 2.0 * SQUEEZED].map(|value| f32x8::splat(simd, value));
    let below = (squeezed - ratio).max(zero).min(twice);
    let upright = below.min(squeezed);
    let (half_slope, slope) = (0.5 * STIFFENING / SQUEEZED, STIFFENING);
    fused(
        upright * f32x8::splat(simd, half_slope),
        upright,
        (below - upright) * f32x8::splat(simd, slope),
    )
}

/// Its slope, as steep as it is when the pentahedron has lost another [`AHEAD`] of its volume.
#[inline(always)]
fn slope<S: Simd>(simd: S, ratio: f32x8<S>) -> f32x8<S> {
    let [zero, one, squeezed] = [0.0, 1.0, SQUEEZED].map(|value| f32x8::splat(simd, value));
    let ahead = f32x8::splat(simd, AHEAD);
    let share = ((squeezed + ahead - ratio) * f32x8::splat(simd, 1.0 / SQUEEZED))
        .max(zero)
        .min(one);
    let rises = (ratio + ahead).simd_gt(zero - squeezed);
    rises.select(share * f32x8::splat(simd, STIFFENING), zero)
}

impl Effect<1> for Forces {
    #[inline(always)]
    fn on<S: Simd>(simd: S, bundle: &Bundle, corners: [Registers<S>; 6]) -> [[Registers<S>; 6]; 1] {
        let Twelvefold { volumes, gradients } = Twelvefold::of(simd, corners);
        let one = f32x8::splat(simd, 1.0);
        let ratio = volumes * load(simd, &bundle.per_volume);
        let over_stiffness = (one - ratio) / ratio.abs().max(one) + barrier(simd, ratio);
        let pressure = load(simd, &bundle.stiffness) * over_stiffness;
        let [g0, g1, g2, g3, g4, g5] = gradients;
        [[
            g0.times(pressure),
            g1.times(pressure),
            g2.times(pressure),
            g3.times(pressure),
            g4.times(pressure),
            g5.times(pressure),
        ]]
    }
}

impl Effect<2> for Tensors {
    #[inline(always)]
    fn on<S: Simd>(simd: S, bundle: &Bundle, corners: [Registers<S>; 6]) -> [[Registers<S>; 6]; 2] {
        let Twelvefold { volumes, gradients } = Twelvefold::of(simd, corners);
        let (half, one) = (f32x8::splat(simd, 0.5), f32x8::splat(simd, 1.0));
        let tiny = f32x8::splat(simd, f32::MIN_POSITIVE);
        let (stiffness, per_volume) = (load(simd, &bundle.stiffness), load(simd, &bundle.per_volume));
        let ratio = volumes * per_volume;
        let grown = one / ratio.abs().max(one);
        let pressure = (half * stiffness * ((one - ratio) * grown + barrier(simd, ratio))).abs();

        let mut squares = [tiny; 6];
        let mut sum = f32x8::splat(simd, 0.0);
        for corner in 0..6 {
            let square = gradients[corner].length_squared();
            sum += square;
            squares[corner] = square.max(tiny);
        }
        let along = half * (stiffness * per_volume) * (grown * grown + slope(simd, ratio)) * sum;

        let length = |way: Registers<S>| way.length_squared().sqrt();
        let way = |from: usize, to: usize| corners[to] - corners[from];
        let mut opposite = [f32x8::splat(simd, 0.0); 6];
        let mut join = |one: usize, other: usize, couples: f32x8<S>| {
            opposite[one] += couples;
            opposite[other] += couples;
        };
        for i in 0..3 {
            let (j, k) = ((i + 1) % 3, (i + 2) % 3);
            let (above_i, above_j, above_k) = (i + 3, j + 3, k + 3);
            join(i, j, length(way(k, above_i) + way(k, above_j)));
            join(above_i, above_j, length(way(above_k, i) + way(above_k, j)));
            join(i, above_i, length(way(j, k) + way(above_j, above_k)));
            join(i, above_j, length(way(j, above_i)));
            join(j, above_i, length(way(i, above_j)));
        }

        let zero = Registers::zero(simd);
        let (mut diagonal, mut across) = ([zero; 6], [zero; 6]);
        for corner in 0..6 {
            let Registers { x, y, z } = gradients[corner];
            let way = gradients[corner].times(along / squares[corner]);
            let everywhere = pressure * opposite[corner];
            diagonal[corner] = Registers {
                x: fused(way.x, x, everywhere),
                y: fused(way.y, y, everywhere),
                z: fused(way.z, z, everywhere),
            };
            across[corner] = Registers {
                x: way.y * z,
                y: way.x * z,
                z: way.x * y,
            };
        }
        [diagonal, across]
    }
}

/// The corners turned so that the one with the smallest index comes first: pentahedra of a lattice are then numbered alike.
pub(crate) fn numbered_anew(nodes: &[u32; 6]) -> [u32; 6] {
    let smallest = (0..6).min_by_key(|&corner| nodes[corner]).unwrap_or(0);
    // The six ways to turn a pentahedron, by the corner that comes first.
    const TURNS: [[usize; 6]; 6] = [
        [0, 1, 2, 3, 4, 5],
        [1, 2, 0, 4, 5, 3],
        [2, 0, 1, 5, 3, 4],
        [3, 5, 4, 0, 2, 1],
        [4, 3, 5, 1, 0, 2],
        [5, 4, 3, 2, 1, 0],
    ];
    TURNS[smallest].map(|corner| nodes[corner])
}
