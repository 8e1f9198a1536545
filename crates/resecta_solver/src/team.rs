//! Threads: one tissue stepped by several, to the same bits as by one.
//!
//! The sites are cut into ranges of whole blocks, *parts*, one a thread. In a substep a thread sums the forces on the nodes of
//! its part and moves them, from the positions that all read to a second array that becomes the first afterwards; so the
//! threads wait for each other once a substep. A spring between two parts is computed by both, and each adds what acts on its own nodes.
//! Springs lead from lower to higher sites (`runs.rs`): what reaches into a part from parts before it is added first, in the
//! order of their blocks, then what the part's own blocks add. That is the order in which one thread adds, so sums have the
//! same bits, however many parts there are.

use std::cell::Cell;
use std::marker::PhantomData;
use std::ops::Range;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::{hint, mem, slice, thread};

use fearless_simd::Simd;

use crate::bed::Bed;
use crate::bound::Plan;
use crate::contact::Contact;
use crate::kick::Kick;
use crate::motion::moved;
use crate::runs::{BLOCK, Layout, Run, with_turn};
use crate::sites::Sites;
use crate::sleep::Sleep;
use crate::springs::{Ends, Springs};
use crate::tissue::Tissue;
use crate::vectors::{SiteVectors, Vectors, View};
use crate::widest::{Widened, with_widest};

/// Below so many sites, some 4,000 nodes, the threads would wait for each other longer than they save.
const FEWEST_SITES: usize = 500;

/// The threads of a tissue and what each does.
#[derive(Debug, Clone)]
pub(crate) struct Team {
    pool: Arc<rayon::ThreadPool>,
    parts: Vec<Part>,
    /// Where the nodes go in a substep.
    next: Vectors,
}

/// What one thread does.
#[derive(Debug, Clone)]
struct Part {
    sites: Range<usize>,
    /// Springs of blocks before the part that end in it, by block.
    reaching: Vec<Share>,
    /// Springs of each block of the part.
    own: Vec<Share>,
}

/// Springs of a block of which an end lies in a part.
#[derive(Debug, Clone)]
struct Share {
    block: usize,
    runs: Vec<(Run, Ends)>,
}

impl Team {
    /// Threads for a tissue with such springs; none where one thread is as fast, or no thread can be had.
    pub fn new(threads: usize, springs: &Springs) -> Option<Team> {
        let layout = springs.layout();
        let threads = threads.min(layout.blocks().len());
        if threads < 2 || layout.sites().count() < FEWEST_SITES {
            return None;
        }
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().ok()?;
        Some(Team {
            pool: Arc::new(pool),
            parts: parts(layout, threads),
            next: Vectors::zero(layout.sites()),
        })
    }

    /// Threads there are.
    pub fn threads(&self) -> usize {
        self.parts.len()
    }
}

/// Cuts the blocks into parts of about equal cost. Parts that much reaches into are made shorter, in a few rounds.
fn parts(layout: &Layout, threads: usize) -> Vec<Part> {
    const ROUNDS: usize = 12;
    let bundles: Vec<usize> = layout
        .blocks()
        .iter()
        .map(|block| layout.runs(block).iter().map(|run| run.bundles).sum::<usize>() + layout.loose(block).len())
        .collect();
    let all: usize = bundles.iter().sum();
    let mut shares = vec![1.0 / threads as f64; threads];
    let mut best: Option<(usize, Vec<Part>)> = None;
    for _ in 0..ROUNDS {
        let (mut parts, mut first, mut wanted, mut so_far) = (Vec::new(), 0, 0.0, 0);
        for (number, share) in shares.iter().enumerate() {
            wanted += share * all as f64;
            // Each part has a block at least, those that follow too.
            let most = bundles.len() - (threads - 1 - number);
            let mut end = first + 1;
            so_far += bundles[first];
            while end < most && (number == threads - 1 || (so_far as f64) < wanted) {
                so_far += bundles[end];
                end += 1;
            }
            parts.push(Part::of(layout, first..end));
            first = end;
        }
        let costs: Vec<usize> = parts.iter().map(Part::cost).collect();
        let largest = costs.iter().copied().max().unwrap_or(0);
        let mean = costs.iter().sum::<usize>() as f64 / threads as f64;
        for (share, cost) in shares.iter_mut().zip(&costs) {
            *share *= (mean / *cost as f64).sqrt();
        }
        let sum: f64 = shares.iter().sum();
        shares.iter_mut().for_each(|share| *share /= sum);
        if best.as_ref().is_none_or(|(least, _)| largest < *least) {
            best = Some((largest, parts));
        }
    }
    best.map(|(_, parts)| parts).unwrap_or_default()
}

