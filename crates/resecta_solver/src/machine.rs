//! Substeps made by another machine: what a graphics processor, say, needs to know of a tissue to move it as [`Tissue`]
//! would, and what it must tell.
//!
//! The tissue keeps what does not move, divides the time, judges the bound and takes over where a machine's motion is
//! refused. The machine holds the motion, makes the substeps of a [`Stretch`] and measures what came of them, so that
//! within an advance nothing but a few numbers goes to and fro.

use glam::{DVec3, Vec3};

use crate::bound::{Plan, longest_stable};
use crate::kick::Kick;
use crate::motion::{StepError, StepReport};
use crate::tissue::{EditError, Tissue};

/// Something that holds the motion of a tissue and makes its substeps.
pub trait Machine {
    /// Why it cannot.
    type Error: From<StepError>;

    /// Makes the substeps of a stretch from where the nodes are: half a kick, then drifts with whole kicks between them,
    /// half a kick. Measures what came of it, and keeps what was before.
    ///
    /// # Errors
    ///
    /// When the machine fails; the advance ends.
    fn make(&mut self, stretch: &Stretch) -> Result<Measured, Self::Error>;

    /// Writes the motion before the last stretch to the tissue, with [`Tissue::set_motion`].
    ///
    /// # Errors
    ///
    /// As [`Machine::make`].
    fn take_back(&mut self, tissue: &mut Tissue) -> Result<(), Self::Error>;

    /// Takes over the motion of the tissue, and what has become of its nodes.
    ///
    /// # Errors
    ///
    /// As [`Machine::make`].
    fn take_over(&mut self, tissue: &Tissue) -> Result<(), Self::Error>;
}

/// What a machine measures at the end of a stretch.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Measured {
    /// The largest square of a circular frequency, 1/s²: over the nodes that move, twice the largest eigenvalue of the sum
    /// of the tensors `k (s I + (1 - s) n nᵀ)` of a node's springs (stiffness k, direction n, and the share s of its length
    /// by which it is stretched), plus the stiffness of the bed, over the inertia.
    pub largest_square: f32,
    /// Whether every component of a velocity is a number up to [`Stretch::fastest_mm_per_s`].
    pub is_sound: bool,
}

/// Substeps of equal length between two measurements.
pub struct Stretch<'a> {
    tissue: &'a Tissue,
    plan: Plan,
}

/// What a kick does to the velocity of a node: `v <- decay v + push f`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NodeKick {
    /// Factor left of the velocity.
    pub decay: f32,
    /// Velocity gained per force, s/g; 0 for a node that does not move.
    pub push: f32,
}

impl Stretch<'_> {
    /// How many there are.
    pub fn substeps(&self) -> u32 {
        self.plan.substeps
    }

    /// Length of a substep, s.
    pub fn substep_s(&self) -> f64 {
        self.plan.substep_s
    }

    /// The fastest that a component of a sound velocity may be, mm/s.
    pub fn fastest_mm_per_s(&self) -> f32 {
        self.plan.fastest()
    }

    /// Differs from that of another stretch of the same tissue where the kicks may differ.
    pub fn kicks_made_for(&self) -> (f64, u64) {
        (self.plan.substep_s, self.tissue.weighing.round)
    }

    /// The kick over half a substep.
    pub fn half_kick(&self, node: u32) -> NodeKick {
        self.kick(&self.tissue.scratch.kicks.half, node)
    }

    /// The kick over a whole substep.
    pub fn whole_kick(&self, node: u32) -> NodeKick {
        self.kick(&self.tissue.scratch.kicks.whole, node)
    }

    fn kick(&self, kicks: &[Kick], node: u32) -> NodeKick {
        let (site, lane) = self.tissue.springs.layout().sites().place(node);
        NodeKick {
            decay: kicks[site].decay.0[lane],
            push: kicks[site].push.0[lane],
        }
    }

    /// All forces on a node at the start besides springs and bed, µN.
    pub fn load(&self, node: u32) -> Vec3 {
        self.tissue.load_in_effect(node)
    }

    /// The nodes on which this force changes, and by how much with each substep, µN.
    pub fn load_gains(&self) -> impl Iterator<Item = (u32, Vec3)> + '_ {
        let substeps = self.plan.substeps as f32;
        let steps = self.tissue.collapse.steps();
        steps.map(move |(node, step)| (node, step / substeps))
    }
}

