//! Scenes of nodes and springs in a file: what `resecta solve` reads and writes, so that our solver can run beside others.
//!
//! The file is binary and little endian, in SI units: the letters `MSSCENE1`; eight `u32`, of which the first is the count
//! of nodes n and the second that of springs s; then as `f64` positions (3 n), masses (n), damping (n), loads (3 n),
//! stiffness (s) and rest lengths (s); the nodes of each spring as `i32` (2 s); a byte a node, 1 where it is held in place.
//! The letters `V0` and 3 n `f64` may follow, the velocities at the start. Ours are mm, g and s.

use std::{fs, io, path::Path};

use bevy::math::DVec3;
use resecta_solver::{Network, NetworkError, Tissue};
use thiserror::Error;

const MAGIC: &[u8; 8] = b"MSSCENE1";
const VELOCITIES: &[u8; 2] = b"V0";

/// mm in a metre; also g in a kg, and mN/m in an N/m.
const MILLI: f64 = 1e3;
/// µN in a newton.
const MICRO: f64 = 1e6;

/// Why a file is no scene.
#[derive(Debug, Error)]
#[error("{file}: {problem}")]
pub struct SpringSceneError {
    /// The file.
    pub file: String,
    /// What is wrong with it.
    pub problem: SpringSceneProblem,
}

/// What is wrong with a scene.
#[derive(Debug, Error)]
pub enum SpringSceneProblem {
    /// It cannot be read.
    #[error("cannot be read: {0}")]
    Read(io::Error),
    /// It begins with something else.
    #[error("does not begin with MSSCENE1")]
    Magic,
    /// It ends early.
    #[error("ends within {field}: {found} bytes, expected {expected}")]
    Short {
        /// What was being read.
        field: &'static str,
        /// Bytes left for it.
        found: usize,
        /// Bytes it takes.
        expected: u64,
    },
    /// Something follows that is no velocities.
    #[error("{0} bytes follow the scene, expected none or `V0` and velocities")]
    Trailing(usize),
    /// A spring names a negative node.
    #[error("spring {spring} joins node {node}, expected 0 or more")]
    NegativeNode {
        /// The spring.
        spring: usize,
        /// The node it names.
        node: i32,
    },
    /// What it holds is no scene.
    #[error(transparent)]
    Network(#[from] NetworkError),
}

/// Reads a scene.
///
/// # Errors
///
/// The first thing that is wrong with the file; memory is taken only for what the file really holds.
pub fn read(file: &Path) -> Result<Network, SpringSceneError> {
    let read = || -> Result<Network, SpringSceneProblem> {
        let bytes = fs::read(file).map_err(SpringSceneProblem::Read)?;
        let network = parse(&bytes)?;
        network.check()?;
        Ok(network)
    };
    read().map_err(|problem| SpringSceneError {
        file: file.display().to_string(),
        problem,
    })
}

/// The places of all nodes as a scene has them: x, y, z of each in metres, `f64`, little endian.
pub fn positions_to_bytes(tissue: &Tissue) -> Vec<u8> {
    (0..tissue.node_count() as u32)
        .flat_map(|node| (tissue.precise_position(node) / MILLI).to_array())
        .flat_map(f64::to_le_bytes)
        .collect()
}

fn parse(bytes: &[u8]) -> Result<Network, SpringSceneProblem> {
    let mut rest = Rest(bytes.strip_prefix(MAGIC).ok_or(SpringSceneProblem::Magic)?);
    let counts: Vec<u32> = rest.take("counts", 8, u32::from_le_bytes)?;
    let (nodes, springs) = (u64::from(counts[0]), u64::from(counts[1]));
    let vectors = |values: Vec<f64>, scale: f64| -> Vec<DVec3> {
        let (vectors, _) = values.as_chunks();
        vectors
            .iter()
            .map(|vector| DVec3::from_array(*vector) * scale)
            .collect()
    };
    let scaled = |values: Vec<f64>, scale: f64| -> Vec<f64> { values.iter().map(|value| value * scale).collect() };
    let mut numbers = |field, count| rest.take(field, count, f64::from_le_bytes);
    let positions = vectors(numbers("positions", 3 * nodes)?, MILLI);
    let masses = scaled(numbers("masses", nodes)?, MILLI);
    let damping = scaled(numbers("damping", nodes)?, MILLI);
    let loads = vectors(numbers("loads", 3 * nodes)?, MICRO);
    let stiffness = scaled(numbers("stiffness", springs)?, MILLI);
    let rest_lengths = scaled(numbers("rest lengths", springs)?, MILLI);
    let ends: Vec<i32> = rest.take("springs", 2 * springs, i32::from_le_bytes)?;
    let ends = ends
        .as_chunks()
        .0
        .iter()
        .enumerate()
        .map(|(spring, pair): (usize, &[i32; 2])| {
            let [a, b] = *pair;
            let node = |node: i32| u32::try_from(node).map_err(|_| SpringSceneProblem::NegativeNode { spring, node });
            Ok([node(a)?, node(b)?])
        });
    let ends = ends.collect::<Result<Vec<[u32; 2]>, SpringSceneProblem>>()?;
    let fixed = rest.take("fixed", nodes, |[fixed]: [u8; 1]| fixed != 0)?;
    let velocities = match rest.0.strip_prefix(VELOCITIES) {
        Some(after) => {
            rest = Rest(after);
            vectors(rest.take("velocities", 3 * nodes, f64::from_le_bytes)?, MILLI)
        }
        None => vec![DVec3::ZERO; positions.len()],
    };
    if !rest.0.is_empty() {
        return Err(SpringSceneProblem::Trailing(rest.0.len()));
    }
    Ok(Network {
        positions,
        velocities,
        masses,
        damping,
        loads,
        fixed,
        springs: ends,
        stiffness,
        rest_lengths,
    })
}

/// The bytes not yet read.
struct Rest<'a>(&'a [u8]);

