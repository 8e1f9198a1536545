//! Following nodes from outside: whoever keeps something by where nodes are (bounding volumes, say) need not look at every
//! node after every advance, but only at those that have gone some way since.

use fearless_simd::{Simd, f32x8, prelude::*};
use glam::Vec3;

use crate::sites::{LANES, Sites};
use crate::tissue::Tissue;
use crate::vectors::{Registers, Vectors};
use crate::widest::{Widened, with_widest};

/// A place for each node of a tissue, no further from the node than a slack.
#[derive(Debug, Clone)]
pub struct Followed {
    slack_mm: f32,
    places: Option<(Sites, Vectors)>,
}

impl Followed {
    /// Follows nodes within a slack, mm; a tissue is first looked at by [`Followed::catch_up`].
    pub fn new(slack_mm: f32) -> Followed {
        Followed { slack_mm, places: None }
    }

    /// Gives every node that is further than the slack from its place another, where it is now. Tells which: all, if the
    /// tissue is not laid out as the one before. Looks at all, some ten thousand in 5 µs.
    pub fn catch_up(&mut self, tissue: &Tissue) -> Vec<u32> {
        let (sites, now) = (tissue.springs.layout().sites(), &tissue.motion.positions);
        match &mut self.places {
            Some((known, places)) if *known == sites => with_widest(CatchUp {
                sites,
                now,
                places,
                slack_mm: self.slack_mm,
            }),
            places => {
                *places = Some((sites, now.clone()));
                (0..tissue.node_count() as u32).collect()
            }
        }
    }

    /// The place of a node, mm; meaningless before the first [`Followed::catch_up`].
    #[inline]
    pub fn place(&self, node: u32) -> Vec3 {
        self.places.as_ref().map_or(Vec3::ZERO, |(_, places)| places.at(node))
    }
}

struct CatchUp<'a> {
    sites: Sites,
    now: &'a Vectors,
    places: &'a mut Vectors,
    slack_mm: f32,
}

impl Widened for CatchUp<'_> {
    type Output = Vec<u32>;

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) -> Vec<u32> {
        let CatchUp {
            sites,
            now,
            places,
            slack_mm,
        } = self;
        let slack = f32x8::splat(simd, slack_mm * slack_mm);
        let mut gone = Vec::new();
        for (site, values) in now.values.iter().enumerate() {
            let away = Registers::load(simd, values) - Registers::load(simd, &places.values[site]);
            let squares = away.length_squared();
            if squares.simd_le(slack).all_true() {
                continue;
            }
            for lane in 0..LANES {
                // What is not a number is never within the slack.
                let is_within = squares[lane] <= slack_mm * slack_mm;
                if let Some(node) = sites.node(site, lane).filter(|_| !is_within) {
                    places.set(node, now.at(node));
                    gone.push(node);
                }
            }
        }
        gone
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Material, TissueMesh};
    use glam::DVec3;

    #[test]
    fn no_node_is_further_from_its_place_than_the_slack_and_only_what_went_that_far_is_told() {
        let positions = (0..40).flat_map(|n| {
            let z = f64::from(n);
            [(0.0, 0.0), (0.0, 2.0), (2.0, 0.0)].map(|(x, y)| DVec3::new(x, y, z))
        });
        let pentahedra = (0..39).map(|n| [0, 1, 2, 3, 4, 5].map(|corner| 3 * n + corner));
        let mesh = TissueMesh::from_pentahedra(positions.collect(), pentahedra.collect());
        let mut tissue = Tissue::new(&mesh, &Material::default()).expect("prisms are a tissue");
        let mut followed = Followed::new(0.2);
        assert_eq!(followed.catch_up(&tissue).len(), 120);
        let wild = |n: u32| (f64::from(n) * 12.9898).sin() as f32;
        for round in 0..20 {
            for node in (0..120).filter(|node| (node + round) % 3 == 0) {
                let step = Vec3::new(wild(round + 7 * node), wild(node), wild(round)) * 0.15;
                let place = tissue.position(node) + step;
                tissue.set_position(node, place).expect("a finite place");
            }
            let before: Vec<Vec3> = (0..120).map(|node| followed.place(node)).collect();
            let mut gone = followed.catch_up(&tissue);
            gone.sort_unstable();
            let expected: Vec<u32> = (0..120)
                .filter(|&node| tissue.position(node).distance(before[node as usize]) > 0.2)
                .collect();
            assert_eq!(gone, expected);
            for node in 0..120 {
                assert!(tissue.position(node).distance(followed.place(node)) <= 0.2 + 1e-6);
            }
        }
    }
}
