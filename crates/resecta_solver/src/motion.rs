//! Motion: how a step is made and how long it may be.
//!
//! Equation (1) of the papers, `m x'' + gamma x' + g(x) = f`, is integrated by velocity Verlet with the damping integrated
//! exactly: over half a step of length h the velocity obeys `v' = -r v + a` with constant acceleration a and rate
//! `r = gamma / m`, so `v <- e^(-r h/2) v + (1 - e^(-r h/2)) / r a`. The order is 2; two half kicks in a row are one kick
//! over h, so a substep costs one evaluation of the forces.
//!
//! For a spring of circular frequency w the step is stable while `h w² tanh(r h / 2) / r <= 2`, which is `h <= 2 / w`
//! without damping and more with it. [`Tissue::bound_s`] takes w² from `2 Σ k / m` over the springs of a node, which no
//! eigenvalue exceeds; the substeps of an advance follow from it.
//!
//! # Inertia
//!
//! Around a narrow lumen, and at the ends of a real gland, cells are a fraction as wide as elsewhere and would dictate a
//! fraction of the step to the whole tissue. A node whose frequency is above [`FASTEST`] times the median gets as much more
//! inertia as brings it there (selective mass scaling). Equilibrium, damping and loads do not change, and inertia decides
//! little in tissue this viscous; the error is part of what [`crate::reference`] shows.

use std::ops::Range;

use glam::Vec3;

use crate::Contact;
use crate::tissue::{Motion, Nodes, Tissue};
use crate::vectors::Vectors;

/// Substeps are shortened below the bound by this factor, so that rounding and a spring turned by a large motion do not
/// meet the bound exactly.
const SAFETY: f64 = 0.95;

/// Squares of frequencies above this many times the median are brought down to it. By measurement on the lattice of the
/// papers' size (10,800 nodes), 2 saves two substeps in five. The error over 1/60 s, RMS over the nodes, is then 2e-3 mm
/// just after a cut that lets the tissue move by 6e-2 mm, and 1e-6 mm once it creeps (with diagonals; the papers' lattice:
/// 2e-3 and 2e-4 mm). At 1.25 the gain is 1.3 times more, and errors 1 to 7 times larger.
const FASTEST: f32 = 2.0;

/// More substeps than this in one advance are refused: at 0.1 ms a substep that is 100 s.
pub const MOST_SUBSTEPS: u32 = 1_000_000;

/// What one advance did.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct StepReport {
    /// Substeps made.
    pub substeps: u32,
    /// Length of a substep, s.
    pub substep_s: f64,
    /// Longest stable substep, s.
    pub bound_s: f64,
    /// Nodes put aside during this advance, by rising index.
    pub put_aside: Vec<PutAside>,
    /// Contacts left out because a number in them was not finite, or a node in them does not live.
    pub contacts_refused: usize,
}

/// A node whose velocity stopped being one that tissue can have (finite, below a kilometre a second). It stays at its last finite position and takes no further part.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PutAside {
    /// The node.
    pub node: u32,
    /// Its last finite position, mm.
    pub position: Vec3,
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

/// How an advance is divided.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Plan {
    substeps: u32,
    substep_s: f64,
    bound_s: f64,
}

/// Arrays that an advance writes before it reads them; kept to avoid allocation.
#[derive(Debug, Clone)]
pub(crate) struct Scratch {
    forces: Vectors,
    external: Vectors,
    start: Motion,
    /// Over half a substep, and over a whole one.
    half: Kick,
    whole: Kick,
    /// Stiffness of the springs around each node, for the bound.
    stiffness: Vec<f32>,
}

impl Scratch {
    pub fn new(count: usize) -> Scratch {
        let vectors = || Vectors::zero(count);
        Scratch {
            forces: vectors(),
            external: vectors(),
            start: Motion::zero(count),
            half: Kick::zero(count),
            whole: Kick::zero(count),
            stiffness: vec![0.0; count],
        }
    }
}

