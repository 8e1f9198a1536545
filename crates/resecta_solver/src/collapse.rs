//! How tissue around a cut answers: the two collapse laws, and how their forces come on.
//!
//! Both laws give a *resection force* on nodes that stay, which acts as an external force in equation (1). It is never put
//! on at once: the force in effect follows its target with the time constant [`TIME_CONSTANT_S`].

use glam::Vec3;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::ranges::{STRONGEST_COLLAPSE_UN, within};
use crate::sites::Sites;
use crate::vectors::Vectors;

/// The law by which tissue collapses into a cut. A scene chooses one or, by `None` of an `Option`, neither.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
pub enum CollapseLaw {
    /// 2003 paper, II.C: a removed spring leaves the force that would have compressed it fully, `mu * l0`, on the node that
    /// stays. Our reading of the direction: towards the removed node, so that tissue moves into the cavity.
    ///
    /// A cut finer than the pentahedra weakens springs by degrees. Each then pulls the end that holds more of its tissue
    /// towards the other, with the stiffness lost in place of `mu`, times the share by which that one holds less.
    CompressionForce {
        /// Share of that force that acts, 0 to 1. At 1 every cut edge is pulled by the whole modulus, which is no slight
        /// collapse; the papers name no share.
        #[schemars(range(min = 0.0, max = 1.0))]
        share: f32,
    },
    /// Second paper, equations (3) and (4): `p_i = k_i dV_i`, `dV_i = c_i * sum of V_j^c / V_j^0` over the pentahedra that
    /// node i lost. Read literally, (4) multiplies by the coordinates of the cutting zone's centre, which would depend on
    /// the origin; our reading: c_i is the unit direction from the node to that centre.
    HydraulicPressure {
        /// k_i, the hydraulic resistance: force for each whole pentahedron lost, µN; 0 or more. Of one that is thinned the
        /// share that went counts.
        #[schemars(range(min = 0.0))]
        resistance_un: f32,
    },
}

impl CollapseLaw {
    /// Whether its number can be: a share from 0 to 1, a resistance from 0 to 1e9 µN.
    pub fn is_usable(&self) -> bool {
        match *self {
            CollapseLaw::CompressionForce { share } => within(share, 0.0, 1.0),
            CollapseLaw::HydraulicPressure { resistance_un } => within(resistance_un, 0.0, STRONGEST_COLLAPSE_UN),
        }
    }
}

impl Default for CollapseLaw {
    fn default() -> Self {
        CollapseLaw::CompressionForce { share: 0.05 }
    }
}

/// How fast resection forces come on, s: several times what the tissue takes to follow.
pub(crate) const TIME_CONSTANT_S: f64 = 0.2;

/// The resection forces of a tissue.
#[derive(Debug, Clone)]
pub(crate) struct Collapse {
    target: Vectors,
    current: Vectors,
    /// Nodes whose force is still on its way, and what it gains in the advance under way.
    approaching: Vec<(u32, Vec3)>,
    is_approaching: Vec<bool>,
}

impl Collapse {
    pub fn new(sites: Sites) -> Collapse {
        Collapse {
            target: Vectors::zero(sites),
            current: Vectors::zero(sites),
            approaching: Vec::new(),
            is_approaching: vec![false; sites.nodes()],
        }
    }

    /// The forces in effect, µN.
    pub fn current(&self) -> &Vectors {
        &self.current
    }

    /// Adds to the target of a node.
    pub fn add(&mut self, node: u32, force: Vec3) {
        self.target.add(node, force);
        if !std::mem::replace(&mut self.is_approaching[node as usize], true) {
            self.approaching.push((node, Vec3::ZERO));
        }
    }

    /// Forgets the force of a node that is removed, and tells what it was to become.
    pub fn take(&mut self, node: u32) -> Vec3 {
        let force = self.target.at(node);
        self.target.set(node, Vec3::ZERO);
        self.current.set(node, Vec3::ZERO);
        force
    }

    /// Works out what every force gains over an advance of that length.
    pub fn approach(&mut self, duration_s: f64) {
        let share = -(-duration_s / TIME_CONSTANT_S).exp_m1() as f32;
        for (node, step) in &mut self.approaching {
            *step = share * (self.target.at(*node) - self.current.at(*node));
        }
    }

    /// What each force gains over the advance under way.
    pub fn steps(&self) -> impl Iterator<Item = (u32, Vec3)> + '_ {
        self.approaching.iter().copied()
    }

    /// Ends an advance: the gains are in effect, and forces near their target have arrived.
    pub fn arrive(&mut self) {
        let Collapse {
            target,
            current,
            approaching,
            is_approaching,
        } = self;
        approaching.retain(|&(node, step)| {
            current.add(node, step);
            let left = target.at(node) - current.at(node);
            let on_its_way = left.length() > 1e-3 * target.at(node).length();
            if !on_its_way {
                current.set(node, target.at(node));
                is_approaching[node as usize] = false;
            }
            on_its_way
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_force_comes_on_exponentially_however_the_time_is_divided() {
        let after = |steps: u32| {
            let mut collapse = Collapse::new(Sites::fewest(1));
            collapse.add(0, Vec3::X * 100.0);
            for _ in 0..steps {
                collapse.approach(TIME_CONSTANT_S / f64::from(steps));
                collapse.arrive();
            }
            collapse.current().at(0).x
        };
        let exact = 100.0 * (1.0 - (-1.0f32).exp());
        for steps in [1, 3, 60] {
            assert!((after(steps) - exact).abs() < 1e-3, "{steps} steps: {}", after(steps));
        }
    }

    #[test]
    fn a_force_arrives_and_then_costs_nothing() {
        let mut collapse = Collapse::new(Sites::fewest(1));
        collapse.add(0, Vec3::Y);
        for _ in 0..20 {
            collapse.approach(TIME_CONSTANT_S);
            collapse.arrive();
        }
        assert_eq!(collapse.current().at(0), Vec3::Y);
        assert_eq!(collapse.steps().count(), 0);
    }
}
