//! Quarantine: a node whose motion stops being one that tissue can have is put aside, and the rest goes on.

use glam::Vec3;

use crate::Contact;
use crate::bound::Plan;
use crate::tissue::{Motion, Tissue};

/// A node whose velocity stopped being one that tissue can have (finite, below a kilometre a second). It stays at its last
/// finite position and takes no further part.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PutAside {
    /// The node.
    pub node: u32,
    /// Its last finite position, mm.
    pub position: Vec3,
}

/// Whether a component of a velocity, mm/s, is one that tissue can have: finite, and below a kilometre a second.
fn is_sound(velocity: f32) -> bool {
    velocity.abs() < 1e6
}

impl Motion {
    /// Whether every velocity is one that tissue can have.
    pub(crate) fn is_sound(&self) -> bool {
        // No early exit: the whole scan vectorises.
        let all_sound = |values: &[f32]| values.iter().fold(true, |sound, &value| sound & is_sound(value));
        self.velocities.each().into_iter().all(all_sound)
    }
}

impl Tissue {
    /// Makes the substeps of a plan one by one, and puts aside every node whose motion stops being sound.
    pub(crate) fn run_with_care(&mut self, plan: Plan, contacts: &[Contact]) -> Vec<PutAside> {
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
            self.scratch.kicks.half.push[index] = 0.0;
            self.scratch.kicks.whole.push[index] = 0.0;
            put_aside.push(PutAside { node, position });
        }
    }
}
