//! Runs: how the springs are laid out for the hot loop.
//!
//! A *bundle* is up to eight springs that lead from the nodes of one site to those of another, one a lane: `low`, the site
//! with the smaller number, and `low + span`. Where a spring leads from one range of nodes to the next (`sites.rs`), the
//! lanes of the other end are turned on by `turn`. Bundles of the same span and turn from consecutive sites are a *run*,
//! with consecutive slots; a lattice numbered along its rings falls into few long ones. Lanes in which there is no spring
//! have stiffness 0. Springs that share their bundle with too few others are *loose*: computed from gathered positions.
//!
//! Runs are cut at the boundaries of *blocks* of sites, and slots follow the order block by block. Since every spring leads
//! from a lower to a higher site, once a block's springs are done, the forces on its nodes are complete and their positions
//! are not read again: the step moves these nodes at once, while all they need is in the nearest cache.

use std::collections::HashMap;
use std::ops::Range;

use crate::sites::{LANES, Sites};

/// Where the springs of a tissue are.
#[derive(Debug, Clone)]
pub(crate) struct Layout {
    sites: Sites,
    blocks: Vec<Block>,
    runs: Vec<Run>,
    loose: Vec<Loose>,
    bundle_count: usize,
}

/// The springs whose lower site is one of a block of consecutive sites.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Block {
    pub sites: Range<usize>,
    runs: Range<usize>,
    loose: Range<usize>,
}

/// Bundles `first_bundle + n` that lead from site `low + n` to site `low + span + n`, `n < bundles`. A spring in lane l ends
/// in lane `(l + turn) % 8`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Run {
    pub first_bundle: usize,
    pub bundles: usize,
    pub low: usize,
    pub span: usize,
    pub turn: usize,
}

impl Run {
    /// Whether every spring begins where the one before ends.
    #[inline(always)]
    pub fn is_chain(&self) -> bool {
        (self.span, self.turn) == (1, 0)
    }
}

/// Up to [`LANES`] springs that are in no run.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Loose {
    pub bundle: usize,
    /// The nodes of each.
    pub ends: Vec<[u32; 2]>,
}

/// Sites a block: positions and forces of a block, and of the neighbours a lattice layer further on, fit the nearest cache.
pub(crate) const BLOCK: usize = 64;

/// Up to this many empty bundles are put in to join two runs: about what the start of a run costs.
const LONGEST_GAP: usize = 2;

/// What things cost in a substep, in cycles measured on the papers' lattice: to choose between layouts.
const COST_OF_SITE: usize = 20;
const COST_OF_BUNDLE: usize = 12;
const COST_OF_RUN: usize = 25;
const COST_OF_LOOSE: usize = 15;

/// Up to this share more sites than needed may be taken, if springs then fill their bundles better.
const MOST_SITES: f64 = 1.15;

/// How the ends of a spring lie to each other. The order is that of slots.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct Way {
    block: usize,
    span: usize,
    turn: usize,
    low: usize,
    lane: usize,
}

impl Way {
    fn of(sites: &Sites, ends: [u32; 2]) -> Way {
        let [mut low, mut high] = ends.map(|end| sites.place(end));
        if low.0 > high.0 {
            (low, high) = (high, low);
        }
        Way {
            block: low.0 / BLOCK,
            span: high.0 - low.0,
            turn: (high.1 + LANES - low.1) % LANES,
            low: low.0,
            lane: low.1,
        }
    }

    /// Whether a run can go on with `next`: it lies in the same way, and not far on.
    fn goes_on(&self, next: &Way) -> bool {
        (self.block, self.span, self.turn) == (next.block, next.span, next.turn)
            && next.low - self.low <= LONGEST_GAP + 1
            && (self.low, self.lane) != (next.low, next.lane)
            // Both ends in one site: they would be written in turn.
            && self.span > 0
    }
}

impl Layout {
    /// Lays out springs by their nodes; also gives each its slot. The number of sites is, of a few that fit the spans, the
    /// one whose substep costs least.
    pub fn of(ends: &[[u32; 2]], node_count: usize) -> (Layout, Vec<u32>) {
        let fewest = Sites::fewest(node_count);
        let mut spans: HashMap<u32, usize> = HashMap::new();
        for [a, b] in ends {
            *spans.entry(a.abs_diff(*b)).or_default() += 1;
        }
        let mut spans: Vec<(usize, u32)> = spans.into_iter().map(|(span, count)| (count, span)).collect();
        spans.sort_unstable_by(|one, other| other.cmp(one));
        let mut counts = vec![fewest.count()];
        for (_, span) in spans.into_iter().take(4) {
            // Gaps in the lattice, as where a ring closes, then fall on the same site in every lane.
            let whole = fewest.count().next_multiple_of(span.max(1) as usize);
            if whole as f64 <= MOST_SITES * fewest.count() as f64 && !counts.contains(&whole) {
                counts.push(whole);
            }
        }
        let layouts = counts
            .into_iter()
            .map(|count| Layout::with(Sites::new(node_count, count), ends));
        layouts
            .min_by_key(|(layout, _)| layout.cost())
            .expect("the fewest sites are one of the choices")
    }

