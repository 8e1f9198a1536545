//! A network of nodes and springs alone, without pentahedra: a scene for the motion, in which nothing can be cut.

use glam::{DVec3, Vec3};

use crate::bound::Weighing;
use crate::collapse::Collapse;
use crate::motion::Scratch;
use crate::ranges::{self, FURTHEST_MM, HEAVIEST_G, MOST_DAMPED, STIFFEST};
use crate::sleep::Sleep;
use crate::springs::Springs;
use crate::surface::Surface;
use crate::tissue::{Living, Motion, NodeKind, Nodes, Pentahedra, Tissue};
use crate::vectors::{Scalars, Vectors};
use crate::watch::{Accuracy, Effort};

/// Nodes and springs with all that moves them. Every list about nodes has one entry a node, every list about springs one a
/// spring.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Network {
    /// Where each node is at the start, mm.
    pub positions: Vec<DVec3>,
    /// Velocity at the start, mm/s.
    pub velocities: Vec<DVec3>,
    /// Mass, g; above 0.
    pub masses: Vec<f64>,
    /// Damping, gamma of equation (1), g/s; 0 or more.
    pub damping: Vec<f64>,
    /// Constant load, µN.
    pub loads: Vec<DVec3>,
    /// Whether the node is held where it is.
    pub fixed: Vec<bool>,
    /// The two nodes of each spring.
    pub springs: Vec<[u32; 2]>,
    /// Stiffness, µN/mm; 0 or more.
    pub stiffness: Vec<f64>,
    /// Length at rest, mm; 0 or more.
    pub rest_lengths: Vec<f64>,
}

/// Why a network is no scene.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum NetworkError {
    /// A list has not one entry for each node or spring.
    #[error("{field} has {count} entries, expected {expected}")]
    Count {
        /// Name of the list.
        field: &'static str,
        /// Its entries.
        count: usize,
        /// Nodes or springs there are.
        expected: usize,
    },
    /// There is no node, or more than 32-bit indices can name.
    #[error("a network of {0} nodes, expected 1 to 500 million")]
    Size(usize),
    /// A value that cannot be.
    #[error("{field} of {what} {index} is {value}, expected {expected}")]
    Value {
        /// Name of the list.
        field: &'static str,
        /// `node` or `spring`.
        what: &'static str,
        /// Index of the entry.
        index: usize,
        /// The value; of a vector its first offending component.
        value: f64,
        /// What was expected.
        expected: &'static str,
    },
    /// A spring names a node that there is not.
    #[error("spring {spring} joins node {node}, but there are {count} nodes")]
    NoSuchNode {
        /// The spring.
        spring: usize,
        /// The node it names.
        node: u32,
        /// Nodes there are.
        count: usize,
    },
}

/// More nodes are refused.
const MOST: usize = 500_000_000;

impl Network {
    /// Checks that every list is complete and every value can be.
    pub fn check(&self) -> Result<(), NetworkError> {
        let (nodes, springs) = (self.positions.len(), self.springs.len());
        if nodes == 0 || nodes > MOST {
            return Err(NetworkError::Size(nodes));
        }
        let counts = [
            ("velocities", self.velocities.len(), nodes),
            ("masses", self.masses.len(), nodes),
            ("damping", self.damping.len(), nodes),
            ("loads", self.loads.len(), nodes),
            ("fixed", self.fixed.len(), nodes),
            ("stiffness", self.stiffness.len(), springs),
            ("rest_lengths", self.rest_lengths.len(), springs),
        ];
        if let Some(&(field, count, expected)) = counts.iter().find(|(_, count, expected)| count != expected) {
            return Err(NetworkError::Count { field, count, expected });
        }
        // What the solver keeps is single precision.
        let within = |value: f64, least: f32, most: f32| ranges::within(value as f32, least, most);
        for (field, vectors, most, expected) in [
            ("positions", &self.positions, FURTHEST_MM, "a number within 10 m"),
            ("velocities", &self.velocities, f32::MAX, "a finite number"),
            ("loads", &self.loads, f32::MAX, "a finite number"),
        ] {
            for (index, vector) in vectors.iter().enumerate() {
                if let Some(value) = vector.to_array().into_iter().find(|value| !within(*value, -most, most)) {
                    return Err(NetworkError::Value {
                        field,
                        what: "node",
                        index,
                        value,
                        expected,
                    });
                }
            }
        }
        let rates = self
            .damping
            .iter()
            .zip(&self.masses)
            .map(|(damping, mass)| damping / mass);
        for (field, what, values, [least, most], expected) in [
            (
                "masses",
                "node",
                &self.masses,
                [f32::MIN_POSITIVE, HEAVIEST_G],
                "above 0, up to 1e12 g",
            ),
            (
                "damping",
                "node",
                &self.damping,
                [0.0, f32::MAX],
                "a finite number, 0 or more",
            ),
            (
                "damping over mass",
                "node",
                &rates.collect(),
                [0.0, MOST_DAMPED],
                "0 to 1e24 1/s",
            ),
            (
                "stiffness",
                "spring",
                &self.stiffness,
                [0.0, STIFFEST],
                "0 to 1e18 µN/mm",
            ),
            (
                "rest_lengths",
                "spring",
                &self.rest_lengths,
                [0.0, FURTHEST_MM],
                "0 to 10 m",
            ),
        ] {
            let offending = values.iter().position(|&value| !within(value, least, most));
            if let Some(index) = offending {
                return Err(NetworkError::Value {
                    field,
                    what,
                    index,
                    value: values[index],
                    expected,
                });
            }
        }
        for (spring, ends) in self.springs.iter().enumerate() {
            if let Some(&node) = ends.iter().find(|&&node| node as usize >= nodes) {
                return Err(NetworkError::NoSuchNode {
                    spring,
                    node,
                    count: nodes,
                });
            }
        }
        Ok(())
    }
}

