//! What pentahedra that hold their volume do to their corners, in registers: their forces, and bounds of their stiffness.
//!
//! # One formula
//!
//! V is the volume of `resecta_anatomy::wedge`, whose faces are cut by node index. Numbered anew so that the corner with
//! the smallest index comes first, two faces are cut from there, and the third along 1-5 or 2-4. A pentahedron with the
//! latter is taken as its mirror image: corners 1 and 2, 4 and 5 changed, volumes negative. So with `p_i = x_i - x_0`
//! always
//!
//! ```text
//! 6 V = p5 · (p1 × (p4 - p2) + p4 × p3)
//! ```
//!
//! and every gradient is a sum of the products a = p1 × p5, b = p2 × p5, c = p3 × p5, d = p4 × p5 and
//! g = p1 × (p4 - p2) + p4 × p3, in which all cancel: the six forces have no resultant and no moment.
//!
//! # Stiffness
//!
//! For the bound of `bound.rs`: with corner gradients g_i, `(Σ g_i · u_i)² <= (Σ |g_i|²) (Σ (g_i · u_i)² / |g_i|²)`, so
//! the first part of the second derivative holds corner i with no more than `p' V0⁻¹ Σ |g|²` along g_i; on lattices
//! closer than with other weights (1 or |g_i|). The second part, p d²V/dx², couples corners i and j by a cross product with
//! a sixth of the edge s_ij that lies opposite, and so holds corner i with no more than `|p| Σ_j |s_ij| / 6` in any
//! direction.

use fearless_simd::{Simd, f32x8, prelude::*};
use resecta_anatomy::wedge;

use crate::pressure::{SQUEEZED, STIFFENING};
use crate::sites::Lanes;
use crate::vectors::{Registers, load};
use crate::widest::fused;

/// Up to eight pentahedra, a lane each.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Bundle {
    /// A sixth of K, Pa; negative for a mirror image, 0 for one that has been removed and where there is none.
    pub stiffness: Lanes,
    /// One over six times the rest volume, 1/mm³; negative for a mirror image.
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

/// The products that six times the volumes and their gradients are made of: see the top of the file.
struct Products<S: Simd> {
    a: Registers<S>,
    b: Registers<S>,
    c: Registers<S>,
    d: Registers<S>,
    g: Registers<S>,
    six_volumes: f32x8<S>,
}

impl<S: Simd> Products<S> {
    #[inline(always)]
    fn of([x0, x1, x2, x3, x4, x5]: [Registers<S>; 6]) -> Products<S> {
        let (p1, p2, p3, p4, p5) = (x1 - x0, x2 - x0, x3 - x0, x4 - x0, x5 - x0);
        let g = p1.cross_plus(x4 - x2, p4.cross(p3));
        Products {
            a: p1.cross(p5),
            b: p2.cross(p5),
            c: p3.cross(p5),
            d: p4.cross(p5),
            six_volumes: fused(p5.x, g.x, fused(p5.y, g.y, p5.z * g.z)),
            g,
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
        let Products {
            a,
            b,
            c,
            d,
            g,
            six_volumes,
        } = Products::of(corners);
        let one = f32x8::splat(simd, 1.0);
        let ratio = six_volumes * load(simd, &bundle.per_volume);
        let over_stiffness = (one - ratio) / ratio.abs().max(one) + barrier(simd, ratio);
        let pressure = load(simd, &bundle.stiffness) * over_stiffness;
        let (a, b, c, d, g) = (
            a.times(pressure),
            b.times(pressure),
            c.times(pressure),
            d.times(pressure),
            g.times(pressure),
        );
        [[(b - c) - g, d - b, a, Registers::zero(simd) - d, c - a, g]]
    }
}

impl Effect<2> for Tensors {
    #[inline(always)]
    fn on<S: Simd>(simd: S, bundle: &Bundle, corners: [Registers<S>; 6]) -> [[Registers<S>; 6]; 2] {
        let Products {
            a,
            b,
            c,
            d,
            g,
            six_volumes,
        } = Products::of(corners);
        let gradients = [(b - c) - g, d - b, a, d, c - a, g];
        let (half, one) = (f32x8::splat(simd, 0.5), f32x8::splat(simd, 1.0));
        let tiny = f32x8::splat(simd, f32::MIN_POSITIVE);
        let (stiffness, per_volume) = (load(simd, &bundle.stiffness), load(simd, &bundle.per_volume));
        let ratio = six_volumes * per_volume;
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

        let [x0, x1, x2, x3, x4, x5] = corners;
        let length = |from: Registers<S>, to: Registers<S>| (to - from).length_squared().sqrt();
        let (e01, e04, e05) = (length(x0, x1), length(x0, x4), length(x0, x5));
        let (e13, e15, e23) = (length(x1, x3), length(x1, x5), length(x2, x3));
        let (e24, e45) = (length(x2, x4), length(x4, x5));
        let opposite = [
            e24 + e15 + e45 + e13 + e23,
            (e05 + e05) + (e24 + e24),
            e05 + e01 + e15,
            e05 + e04 + e45,
            (e05 + e05) + (e13 + e13),
            e24 + e01 + e04 + e13 + e23,
        ];

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

/// The corners in the order of the formula, and whether that is the mirror image.
pub(crate) fn numbered_anew(nodes: &[u32; 6]) -> ([u32; 6], bool) {
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
    let turned = TURNS[smallest].map(|corner| nodes[corner]);
    let [x0, x1, x2, x3, x4, x5] = turned;
    let [[start, _, end], _] = wedge::split_quad([x1, x4, x5, x2]);
    if [start, end] == [x1, x5] || [start, end] == [x5, x1] {
        (turned, false)
    } else {
        ([x0, x2, x1, x3, x5, x4], true)
    }
}
