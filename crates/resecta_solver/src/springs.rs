//! Springs: where a spring's force is computed.
//!
//! A spring has an index, by which everybody else knows it, and a *slot*, where the hot loop finds its stiffness and rest
//! length: a lane of a *bundle* of eight. How bundles are laid out, and why, is in `runs.rs`: most springs are in *runs* of
//! bundles between whole sites, few are *loose* and gathered.
//!
//! A product and a sum are fused on every processor (on those that cannot, slowly), and the order of all sums is the same
//! whatever the instructions, so forces have the same bits everywhere.
//!
//! A removed spring keeps its slot with stiffness 0: nothing is renumbered, and removal costs nothing in the loop.

use std::cell::Cell;

use fearless_simd::{Simd, f32x8, f32x16, prelude::*};
use glam::Vec3;

use crate::pairs::{Pair, has_pairs, load_two};
use crate::runs::{Block, Layout, Loose, Run, with_turn};
use crate::sites::{LANES, Lanes};
use crate::sleep::Sleep;
use crate::vectors::{Registers, SiteVectors, Vectors, View, load};

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
    bundles: Vec<Bundle>,
    layout: Layout,
    presence_version: u64,
    /// The true stiffness of every spring, µN/mm, while some in `bundles` are softened (`soften.rs`); otherwise empty.
    unsoftened: Vec<f32>,
}

/// What the forces of up to eight springs follow from, a lane each.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Bundle {
    /// µN/mm; 0 for a spring that has been removed, and where there is none.
    pub stiffness: Lanes,
    /// mm.
    pub rest_length: Lanes,
}

