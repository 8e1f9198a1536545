//! Training: a model from annotated cases, with the figures of models that each did without one of them.

use glam::{DVec2, DVec3};
use rayon::prelude::*;

use crate::annotate::annotate_found;
use crate::appearance::Appearance;
use crate::compare::mean_distance_mm;
use crate::confidence::{Confidence, Evidence};
use crate::field::Field;
use crate::gland::{Gland, GlandModel};
use crate::gland_search::GlandSearch;
use crate::score::{Figures, Score, score};
use crate::search::Found;
use crate::section::SectionModel;
use crate::{Annotation, Model, Stack};

/// Fewest cases to learn from.
const LEAST_CASES: usize = 3;

/// A stack and the outlines someone drew on it.
#[derive(Debug, Clone)]
pub struct TrainingCase {
    /// Its name, for figures and errors.
    pub name: String,
    /// The images.
    pub stack: Stack,
    /// Outlines of the capsule by rising height: height, corners, mm.
    pub outlines: Vec<(f64, Vec<DVec2>)>,
}

/// Why nothing was learned.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum TrainError {
    /// Too few to learn from when one is left out.
    #[error("there are {found} cases, expected at least {LEAST_CASES} to learn from")]
    TooFew {
        /// Cases given.
        found: usize,
    },
    /// Fewer than three outlines that enclose an area, or none of any height.
    #[error("{case}: has no gland to learn from, expected at least three outlines by rising height")]
    NoGland {
        /// The case.
        case: String,
    },
    /// Outlines and images at different heights: one of the two has a wrong spacing or origin.
    #[error("{case}: the outlines do not lie within the stack of images")]
    Apart {
        /// The case.
        case: String,
    },
}

/// A gland made ready to learn from, and its mirror image.
type Ready = [(Field, Gland); 2];

impl Model {
    /// Learns from cases and from their mirror images, measures models trained without each case on that case, and
    /// calibrates the confidence on these. `progress` is told how many cases have been left out, and of how many.
    ///
    /// # Errors
    ///
    /// Every [`TrainError`].
    pub fn train(
        cases: &[TrainingCase],
        attribution: &str,
        seed: u64,
        progress: impl Fn(usize, usize) + Sync,
    ) -> Result<Model, TrainError> {
        if cases.len() < LEAST_CASES {
            return Err(TrainError::TooFew { found: cases.len() });
        }
        let ready = cases.iter().map(prepare).collect::<Result<Vec<Ready>, TrainError>>()?;
        let done = std::sync::atomic::AtomicUsize::new(0);
        let held_out: Vec<Option<[HeldOut; 2]>> = (0..cases.len())
            .into_par_iter()
            .map(|left_out| {
                let others: Vec<&Ready> = ready
                    .iter()
                    .enumerate()
                    .filter(|(index, _)| *index != left_out)
                    .map(|(_, case)| case)
                    .collect();
                let mut model = learn(&others);
                let search = GlandSearch::new(&cases[left_out].stack, &model);
                let (found, field) = (search.run(seed), search.field);
                let whole = HeldOut::of(&cases[left_out], &field, &model, &found, seed);
                model.adjusts_slices = true;
                let adjusted = HeldOut::of(&cases[left_out], &field, &model, &found, seed);
                let done = done.fetch_add(1, std::sync::atomic::Ordering::Relaxed) + 1;
                progress(done, cases.len());
                Some([whole?, adjusted?])
            })
            .collect();
        let (whole, adjusted): (Vec<HeldOut>, Vec<HeldOut>) = held_out
            .into_iter()
            .flatten()
            .map(|[whole, adjusted]| (whole, adjusted))
            .unzip();
        let mut model = learn(&ready.iter().collect::<Vec<_>>());
        model.adjusts_slices = mean_mm(&adjusted) < mean_mm(&whole);
        let held_out = if model.adjusts_slices { adjusted } else { whole };
        model.attribution = attribution.to_owned();
        let all: Vec<(Evidence, f64)> = held_out.iter().flat_map(|case| case.seen.iter().copied()).collect();
        model.confidence = Confidence::of(&all);
        model.figures.scores = (0..held_out.len())
            .map(|index| held_out[index].score(&held_out, index))
            .collect();
        Ok(model)
    }

    /// Learns from cases as [`Model::train`] does, without measuring anything: the model has no figures, adjusts no slices
    /// one by one, and its confidence is not calibrated.
    ///
    /// # Errors
    ///
    /// Every [`TrainError`].
    pub fn learn(cases: &[TrainingCase]) -> Result<Model, TrainError> {
        if cases.len() < LEAST_CASES - 1 {
            return Err(TrainError::TooFew { found: cases.len() });
        }
        let ready = cases.iter().map(prepare).collect::<Result<Vec<Ready>, TrainError>>()?;
        Ok(learn(&ready.iter().collect::<Vec<_>>()))
    }
}