/// What a kick over some time does to the velocity of every node.
#[derive(Debug, Clone)]
struct Kick {
    /// How long the kick is, s.
    time_s: f64,
    /// The rates that `decay` and `gain` hold for, damping over inertia, 1/s.
    rate: Vec<f32>,
    /// Factor left of the velocity.
    decay: Vec<f32>,
    /// Velocity gained per acceleration, s.
    gain: Vec<f32>,
    /// Velocity gained per force, s/g.
    push: Vec<f32>,
}

impl Kick {
    fn zero(count: usize) -> Kick {
        Kick {
            time_s: 0.0,
            rate: vec![f32::NAN; count],
            decay: vec![0.0; count],
            gain: vec![0.0; count],
            push: vec![0.0; count],
        }
    }

    /// Makes it a kick over that time. Exponentials are computed only for nodes whose rate changed.
    fn prepare(&mut self, time_s: f64, nodes: &Nodes) {
        if self.time_s != time_s {
            self.time_s = time_s;
            self.rate.fill(f32::NAN);
        }
        let mut last = (f32::NAN, (0.0, 0.0));
        for node in 0..self.rate.len() {
            let inverse_inertia = nodes.inverse_inertia[node];
            let rate = nodes.damping_rate[node] * (nodes.mass[node] * inverse_inertia);
            if rate != self.rate[node] {
                if rate != last.0 {
                    last = (rate, exact_damping(time_s, f64::from(rate)));
                }
                self.rate[node] = rate;
                (self.decay[node], self.gain[node]) = last.1;
            }
            self.push[node] = self.gain[node] * inverse_inertia;
        }
    }
}

/// What is left of a velocity after `time_s`, and what an acceleration adds to it in that time, s.
fn exact_damping(time_s: f64, rate: f64) -> (f32, f32) {
    let gain = if rate > 0.0 {
        -(-rate * time_s).exp_m1() / rate
    } else {
        time_s
    };
    ((-rate * time_s).exp() as f32, gain as f32)
}

/// The longest h with `h w² tanh(r h / 2) / r <= 2`, by bisection between the bound without damping and one beyond it.
fn longest_stable(square: f64, rate: f64) -> f64 {
    if square <= 0.0 {
        return f64::INFINITY;
    }
    let undamped = 2.0 / square.sqrt();
    if !(rate > 0.0 && rate.is_finite()) {
        return undamped;
    }
    let stable = |step: f64| step * square * (0.5 * rate * step).tanh() / rate <= 2.0;
    // tanh <= 1, so 2 r / w² is stable whatever the step; tanh x <= x, so is the undamped bound.
    let mut low = undamped.max(2.0 * rate / square);
    let mut high = 2.0 * low;
    while stable(high) {
        (low, high) = (high, 2.0 * high);
    }
    for _ in 0..40 {
        let middle = 0.5 * (low + high);
        if stable(middle) {
            low = middle;
        } else {
            high = middle;
        }
    }
    low
}

impl Tissue {
    /// The longest stable substep, s; infinite for a tissue that no spring holds.
    ///
    /// Inertias and bound are computed anew when a spring, a mass, a damping or what lives has changed.
    pub fn bound_s(&mut self) -> f64 {
        if let Some(bound) = self.bound {
            return bound;
        }
        let (mut square, mut rate) = (0.0f32, f32::INFINITY);
        self.sum_stiffness();
        for node in 0..self.node_count() {
            let mass = self.nodes.mass[node];
            if self.nodes.pentahedra_left[node] == 0 || self.nodes.put_aside[node] {
                continue;
            }
            let stiffness = self.scratch.stiffness[node];
            let inertia = mass.max(stiffness / self.fastest);
            self.nodes.inverse_inertia[node] = 1.0 / inertia;
            square = square.max(stiffness / inertia);
            rate = rate.min(self.nodes.damping_rate[node] * (mass / inertia));
        }
        let bound = longest_stable(f64::from(square), f64::from(rate));
        self.bound = Some(bound);
        bound
    }

