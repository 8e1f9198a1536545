//! Sleep: what does not move is not computed.
//!
//! Blocks of sites (`runs.rs`) sleep and wake. A block falls asleep when, at the end of [`QUIET_ADVANCES`] advances in a
//! row, no node in it has moved further in the advance than the error aim a second allows, none is faster, and none is out
//! of balance by more force than would move it by 1/500 of the aim against the springs around it. Rounding makes nodes
//! tremble by a unit in the last place of their positions, at the highest frequency there is, the faster the finer the
//! lattice: that much way and speed count for nothing. (A tissue that aims for far less than the default does not sleep: what
//! rounding does to its forces is out of balance.) Sleeping nodes stay where they are; springs between two sleeping blocks are
//! not computed. A block wakes when a contact, a cut, an edit or a resection force reaches one of its nodes, and when a node
//! of a block that it shares a spring with moves four times as far or as fast as a sleeper may: looked at every
//! [`SUBSTEPS_A_LOOK`] substeps, in which a wave runs a few millimetres.

use fearless_simd::{Simd, f32x8, mask32x8, prelude::*};

use crate::Contact;
use crate::runs::{BLOCK, Layout, Run};
use crate::tissue::Tissue;
use crate::vectors::{Registers, SiteVectors, load};
use crate::widest::{Widened, with_widest};

/// Advances in a row that a block is quiet before it sleeps.
const QUIET_ADVANCES: u32 = 3;

/// Substeps from one look for sleepers to wake to the next.
pub(crate) const SUBSTEPS_A_LOOK: u32 = 8;

/// Speed of a quiet node, in error aims a second.
const QUIET_SPEED: f32 = 1.0;

/// Distance that the force on a quiet node could move it, in error aims.
const QUIET_WAY: f32 = 2e-3;

/// Sleepers wake beside what moves so many times as far or as fast as they may.
const WAKING: f32 = 4.0;

/// How far rounding moves a node, in units in the last place: by measurement 1.6 in the worst of 66,000 nodes.
const TREMBLE: f32 = 3.0 * f32::EPSILON;

/// How far and how fast the nodes of a quiet block may move.
#[derive(Debug, Clone, Copy)]
struct Quiet {
    /// mm in the time looked at.
    way: f32,
    /// mm/s.
    speed: f32,
    /// Speed of a node that trembles, over the way, 1/s.
    tremble_rate: f32,
}

impl Quiet {
    /// Which nodes of a site are.
    #[inline(always)]
    fn holds<S: Simd>(
        &self,
        simd: S,
        place: Registers<S>,
        before: Registers<S>,
        velocity: Registers<S>,
    ) -> mask32x8<S> {
        let tremble = place.length_squared().sqrt() * f32x8::splat(simd, TREMBLE);
        let way = tremble + f32x8::splat(simd, self.way);
        let speed = tremble * f32x8::splat(simd, self.tremble_rate) + f32x8::splat(simd, self.speed);
        (place - before).length_squared().simd_le(way * way) & velocity.length_squared().simd_le(speed * speed)
    }
}

/// Which blocks sleep.
#[derive(Debug, Clone)]
pub(crate) struct Sleep {
    awake: Vec<bool>,
    /// Advances in a row at the end of which the block was quiet.
    quiet: Vec<u32>,
    /// The other blocks that each shares a spring, or a pentahedron that holds its volume, with.
    neighbours: Vec<Vec<u32>>,
    asleep: usize,
}

impl Sleep {
    /// All awake.
    pub fn none(layout: &Layout) -> Sleep {
        let count = layout.blocks().len();
        let mut neighbours = vec![Vec::new(); count];
        let mut join = |one: usize, other: usize| {
            for (one, other) in [(one, other), (other, one)] {
                if one != other && !neighbours[one].contains(&(other as u32)) {
                    neighbours[one].push(other as u32);
                }
            }
        };
        for (number, block) in layout.blocks().iter().enumerate() {
            for run in layout.runs(block) {
                high_blocks(run).into_iter().for_each(|high| join(number, high));
            }
            for loose in layout.loose(block) {
                for ends in &loose.ends {
                    let [one, other] = ends.map(|end| layout.sites().place(end).0 / BLOCK);
                    join(one, other);
                }
            }
        }
        Sleep {
            awake: vec![true; count],
            quiet: vec![0; count],
            neighbours,
            asleep: 0,
        }
    }

    /// Whether a block is awake.
    #[inline(always)]
    pub fn is_awake(&self, block: usize) -> bool {
        self.awake[block]
    }

    /// Whether a run of a block has an end in a block that is awake.
    #[inline(always)]
    pub fn is_run_awake(&self, block: usize, run: &Run) -> bool {
        self.asleep == 0 || self.awake[block] || high_blocks(run).into_iter().any(|high| self.awake[high])
    }

    /// Makes blocks neighbours of each other.
    pub fn join(&mut self, blocks: &[u32]) {
        for &one in blocks {
            for &other in blocks {
                let neighbours = &mut self.neighbours[one as usize];
                if one != other && !neighbours.contains(&other) {
                    neighbours.push(other);
                }
            }
        }
    }

    /// Whether any block sleeps.
    pub fn is_any_asleep(&self) -> bool {
        self.asleep > 0
    }

    /// Whether every block sleeps.
    pub fn is_all_asleep(&self) -> bool {
        self.asleep == self.awake.len()
    }

    pub fn wake_all(&mut self) {
        (0..self.awake.len()).for_each(|block| {
            self.wake(block);
        });
    }

