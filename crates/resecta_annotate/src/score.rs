//! Scores of an annotation against what someone drew.

use glam::DVec2;
use serde::{Deserialize, Serialize};

use crate::Annotation;
use crate::annotate::volume_ml;
use crate::compare::{Overlap, mean_distance_mm};
use resecta_anatomy::contour;

/// How well one gland was found.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Score {
    /// The case.
    pub case: String,
    /// Dice's coefficient of the whole gland.
    pub dice: f64,
    /// Of the middle two thirds of its height, taken as one body.
    pub dice_middle: f64,
    /// Of the lowest sixth.
    pub dice_apex: f64,
    /// Of the highest sixth.
    pub dice_base: f64,
    /// Mean distance between the outlines of the middle two thirds, mm; of slices where the gland was found.
    pub distance_middle_mm: f64,
    /// Volume found less the true one, as a share of it.
    pub volume_error: f64,
    /// Share of the slices that were flagged.
    pub flagged: f64,
    /// Correlation over the slices of the error expected and the true one, by ranks.
    pub confidence: f64,
    /// Dice's coefficient of each slice of the gland, with the height in shares of the whole.
    pub slices: Vec<(f64, f64)>,
}

/// Scores of models trained without the case.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Figures {
    /// A score a case left out.
    pub scores: Vec<Score>,
}

impl Figures {
    /// The median of something over the cases; not a number where there are none.
    pub fn median(&self, of: impl Fn(&Score) -> f64) -> f64 {
        median(self.scores.iter().map(of).collect())
    }
}

/// The median; not a number of nothing.
pub(crate) fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    let half = values.len() / 2;
    match values.len() {
        0 => f64::NAN,
        count if count % 2 == 0 => 0.5 * (values[half - 1] + values[half]),
        _ => values[half],
    }
}

/// Scores an annotation of a stack at these heights against outlines drawn on it.
pub(crate) fn score(case: &str, heights: &[f64], truth: &[(f64, Vec<DVec2>)], found: &Annotation) -> Score {
    let spacing = (heights[heights.len() - 1] - heights[0]) / (heights.len() - 1).max(1) as f64;
    let ends = [truth[0].0 - 0.5 * spacing, truth[truth.len() - 1].0 + 0.5 * spacing];
    let near = |one: f64, other: f64| (one - other).abs() < 0.25 * spacing;
    let (mut whole, mut thirds) = (Overlap::default(), [Overlap::default(); 3]);
    let (mut distances, mut slices, mut expected, mut true_mm) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
    for &z in heights {
        let drawn = truth
            .iter()
            .find(|(height, _)| near(*height, z))
            .map_or(&[][..], |(_, outline)| outline);
        let slice = found.slices.iter().find(|slice| near(slice.z_mm, z));
        let outline = slice.map_or(&[][..], |slice| &slice.capsule);
        let overlap = Overlap::of(drawn, outline);
        whole += overlap;
        let share = (z - ends[0]) / (ends[1] - ends[0]);
        if !drawn.is_empty() && (0.0..=1.0).contains(&share) {
            let third = usize::from(share >= 1.0 / 6.0) + usize::from(share > 5.0 / 6.0);
            thirds[third] += overlap;
            slices.push((share, overlap.dice()));
        }
        if let (false, Some(slice)) = (drawn.is_empty(), slice) {
            let distance = mean_distance_mm(drawn, outline);
            if (1.0 / 6.0..=5.0 / 6.0).contains(&share) {
                distances.push(distance);
            }
            expected.push(slice.error_mm);
            true_mm.push(distance);
        }
    }
    let volume = |areas: Vec<(f64, f64)>| volume_ml(areas.into_iter());
    let true_ml = volume(
        truth
            .iter()
            .map(|(z, outline)| (*z, contour::signed_area(outline).abs()))
            .collect(),
    );
    Score {
        case: case.to_owned(),
        dice: whole.dice(),
        dice_middle: thirds[1].dice(),
        dice_apex: thirds[0].dice(),
        dice_base: thirds[2].dice(),
        distance_middle_mm: distances.iter().sum::<f64>() / distances.len().max(1) as f64,
        volume_error: found.volume_ml() / true_ml - 1.0,
        flagged: found.slices.iter().filter(|slice| !slice.flags.is_empty()).count() as f64
            / found.slices.len().max(1) as f64,
        confidence: rank_correlation(&expected, &true_mm),
        slices,
    }
}

/// Spearman's correlation; 0 where there is too little to correlate.
fn rank_correlation(one: &[f64], other: &[f64]) -> f64 {
    let ranks = |values: &[f64]| -> Vec<f64> {
        let mut order: Vec<usize> = (0..values.len()).collect();
        order.sort_by(|&a, &b| values[a].total_cmp(&values[b]));
        let mut ranks = vec![0.0; values.len()];
        for (rank, index) in order.into_iter().enumerate() {
            ranks[index] = rank as f64;
        }
        ranks
    };
    let middle = 0.5 * (one.len().max(1) - 1) as f64;
    let (one, other) = (ranks(one), ranks(other));
    let squares: f64 = one.iter().map(|rank| (rank - middle).powi(2)).sum();
    let products: f64 = one.iter().zip(&other).map(|(a, b)| (a - middle) * (b - middle)).sum();
    if squares > 0.0 { products / squares } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ranks_that_agree_correlate_wholly() {
        assert_eq!(rank_correlation(&[1.0, 5.0, 2.0], &[10.0, 90.0, 11.0]), 1.0);
        assert_eq!(rank_correlation(&[1.0, 5.0, 2.0], &[3.0, 1.0, 2.0]), -1.0);
        assert_eq!(rank_correlation(&[], &[]), 0.0);
    }

    #[test]
    fn the_median_of_an_even_number_lies_between() {
        assert_eq!(median(vec![4.0, 1.0, 2.0, 3.0]), 2.5);
        assert_eq!(median(vec![4.0, 1.0, 2.0]), 2.0);
    }
}
