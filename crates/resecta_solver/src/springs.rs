//! Springs: where a spring's force is computed.
//!
//! A spring has an index, by which everybody else knows it, and a *slot*, where the hot loop finds its stiffness and rest
//! length. How slots are laid out, and why, is in `runs.rs`: most springs are in *runs* that read and write contiguous
//! memory, few are *loose* and gathered.
//!
//! A product and a sum are fused on every processor (on those that cannot, slowly), and the order of all sums is the same
//! whatever the width of the registers, so forces have the same bits everywhere.
//!
//! A removed spring keeps its slot with stiffness 0: nothing is renumbered, and removal costs nothing in the loop.

use glam::Vec3;

use crate::aligned::{Aligned, CHUNK};
use crate::runs::{Block, Layout, Run};
use crate::vectors::{Chunk, Vectors};

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
    stiffness: Aligned,
    /// By slot: rest length, mm.
    rest_length: Aligned,
    layout: Layout,
}

/// The pulls of a chunk of slots: on the first node of each acts `tension` times `way`, on the second the opposite.
struct Pull {
    /// Tension over length, µN/mm.
    tension: [f32; CHUNK],
    /// From the first node to the second, by component, mm.
    way: Chunk,
}

/// Shorter than this a spring counts as having no direction, and gives no force; mm.
pub(crate) const SHORTEST: f32 = 1e-9;

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
        let (layout, slot) = Layout::of(&nodes, node_count);
        let by_slot = |values: &[f32]| {
            let mut by_slot = Aligned::filled(layout.slot_count(), 0.0);
            for (&slot, &value) in slot.iter().zip(values) {
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
            slot,
            layout,
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

    /// Where the springs are.
    pub fn layout(&self) -> &Layout {
        &self.layout
    }

    /// Stiffness, µN/mm, and rest length, mm, of `chunks` chunks of slots.
    #[inline(always)]
    pub fn chunks(&self, first_slot: usize, chunks: usize) -> [&[[f32; CHUNK]]; 2] {
        [&self.stiffness, &self.rest_length].map(|values| values.chunks(first_slot, chunks))
    }

    /// Adds the force of every spring of a block to its nodes, µN: equation (2) of the papers with the sign of a pull. When
    /// it has been done for a block and all before it, the forces on the block's nodes are complete.
    ///
    /// Inlined, as all that it calls, into callers that were compiled for wider registers.
    #[inline(always)]
    pub fn add_forces(&self, block: &Block, positions: &Vectors, forces: &mut Vectors) {
        for run in self.layout.runs(block) {
            if run.b == run.a + 1 {
                self.add_chain_forces(run, positions, forces);
                continue;
            }
            let [ax, ay, az] = positions.chunks(run.a, run.chunks);
            let [bx, by, bz] = positions.chunks(run.b, run.chunks);
            let [stiffness, rest_length] = self.chunks(run.first_slot, run.chunks);
            let [at_a, at_b] = forces.shared([run.a, run.b], run.chunks);
            for n in 0..run.chunks {
                let [a, b] = [[ax[n], ay[n], az[n]], [bx[n], by[n], bz[n]]];
                let pull = pull(&stiffness[n], &rest_length[n], &a, &b);
                at_a.add(n, &pull.tension, &pull.way);
                at_b.add(n, &pull.tension.map(|tension| -tension), &pull.way);
            }
        }
        // Positions are gathered, forces scattered, and only what lies between is vectorised.
        for loose in self.layout.loose(block) {
            let [a, b] = loose.gather(positions);
            let [stiffness, rest_length] = self.chunks(loose.first_slot, 1);
            let pull = pull(&stiffness[0], &rest_length[0], &a, &b);
            for (n, &[a, b]) in loose.ends.iter().enumerate() {
                let way = Vec3::new(pull.way[0][n], pull.way[1][n], pull.way[2][n]);
                forces.add(a, way * pull.tension[n]);
                forces.add(b, way * -pull.tension[n]);
            }
        }
    }

    /// Adds the forces of a run in which every spring begins where the one before ends. Each node's two pulls are summed in
    /// registers: added one after the other, each would wait for the other's store, of which it reads a part.
    #[inline(always)]
    fn add_chain_forces(&self, run: &Run, positions: &Vectors, forces: &mut Vectors) {
        let [ax, ay, az] = positions.chunks(run.a, run.chunks);
        let [bx, by, bz] = positions.chunks(run.b, run.chunks);
        let [stiffness, rest_length] = self.chunks(run.first_slot, run.chunks);
        let [at_a] = forces.shared([run.a], run.chunks);
        let mut carried = [0.0; 3];
        for n in 0..run.chunks {
            let [a, b] = [[ax[n], ay[n], az[n]], [bx[n], by[n], bz[n]]];
            let pull = pull(&stiffness[n], &rest_length[n], &a, &b);
            let mut sums = [[0.0; CHUNK]; 3];
            for axis in 0..3 {
                let pulls: [f32; CHUNK] = std::array::from_fn(|n| pull.tension[n] * pull.way[axis][n]);
                let mut before = [carried[axis]; CHUNK];
                before[1..].copy_from_slice(&pulls[..CHUNK - 1]);
                carried[axis] = pulls[CHUNK - 1];
                for n in 0..CHUNK {
                    sums[axis][n] = pulls[n] - before[n];
                }
            }
            at_a.add(n, &[1.0; CHUNK], &sums);
        }
        forces.add((run.a + run.chunks * CHUNK) as u32, -Vec3::from_array(carried));
    }
}

/// The pulls of a chunk of springs between nodes at `a` and at `b`.
#[inline(always)]
fn pull(stiffness: &[f32; CHUNK], rest_length: &[f32; CHUNK], a: &Chunk, b: &Chunk) -> Pull {
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
        for block in springs.layout().blocks() {
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
        // Families with gaps, over several blocks; springs that run backwards; springs that follow no order.
        let beside = (0..1490u32).filter(|n| n % 7 != 0).map(|n| [n, n + 1]);
        let near = (0..1500u32).filter(|n| n % 11 != 0).map(|n| [n, n + 9]);
        let far = (0..1450u32).filter(|n| n % 13 != 0).map(|n| [n, n + 57]);
        let back = (100..160u32).map(|n| [n, n - 50]);
        let wild = (0..40u32).map(|n| [(n * 37) % 1500, (n * 53 + 1) % 1500]);
        let nodes: Vec<[u32; 2]> = near.chain(far).chain(wild).chain(back).chain(beside).collect();
        let (positions, together) = (curve(1510), springs(nodes.clone()));
        let blocks = together.layout().blocks();
        let distances =
            |block| -> Vec<usize> { together.layout().runs(block).iter().map(|run| run.b - run.a).collect() };
        assert_eq!(
            blocks.iter().map(distances).collect::<Vec<_>>(),
            [vec![1, 9, 50, 57], vec![1, 9, 57], vec![1, 9, 57]]
        );
        let mut forces = Vectors::zero(1510);
        add_forces(&together, &positions, &mut forces);
        let (mut one_by_one, mut sizes) = (Vectors::zero(1510), Vectors::zero(1510));
        for pair in nodes {
            let mut alone = Vectors::zero(1510);
            add_forces(&springs(vec![pair]), &positions, &mut alone);
            for end in pair {
                one_by_one.add(end, alone.at(end));
                sizes.add(end, alone.at(end).abs());
            }
        }
        for n in 0..1510 {
            let sums = forces.get(n).into_iter().zip(one_by_one.get(n)).zip(sizes.get(n));
            for ((x, y), size) in sums {
                assert!((x - y).abs() <= 8.0 * f32::EPSILON * size, "node {n}: {x} {y}");
            }
        }
    }

    #[test]
    fn the_forces_on_a_block_are_complete_once_it_is_done() {
        let springs = springs(
            (0..1400u32)
                .flat_map(|n| [[n, n + 1], [n + 100, n], [n % 9, n + 2]])
                .collect(),
        );
        let positions = curve(1501);
        let mut all = Vectors::zero(1501);
        add_forces(&springs, &positions, &mut all);
        let mut so_far = Vectors::zero(1501);
        for block in springs.layout().blocks() {
            springs.add_forces(block, &positions, &mut so_far);
            for node in block.nodes.clone() {
                assert_eq!(so_far.get(node), all.get(node));
            }
        }
    }
}
