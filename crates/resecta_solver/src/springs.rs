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
//! the same whatever the width of the registers, and a product and a sum are fused on every processor (on those that cannot,
//! slowly), so forces have the same bits everywhere.
//!
//! Runs are cut at the boundaries of *blocks* of nodes, and slots follow the order block by block. Every spring leads from
//! a lower to a higher node, so once a block's springs are done, the forces on its nodes are complete and its positions are
//! not read again: the step moves these nodes at once, while all they need is in the nearest cache.
//!
//! A removed spring keeps its slot with stiffness 0: no run is broken, nothing is renumbered, and removal costs nothing in
//! the loop.

use std::ops::Range;

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
    blocks: Vec<Block>,
    runs: Vec<Run>,
    loose: Vec<Loose>,
}

/// The springs whose lower node is one of a block of consecutive nodes.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Block {
    pub nodes: Range<usize>,
    runs: Range<usize>,
    loose: Range<usize>,
}

/// The slots from `first` on join nodes `a + n` and `b + n`.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Run {
    first: u32,
    length: u32,
    a: u32,
    b: u32,
}

/// Up to [`CHUNK`] springs that are in no run, in the slots from `first` on.
#[derive(Debug, Clone, PartialEq)]
struct Loose {
    first: u32,
    ends: Vec<[u32; 2]>,
}

/// Nodes a block: positions and forces of a block and of the neighbours of a lattice layer further on fit the nearest
/// cache.
const BLOCK: u32 = 512;

/// Slots computed at a time: one register of 16 `f32`, two of 8, or four of 4.
pub(crate) const CHUNK: usize = 16;

/// The pulls of a chunk of slots: on the first node of each acts `tension` times `way`, on the second the opposite.
struct Pull {
    /// Tension over length, µN/mm.
    tension: [f32; CHUNK],
    /// From the first node to the second, by component, mm.
    way: [[f32; CHUNK]; 3],
}

/// Up to this many empty slots are put in to join two runs: about what the start of a run costs.
const LONGEST_GAP: u32 = 8;

/// Runs below this length are computed as loose springs.
const SHORTEST_RUN: u32 = 12;

/// Shorter than this a spring counts as having no direction, and gives no force; mm.
const SHORTEST: f32 = 1e-9;