    fn with(sites: Sites, ends: &[[u32; 2]]) -> (Layout, Vec<u32>) {
        let mut springs: Vec<(Way, u32)> = ends.iter().map(|ends| Way::of(&sites, *ends)).zip(0..).collect();
        springs.sort_unstable();
        let mut layout = Layout {
            sites,
            blocks: Vec::new(),
            runs: Vec::new(),
            loose: Vec::new(),
            bundle_count: 0,
        };
        let mut slot = vec![0; ends.len()];
        let mut rest = &springs[..];
        for first in (0..sites.count()).step_by(BLOCK) {
            let number = first / BLOCK;
            let (springs, others) = rest.split_at(rest.partition_point(|(way, _)| way.block == number));
            rest = others;
            let (first_run, first_loose) = (layout.runs.len(), layout.loose.len());
            let mut alone = Vec::new();
            for stretch in springs.chunk_by(|(one, _), (next, _)| one.goes_on(next)) {
                let bundles = stretch[stretch.len() - 1].0.low - stretch[0].0.low + 1;
                if stretch.len() * COST_OF_LOOSE <= COST_OF_RUN + bundles * COST_OF_BUNDLE {
                    alone.extend(stretch.iter().map(|(_, spring)| *spring));
                } else {
                    layout.add_run(stretch, bundles, &mut slot);
                }
            }
            for springs in alone.chunks(LANES) {
                layout.add_loose(springs, ends, &mut slot);
            }
            layout.blocks.push(Block {
                sites: first..(first + BLOCK).min(sites.count()),
                runs: first_run..layout.runs.len(),
                loose: first_loose..layout.loose.len(),
            });
        }
        (layout, slot)
    }

    fn add_run(&mut self, stretch: &[(Way, u32)], bundles: usize, slot: &mut [u32]) {
        let Way { span, turn, low, .. } = stretch[0].0;
        for (way, spring) in stretch {
            slot[*spring as usize] = ((self.bundle_count + way.low - low) * LANES + way.lane) as u32;
        }
        self.runs.push(Run {
            first_bundle: self.bundle_count,
            bundles,
            low,
            span,
            turn,
        });
        self.bundle_count += bundles;
    }

    fn add_loose(&mut self, springs: &[u32], ends: &[[u32; 2]], slot: &mut [u32]) {
        for (&spring, at) in springs.iter().zip((self.bundle_count * LANES) as u32..) {
            slot[spring as usize] = at;
        }
        self.loose.push(Loose {
            bundle: self.bundle_count,
            ends: springs.iter().map(|&spring| ends[spring as usize]).collect(),
        });
        self.bundle_count += 1;
    }

    /// Cycles of a substep, roughly.
    fn cost(&self) -> usize {
        let loose: usize = self.loose.iter().map(|loose| loose.ends.len()).sum();
        let bundles: usize = self.runs.iter().map(|run| run.bundles).sum();
        self.sites.count() * COST_OF_SITE
            + self.runs.len() * COST_OF_RUN
            + bundles * COST_OF_BUNDLE
            + loose * COST_OF_LOOSE
    }

    /// Where the nodes are.
    pub fn sites(&self) -> Sites {
        self.sites
    }

    /// Bundles there are, those of loose springs included.
    pub fn bundle_count(&self) -> usize {
        self.bundle_count
    }

    /// The blocks, by rising sites; together they hold every site once.
    pub fn blocks(&self) -> &[Block] {
        &self.blocks
    }

    /// The runs of a block.
    #[inline(always)]
    pub fn runs(&self, block: &Block) -> &[Run] {
        &self.runs[block.runs.clone()]
    }

    /// The loose springs of a block, by bundles.
    #[inline(always)]
    pub fn loose(&self, block: &Block) -> &[Loose] {
        &self.loose[block.loose.clone()]
    }
}

/// Calls a function, generic over `<TURN, BACK>`, for the turn of a run: how far lanes are turned on, and back.
macro_rules! with_turn {
    ($turn:expr, $object:ident . $function:ident ( $($argument:expr),* )) => {
        match $turn {
            0 => $object.$function::<0, 0, _>($($argument),*),
            1 => $object.$function::<1, 7, _>($($argument),*),
            2 => $object.$function::<2, 6, _>($($argument),*),
            3 => $object.$function::<3, 5, _>($($argument),*),
            4 => $object.$function::<4, 4, _>($($argument),*),
            5 => $object.$function::<5, 3, _>($($argument),*),
            6 => $object.$function::<6, 2, _>($($argument),*),
            _ => $object.$function::<7, 1, _>($($argument),*),
        }
    };
}
pub(crate) use with_turn;
