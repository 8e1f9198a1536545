//! Motion: how a step is made.
//!
//! Equation (1) of the papers, `m x'' + gamma x' + g(x) = f`, is integrated by velocity Verlet with the damping integrated
//! exactly (`kick.rs`): half a kick, a drift, half a kick. The order is 2; two half kicks in a row are one whole kick, so a
//! substep costs one evaluation of the forces. How many substeps an advance takes is in `bound.rs`.

use std::ops::Range;

use fearless_simd::{Simd, f32x8, prelude::*};

use crate::bed::Bed;
use crate::bound::Plan;
use crate::contact::{Holds, Touch};
use crate::held::Held;
use crate::kick::{Kick, Kicks};
use crate::marks::Marks;
use crate::sites::{LANES, Sites};
use crate::sleep::SUBSTEPS_A_LOOK;
use crate::tissue::{Motion, Tissue};
use crate::vectors::{Registers, SiteVectors, Vectors};
use crate::viscosity::Viscosity;
use crate::widest::{Widened, with_widest};
use crate::{Contact, MOST_SUBSTEPS, PutAside};

/// Most substeps that [`Tissue::advance_steps`] makes before it checks the bound, which costs as much as some four.
const STRETCH: u32 = 128;

/// How often an advance is made again with half the bound for pentahedra that hold their volume.
const MOST_HALVINGS: u32 = 8;

/// What one advance did.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct StepReport {
    /// Substeps that the advance consists of; 0 when all of the tissue slept.
    pub substeps: u32,
    /// Substeps made before in vain, because the tissue took a shape for which they were too long.
    pub substeps_repeated: u32,
    /// Substeps of the second solution that a watch carries.
    pub substeps_beside: u32,
    /// Length of a substep, s.
    pub substep_s: f64,
    /// Longest stable substep, s.
    pub bound_s: f64,
    /// Nodes put aside during this advance, by rising index.
    pub put_aside: Vec<PutAside>,
    /// Contacts left out because a number in them was not finite, a plane lay beyond 10 m, or a node in them does not live.
    pub contacts_refused: usize,
}

impl StepReport {
    /// Adds what the advance that followed did; lengths and bound are those of the last.
    pub(crate) fn join(&mut self, next: StepReport) {
        self.substeps = self.substeps.saturating_add(next.substeps);
        self.substeps_repeated = self.substeps_repeated.saturating_add(next.substeps_repeated);
        self.substeps_beside = self.substeps_beside.saturating_add(next.substeps_beside);
        (self.substep_s, self.bound_s) = (next.substep_s, next.bound_s);
        self.put_aside.extend(next.put_aside);
        self.contacts_refused += next.contacts_refused;
    }
}

/// An advance that was refused; nothing has moved.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum StepError {
    /// The time to advance is NaN, infinite, zero or negative.
    #[error("a step lasts {0} s, expected a finite time above 0")]
    Duration(f64),
    /// The time would take too many substeps.
    #[error("a step of {duration_s} s takes {needed:.0} substeps of at most {bound_s} s, more than {MOST_SUBSTEPS}")]
    TooManySubsteps {
        /// The time asked for, s.
        duration_s: f64,
        /// Longest stable substep, s.
        bound_s: f64,
        /// How many would be needed.
        needed: f64,
    },
}

/// The attempts at an advance: each with a bound that is stricter than the last.
#[derive(Clone, Copy, PartialEq)]
enum Attempt {
    /// By the bound of the tissue as it lay before.
    AsItLay,
    /// By the bound of the shape that the first attempt led to.
    AsItCame,
    /// By a bound that holds for any shape. The volume terms of pentahedra have none: with them this is made again, with half
    /// the bound each time, so many times at most.
    ForAnyShape { again: u32 },
}

/// The substeps of a plan, compiled for several widths of vector registers.
struct Run<'a> {
    tissue: &'a mut Tissue,
    plan: Plan,
    contacts: &'a [Contact],
}

impl Widened for Run<'_> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) {
        self.tissue.begin(self.plan, self.contacts);
        for substep in 1..=self.plan.substeps {
            self.tissue.substep(simd, self.plan, substep);
        }
        self.tissue.end(simd);
    }
}

