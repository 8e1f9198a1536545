//! Springs: where a spring's force is computed.
//!
//! Springs are arrays (structure of arrays), and consecutive springs whose two nodes both rise by one form a *run*. A
//! lattice numbered along its rings consists of such runs, so the force of a whole run reads and writes contiguous memory
//! and the compiler turns the loop into vector instructions; nothing is gathered. A removed spring keeps its place with
//! stiffness 0: no run is broken, nothing is renumbered, and removal costs nothing in the loop.

use crate::vectors::Vectors;

/// The springs of a tissue.
#[derive(Debug, Clone)]
pub(crate) struct Springs {
    /// The two nodes of each spring.
    pub nodes: Vec<[u32; 2]>,
    /// Stiffness, µN/mm; 0 when removed.
    pub stiffness: Vec<f32>,
    /// Rest length, mm.
    pub rest_length: Vec<f32>,
    /// How many pentahedra have both ends of the spring and still live; 0 from the start for a spring across a cell.
    pub behind: Vec<u16>,
    /// Sum over the living pentahedra behind the spring of fraction times volume, mm³.
    pub backing: Vec<f32>,
    /// Whether the spring is still part of the tissue.
    pub alive: Vec<bool>,
    runs: Vec<Run>,
}

/// Springs `first..first + length` join nodes `a + n` and `b + n`.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Run {
    first: u32,
    length: u32,
    a: u32,
    b: u32,
}

/// Springs computed at a time: their forces stay in the nearest cache between the two passes that add them to the nodes.
const BLOCK: usize = 128;

/// Shorter than this a spring counts as having no direction, and gives no force; mm.
const SHORTEST: f32 = 1e-9;

impl Springs {
    /// Springs that all live. One array entry a spring in every argument.
    pub fn new(
        nodes: Vec<[u32; 2]>,
        stiffness: Vec<f32>,
        rest_length: Vec<f32>,
        behind: Vec<u16>,
        backing: Vec<f32>,
    ) -> Springs {
        Springs {
            alive: vec![true; nodes.len()],
            runs: runs(&nodes),
            nodes,
            stiffness,
            rest_length,
            behind,
            backing,
        }
    }

    /// Sums the stiffness of the springs around every node, µN/mm.
    pub fn sum_stiffness(&self, sums: &mut [f32]) {
        sums.fill(0.0);
        for run in &self.runs {
            let (first, a, b, length) = (run.first as usize, run.a as usize, run.b as usize, run.length as usize);
            for end in [a, b] {
                for (sum, stiffness) in sums[end..end + length]
                    .iter_mut()
                    .zip(&self.stiffness[first..first + length])
                {
                    *sum += stiffness;
                }
            }
        }
    }

    /// Adds the force of every spring to its nodes, µN: equation (2) of the papers with the sign of a pull.
    ///
    /// The result has the same bits whichever instructions the processor offers: no operation is fused or reordered.
    pub fn add_forces(&self, positions: &Vectors, forces: &mut Vectors) {
        #[cfg(target_arch = "x86_64")]
        {
            if is_x86_feature_detected!("avx512f") && is_x86_feature_detected!("avx512vl") {
                // SAFETY: the processor has been asked for these instructions.
                return unsafe { self.add_forces_avx512(positions, forces) };
            }
            if is_x86_feature_detected!("avx2") {
                // SAFETY: the processor has been asked for these instructions.
                return unsafe { self.add_forces_avx2(positions, forces) };
            }
        }
        self.add_forces_anywhere(positions, forces);
    }

    #[cfg(target_arch = "x86_64")]
    #[target_feature(enable = "avx512f,avx512vl,avx2")]
    fn add_forces_avx512(&self, positions: &Vectors, forces: &mut Vectors) {
        self.add_forces_anywhere(positions, forces);
    }

    #[cfg(target_arch = "x86_64")]
    #[target_feature(enable = "avx2")]
    fn add_forces_avx2(&self, positions: &Vectors, forces: &mut Vectors) {
        self.add_forces_anywhere(positions, forces);
    }

    #[inline(always)]
    fn add_forces_anywhere(&self, positions: &Vectors, forces: &mut Vectors) {
        for run in &self.runs {
            let mut done = 0;
            while done < run.length as usize {
                let length = BLOCK.min(run.length as usize - done);
                let springs = run.first as usize + done..run.first as usize + done + length;
                let (a, b) = (run.a as usize + done, run.b as usize + done);
                add_block_forces(
                    [&self.stiffness[springs.clone()], &self.rest_length[springs]],
                    [a, b],
                    positions,
                    forces,
                );
                done += length;
            }
        }
    }
}

/// Finds the runs. Removal does not change them.
fn runs(nodes: &[[u32; 2]]) -> Vec<Run> {
    let mut runs: Vec<Run> = Vec::new();
    for (spring, &[a, b]) in (0u32..).zip(nodes) {
        match runs.last_mut() {
            Some(run) if run.a + run.length == a && run.b + run.length == b => run.length += 1,
            _ => runs.push(Run {
                first: spring,
                length: 1,
                a,
                b,
            }),
        }
    }
    runs
}

