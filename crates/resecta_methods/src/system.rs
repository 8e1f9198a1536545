//! What every method integrates: `m x'' + gamma x' = springs + load` in double precision, and the one force kernel.
//!
//! Units are mm, g and s: force in µN, stiffness in µN/mm.

use glam::{DMat3, DVec3};
use resecta_solver::{Network, NetworkError};

/// A spring: force `k (l - l0)` along it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Spring {
    /// The nodes it joins.
    pub ends: [u32; 2],
    /// k, µN/mm; 0 or more.
    pub stiffness: f64,
    /// l0, mm; 0 or more.
    pub rest_length: f64,
}

/// How a spring answers small movements `d` of one end against the other: `across d + along (along · d)`, µN.
///
/// This is its Hessian `k [s I + (1 - s) n nᵀ]` with `s = 1 - l0 / l`; of a compressed spring s is negative and is taken as
/// 0, so that no sum of tensors has a negative eigenvalue.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Tensor {
    /// k s, µN/mm.
    pub across: f64,
    /// n times the root of k (1 - s), (µN/mm)^(1/2).
    pub along: DVec3,
}

impl Spring {
    /// Force on its first end, µN, where `between` leads from the first end to the second, mm. A spring without length pulls
    /// nowhere.
    #[inline]
    pub fn pull(&self, between: DVec3) -> DVec3 {
        let length = between.length();
        if length > 0.0 {
            between * (self.stiffness * (1.0 - self.rest_length / length))
        } else {
            DVec3::ZERO
        }
    }

    /// Its tensor, where `between` leads from the first end to the second, mm.
    #[inline]
    pub fn tensor(&self, between: DVec3) -> Tensor {
        let length = between.length();
        let stretch = if self.rest_length < length {
            1.0 - self.rest_length / length
        } else {
            0.0
        };
        let along = if length > 0.0 {
            between * ((self.stiffness * (1.0 - stretch)).sqrt() / length)
        } else {
            DVec3::ZERO
        };
        Tensor {
            across: self.stiffness * stretch,
            along,
        }
    }

    /// Elastic energy, nJ (µN mm).
    fn energy(&self, between: DVec3) -> f64 {
        0.5 * self.stiffness * (between.length() - self.rest_length).powi(2)
    }
}

impl Tensor {
    /// Force that answers a small movement of one end against the other, µN.
    #[inline]
    pub fn times(&self, movement: DVec3) -> DVec3 {
        movement * self.across + self.along * self.along.dot(movement)
    }

    /// As a matrix, µN/mm.
    pub fn matrix(&self) -> DMat3 {
        let outer = DMat3::from_cols(
            self.along * self.along.x,
            self.along * self.along.y,
            self.along * self.along.z,
        );
        DMat3::from_diagonal(DVec3::splat(self.across)) + outer
    }
}

/// What a method has computed, without regard to the machine.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, serde::Serialize)]
pub struct Work {
    /// Passes of the force kernel over all springs.
    pub force_passes: u64,
    /// Passes of the stiffness product over all springs, linearisations among them.
    pub product_passes: u64,
    /// Sweeps of XPBD over the springs or of VBD over the nodes.
    pub sweeps: u64,
    /// Springs visited by all of these.
    pub spring_visits: u64,
}

/// Where the nodes are and how fast.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct State {
    /// mm.
    pub positions: Vec<DVec3>,
    /// mm/s; of a fixed node zero.
    pub velocities: Vec<DVec3>,
}

/// What moves: masses, damping, loads and springs.
#[derive(Debug, Clone, PartialEq)]
pub struct System {
    /// Mass of each node, g; above 0.
    pub masses: Vec<f64>,
    /// 1/g; of a fixed node 0.
    pub inverse_masses: Vec<f64>,
    /// Damping gamma of each node, g/s; 0 or more.
    pub damping: Vec<f64>,
    /// Constant load on each node, µN; on a fixed node zero.
    pub loads: Vec<DVec3>,
    /// The fixed nodes, by rising index.
    pub fixed: Vec<u32>,
    /// The springs.
    pub springs: Vec<Spring>,
}