/// At which ends of a run's springs forces are added.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Ends {
    Both,
    Low,
    High,
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
        let mut bundles = vec![Bundle::default(); layout.bundle_count()];
        for ((&slot, &stiffness), &rest_length) in slot.iter().zip(stiffness).zip(rest_length) {
            let (bundle, lane) = bundle_and_lane(slot);
            bundles[bundle].stiffness.0[lane] = stiffness;
            bundles[bundle].rest_length.0[lane] = rest_length;
        }
        Springs {
            alive: vec![true; nodes.len()],
            bundles,
            nodes,
            behind,
            backing,
            slot,
            layout,
            presence_version: 0,
            unsoftened: Vec::new(),
        }
    }

    /// Stiffness of a spring, µN/mm.
    #[inline]
    pub fn stiffness(&self, spring: u32) -> f32 {
        match self.unsoftened.get(spring as usize) {
            Some(&stiffness) => stiffness,
            None => self.stepped_stiffness(spring),
        }
    }

    /// Stiffness that a spring is stepped with, µN/mm: its own, or less while it is softened.
    #[inline]
    pub fn stepped_stiffness(&self, spring: u32) -> f32 {
        let (bundle, lane) = bundle_and_lane(self.slot[spring as usize]);
        self.bundles[bundle].stiffness.0[lane]
    }

    pub fn set_stiffness(&mut self, spring: u32, stiffness: f32) {
        if let Some(unsoftened) = self.unsoftened.get_mut(spring as usize) {
            *unsoftened = stiffness;
        }
        self.set_stepped_stiffness(spring, stiffness);
    }

    fn set_stepped_stiffness(&mut self, spring: u32, stiffness: f32) {
        let (bundle, lane) = bundle_and_lane(self.slot[spring as usize]);
        let own = &mut self.bundles[bundle].stiffness.0[lane];
        self.presence_version += u64::from((*own > 0.0) != (stiffness > 0.0));
        *own = stiffness;
    }

    /// A number that grows whenever a spring is removed.
    pub fn presence_version(&self) -> u64 {
        self.presence_version
    }

    /// Lets every spring be stepped with a stiffness that follows from its nodes, µN/mm, at most its own.
    pub fn soften(&mut self, to: impl Fn([u32; 2]) -> f32) {
        if self.unsoftened.is_empty() {
            self.unsoftened = (0..self.nodes.len() as u32)
                .map(|spring| self.stepped_stiffness(spring))
                .collect();
        }
        for spring in 0..self.nodes.len() as u32 {
            let own = self.unsoftened[spring as usize];
            self.set_stepped_stiffness(spring, own.min(to(self.nodes[spring as usize])));
        }
    }

    /// Steps every spring with its own stiffness again. Says whether some were softened.
    pub fn unsoften(&mut self) -> bool {
        let unsoftened = std::mem::take(&mut self.unsoftened);
        for (spring, &stiffness) in (0u32..).zip(&unsoftened) {
            self.set_stepped_stiffness(spring, stiffness);
        }
        !unsoftened.is_empty()
    }

    /// Springs that are softened.
    pub fn softened(&self) -> usize {
        let springs = (0u32..).zip(&self.unsoftened);
        springs
            .filter(|&(spring, &own)| self.stepped_stiffness(spring) < own)
            .count()
    }

    /// Rest length of a spring, mm.
    #[inline]
    pub fn rest_length(&self, spring: u32) -> f32 {
        let (bundle, lane) = bundle_and_lane(self.slot[spring as usize]);
        self.bundles[bundle].rest_length.0[lane]
    }

    pub fn set_rest_length(&mut self, spring: u32, rest_length: f32) {
        let (bundle, lane) = bundle_and_lane(self.slot[spring as usize]);
        self.bundles[bundle].rest_length.0[lane] = rest_length;
    }

    /// Where the springs are.
    pub fn layout(&self) -> &Layout {
        &self.layout
    }

    /// The bundles of a run.
    #[inline(always)]
    pub fn bundles(&self, run: &Run) -> &[Bundle] {
        &self.bundles[run.first_bundle..][..run.bundles]
    }

    /// The bundle of some loose springs.
    #[inline(always)]
    pub fn loose_bundle(&self, loose: &Loose) -> &Bundle {
        &self.bundles[loose.bundle]
    }

    /// Adds the force of every spring of a block to its nodes, µN: equation (2) of the papers with the sign of a pull. When
    /// it has been done for a block and all before it, the forces on the block's nodes are complete. Springs between blocks
    /// that sleep are left out, and the forces on nodes that sleep mean nothing.
    ///
    /// Inlined, as all that it calls, into callers that were compiled for wider registers.
    #[inline(always)]
    pub fn add_forces<S: Simd>(
        &self,
        simd: S,
        (number, block): (usize, &Block),
        sleep: &Sleep,
        positions: View,
        forces: &mut Vectors,
    ) {
        for run in self.layout.runs(block) {
            if !sleep.is_run_awake(number, run) {
                continue;
            }
            if run.is_chain() {
                let forces = &mut forces.values[run.low..][..run.bundles + 1];
                self.add_chain_forces(simd, run, positions, forces);
            } else {
                let forces = forces.shared([run.low, run.low + run.span], run.bundles);
                with_turn!(run.turn, self.add_run_forces(simd, run, positions, forces));
            }
        }
        for loose in self.layout.loose(block) {
            self.add_loose_forces(simd, loose, positions, |node, pull| forces.add(node, pull));
        }
    }

    /// Adds the forces of a run to those at its low and at its high sites.
    #[inline(always)]
    pub fn add_run_forces<const TURN: usize, const BACK: usize, S: Simd>(
        &self,
        simd: S,
        run: &Run,
        positions: View,
        [at_low, at_high]: [&[Cell<SiteVectors>]; 2],
    ) {
        let bundles = self.bundles(run);
        let [lows, highs] = [run.low, run.low + run.span].map(|first| &positions.values[first..][..bundles.len()]);
        let (at_low, at_high) = (&at_low[..bundles.len()], &at_high[..bundles.len()]);
        let mut first_alone = 0;
        // Where one spring ends in the site that the next begins in, two abreast would be summed in another order.
        if has_pairs(simd) && run.span > 1 {
            first_alone = bundles.len() - bundles.len() % 2;
            for n in (0..first_alone).step_by(2) {
                let of = |places: &[SiteVectors]| Pair::load(simd, [&places[n], &places[n + 1]]);
                let (low, high) = (of(lows), of(highs));
                let pulls = pulls_of_two(simd, &bundles[n], &bundles[n + 1], low, high.turned::<TURN>());
                let sums = |at: &[Cell<SiteVectors>]| Pair::load(simd, [&at[n].get(), &at[n + 1].get()]);
                (sums(at_low) + pulls).store([&at_low[n], &at_low[n + 1]]);
                (sums(at_high) - pulls.turned::<BACK>()).store([&at_high[n], &at_high[n + 1]]);
            }
        }
        for n in first_alone..bundles.len() {
            let (low, high) = (Registers::load(simd, &lows[n]), Registers::load(simd, &highs[n]));
            let pulls = pulls(simd, &bundles[n], low, high.turned::<TURN>());
            let sum = Registers::load(simd, &at_low[n].get());
            at_low[n].set((sum + pulls).stored());
            let sum = Registers::load(simd, &at_high[n].get());
            at_high[n].set((sum - pulls.turned::<BACK>()).stored());
        }
    }

    /// Adds the forces of a run in which every spring begins where the one before ends: positions are read once, and each
    /// site's two pulls are summed before they are added. The forces are those at its low sites and, if there is one more,
    /// at the last high site.
    #[inline(always)]
    pub fn add_chain_forces<S: Simd>(&self, simd: S, run: &Run, positions: View, forces: &mut [SiteVectors]) {
        let bundles = self.bundles(run);
        let places = &positions.values[run.low..][..bundles.len() + 1];
        let (forces, last) = forces.split_at_mut(bundles.len());
        let mut low = Registers::load(simd, &places[0]);
        let mut before = Registers::zero(simd);
        for n in 0..bundles.len() {
            let high = Registers::load(simd, &places[n + 1]);
            let pulls = pulls(simd, &bundles[n], low, high);
            let sum = Registers::load(simd, &forces[n]);
            forces[n] = (sum + (pulls - before)).stored();
            (low, before) = (high, pulls);
        }
        if let [last, ..] = last {
            *last = (Registers::load(simd, last) - before).stored();
        }
    }

    /// Positions are gathered, forces handed out a node each, and only what lies between is done in registers.
    #[inline(always)]
    pub fn add_loose_forces<S: Simd>(&self, simd: S, loose: &Loose, positions: View, mut add: impl FnMut(u32, Vec3)) {
        let [a, b] = gather(loose, positions);
        let (a, b) = (Registers::load(simd, &a), Registers::load(simd, &b));
        let pulls = pulls(simd, self.loose_bundle(loose), a, b).stored();
        for (lane, &[a, b]) in loose.ends.iter().enumerate() {
            let pull = Vec3::from_array(pulls.map(|component| component.0[lane]));
            add(a, pull);
            add(b, -pull);
        }
    }
}

