//! Three-dimensional vectors as a structure of arrays, the layout of every hot loop: one component of consecutive nodes
//! fills one vector register.

use std::cell::Cell;

use glam::Vec3;

use crate::aligned::{Aligned, CHUNK};

/// The vectors of a chunk of nodes, by component.
pub(crate) type Chunk = [[f32; CHUNK]; 3];

/// One vector a node, by component. Behind the last node stand as many zeros as a chunk may reach past it.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Vectors {
    components: [Aligned; 3],
    count: usize,
}

/// Consecutive nodes of some vectors, chunk by chunk, that others may read and write too: the two ends of springs overlap.
#[derive(Clone, Copy)]
pub(crate) struct Shared<'a>([&'a [[Cell<f32>; CHUNK]]; 3]);

impl Vectors {
    pub fn zero(count: usize) -> Vectors {
        let zeros = Aligned::filled(count + CHUNK, 0.0);
        Vectors {
            components: [zeros.clone(), zeros.clone(), zeros],
            count,
        }
    }

    #[inline(always)]
    pub fn copy_from(&mut self, other: &Vectors) {
        for (to, from) in self.each_mut().into_iter().zip(other.each()) {
            to.copy_from_slice(from);
        }
    }

    pub fn fill_zero(&mut self) {
        for component in &mut self.components {
            component.fill(0.0);
        }
    }

    #[inline(always)]
    pub fn get(&self, node: usize) -> [f32; 3] {
        let [x, y, z] = &self.components;
        [x[node], y[node], z[node]]
    }

    #[inline(always)]
    pub fn at(&self, node: u32) -> Vec3 {
        Vec3::from_array(self.get(node as usize))
    }

    #[inline(always)]
    pub fn set(&mut self, node: u32, value: Vec3) {
        for (component, value) in self.components.iter_mut().zip(value.to_array()) {
            component[node as usize] = value;
        }
    }

    #[inline(always)]
    pub fn add(&mut self, node: u32, value: Vec3) {
        self.set(node, self.at(node) + value);
    }

    /// The vectors of [`CHUNK`] consecutive nodes.
    #[inline(always)]
    pub fn chunk(&self, first: usize) -> Chunk {
        self.chunks(first, 1).map(|chunks| chunks[0])
    }

    /// The vectors of `chunks` chunks of nodes from `first` on.
    #[inline(always)]
    pub fn chunks(&self, first: usize, chunks: usize) -> [&[[f32; CHUNK]]; 3] {
        let [x, y, z] = &self.components;
        [x, y, z].map(|component| component.chunks(first, chunks))
    }

    /// The same, to be written by several at once.
    #[inline(always)]
    pub fn shared<const N: usize>(&mut self, firsts: [usize; N], chunks: usize) -> [Shared<'_>; N] {
        let components = self
            .components
            .each_mut()
            .map(|component| Cell::from_mut(&mut **component).as_slice_of_cells());
        firsts.map(|first| Shared(components.map(|component| &component[first..].as_chunks().0[..chunks])))
    }

    /// The components of all nodes.
    #[inline(always)]
    pub fn each(&self) -> [&[f32]; 3] {
        let [x, y, z] = &self.components;
        [&x[..self.count], &y[..self.count], &z[..self.count]]
    }

    #[inline(always)]
    pub fn each_mut(&mut self) -> [&mut [f32]; 3] {
        let count = self.count;
        self.components.each_mut().map(|component| &mut component[..count])
    }
}

impl Shared<'_> {
    /// Adds the values, each times its factor, to the nodes of a chunk.
    #[inline(always)]
    pub fn add(&self, chunk: usize, factors: &[f32; CHUNK], values: &Chunk) {
        for (component, values) in self.0.iter().zip(values) {
            let place = &component[chunk];
            // Read, added and written as a whole: only so does the compiler keep to whole registers.
            let mut sums = [0.0; CHUNK];
            for n in 0..CHUNK {
                sums[n] = place[n].get();
            }
            for n in 0..CHUNK {
                sums[n] = factors[n].mul_add(values[n], sums[n]);
            }
            for n in 0..CHUNK {
                place[n].set(sums[n]);
            }
        }
    }
}

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