impl Rest<'_> {
    /// Reads `count` values of `N` bytes each.
    fn take<const N: usize, T>(
        &mut self,
        field: &'static str,
        count: u64,
        value: impl Fn([u8; N]) -> T,
    ) -> Result<Vec<T>, SpringSceneProblem> {
        let expected = count * N as u64;
        let Some((taken, rest)) = usize::try_from(expected)
            .ok()
            .and_then(|length| self.0.split_at_checked(length))
        else {
            return Err(SpringSceneProblem::Short {
                field,
                found: self.0.len(),
                expected,
            });
        };
        self.0 = rest;
        Ok(taken.as_chunks().0.iter().map(|bytes| value(*bytes)).collect())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two nodes, the first held, one spring of 10 N/m and 2 mm stretched to 3 mm.
    fn bytes() -> Vec<u8> {
        let mut bytes = MAGIC.to_vec();
        bytes.extend([2u32, 1, 0, 0, 0, 1, 0, 0].iter().flat_map(|count| count.to_le_bytes()));
        let numbers = [
            0.0, 0.0, 0.0, 3e-3, 0.0, 0.0, 1e-6, 2e-6, 1e-5, 2e-5, 0.0, 0.0, 0.0, 0.0, 1e-3, 0.0, 10.0, 2e-3,
        ];
        bytes.extend(numbers.iter().flat_map(|number: &f64| number.to_le_bytes()));
        bytes.extend([0i32, 1].iter().flat_map(|node| node.to_le_bytes()));
        bytes.extend([1, 0]);
        bytes
    }

    #[test]
    fn a_scene_is_read_in_our_units() {
        let network = parse(&bytes()).unwrap();
        assert_eq!(network.positions, [DVec3::ZERO, DVec3::X * 3.0]);
        assert_eq!(network.fixed, [true, false]);
        let close = |a: f64, b: f64| assert!((a / b - 1.0).abs() < 1e-12, "{a} {b}");
        close(network.masses[1], 2e-3);
        close(network.damping[0], 1e-2);
        close(network.loads[1].y, 1e3);
        close(network.stiffness[0], 1e4);
        close(network.rest_lengths[0], 2.0);
        let mut moving = bytes();
        moving.extend(VELOCITIES);
        moving.extend(
            [0.0, 0.0, 0.0, 0.0, 0.5, 0.0]
                .iter()
                .flat_map(|number: &f64| number.to_le_bytes()),
        );
        assert_eq!(parse(&moving).unwrap().velocities[1], DVec3::Y * 500.0);
    }

    #[test]
    fn a_file_cut_off_anywhere_or_with_more_behind_is_refused() {
        let whole = bytes();
        for length in 0..whole.len() {
            assert!(parse(&whole[..length]).is_err(), "{length} bytes");
        }
        let more: Vec<u8> = whole.iter().copied().chain([7]).collect();
        assert!(matches!(parse(&more), Err(SpringSceneProblem::Trailing(1))));
    }

    #[test]
    fn counts_beyond_the_file_take_no_memory() {
        let mut hostile = bytes();
        hostile[8..16].fill(0xff);
        let Err(problem) = parse(&hostile) else {
            panic!("it is refused")
        };
        assert_eq!(
            problem.to_string(),
            "ends within positions: 154 bytes, expected 103079215080"
        );
    }
}
