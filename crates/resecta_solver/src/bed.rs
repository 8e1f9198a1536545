//! The bed that holds some nodes where they were: a spring without length from each to its rest place, of the stiffness
//! `support`, mN/m.

use std::ops::Range;

use fearless_simd::Simd;

use crate::tissue::Nodes;
use crate::vectors::{Registers, SiteVectors, load};

/// The beds of a tissue's nodes.
pub(crate) struct Bed<'a> {
    nodes: &'a Nodes,
}

impl Bed<'_> {
    pub fn of(nodes: &Nodes) -> Bed<'_> {
        Bed { nodes }
    }

    /// Adds its force to the nodes of a block, which lie at `places`, mm: stiffness times the way back to the rest place, µN.
    #[inline(always)]
    pub fn add_forces<S: Simd>(
        &self,
        simd: S,
        block: &Range<usize>,
        places: &[SiteVectors],
        forces: &mut [SiteVectors],
    ) {
        for bed in &self.nodes.supported {
            let held = bed.start.max(block.start)..bed.end.min(block.end);
            if held.is_empty() {
                continue;
            }
            let support = &self.nodes.support.values[held.clone()];
            let rest = &self.nodes.rest.values[held.clone()];
            let own = held.start - block.start..held.end - block.start;
            let (places, forces) = (&places[own.clone()], &mut forces[own]);
            for n in 0..support.len() {
                let away = Registers::load(simd, &rest[n]) - Registers::load(simd, &places[n]);
                let sum = Registers::load(simd, &forces[n]);
                forces[n] = away.times_plus(load(simd, &support[n]), sum).stored();
            }
        }
    }
}
