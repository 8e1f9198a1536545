//! Scenes: an annulus of nodes and springs of the gland's size, its outer wall fixed, pulled at a patch of its inner wall.

use std::f64::consts::TAU;

use glam::DVec3;
use resecta_solver::Network;

/// Inner and outer radius, mm.
const RADII: [f64; 2] = [3.0, 22.5];
/// Length along the axis, mm.
const LENGTH: f64 = 40.0;
/// Density, g/mm³.
const DENSITY: f64 = 1.05e-3;
/// Modulus of the soft tissue, Pa = µN/mm².
const MODULUS: f64 = 20e3;
/// Direction of the load: inwards, a little askew so that no symmetry hides anything.
const PULL: DVec3 = DVec3::new(-1.0, -0.17, -0.11);

/// An annular lattice.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub struct Annulus {
    /// Nodes around the axis, along it and across the wall; 3, 2 and 3 or more.
    pub counts: [usize; 3],
    /// Whether the faces of cells have diagonals (18 neighbours) or not (6, a mechanism).
    pub diagonals: bool,
    /// Share by which springs are stretched at the start, where loads keep them in balance.
    pub pre_tension: f64,
    /// Stiffness of the springs within the layer next to the fixed one, over that of all others.
    pub stiffness_ratio: f64,
    /// Damping rate gamma / m, 1/s.
    pub damping_rate: f64,
    /// Pull on the patch, µN.
    pub pull_un: f64,
    /// Whether a notch is cut beside the patch.
    pub notch: bool,
}

impl Annulus {
    /// Nodes, springs, masses and loads; at rest.
    pub fn network(&self) -> Network {
        let [around, along, across] = self.counts;
        let step = [
            TAU / around as f64,
            LENGTH / (along - 1) as f64,
            (RADII[1] - RADII[0]) / (across - 1) as f64,
        ];
        let mut network = Network::default();
        // Where each site of the grid stands among the nodes, unless the notch took it.
        let mut index = vec![None; around * along * across];
        let mut patch = Vec::new();
        for (site, entry) in index.iter_mut().enumerate() {
            let [a, s, l] = self.coordinates(site);
            let (angle, z, radius) = (a as f64 * step[0], s as f64 * step[1], RADII[0] + l as f64 * step[2]);
            if self.notch && l <= across / 3 && in_notch(angle, z) {
                continue;
            }
            *entry = Some(network.positions.len() as u32);
            let (inner, outer) = (
                (radius - 0.5 * step[2]).max(RADII[0]),
                (radius + 0.5 * step[2]).min(RADII[1]),
            );
            let depth = if s == 0 || s == along - 1 {
                0.5 * step[1]
            } else {
                step[1]
            };
            let mass = DENSITY * 0.5 * (outer * outer - inner * inner) * step[0] * depth;
            if l == 0 && in_patch(angle, z) {
                patch.push(network.positions.len());
            }
            network
                .positions
                .push(DVec3::new(radius * angle.cos(), radius * angle.sin(), z));
            network.masses.push(mass);
            network.damping.push(self.damping_rate * mass);
            network.fixed.push(l == across - 1);
        }
        let count = network.positions.len();
        network.velocities = vec![DVec3::ZERO; count];
        network.loads = vec![DVec3::ZERO; count];
        let whole: f64 = patch.iter().map(|&node| network.masses[node]).sum();
        for node in patch {
            network.loads[node] = PULL.normalize() * (self.pull_un * network.masses[node] / whole);
        }
        self.join(&index, &mut network);
        network
    }

    fn coordinates(&self, site: usize) -> [usize; 3] {
        let [_, along, across] = self.counts;
        [site / (along * across), site / across % along, site % across]
    }

    /// Springs between neighbours, and the loads that balance their tension.
    fn join(&self, index: &[Option<u32>], network: &mut Network) {
        let [around, along, across] = self.counts;
        let volume = std::f64::consts::PI * (RADII[1].powi(2) - RADII[0].powi(2)) * LENGTH;
        let size = (volume / index.len() as f64).cbrt();
        // With diagonals of equal stiffness k a cube of side a has the modulus 2.5 k / a.
        let (soft, offsets) = if self.diagonals {
            (0.4 * MODULUS * size, &OFFSETS[..])
        } else {
            (MODULUS * size, &OFFSETS[..3])
        };
        for (site, node) in index.iter().enumerate() {
            let [a, s, l] = self.coordinates(site);
            for &(da, ds, dl) in offsets {
                let (Some(s1), Some(l1)) = (s.checked_add_signed(ds), l.checked_add_signed(dl)) else {
                    continue;
                };
                if s1 >= along || l1 >= across || l == across - 1 && l1 == across - 1 {
                    continue;
                }
                let a1 = (a + da) % around;
                let (Some(node), Some(other)) = (*node, index[(a1 * along + s1) * across + l1]) else {
                    continue;
                };
                let stiff = l == across - 2 && l1 == across - 2;
                let stiffness = soft * if stiff { self.stiffness_ratio } else { 1.0 };
                let between = network.positions[other as usize] - network.positions[node as usize];
                let rest_length = between.length() / (1.0 + self.pre_tension);
                let pull = between * (stiffness * (1.0 - rest_length / between.length()));
                network.loads[node as usize] -= pull;
                network.loads[other as usize] += pull;
                network.springs.push([node, other]);
                network.stiffness.push(stiffness);
                network.rest_lengths.push(rest_length);
            }
        }
    }
}

/// From a site to its neighbours around, along and across: three along edges, six along diagonals.
const OFFSETS: [(usize, isize, isize); 9] = [
    (0, 0, 1),
    (0, 1, 0),
    (1, 0, 0),
    (0, 1, 1),
    (0, 1, -1),
    (1, 0, 1),
    (1, 0, -1),
    (1, 1, 0),
    (1, -1, 0),
];

/// The middle third of the inner wall, 40 degrees to either side.
fn in_patch(angle: f64, z: f64) -> bool {
    angle.min(TAU - angle).to_degrees() < 40.0 + 1e-6 && in_middle(z)
}

/// Beside the patch, 45 to 130 degrees, as long as it is.
fn in_notch(angle: f64, z: f64) -> bool {
    (45.0..130.0).contains(&angle.to_degrees()) && in_middle(z)
}

fn in_middle(z: f64) -> bool {
    z > LENGTH / 3.0 - 1e-6 && z < 2.0 * LENGTH / 3.0 + 1e-6
}
