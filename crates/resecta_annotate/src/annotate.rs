//! Annotation: from a stack of images to the outlines of the gland, with what is to be thought of them.
//!
//! First the model of the whole gland is fitted to the whole stack by the genetic algorithm, so that apex and base are found
//! with the rest and clear slices help unclear ones. Then, where training showed that it pays, each slice may move a little
//! from there, from the middle outwards, beginning with what its neighbour found.

use std::fmt;

use glam::DVec2;
use resecta_anatomy::{MIN_SLICES, contour};
use serde::{Deserialize, Serialize};

use crate::appearance::{Zone, rms_mm};
use crate::confidence::Evidence;
use crate::discriminant::Verdict;
use crate::field::{Field, FieldSlice};
use crate::gland::{Gland, POSE};
use crate::gland_search::{GlandSearch, REFINEMENT};
use crate::principal::WEIGHT_LIMIT;
use crate::search::{Found, GeneticOptions, genetic_then_local};
use crate::section::SECTION_POSE;
use crate::{Image, Model, Stack};

/// How far a slice may move from what the whole gland says, as standard deviations: mm, rad, logarithm of the size.
const SLICE_MM: f64 = 1.5;
const SLICE_RAD: f64 = 0.05;
const SLICE_SCALE: f64 = 0.05;
/// The same for the weights of its modes, in standard deviations of the mode.
const SLICE_MODE: f64 = 0.5;
/// Share of what a slice moved by that its neighbour begins with.
const CARRIED: f64 = 0.5;
/// A pose or a mode this near to its limit, as a share, is at it.
const AT_LIMIT: f64 = 0.98;
/// Share of an outline that may lie beyond what the image shows.
const HIDDEN_SHARE: f64 = 0.05;

/// Why a stack gave no annotation.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum AnnotateError {
    /// A gland needs slices.
    #[error("the stack has {found} images, expected at least {MIN_SLICES} to find a gland in")]
    TooFewImages {
        /// Images of the stack.
        found: usize,
    },
    /// The gland that was found lies between or beside the images.
    #[error("the gland found crosses {found} images of the stack, expected at least {MIN_SLICES}")]
    TooFewSlices {
        /// Images that cross it.
        found: usize,
    },
    /// No such image.
    #[error("image {index}: the stack has {count}")]
    NoImage {
        /// The index asked for.
        index: usize,
        /// Images of the stack.
        count: usize,
    },
}

/// Why an outline is not to be taken as it is.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub enum Flag {
    /// Part of the outline lies where the image shows nothing.
    LeavesImage {
        /// The share of its landmarks that does.
        share: f64,
    },
    /// The grey values do not look as they should: one slice in six like it is further out than [`POOR_FIT_MM`](crate::POOR_FIT_MM).
    PoorFit,
    /// The gland's size, place or shape is as unusual as the model allows: a wrong spacing does that.
    Unusual,
}

impl fmt::Display for Flag {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Flag::LeavesImage { share } => write!(f, "{:.0} % of it lie beyond the image", 100.0 * share),
            Flag::PoorFit => f.write_str("a poor fit"),
            Flag::Unusual => f.write_str("of unusual size, place or shape"),
        }
    }
}

/// The outline found in one image.
#[derive(Debug, Clone, PartialEq)]
pub struct AnnotatedSlice {
    /// Index of the image in its stack.
    pub image: usize,
    /// Height, mm.
    pub z_mm: f64,
    /// The zone whose grey statistics were used.
    pub zone: Zone,
    /// Landmarks of the capsule, mm.
    pub capsule: Vec<DVec2>,
    /// Weights of the section model: pose, then modes, in standard deviations.
    pub weights: Vec<f64>,
    /// Mean distance to the true outline that is expected, mm.
    pub error_mm: f64,
    /// Why it needs looking at; empty if it is as good as any.
    pub flags: Vec<Flag>,
}

/// What was found in a stack.
#[derive(Debug, Clone, PartialEq)]
pub struct Annotation {
    /// The slices that cross the gland, by rising height.
    pub slices: Vec<AnnotatedSlice>,
    /// The whole gland as first found.
    pub gland: Gland,
    /// Its weights: pose, then modes, in standard deviations.
    pub weights: Vec<f64>,
    /// Evaluations of the error function, all searches together.
    pub evaluations: usize,
}

/// Finds the gland in a stack. `progress` is told how many steps are done, and of how many.
///
/// The same seed gives the same bits with any number of threads.
///
/// # Errors
///
/// [`AnnotateError::TooFewImages`] or [`AnnotateError::TooFewSlices`]. Anything doubtful is a [`Flag`], not an error.
pub fn annotate(
    stack: &Stack,
    model: &Model,
    seed: u64,
    progress: impl FnMut(usize, usize),
) -> Result<Annotation, AnnotateError> {
    let images = stack.slices();
    if images.len() < MIN_SLICES {
        return Err(AnnotateError::TooFewImages { found: images.len() });
    }
    let search = GlandSearch::new(stack, model);
    let found = search.run(seed);
    annotate_found(stack, &search.field, model, &found, seed, progress)
}