/// Arrays that an advance or a cut writes before it reads them; kept to avoid allocation.
#[derive(Debug, Clone)]
pub(crate) struct Scratch {
    pub forces: Vectors,
    pub external: Vectors,
    pub pressures: Vectors,
    /// The contacts of the advance under way, or of the last one.
    pub contacts: Holds,
    /// The motion before it.
    pub start: Motion,
    pub kicks: Kicks,
    pub viscosity: Viscosity,
    pub held: Held,
    pub marked_nodes: Marks,
    pub marked_springs: Marks,
}

impl Scratch {
    pub fn new(sites: Sites, spring_count: usize) -> Scratch {
        Scratch {
            forces: Vectors::zero(sites),
            external: Vectors::zero(sites),
            pressures: Vectors::zero(sites),
            contacts: Holds::default(),
            start: Motion::zero(sites),
            kicks: Kicks::zero(sites),
            viscosity: Viscosity::new(sites),
            held: Held::zero(sites),
            marked_nodes: Marks::new(sites.nodes()),
            marked_springs: Marks::new(spring_count),
        }
    }
}

impl Tissue {
    /// Moves the tissue on by `duration_s`, in as many equal substeps as the bound asks for.
    ///
    /// Every contact holds after every substep, those later in the list winning over earlier ones. Should the
    /// velocity of a node stop being one that a scene can have, the advance is made again with that node put aside.
    ///
    /// # Errors
    ///
    /// When the duration is no positive number or would take more than [`MOST_SUBSTEPS`] substeps.
    pub fn advance(&mut self, duration_s: f64, contacts: &[Contact]) -> Result<StepReport, StepError> {
        let usable = self.usable(contacts);
        let effort = self.accuracy.effort;
        let mut report = self.make(|bound_s| Plan::new(duration_s, bound_s, effort), &usable)?;
        report.contacts_refused = contacts.len() - usable.len();
        self.fall_asleep(duration_s);
        match self.watch_does(|other| other.advance(duration_s, &usable)) {
            Some(Err(_)) => self.watch = None,
            Some(Ok(beside)) => report.substeps_beside = beside.substeps,
            None => {}
        }
        Ok(report)
    }

    /// Makes `steps` steps of `step_s` each. A step above the bound is divided, as often as the bound asks for; none is
    /// lengthened. The bound is checked every 128 substeps, within a step or over several: forces at the end of one
    /// step serve the next, so that this costs less than as many advances. Every step is made for every node: nothing sleeps.
    ///
    /// # Errors
    ///
    /// As [`Tissue::advance`]; the steps before are made.
    pub fn advance_steps(&mut self, step_s: f64, steps: u64) -> Result<StepReport, StepError> {
        let effort = self.accuracy.effort;
        let mut total = self.in_portions(step_s, steps, |tissue, part_s, made| {
            tissue.make(|bound_s| Plan::of_steps(part_s, made, bound_s, effort), &[])
        })?;
        match self.watch_does(|other| other.advance_steps(step_s, steps)) {
            Some(Err(_)) => self.watch = None,
            Some(Ok(beside)) => total.substeps_beside = beside.substeps,
            None => {}
        }
        Ok(total)
    }

    /// Makes steps portion by portion, so long that the bound is checked as often as it should be. `make` makes as many
    /// steps of such a length as it is told, s.
    pub(crate) fn in_portions<E: From<StepError>>(
        &mut self,
        step_s: f64,
        steps: u64,
        mut make: impl FnMut(&mut Tissue, f64, u32) -> Result<StepReport, E>,
    ) -> Result<StepReport, E> {
        let (mut total, mut left) = (StepReport::default(), steps);
        let effort = self.accuracy.effort;
        self.sleep.wake_all();
        while left > 0 {
            let divisions = Plan::new(step_s, self.bound_s(), effort)?.substeps;
            // Several steps in one go, or one in several.
            let (made, parts) = if divisions <= STRETCH {
                (left.min(u64::from(STRETCH / divisions)), 1)
            } else {
                (1, divisions.div_ceil(STRETCH))
            };
            for _ in 0..parts {
                let report = make(self, step_s / f64::from(parts), made as u32)?;
                total.join(report);
            }
            left -= made;
        }
        Ok(total)
    }