/// Where the first and the second nodes of loose springs are; 0 past the last spring.
#[inline(always)]
pub(crate) fn gather(loose: &Loose, positions: View) -> [SiteVectors; 2] {
    let mut places = [SiteVectors::default(); 2];
    for (lane, pair) in loose.ends.iter().enumerate() {
        for (places, &node) in places.iter_mut().zip(pair) {
            for (component, place) in places.iter_mut().zip(positions.at(node).to_array()) {
                component.0[lane] = place;
            }
        }
    }
    places
}

/// The pulls of a bundle's springs on their first nodes, at `low`, µN; on the second, at `high`, act the opposites.
#[inline(always)]
fn pulls<S: Simd>(simd: S, bundle: &Bundle, low: Registers<S>, high: Registers<S>) -> Registers<S> {
    let way = high - low;
    let length = way.length_squared().sqrt();
    let elongation = length - load(simd, &bundle.rest_length);
    let tension = load(simd, &bundle.stiffness) * elongation;
    way.times(tension / length.max(f32x8::splat(simd, SHORTEST)))
}

/// The same of two bundles.
#[inline(always)]
fn pulls_of_two<S: Simd>(simd: S, first: &Bundle, second: &Bundle, low: Pair<S>, high: Pair<S>) -> Pair<S> {
    let way = high - low;
    let length = way.length_squared().sqrt();
    let elongation = length - load_two(simd, &first.rest_length, &second.rest_length);
    let tension = load_two(simd, &first.stiffness, &second.stiffness) * elongation;
    way.times(tension / length.max(f32x16::splat(simd, SHORTEST)))
}

