//! Three-dimensional vectors as a structure of arrays, the layout of every hot loop: one component of consecutive nodes
//! fills one vector register.

use std::ops::Range;

use glam::Vec3;

/// One vector a node, by component.
#[derive(Debug, Clone, PartialEq, Default)]
pub(crate) struct Vectors {
    x: Vec<f32>,
    y: Vec<f32>,
    z: Vec<f32>,
}

impl Vectors {
    pub fn zero(count: usize) -> Vectors {
        Vectors {
            x: vec![0.0; count],
            y: vec![0.0; count],
            z: vec![0.0; count],
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

    #[inline(always)]
    pub fn slices(&self, nodes: Range<usize>) -> [&[f32]; 3] {
        [&self.x[nodes.clone()], &self.y[nodes.clone()], &self.z[nodes]]
    }

    #[inline(always)]
    pub fn each(&self) -> [&[f32]; 3] {
        [&self.x, &self.y, &self.z]
    }

    #[inline(always)]
    pub fn each_mut(&mut self) -> [&mut [f32]; 3] {
        [&mut self.x, &mut self.y, &mut self.z]
    }
}

impl FromIterator<[f32; 3]> for Vectors {
    fn from_iter<I: IntoIterator<Item = [f32; 3]>>(vectors: I) -> Self {
        let mut all = Vectors::default();
        for [x, y, z] in vectors {
            all.x.push(x);
            all.y.push(y);
            all.z.push(z);
        }
        all
    }
}