impl Part {
    fn of(layout: &Layout, blocks: Range<usize>) -> Part {
        let sites = layout.blocks()[blocks.start].sites.start..layout.blocks()[blocks.end - 1].sites.end;
        let share = |number: usize, pieces: &dyn Fn(&Run, &mut Vec<(Run, Ends)>)| {
            let mut runs = Vec::new();
            for run in layout.runs(&layout.blocks()[number]) {
                pieces(run, &mut runs);
            }
            Share { block: number, runs }
        };
        let touches = |number: usize| {
            let loose = layout.loose(&layout.blocks()[number]);
            let places = loose.iter().flat_map(|loose| loose.ends.iter().flatten());
            places
                .into_iter()
                .any(|&end| sites.contains(&layout.sites().place(end).0))
        };
        let reaching = (0..blocks.start)
            .map(|number| share(number, &|run, runs| run.pieces_that_reach(&sites, runs)))
            .filter(|share| !share.runs.is_empty() || touches(share.block));
        Part {
            reaching: reaching.collect(),
            own: blocks
                .map(|number| share(number, &|run, runs| run.pieces_that_leave(&sites, runs)))
                .collect(),
            sites,
        }
    }

    /// Bundles that it computes.
    fn cost(&self) -> usize {
        let shares = self.reaching.iter().chain(&self.own);
        shares.flat_map(|share| &share.runs).map(|(run, _)| run.bundles).sum()
    }
}

impl Run {
    /// Bundles from `from` up to `to`.
    fn part(&self, bundles: Range<usize>) -> Run {
        Run {
            first_bundle: self.first_bundle + bundles.start,
            bundles: bundles.len(),
            low: self.low + bundles.start,
            ..*self
        }
    }

    /// Of a run whose low sites lie before some sites: the bundles whose high sites lie among them.
    fn pieces_that_reach(&self, sites: &Range<usize>, pieces: &mut Vec<(Run, Ends)>) {
        let high = self.low + self.span;
        let from = sites.start.saturating_sub(high).min(self.bundles);
        let to = sites.end.saturating_sub(high).min(self.bundles);
        if from < to {
            pieces.push((self.part(from..to), Ends::High));
        }
    }

    /// Of a run whose low sites lie among some sites: the bundles with both ends there, and those that lead out.
    fn pieces_that_leave(&self, sites: &Range<usize>, pieces: &mut Vec<(Run, Ends)>) {
        let inside = sites.end.saturating_sub(self.low + self.span).min(self.bundles);
        if self.is_chain() {
            // What acts on a node of a chain from both sides is summed first: it stays in one piece.
            pieces.push((*self, if inside < self.bundles { Ends::Low } else { Ends::Both }));
            return;
        }
        for (bundles, ends) in [(0..inside, Ends::Both), (inside..self.bundles, Ends::Low)] {
            if !bundles.is_empty() {
                pieces.push((self.part(bundles), ends));
            }
        }
    }
}

/// An array of all sites while the threads are at work: a part is written by its own thread only.
struct Shared<'a> {
    first: *mut SiteVectors,
    sites: usize,
    lives: PhantomData<&'a mut [SiteVectors]>,
}

// SAFETY: what is done to the array is left to the unsafe functions below.
unsafe impl Sync for Shared<'_> {}

impl<'a> Shared<'a> {
    fn of(array: &'a mut [SiteVectors]) -> Shared<'a> {
        Shared {
            first: array.as_mut_ptr(),
            sites: array.len(),
            lives: PhantomData,
        }
    }

    /// # Safety
    ///
    /// Until the slice is dropped nobody writes to the array.
    unsafe fn all(&self) -> &'a [SiteVectors] {
        // SAFETY: pointer and length are those of a slice that is borrowed for 'a.
        unsafe { slice::from_raw_parts(self.first, self.sites) }
    }

    /// # Safety
    ///
    /// Until the slice is dropped nobody else reads or writes these sites.
    unsafe fn part(&self, sites: &Range<usize>) -> &'a mut [SiteVectors] {
        assert!(sites.start <= sites.end && sites.end <= self.sites);
        // SAFETY: the range lies within a slice that is borrowed for 'a.
        unsafe { slice::from_raw_parts_mut(self.first.add(sites.start), sites.len()) }
    }
}

/// Where the threads wait for each other. They meet every few microseconds, so they spin; only one that waits long, because
/// another has no processor, lets others have its own.
struct Meeting {
    threads: usize,
    arrived: AtomicUsize,
    meetings: AtomicUsize,
}

impl Meeting {
    fn of(threads: usize) -> Meeting {
        Meeting {
            threads,
            arrived: AtomicUsize::new(0),
            meetings: AtomicUsize::new(0),
        }
    }

