//! Arrays of numbers that begin at the boundary of a cache line: a vector register of a chunk is then read and written in
//! one go, where every other one would reach over two lines.

use std::ops::{Deref, DerefMut};

use bytemuck::{Pod, Zeroable};

/// Nodes or springs computed at a time: one register of 16 `f32`, two of 8, or four of 4.
pub(crate) const CHUNK: usize = 16;

/// A cache line.
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
#[repr(C, align(64))]
struct Line([f32; CHUNK]);

/// Numbers in whole cache lines.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Aligned(Vec<Line>);

impl Aligned {
    /// At least that many, all the same.
    pub fn filled(count: usize, value: f32) -> Aligned {
        Aligned(vec![Line([value; CHUNK]); count.div_ceil(CHUNK)])
    }

    /// `chunks` chunks from `first` on.
    #[inline(always)]
    pub fn chunks(&self, first: usize, chunks: usize) -> &[[f32; CHUNK]] {
        &self[first..].as_chunks().0[..chunks]
    }
}

impl Deref for Aligned {
    type Target = [f32];

    #[inline(always)]
    fn deref(&self) -> &[f32] {
        bytemuck::cast_slice(&self.0)
    }
}

impl DerefMut for Aligned {
    #[inline(always)]
    fn deref_mut(&mut self) -> &mut [f32] {
        bytemuck::cast_slice_mut(&mut self.0)
    }
}
