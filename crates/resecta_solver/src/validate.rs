//! What must hold in every tissue, whatever was done to it, and the name of what does not.

use std::collections::BTreeMap;

use resecta_anatomy::wedge;

use crate::tissue::Tissue;

/// The first thing found inconsistent.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum Inconsistency {
    /// A living spring ends at a removed node.
    #[error("spring {spring} lives, but its node {node} has been removed")]
    DanglingSpring {
        /// The spring.
        spring: u32,
        /// The node.
        node: u32,
    },
    /// A removed spring still pulls, or a living one has stiffness or rest length that are no lengths.
    #[error("spring {spring} (alive: {alive}) has stiffness {stiffness} µN/mm and rest length {rest_length} mm")]
    SpringValue {
        /// The spring.
        spring: u32,
        /// Whether it lives.
        alive: bool,
        /// Its stiffness.
        stiffness: f32,
        /// Its rest length.
        rest_length: f32,
    },
    /// A node counts another number of living pentahedra than there are around it.
    #[error("node {node} counts {counted} living pentahedra, but {found} are around it")]
    NodeCount {
        /// The node.
        node: u32,
        /// What it counts.
        counted: u16,
        /// What there are.
        found: usize,
    },
    /// A living node has no living spring.
    #[error("node {0} lives, but no living spring ends there")]
    OrphanNode(u32),
    /// A removed node still moves, or a living one that was not put aside does not.
    #[error("node {node} (alive: {alive}) has mass {mass} g and inverse mass {inverse_inertia} 1/g")]
    NodeMass {
        /// The node.
        node: u32,
        /// Whether it lives.
        alive: bool,
        /// Its mass.
        mass: f32,
        /// The inverse used in motion.
        inverse_inertia: f32,
    },
    /// A position or velocity is not finite.
    #[error("node {0} has a position or velocity that is not finite")]
    NotFinite(u32),
    /// The surface kept is not the surface of the living pentahedra.
    #[error("the surface has {kept} triangles {sample:?} too many and lacks {missing} of those exposed")]
    WrongSurface {
        /// How many triangles stand there that should not.
        kept: usize,
        /// How many should stand there and do not.
        missing: usize,
        /// One of them.
        sample: [u32; 3],
    },
    /// An edge is not passed as often in one sense as in the other.
    #[error("the surface is open or turned at the edge between nodes {0} and {1}")]
    OpenSurface(u32, u32),
    /// The surface encloses another volume than the pentahedra have.
    #[error("the surface encloses {enclosed_mm3} mm³, the pentahedra have {pentahedra_mm3} mm³")]
    WrongVolume {
        /// By the surface.
        enclosed_mm3: f64,
        /// By the pentahedra.
        pentahedra_mm3: f64,
    },
    /// Removed and living volume do not add up to the volume built.
    #[error("{removed_mm3} mm³ were removed and {left_mm3} mm³ are left of {initial_mm3} mm³")]
    VolumeLost {
        /// Removed by the tissue's account.
        removed_mm3: f64,
        /// Rest volume of the living pentahedra.
        left_mm3: f64,
        /// Rest volume at the start.
        initial_mm3: f64,
    },
    /// A node lives without pentahedra, or is removed with some around it.
    #[error("node {node} (alive: {alive}) has {found} pentahedra around it")]
    NodeAlive {
        /// The node.
        node: u32,
        /// Whether it is said to live.
        alive: bool,
        /// Living pentahedra around it.
        found: usize,
    },
    /// A removed pentahedron still presses on its corners.
    #[error("pentahedron {0} has been removed, but still holds its volume")]
    Presses(u32),
    /// A count of living elements is wrong.
    #[error("{counted} {what} are said to live, but {found} do")]
    Living {
        /// What is counted.
        what: &'static str,
        /// The count kept.
        counted: usize,
        /// The count found.
        found: usize,
    },
}

impl Tissue {
    /// Checks everything that must hold between nodes, springs, pentahedra and surface.
    ///
    /// # Errors
    ///
    /// The first inconsistency, named. Costs as much as many steps: meant for tests and debug builds.
    pub fn validate(&self) -> Result<(), Inconsistency> {
        let springs_around = self.validate_springs()?;
        self.validate_nodes(&springs_around)?;
        self.validate_surface()?;
        self.validate_volume()?;
        self.validate_counts()
    }

    fn validate_springs(&self) -> Result<Vec<u32>, Inconsistency> {
        let mut around = vec![0u32; self.node_count()];
        for spring in 0..self.spring_count() as u32 {
            let state = self.spring(spring);
            let alive = self.is_spring_alive(spring);
            let no_length = |value: f32| !(value.is_finite() && value >= 0.0);
            if no_length(state.stiffness) || no_length(state.rest_length) || (!alive && state.stiffness != 0.0) {
                return Err(Inconsistency::SpringValue {
                    spring,
                    alive,
                    stiffness: state.stiffness,
                    rest_length: state.rest_length,
                });
            }
            for node in state.nodes.into_iter().filter(|_| alive) {
                around[node as usize] += 1;
                if !self.is_node_alive(node) {
                    return Err(Inconsistency::DanglingSpring { spring, node });
                }
            }
        }
        Ok(around)
    }