    /// Sums up how stiffly every node is held, µN/mm: no frequency exceeds the root of this over inertia.
    fn sum_stiffness(&mut self) {
        self.springs.sum_stiffness(&mut self.scratch.stiffness);
        for (stiffness, support) in self.scratch.stiffness.iter_mut().zip(&self.nodes.support) {
            *stiffness = 2.0 * *stiffness + support;
        }
    }

    /// Sets the limit of frequencies from those of the tissue as built.
    pub(crate) fn limit_frequencies(&mut self) {
        self.sum_stiffness();
        let mut squares: Vec<f32> = self
            .scratch
            .stiffness
            .iter()
            .zip(&self.nodes.mass)
            .map(|(stiffness, mass)| stiffness / mass)
            .collect();
        squares.sort_unstable_by(f32::total_cmp);
        self.fastest = FASTEST * squares[squares.len() / 2];
    }

    /// Moves the tissue on by `duration_s`, in as many equal substeps as the bound asks for.
    ///
    /// Every contact holds after every substep, those later in the list winning over earlier ones. Should the
    /// velocity of a node stop being one that tissue can have, the advance is made again with that node put aside.
    ///
    /// # Errors
    ///
    /// When the duration is no positive number or would take more than [`MOST_SUBSTEPS`] substeps.
    pub fn advance(&mut self, duration_s: f64, contacts: &[Contact]) -> Result<StepReport, StepError> {
        let plan = self.plan(duration_s)?;
        let usable = self.usable(contacts);
        self.collapse.approach(duration_s);
        self.scratch.start.copy_from(&self.motion);
        self.run(plan, &usable);
        let put_aside = if self.motion.is_sound() {
            Vec::new()
        } else {
            self.run_with_care(plan, &usable)
        };
        self.collapse.arrive();
        Ok(StepReport {
            substeps: plan.substeps,
            substep_s: plan.substep_s,
            bound_s: plan.bound_s,
            put_aside,
            contacts_refused: contacts.len() - usable.len(),
        })
    }

    /// Estimates the error of an advance, without making it: root mean square over the nodes, mm.
    ///
    /// By step doubling: the advance is tried with its substeps and with twice as many; the difference is 3/4 of the error
    /// of a method of order 2. What added inertia costs is not in it. Costs three advances.
    ///
    /// # Errors
    ///
    /// As [`Tissue::advance`].
    pub fn estimate_error_mm(&mut self, duration_s: f64, contacts: &[Contact]) -> Result<f64, StepError> {
        let plan = self.plan(duration_s)?;
        let usable = self.usable(contacts);
        self.collapse.approach(duration_s);
        self.scratch.start.copy_from(&self.motion);
        self.run(plan, &usable);
        let coarse = self.motion.positions.clone();
        self.motion.copy_from(&self.scratch.start);
        let finer = Plan {
            substeps: 2 * plan.substeps,
            substep_s: 0.5 * plan.substep_s,
            ..plan
        };
        self.run(finer, &usable);
        let sum: f64 = (0..self.node_count() as u32)
            .filter(|&node| self.is_node_alive(node))
            .map(|node| f64::from(coarse.at(node).distance_squared(self.motion.positions.at(node))))
            .sum();
        self.motion.copy_from(&self.scratch.start);
        Ok(4.0 / 3.0 * (sum / self.living.nodes.max(1) as f64).sqrt())
    }

    fn plan(&mut self, duration_s: f64) -> Result<Plan, StepError> {
        if !(duration_s.is_finite() && duration_s > 0.0) {
            return Err(StepError::Duration(duration_s));
        }
        let bound_s = self.bound_s();
        let needed = (duration_s / (SAFETY * bound_s)).ceil().max(1.0);
        if needed > f64::from(MOST_SUBSTEPS) {
            return Err(StepError::TooManySubsteps {
                duration_s,
                bound_s,
                needed,
            });
        }
        Ok(Plan {
            substeps: needed as u32,
            substep_s: duration_s / needed,
            bound_s,
        })
    }

    fn usable(&self, contacts: &[Contact]) -> Vec<Contact> {
        let usable =
            |contact: &&Contact| contact.is_finite() && contact.nodes.iter().all(|&node| self.is_node_alive(node));
        contacts.iter().filter(usable).copied().collect()
    }