    /// Makes a plan that follows from a bound; should the tissue outrun the bound, a stricter one.
    pub(crate) fn make(
        &mut self,
        plan_of: impl Fn(f64) -> Result<Plan, StepError>,
        contacts: &[Contact],
    ) -> Result<StepReport, StepError> {
        let mut plan = plan_of(self.bound_s())?;
        let mut attempt = Attempt::AsItLay;
        self.wake_reached(contacts);
        if self.sleep.is_all_asleep() {
            // None of them touches: what one reaches would be awake.
            self.take_hold(plan, contacts);
            return Ok(StepReport {
                substep_s: plan.substep_s,
                bound_s: plan.bound_s,
                ..StepReport::default()
            });
        }
        self.motion_version += 1;
        self.collapse.approach(plan.duration_s());
        self.press();
        self.yield_bed(plan.duration_s());
        self.scratch.start.copy_from(&self.motion);
        let mut substeps_repeated = 0;
        let is_sound = loop {
            self.run(plan, contacts);
            let (bound_s, is_sound) = (self.measure_bound_s(), self.motion.is_sound(plan));
            let is_last = attempt == Attempt::ForAnyShape { again: 0 };
            if is_last || is_sound && plan.substep_s <= bound_s {
                break is_sound;
            }
            // The tissue has turned into a shape for which the step was too long.
            let again = match attempt {
                Attempt::ForAnyShape { again } => again - 1,
                _ if self.volumes.is_some() => MOST_HALVINGS,
                _ => 0,
            };
            let stricter = if is_sound && attempt == Attempt::AsItLay {
                attempt = Attempt::AsItCame;
                bound_s
            } else {
                attempt = Attempt::ForAnyShape { again };
                let of_springs = self.bound_of_any_shape_s();
                if self.volumes.is_some() {
                    of_springs.min(0.5 * plan.bound_s)
                } else {
                    of_springs
                }
            };
            self.motion.copy_from(&self.scratch.start);
            self.forget_bound();
            substeps_repeated += plan.substeps;
            plan = plan_of(stricter)?;
        };
        let put_aside = if is_sound {
            Vec::new()
        } else {
            self.motion.copy_from(&self.scratch.start);
            let put_aside = self.run_with_care(plan, contacts);
            self.forget_bound();
            put_aside
        };
        self.collapse.arrive();
        if self.accuracy.effort.is_viscous() {
            // The next advance has its inertias by how the tissue lies now: what a tool squeezes asks for no shorter substeps.
            self.forget_inertias();
        }
        Ok(StepReport {
            substeps: plan.substeps,
            substeps_repeated,
            substeps_beside: 0,
            substep_s: plan.substep_s,
            bound_s: plan.bound_s,
            put_aside,
            contacts_refused: 0,
        })
    }

    fn usable(&self, contacts: &[Contact]) -> Vec<Contact> {
        let usable =
            |contact: &&Contact| contact.is_usable() && contact.point.parts().all(|(node, _)| self.is_node_alive(node));
        contacts.iter().filter(usable).copied().collect()
    }

    /// Makes the substeps of a plan from where the tissue is.
    fn run(&mut self, plan: Plan, contacts: &[Contact]) {
        if self.team.is_some() {
            return self.run_by_team(plan, contacts);
        }
        with_widest(Run {
            tissue: self,
            plan,
            contacts,
        });
    }

    /// Loads, coefficients and contacts; the sums of forces begin with the loads.
    #[inline(always)]
    pub(crate) fn begin(&mut self, plan: Plan, contacts: &[Contact]) {
        (self.scratch.kicks).prepare(plan.substep_s, self.weighing.round, &self.nodes);
        self.take_hold(plan, contacts);
        let scratch = &mut self.scratch;
        if self.accuracy.effort.is_viscous() {
            scratch.viscosity.prepare(&self.springs, &self.nodes.inverse_inertia);
        }
        let (load, balance) = (&self.nodes.load.values, &self.nodes.balance.values);
        let loads = load.iter().zip(balance).zip(&self.collapse.current().values);
        for (sum, ((load, balance), collapse)) in scratch.external.values.iter_mut().zip(loads) {
            for axis in 0..3 {
                for n in 0..LANES {
                    sum[axis].0[n] = load[axis].0[n] + balance[axis].0[n] + collapse[axis].0[n];
                }
            }
        }
        let of_water = self.water.as_ref().map(|water| &water.forces);
        let of_frame = self.frame.as_ref().map(|frame| &frame.forces);
        for forces in of_water.into_iter().chain(of_frame) {
            let sums = scratch.external.values.as_flattened_mut().iter_mut();
            for (sum, force) in sums.zip(forces.values.as_flattened()) {
                for n in 0..LANES {
                    sum.0[n] += force.0[n];
                }
            }
        }
        scratch.forces.copy_from(&scratch.external);
    }