    /// Returns once all have called it as often.
    fn wait(&self) {
        const SPINS: u32 = 3_000;
        let meeting = self.meetings.load(Ordering::Relaxed);
        if self.arrived.fetch_add(1, Ordering::AcqRel) + 1 == self.threads {
            self.arrived.store(0, Ordering::Relaxed);
            self.meetings.store(meeting + 1, Ordering::Release);
            return;
        }
        let mut spins = 0;
        while self.meetings.load(Ordering::Acquire) == meeting {
            if spins < SPINS {
                spins += 1;
                hint::spin_loop();
            } else {
                thread::yield_now();
            }
        }
    }
}

/// Substeps without anything between them that is not a part's own, or the half kick that ends an advance.
struct Stretch<'a> {
    springs: &'a Springs,
    sleep: &'a Sleep,
    beds: Bed<'a>,
    sites: Sites,
    external: &'a [SiteVectors],
    /// Where the nodes are, and where they go in the next substep, by turns.
    places: [Shared<'a>; 2],
    forces: Shared<'a>,
    velocities: Shared<'a>,
    lost: Shared<'a>,
    /// The kicks of each substep.
    kicks: Vec<&'a [Kick]>,
    /// Length of a substep, s; none in the half kick that ends an advance.
    substep_s: Option<f32>,
    meeting: Meeting,
}

/// A thread's way through a stretch.
struct Work<'a>(&'a Stretch<'a>, &'a Part);

impl Widened for Work<'_> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) {
        let Work(stretch, part) = self;
        let mut turn = 0;
        for kicks in &stretch.kicks {
            {
                let [places, next] = [&stretch.places[turn], &stretch.places[1 - turn]];
                // SAFETY: threads have parts that do not overlap, and of these arrays each touches its own part only; of
                // `places` nobody writes, of `next` everyone its own part. The two change roles at a meeting, when all of
                // these slices are dropped.
                let mut job = unsafe {
                    Job {
                        part,
                        stretch,
                        positions: View {
                            values: places.all(),
                            sites: stretch.sites,
                        },
                        kicks,
                        forces: stretch.forces.part(&part.sites),
                        velocities: stretch.velocities.part(&part.sites),
                        drift: stretch.substep_s.map(|time_s| Drift {
                            time_s,
                            next: next.part(&part.sites),
                            lost: stretch.lost.part(&part.sites),
                        }),
                    }
                };
                for share in &part.reaching {
                    job.add_forces(simd, share);
                }
                for share in &part.own {
                    job.add_forces(simd, share);
                    job.finish(simd, share.block);
                }
            }
            turn = 1 - turn;
            stretch.meeting.wait();
        }
    }
}

/// What a thread needs for its part in a substep: its own nodes to write, all positions to read.
struct Job<'a> {
    part: &'a Part,
    stretch: &'a Stretch<'a>,
    positions: View<'a>,
    kicks: &'a [Kick],
    forces: &'a mut [SiteVectors],
    velocities: &'a mut [SiteVectors],
    drift: Option<Drift<'a>>,
}

/// Where the nodes go, and what rounding takes from it.
struct Drift<'a> {
    time_s: f32,
    next: &'a mut [SiteVectors],
    lost: &'a mut [SiteVectors],
}