    /// Makes the substeps of a plan from where the tissue is, with the widest vector instructions there are. The result has
    /// the same bits with each: what is fused is written so, and nothing is reordered.
    fn run(&mut self, plan: Plan, contacts: &[Contact]) {
        #[cfg(target_arch = "x86_64")]
        {
            let fused = is_x86_feature_detected!("fma");
            if fused && is_x86_feature_detected!("avx512f") && is_x86_feature_detected!("avx512vl") {
                // SAFETY: the processor has been asked for these instructions.
                return unsafe { self.run_avx512(plan, contacts) };
            }
            if fused && is_x86_feature_detected!("avx2") {
                // SAFETY: the processor has been asked for these instructions.
                return unsafe { self.run_avx2(plan, contacts) };
            }
        }
        self.run_anywhere(plan, contacts);
    }

    #[cfg(target_arch = "x86_64")]
    #[target_feature(enable = "avx512f,avx512vl,avx2,fma")]
    fn run_avx512(&mut self, plan: Plan, contacts: &[Contact]) {
        self.run_anywhere(plan, contacts);
    }

    #[cfg(target_arch = "x86_64")]
    #[target_feature(enable = "avx2,fma")]
    fn run_avx2(&mut self, plan: Plan, contacts: &[Contact]) {
        self.run_anywhere(plan, contacts);
    }

    #[inline(always)]
    fn run_anywhere(&mut self, plan: Plan, contacts: &[Contact]) {
        self.begin(plan);
        for substep in 1..=plan.substeps {
            self.substep(plan, substep, contacts);
        }
        self.end();
    }

    /// Makes the same substeps again from the start, and puts aside every node whose motion stops being sound.
    fn run_with_care(&mut self, plan: Plan, contacts: &[Contact]) -> Vec<PutAside> {
        let start = self.scratch.start.clone();
        self.motion.copy_from(&start);
        self.begin(plan);
        let mut put_aside = Vec::new();
        for substep in 1..=plan.substeps {
            let before = self.motion.clone();
            self.substep(plan, substep, contacts);
            self.put_aside_what_is_not_sound(&before, &mut put_aside);
        }
        self.end();
        put_aside.sort_unstable_by_key(|put_aside| put_aside.node);
        put_aside
    }

    /// Loads and coefficients; the sums of forces begin with the loads.
    #[inline(always)]
    fn begin(&mut self, plan: Plan) {
        let scratch = &mut self.scratch;
        scratch.half.prepare(0.5 * plan.substep_s, &self.nodes);
        scratch.whole.prepare(plan.substep_s, &self.nodes);
        let loads = [&self.nodes.load, &self.nodes.balance, self.collapse.current()].map(Vectors::each);
        for (axis, external) in scratch.external.each_mut().into_iter().enumerate() {
            let [load, balance, collapse] = loads.map(|load| &load[axis][..external.len()]);
            for n in 0..external.len() {
                external[n] = load[n] + balance[n] + collapse[n];
            }
        }
        scratch.forces.copy_from(&scratch.external);
    }

    /// One substep: forces, the kick that ends the last substep and begins this one (half a kick at the start), drift, and
    /// contacts. Block by block: see `springs.rs`.
    #[inline(always)]
    fn substep(&mut self, plan: Plan, substep: u32, contacts: &[Contact]) {
        let scratch = &mut self.scratch;
        for (node, step) in self.collapse.steps() {
            scratch.external.add(node, step / plan.substeps as f32);
        }
        let kick = if substep == 1 { &scratch.half } else { &scratch.whole };
        let substep_s = plan.substep_s as f32;
        for block in self.springs.blocks() {
            self.springs
                .add_forces(block, &self.motion.positions, &mut scratch.forces);
            self.nodes
                .add_bed_forces(&block.nodes, &self.motion.positions, &mut scratch.forces);
            let nodes = block.nodes.clone();
            self.motion
                .kick_and_drift(nodes, kick, substep_s, &mut scratch.forces, &scratch.external);
        }
        let time = substep as f32 / plan.substeps as f32;
        for contact in contacts {
            self.motion.hold(contact, time, plan, &self.nodes.inverse_inertia);
        }
    }

