//! Springs: where a spring's force is computed.
//!
//! # Layout
//!
//! A spring has an index, by which everybody else knows it, and a *slot*, where the hot loop finds its stiffness and rest
//! length. Slots are ordered so that consecutive slots join consecutive nodes: springs are sorted by the distance between
//! their two nodes, then by the first, and each stretch in which both nodes rise by one is a *run*. A lattice numbered
//! along its rings falls into few long runs; their forces read and write contiguous memory, the compiler turns the loop
//! into vector instructions, and nothing is gathered. Short gaps in a run and its end up to a whole [`CHUNK`] are filled
//! with slots of stiffness 0, which cost less than a new run or a loop for the rest; springs in runs too short to pay are
//! computed from gathered positions.
//!
//! A chunk's forces stay in registers: they are added to its first nodes, then taken from its second nodes. That order is
//! the same whatever the width of the registers, so the sums have the same bits on every processor.
//!
//! A removed spring keeps its slot with stiffness 0: no run is broken, nothing is renumbered, and removal costs nothing in
//! the loop.

use glam::Vec3;

use crate::vectors::{Vectors, chunk};

/// The springs of a tissue.
#[derive(Debug, Clone)]
pub(crate) struct Springs {
    /// The two nodes of each spring.
    pub nodes: Vec<[u32; 2]>,
    /// How many pentahedra have both ends of the spring and still live; 0 from the start for a spring across a cell.
    pub behind: Vec<u16>,
    /// Sum over the living pentahedra behind the spring of fraction times volume, mm³.
    pub backing: Vec<f32>,
    /// Whether the spring is still part of the tissue.
    pub alive: Vec<bool>,
    slot: Vec<u32>,
    /// By slot: stiffness, µN/mm; 0 when removed.
    stiffness: Vec<f32>,
    /// By slot: rest length, mm.
    rest_length: Vec<f32>,
    runs: Vec<Run>,
    /// The nodes of the slots behind all runs, which are computed one by one.
    loose: Vec<[u32; 2]>,
}

/// The slots from `first` on join nodes `a + n` and `b + n`.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Run {
    first: u32,
    length: u32,
    a: u32,
    b: u32,
}

/// Slots computed at a time: one register of 16 `f32`, two of 8, or four of 4.
pub(crate) const CHUNK: usize = 16;

/// Forces of a chunk of slots, by component, µN.
type Pull = [[f32; CHUNK]; 3];

/// Up to this many empty slots are put in to join two runs: about what the start of a run costs.
const LONGEST_GAP: u32 = 8;

/// Runs below this length are computed as loose springs.
const SHORTEST_RUN: u32 = 12;

/// Shorter than this a spring counts as having no direction, and gives no force; mm.
const SHORTEST: f32 = 1e-9;

impl Springs {
    /// Springs that all live. One array entry a spring in every argument.
    pub fn new(
        nodes: Vec<[u32; 2]>,
        stiffness: &[f32],
        rest_length: &[f32],
        behind: Vec<u16>,
        backing: Vec<f32>,
    ) -> Springs {
        let (runs, slot, loose, slots) = lay_out(&nodes);
        let by_slot = |values: &[f32]| {
            let mut by_slot = vec![0.0; slots];
            slot.iter()
                .zip(values)
                .for_each(|(&slot, &value)| by_slot[slot as usize] = value);
            by_slot
        };
        Springs {
            alive: vec![true; nodes.len()],
            stiffness: by_slot(stiffness),
            rest_length: by_slot(rest_length),
            nodes,
            behind,
            backing,
            slot,
            runs,
            loose,
        }
    }

    /// Stiffness of a spring, µN/mm.
    #[inline]
    pub fn stiffness(&self, spring: u32) -> f32 {
        self.stiffness[self.slot[spring as usize] as usize]
    }

    pub fn set_stiffness(&mut self, spring: u32, stiffness: f32) {
        self.stiffness[self.slot[spring as usize] as usize] = stiffness;
    }

    /// Rest length of a spring, mm.
    #[inline]
    pub fn rest_length(&self, spring: u32) -> f32 {
        self.rest_length[self.slot[spring as usize] as usize]
    }

    pub fn set_rest_length(&mut self, spring: u32, rest_length: f32) {
        self.rest_length[self.slot[spring as usize] as usize] = rest_length;
    }