impl System {
    /// A network and where it starts.
    ///
    /// # Errors
    ///
    /// The first thing that [`Network::check`] finds.
    pub fn new(network: &Network) -> Result<(System, State), NetworkError> {
        network.check()?;
        let unless_fixed = |vectors: &[DVec3]| -> Vec<DVec3> {
            let pairs = vectors.iter().zip(&network.fixed);
            pairs
                .map(|(vector, fixed)| if *fixed { DVec3::ZERO } else { *vector })
                .collect()
        };
        let inverse = |(mass, fixed): (&f64, &bool)| if *fixed { 0.0 } else { 1.0 / mass };
        let springs = network
            .springs
            .iter()
            .zip(&network.stiffness)
            .zip(&network.rest_lengths);
        let system = System {
            masses: network.masses.clone(),
            inverse_masses: network.masses.iter().zip(&network.fixed).map(inverse).collect(),
            damping: network.damping.clone(),
            loads: unless_fixed(&network.loads),
            fixed: (0..)
                .zip(&network.fixed)
                .filter(|(_, fixed)| **fixed)
                .map(|(node, _)| node)
                .collect(),
            springs: springs
                .map(|((ends, stiffness), rest_length)| Spring {
                    ends: *ends,
                    stiffness: *stiffness,
                    rest_length: *rest_length,
                })
                .collect(),
        };
        let state = State {
            positions: network.positions.clone(),
            velocities: unless_fixed(&network.velocities),
        };
        Ok((system, state))
    }

    /// Nodes there are.
    pub fn node_count(&self) -> usize {
        self.masses.len()
    }

    /// The force kernel: springs and loads, without damping, µN; zero on fixed nodes. Each spring once.
    pub fn forces(&self, positions: &[DVec3], forces: &mut [DVec3], work: &mut Work) {
        work.force_passes += 1;
        work.spring_visits += self.springs.len() as u64;
        forces.copy_from_slice(&self.loads);
        for spring in &self.springs {
            let [a, b] = spring.ends.map(|end| end as usize);
            let pull = spring.pull(positions[b] - positions[a]);
            forces[a] += pull;
            forces[b] -= pull;
        }
        self.hold(forces);
    }

    /// Sets the entries of fixed nodes to zero.
    pub fn hold(&self, vectors: &mut [DVec3]) {
        for &node in &self.fixed {
            vectors[node as usize] = DVec3::ZERO;
        }
    }

    /// Elastic energy less the work of the loads on `positions`, nJ; an elastic pass over the springs.
    pub fn potential(&self, positions: &[DVec3], work: &mut Work) -> f64 {
        work.force_passes += 1;
        work.spring_visits += self.springs.len() as u64;
        let elastic: f64 = self
            .springs
            .iter()
            .map(|spring| {
                let [a, b] = spring.ends.map(|end| positions[end as usize]);
                spring.energy(b - a)
            })
            .sum();
        let worked: f64 = self
            .loads
            .iter()
            .zip(positions)
            .map(|(load, place)| load.dot(*place))
            .sum();
        elastic - worked
    }

    /// Kinetic energy, nJ.
    pub fn kinetic(&self, velocities: &[DVec3]) -> f64 {
        let terms = self.masses.iter().zip(velocities);
        terms
            .map(|(mass, velocity)| 0.5 * mass * velocity.length_squared())
            .sum()
    }

    /// Damping rate gamma / m of a node, 1/s.
    pub fn damping_rate(&self, node: usize) -> f64 {
        self.damping[node] / self.masses[node]
    }
}

impl State {
    /// Whether every number is finite and no node is further out than 1e6 mm. One pass.
    pub fn is_sound(&self) -> bool {
        let far = 1e6;
        let within = self
            .positions
            .iter()
            .fold(true, |all, place| all & (place.abs().max_element() <= far));
        // Of NaN a comparison is false, and a sum with NaN or infinity is not finite.
        within && self.velocities.iter().copied().sum::<DVec3>().is_finite()
    }
}