fn bundle_and_lane(slot: u32) -> (usize, usize) {
    (slot as usize / LANES, slot as usize % LANES)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::widest::{Widened, with_widest};

    fn springs(node_count: usize, nodes: Vec<[u32; 2]>) -> Springs {
        let count = nodes.len();
        let stiffness: Vec<f32> = nodes.iter().map(|[a, _]| 3.0 + *a as f32).collect();
        let rest_length: Vec<f32> = nodes.iter().map(|[_, b]| 0.25 + 0.25 * *b as f32).collect();
        Springs::new(
            node_count,
            nodes,
            &stiffness,
            &rest_length,
            vec![1; count],
            vec![1.0; count],
        )
    }

    struct OfBlock<'a>(&'a Springs, &'a Block, &'a Vectors, &'a mut Vectors);

    impl Widened for OfBlock<'_> {
        type Output = ();

        #[inline(always)]
        fn run<S: Simd>(self, simd: S) {
            let OfBlock(springs, block, positions, forces) = self;
            let awake = Sleep::none(springs.layout());
            springs.add_forces(simd, (0, block), &awake, positions.view(), forces);
        }
    }

    fn forces(springs: &Springs, positions: &Vectors) -> Vectors {
        let mut forces = Vectors::zero(springs.layout().sites());
        for block in springs.layout().blocks() {
            with_widest(OfBlock(springs, block, positions, &mut forces));
        }
        forces
    }

    fn curve(springs: &Springs) -> Vectors {
        let sites = springs.layout().sites();
        let place = |n: usize| {
            let n = n as f32;
            Vec3::new((n * 0.31).sin() * 5.0, (n * 0.17).cos() * 5.0, n * 0.1)
        };
        Vectors::of(sites, (0..sites.nodes()).map(place))
    }

    #[test]
    fn a_spring_pulls_with_stiffness_times_elongation_along_its_axis() {
        let springs = springs(2, vec![[0, 1]]);
        let places = [Vec3::ZERO, Vec3::new(3.0, 4.0, 0.0)];
        let forces = forces(&springs, &Vectors::of(springs.layout().sites(), places));
        // Length 5, rest 0.5, stiffness 3: 13.5 µN along (0.6, 0.8).
        assert!(
            forces.at(0).abs_diff_eq(Vec3::new(8.1, 10.8, 0.0), 1e-5),
            "{}",
            forces.at(0)
        );
        assert_eq!(forces.at(1), -forces.at(0));
    }

    #[test]
    fn a_spring_without_length_gives_no_force_and_no_nan() {
        let springs = springs(2, vec![[0, 1]]);
        let places = [Vec3::new(1.0, 2.0, 3.0); 2];
        let forces = forces(&springs, &Vectors::of(springs.layout().sites(), places));
        assert_eq!([forces.at(0), forces.at(1)], [Vec3::ZERO; 2]);
    }

    #[test]
    fn internal_forces_sum_to_zero() {
        let springs = springs(400, (0..393).map(|n| [n, n + 7]).collect());
        let forces = forces(&springs, &curve(&springs));
        let (mut sum, mut size) = ([0.0f64; 3], 0.0f64);
        for n in 0..400 {
            for (sum, force) in sum.iter_mut().zip(forces.at(n).to_array()) {
                *sum += f64::from(force);
                size += f64::from(force.abs());
            }
        }
        let rounding = size * f64::from(f32::EPSILON);
        assert!(sum.iter().all(|sum| sum.abs() <= rounding), "{sum:?} of {size}");
    }

    #[test]
    fn forces_are_those_of_each_spring_alone_whatever_the_layout() {
        // Families with gaps, over several blocks and ranges of lanes; springs that run backwards; some twice; springs
        // within a site; springs that follow no order.
        const COUNT: u32 = 4510;
        let family = |span: u32, gap: u32| {
            let firsts = (0..COUNT - span).filter(move |n| n % gap != 0);
            firsts.map(move |n| [n, n + span])
        };
        let back = (100..160u32).flat_map(|n| [[n, n - 50], [n, n - 50]]);
        let ring = (0..COUNT / 51).map(|n| [51 * n, (51 * n + 50).min(COUNT - 1)]);
        let wild = (0..40u32).map(|n| [(n * 37) % COUNT, (n * 53 + 1) % COUNT]);
        let nodes: Vec<[u32; 2]> = family(9, 11)
            .chain(family(663, 13))
            .chain(family(1200, 7))
            .chain(wild)
            .chain(back)
            .chain(ring)
            .chain(family(1, 51))
            .collect();
        let springs = springs(COUNT as usize, nodes.clone());
        let layout = springs.layout();
        let turns: Vec<usize> = layout
            .blocks()
            .iter()
            .flat_map(|block| layout.runs(block).iter().map(|run| run.turn))
            .collect();
        assert!([0, 1, 2, 7].iter().all(|turn| turns.contains(turn)), "{turns:?}");
        assert!(layout.blocks().iter().any(|block| !layout.loose(block).is_empty()));
        let positions = curve(&springs);
        let together = forces(&springs, &positions);
        let mut alone = vec![(glam::DVec3::ZERO, 0.0); COUNT as usize];
        for (spring, [a, b]) in (0u32..).zip(nodes) {
            let way = (positions.at(b) - positions.at(a)).as_dvec3();
            let (stiffness, rest) = (springs.stiffness(spring), springs.rest_length(spring));
            let (direction, length) = way.normalize_and_length();
            let pull = direction * f64::from(stiffness) * (length - f64::from(rest));
            // Of a difference of two lengths the longer one rounds.
            let size = f64::from(stiffness) * length.max(f64::from(rest));
            for (node, pull) in [(a, pull), (b, -pull)] {
                let (sum, sizes) = &mut alone[node as usize];
                *sum += pull;
                *sizes += size;
            }
        }
        for (node, (sum, size)) in (0u32..).zip(alone) {
            let off = together.at(node).as_dvec3().distance(sum);
            assert!(
                off <= 8.0 * f64::from(f32::EPSILON) * size,
                "node {node}: {off} of {size}"
            );
        }
    }

    #[test]
    fn the_forces_on_a_block_are_complete_once_it_is_done() {
        let nodes = (0..1400u32).flat_map(|n| [[n, n + 1], [n + 100, n], [n % 9, n + 2]]);
        let springs = springs(1501, nodes.collect());
        let positions = curve(&springs);
        let all = forces(&springs, &positions);
        let mut so_far = Vectors::zero(springs.layout().sites());
        for block in springs.layout().blocks() {
            with_widest(OfBlock(&springs, block, &positions, &mut so_far));
            assert_eq!(so_far.values[block.sites.clone()], all.values[block.sites.clone()]);
        }
    }
}
