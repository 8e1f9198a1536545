//! The stiffness-times-vector product that all implicit methods share, without a matrix.

use glam::{DMat3, DVec3};

use crate::system::{System, Tensor, Work};

/// The tensors of all springs at one shape; see [`Tensor`] for what a compressed spring counts as.
#[derive(Debug, Clone, Default)]
pub struct Stiffness {
    tensors: Vec<Tensor>,
}

impl Stiffness {
    /// Takes the tensors at `positions`, mm. Counts as a product.
    pub fn linearise(&mut self, system: &System, positions: &[DVec3], work: &mut Work) {
        work.product_passes += 1;
        work.spring_visits += system.springs.len() as u64;
        self.tensors.clear();
        self.tensors.extend(system.springs.iter().map(|spring| {
            let [a, b] = spring.ends.map(|end| positions[end as usize]);
            spring.tensor(b - a)
        }));
    }

    /// `product = K movements`, µN; `movements` of fixed nodes are zero, so is their product.
    pub fn product(&self, system: &System, movements: &[DVec3], product: &mut [DVec3], work: &mut Work) {
        work.product_passes += 1;
        work.spring_visits += system.springs.len() as u64;
        product.fill(DVec3::ZERO);
        for (spring, tensor) in system.springs.iter().zip(&self.tensors) {
            let [a, b] = spring.ends.map(|end| end as usize);
            let force = tensor.times(movements[b] - movements[a]);
            product[a] -= force;
            product[b] += force;
        }
        system.hold(product);
    }

    /// The blocks of K on its diagonal, one a node, µN/mm.
    pub fn diagonal(&self, system: &System) -> Vec<DMat3> {
        let mut blocks = vec![DMat3::ZERO; system.node_count()];
        for (spring, tensor) in system.springs.iter().zip(&self.tensors) {
            let matrix = tensor.matrix();
            for end in spring.ends {
                blocks[end as usize] += matrix;
            }
        }
        blocks
    }
}
