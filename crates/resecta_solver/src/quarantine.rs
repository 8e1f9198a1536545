//! Quarantine: a node whose motion stops being one that tissue can have is put aside, and the rest goes on.

use fearless_simd::Simd;
use glam::Vec3;

use crate::Contact;
use crate::bound::Plan;
use crate::tissue::{Motion, Tissue};
use crate::widest::{Widened, with_widest};

/// A node whose velocity stopped being one that a scene can have: not finite, or such that it goes further than 300 mm in a
/// substep (in tissue a kilometre a second). It stays at its last finite position and takes no further part.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PutAside {
    /// The node.
    pub node: u32,
    /// Its last finite position, mm.
    pub position: Vec3,
}

/// Furthest way in a substep, mm: some organ's length.
const FURTHEST_MM: f64 = 300.0;

/// Whether a component of a velocity is finite and at most `fastest`, mm/s.
fn is_sound(velocity: f32, fastest: f32) -> bool {
    velocity.abs() <= fastest
}

impl Plan {
    /// The fastest that a node may be, mm/s.
    pub(crate) fn fastest(&self) -> f32 {
        (FURTHEST_MM / self.substep_s) as f32
    }
}

impl Motion {
    /// Whether every velocity is one that a scene can have.
    pub(crate) fn is_sound(&self, plan: Plan) -> bool {
        let fastest = plan.fastest();
        let components = self.velocities.values.as_flattened();
        // No early exit: the whole scan vectorises.
        components.iter().fold(true, |sound, lanes| {
            lanes
                .0
                .iter()
                .fold(sound, |sound, &velocity| sound & is_sound(velocity, fastest))
        })
    }
}

/// The substeps of a plan, each looked at before the next.
struct RunWithCare<'a> {
    tissue: &'a mut Tissue,
    plan: Plan,
    contacts: &'a [Contact],
}

impl Widened for RunWithCare<'_> {
    type Output = Vec<PutAside>;

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) -> Vec<PutAside> {
        let RunWithCare { tissue, plan, contacts } = self;
        tissue.begin(plan, contacts);
        let mut put_aside = Vec::new();
        for substep in 1..=plan.substeps {
            let before = tissue.motion.clone();
            tissue.substep(simd, plan, substep);
            if tissue.put_aside_what_is_not_sound(plan, &before, &mut put_aside) {
                // Who holds a contact with a node that stands still goes all of its way.
                tissue.scratch.contacts.reweigh(contacts, &tissue.nodes.inverse_inertia);
            }
        }
        tissue.end(simd);
        put_aside
    }
}

impl Tissue {
    /// Makes the substeps of a plan one by one, and puts aside every node whose motion stops being sound.
    pub(crate) fn run_with_care(&mut self, plan: Plan, contacts: &[Contact]) -> Vec<PutAside> {
        let mut put_aside = with_widest(RunWithCare {
            tissue: self,
            plan,
            contacts,
        });
        put_aside.sort_unstable_by_key(|put_aside| put_aside.node);
        put_aside
    }

    /// Stops every node that [`is_sound`] does not hold for where it was before; tells whether there was one.
    fn put_aside_what_is_not_sound(&mut self, plan: Plan, before: &Motion, put_aside: &mut Vec<PutAside>) -> bool {
        let (fastest, mut any) = (plan.fastest(), false);
        for node in 0..self.node_count() as u32 {
            let velocity = self.motion.velocities.at(node).to_array();
            if velocity.into_iter().all(|component| is_sound(component, fastest)) {
                continue;
            }
            any = true;
            let (index, position) = (node as usize, before.positions.at(node));
            self.motion.positions.set(node, position);
            self.motion.lost.set(node, Vec3::ZERO);
            self.motion.velocities.set(node, Vec3::ZERO);
            let named_before = std::mem::replace(&mut self.nodes.put_aside[index], true);
            self.nodes.inverse_inertia.set(node, 0.0);
            // What pushed it may be infinite, and 0 times infinity is not 0.
            self.nodes.load.set(node, Vec3::ZERO);
            self.scratch.external.set(node, Vec3::ZERO);
            self.scratch.forces.set(node, Vec3::ZERO);
            self.scratch.kicks.stop(node);
            if !named_before {
                put_aside.push(PutAside { node, position });
            }
        }
        any
    }
}