/// The force of consecutive springs from nodes `a..` to nodes `b..`.
#[inline(always)]
fn add_block_forces(
    [stiffness, rest_length]: [&[f32]; 2],
    [a, b]: [usize; 2],
    positions: &Vectors,
    forces: &mut Vectors,
) {
    let length = stiffness.len().min(BLOCK);
    let [ax, ay, az] = positions.slices(a..a + length);
    let [bx, by, bz] = positions.slices(b..b + length);
    let (stiffness, rest_length) = (&stiffness[..length], &rest_length[..length]);
    let mut pull = [[0.0f32; BLOCK]; 3];
    for n in 0..length {
        let (dx, dy, dz) = (bx[n] - ax[n], by[n] - ay[n], bz[n] - az[n]);
        let distance = (dx * dx + dy * dy + dz * dz).sqrt();
        let tension = stiffness[n] * (distance - rest_length[n]) / distance.max(SHORTEST);
        pull[0][n] = tension * dx;
        pull[1][n] = tension * dy;
        pull[2][n] = tension * dz;
    }
    for (pull, forces) in pull.iter().zip(forces.each_mut()) {
        // Two passes: the two ranges of nodes may overlap.
        for (force, pull) in forces[a..a + length].iter_mut().zip(pull) {
            *force += pull;
        }
        for (force, pull) in forces[b..b + length].iter_mut().zip(pull) {
            *force -= pull;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn springs(nodes: Vec<[u32; 2]>) -> Springs {
        let count = nodes.len();
        let stiffness = (0..count).map(|n| 3.0 + n as f32).collect();
        let rest_length = (0..count).map(|n| 0.5 + 0.25 * n as f32).collect();
        Springs::new(nodes, stiffness, rest_length, vec![1; count], vec![1.0; count])
    }

    #[test]
    fn a_spring_pulls_with_stiffness_times_elongation_along_its_axis() {
        let springs = springs(vec![[0, 1]]);
        let mut forces = Vectors::zero(2);
        springs.add_forces(&Vectors::from_iter([[0.0, 0.0, 0.0], [3.0, 4.0, 0.0]]), &mut forces);
        // Length 5, rest 0.5, stiffness 3: 13.5 µN along (0.6, 0.8).
        for (got, expected) in forces.get(0).into_iter().zip([8.1, 10.8, 0.0]) {
            assert!((got - expected).abs() < 1e-5, "{got} {expected}");
        }
        assert_eq!(forces.get(1), forces.get(0).map(|force| -force));
    }

    #[test]
    fn a_spring_without_length_gives_no_force_and_no_nan() {
        let springs = springs(vec![[0, 1]]);
        let mut forces = Vectors::zero(2);
        springs.add_forces(&Vectors::from_iter([[1.0, 2.0, 3.0]; 2]), &mut forces);
        assert_eq!([forces.get(0), forces.get(1)], [[0.0; 3]; 2]);
    }

    #[test]
    fn internal_forces_sum_to_zero_and_do_not_depend_on_the_order_of_springs() {
        // 400 nodes on a curve, joined to the next and to the seventh next: two long runs, overlapping ranges.
        let nodes: Vec<[u32; 2]> = [1, 7]
            .into_iter()
            .flat_map(|gap| (0..400 - gap).map(move |n| [n, n + gap]))
            .collect();
        let place = |n: i32| {
            [
                (n as f32 * 0.31).sin() * 5.0,
                (n as f32 * 0.17).cos() * 5.0,
                n as f32 * 0.1,
            ]
        };
        let positions = Vectors::from_iter((0..400).map(place));
        let straight = springs(nodes.clone());
        let mut forces = Vectors::zero(400);
        straight.add_forces(&positions, &mut forces);

        let (mut sum, mut size) = ([0.0f64; 3], 0.0f64);
        for n in 0..400 {
            for (sum, force) in sum.iter_mut().zip(forces.get(n)) {
                *sum += f64::from(force);
                size += f64::from(force.abs());
            }
        }
        let rounding = size * f64::from(f32::EPSILON);
        assert!(sum.iter().all(|sum| sum.abs() <= rounding), "{sum:?} of {size}");

        let reversed = |values: &[f32]| values.iter().rev().copied().collect();
        let backwards = Springs::new(
            nodes.into_iter().rev().collect(),
            reversed(&straight.stiffness),
            reversed(&straight.rest_length),
            vec![1; straight.nodes.len()],
            reversed(&straight.backing),
        );
        assert!(backwards.runs.len() > 700, "reversed, every spring is a run of its own");
        let mut again = Vectors::zero(400);
        backwards.add_forces(&positions, &mut again);
        for n in 0..400 {
            for (x, y) in forces.get(n).into_iter().zip(again.get(n)) {
                assert!((x - y).abs() <= 1e-3 * x.abs().max(1.0), "{x} {y}");
            }
        }
    }

    #[test]
    fn vector_instructions_give_the_same_bits_as_scalar_ones() {
        let nodes: Vec<[u32; 2]> = (0..700).map(|n| [n, n + 50]).collect();
        let positions =
            Vectors::from_iter((0..750).map(|n| [n as f32 * 0.37, (n as f32).sin(), (n as f32).cos() * 9.0]));
        let springs = springs(nodes);
        let (mut dispatched, mut scalar) = (Vectors::zero(750), Vectors::zero(750));
        springs.add_forces(&positions, &mut dispatched);
        springs.add_forces_anywhere(&positions, &mut scalar);
        assert_eq!(dispatched, scalar);
    }
}
