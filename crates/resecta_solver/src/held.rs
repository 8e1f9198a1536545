//! How stiffly each node is held by the springs around it: what the bound of a substep follows from.

use glam::Vec3;

use crate::aligned::CHUNK;
use crate::springs::{SHORTEST, Springs};
use crate::vectors::{Chunk, Vectors};
use crate::widest::{Widened, with_widest};

/// A symmetric tensor a node, µN/mm.
#[derive(Debug, Clone)]
pub(crate) struct Held {
    /// xx, yy, zz.
    diagonal: Vectors,
    /// yz, xz, xy.
    across: Vectors,
    /// Upper bound of the square of a node's frequency times its inertia (see `bound.rs`), µN/mm.
    pub stiffness: Vec<f32>,
}

/// The tensors of a chunk of springs, per stiffness.
struct Tensors {
    diagonal: Chunk,
    across: Chunk,
}

impl Held {
    pub fn zero(count: usize) -> Held {
        Held {
            diagonal: Vectors::zero(count),
            across: Vectors::zero(count),
            stiffness: vec![0.0; count],
        }
    }

    /// Works out the stiffness of every node with the nodes at some positions; `support` holds each besides, µN/mm.
    pub fn measure(&mut self, springs: &Springs, positions: &Vectors, support: &[f32]) {
        with_widest(Measure {
            springs,
            positions,
            support,
            held: self,
        });
    }

    /// The same with every spring counted in every direction: no shape makes a node stiffer.
    pub fn measure_any_shape(&mut self, springs: &Springs, support: &[f32]) {
        self.stiffness.fill(0.0);
        for (spring, ends) in (0u32..).zip(&springs.nodes) {
            for &end in ends {
                self.stiffness[end as usize] += 2.0 * springs.stiffness(spring);
            }
        }
        for (stiffness, support) in self.stiffness.iter_mut().zip(support) {
            *stiffness += support;
        }
    }

    /// Adds to both ends of every spring the tensor by which it holds them: `k (s I + (1 - s) n nᵀ)` with stiffness k,
    /// direction n and the share s of its length by which it is stretched, 0 for one that is compressed.
    #[inline(always)]
    fn add_tensors(&mut self, springs: &Springs, positions: &Vectors) {
        for block in springs.layout().blocks() {
            for run in springs.layout().runs(block) {
                let [ax, ay, az] = positions.chunks(run.a, run.chunks);
                let [bx, by, bz] = positions.chunks(run.b, run.chunks);
                let [stiffness, rest_length] = springs.chunks(run.first_slot, run.chunks);
                let ends = [run.a, run.b];
                let diagonal = self.diagonal.shared(ends, run.chunks);
                let across = self.across.shared(ends, run.chunks);
                for n in 0..run.chunks {
                    let [a, b] = [[ax[n], ay[n], az[n]], [bx[n], by[n], bz[n]]];
                    let tensors = tensors(&rest_length[n], &a, &b);
                    for end in 0..2 {
                        diagonal[end].add(n, &stiffness[n], &tensors.diagonal);
                        across[end].add(n, &stiffness[n], &tensors.across);
                    }
                }
            }
            for loose in springs.layout().loose(block) {
                let [a, b] = loose.gather(positions);
                let [stiffness, rest_length] = springs.chunks(loose.first_slot, 1);
                let tensors = tensors(&rest_length[0], &a, &b);
                for (n, ends) in loose.ends.iter().enumerate() {
                    let of = |values: &Chunk| Vec3::from_array(values.map(|values| values[n])) * stiffness[0][n];
                    for &end in ends {
                        self.diagonal.add(end, of(&tensors.diagonal));
                        self.across.add(end, of(&tensors.across));
                    }
                }
            }
        }
    }
}

struct Measure<'a> {
    springs: &'a Springs,
    positions: &'a Vectors,
    support: &'a [f32],
    held: &'a mut Held,
}

impl Widened for Measure<'_> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        let Measure {
            springs,
            positions,
            support,
            held,
        } = self;
        held.diagonal.fill_zero();
        held.across.fill_zero();
        held.add_tensors(springs, positions);
        let stiffness = held.stiffness.chunks_mut(CHUNK);
        for ((first, stiffness), support) in (0..).step_by(CHUNK).zip(stiffness).zip(support.chunks(CHUNK)) {
            let largest = largest_eigenvalues(held.diagonal.chunk(first), held.across.chunk(first));
            for (n, (stiffness, support)) in stiffness.iter_mut().zip(support).enumerate() {
                *stiffness = 2.0f32.mul_add(largest[n], *support);
            }
        }
    }
}

