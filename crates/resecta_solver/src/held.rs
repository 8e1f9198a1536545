//! How stiffly each node is held by the springs and pentahedra around it: what the bound of a substep follows from.

use fearless_simd::{Simd, f32x8, prelude::*};
use glam::Vec3;

use crate::runs::{Run, with_turn};
use crate::sites::{LANES, Lanes, Sites};
use crate::springs::{Bundle, SHORTEST, Springs, gather};
use crate::vectors::{Registers, Scalars, SiteVectors, Vectors, load};
use crate::volumes::Volumes;
use crate::widest::{Widened, fused, with_widest};

/// A symmetric tensor a node, µN/mm.
#[derive(Debug, Clone)]
pub(crate) struct Held {
    /// xx, yy, zz.
    diagonal: Vectors,
    /// yz, xz, xy.
    across: Vectors,
    /// Upper bound of the square of a node's frequency times its inertia (see `bound.rs`), µN/mm.
    pub stiffness: Scalars,
}

impl Held {
    pub fn zero(sites: Sites) -> Held {
        Held {
            diagonal: Vectors::zero(sites),
            across: Vectors::zero(sites),
            stiffness: Scalars::zero(sites),
        }
    }

    /// Works out the stiffness of every node with the nodes at some positions; `support` holds each besides, µN/mm.
    pub fn measure(&mut self, springs: &Springs, volumes: Option<&Volumes>, positions: &Vectors, support: &Scalars) {
        with_widest(Measure {
            springs,
            volumes,
            positions,
            support,
            held: self,
        });
    }

    /// The same by the springs alone, every one counted in every direction: no shape makes them hold a node more stiffly.
    pub fn measure_any_shape(&mut self, springs: &Springs, support: &Scalars) {
        self.stiffness.values.copy_from_slice(&support.values);
        for (spring, ends) in (0u32..).zip(&springs.nodes) {
            for &end in ends {
                let sum = self.stiffness.at(end) + 2.0 * springs.stepped_stiffness(spring);
                self.stiffness.set(end, sum);
            }
        }
    }

    /// Adds to both ends of every spring the tensor by which it holds them: `k (s I + (1 - s) n nᵀ)` with stiffness k,
    /// direction n and the share s of its length by which it is stretched, 0 for one that is compressed.
    #[inline(always)]
    fn add_tensors<S: Simd>(&mut self, simd: S, springs: &Springs, positions: &Vectors) {
        for block in springs.layout().blocks() {
            for run in springs.layout().runs(block) {
                with_turn!(run.turn, self.add_run_tensors(simd, run, springs, positions));
            }
            for loose in springs.layout().loose(block) {
                let [a, b] = gather(loose, positions.view());
                let (a, b) = (Registers::load(simd, &a), Registers::load(simd, &b));
                let tensors = tensors(simd, springs.loose_bundle(loose), a, b);
                let (diagonal, across) = (tensors.diagonal.stored(), tensors.across.stored());
                for (lane, ends) in loose.ends.iter().enumerate() {
                    let of = |tensors: &SiteVectors| Vec3::from_array(tensors.map(|component| component.0[lane]));
                    for &end in ends {
                        self.diagonal.add(end, of(&diagonal));
                        self.across.add(end, of(&across));
                    }
                }
            }
        }
    }

    #[inline(always)]
    fn add_run_tensors<const TURN: usize, const BACK: usize, S: Simd>(
        &mut self,
        simd: S,
        run: &Run,
        springs: &Springs,
        positions: &Vectors,
    ) {
        let bundles = springs.bundles(run);
        let ends = [run.low, run.low + run.span];
        let [lows, highs] = ends.map(|first| &positions.values[first..][..bundles.len()]);
        let [low_diagonal, high_diagonal] = self.diagonal.shared(ends, bundles.len());
        let [low_across, high_across] = self.across.shared(ends, bundles.len());
        for n in 0..bundles.len() {
            let (low, high) = (Registers::load(simd, &lows[n]), Registers::load(simd, &highs[n]));
            let Tensors { diagonal, across } = tensors(simd, &bundles[n], low, high.turned::<TURN>());
            let sum = Registers::load(simd, &low_diagonal[n].get());
            low_diagonal[n].set((sum + diagonal).stored());
            let sum = Registers::load(simd, &low_across[n].get());
            low_across[n].set((sum + across).stored());
            let sum = Registers::load(simd, &high_diagonal[n].get());
            high_diagonal[n].set((sum + diagonal.turned::<BACK>()).stored());
            let sum = Registers::load(simd, &high_across[n].get());
            high_across[n].set((sum + across.turned::<BACK>()).stored());
        }
    }
}

/// The tensors of a bundle.
struct Tensors<S: Simd> {
    /// xx, yy, zz.
    diagonal: Registers<S>,
    /// yz, xz, xy.
    across: Registers<S>,
}

struct Measure<'a> {
    springs: &'a Springs,
    volumes: Option<&'a Volumes>,
    positions: &'a Vectors,
    support: &'a Scalars,
    held: &'a mut Held,
}

