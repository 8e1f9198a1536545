//! Runs: how the springs are laid out for the hot loop.
//!
//! Springs lead from a lower to a higher node. They are sorted by the distance between their two nodes (in indices), then
//! by the first, and each stretch in which both nodes rise by one is a *run*, whose springs have consecutive slots. A
//! lattice numbered along its rings falls into few long runs; their forces read and write contiguous memory, the compiler
//! turns the loop into vector instructions, and nothing is gathered. A run begins at the boundary of a chunk of nodes and
//! ends with a whole chunk; gaps in it are filled with slots of stiffness 0, which cost less than a new run or a loop for
//! the rest. Springs in runs too short to pay are *loose*: computed from gathered positions.
//!
//! Runs are cut at the boundaries of *blocks* of nodes, and slots follow the order block by block. Since every spring leads
//! from a lower to a higher node, once a block's springs are done, the forces on its nodes are complete and its positions
//! are not read again: the step moves these nodes at once, while all they need is in the nearest cache.
//!
//! Runs were measured against doing all springs of 16 nodes at a time with their forces kept in registers, which touches
//! memory less: runs are 1.4 times faster, since the roots and divisions of a long loop overlap.

use std::ops::Range;

use crate::aligned::CHUNK;
use crate::vectors::{Chunk, Vectors};

/// Where the springs of a tissue are.
#[derive(Debug, Clone)]
pub(crate) struct Layout {
    blocks: Vec<Block>,
    runs: Vec<Run>,
    loose: Vec<Loose>,
    slot_count: usize,
}

/// The springs whose lower node is one of a block of consecutive nodes.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Block {
    pub nodes: Range<usize>,
    runs: Range<usize>,
    loose: Range<usize>,
}

/// Springs that join node `a + n` and node `b + n`, and have slot `first_slot + n`; whole chunks of them.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Run {
    pub first_slot: usize,
    pub chunks: usize,
    pub a: usize,
    pub b: usize,
}

/// Up to [`CHUNK`] springs that are in no run.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Loose {
    pub first_slot: usize,
    /// The nodes of each.
    pub ends: Vec<[u32; 2]>,
}

/// Nodes a block: positions and forces of a block and of the neighbours of a lattice layer further on fit the nearest
/// cache. Whole chunks.
const BLOCK: u32 = 512;

/// Up to this many empty slots are put in to join two runs: about what the start of a run costs.
const LONGEST_GAP: u32 = 8;

/// Runs below this length are computed as loose springs.
const SHORTEST_RUN: u32 = 12;

impl Loose {
    /// Positions of the first and of the second nodes; 0 past the last spring.
    #[inline(always)]
    pub fn gather(&self, positions: &Vectors) -> [Chunk; 2] {
        let mut places = [[[0.0; CHUNK]; 3]; 2];
        for (n, pair) in self.ends.iter().enumerate() {
            for (places, &node) in places.iter_mut().zip(pair) {
                [places[0][n], places[1][n], places[2][n]] = positions.get(node as usize);
            }
        }
        places
    }
}

impl Layout {
    /// Lays out springs by their nodes; also gives each its slot.
    pub fn of(nodes: &[[u32; 2]], node_count: usize) -> (Layout, Vec<u32>) {
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

        let mut slot = vec![0; nodes.len()];
        let mut layout = Layout {
            blocks: Vec::new(),
            runs: Vec::new(),
            loose: Vec::new(),
            slot_count: 0,
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
                    layout.add_run(stretch, ends, &mut slot);
                }
            }
            for springs in alone.chunks(CHUNK) {
                layout.add_loose(springs, ends, &mut slot);
            }
            let nodes = number * BLOCK..((number + 1) * BLOCK).min(node_count as u32);
            layout.blocks.push(Block {
                nodes: nodes.start as usize..nodes.end as usize,
                runs: first_run..layout.runs.len(),
                loose: first_loose..layout.loose.len(),
            });
        }
        (layout, slot)
    }

    fn add_run(&mut self, stretch: &[u32], ends: impl Fn(u32) -> [u32; 2], slot: &mut [u32]) {
        let [first, second] = ends(stretch[0]);
        let [last, _] = ends(stretch[stretch.len() - 1]);
        let a = first - first % CHUNK as u32;
        for &spring in stretch {
            slot[spring as usize] = self.slot_count as u32 + ends(spring)[0] - a;
        }
        let chunks = ((last - a) as usize + 1).div_ceil(CHUNK);
        self.runs.push(Run {
            first_slot: self.slot_count,
            chunks,
            a: a as usize,
            b: (a + second - first) as usize,
        });
        self.slot_count += chunks * CHUNK;
    }

    fn add_loose(&mut self, springs: &[u32], ends: impl Fn(u32) -> [u32; 2], slot: &mut [u32]) {
        for (at, &spring) in (self.slot_count as u32..).zip(springs) {
            slot[spring as usize] = at;
        }
        self.loose.push(Loose {
            first_slot: self.slot_count,
            ends: springs.iter().map(|&spring| ends(spring)).collect(),
        });
        self.slot_count += CHUNK;
    }

    /// Slots there are, empty ones included: whole chunks.
    pub fn slot_count(&self) -> usize {
        self.slot_count
    }

    /// The blocks, by rising nodes; together they hold every node once.
    pub fn blocks(&self) -> &[Block] {
        &self.blocks
    }

    /// The runs of a block.
    #[inline(always)]
    pub fn runs(&self, block: &Block) -> &[Run] {
        &self.runs[block.runs.clone()]
    }

    /// The loose springs of a block, by chunks.
    #[inline(always)]
    pub fn loose(&self, block: &Block) -> &[Loose] {
        &self.loose[block.loose.clone()]
    }
}
