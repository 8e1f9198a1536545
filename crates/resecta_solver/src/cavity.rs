//! What a cut leaves around it: lighter nodes, forces by which tissue falls into the cavity, and nodes that hold nothing.

use glam::{DVec3, Vec3};

use crate::collapse::CollapseLaw;
use crate::resect::{Loss, WeakenedSpring};
use crate::tissue::Tissue;

/// What a cut leaves: its centre, and what every node it touched lost, by rising node.
pub(crate) struct Cavity {
    centre: Vec3,
    lost: Vec<NodeLoss>,
}

/// What a node lost with what was taken around it.
struct NodeLoss {
    node: u32,
    /// Sum of V^c / V^0, of each pentahedron as much as was taken.
    ratios: f32,
    /// Sum of V^0, likewise, mm³.
    rest_volume_mm3: f64,
}

/// How a cut takes pentahedra.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Taken {
    /// Only whole ones, as in the papers.
    Whole,
    /// Parts of them.
    Part,
}

/// The ends of a spring: one holds more than the other, or the other is gone.
struct SpringEnds {
    stays: u32,
    goes: u32,
}

impl Cavity {
    /// The nodes around it, rising.
    pub fn nodes(&self) -> impl Iterator<Item = u32> {
        self.lost.iter().map(|loss| loss.node)
    }
}

impl Tissue {
    /// What is about to be taken, by node.
    pub(crate) fn cavity(&mut self, losses: &[Loss]) -> Cavity {
        let mut lost: Vec<NodeLoss> = Vec::new();
        let (mut centre, mut sum) = (DVec3::ZERO, 0.0);
        self.scratch.marked_nodes.clear();
        for loss in losses {
            let volume = self.volume_of(loss.pentahedron) * loss.share;
            (centre, sum) = (
                centre + self.centroid(loss.pentahedron).as_dvec3() * volume,
                sum + volume,
            );
            let rest_volume = self.rest_volume_mm3(loss.pentahedron);
            for node in self.pentahedron_nodes(loss.pentahedron) {
                let new = || NodeLoss {
                    node,
                    ratios: 0.0,
                    rest_volume_mm3: 0.0,
                };
                let node = self.scratch.marked_nodes.entry(node, &mut lost, new);
                node.ratios += (volume / rest_volume) as f32;
                node.rest_volume_mm3 += rest_volume * loss.share;
            }
        }
        lost.sort_unstable_by_key(|loss| loss.node);
        Cavity {
            centre: (centre / sum).as_vec3(),
            lost,
        }
    }

    /// Rest volume that the pentahedra around a node hold, mm³.
    fn volume_around(&self, node: u32) -> f64 {
        self.pentahedra_around(node)
            .map(|pentahedron| self.rest_volume_mm3(pentahedron) * self.fill(pentahedron))
            .sum()
    }

    /// The same as a share of what was there before any cut.
    fn share_around(&self, node: u32) -> f64 {
        let whole = |&pentahedron: &u32| self.rest_volume_mm3(pentahedron);
        self.volume_around(node) / self.nodes.around(node).iter().map(whole).sum::<f64>()
    }

    /// Takes from every node the mass, and from its bed the stiffness, of what is gone around it.
    pub(crate) fn lighten_nodes(&mut self, cavity: &Cavity) {
        for &NodeLoss {
            node, rest_volume_mm3, ..
        } in &cavity.lost
        {
            let after = self.volume_around(node);
            let left = (after / (after + rest_volume_mm3)) as f32;
            for quantity in [&mut self.nodes.mass, &mut self.nodes.support] {
                quantity.set(node, quantity.at(node) * left);
            }
        }
    }

    /// Lets the surroundings collapse by a law.
    pub(crate) fn collapse_into(
        &mut self,
        cavity: &Cavity,
        weakened: &[WeakenedSpring],
        law: CollapseLaw,
        taken: Taken,
    ) {
        match (law, taken) {
            (CollapseLaw::CompressionForce { share }, Taken::Whole) => {
                for spring in weakened {
                    if let Some(ends) = self.ends(spring.spring) {
                        self.pull_together(spring.spring, &ends, spring.before * share);
                    }
                }
            }
            (CollapseLaw::CompressionForce { share }, Taken::Part) => {
                for spring in weakened {
                    let [a, b] = self.springs.nodes[spring.spring as usize];
                    let [holds_a, holds_b] = [a, b].map(|node| self.share_around(node));
                    let (ends, more, less) = if holds_a > holds_b {
                        (SpringEnds { stays: a, goes: b }, holds_a, holds_b)
                    } else {
                        (SpringEnds { stays: b, goes: a }, holds_b, holds_a)
                    };
                    if more > 0.0 {
                        let difference = (1.0 - less / more) as f32;
                        self.pull_together(spring.spring, &ends, spring.lost * share * difference);
                    }
                }
            }
            (CollapseLaw::HydraulicPressure { resistance_un }, _) => self.hydraulic_pressure(cavity, resistance_un),
        }
    }

    /// 2003 paper, II.C: see [`CollapseLaw::CompressionForce`]. The stiffness is what acts of that lost, µN/mm.
    fn pull_together(&mut self, spring: u32, ends: &SpringEnds, stiffness: f32) {
        let towards = (self.position(ends.goes) - self.position(ends.stays)).normalize_or_zero();
        let force = stiffness * self.springs.rest_length(spring);
        self.collapse.add(ends.stays, towards * force);
    }

    /// The ends of a removed spring, where one stays and the other goes.
    fn ends(&self, spring: u32) -> Option<SpringEnds> {
        let [a, b] = self.springs.nodes[spring as usize];
        match [a, b].map(|node| self.is_node_alive(node)) {
            [true, false] => Some(SpringEnds { stays: a, goes: b }),
            [false, true] => Some(SpringEnds { stays: b, goes: a }),
            _ => None,
        }
    }

    /// Second paper, equations (3) and (4): see [`CollapseLaw::HydraulicPressure`].
    fn hydraulic_pressure(&mut self, cavity: &Cavity, resistance_un: f32) {
        for &NodeLoss { node, ratios, .. } in &cavity.lost {
            if self.is_node_alive(node) {
                let towards = (cavity.centre - self.position(node)).normalize_or_zero();
                self.collapse.add(node, towards * resistance_un * ratios);
            }
        }
    }

    /// Removes the nodes that no pentahedron holds any more. The resection force each had gathered goes, in equal parts,
    /// to its former neighbours that stay.
    pub(crate) fn remove_bare_nodes(&mut self, cavity: &Cavity, weakened: &[WeakenedSpring]) -> Vec<u32> {
        let bare: Vec<u32> = cavity.nodes().filter(|&node| !self.is_node_alive(node)).collect();
        // By the node that goes.
        let mut heirs: Vec<SpringEnds> = weakened.iter().filter_map(|spring| self.ends(spring.spring)).collect();
        heirs.sort_by_key(|ends| ends.goes);
        for &node in &bare {
            let force = self.collapse.take(node);
            self.nodes.inverse_inertia.set(node, 0.0);
            self.nodes.load.set(node, Vec3::ZERO);
            self.nodes.balance.set(node, Vec3::ZERO);
            self.motion.velocities.set(node, Vec3::ZERO);
            if force != Vec3::ZERO {
                let first = heirs.partition_point(|ends| ends.goes < node);
                let end = heirs.partition_point(|ends| ends.goes <= node);
                for heir in &heirs[first..end] {
                    self.collapse.add(heir.stays, force / (end - first) as f32);
                }
            }
        }
        bare
    }
}
