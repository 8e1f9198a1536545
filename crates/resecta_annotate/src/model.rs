//! The trained model.

use glam::{DVec2, DVec3};
use serde::{Deserialize, Serialize};

use crate::appearance::{Appearance, Seen, Zone};
use crate::field::Field;
use crate::gland::{Gland, GlandModel};
use crate::Stack;

/// A stack and the outlines someone drew on it.
#[derive(Debug, Clone)]
pub struct TrainingCase {
    /// Its name, for reports.
    pub name: String,
    /// The images.
    pub stack: Stack,
    /// Outlines by rising height, mm.
    pub outlines: Vec<(f64, Vec<DVec2>)>,
}

/// What was learned.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Model {
    /// The whole gland.
    pub gland: GlandModel,
    /// Grey statistics.
    pub appearance: Appearance,
}

/// Weight of the mean surprise of all landmarks against the prior of pose and shape: about the number of landmarks whose
/// profiles are independent.
pub(crate) fn independent() -> f64 {
    std::env::var("W").ok().and_then(|w| w.parse().ok()).unwrap_or(40.0)
}
static WW: std::sync::LazyLock<f64> = std::sync::LazyLock::new(independent);
static WEE: std::sync::LazyLock<f64> = std::sync::LazyLock::new(ends_weight);
pub(crate) fn var(name: &str, or: f64) -> f64 {
    std::env::var(name).ok().and_then(|w| w.parse().ok()).unwrap_or(or)
}
pub(crate) static TEMPER: std::sync::LazyLock<f32> = std::sync::LazyLock::new(|| var("T", 1.0) as f32);
pub(crate) static FLOOR: std::sync::LazyLock<f32> = std::sync::LazyLock::new(|| var("F", 0.0) as f32);
pub(crate) static SHR: std::sync::LazyLock<f64> = std::sync::LazyLock::new(|| var("S", 0.1));
pub(crate) fn ends_weight() -> f64 {
    std::env::var("WE").ok().and_then(|w| w.parse().ok()).unwrap_or(1.0)
}

impl Model {
    /// Learns from cases and from their mirror images.
    pub fn train(cases: &[TrainingCase]) -> Model {
        let mut seen = Vec::new();
        for case in cases {
            let field = Field::of(&case.stack);
            let Some(gland) = Gland::of_outlines(&case.outlines) else { continue };
            let axis = field.centre().x;
            let outlines: Vec<(f64, Vec<DVec2>)> = case
                .outlines
                .iter()
                .map(|(z, outline)| {
                    let mirror = outline.iter().map(|place| DVec2::new(2.0 * axis - place.x, place.y));
                    (*z, mirror.collect())
                })
                .collect();
            let Some(mirror) = Gland::of_outlines(&outlines) else { continue };
            let mirrored_field = field.mirrored();
            seen.push((field, gland, false));
            seen.push((mirrored_field, mirror, true));
        }
        let glands: Vec<(Gland, DVec3)> =
            seen.iter().map(|(field, gland, _)| (gland.clone(), field.centre())).collect();
        let seen: Vec<Seen> = seen
            .iter()
            .map(|(field, gland, is_mirrored)| Seen { field, gland, is_mirrored: *is_mirrored })
            .collect();
        Model { gland: GlandModel::of(&glands), appearance: Appearance::of(&seen) }
    }

    /// The error of a gland in a stack.
    pub(crate) fn error(&self, field: &Field, weights: &[f64], centre: DVec3) -> f64 {
        let gland = self.gland.at(weights, centre);
        let (mut sum, mut count) = (0.0, 0.0);
        for (share, places) in gland.surface() {
            for (landmark, (place, normal)) in places.into_iter().enumerate() {
                let verdict = self.appearance.judge(field, Zone::at(share), landmark, place, normal);
                sum += f64::from(verdict.surprise);
                count += 1.0;
            }
        }
        let ends: f64 = (0..2)
            .map(|end| f64::from(self.appearance.judge_end(field, &gland, end).surprise))
            .sum();
        let prior: f64 = weights.iter().map(|weight| weight * weight).sum();
        *WW * sum / f64::max(count, 1.0) + *WEE * ends + 0.5 * prior
    }
}
