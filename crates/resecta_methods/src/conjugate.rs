//! Conjugate gradients on `(D + q K) x = b`, preconditioned by the inverted blocks of the diagonal.
//!
//! Source: Hestenes and Stiefel 1952; the preconditioned form of Saad, Iterative Methods for Sparse Linear Systems (2003),
//! algorithm 9.1.

use glam::{DMat3, DVec3};

use crate::{
    stiffness::Stiffness,
    system::{System, Work},
};

/// Iterations after which a solve ends without its tolerance. What it has then is still a direction of descent.
const MOST_ITERATIONS: usize = 1000;

/// The matrix `D + q K`: symmetric and positive definite where every D is above 0 and q is not negative.
#[derive(Debug, Clone, Copy)]
pub struct Operator<'a> {
    /// Springs, and which nodes are fixed.
    pub system: &'a System,
    /// K.
    pub stiffness: &'a Stiffness,
    /// D, one a node, g.
    pub diagonal: &'a [f64],
    /// q, s².
    pub square: f64,
}

impl Operator<'_> {
    fn apply(&self, vector: &[DVec3], product: &mut [DVec3], work: &mut Work) {
        self.stiffness.product(self.system, vector, product, work);
        for ((product, vector), diagonal) in product.iter_mut().zip(vector).zip(self.diagonal) {
            *product = *product * self.square + *vector * *diagonal;
        }
        self.system.hold(product);
    }

    fn inverted_blocks(&self) -> Vec<DMat3> {
        let blocks = self.stiffness.diagonal(self.system).into_iter().zip(self.diagonal);
        let inverted = |(block, diagonal): (DMat3, &f64)| {
            (block * self.square + DMat3::from_diagonal(DVec3::splat(*diagonal))).inverse()
        };
        blocks.map(inverted).collect()
    }
}

/// The vectors of the iteration, kept between solves.
#[derive(Debug, Clone, Default)]
pub struct ConjugateGradients {
    residual: Vec<DVec3>,
    conditioned: Vec<DVec3>,
    search: Vec<DVec3>,
    product: Vec<DVec3>,
}

impl ConjugateGradients {
    /// Solves from zero, until the residual in the norm of the preconditioner is `tolerance` (0 to 1) times what it was.
    /// `right` is zero on fixed nodes. Returns whether the tolerance was reached within 1,000 iterations.
    pub fn solve(
        &mut self,
        operator: Operator,
        right: &[DVec3],
        solution: &mut Vec<DVec3>,
        tolerance: f64,
        work: &mut Work,
    ) -> bool {
        let count = right.len();
        let blocks = operator.inverted_blocks();
        solution.clear();
        solution.resize(count, DVec3::ZERO);
        self.residual.clear();
        self.residual.extend_from_slice(right);
        self.conditioned.clear();
        self.conditioned
            .extend(blocks.iter().zip(right).map(|(block, value)| *block * *value));
        self.search.clone_from(&self.conditioned);
        self.product.resize(count, DVec3::ZERO);
        let mut norm = dot(&self.residual, &self.conditioned);
        let enough = norm * tolerance * tolerance;
        for _ in 0..MOST_ITERATIONS {
            if norm <= enough || norm.is_nan() {
                // NaN is found in the solution by whoever asked.
                return true;
            }
            operator.apply(&self.search, &mut self.product, work);
            let step = norm / dot(&self.search, &self.product);
            for node in 0..count {
                solution[node] += self.search[node] * step;
                self.residual[node] -= self.product[node] * step;
                self.conditioned[node] = blocks[node] * self.residual[node];
            }
            let before = norm;
            norm = dot(&self.residual, &self.conditioned);
            let keep = norm / before;
            for (search, conditioned) in self.search.iter_mut().zip(&self.conditioned) {
                *search = *conditioned + *search * keep;
            }
        }
        false
    }
}

/// Scalar product over all nodes.
pub(crate) fn dot(a: &[DVec3], b: &[DVec3]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a.dot(*b)).sum()
}
