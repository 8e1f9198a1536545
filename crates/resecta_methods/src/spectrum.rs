//! How fast a scene's modes are: the explicit stability bound, a bound of the spectral radius, the slowest mode.

use glam::{DMat3, DVec3};

use crate::{
    conjugate::{ConjugateGradients, Operator, dot},
    stiffness::Stiffness,
    system::{System, Work},
};

/// Shift of the inverse iteration, rad/s: slower modes count as no stiffness at all.
const SHIFT: f64 = 5.0;

/// The longest step that is stable for leapfrog without damping at this shape, s: `2 / w` with
/// `w² <= max_i 2 lambda(D_i) / m_i`, D_i the sum of the tensors around a node and lambda its largest eigenvalue. Safe, and a
/// few per cent short of the truth on lattices. Infinite without springs.
pub fn stability_bound_s(system: &System, positions: &[DVec3]) -> f64 {
    let mut stiffness = Stiffness::default();
    stiffness.linearise(system, positions, &mut Work::default());
    let blocks = stiffness.diagonal(system);
    let squares = blocks.iter().zip(&system.inverse_masses);
    let most = squares
        .map(|(block, inverse)| 2.0 * largest_eigenvalue(*block) * inverse)
        .fold(0.0, f64::max);
    2.0 / most.sqrt()
}

/// A bound of the spectral radius of the first-order system that holds for any shape, 1/s.
///
/// Every eigenvalue z with its vector u solves `z² u*Mu + z u*Gu + u*Ku = 0`, so |z| is at most `a/2 + (a²/4 + w²)^(1/2)` with
/// a the largest damping rate and `w² = max_i 2 sum_j k_ij / m_i`.
pub fn radius_per_s(system: &System) -> f64 {
    let mut sums = vec![0.0; system.node_count()];
    for spring in &system.springs {
        for end in spring.ends {
            sums[end as usize] += spring.stiffness;
        }
    }
    let square = sums
        .iter()
        .zip(&system.inverse_masses)
        .map(|(sum, inverse)| 2.0 * sum * inverse)
        .fold(0.0, f64::max);
    let rate = (0..system.node_count())
        .map(|node| system.damping_rate(node))
        .fold(0.0, f64::max);
    0.5 * rate + (0.25 * rate * rate + square).sqrt()
}

/// Circular frequency of the slowest mode at this shape, rad/s, to about 1 %; below some 5 rad/s it is a mechanism.
///
/// Inverse iteration with a shift on `K u = w² M u`.
pub fn slowest_rad_per_s(system: &System, positions: &[DVec3]) -> f64 {
    let work = &mut Work::default();
    let mut stiffness = Stiffness::default();
    stiffness.linearise(system, positions, work);
    let diagonal: Vec<f64> = system.masses.iter().map(|mass| SHIFT * SHIFT * mass).collect();
    // A start that has something of every mode: a fixed sequence of low discrepancy.
    let mut mode: Vec<DVec3> = (1..=system.node_count())
        .map(|n| (DVec3::new(0.754_877, 0.569_840, 0.438_579) * n as f64).fract() - DVec3::splat(0.5))
        .collect();
    system.hold(&mut mode);
    let mut gradients = ConjugateGradients::default();
    let (mut weighed, mut square) = (vec![DVec3::ZERO; mode.len()], f64::INFINITY);
    for _ in 0..40 {
        for ((weighed, value), mass) in weighed.iter_mut().zip(&mode).zip(&system.masses) {
            *weighed = *value * *mass;
        }
        let operator = Operator {
            system,
            stiffness: &stiffness,
            diagonal: &diagonal,
            square: 1.0,
        };
        gradients.solve(operator, &weighed, &mut mode, 1e-4, work);
        // With x = (K + q M)^-1 M y the quotient y·Mx / x·Mx tends to w² + q.
        let along = dot(&weighed, &mode);
        let norm: f64 = mode
            .iter()
            .zip(&system.masses)
            .map(|(value, mass)| mass * value.length_squared())
            .sum();
        if norm <= 0.0 {
            return 0.0;
        }
        let last = square;
        square = (along / norm - SHIFT * SHIFT).max(0.0);
        let scale = norm.sqrt().recip();
        mode.iter_mut().for_each(|value| *value *= scale);
        if (last - square).abs() <= 5e-3 * square {
            break;
        }
    }
    square.sqrt()
}

/// Largest eigenvalue of a symmetric matrix: Smith 1961, by the angle of its characteristic cubic.
fn largest_eigenvalue(matrix: DMat3) -> f64 {
    let trace = matrix.x_axis.x + matrix.y_axis.y + matrix.z_axis.z;
    let mean = trace / 3.0;
    let rest = matrix - DMat3::from_diagonal(DVec3::splat(mean));
    let spread = (rest.to_cols_array().iter().map(|value| value * value).sum::<f64>() / 6.0).sqrt();
    if spread <= 0.0 {
        return mean;
    }
    let half = 0.5 * (rest * spread.recip()).determinant();
    mean + 2.0 * spread * (half.clamp(-1.0, 1.0).acos() / 3.0).cos()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_largest_eigenvalue_of_known_matrices() {
        assert!((largest_eigenvalue(DMat3::from_diagonal(DVec3::new(1.0, 5.0, 2.0))) - 5.0).abs() < 1e-12);
        let ones = DMat3::from_cols(DVec3::ONE, DVec3::ONE, DVec3::ONE);
        assert!((largest_eigenvalue(ones) - 3.0).abs() < 1e-12);
        assert_eq!(largest_eigenvalue(DMat3::ZERO), 0.0);
    }
}
