//! Three-dimensional vectors as a structure of arrays, the layout of every hot loop: one component of consecutive nodes
//! fills one vector register.

use glam::Vec3;

use crate::springs::CHUNK;

/// One vector a node, by component. Behind the last node stand as many zeros as a chunk may reach past it.
#[derive(Debug, Clone, PartialEq, Default)]
pub(crate) struct Vectors {
    x: Vec<f32>,
    y: Vec<f32>,
    z: Vec<f32>,
    count: usize,
}

impl Vectors {
    pub fn zero(count: usize) -> Vectors {
        let zeros = vec![0.0; count + CHUNK];
        Vectors {
            x: zeros.clone(),
            y: zeros.clone(),
            z: zeros,
            count,
        }
    }

    #[inline(always)]
    pub fn copy_from(&mut self, other: &Vectors) {
        for (to, from) in self.each_mut().into_iter().zip(other.each()) {
            to.copy_from_slice(from);
        }
    }

    #[inline(always)]
    pub fn get(&self, node: usize) -> [f32; 3] {
        [self.x[node], self.y[node], self.z[node]]
    }

    #[inline(always)]
    pub fn at(&self, node: u32) -> Vec3 {
        Vec3::from_array(self.get(node as usize))
    }

    #[inline(always)]
    pub fn set(&mut self, node: u32, value: Vec3) {
        let node = node as usize;
        [self.x[node], self.y[node], self.z[node]] = value.to_array();
    }

    #[inline(always)]
    pub fn add(&mut self, node: u32, value: Vec3) {
        self.set(node, self.at(node) + value);
    }

    /// The vectors of [`CHUNK`] consecutive nodes.
    #[inline(always)]
    pub fn chunk(&self, first: usize) -> [[f32; CHUNK]; 3] {
        [*chunk(&self.x, first), *chunk(&self.y, first), *chunk(&self.z, first)]
    }

    /// Adds the values, each times its factor, to [`CHUNK`] consecutive nodes.
    #[inline(always)]
    pub fn add_chunk(&mut self, first: usize, factors: &[f32; CHUNK], values: &[[f32; CHUNK]; 3]) {
        for (component, values) in [&mut self.x, &mut self.y, &mut self.z].into_iter().zip(values) {
            let place: &mut [f32; CHUNK] = component[first..].first_chunk_mut().expect(REACH);
            // Read, added and written as a whole: only so does the compiler keep to whole registers.
            let mut sums = *place;
            for n in 0..CHUNK {
                sums[n] = factors[n].mul_add(values[n], sums[n]);
            }
            *place = sums;
        }
    }

    /// The components of all nodes.
    #[inline(always)]
    pub fn each(&self) -> [&[f32]; 3] {
        [&self.x[..self.count], &self.y[..self.count], &self.z[..self.count]]
    }

    #[inline(always)]
    pub fn each_mut(&mut self) -> [&mut [f32]; 3] {
        let count = self.count;
        [&mut self.x[..count], &mut self.y[..count], &mut self.z[..count]]
    }
}

/// The [`CHUNK`] values from `first` on.
#[inline(always)]
pub(crate) fn chunk(values: &[f32], first: usize) -> &[f32; CHUNK] {
    values[first..].first_chunk().expect(REACH)
}

const REACH: &str = "arrays reach a chunk past their last element";

impl FromIterator<[f32; 3]> for Vectors {
    fn from_iter<I: IntoIterator<Item = [f32; 3]>>(vectors: I) -> Self {
        let vectors: Vec<[f32; 3]> = vectors.into_iter().collect();
        let mut all = Vectors::zero(vectors.len());
        for (node, vector) in (0..).zip(vectors) {
            all.set(node, Vec3::from_array(vector));
        }
        all
    }
}