/// The tensors of a chunk of springs between nodes at `a` and at `b`.
#[inline(always)]
fn tensors(rest_length: &[f32; CHUNK], a: &Chunk, b: &Chunk) -> Tensors {
    let mut tensors = Tensors {
        diagonal: [[0.0; CHUNK]; 3],
        across: [[0.0; CHUNK]; 3],
    };
    let Tensors { diagonal, across } = &mut tensors;
    for n in 0..CHUNK {
        let [dx, dy, dz] = [b[0][n] - a[0][n], b[1][n] - a[1][n], b[2][n] - a[2][n]];
        let square = dx.mul_add(dx, dy.mul_add(dy, dz * dz));
        let distance = square.sqrt();
        // A spring without length may turn any way: it counts in all.
        let stretched = if distance > SHORTEST {
            (1.0 - rest_length[n] / distance).max(0.0)
        } else {
            1.0
        };
        let along = (1.0 - stretched) / square.max(SHORTEST * SHORTEST);
        let [x, y, z] = [along * dx, along * dy, along * dz];
        diagonal[0][n] = x.mul_add(dx, stretched);
        diagonal[1][n] = y.mul_add(dy, stretched);
        diagonal[2][n] = z.mul_add(dz, stretched);
        [across[0][n], across[1][n], across[2][n]] = [y * dz, x * dz, x * dy];
    }
    tensors
}

/// Upper bounds of the largest eigenvalues of symmetric tensors (xx, yy, zz and yz, xz, xy), at most 0.4 % above them.
///
/// With mean q of the diagonal and `p² = tr (D - q I)² / 6` the largest eigenvalue is `q + 2 p cos(acos(r) / 3)`,
/// `r = det(D - q I) / 2 p³` (Smith, Commun. ACM 4:168, 1961). With `x = sqrt((1 + r) / 2)` the cosine is
/// `cos(π/3 - 2/3 asin x)`: 1/2 with slope 1/√3 at x = 0, 1 at x = 1, and nowhere above the parabola through these.
#[inline(always)]
fn largest_eigenvalues([xx, yy, zz]: Chunk, [yz, xz, xy]: Chunk) -> [f32; CHUNK] {
    const SLOPE: f32 = 0.577_350_3;
    let mut largest = [0.0; CHUNK];
    for n in 0..CHUNK {
        let q = (xx[n] + yy[n] + zz[n]) * (1.0 / 3.0);
        let [a, b, c, yz, xz, xy] = [xx[n] - q, yy[n] - q, zz[n] - q, yz[n], xz[n], xy[n]];
        let squares = a * a + b * b + c * c + 2.0 * (yz * yz + xz * xz + xy * xy);
        let p = (squares * (1.0 / 6.0)).sqrt();
        // The deviator relative to p; nothing in place of it where there is none.
        let scale = 1.0 / p.max(1e-6 * q.abs()).max(f32::MIN_POSITIVE);
        let [a, b, c, yz, xz, xy] = [a, b, c, yz, xz, xy].map(|value| value * scale);
        let determinant = a * (b * c - yz * yz) - xy * (xy * c - yz * xz) + xz * (xy * yz - b * xz);
        let x = 0.25f32.mul_add(determinant, 0.5).clamp(0.0, 1.0).sqrt();
        let cosine = x.mul_add((0.5 - SLOPE).mul_add(x, SLOPE), 0.5);
        largest[n] = (2.0 * p).mul_add(cosine, q);
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
            let everywhere = |values: [f32; 3]| values.map(|value| [value; CHUNK]);
            let bound = largest_eigenvalues(everywhere([x.x, y.y, z.z]), everywhere([y.z, x.z, x.y]));
            let ratio = bound[n as usize % CHUNK] / values.x;
            assert!((1.0 - 1e-5..1.004).contains(&ratio), "{values}: {ratio}");
        }
        let nothing = [[0.0; CHUNK]; 3];
        assert_eq!(largest_eigenvalues(nothing, nothing), [0.0; CHUNK]);
    }
}
