//! Softening: springs far stiffer than the tissue around them, for scenes that would rather have time than that stiffness.
//!
//! A shell 10,000 times as stiff as the tissue it lies in asks for a hundred times the substeps, and hardly moves. Ten or a
//! hundred times as stiff it hardly moves either. So where the effort of a tissue (`watch.rs`) allows no node a frequency as
//! high as its springs give it, those springs are stepped with less: the stiffest around the node are cut down to a common
//! height, till the node is held as stiffly as its frequency may be, but no less stiffly than the effort says, ten times what
//! is usual in the tissue or more. What is then still missing to the frequency its inertia makes up for (`bound.rs`): raised
//! inertia is wrong only while things move, softened springs are wrong for good, but masses that make up for a ratio of
//! 10,000 would hardly ever get there.
//!
//! The error is that of the softened springs, seen by a watch like any other. Springs of a tissue with pre-tension are not
//! softened: they would lose the tension that holds the shape; nor those of one whose pentahedra hold their volume, whose
//! nodes are held by more than springs.

use crate::held::Held;
use crate::sites::Lanes;
use crate::tissue::Tissue;

impl Tissue {
    /// Softens the springs of nodes whose square of frequency would exceed `fastest`, 1/s². Says whether any was.
    ///
    /// Takes the measure of how nodes are held (`held.rs`) as known; it is another one afterwards.
    pub(crate) fn soften(&mut self, fastest: f32) -> bool {
        let softens = fastest.is_finite() && self.pre_tension == 0.0 && self.volumes.is_none();
        let Some(usual) = self.usual.filter(|_| softens) else {
            return false;
        };
        let stiffest = self.effort().stiffest as f32;
        let (held, floor): (&Held, f32) = (&self.scratch.held, stiffest * usual.stiffness);
        // After every cut: where nothing is that stiff, no more is done.
        let is_stiff = |site: &Lanes| site.0.iter().any(|&held| held > floor);
        if !held.stiffness.values.iter().any(is_stiff) {
            return false;
        }
        let nodes = self.nodes.mass.iter().zip(self.nodes.inverse_inertia.iter());
        // Of what its springs give a node, the share that stays; 1 for what does not move.
        let shares: Vec<f32> = nodes
            .zip(held.stiffness.iter())
            .map(|((mass, inverse), held)| match (fastest * mass).max(floor) / held {
                share if share < 1.0 && inverse > 0.0 => share,
                _ => 1.0,
            })
            .collect();
        if shares.iter().all(|&share| share == 1.0) {
            return false;
        }
        let mut around: Vec<Vec<f32>> = vec![Vec::new(); shares.len()];
        for (spring, ends) in (0u32..).zip(&self.springs.nodes) {
            for &end in ends {
                if shares[end as usize] < 1.0 {
                    around[end as usize].push(self.springs.stepped_stiffness(spring));
                }
            }
        }
        let heights: Vec<f32> = shares
            .iter()
            .zip(around)
            .map(|(&share, springs)| {
                if share < 1.0 {
                    height(springs, share)
                } else {
                    f32::INFINITY
                }
            })
            .collect();
        self.springs
            .soften(|ends| heights[ends[0] as usize].min(heights[ends[1] as usize]));
        true
    }

    /// Stiffness that a spring is stepped with, µN/mm: its own, or less while it is softened.
    pub fn stepped_stiffness(&self, spring: u32) -> f32 {
        self.springs.stepped_stiffness(spring)
    }

    /// Springs that are stepped with less than their stiffness at present, to save substeps: see [`Effort`](crate::Effort).
    pub fn softened_springs(&self) -> usize {
        self.springs.softened()
    }
}

/// The height down to which values are to be cut so that a share of their sum stays.
fn height(mut values: Vec<f32>, share: f32) -> f32 {
    values.sort_unstable_by(f32::total_cmp);
    let mut left = share * values.iter().sum::<f32>();
    for (number, &value) in values.iter().enumerate() {
        let even = left / (values.len() - number) as f32;
        if value > even {
            return even;
        }
        left -= value;
    }
    f32::INFINITY
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cutting_down_to_the_height_leaves_the_share() {
        for (values, share) in [
            (vec![1.0, 1.0, 100.0, 200.0], 0.1),
            (vec![5.0, 5.0, 5.0], 0.5),
            (vec![0.0, 3.0], 0.9),
            (vec![7.0], 0.01),
        ] {
            let height = height(values.clone(), share);
            let left: f32 = values.iter().map(|value| value.min(height)).sum();
            let wanted = share * values.iter().sum::<f32>();
            assert!((left / wanted - 1.0).abs() < 1e-5, "{values:?} {share}: {height}");
        }
    }
}