    /// The forces at the end, and the half kick that ends the last substep.
    #[inline(always)]
    fn end(&mut self) {
        for block in self.springs.blocks() {
            self.springs
                .add_forces(block, &self.motion.positions, &mut self.scratch.forces);
            self.nodes
                .add_bed_forces(&block.nodes, &self.motion.positions, &mut self.scratch.forces);
        }
        self.scratch
            .half
            .apply(&self.scratch.forces, &mut self.motion.velocities);
    }

    /// Stops every node that [`is_sound`] does not hold for where it was before.
    fn put_aside_what_is_not_sound(&mut self, before: &Motion, put_aside: &mut Vec<PutAside>) {
        for node in 0..self.node_count() as u32 {
            if self.motion.velocities.at(node).to_array().into_iter().all(is_sound) {
                continue;
            }
            let (index, position) = (node as usize, before.positions.at(node));
            self.motion.positions.set(node, position);
            self.motion.lost.set(node, Vec3::ZERO);
            self.motion.velocities.set(node, Vec3::ZERO);
            self.nodes.put_aside[index] = true;
            self.nodes.inverse_inertia[index] = 0.0;
            // What pushed it may be infinite, and 0 times infinity is not 0.
            self.nodes.load.set(node, Vec3::ZERO);
            self.scratch.external.set(node, Vec3::ZERO);
            self.scratch.forces.set(node, Vec3::ZERO);
            self.scratch.half.push[index] = 0.0;
            self.scratch.whole.push[index] = 0.0;
            put_aside.push(PutAside { node, position });
        }
    }
}

impl Nodes {
    /// Adds the force of the bed to the nodes of a block that it holds, µN.
    #[inline(always)]
    fn add_bed_forces(&self, block: &Range<usize>, positions: &Vectors, forces: &mut Vectors) {
        for bed in &self.supported {
            let held = bed.start.max(block.start)..bed.end.min(block.end);
            if held.is_empty() {
                continue;
            }
            let axes = forces
                .each_mut()
                .into_iter()
                .zip(positions.each())
                .zip(self.rest.each());
            for ((forces, places), rest) in axes {
                let (support, forces) = (&self.support[held.clone()], &mut forces[held.clone()]);
                let (places, rest) = (&places[held.clone()], &rest[held.clone()]);
                for n in 0..forces.len() {
                    forces[n] = support[n].mul_add(rest[n] - places[n], forces[n]);
                }
            }
        }
    }
}

/// Whether a component of a velocity, mm/s, is one that tissue can have: finite, and below a kilometre a second.
fn is_sound(velocity: f32) -> bool {
    velocity.abs() < 1e6
}

impl Kick {
    #[inline(always)]
    fn apply(&self, forces: &Vectors, velocities: &mut Vectors) {
        for (velocities, forces) in velocities.each_mut().into_iter().zip(forces.each()) {
            let count = velocities.len();
            let (decay, push, forces) = (&self.decay[..count], &self.push[..count], &forces[..count]);
            for n in 0..count {
                velocities[n] = decay[n].mul_add(velocities[n], push[n] * forces[n]);
            }
        }
    }
}

impl Motion {
    fn zero(count: usize) -> Motion {
        Motion {
            positions: Vectors::zero(count),
            lost: Vectors::zero(count),
            velocities: Vectors::zero(count),
        }
    }

    fn copy_from(&mut self, other: &Motion) {
        self.positions.copy_from(&other.positions);
        self.lost.copy_from(&other.lost);
        self.velocities.copy_from(&other.velocities);
    }

    /// Whether [`is_sound`] holds for every node.
    fn is_sound(&self) -> bool {
        // No early exit: the whole scan vectorises.
        let all_sound = |values: &[f32]| values.iter().fold(true, |sound, &value| sound & is_sound(value));
        self.velocities.each().into_iter().all(all_sound)
    }