    fn validate_nodes(&self, springs_around: &[u32]) -> Result<(), Inconsistency> {
        for node in 0..self.node_count() as u32 {
            let index = node as usize;
            let found = self.pentahedra_around(node).count();
            let counted = self.nodes.pentahedra_left[index];
            if usize::from(counted) != found {
                return Err(Inconsistency::NodeCount { node, counted, found });
            }
            let alive = self.is_node_alive(node);
            // A network has no pentahedra, and may have nodes alone.
            if self.pentahedron_count() > 0 {
                if alive != (found > 0) {
                    return Err(Inconsistency::NodeAlive { node, alive, found });
                }
                if alive && springs_around[index] == 0 {
                    return Err(Inconsistency::OrphanNode(node));
                }
            }
            let (mass, inverse_inertia) = (self.nodes.mass.at(node), self.nodes.inverse_inertia.at(node));
            let moves = alive && !self.nodes.put_aside[index] && !self.nodes.fixed[index];
            if moves != (inverse_inertia > 0.0) || !inverse_inertia.is_finite() || !mass.is_finite() {
                return Err(Inconsistency::NodeMass {
                    node,
                    alive,
                    mass,
                    inverse_inertia,
                });
            }
            if !self.position(node).is_finite() || !self.velocity(node).is_finite() {
                return Err(Inconsistency::NotFinite(node));
            }
        }
        Ok(())
    }

    fn validate_surface(&self) -> Result<(), Inconsistency> {
        let mut balance: BTreeMap<[u32; 3], i32> = BTreeMap::new();
        for (_, triangle) in self.surface.triangles() {
            *balance.entry(turned(triangle)).or_default() += 1;
        }
        for triangle in self.surface.expected(&self.pentahedra.nodes, &self.pentahedra.alive) {
            *balance.entry(turned(triangle)).or_default() -= 1;
        }
        let count = |sign: i32| balance.values().filter(|&&count| count.signum() == sign).count();
        if let Some((&sample, _)) = balance.iter().find(|&(_, &count)| count != 0) {
            return Err(Inconsistency::WrongSurface {
                kept: count(1),
                missing: count(-1),
                sample,
            });
        }
        let mut edges: BTreeMap<[u32; 2], i32> = BTreeMap::new();
        for (_, [a, b, c]) in self.surface.triangles() {
            for [from, to] in [[a, b], [b, c], [c, a]] {
                *edges.entry([from.min(to), from.max(to)]).or_default() += if from < to { 1 } else { -1 };
            }
        }
        match edges.iter().find(|&(_, &sum)| sum != 0) {
            Some((&[a, b], _)) => Err(Inconsistency::OpenSurface(a, b)),
            None => Ok(()),
        }
    }

    fn validate_volume(&self) -> Result<(), Inconsistency> {
        let mut removed = (0..self.pentahedron_count() as u32).filter(|&index| !self.is_pentahedron_alive(index));
        if let Some(pentahedron) = removed.find(|&index| self.volume_stiffness_pa(index) != 0.0) {
            return Err(Inconsistency::Presses(pentahedron));
        }
        // Taken from a corner of the tissue, not the origin: a far origin would cost digits.
        let origin = self.position64(0);
        let enclosed_mm3: f64 = self
            .surface
            .triangles()
            .map(|(_, triangle)| {
                let [a, b, c] = triangle.map(|node| self.position64(node) - origin);
                a.dot(b.cross(c)) / 6.0
            })
            .sum();
        let living = || self.living_pentahedron_indices();
        // With faces cut as those of the surface are.
        let within = |pentahedron| {
            wedge::volume_within_boundary(&self.pentahedron_nodes(pentahedron), |node| self.position64(node))
        };
        let pentahedra_mm3: f64 = living().map(within).sum();
        let tolerance = 1e-9 * self.rest_volume_mm3;
        if (enclosed_mm3 - pentahedra_mm3).abs() > tolerance.max(1e-6 * pentahedra_mm3.abs()) {
            return Err(Inconsistency::WrongVolume {
                enclosed_mm3,
                pentahedra_mm3,
            });
        }
        let held = |pentahedron| self.rest_volume_mm3(pentahedron) * self.fill(pentahedron);
        let left_mm3: f64 = living().map(held).sum();
        if (left_mm3 + self.removed_volume_mm3 - self.rest_volume_mm3).abs() > tolerance {
            return Err(Inconsistency::VolumeLost {
                removed_mm3: self.removed_volume_mm3,
                left_mm3,
                initial_mm3: self.rest_volume_mm3,
            });
        }
        Ok(())
    }

    fn validate_counts(&self) -> Result<(), Inconsistency> {
        let nodes = self.nodes.alive.iter().filter(|&&alive| alive).count();
        let springs = self.springs.alive.iter().filter(|&&alive| alive).count();
        let pentahedra = self.pentahedra.alive.iter().filter(|&&alive| alive).count();
        let counts = [
            ("nodes", self.living.nodes, nodes),
            ("springs", self.living.springs, springs),
            ("pentahedra", self.living.pentahedra, pentahedra),
        ];
        match counts.into_iter().find(|(_, counted, found)| counted != found) {
            Some((what, counted, found)) => Err(Inconsistency::Living { what, counted, found }),
            None => Ok(()),
        }
    }
}

/// A triangle from its smallest corner, its sense kept.
fn turned([a, b, c]: [u32; 3]) -> [u32; 3] {
    if a < b && a < c {
        [a, b, c]
    } else if b < c {
        [b, c, a]
    } else {
        [c, a, b]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn turning_keeps_the_sense_of_a_triangle() {
        assert_eq!(turned([2, 3, 1]), [1, 2, 3]);
        assert_eq!(turned([3, 2, 1]), [1, 3, 2]);
    }
}