    /// Lets the sums of forces begin with the pressures of pentahedra that hold their volume.
    #[inline(always)]
    fn add_pressures<S: Simd>(&mut self, simd: S) {
        let Some(volumes) = &self.volumes else { return };
        let scratch = &mut self.scratch;
        volumes.sum_forces(simd, &self.motion.positions, &mut scratch.pressures);
        let sums = scratch.forces.values.iter_mut().zip(&scratch.external.values);
        for ((force, external), pressure) in sums.zip(&scratch.pressures.values) {
            *force = (Registers::load(simd, external) + Registers::load(simd, pressure)).stored();
        }
    }

    /// One substep: forces, the kick that ends the last substep and begins this one (half a kick at the start), drift, and
    /// contacts. Block by block: see `springs.rs`.
    #[inline(always)]
    pub(crate) fn substep<S: Simd>(&mut self, simd: S, plan: Plan, substep: u32) {
        self.add_resection_forces(plan);
        self.add_pressures(simd);
        let scratch = &mut self.scratch;
        let kicks = if substep == 1 {
            &scratch.kicks.half
        } else {
            &scratch.kicks.whole
        };
        let substep_s = plan.substep_s as f32;
        let is_viscous = self.accuracy.effort.is_viscous();
        for (number, block) in self.springs.layout().blocks().iter().enumerate() {
            let positions = self.motion.positions.view();
            self.springs
                .add_forces(simd, (number, block), &self.sleep, positions, &mut scratch.forces);
            if !self.sleep.is_awake(number) {
                continue;
            }
            let (sites, forces) = (&block.sites, &mut scratch.forces.values[block.sites.clone()]);
            Bed::of(&self.nodes).add_forces(simd, sites, &positions.values[sites.clone()], forces);
            let (kicks, loads) = (&kicks[sites.clone()], &scratch.external.values[sites.clone()]);
            if is_viscous {
                self.motion.kick(simd, sites.clone(), kicks, forces, loads);
            } else {
                self.motion
                    .kick_and_drift(simd, sites.clone(), (kicks, substep_s), forces, loads);
            }
        }
        if is_viscous {
            let inverse_inertia = &self.nodes.inverse_inertia;
            let velocities = &mut self.motion.velocities;
            scratch
                .viscosity
                .apply(simd, &self.springs, inverse_inertia, velocities);
            for (number, block) in self.springs.layout().blocks().iter().enumerate() {
                if self.sleep.is_awake(number) {
                    self.motion.drift(simd, block.sites.clone(), substep_s);
                }
            }
        }
        self.after_substep(plan, substep);
    }

    /// Makes the contacts of an advance ready.
    pub(crate) fn take_hold(&mut self, plan: Plan, contacts: &[Contact]) {
        let (scratch, inverse_inertia) = (&mut self.scratch, &self.nodes.inverse_inertia);
        let substeps = (plan.substeps, plan.substep_s as f32);
        (scratch.contacts).prepare(contacts, substeps, &scratch.kicks, inverse_inertia);
    }