    /// Changes the velocities of some nodes by the forces, moves the nodes on by their velocities, keeps what rounding takes
    /// from the positions (compensated summation), and starts the next sum of forces from the loads. One pass.
    #[inline(always)]
    fn kick_and_drift(
        &mut self,
        nodes: Range<usize>,
        kick: &Kick,
        time_s: f32,
        forces: &mut Vectors,
        external: &Vectors,
    ) {
        let count = nodes.len();
        let (decay, push) = (&kick.decay[nodes.clone()], &kick.push[nodes.clone()]);
        let (positions, lost, velocities) = (
            self.positions.each_mut(),
            self.lost.each_mut(),
            self.velocities.each_mut(),
        );
        let loads = external.each();
        let axes = positions
            .into_iter()
            .zip(lost)
            .zip(velocities)
            .zip(forces.each_mut())
            .zip(loads);
        for ((((positions, lost), velocities), forces), loads) in axes {
            let (positions, lost) = (&mut positions[nodes.clone()], &mut lost[nodes.clone()]);
            let (velocities, forces) = (&mut velocities[nodes.clone()], &mut forces[nodes.clone()]);
            let loads = &loads[nodes.clone()];
            for n in 0..count {
                let velocity = decay[n].mul_add(velocities[n], push[n] * forces[n]);
                let step = time_s.mul_add(velocity, -lost[n]);
                let place = positions[n] + step;
                lost[n] = (place - positions[n]) - step;
                positions[n] = place;
                velocities[n] = velocity;
                forces[n] = loads[n];
            }
        }
    }

    /// Brings a contact's point to its side of the plane at `time` (0 to 1 over the advance), the nodes sharing the way by
    /// weight and inverse mass, and takes the velocity that goes against the plane's own.
    fn hold(&mut self, contact: &Contact, time: f32, plan: Plan, inverse_inertia: &[f32]) {
        let Contact {
            nodes, weights, normal, ..
        } = *contact;
        let share = [0, 1, 2].map(|corner| weights[corner] * inverse_inertia[nodes[corner] as usize]);
        let compliance: f32 = share.iter().zip(&weights).map(|(share, weight)| share * weight).sum();
        if compliance <= 0.0 {
            return;
        }
        let along = |vectors: &Vectors| -> f32 {
            nodes
                .iter()
                .zip(&weights)
                .map(|(&node, weight)| weight * vectors.at(node).dot(normal))
                .sum()
        };
        let offset = contact.offset_start + time * (contact.offset_end - contact.offset_start);
        let depth = offset - along(&self.positions);
        if depth <= 0.0 {
            return;
        }
        let duration = plan.substep_s as f32 * plan.substeps as f32;
        let against = (contact.offset_end - contact.offset_start) / duration - along(&self.velocities);
        for (&node, share) in nodes.iter().zip(share) {
            self.positions.add(node, normal * (depth * share / compliance));
            if against > 0.0 {
                self.velocities.add(node, normal * (against * share / compliance));
            }
        }
    }
}

#[cfg(all(test, target_arch = "x86_64"))]
mod tests {
    use super::*;
    use crate::{Material, TissueMesh};
    use glam::DVec3;

    #[test]
    fn vector_instructions_give_the_same_bits_as_scalar_ones() {
        // A row of prisms: long enough for runs, with a load and a contact.
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
        let mut tissue = Tissue::new(&mesh, &Material::default()).expect("prisms are a tissue");
        tissue
            .set_load(60, Vec3::new(300.0, -200.0, 100.0))
            .expect("a finite load");
        let contact = Contact {
            nodes: [0, 1, 2],
            weights: [0.2, 0.3, 0.5],
            normal: Vec3::Z,
            offset_start: 0.0,
            offset_end: 0.7,
        };
        let plan = tissue.plan(0.02).expect("a plain plan");
        let mut scalar = tissue.clone();
        scalar.run_anywhere(plan, &[contact]);
        tissue.run(plan, &[contact]);
        assert_eq!(tissue.motion, scalar.motion);
    }
}
