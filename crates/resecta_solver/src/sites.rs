//! Sites: where a node's numbers lie in the arrays of the hot loop.
//!
//! A vector register holds eight numbers, its *lanes*. The nodes are cut into eight ranges of equal length, one a lane, and
//! the nodes at the same place of each range share a *site*: node `n` of `m` sites lies at site `n % m` in lane `n / m`.
//! Neighbours in a lattice differ by the same index everywhere, so the neighbours of the eight nodes of a site lie at one
//! other site in the same lanes (or, where a range ends and the next begins, turned on by a lane). Whatever is done to
//! springs or nodes is done to whole, aligned registers: nothing is gathered, shifted, or read across cache lines. Eight
//! consecutive nodes in a register, the plain layout, cost 1.8 times as much a substep on the lattice of the papers.
//!
//! The three components of a site's vectors lie beside each other, so a loop needs one pointer an array.

/// Numbers in a register.
pub(crate) const LANES: usize = 8;

/// A number of each node of a site.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[repr(C, align(32))]
pub(crate) struct Lanes(pub [f32; LANES]);

/// Which node lies where.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Sites {
    count: usize,
    nodes: usize,
    /// 2^56 / count, rounded up: a product and a shift then divide exactly, for fewer than 2^29 nodes.
    reciprocal: u64,
}

impl Sites {
    /// As few sites as hold that many nodes.
    pub fn fewest(nodes: usize) -> Sites {
        Sites::new(nodes, nodes.div_ceil(LANES))
    }

    /// That many sites, or as many as the nodes take.
    pub fn new(nodes: usize, count: usize) -> Sites {
        let count = count.max(nodes.div_ceil(LANES)).max(1);
        Sites {
            count,
            nodes,
            reciprocal: (1 << 56) / count as u64 + 1,
        }
    }

    /// How many there are.
    pub fn count(&self) -> usize {
        self.count
    }

    /// Nodes in them.
    pub fn nodes(&self) -> usize {
        self.nodes
    }

    /// Site and lane of a node.
    #[inline(always)]
    pub fn place(&self, node: u32) -> (usize, usize) {
        let lane = ((u64::from(node) * self.reciprocal) >> 56) as usize;
        (node as usize - lane * self.count, lane)
    }

    /// The node at a site in a lane, where there is one.
    pub fn node(&self, site: usize, lane: usize) -> Option<u32> {
        let node = lane * self.count + site;
        (node < self.nodes).then_some(node as u32)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_node_has_a_place_of_its_own() {
        for (nodes, count) in [(1, 1), (8, 1), (9, 0), (1000, 130), (15_249, 1989), (499_999_999, 0)] {
            let sites = Sites::new(nodes, count);
            assert!(sites.count() >= count && sites.count() * LANES >= nodes);
            for node in (0..nodes as u32).step_by(1 + nodes / 5000).chain([nodes as u32 - 1]) {
                let (site, lane) = sites.place(node);
                assert!(site < sites.count() && lane < LANES, "{node}: {site} {lane}");
                assert_eq!(sites.node(site, lane), Some(node));
            }
        }
    }
}
