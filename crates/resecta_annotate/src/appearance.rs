//! What the grey values about the boundary look like: a statistic for each landmark in each zone of the gland.

use glam::{DVec2, DVec3};
use serde::{Deserialize, Serialize};

use crate::discriminant::{Discriminant, Moments, Verdict};
use crate::field::{Field, FieldSlice};
use crate::gland::{Gland, SurfacePoint};
use crate::landmarks::{LANDMARKS, normals};

/// Distance between the samples of a profile along the normal, mm.
const STEP_MM: f64 = 1.5;
/// Samples to each side of the landmark.
const HALF: usize = 8;
/// Displacements to each side that a profile is judged for.
const REACH: usize = 6;
/// Samples of a profile.
const SAMPLES: usize = 2 * HALF + 1;
/// The same along the axis, at apex and base.
const END_STEP_MM: f64 = 3.0;
const END_HALF: usize = 4;
const END_REACH: usize = 3;
/// Where profiles along the axis stand about the middle of an end, mm.
const END_COLUMNS: [DVec2; 5] = [
    DVec2::ZERO,
    DVec2::new(0.0, -8.0),
    DVec2::new(0.0, 8.0),
    DVec2::new(8.0, 0.0),
    DVec2::new(-8.0, 0.0),
];

/// A third of the gland in height, each with statistics of its own.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum Zone {
    /// The lowest quarter.
    Apex,
    /// Between.
    Middle,
    /// The highest quarter, towards the bladder.
    Base,
}

impl Zone {
    /// All, by rising height.
    pub const ALL: [Zone; 3] = [Zone::Apex, Zone::Middle, Zone::Base];

    /// The zone at a height within the gland: 0 at the lowest level, 1 at the highest.
    pub fn at(share: f64) -> Zone {
        match share {
            share if share < 0.25 => Zone::Apex,
            share if share > 0.75 => Zone::Base,
            _ => Zone::Middle,
        }
    }
}

/// Grey statistics of the gland's boundary.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Appearance {
    /// For each zone, for each landmark, along the normals of the gland's surface.
    surface: Vec<Vec<Discriminant>>,
    /// The same along the normals of the outline, within the slice.
    outline: Vec<Vec<Discriminant>>,
    /// Along the axis at apex and base.
    ends: Vec<Discriminant>,
}

impl Appearance {
    /// Learns from glands and the stacks that show them.
    pub(crate) fn of(cases: &[(Field, Gland)]) -> Appearance {
        let none = vec![vec![Moments::new(2 * REACH + 1, SAMPLES); LANDMARKS]; Zone::ALL.len()];
        let (mut surface, mut outline) = (none.clone(), none);
        let end_samples = END_COLUMNS.len() * (2 * END_HALF + 1);
        let mut ends = vec![Moments::new(2 * END_REACH + 1, end_samples); 2];
        for (field, gland) in cases {
            for (share, points) in gland.surface() {
                let zone = Zone::at(share) as usize;
                for (landmark, SurfacePoint { place, normal, .. }) in points.into_iter().enumerate() {
                    let slice = field.plane(place.z);
                    let (flat, in_slice) = (normal.truncate().normalize_or_zero(), place.truncate());
                    for displacement in 0..=2 * REACH {
                        let shift = (displacement as f64 - REACH as f64) * STEP_MM;
                        let profile = space_profile(field, place + shift * normal, normal);
                        surface[zone][landmark].add(displacement, &profile);
                        let profile = flat_profile(slice, in_slice + shift * flat, flat);
                        outline[zone][landmark].add(displacement, &profile);
                    }
                }
            }
            for (end, moments) in ends.iter_mut().enumerate() {
                for displacement in 0..=2 * END_REACH {
                    let shift = (displacement as f64 - END_REACH as f64) * END_STEP_MM;
                    moments.add(displacement, &end_profile(field, gland, end, shift));
                }
            }
        }
        let learn = |zones: Vec<Vec<Moments>>| {
            let landmarks = |zone: &Vec<Moments>| zone.iter().map(Discriminant::of).collect();
            zones.iter().map(landmarks).collect()
        };
        Appearance {
            surface: learn(surface),
            outline: learn(outline),
            ends: ends.iter().map(Discriminant::of).collect(),
        }
    }

