//! Quality of pentahedra: the scaled Jacobian.
//!
//! At each of the six corners the determinant of its three edges is divided by their lengths; the smallest of the six,
//! times 2/√3, is the quality. It is 1 for a right prism over an equilateral triangle, whatever its height, falls to 0 as
//! the prism is flattened or sheared, and is negative where a corner is turned inside out. This is Verdict's and
//! ParaView's "Scaled Jacobian" of a wedge.

use glam::DVec3;

/// Each corner with its neighbours, so that the determinant of a sound prism is positive.
const CORNERS: [[usize; 4]; 6] = [
    [0, 2, 1, 3],
    [1, 0, 2, 4],
    [2, 1, 0, 5],
    [3, 4, 5, 0],
    [4, 5, 3, 1],
    [5, 3, 4, 2],
];

/// Smallest and mean quality of a lattice's pentahedra.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LatticeQuality {
    /// The worst pentahedron's scaled Jacobian.
    pub min: f64,
    /// Mean over all pentahedra.
    pub mean: f64,
}

/// Scaled Jacobian of one pentahedron, nodes in the order of [`crate::wedge`]; between -1 and 1.15, 0 where an edge has no
/// length.
pub fn scaled_jacobian(nodes: &[u32; 6], position: impl Fn(u32) -> DVec3) -> f64 {
    let smallest = CORNERS
        .iter()
        .map(|corners| {
            let [corner, a, b, c] = corners.map(|corner| position(nodes[corner]));
            let edge = |end: DVec3| (end - corner).normalize_or_zero();
            edge(a).dot(edge(b).cross(edge(c)))
        })
        .fold(f64::INFINITY, f64::min);
    smallest * 2.0 / 3.0f64.sqrt()
}

/// Quality over all `pentahedra`; NaN mean where there are none.
pub(crate) fn of(pentahedra: &[[u32; 6]], positions: &[DVec3]) -> LatticeQuality {
    let each = || (pentahedra.iter()).map(|nodes| scaled_jacobian(nodes, |node| positions[node as usize]));
    LatticeQuality {
        min: each().fold(f64::INFINITY, f64::min),
        mean: each().sum::<f64>() / pentahedra.len() as f64,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A right prism over an equilateral triangle of edge 1, lower normal towards -z.
    fn regular(height: f64) -> [DVec3; 6] {
        let lower = [(0.0, 0.0), (0.5, 0.75f64.sqrt()), (1.0, 0.0)];
        let at = |n: usize| DVec3::new(lower[n % 3].0, lower[n % 3].1, if n < 3 { 0.0 } else { height });
        [0, 1, 2, 3, 4, 5].map(at)
    }

    fn quality(points: [DVec3; 6]) -> f64 {
        scaled_jacobian(&[0, 1, 2, 3, 4, 5], |node| points[node as usize])
    }

    #[test]
    fn the_regular_prism_has_quality_one_at_any_height_and_size() {
        for height in [0.1, 1.0, 7.0] {
            assert!((quality(regular(height)) - 1.0).abs() < 1e-12);
            assert!((quality(regular(height).map(|point| point * 30.0)) - 1.0).abs() < 1e-12);
        }
    }

    #[test]
    fn shear_lowers_quality_and_a_mirror_turns_its_sign() {
        let sheared = regular(1.0).map(|point| point + DVec3::X * point.z);
        assert!((quality(sheared) - 0.5f64.sqrt()).abs() < 1e-12);
        let mirrored = regular(1.0).map(|point| point * DVec3::new(1.0, 1.0, -1.0));
        assert!((quality(mirrored) + 1.0).abs() < 1e-12);
    }
}