impl Job<'_> {
    /// Adds the forces of a block's springs to the part's nodes.
    #[inline(always)]
    fn add_forces<S: Simd>(&mut self, simd: S, share: &Share) {
        let (springs, positions, first) = (self.stretch.springs, self.positions, self.part.sites.start);
        let mut elsewhere = [SiteVectors::default(); BLOCK];
        for (run, ends) in &share.runs {
            if !self.stretch.sleep.is_run_awake(share.block, run) {
                continue;
            }
            if run.is_chain() && *ends != Ends::High {
                let last = usize::from(*ends == Ends::Both);
                let forces = &mut self.forces[run.low - first..][..run.bundles + last];
                springs.add_chain_forces(simd, run, positions, forces);
                continue;
            }
            let here = Cell::from_mut(&mut *self.forces).as_slice_of_cells();
            let elsewhere = &Cell::from_mut(&mut elsewhere[..]).as_slice_of_cells()[..run.bundles];
            let at = |site: usize, is_here: bool| {
                if is_here {
                    &here[site - first..][..run.bundles]
                } else {
                    elsewhere
                }
            };
            let forces = [
                at(run.low, *ends != Ends::High),
                at(run.low + run.span, *ends != Ends::Low),
            ];
            with_turn!(run.turn, springs.add_run_forces(simd, run, positions, forces));
        }
        let layout = springs.layout();
        for loose in layout.loose(&layout.blocks()[share.block]) {
            springs.add_loose_forces(simd, loose, positions, |node, pull| {
                let (site, lane) = layout.sites().place(node);
                if let Some(force) = site.checked_sub(first).and_then(|site| self.forces.get_mut(site)) {
                    for (component, pull) in force.iter_mut().zip(pull.to_array()) {
                        component.0[lane] += pull;
                    }
                }
            });
        }
    }

    /// Kicks and moves the nodes of a block whose forces are complete.
    #[inline(always)]
    fn finish<S: Simd>(&mut self, simd: S, number: usize) {
        let (stretch, first) = (self.stretch, self.part.sites.start);
        let block = &stretch.springs.layout().blocks()[number];
        let own = block.sites.start - first..block.sites.end - first;
        let places = &self.positions.values[block.sites.clone()];
        let (forces, velocities) = (&mut self.forces[own.clone()], &mut self.velocities[own.clone()]);
        if !stretch.sleep.is_awake(number) {
            if let Some(drift) = &mut self.drift {
                drift.next[own].copy_from_slice(places);
            }
            return;
        }
        stretch.beds.add_forces(simd, &block.sites, places, forces);
        let (kicks, loads) = (&self.kicks[block.sites.clone()], &stretch.external[block.sites.clone()]);
        let Some(drift) = &mut self.drift else {
            for n in 0..kicks.len() {
                velocities[n] = kicks[n].applied(simd, &velocities[n], &forces[n]).stored();
            }
            return;
        };
        let (next, lost) = (&mut drift.next[own.clone()], &mut drift.lost[own]);
        for n in 0..kicks.len() {
            next[n] = moved(
                simd,
                (&kicks[n], drift.time_s),
                &places[n],
                &mut lost[n],
                &mut velocities[n],
                &forces[n],
            );
            forces[n] = loads[n];
        }
    }
}

impl Tissue {
    /// Lets up to so many threads step the tissue, and says how many will: small tissues are faster with one, and those whose
    /// pentahedra hold their volume take one. The result has the same bits with any number. It pays for large lattices of six
    /// neighbours that no contact touches; with diagonals, and where contacts are held, it may cost (`docs/benchmarks.md`).
    pub fn set_threads(&mut self, threads: usize) -> usize {
        if threads != self.threads() && self.volumes.is_none() {
            self.team = Team::new(threads, &self.springs);
        }
        self.watch_does(|other| other.set_threads(threads));
        self.threads()
    }

    /// Threads that step the tissue.
    pub fn threads(&self) -> usize {
        self.team.as_ref().map_or(1, Team::threads)
    }

    /// Makes the substeps of a plan with the team.
    pub(crate) fn run_by_team(&mut self, plan: Plan, contacts: &[Contact]) {
        let Some(mut team) = self.team.take() else { return };
        self.begin(plan, contacts);
        // What is not a part's own is done between stretches, by one thread.
        let alone = contacts.is_empty() && self.collapse.steps().next().is_none() && !self.sleep.is_any_asleep();
        let length = if alone { plan.substeps } else { 1 };
        for first in (1..=plan.substeps).step_by(length as usize) {
            self.add_resection_forces(plan);
            self.stretch_by_team(&mut team, Some(plan), first, length);
            self.after_substep(plan, first + length - 1);
        }
        self.stretch_by_team(&mut team, None, 1, 1);
        self.team = Some(team);
    }

    /// `length` substeps of a plan from the `first` on, or the half kick that ends an advance.
    fn stretch_by_team(&mut self, team: &mut Team, plan: Option<Plan>, first: u32, length: u32) {
        let (scratch, motion) = (&mut self.scratch, &mut self.motion);
        let kicks = |substep| match substep {
            1 => &scratch.kicks.half[..],
            _ => &scratch.kicks.whole[..],
        };
        let stretch = Stretch {
            springs: &self.springs,
            sleep: &self.sleep,
            beds: Bed::of(&self.nodes),
            sites: self.springs.layout().sites(),
            external: &scratch.external.values,
            places: [
                Shared::of(&mut motion.positions.values),
                Shared::of(&mut team.next.values),
            ],
            forces: Shared::of(&mut scratch.forces.values),
            velocities: Shared::of(&mut motion.velocities.values),
            lost: Shared::of(&mut motion.lost.values),
            kicks: (first..first + length).map(kicks).collect(),
            substep_s: plan.map(|plan| plan.substep_s as f32),
            meeting: Meeting::of(team.parts.len()),
        };
        let parts = &team.parts;
        team.pool
            .broadcast(|thread| with_widest(Work(&stretch, &parts[thread.index()])));
        if plan.is_some() && length % 2 == 1 {
            mem::swap(&mut motion.positions, &mut team.next);
        }
    }
}