impl Springs {
    /// Springs that all live, between `node_count` nodes. One array entry a spring in every other argument.
    pub fn new(
        node_count: usize,
        nodes: Vec<[u32; 2]>,
        stiffness: &[f32],
        rest_length: &[f32],
        behind: Vec<u16>,
        backing: Vec<f32>,
    ) -> Springs {
        let layout = Layout::of(&nodes, node_count);
        let by_slot = |values: &[f32]| {
            let mut by_slot = vec![0.0; layout.slots as usize];
            for (&slot, &value) in layout.slot.iter().zip(values) {
                by_slot[slot as usize] = value;
            }
            by_slot
        };
        Springs {
            alive: vec![true; nodes.len()],
            stiffness: by_slot(stiffness),
            rest_length: by_slot(rest_length),
            nodes,
            behind,
            backing,
            slot: layout.slot,
            blocks: layout.blocks,
            runs: layout.runs,
            loose: layout.loose,
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
        for loose in &self.loose {
            for (ends, stiffness) in loose.ends.iter().zip(&self.stiffness[loose.first as usize..]) {
                ends.iter().for_each(|&end| sums[end as usize] += stiffness);
            }
        }
    }

    /// The blocks, by rising nodes; together they hold every node once.
    pub fn blocks(&self) -> &[Block] {
        &self.blocks
    }

    /// Adds the force of every spring of a block to its nodes, µN: equation (2) of the papers with the sign of a pull. When
    /// it has been done for a block and all before it, the forces on the block's nodes are complete.
    ///
    /// Inlined into callers that were compiled for wider registers.
    #[inline(always)]
    pub fn add_forces(&self, block: &Block, positions: &Vectors, forces: &mut Vectors) {
        for run in &self.runs[block.runs.clone()] {
            let (first, a, b) = (run.first as usize, run.a as usize, run.b as usize);
            for start in (0..run.length as usize).step_by(CHUNK) {
                let (a, b) = (a + start, b + start);
                let pull = self.pull(first + start, positions.chunk(a), positions.chunk(b));
                forces.add_chunk(a, &pull.tension, &pull.way);
                forces.add_chunk(b, &pull.tension.map(|tension| -tension), &pull.way);
            }
        }
        // Positions are gathered, forces scattered, and only what lies between is vectorised.
        for loose in &self.loose[block.loose.clone()] {
            let mut places = [[[0.0; CHUNK]; 3]; 2];
            for (n, pair) in loose.ends.iter().enumerate() {
                for (places, &node) in places.iter_mut().zip(pair) {
                    [places[0][n], places[1][n], places[2][n]] = positions.get(node as usize);
                }
            }
            let pull = self.pull(loose.first as usize, places[0], places[1]);
            for (n, &[a, b]) in loose.ends.iter().enumerate() {
                let way = Vec3::new(pull.way[0][n], pull.way[1][n], pull.way[2][n]);
                forces.add(a, way * pull.tension[n]);
                forces.add(b, way * -pull.tension[n]);
            }
        }
    }

    /// The pulls of the chunk that begins with slot `first`.
    #[inline(always)]
    fn pull(&self, first: usize, a: [[f32; CHUNK]; 3], b: [[f32; CHUNK]; 3]) -> Pull {
        let stiffness: &[f32; CHUNK] = chunk(&self.stiffness, first);
        let rest_length: &[f32; CHUNK] = chunk(&self.rest_length, first);
        let mut pull = Pull {
            tension: [0.0; CHUNK],
            way: [[0.0; CHUNK]; 3],
        };
        for n in 0..CHUNK {
            let [dx, dy, dz] = [b[0][n] - a[0][n], b[1][n] - a[1][n], b[2][n] - a[2][n]];
            let distance = dx.mul_add(dx, dy.mul_add(dy, dz * dz)).sqrt();
            pull.tension[n] = stiffness[n] * (distance - rest_length[n]) / distance.max(SHORTEST);
            [pull.way[0][n], pull.way[1][n], pull.way[2][n]] = [dx, dy, dz];
        }
        pull
    }
}

/// Where everything goes.
struct Layout {
    blocks: Vec<Block>,
    runs: Vec<Run>,
    loose: Vec<Loose>,
    slot: Vec<u32>,
    slots: u32,
}

impl Layout {
    fn of(nodes: &[[u32; 2]], node_count: usize) -> Layout {
        let ends = |spring: u32| {
            let [a, b] = nodes[spring as usize];
            [a.min(b), a.max(b)]
        };
        // By block of the lower node, then by the distance between the nodes, then by the lower node.
        let key = |spring: u32| {
            let [low, high] = ends(spring);
            (low / BLOCK, high - low, low)
        };
        let mut order: Vec<u32> = (0..nodes.len() as u32).collect();
        order.sort_by_key(|&spring| key(spring));

        let mut layout = Layout {
            blocks: Vec::new(),
            runs: Vec::new(),
            loose: Vec::new(),
            slot: vec![0; nodes.len()],
            slots: 0,
        };
        let mut rest = &order[..];
        for number in 0..(node_count as u32).div_ceil(BLOCK) {
            let count = rest.iter().take_while(|&&spring| key(spring).0 == number).count();
            let (springs, others) = rest.split_at(count);
            rest = others;
            let (first_run, first_loose) = (layout.runs.len(), layout.loose.len());
            // Stretches in which both nodes rise together, with at most a short gap from one spring to the next.
            let stretches = springs.chunk_by(|&one, &next| {
                let ((_, distance, low), (_, next_distance, next_low)) = (key(one), key(next));
                distance == next_distance && next_low > low && next_low - low <= LONGEST_GAP + 1
            });
            let mut alone = Vec::new();
            for stretch in stretches {
                if ends(stretch[stretch.len() - 1])[0] - ends(stretch[0])[0] + 1 < SHORTEST_RUN {
                    alone.extend_from_slice(stretch);
                } else {
                    layout.add_run(stretch, &ends);
                }
            }
            for springs in alone.chunks(CHUNK) {
                layout.add_loose(springs, &ends);
            }
            let nodes = number * BLOCK..((number + 1) * BLOCK).min(node_count as u32);
            layout.blocks.push(Block {
                nodes: nodes.start as usize..nodes.end as usize,
                runs: first_run..layout.runs.len(),
                loose: first_loose..layout.loose.len(),
            });
        }
        layout
    }

