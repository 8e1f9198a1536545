//! Energy and momentum of a tissue: what the laws of motion are checked against.

use glam::DVec3;

use crate::mobility::Frame;
use crate::pressure::energy_over_stiffness;
use crate::tissue::Tissue;

/// Energy of a tissue by kind, nJ (µN·mm).
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Energy {
    /// Of motion, by the nodes' inertia.
    pub kinetic: f64,
    /// In the springs, with the stiffness that they are stepped with.
    pub elastic: f64,
    /// In the pentahedra that hold their volume; 0 where the material has no Poisson's ratio of its own.
    pub volume: f64,
    /// In the bed that holds the capsule.
    pub support: f64,
    /// Of the loads that balance pre-tension; 0 at rest, and only a sum with `elastic` means anything.
    pub balance: f64,
}

impl Energy {
    /// The sum, nJ.
    pub fn total(&self) -> f64 {
        self.kinetic + self.elastic + self.volume + self.support + self.balance
    }
}

impl Tissue {
    /// The energy as it is now.
    pub fn energy(&self) -> Energy {
        let mut energy = Energy::default();
        for (spring, &[a, b]) in (0u32..).zip(&self.springs.nodes) {
            let elongation =
                self.position64(a).distance(self.position64(b)) - f64::from(self.springs.rest_length(spring));
            energy.elastic += 0.5 * f64::from(self.springs.stepped_stiffness(spring)) * elongation * elongation;
        }
        if self.volumes.is_some() {
            for pentahedron in self.living_pentahedron_indices() {
                let rest = self.rest_volume_mm3(pentahedron);
                let held = energy_over_stiffness(self.volume_of(pentahedron) / rest);
                energy.volume += self.volume_stiffness_pa(pentahedron) * rest * held;
            }
        }
        for node in (0..self.node_count() as u32).filter(|&node| self.is_node_alive(node)) {
            let moved = self.position64(node) - self.rest_position(node).as_dvec3();
            energy.kinetic += 0.5 * f64::from(self.inertia_g(node)) * self.velocity(node).as_dvec3().length_squared();
            let from_bed = moved - self.bed_moves(self.rest_position(node)).as_dvec3();
            energy.support += 0.5 * f64::from(self.nodes.support.at(node)) * from_bed.length_squared();
            energy.balance -= self.nodes.balance.at(node).as_dvec3().dot(moved);
        }
        energy.support += self.frame.as_ref().map_or(0.0, Frame::energy);
        energy
    }

    /// Momentum of all living nodes by their inertia, g·mm/s.
    pub fn momentum(&self) -> DVec3 {
        let of = |node: u32| self.velocity(node).as_dvec3() * f64::from(self.inertia_g(node));
        (0..self.node_count() as u32)
            .filter(|&node| self.is_node_alive(node))
            .map(of)
            .sum()
    }
}
