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
    /// The slices of the gland drawn, by rising height.
    pub slices: Vec<SliceScore>,
}

/// How well a slice of the gland drawn was found.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SliceScore {
    /// Height in the drawn gland, whose ends lie half a slice beyond its first and last outline: 0 at the apex to 1 at the base.
    pub share: f64,
    /// Dice's coefficient; 0 where nothing was found.
    pub dice: f64,
    /// Mean distance between what was drawn and what was found, mm; none where nothing was.
    pub distance_mm: Option<f64>,
    /// The mean distance that was expected, mm.
    pub expected_mm: Option<f64>,
    /// Whether what was found was flagged.
    pub flagged: bool,
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

/// Overlap of drawn outlines with found ones, by the height in the drawn gland: lowest sixth, middle two thirds, highest
/// sixth, and everything that was found beyond its ends. Heights are those of the images.
pub fn overlap_of_parts(heights: &[f64], drawn: &[(f64, Vec<DVec2>)], found: &[(f64, Vec<DVec2>)]) -> [Overlap; 4] {
    let mut parts = [Overlap::default(); 4];
    for slice in Pair::all(heights, drawn, found) {
        let part = slice.part();
        parts[part] += Overlap::of(slice.drawn, slice.found);
    }
    parts
}

/// The part of a gland between apex and base, of those of [`overlap_of_parts`].
const MIDDLE: usize = 1;

/// What is drawn and what was found in one image; nothing is empty.
struct Pair<'a> {
    drawn: &'a [DVec2],
    found: &'a [DVec2],
    /// Height in the drawn gland, whose ends lie half a slice beyond its first and last outline.
    share: f64,
    /// The outline found, by place.
    index: Option<usize>,
}

impl<'a> Pair<'a> {
    fn all(
        heights: &'a [f64],
        drawn: &'a [(f64, Vec<DVec2>)],
        found: &'a [(f64, Vec<DVec2>)],
    ) -> impl Iterator<Item = Pair<'a>> {
        let spacing = (heights[heights.len() - 1] - heights[0]) / (heights.len() - 1).max(1) as f64;
        let ends = [drawn[0].0 - 0.5 * spacing, drawn[drawn.len() - 1].0 + 0.5 * spacing];
        let at = move |outlines: &'a [(f64, Vec<DVec2>)], z: f64| {
            outlines
                .iter()
                .position(|(height, _)| (height - z).abs() < 0.25 * spacing)
        };
        heights.iter().map(move |&z| {
            let index = at(found, z);
            Pair {
                drawn: at(drawn, z).map_or(&[], |index| &drawn[index].1),
                found: index.map_or(&[], |index| &found[index].1),
                share: (z - ends[0]) / (ends[1] - ends[0]),
                index,
            }
        })
    }

    fn part(&self) -> usize {
        if self.drawn.is_empty() {
            3
        } else {
            usize::from(self.share >= 1.0 / 6.0) + usize::from(self.share > 5.0 / 6.0)
        }
    }
}

/// Scores an annotation of a stack at these heights against outlines drawn on it.
pub(crate) fn score(case: &str, heights: &[f64], truth: &[(f64, Vec<DVec2>)], found: &Annotation) -> Score {
    let outlines: Vec<(f64, Vec<DVec2>)> = found
        .slices
        .iter()
        .map(|slice| (slice.z_mm, slice.capsule.clone()))
        .collect();
    let mut parts = [Overlap::default(); 4];
    let (mut distances, mut slices, mut expected, mut true_mm) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
    for pair in Pair::all(heights, truth, &outlines) {
        let (part, overlap) = (pair.part(), Overlap::of(pair.drawn, pair.found));
        parts[part] += overlap;
        if pair.drawn.is_empty() {
            continue;
        }
        let slice = pair.index.map(|index| &found.slices[index]);
        let distance_mm = slice.map(|_| mean_distance_mm(pair.drawn, pair.found));
        if let (Some(slice), Some(distance)) = (slice, distance_mm) {
            if part == MIDDLE {
                distances.push(distance);
            }
            expected.push(slice.error_mm);
            true_mm.push(distance);
        }
        slices.push(SliceScore {
            share: pair.share,
            dice: overlap.dice(),
            distance_mm,
            expected_mm: slice.map(|slice| slice.error_mm),
            flagged: slice.is_some_and(|slice| !slice.flags.is_empty()),
        });
    }
    let mut whole = Overlap::default();
    parts.iter().for_each(|part| whole += *part);
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
        dice_middle: parts[MIDDLE].dice(),
        dice_apex: parts[0].dice(),
        dice_base: parts[2].dice(),
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
