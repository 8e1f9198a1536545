//! What was learned of glands and their images, and the errors that searches make least.

use glam::{DVec2, DVec3};
use serde::{Deserialize, Serialize};

use crate::appearance::{Appearance, Zone};
use crate::confidence::Confidence;
use crate::field::{Field, FieldSlice};
use crate::gland::GlandModel;
use crate::score::Figures;
use crate::section::SectionModel;

/// Weight of the mean surprise of a gland's landmarks against the prior of pose and shape: about as many of the profiles
/// as tell something of their own.
const GLAND_PROFILES: f64 = 40.0;
/// The same for the landmarks of one outline.
const OUTLINE_PROFILES: f64 = 8.0;

/// A trained model of the prostate in ultrasound.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Model {
    /// What it learned from, and under which licence: shown wherever the model is used.
    pub attribution: String,
    /// How well models trained without a case found that case.
    pub figures: Figures,
    /// Pose and shape of the whole gland.
    pub gland: GlandModel,
    /// Pose and shape of one section.
    pub section: SectionModel,
    /// Grey statistics of the boundary.
    pub appearance: Appearance,
    /// Whether slices are adjusted one by one after the whole gland: only where that paid on held-out cases.
    pub adjusts_slices: bool,
    /// What a fit tells of its own error.
    pub confidence: Confidence,
}

impl Model {
    /// The error of a gland in a stack with this middle: the mean surprise of its surface and that of its ends, and how
    /// unusual its pose and shape are. The mean is over the area: landmarks crowd at apex and base, where they see the same.
    pub(crate) fn gland_error(&self, field: &Field, weights: &[f64], stack_centre: DVec3) -> f64 {
        let gland = self.gland.at(weights, stack_centre);
        let (mut sum, mut area) = (0.0, 0.0);
        for (share, points) in gland.surface() {
            let zone = Zone::at(share);
            for (landmark, point) in points.into_iter().enumerate() {
                let verdict = self.appearance.judge(field, zone, landmark, point.place, point.normal);
                sum += point.area * f64::from(verdict.surprise);
                area += point.area;
            }
        }
        let ends: f64 = (0..2)
            .map(|end| f64::from(self.appearance.judge_end(field, &gland, end).surprise))
            .sum();
        let unusual: f64 = weights.iter().map(|weight| weight * weight).sum();
        GLAND_PROFILES * sum / f64::max(area, 1e-9) + ends + 0.5 * unusual
    }

    /// The error of an outline in a slice: the mean surprise of its landmarks, and how far it is from what was expected.
    pub(crate) fn outline_error(&self, slice: &FieldSlice, zone: Zone, outline: &[DVec2], offsets: &[f64]) -> f64 {
        let (mut sum, mut count) = (0.0, 0.0);
        for verdict in self.appearance.judge_outline(slice, zone, outline) {
            sum += f64::from(verdict.surprise);
            count += 1.0;
        }
        let unusual: f64 = offsets.iter().map(|offset| offset * offset).sum();
        OUTLINE_PROFILES * sum / f64::max(count, 1.0) + 0.5 * unusual
    }
}