fn prepare(case: &TrainingCase) -> Result<Ready, TrainError> {
    let field = Field::of(&case.stack);
    let axis = field.centre().x;
    let mirror = |(z, outline): &(f64, Vec<DVec2>)| {
        (
            *z,
            outline
                .iter()
                .map(|place| DVec2::new(2.0 * axis - place.x, place.y))
                .collect(),
        )
    };
    let mirrored: Vec<(f64, Vec<DVec2>)> = case.outlines.iter().map(mirror).collect();
    let no_gland = || TrainError::NoGland {
        case: case.name.clone(),
    };
    let gland = Gland::of_outlines(&case.outlines).ok_or_else(no_gland)?;
    let mirrored = Gland::of_outlines(&mirrored).ok_or_else(no_gland)?;
    let (slices, middle) = (case.stack.slices(), 0.5 * (gland.ends[0] + gland.ends[1]));
    let inside = slices[0].z_mm <= middle && middle <= slices[slices.len() - 1].z_mm;
    let flat = gland.levels.iter().flatten().sum::<DVec2>() / gland.levels.iter().flatten().count() as f64;
    if !inside || !field.plane(middle).holds(flat) {
        return Err(TrainError::Apart {
            case: case.name.clone(),
        });
    }
    let mirrored_field = field.mirrored();
    Ok([(field, gland), (mirrored_field, mirrored)])
}

/// The model without figures and with no confidence.
fn learn(cases: &[&Ready]) -> Model {
    let seen: Vec<(Field, Gland)> = cases.iter().flat_map(|case| case.iter().cloned()).collect();
    let glands: Vec<(Gland, DVec3)> = seen
        .iter()
        .map(|(field, gland)| (gland.clone(), field.centre()))
        .collect();
    let sections: Vec<(Vec<DVec2>, DVec2)> = glands
        .iter()
        .flat_map(|(gland, centre)| gland.levels.iter().map(|level| (level.clone(), centre.truncate())))
        .collect();
    Model {
        attribution: String::new(),
        figures: Figures::default(),
        gland: GlandModel::of(&glands),
        section: SectionModel::of(&sections),
        appearance: Appearance::of(&seen),
        adjusts_slices: false,
        confidence: Confidence::of(&[]),
    }
}

/// Mean over all slices of the mean distances, mm.
fn mean_mm(cases: &[HeldOut]) -> f64 {
    let all = || cases.iter().flat_map(|case| &case.seen);
    all().map(|(_, distance)| distance).sum::<f64>() / all().count().max(1) as f64
}

/// A case annotated by a model that had not seen it.
struct HeldOut {
    name: String,
    heights: Vec<f64>,
    truth: Vec<(f64, Vec<DVec2>)>,
    annotation: Annotation,
    /// Evidence and true mean distance, mm, of the slices that both have.
    seen: Vec<(Evidence, f64)>,
    /// Evidence of all slices found.
    evidence: Vec<Evidence>,
}

impl HeldOut {
    fn of(case: &TrainingCase, field: &Field, model: &Model, found: &Found, seed: u64) -> Option<HeldOut> {
        let annotation = annotate_found(&case.stack, field, model, found, seed, |_, _| {}).ok()?;
        let evidence = annotation.evidence(model, field);
        let seen = annotation.slices.iter().zip(&evidence).filter_map(|(slice, evidence)| {
            let (_, drawn) = case.outlines.iter().find(|(z, _)| (z - slice.z_mm).abs() < 1e-3)?;
            Some((*evidence, mean_distance_mm(drawn, &slice.capsule)))
        });
        Some(HeldOut {
            name: case.name.clone(),
            heights: case.stack.slices().iter().map(|slice| slice.z_mm).collect(),
            truth: case.outlines.clone(),
            seen: seen.collect(),
            annotation,
            evidence,
        })
    }

    /// The score, with the confidence calibrated on the other cases.
    fn score(&self, all: &[HeldOut], this: usize) -> Score {
        let others = all.iter().enumerate().filter(|(index, _)| *index != this);
        let seen: Vec<(Evidence, f64)> = others.flat_map(|(_, case)| case.seen.iter().copied()).collect();
        let confidence = Confidence::of(&seen);
        let mut annotation = self.annotation.clone();
        for (slice, evidence) in annotation.slices.iter_mut().zip(&self.evidence) {
            slice.error_mm = confidence.error_mm(*evidence);
            slice.flags.retain(|flag| *flag != crate::Flag::PoorFit);
            if confidence.is_poor(slice.error_mm) {
                slice.flags.push(crate::Flag::PoorFit);
            }
        }
        score(&self.name, &self.heights, &self.truth, &annotation)
    }
}