/// As [`annotate`], once the whole gland is found.
pub(crate) fn annotate_found(
    stack: &Stack,
    field: &Field,
    model: &Model,
    found: &Found,
    seed: u64,
    mut progress: impl FnMut(usize, usize),
) -> Result<Annotation, AnnotateError> {
    let images = stack.slices();
    let gland = model.gland.at(&found.weights, field.centre());
    let crossing: Vec<usize> = (0..images.len())
        .filter(|&image| gland.section(images[image].z_mm).is_some())
        .collect();
    if crossing.len() < MIN_SLICES {
        return Err(AnnotateError::TooFewSlices { found: crossing.len() });
    }
    let steps = crossing.len() + 1;
    progress(1, steps);
    let mut evaluations = found.evaluations;
    let mut slices: Vec<Option<AnnotatedSlice>> = vec![None; crossing.len()];
    let middle = crossing.len() / 2;
    let upwards = (middle..crossing.len()).map(|place| (place, place.checked_sub(1).filter(|_| place > middle)));
    let downwards = (0..middle).rev().map(|place| (place, Some(place + 1)));
    for (done, (place, neighbour)) in upwards.chain(downwards).enumerate() {
        let image = crossing[place];
        let z = images[image].z_mm;
        let Some(expected) = gland.section(z) else { continue };
        let carried = neighbour.and_then(|neighbour| {
            let neighbour = slices[neighbour].as_ref()?;
            Some((gland.section(neighbour.z_mm)?, neighbour.capsule.clone()))
        });
        let start = match carried {
            None => expected.clone(),
            Some((before, after)) => (0..expected.len())
                .map(|landmark| expected[landmark] + CARRIED * (after[landmark] - before[landmark]))
                .collect(),
        };
        let search = SliceSearch {
            model,
            slice: field.plane(z),
            zone: Zone::at(gland.share_of(z)),
            expected: Some(&expected),
            start: Some(&start),
        };
        let (weights, capsule, looked) = if model.adjusts_slices {
            search.run(seed.wrapping_add(1 + image as u64))
        } else {
            (
                model.section.weights_of(&expected, search.slice.centre()),
                expected.clone(),
                0,
            )
        };
        evaluations += looked;
        let mut slice = search.report(&images[image].image, image, z, weights, capsule);
        if at_limit(&found.weights[..POSE]) {
            slice.flags.push(Flag::Unusual);
        }
        slices[place] = Some(slice);
        progress(done + 2, steps);
    }
    Ok(Annotation {
        slices: slices.into_iter().flatten().collect(),
        gland,
        weights: found.weights.clone(),
        evaluations,
    })
}

/// Finds the outline in one image of a stack: from a start, such as an outline that someone mended or the neighbour's, or
/// from the mean section where there is none.
///
/// # Errors
///
/// [`AnnotateError::NoImage`].
pub fn annotate_slice(
    stack: &Stack,
    image: usize,
    zone: Zone,
    start: Option<&[DVec2]>,
    model: &Model,
    seed: u64,
) -> Result<AnnotatedSlice, AnnotateError> {
    let images = stack.slices();
    let Some(shown) = images.get(image) else {
        return Err(AnnotateError::NoImage {
            index: image,
            count: images.len(),
        });
    };
    let field = Field::of(stack);
    let marked = start.and_then(crate::landmarks::landmarks);
    let search = SliceSearch {
        model,
        slice: field.plane(shown.z_mm),
        zone,
        expected: marked.as_deref(),
        start: marked.as_deref(),
    };
    let (weights, capsule, _) = search.run(seed);
    Ok(search.report(&shown.image, image, shown.z_mm, weights, capsule))
}

fn at_limit(weights: &[f64]) -> bool {
    weights.iter().any(|weight| weight.abs() >= AT_LIMIT * WEIGHT_LIMIT)
}

/// The search in one slice.
struct SliceSearch<'a> {
    model: &'a Model,
    slice: &'a FieldSlice,
    zone: Zone,
    /// Where the outline is expected; anywhere that training saw one, where absent.
    expected: Option<&'a [DVec2]>,
    /// Where the search begins; at what is expected, where absent.
    start: Option<&'a [DVec2]>,
}