    /// Wakes a block. Tells whether it was asleep.
    pub fn wake(&mut self, block: usize) -> bool {
        self.quiet[block] = 0;
        let slept = !std::mem::replace(&mut self.awake[block], true);
        self.asleep -= usize::from(slept);
        slept
    }
}

/// The blocks of the higher sites of a run: from the first to the last.
#[inline(always)]
fn high_blocks(run: &Run) -> [usize; 2] {
    let first = run.low + run.span;
    [first / BLOCK, (first + run.bundles - 1) / BLOCK]
}

impl Tissue {
    /// Share of the tissue that sleeps, 0 to 1: what does not move is not computed.
    pub fn sleeping_share(&self) -> f64 {
        self.sleep.asleep as f64 / self.sleep.awake.len().max(1) as f64
    }

    /// Rises whenever a node may have moved.
    pub fn motion_version(&self) -> u64 {
        self.motion_version
    }

    /// Wakes the surroundings of a node.
    pub(crate) fn wake(&mut self, node: u32) {
        self.sleep.wake(self.springs.layout().sites().place(node).0 / BLOCK);
    }

    /// Wakes the surroundings of a spring.
    pub(crate) fn wake_ends(&mut self, spring: u32) {
        for node in self.springs.nodes[spring as usize] {
            self.wake(node);
        }
    }

    /// Wakes what contacts and changing resection forces reach.
    pub(crate) fn wake_reached(&mut self, contacts: &[Contact]) {
        let sites = self.springs.layout().sites();
        let touched = contacts
            .iter()
            .flat_map(|contact| contact.point.parts().map(|(node, _)| node));
        for node in touched.chain(self.collapse.steps().map(|(node, _)| node)) {
            self.sleep.wake(sites.place(node).0 / BLOCK);
        }
    }

    /// Wakes blocks beside moving ones, `time_s` into an advance. Their forces, of which a part was computed, begin anew with
    /// the loads.
    pub(crate) fn wake_by_motion(&mut self, time_s: f64) {
        with_widest(WakeByMotion(self, time_s));
    }

    /// At the end of an advance: lets what has been quiet for long enough fall asleep.
    pub(crate) fn fall_asleep(&mut self, duration_s: f64) {
        with_widest(FallAsleep(self, duration_s));
    }

    /// What is quiet over a time, and so many times as much.
    fn quiet(&self, time_s: f64, times: f32) -> Quiet {
        let speed = times * QUIET_SPEED * self.error_aim_mm();
        let bound_s = self.bound.unwrap_or(f64::INFINITY);
        Quiet {
            way: speed * time_s as f32,
            speed,
            // The highest frequency there is.
            tremble_rate: times * (2.0 / bound_s) as f32,
        }
    }
}

struct WakeByMotion<'a>(&'a mut Tissue, f64);

impl Widened for WakeByMotion<'_> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) {
        let WakeByMotion(tissue, time_s) = self;
        let quiet = tissue.quiet(time_s, WAKING);
        let blocks = tissue.springs.layout().blocks();
        for (number, block) in blocks.iter().enumerate() {
            let sleeper = |&other: &u32| !tissue.sleep.awake[other as usize];
            if !tissue.sleep.awake[number] || !tissue.sleep.neighbours[number].iter().any(sleeper) {
                continue;
            }
            let mut moves = false;
            for site in block.sites.clone() {
                let place = Registers::load(simd, &tissue.motion.positions.values[site]);
                let before = Registers::load(simd, &tissue.scratch.start.positions.values[site]);
                let velocity = Registers::load(simd, &tissue.motion.velocities.values[site]);
                if !quiet.holds(simd, place, before, velocity).all_true() {
                    moves = true;
                    break;
                }
            }
            if !moves {
                continue;
            }
            for other in tissue.sleep.neighbours[number].clone() {
                if tissue.sleep.wake(other as usize) {
                    let sites = blocks[other as usize].sites.clone();
                    let external = &tissue.scratch.external.values[sites.clone()];
                    tissue.scratch.forces.values[sites].copy_from_slice(external);
                }
            }
        }
    }
}

struct FallAsleep<'a>(&'a mut Tissue, f64);

impl Widened for FallAsleep<'_> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) {
        let FallAsleep(tissue, duration_s) = self;
        let quiet = tissue.quiet(duration_s, 1.0);
        let way = f32x8::splat(simd, QUIET_WAY * tissue.error_aim_mm());
        for (number, block) in tissue.springs.layout().blocks().iter().enumerate() {
            if !tissue.sleep.awake[number] {
                continue;
            }
            let mut is_quiet = true;
            for site in block.sites.clone() {
                let place = Registers::load(simd, &tissue.motion.positions.values[site]);
                let before = Registers::load(simd, &tissue.scratch.start.positions.values[site]);
                let velocity = Registers::load(simd, &tissue.motion.velocities.values[site]);
                let force = Registers::load(simd, &tissue.scratch.forces.values[site]);
                let balanced = load(simd, &tissue.scratch.held.stiffness.values[site]) * way;
                let still = load(simd, &tissue.nodes.inverse_inertia.values[site]).simd_eq(0.0);
                let slow = quiet.holds(simd, place, before, velocity);
                let quiet_site = slow & force.length_squared().simd_le(balanced * balanced) | still;
                if !quiet_site.all_true() {
                    is_quiet = false;
                    break;
                }
            }
            let sleep = &mut tissue.sleep;
            sleep.quiet[number] = if is_quiet { sleep.quiet[number] + 1 } else { 0 };
            if sleep.quiet[number] >= QUIET_ADVANCES {
                sleep.awake[number] = false;
                sleep.asleep += 1;
                tissue.motion.velocities.values[block.sites.clone()].fill(SiteVectors::default());
            }
        }
    }
}