impl Tissue {
    /// As [`Tissue::advance_steps`], with the substeps made by another machine that has taken over this tissue's motion.
    ///
    /// Time is divided and the bound checked as there. A stretch whose motion outran its bound or stopped being sound is
    /// taken back and made by the tissue itself, which repeats it and puts nodes aside as ever. Water presses on the surface as the
    /// tissue itself last lay. A watch ends. Afterwards
    /// the motion is in the machine; that of the tissue is out of date.
    ///
    /// # Errors
    ///
    /// As [`Tissue::advance_steps`], and when the machine fails; the stretches before are made.
    pub fn advance_steps_on<M: Machine>(
        &mut self,
        machine: &mut M,
        step_s: f64,
        steps: u64,
    ) -> Result<StepReport, M::Error> {
        self.watch = None;
        let (effort, slowest_rate) = (self.effort(), self.slowest_rate());
        self.in_portions(step_s, steps, |tissue, part_s, made| {
            let plan_of = |bound_s| Plan::of_steps(part_s, made, bound_s, effort);
            let plan = plan_of(tissue.bound_s())?;
            tissue.motion_version += 1;
            tissue.collapse.approach(plan.duration_s());
            tissue.press();
            let (kicks, nodes) = (&mut tissue.scratch.kicks, &tissue.nodes);
            kicks.prepare(plan.substep_s, tissue.weighing.round, nodes);
            let Measured {
                largest_square,
                is_sound,
            } = machine.make(&Stretch { tissue, plan })?;
            let bound_s = longest_stable(f64::from(largest_square), f64::from(slowest_rate));
            if is_sound && plan.substep_s <= bound_s {
                tissue.bound = Some(bound_s);
                tissue.collapse.arrive();
                return Ok(StepReport {
                    substeps: plan.substeps,
                    substep_s: plan.substep_s,
                    bound_s: plan.bound_s,
                    ..StepReport::default()
                });
            }
            machine.take_back(tissue)?;
            tissue.forget_bound();
            let mut report = tissue.make(plan_of, &[])?;
            report.substeps_repeated += plan.substeps;
            machine.take_over(tissue)?;
            Ok(report)
        })
    }

    /// Measures the tissue as it lies, and gives nodes their inertias by it. An advance by another machine keeps these;
    /// whoever hands a tissue over does this first.
    pub fn settle(&mut self) {
        self.measure_bound_s();
    }

    /// Stiffness of the bed that holds a node at its rest position, µN/mm; 0 where there is none.
    pub fn support(&self, node: u32) -> f32 {
        self.nodes.support.at(node)
    }

    /// Moves a node, mm, keeping what single precision cannot hold of its place, and gives it a velocity, mm/s.
    ///
    /// # Errors
    ///
    /// When there is no such living node, or a number is not finite.
    pub fn set_motion(&mut self, node: u32, position: DVec3, velocity: Vec3) -> Result<(), EditError> {
        // No limit of places: where a run has led is where the node is.
        self.check_node(node, "velocity", velocity)?;
        self.check_node(node, "position", position.as_vec3())?;
        let single = position.as_vec3();
        self.motion.positions.set(node, single);
        self.motion.lost.set(node, (single.as_dvec3() - position).as_vec3());
        self.motion.velocities.set(node, velocity);
        self.forget_bound();
        self.wake(node);
        self.motion_version += 1;
        Ok(())
    }

    /// The forces on a node now, besides springs and bed, µN.
    pub(crate) fn load_in_effect(&self, node: u32) -> Vec3 {
        // In the order of `begin`.
        let load = self.nodes.load.at(node) + self.nodes.balance.at(node) + self.collapse.current().at(node);
        let of_surroundings = self.forces_of_surroundings();
        of_surroundings.fold(load, |load, forces| load + forces.at(node))
    }

    /// The least damping rate of a node that moves, 1/s; infinite where none does.
    fn slowest_rate(&self) -> f32 {
        let nodes = &self.nodes;
        let inverses = nodes.inverse_inertia.iter();
        let rates = nodes.damping_rate.iter().zip(nodes.mass.iter()).zip(inverses);
        rates
            .filter(|(_, inverse)| *inverse > 0.0)
            .map(|((rate, mass), inverse)| rate * (mass * inverse))
            .fold(f32::INFINITY, f32::min)
    }
}