impl SliceSearch<'_> {
    /// The weights and landmarks of least error, and evaluations made.
    fn run(&self, seed: u64) -> (Vec<f64>, Vec<DVec2>, usize) {
        let section = &self.model.section;
        let centre = self.slice.centre();
        let dimensions = section.dimensions();
        let (middle, deviation) = match self.expected {
            None => (vec![0.0; dimensions], vec![1.0; dimensions]),
            Some(expected) => {
                let mut deviation = vec![SLICE_MODE; dimensions];
                let pose = [SLICE_MM, SLICE_MM, SLICE_RAD, SLICE_SCALE];
                for axis in 0..SECTION_POSE {
                    deviation[axis] = pose[axis] / section.pose_deviation[axis];
                }
                (section.weights_of(expected, centre), deviation)
            }
        };
        // What the model cannot say of the expected outline stays as it is.
        let rest: Vec<DVec2> = match self.expected {
            None => vec![DVec2::ZERO; crate::landmarks::LANDMARKS],
            Some(expected) => {
                let said = section.at(&middle, centre);
                expected.iter().zip(said).map(|(place, said)| *place - said).collect()
            }
        };
        let weights_at = |offsets: &[f64]| -> Vec<f64> {
            (0..dimensions)
                .map(|axis| middle[axis] + deviation[axis] * offsets[axis])
                .collect()
        };
        let outline_at = |offsets: &[f64]| -> Vec<DVec2> {
            let outline = section.at(&weights_at(offsets), centre);
            outline.iter().zip(&rest).map(|(place, rest)| *place + *rest).collect()
        };
        let error = |offsets: &[f64]| {
            self.model
                .outline_error(self.slice, self.zone, &outline_at(offsets), offsets)
        };
        let mut starts = vec![vec![0.0; dimensions]];
        if let Some(start) = self.start {
            let weights = section.weights_of(start, centre);
            let offset =
                |axis: usize| ((weights[axis] - middle[axis]) / deviation[axis]).clamp(-WEIGHT_LIMIT, WEIGHT_LIMIT);
            starts.push((0..dimensions).map(offset).collect());
        }
        let options = GeneticOptions {
            population: 32,
            evaluations: 960,
            patience: 12,
            ..GeneticOptions::default()
        };
        let found = genetic_then_local(&starts, &options, REFINEMENT, seed, error);
        let mut offsets = found.weights;
        for _ in 0..20 {
            if contour::self_crossing(&outline_at(&offsets)).is_none() {
                break;
            }
            offsets[SECTION_POSE..].iter_mut().for_each(|offset| *offset *= 0.8);
        }
        (weights_at(&offsets), outline_at(&offsets), found.evaluations)
    }

    fn evidence(&self, capsule: &[DVec2]) -> Evidence {
        let verdicts: Vec<Verdict> = self
            .model
            .appearance
            .judge_outline(self.slice, self.zone, capsule)
            .collect();
        let surprise = verdicts.iter().map(|verdict| f64::from(verdict.surprise)).sum::<f64>();
        Evidence {
            zone: self.zone,
            rms_mm: rms_mm(&verdicts),
            surprise: surprise / verdicts.len().max(1) as f64,
        }
    }

    fn report(&self, shown: &Image, image: usize, z_mm: f64, weights: Vec<f64>, capsule: Vec<DVec2>) -> AnnotatedSlice {
        let error_mm = self.model.confidence.error_mm(self.evidence(&capsule));
        let mut flags = Vec::new();
        let hidden = capsule.iter().filter(|place| shown.grey_at(**place).is_none()).count();
        let share = hidden as f64 / capsule.len() as f64;
        if share > HIDDEN_SHARE {
            flags.push(Flag::LeavesImage { share });
        }
        if self.model.confidence.is_poor(error_mm) {
            flags.push(Flag::PoorFit);
        }
        if self.expected.is_none() && at_limit(&weights) {
            flags.push(Flag::Unusual);
        }
        AnnotatedSlice {
            image,
            z_mm,
            zone: self.zone,
            capsule,
            weights,
            error_mm,
            flags,
        }
    }
}

impl Annotation {
    /// What is known of a slice before its error can be estimated, for calibration.
    pub(crate) fn evidence(&self, model: &Model, field: &Field) -> Vec<Evidence> {
        self.slices
            .iter()
            .map(|slice| {
                let search = SliceSearch {
                    model,
                    slice: field.plane(slice.z_mm),
                    zone: slice.zone,
                    expected: None,
                    start: None,
                };
                search.evidence(&slice.capsule)
            })
            .collect()
    }

    /// Volume of the gland, ml: the slices' areas, each as thick as the space between them.
    pub fn volume_ml(&self) -> f64 {
        volume_ml(
            self.slices
                .iter()
                .map(|slice| (slice.z_mm, contour::signed_area(&slice.capsule).abs())),
        )
    }
}

/// Volume of a stack of areas (height in mm, area in mm²) by rising height, ml: each as thick as the space to its neighbours.
pub(crate) fn volume_ml(areas: impl Iterator<Item = (f64, f64)>) -> f64 {
    let areas: Vec<(f64, f64)> = areas.collect();
    let last = areas.len().saturating_sub(1);
    let thickness = |index: usize| {
        let below = if index > 0 {
            areas[index].0 - areas[index - 1].0
        } else {
            areas[1.min(last)].0 - areas[0].0
        };
        let above = if index < last {
            areas[index + 1].0 - areas[index].0
        } else {
            below
        };
        0.5 * (below + above)
    };
    (0..areas.len())
        .map(|index| areas[index].1 * thickness(index))
        .sum::<f64>()
        / 1000.0
}