    /// What became of the contacts of the last advance, those that were refused left out.
    pub fn touches(&self) -> impl Iterator<Item = Touch> + '_ {
        self.scratch.contacts.touches()
    }

    /// Lets the forces of resections grow by what they do in a substep.
    #[inline(always)]
    pub(crate) fn add_resection_forces(&mut self, plan: Plan) {
        for (node, step) in self.collapse.steps() {
            self.scratch.external.add(node, step / plan.substeps as f32);
        }
    }

    /// Wakes what is reached, and holds contacts.
    #[inline(always)]
    pub(crate) fn after_substep(&mut self, plan: Plan, substep: u32) {
        let time = substep as f32 / plan.substeps as f32;
        if self.sleep.is_any_asleep() && substep.is_multiple_of(SUBSTEPS_A_LOOK) {
            self.wake_by_motion(plan.substep_s * f64::from(substep));
        }
        self.scratch.contacts.apply(&mut self.motion, time);
    }

    /// The forces at the end, and the half kick that ends the last substep.
    #[inline(always)]
    pub(crate) fn end<S: Simd>(&mut self, simd: S) {
        self.add_pressures(simd);
        let scratch = &mut self.scratch;
        for (number, block) in self.springs.layout().blocks().iter().enumerate() {
            let (positions, forces) = (self.motion.positions.view(), &mut scratch.forces);
            self.springs
                .add_forces(simd, (number, block), &self.sleep, positions, forces);
            if self.sleep.is_awake(number) {
                let (places, at) = (&positions.values[block.sites.clone()], block.sites.clone());
                Bed::of(&self.nodes).add_forces(simd, &block.sites, places, &mut forces.values[at]);
                scratch
                    .kicks
                    .apply_half(simd, block.sites.clone(), forces, &mut self.motion.velocities);
            }
        }
    }
}

/// Changes the velocities of a site by the forces, keeps what rounding takes from its positions (compensated summation),
/// and gives where its nodes go by these velocities.
#[inline(always)]
pub(crate) fn moved<S: Simd>(
    simd: S,
    (kick, time_s): (&Kick, f32),
    place: &SiteVectors,
    lost: &mut SiteVectors,
    velocity: &mut SiteVectors,
    force: &SiteVectors,
) -> SiteVectors {
    let now = kick.applied(simd, velocity, force);
    let (before, remains) = (Registers::load(simd, place), Registers::load(simd, lost));
    let step = now.times(f32x8::splat(simd, time_s)) - remains;
    let after = before + step;
    *lost = ((after - before) - step).stored();
    *velocity = now.stored();
    after.stored()
}

impl Motion {
    fn zero(sites: Sites) -> Motion {
        Motion {
            positions: Vectors::zero(sites),
            lost: Vectors::zero(sites),
            velocities: Vectors::zero(sites),
        }
    }

    pub(crate) fn copy_from(&mut self, other: &Motion) {
        self.positions.copy_from(&other.positions);
        self.lost.copy_from(&other.lost);
        self.velocities.copy_from(&other.velocities);
    }

    /// Kicks the nodes of some sites, and starts the next sum of forces from the loads.
    #[inline(always)]
    fn kick<S: Simd>(
        &mut self,
        simd: S,
        sites: Range<usize>,
        kicks: &[Kick],
        forces: &mut [SiteVectors],
        loads: &[SiteVectors],
    ) {
        let velocities = &mut self.velocities.values[sites];
        for n in 0..kicks.len() {
            velocities[n] = kicks[n].applied(simd, &velocities[n], &forces[n]).stored();
            forces[n] = loads[n];
        }
    }

    /// Moves the nodes of some sites.
    #[inline(always)]
    fn drift<S: Simd>(&mut self, simd: S, sites: Range<usize>, time_s: f32) {
        let (positions, lost) = (
            &mut self.positions.values[sites.clone()],
            &mut self.lost.values[sites.clone()],
        );
        let velocities = &self.velocities.values[sites];
        for n in 0..velocities.len() {
            let now = Registers::load(simd, &velocities[n]);
            let (before, remains) = (Registers::load(simd, &positions[n]), Registers::load(simd, &lost[n]));
            let step = now.times(f32x8::splat(simd, time_s)) - remains;
            let after = before + step;
            lost[n] = ((after - before) - step).stored();
            positions[n] = after.stored();
        }
    }

    /// Kicks and moves the nodes of some sites, and starts the next sum of forces from the loads. One pass.
    #[inline(always)]
    fn kick_and_drift<S: Simd>(
        &mut self,
        simd: S,
        sites: Range<usize>,
        (kicks, time_s): (&[Kick], f32),
        forces: &mut [SiteVectors],
        loads: &[SiteVectors],
    ) {
        let (positions, lost) = (
            &mut self.positions.values[sites.clone()],
            &mut self.lost.values[sites.clone()],
        );
        let velocities = &mut self.velocities.values[sites];
        for n in 0..kicks.len() {
            positions[n] = moved(
                simd,
                (&kicks[n], time_s),
                &positions[n],
                &mut lost[n],
                &mut velocities[n],
                &forces[n],
            );
            forces[n] = loads[n];
        }
    }
}