    /// Sums the stiffness of the springs around every node, µN/mm.
    pub fn sum_stiffness(&self, sums: &mut [f32]) {
        sums.fill(0.0);
        for run in &self.runs {
            let (first, length) = (run.first as usize, run.length as usize);
            for end in [run.a as usize, run.b as usize] {
                for (sum, stiffness) in sums[end..end + length]
                    .iter_mut()
                    .zip(&self.stiffness[first..first + length])
                {
                    *sum += stiffness;
                }
            }
        }
        for (ends, stiffness) in self.loose.iter().zip(&self.stiffness[self.first_loose()..]) {
            ends.iter().for_each(|&end| sums[end as usize] += stiffness);
        }
    }

    /// Adds the force of every spring to its nodes, µN: equation (2) of the papers with the sign of a pull.
    ///
    /// Inlined into callers that were compiled for wider registers.
    #[inline(always)]
    pub fn add_forces(&self, positions: &Vectors, forces: &mut Vectors) {
        for run in &self.runs {
            let (first, a, b) = (run.first as usize, run.a as usize, run.b as usize);
            for start in (0..run.length as usize).step_by(CHUNK) {
                let (a, b) = (a + start, b + start);
                let pull = self.pull(first + start, positions.chunk(a), positions.chunk(b));
                forces.add_chunk(a, 1.0, &pull);
                forces.add_chunk(b, -1.0, &pull);
            }
        }
        self.add_loose_forces(positions, forces);
    }

    /// The springs outside of runs: positions are gathered, forces scattered, and only what lies between is vectorised.
    #[inline(always)]
    fn add_loose_forces(&self, positions: &Vectors, forces: &mut Vectors) {
        for (chunk, ends) in self.loose.chunks(CHUNK).enumerate() {
            let mut places = [[[0.0; CHUNK]; 3]; 2];
            for (n, pair) in ends.iter().enumerate() {
                for (places, &node) in places.iter_mut().zip(pair) {
                    [places[0][n], places[1][n], places[2][n]] = positions.get(node as usize);
                }
            }
            let pull = self.pull(self.first_loose() + chunk * CHUNK, places[0], places[1]);
            for (n, &[a, b]) in ends.iter().enumerate() {
                let pull = Vec3::new(pull[0][n], pull[1][n], pull[2][n]);
                forces.add(a, pull);
                forces.add(b, -pull);
            }
        }
    }

    /// Pull on the first node of each slot of a chunk that begins with slot `first`, µN.
    #[inline(always)]
    fn pull(&self, first: usize, a: [[f32; CHUNK]; 3], b: [[f32; CHUNK]; 3]) -> Pull {
        let stiffness: &[f32; CHUNK] = chunk(&self.stiffness, first);
        let rest_length: &[f32; CHUNK] = chunk(&self.rest_length, first);
        let mut pull = [[0.0; CHUNK]; 3];
        for n in 0..CHUNK {
            let (dx, dy, dz) = (b[0][n] - a[0][n], b[1][n] - a[1][n], b[2][n] - a[2][n]);
            let distance = (dx * dx + dy * dy + dz * dz).sqrt();
            let tension = stiffness[n] * (distance - rest_length[n]) / distance.max(SHORTEST);
            pull[0][n] = tension * dx;
            pull[1][n] = tension * dy;
            pull[2][n] = tension * dz;
        }
        pull
    }

    fn first_loose(&self) -> usize {
        self.stiffness.len() - self.loose.len().next_multiple_of(CHUNK)
    }
}