impl Tissue {
    /// A tissue of nodes and springs alone. It makes the full effort: masses and springs are what they are.
    ///
    /// # Errors
    ///
    /// The first thing that [`Network::check`] finds.
    pub fn from_network(network: &Network) -> Result<Tissue, NetworkError> {
        network.check()?;
        let count = network.positions.len();
        let rest_length: Vec<f32> = network.rest_lengths.iter().map(|length| *length as f32).collect();
        let stiffness: Vec<f32> = network.stiffness.iter().map(|stiffness| *stiffness as f32).collect();
        let spring_count = network.springs.len();
        let springs = Springs::new(
            count,
            network.springs.clone(),
            &stiffness,
            &rest_length,
            vec![0; spring_count],
            vec![0.0; spring_count],
        );
        let (sites, sleep) = (springs.layout().sites(), Sleep::none(springs.layout()));
        let single = |vectors: &[DVec3]| Vectors::of(sites, vectors.iter().map(|vector| vector.as_vec3()));
        let positions = single(&network.positions);
        let lost = network
            .positions
            .iter()
            .map(|position| (position.as_vec3().as_dvec3() - *position).as_vec3());
        let velocities = network.velocities.iter().zip(&network.fixed);
        let velocities = velocities.map(|(velocity, fixed)| if *fixed { Vec3::ZERO } else { velocity.as_vec3() });
        let masses = || network.masses.iter().map(|mass| *mass as f32);
        let damping_rate = network
            .damping
            .iter()
            .zip(&network.masses)
            .map(|(damping, mass)| (damping / mass) as f32);
        let inverse_inertia = masses()
            .zip(&network.fixed)
            .map(|(mass, fixed)| if *fixed { 0.0 } else { 1.0 / mass });
        let mut tissue = Tissue {
            motion: Motion {
                lost: Vectors::of(sites, lost),
                velocities: Vectors::of(sites, velocities),
                positions: positions.clone(),
            },
            nodes: Nodes {
                rest: positions,
                kind: vec![NodeKind::Inner; count],
                inverse_inertia: Scalars::of(sites, inverse_inertia),
                mass: Scalars::of(sites, masses()),
                damping_rate: Scalars::of(sites, damping_rate),
                support: Scalars::zero(sites),
                supported: Vec::new(),
                load: single(&network.loads),
                balance: Vectors::zero(sites),
                alive: vec![true; count],
                fixed: network.fixed.clone(),
                pentahedra_left: vec![0; count],
                around_start: vec![0; count + 1],
                around: Vec::new(),
                put_aside: vec![false; count],
            },
            springs,
            pentahedra: Pentahedra {
                nodes: Vec::new(),
                zone: Vec::new(),
                rest_volume: Vec::new(),
                longest_edge_squared: Vec::new(),
                fill: Vec::new(),
                capsule_area: Vec::new(),
                held: Vec::new(),
                alive: Vec::new(),
                share_start: vec![0],
                shares: Vec::new(),
            },
            volumes: None,
            surface: Surface::new(&[]).expect("no pentahedra share no face"),
            collapse: Collapse::new(sites),
            water: None,
            frame: None,
            modulus_pa: 0.0,
            pre_tension: 0.0,
            mean_length: rest_length.iter().sum::<f32>() / spring_count.max(1) as f32,
            reach: 0.0,
            rest_volume_mm3: 0.0,
            removed_volume_mm3: 0.0,
            living: Living {
                nodes: count,
                springs: spring_count,
                pentahedra: 0,
            },
            bound: None,
            weighing: Weighing::new(),
            usual: None,
            sleep,
            motion_version: 0,
            accuracy: Accuracy::new(),
            watch: None,
            team: None,
            scratch: Scratch::new(sites, spring_count),
        };
        tissue.measure_usual();
        tissue.set_effort(Effort::FULL);
        Ok(tissue)
    }
}