#[cfg(all(test, target_arch = "x86_64"))]
mod tests {
    use super::*;
    use crate::{Material, Pusher, ShearResistance, TissueMesh, TissuePoint, widest::with_level};
    use fearless_simd::Level;
    use glam::{DVec2, DVec3, Vec3};
    use resecta_anatomy::{Lattice, LatticeOptions, Section};

    #[test]
    fn all_instruction_sets_give_the_same_bits() {
        // Rows of prisms: long enough for runs, with a load and a contact.
        let positions = (0..40).flat_map(|n| {
            let z = 1.5 * f64::from(n);
            [
                DVec3::new(0.0, 0.0, z),
                DVec3::new(0.0, 2.0, z),
                DVec3::new(2.0, 0.0, z),
            ]
        });
        let pentahedra = (0..39).map(|n| [0, 1, 2, 3, 4, 5].map(|corner| 3 * n + corner));
        let mesh = TissueMesh::from_pentahedra(positions.collect(), pentahedra.collect());
        for poisson_ratio in [None, Some(0.45)] {
            let material = Material {
                poisson_ratio,
                ..Material::default()
            };
            let tissue = Tissue::new(&mesh, &material).expect("prisms are a tissue");
            assert_same_bits(tissue);
        }
    }

    #[test]
    fn all_instruction_sets_give_the_same_bits_in_a_tube_on_its_bed() {
        // Rings and layers: springs that close a ring, lead to the next range of lanes, and leave a site over at the end of a run.
        for steps in [24, 27, 36] {
            let ring = |radius: f64| -> Vec<DVec2> {
                let angles = (0..steps).map(|n| f64::from(n) / f64::from(steps) * std::f64::consts::TAU);
                angles.map(|angle| DVec2::from_angle(angle) * radius).collect()
            };
            let (outer, inner) = (ring(15.0), ring(4.0));
            let sections = [0.0, 5.0, 10.0, 15.0].map(|z| Section {
                z,
                outer: &outer,
                inner: &inner,
            });
            let options = LatticeOptions {
                alpha_deg: 360.0 / f64::from(steps),
                ..LatticeOptions::default()
            };
            let lattice = Lattice::from_sections(&sections, &options).expect("a tube is a lattice");
            let shear = ShearResistance::Diagonals;
            let material = Material {
                shear,
                ..Material::default()
            };
            let mesh = TissueMesh::from_lattice(&lattice, shear);
            let tissue = Tissue::new(&mesh, &material).expect("a tube is a tissue");
            let layout = tissue.springs.layout();
            let mut runs = layout.blocks().iter().flat_map(|block| layout.runs(block));
            assert!(runs.any(|run| run.turn > 0 && run.span > 1 && run.bundles > 2 && run.bundles % 2 == 1));
            assert_same_bits(tissue);
        }
    }

    fn assert_same_bits(mut tissue: Tissue) {
        tissue
            .set_load(60, Vec3::new(300.0, -200.0, 100.0))
            .expect("a finite load");
        let plane = Pusher::HalfSpace {
            normal: Vec3::Z,
            offset_mm: [0.0, 0.7],
        };
        let contact = Contact::new(TissuePoint::on_triangle([0, 1, 2], [0.2, 0.3, 0.5]), plane);
        let plan = Plan::new(0.02, tissue.bound_s(), tissue.effort()).expect("a plain plan");
        let levels = Level::new();
        let narrower = [levels.as_avx2().map(Level::Avx2), levels.as_sse2().map(Level::Sse2)];
        let contacts = &[contact];
        let runs: Vec<Motion> = narrower
            .into_iter()
            .flatten()
            .map(|level| {
                let mut tissue = tissue.clone();
                let run = Run {
                    tissue: &mut tissue,
                    plan,
                    contacts,
                };
                with_level(level, run);
                tissue.motion
            })
            .collect();
        tissue.run(plan, contacts);
        assert!(!runs.is_empty());
        for motion in runs {
            assert_eq!(tissue.motion, motion);
        }
    }
}
