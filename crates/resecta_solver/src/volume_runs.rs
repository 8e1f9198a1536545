//! How pentahedra are laid out for the loop of `volumes.rs`: as springs are in `runs.rs`, with six ends in place of two.
//!
//! A *bundle* is up to eight pentahedra whose first corners share a site, a lane each, and whose other corners lie at the
//! same sites and lanes on from there. Bundles of the same steps from consecutive sites are a *run*; the rest are *loose*.
//! Each belongs to the block of its lowest corner: once that block and those before are done, the forces on the block's
//! nodes are complete, and no later block reads their positions again.

use std::ops::Range;

use crate::runs::BLOCK;
use crate::sites::{LANES, Sites};

/// Where the pentahedra of a tissue are.
#[derive(Debug, Clone)]
pub(crate) struct VolumeLayout {
    blocks: Vec<Block>,
    runs: Vec<Run>,
    loose: Vec<Loose>,
    bundle_count: usize,
}

#[derive(Debug, Clone)]
struct Block {
    runs: Range<usize>,
    loose: Range<usize>,
}

/// Bundles `first_bundle + n`, whose corners are at the sites `firsts + n`. A pentahedron in lane l has a corner in lane
/// `(l + turn) % 8`.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Run {
    pub first_bundle: usize,
    pub bundles: usize,
    pub firsts: [usize; 6],
    pub turns: [u8; 6],
    /// The blocks that the corners lie in.
    pub blocks: Vec<u32>,
}

/// Up to [`LANES`] pentahedra that are in no run.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Loose {
    pub bundle: usize,
    pub corners: Vec<[u32; 6]>,
    /// The blocks that the corners lie in.
    pub blocks: Vec<u32>,
}

/// Up to this many empty bundles are put in to join two runs.
const LONGEST_GAP: usize = 1;

/// What things cost, in cycles, roughly: to choose between runs and loose.
const COST_OF_BUNDLE: usize = 70;
const COST_OF_RUN: usize = 40;
const COST_OF_LOOSE: usize = 60;

/// How the corners of a pentahedron lie to each other. The order is that of slots.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct Way {
    block: usize,
    spans: [isize; 6],
    turns: [u8; 6],
    low: usize,
    lane: usize,
}

impl Way {
    fn of(sites: &Sites, corners: &[u32; 6]) -> Way {
        let places = corners.map(|corner| sites.place(corner));
        let (low, lane) = places[0];
        let lowest = places.iter().fold(low, |lowest, place| lowest.min(place.0));
        Way {
            block: lowest / BLOCK,
            spans: places.map(|(site, _)| site as isize - low as isize),
            turns: places.map(|(_, other)| ((other + LANES - lane) % LANES) as u8),
            low,
            lane,
        }
    }

    /// Whether a run can go on with `next`: it lies in the same way, and not far on.
    fn goes_on(&self, next: &Way) -> bool {
        (self.block, self.spans, self.turns) == (next.block, next.spans, next.turns)
            && next.low - self.low <= LONGEST_GAP + 1
            && (self.low, self.lane) != (next.low, next.lane)
    }
}

impl VolumeLayout {
    /// Lays out pentahedra by their corners; also gives each its slot.
    pub fn of(sites: Sites, corners: &[[u32; 6]]) -> (VolumeLayout, Vec<u32>) {
        let mut ways: Vec<(Way, u32)> = corners
            .iter()
            .map(|corners| Way::of(&sites, corners))
            .zip(0..)
            .collect();
        ways.sort_unstable();
        let mut layout = VolumeLayout {
            blocks: Vec::new(),
            runs: Vec::new(),
            loose: Vec::new(),
            bundle_count: 0,
        };
        let mut slot = vec![0; corners.len()];
        let mut rest = &ways[..];
        for number in 0..sites.count().div_ceil(BLOCK) {
            let (own, others) = rest.split_at(rest.partition_point(|(way, _)| way.block == number));
            rest = others;
            let (first_run, first_loose) = (layout.runs.len(), layout.loose.len());
            let mut alone = Vec::new();
            for stretch in own.chunk_by(|(one, _), (next, _)| one.goes_on(next)) {
                let bundles = stretch[stretch.len() - 1].0.low - stretch[0].0.low + 1;
                if stretch.len() * COST_OF_LOOSE <= COST_OF_RUN + bundles * COST_OF_BUNDLE {
                    alone.extend(stretch.iter().map(|(_, pentahedron)| *pentahedron));
                } else {
                    layout.add_run(stretch, bundles, &mut slot);
                }
            }
            for pentahedra in alone.chunks(LANES) {
                layout.add_loose(&sites, pentahedra, corners, &mut slot);
            }
            layout.blocks.push(Block {
                runs: first_run..layout.runs.len(),
                loose: first_loose..layout.loose.len(),
            });
        }
        (layout, slot)
    }

    fn add_run(&mut self, stretch: &[(Way, u32)], bundles: usize, slot: &mut [u32]) {
        let Way { spans, turns, low, .. } = stretch[0].0;
        for (way, pentahedron) in stretch {
            slot[*pentahedron as usize] = ((self.bundle_count + way.low - low) * LANES + way.lane) as u32;
        }
        let firsts = spans.map(|span| low.wrapping_add_signed(span));
        self.runs.push(Run {
            first_bundle: self.bundle_count,
            bundles,
            firsts,
            turns,
            blocks: distinct(firsts.iter().flat_map(|&first| [first, first + bundles - 1])),
        });
        self.bundle_count += bundles;
    }

    fn add_loose(&mut self, sites: &Sites, pentahedra: &[u32], corners: &[[u32; 6]], slot: &mut [u32]) {
        for (&pentahedron, at) in pentahedra.iter().zip((self.bundle_count * LANES) as u32..) {
            slot[pentahedron as usize] = at;
        }
        let corners: Vec<[u32; 6]> = pentahedra.iter().map(|&index| corners[index as usize]).collect();
        self.loose.push(Loose {
            bundle: self.bundle_count,
            blocks: distinct(corners.iter().flatten().map(|&node| sites.place(node).0)),
            corners,
        });
        self.bundle_count += 1;
    }

    /// Bundles there are, those of loose pentahedra included.
    pub fn bundle_count(&self) -> usize {
        self.bundle_count
    }

    /// The runs of a block, by its number.
    #[inline(always)]
    pub fn runs(&self, block: usize) -> &[Run] {
        &self.runs[self.blocks[block].runs.clone()]
    }

    /// The loose pentahedra of a block, by bundles.
    #[inline(always)]
    pub fn loose(&self, block: usize) -> &[Loose] {
        &self.loose[self.blocks[block].loose.clone()]
    }

    pub fn block_count(&self) -> usize {
        self.blocks.len()
    }

    /// The blocks that each run and each bundle of loose pentahedra reaches.
    pub fn reached(&self) -> impl Iterator<Item = &[u32]> {
        let runs = self.runs.iter().map(|run| &run.blocks[..]);
        runs.chain(self.loose.iter().map(|loose| &loose.blocks[..]))
    }
}

/// The blocks of some sites, each once. (No run is longer than a block, so its ends name all blocks of a corner.)
fn distinct(sites: impl Iterator<Item = usize>) -> Vec<u32> {
    let mut blocks: Vec<u32> = sites.map(|site| (site / BLOCK) as u32).collect();
    blocks.sort_unstable();
    blocks.dedup();
    blocks
}