    /// Sizes of the parts, for checking a file: field, found, expected.
    pub(crate) fn parts(&self) -> Vec<(&'static str, usize, usize)> {
        let mut parts = vec![("appearance.ends", self.ends.len(), 2)];
        let end_samples = END_COLUMNS.len() * (2 * END_HALF + 1);
        for end in &self.ends {
            parts.extend(end.parts("appearance.ends", 2 * END_REACH + 1, end_samples));
        }
        for (field, zones) in [
            ("appearance.surface", &self.surface),
            ("appearance.outline", &self.outline),
        ] {
            parts.push((field, zones.len(), Zone::ALL.len()));
            for zone in zones {
                parts.push((field, zone.len(), LANDMARKS));
                for landmark in zone {
                    parts.extend(landmark.parts(field, 2 * REACH + 1, SAMPLES));
                }
            }
        }
        parts
    }

    /// What a landmark of the gland's surface sees along its normal.
    pub(crate) fn judge(&self, field: &Field, zone: Zone, landmark: usize, place: DVec3, normal: DVec3) -> Verdict {
        self.surface[zone as usize][landmark].judge(&space_profile(field, place, normal))
    }

    /// What the landmarks of an outline see within their slice.
    pub(crate) fn judge_outline<'a>(
        &'a self,
        slice: &'a FieldSlice,
        zone: Zone,
        section: &'a [DVec2],
    ) -> impl Iterator<Item = Verdict> + 'a {
        let statistics = &self.outline[zone as usize];
        normals(section)
            .into_iter()
            .enumerate()
            .map(move |(landmark, normal)| statistics[landmark].judge(&flat_profile(slice, section[landmark], normal)))
    }

    /// What the images show about an end of the gland: 0 apex, 1 base. A displacement counts upwards.
    pub(crate) fn judge_end(&self, field: &Field, gland: &Gland, end: usize) -> Verdict {
        self.ends[end].judge(&end_profile(field, gland, end, 0.0))
    }
}

/// Grey values from inside to outside along a normal of the surface.
fn space_profile(field: &Field, place: DVec3, normal: DVec3) -> [f32; SAMPLES] {
    std::array::from_fn(|sample| field.at(place + along(sample) * normal))
}

/// The same within a slice.
fn flat_profile(slice: &FieldSlice, place: DVec2, normal: DVec2) -> [f32; SAMPLES] {
    std::array::from_fn(|sample| slice.at(place + along(sample) * normal))
}

/// Where a sample of a profile lies, mm outwards from the landmark.
fn along(sample: usize) -> f64 {
    (sample as f64 - HALF as f64) * STEP_MM
}

fn end_profile(field: &Field, gland: &Gland, end: usize, shift: f64) -> Vec<f32> {
    // The outlines of the very ends are small and irregular; the next level has a better middle.
    let level = if end == 0 {
        &gland.levels[1]
    } else {
        &gland.levels[gland.levels.len() - 2]
    };
    let middle = level.iter().sum::<DVec2>() / level.len() as f64;
    let mut profile = Vec::with_capacity(END_COLUMNS.len() * (2 * END_HALF + 1));
    for column in END_COLUMNS {
        for sample in 0..=2 * END_HALF {
            let z = gland.ends[end] + shift + (sample as f64 - END_HALF as f64) * END_STEP_MM;
            profile.push(field.at((middle + column).extend(z)));
        }
    }
    profile
}

/// Root mean square of displacements, mm.
pub(crate) fn rms_mm(verdicts: &[Verdict]) -> f64 {
    let squares: f64 = verdicts
        .iter()
        .map(|verdict| (f64::from(verdict.displacement) * STEP_MM).powi(2))
        .sum();
    (squares / verdicts.len().max(1) as f64).sqrt()
}