/// Finds runs, the slot of every spring, the ends of loose springs, and the number of slots.
fn lay_out(nodes: &[[u32; 2]]) -> (Vec<Run>, Vec<u32>, Vec<[u32; 2]>, usize) {
    let mut order: Vec<u32> = (0..nodes.len() as u32).collect();
    let key = |spring: u32| {
        let [a, b] = nodes[spring as usize];
        (i64::from(b) - i64::from(a), a)
    };
    order.sort_by_key(|&spring| key(spring));
    // Stretches of `order` in which both nodes rise together, with at most a short gap from one spring to the next.
    let stretches = order.chunk_by(|&one, &next| {
        let ((offset, a), (next_offset, next_a)) = (key(one), key(next));
        offset == next_offset && next_a > a && next_a - a <= LONGEST_GAP + 1
    });
    let (mut runs, mut slot, mut alone) = (Vec::new(), vec![0u32; nodes.len()], Vec::new());
    let mut slots = 0;
    for stretch in stretches {
        let [a, b] = nodes[stretch[0] as usize];
        let [last, _] = nodes[stretch[stretch.len() - 1] as usize];
        let length = last - a + 1;
        if length < SHORTEST_RUN {
            alone.extend_from_slice(stretch);
            continue;
        }
        for &spring in stretch {
            slot[spring as usize] = slots + (nodes[spring as usize][0] - a);
        }
        runs.push(Run {
            first: slots,
            length,
            a,
            b,
        });
        slots += length.next_multiple_of(CHUNK as u32);
    }
    for (place, &spring) in (slots..).zip(&alone) {
        slot[spring as usize] = place;
    }
    let loose = alone.iter().map(|&spring| nodes[spring as usize]).collect();
    (runs, slot, loose, slots as usize + alone.len().next_multiple_of(CHUNK))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn springs(nodes: Vec<[u32; 2]>) -> Springs {
        let count = nodes.len();
        let stiffness: Vec<f32> = nodes.iter().map(|[a, _]| 3.0 + *a as f32).collect();
        let rest_length: Vec<f32> = nodes.iter().map(|[_, b]| 0.25 + 0.25 * *b as f32).collect();
        Springs::new(nodes, &stiffness, &rest_length, vec![1; count], vec![1.0; count])
    }

    fn curve(count: usize) -> Vectors {
        let place = |n: usize| {
            [
                (n as f32 * 0.31).sin() * 5.0,
                (n as f32 * 0.17).cos() * 5.0,
                n as f32 * 0.1,
            ]
        };
        (0..count).map(place).collect()
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
    fn internal_forces_sum_to_zero() {
        let mut forces = Vectors::zero(400);
        springs((0..393).map(|n| [n, n + 7]).collect()).add_forces(&curve(400), &mut forces);
        let (mut sum, mut size) = ([0.0f64; 3], 0.0f64);
        for n in 0..400 {
            for (sum, force) in sum.iter_mut().zip(forces.get(n)) {
                *sum += f64::from(force);
                size += f64::from(force.abs());
            }
        }
        let rounding = size * f64::from(f32::EPSILON);
        assert!(sum.iter().all(|sum| sum.abs() <= rounding), "{sum:?} of {size}");
    }

    #[test]
    fn forces_are_those_of_each_spring_alone_whatever_the_layout() {
        // Long runs with gaps to fill, springs that run backwards, and springs that follow no order.
        let along = (0..300u32).filter(|n| n % 11 != 0).map(|n| [n, n + 9]);
        let back = (100..160u32).map(|n| [n, n - 50]);
        let wild = (0..40u32).map(|n| [(n * 37) % 400, (n * 53 + 1) % 400]);
        let nodes: Vec<[u32; 2]> = along.chain(wild).chain(back).collect();
        let (positions, together) = (curve(400), springs(nodes.clone()));
        assert!(
            together.runs.len() == 2 && together.loose.len() == 40,
            "{:?}",
            together.runs
        );
        let mut forces = Vectors::zero(400);
        together.add_forces(&positions, &mut forces);
        let mut one_by_one = Vectors::zero(400);
        for pair in nodes {
            springs(vec![pair]).add_forces(&positions, &mut one_by_one);
        }
        for n in 0..400 {
            for (x, y) in forces.get(n).into_iter().zip(one_by_one.get(n)) {
                assert!((x - y).abs() <= 1e-5 * x.abs().max(100.0), "node {n}: {x} {y}");
            }
        }
    }

    #[test]
    fn the_sum_of_stiffness_counts_each_spring_at_both_ends() {
        let nodes: Vec<[u32; 2]> = (0..50u32).map(|n| [n, n + 3]).chain([[20, 4], [51, 0]]).collect();
        let springs = springs(nodes.clone());
        let mut sums = vec![0.0; 53];
        springs.sum_stiffness(&mut sums);
        for (node, sum) in (0u32..).zip(sums) {
            let at_node = (0u32..).zip(&nodes).filter(|(_, ends)| ends.contains(&node));
            assert_eq!(sum, at_node.map(|(spring, _)| springs.stiffness(spring)).sum::<f32>());
        }
    }
}
