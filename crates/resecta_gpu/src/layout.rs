//! Where springs lie on the graphics processor.
//!
//! An invocation a node, so a spring is listed at both of its ends. Nodes are cut into *slices* of 64, as many as share a
//! workgroup; a slice has as many *slots* as its busiest node has springs, and a slot holds a spring of each of its 64
//! nodes, side by side (sliced ELLPACK). So the invocations of a workgroup read consecutive numbers in every turn of the
//! loop, whole cache lines of which all is used, and do the same number of turns. A list a node, one behind the other, would
//! have each invocation read a line of its own; one width for all nodes would let a single hub of many springs lengthen
//! every node's loop. What a slice has too many is filled with springs of no stiffness from the node to itself: they pull by
//! exactly 0.
//!
//! Nodes keep their order: in a lattice, neighbours differ by the same index everywhere, so 64 consecutive nodes find their
//! neighbours' places beside each other too.

use resecta_solver::Tissue;

/// Nodes in a slice, and invocations in a workgroup.
pub(crate) const SLICE: usize = 64;

/// The springs of a tissue, by slot.
#[derive(Debug, PartialEq)]
pub(crate) struct Slices {
    /// Slots before each slice; one entry more than slices.
    pub starts: Vec<u32>,
    /// The node at the other end.
    pub neighbours: Vec<u32>,
    /// Stiffness, µN/mm, and rest length, mm.
    pub springs: Vec<[f32; 2]>,
}

impl Slices {
    /// The springs of a tissue that have not been removed. None where there are more slots than 32 bits can count, which no
    /// memory would hold.
    pub fn of(tissue: &Tissue) -> Option<Slices> {
        let nodes = tissue.node_count();
        let living = || (0..tissue.spring_count() as u32).filter(|&spring| tissue.is_spring_alive(spring));
        let mut degrees = vec![0u32; nodes];
        for spring in living() {
            for node in tissue.spring(spring).nodes {
                degrees[node as usize] += 1;
            }
        }
        let mut starts = vec![0u32];
        let mut slots = 0u32;
        for slice in degrees.chunks(SLICE) {
            slots = slots.checked_add(slice.iter().copied().max().unwrap_or(0))?;
            starts.push(slots);
        }
        let entries = slots.checked_mul(SLICE as u32)? as usize;
        let mut slices = Slices {
            neighbours: vec![0; entries],
            springs: vec![[0.0; 2]; entries],
            starts,
        };
        for node in 0..nodes {
            let (slice, lane) = (node / SLICE, node % SLICE);
            for slot in slices.starts[slice]..slices.starts[slice + 1] {
                slices.neighbours[slot as usize * SLICE + lane] = node as u32;
            }
        }
        // By rising index, at every node.
        degrees.fill(0);
        for spring in living() {
            let state = tissue.spring(spring);
            let [a, b] = state.nodes;
            for (node, other) in [(a, b), (b, a)] {
                let node = node as usize;
                let slot = slices.starts[node / SLICE] + degrees[node];
                let entry = slot as usize * SLICE + node % SLICE;
                slices.neighbours[entry] = other;
                slices.springs[entry] = [tissue.stepped_stiffness(spring), state.rest_length];
                degrees[node] += 1;
            }
        }
        Some(slices)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec3;
    use resecta_solver::Network;

    #[test]
    fn every_spring_lies_at_both_of_its_ends_and_the_rest_pulls_nowhere() {
        // A chain, and a hub in the middle of it that knows everybody.
        let nodes = 150u32;
        let chain = (1..nodes).map(|n| [n - 1, n]);
        let springs: Vec<[u32; 2]> = chain.chain((0..nodes).map(|n| [70, n])).collect();
        let network = Network {
            positions: (0..nodes).map(|n| DVec3::X * f64::from(n)).collect(),
            velocities: vec![DVec3::ZERO; 150],
            masses: vec![1.0; 150],
            damping: vec![0.0; 150],
            loads: vec![DVec3::ZERO; 150],
            fixed: vec![false; 150],
            stiffness: (0..springs.len()).map(|n| 1.0 + n as f64).collect(),
            rest_lengths: vec![1.0; springs.len()],
            springs: springs.clone(),
        };
        let tissue = Tissue::from_network(&network).expect("a network");
        let slices = Slices::of(&tissue).expect("few slots");
        assert_eq!(slices.starts.len(), 4);
        assert!(slices.starts[2] - slices.starts[1] >= 150 && slices.starts[1] == 3);
        let mut expected: Vec<(u32, u32, u32)> = Vec::new();
        for (spring, [a, b]) in (0u32..).zip(springs) {
            expected.extend([(a, b, spring), (b, a, spring)]);
        }
        let mut found = Vec::new();
        for node in 0..nodes {
            let (slice, lane) = (node as usize / SLICE, node as usize % SLICE);
            let mut last = 0.0;
            for slot in slices.starts[slice]..slices.starts[slice + 1] {
                let entry = slot as usize * SLICE + lane;
                let [stiffness, _] = slices.springs[entry];
                if stiffness == 0.0 {
                    assert_eq!(slices.neighbours[entry], node);
                } else {
                    assert!(stiffness >= last, "by rising index");
                    last = stiffness;
                    found.push((node, slices.neighbours[entry], stiffness as u32 - 1));
                }
            }
        }
        expected.sort_unstable();
        found.sort_unstable();
        assert_eq!(found, expected);
    }
}