impl Widened for Measure<'_> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) {
        let Measure {
            springs,
            volumes,
            positions,
            support,
            held,
        } = self;
        held.diagonal.values.fill(SiteVectors::default());
        held.across.values.fill(SiteVectors::default());
        held.add_tensors(simd, springs, positions);
        if let Some(volumes) = volumes {
            volumes.add_tensors(simd, positions, &mut held.diagonal, &mut held.across);
        }
        let tensors = held.diagonal.values.iter().zip(&held.across.values);
        let stiffness = held.stiffness.values.iter_mut().zip(&support.values);
        for ((diagonal, across), (stiffness, support)) in tensors.zip(stiffness) {
            let largest = largest_eigenvalues(diagonal, across);
            for n in 0..LANES {
                stiffness.0[n] = 2.0f32.mul_add(largest.0[n], support.0[n]);
            }
        }
    }
}

/// The tensors of a bundle between nodes at `low` and at `high`.
#[inline(always)]
fn tensors<S: Simd>(simd: S, bundle: &Bundle, low: Registers<S>, high: Registers<S>) -> Tensors<S> {
    let (zero, one) = (f32x8::splat(simd, 0.0), f32x8::splat(simd, 1.0));
    let way = high - low;
    let square = way.length_squared();
    let length = square.sqrt();
    // A spring without length may turn any way: it counts in all.
    let stretched = (one - load(simd, &bundle.rest_length) / length).max(zero);
    let stretched = length.simd_gt(f32x8::splat(simd, SHORTEST)).select(stretched, one);
    let stiffness = load(simd, &bundle.stiffness);
    let along = way.times(stiffness * (one - stretched) / square.max(f32x8::splat(simd, SHORTEST * SHORTEST)));
    let everywhere = stiffness * stretched;
    Tensors {
        diagonal: Registers {
            x: fused(along.x, way.x, everywhere),
            y: fused(along.y, way.y, everywhere),
            z: fused(along.z, way.z, everywhere),
        },
        across: Registers {
            x: along.y * way.z,
            y: along.x * way.z,
            z: along.x * way.y,
        },
    }
}

/// Upper bounds of the largest eigenvalues of symmetric tensors (xx, yy, zz and yz, xz, xy), at most 0.4 % above them.
///
/// With mean q of the diagonal and `p² = tr (D - q I)² / 6` the largest eigenvalue is `q + 2 p cos(acos(r) / 3)`,
/// `r = det(D - q I) / 2 p³` (Smith, Commun. ACM 4:168, 1961). With `x = sqrt((1 + r) / 2)` the cosine is
/// `cos(π/3 - 2/3 asin x)`: 1/2 with slope 1/√3 at x = 0, 1 at x = 1, and nowhere above the parabola through these.
#[inline(always)]
fn largest_eigenvalues(diagonal: &SiteVectors, across: &SiteVectors) -> Lanes {
    const SLOPE: f32 = 0.577_350_3;
    let mut largest = Lanes::default();
    for n in 0..LANES {
        let [xx, yy, zz] = [0, 1, 2].map(|axis| diagonal[axis].0[n]);
        let [yz, xz, xy] = [0, 1, 2].map(|axis| across[axis].0[n]);
        let q = (xx + yy + zz) * (1.0 / 3.0);
        // Relative to the mean, so that no square over- or underflows.
        let unit = 1.0 / q.max(f32::MIN_POSITIVE);
        let [a, b, c, yz, xz, xy] = [xx - q, yy - q, zz - q, yz, xz, xy].map(|value| value * unit);
        let squares = a * a + b * b + c * c + 2.0 * (yz * yz + xz * xz + xy * xy);
        let p = (squares * (1.0 / 6.0)).sqrt();
        // The deviator relative to p; nothing in place of it where there is none.
        let scale = 1.0 / p.max(1e-6);
        let [a, b, c, yz, xz, xy] = [a, b, c, yz, xz, xy].map(|value| value * scale);
        let determinant = a * (b * c - yz * yz) - xy * (xy * c - yz * xz) + xz * (xy * yz - b * xz);
        let x = 0.25f32.mul_add(determinant, 0.5).clamp(0.0, 1.0).sqrt();
        let cosine = x.mul_add((0.5 - SLOPE).mul_add(x, SLOPE), 0.5);
        largest.0[n] = q * (2.0 * p).mul_add(cosine, 1.0);
    }
    largest
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::{Mat3, Quat};

    #[test]
    fn the_largest_eigenvalue_is_bounded_from_above_and_closely() {
        let turn = Quat::from_euler(glam::EulerRot::XYZ, 0.4, -1.1, 2.3);
        for n in 0..2000u32 {
            let [b, c] = [n % 41, n / 41 % 41].map(|n| n as f32 / 40.0);
            let values = Vec3::new(1.0, b, b.min(c)) * 10.0f32.powi(n as i32 % 7 - 3);
            let turn = Mat3::from_quat(turn * Quat::from_rotation_y(n as f32));
            let tensor = turn * Mat3::from_diagonal(values) * turn.transpose();
            let [x, y, z] = [tensor.x_axis, tensor.y_axis, tensor.z_axis];
            let everywhere = |values: [f32; 3]| values.map(|value| Lanes([value; LANES]));
            let bound = largest_eigenvalues(&everywhere([x.x, y.y, z.z]), &everywhere([y.z, x.z, x.y]));
            let ratio = bound.0[n as usize % LANES] / values.x;
            assert!((1.0 - 1e-5..1.004).contains(&ratio), "{values}: {ratio}");
        }
        let nothing = SiteVectors::default();
        assert_eq!(largest_eigenvalues(&nothing, &nothing), Lanes::default());
    }
}
