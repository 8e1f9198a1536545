//! The wedge's shape functions: where a point inside a pentahedron is.
//!
//! Local coordinates `(a, b, t)`: in the triangle the corners 0, 1, 2 have the weights `1 - a - b`, `a`, `b`; along the
//! axis `t` runs from 0 at the triangle (0, 1, 2) to 1 at (3, 4, 5).

use glam::{DVec3, Vec3};

use crate::sublattice::{LANES, Lanes};

/// Weights of the six corners at a place; all are 0 or more inside, and they sum to 1.
pub fn weights(a: f32, b: f32, t: f32) -> [f32; 6] {
    let triangle = [(1.0 - a - b).max(0.0), a, b];
    std::array::from_fn(|corner| triangle[corner % 3] * if corner < 3 { 1.0 - t } else { t })
}

/// `Σ N_i X_i` as a polynomial in single precision, for eight places at a time.
#[derive(Debug, Clone, Copy)]
pub struct Carrier([Vec3; 6]);

impl Carrier {
    #[inline(always)]
    pub fn new(x: [Vec3; 6]) -> Self {
        let (a, b) = (x[1] - x[0], x[2] - x[0]);
        Self([x[0], a, b, x[3] - x[0], x[4] - x[3] - a, x[5] - x[3] - b])
    }

    /// By component.
    #[inline(always)]
    pub fn at(&self, [a, b, t]: &[Lanes; 3]) -> [Lanes; 3] {
        let c = &self.0;
        let mut out = [[0.0; LANES]; 3];
        for n in 0..3 {
            for l in 0..LANES {
                let start = c[0][n] + c[1][n] * a[l] + c[2][n] * b[l];
                out[n][l] = start + (c[3][n] + c[4][n] * a[l] + c[5][n] * b[l]) * t[l];
            }
        }
        out
    }

    /// At one place.
    #[inline(always)]
    pub fn at_one(&self, [a, b, t]: [f32; 3]) -> Vec3 {
        let c = &self.0;
        c[0] + c[1] * a + c[2] * b + (c[3] + c[4] * a + c[5] * b) * t
    }

    /// Derivatives at one place.
    #[inline(always)]
    pub fn axes(&self, [a, b, t]: [f32; 3]) -> [Vec3; 3] {
        let c = &self.0;
        [c[1] + c[4] * t, c[2] + c[5] * t, c[3] + c[4] * a + c[5] * b]
    }

    /// Derivatives, each by component.
    #[inline(always)]
    pub fn jacobian(&self, [a, b, t]: &[Lanes; 3]) -> [[Lanes; 3]; 3] {
        let c = &self.0;
        let mut out = [[[0.0; LANES]; 3]; 3];
        for n in 0..3 {
            for l in 0..LANES {
                out[0][n][l] = c[1][n] + c[4][n] * t[l];
                out[1][n][l] = c[2][n] + c[5][n] * t[l];
                out[2][n][l] = c[3][n] + c[4][n] * a[l] + c[5][n] * b[l];
            }
        }
        out
    }
}

/// `Σ N_i X_i` as a polynomial: six vectors of coefficients take fewer operations a point than six weights.
#[derive(Debug, Clone, Copy)]
pub struct Shape([DVec3; 6]);

impl Shape {
    pub fn new(x: [DVec3; 6]) -> Self {
        let (along_a, along_b) = (x[1] - x[0], x[2] - x[0]);
        Self([
            x[0],
            along_a,
            along_b,
            x[3] - x[0],
            x[4] - x[3] - along_a,
            x[5] - x[3] - along_b,
        ])
    }

    pub fn at(&self, [a, b, t]: [f64; 3]) -> DVec3 {
        let c = &self.0;
        c[0] + c[1] * a + c[2] * b + (c[3] + c[4] * a + c[5] * b) * t
    }

    /// Derivatives with respect to `a`, `b` and `t`.
    pub fn jacobian(&self, [a, b, t]: [f64; 3]) -> [DVec3; 3] {
        let c = &self.0;
        [c[1] + c[4] * t, c[2] + c[5] * t, c[3] + c[4] * a + c[5] * b]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_polynomial_is_the_weighted_sum() {
        let corners: [DVec3; 6] =
            std::array::from_fn(|n| DVec3::new((n * n) as f64, (7 * n % 5) as f64, (3 * n % 4) as f64));
        let shape = Shape::new(corners);
        let summed: DVec3 = (corners.iter().zip(weights(0.25, 0.5, 0.75)))
            .map(|(corner, weight)| *corner * f64::from(weight))
            .sum();
        assert!(shape.at([0.25, 0.5, 0.75]).distance(summed) < 1e-12);
    }
}