    fn add_run(&mut self, stretch: &[u32], ends: &impl Fn(u32) -> [u32; 2]) {
        let [a, b] = ends(stretch[0]);
        let [last, _] = ends(stretch[stretch.len() - 1]);
        for &spring in stretch {
            self.slot[spring as usize] = self.slots + ends(spring)[0] - a;
        }
        let length = last - a + 1;
        self.runs.push(Run {
            first: self.slots,
            length,
            a,
            b,
        });
        self.slots += length.next_multiple_of(CHUNK as u32);
    }

    fn add_loose(&mut self, springs: &[u32], ends: &impl Fn(u32) -> [u32; 2]) {
        for (slot, &spring) in (self.slots..).zip(springs) {
            self.slot[spring as usize] = slot;
        }
        self.loose.push(Loose {
            first: self.slots,
            ends: springs.iter().map(|&spring| ends(spring)).collect(),
        });
        self.slots += CHUNK as u32;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn springs(nodes: Vec<[u32; 2]>) -> Springs {
        let count = nodes.len();
        let stiffness: Vec<f32> = nodes.iter().map(|[a, _]| 3.0 + *a as f32).collect();
        let rest_length: Vec<f32> = nodes.iter().map(|[_, b]| 0.25 + 0.25 * *b as f32).collect();
        let node_count = nodes.iter().flatten().max().map_or(0, |last| *last as usize + 1);
        Springs::new(
            node_count,
            nodes,
            &stiffness,
            &rest_length,
            vec![1; count],
            vec![1.0; count],
        )
    }

    fn add_forces(springs: &Springs, positions: &Vectors, forces: &mut Vectors) {
        for block in springs.blocks() {
            springs.add_forces(block, positions, forces);
        }
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
        add_forces(
            &springs,
            &Vectors::from_iter([[0.0, 0.0, 0.0], [3.0, 4.0, 0.0]]),
            &mut forces,
        );
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
        add_forces(&springs, &Vectors::from_iter([[1.0, 2.0, 3.0]; 2]), &mut forces);
        assert_eq!([forces.get(0), forces.get(1)], [[0.0; 3]; 2]);
    }

    #[test]
    fn internal_forces_sum_to_zero() {
        let mut forces = Vectors::zero(400);
        add_forces(
            &springs((0..393).map(|n| [n, n + 7]).collect()),
            &curve(400),
            &mut forces,
        );
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
        // Long runs with gaps to fill, over several blocks; springs that run backwards; springs that follow no order.
        let beside = (0..90u32).filter(|n| n % 7 != 0).map(|n| [n, n + 1]);
        let along = (0..1500u32).filter(|n| n % 11 != 0).map(|n| [n, n + 9]);
        let back = (100..160u32).map(|n| [n, n - 50]);
        let wild = (0..40u32).map(|n| [(n * 37) % 1500, (n * 53 + 1) % 1500]);
        let nodes: Vec<[u32; 2]> = along.chain(wild).chain(back).chain(beside).collect();
        let (positions, together) = (curve(1510), springs(nodes.clone()));
        assert!(
            together.blocks.len() == 3 && together.runs.len() == 5,
            "{:?}",
            together.runs
        );
        let mut forces = Vectors::zero(1510);
        add_forces(&together, &positions, &mut forces);
        let mut one_by_one = Vectors::zero(1510);
        for pair in nodes {
            add_forces(&springs(vec![pair]), &positions, &mut one_by_one);
        }
        for n in 0..1510 {
            for (x, y) in forces.get(n).into_iter().zip(one_by_one.get(n)) {
                assert!((x - y).abs() <= 1e-5 * x.abs().max(1000.0), "node {n}: {x} {y}");
            }
        }
    }

    #[test]
    fn the_forces_on_a_block_are_complete_once_it_is_done() {
        let springs = springs((0..1400u32).flat_map(|n| [[n, n + 1], [n + 100, n]]).collect());
        let positions = curve(1501);
        let mut all = Vectors::zero(1501);
        add_forces(&springs, &positions, &mut all);
        let mut so_far = Vectors::zero(1501);
        for block in springs.blocks() {
            springs.add_forces(block, &positions, &mut so_far);
            for node in block.nodes.clone() {
                assert_eq!(so_far.get(node), all.get(node));
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
