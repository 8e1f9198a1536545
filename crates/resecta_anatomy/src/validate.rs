//! The rules every case keeps, and the error that names the slice and the rule broken.
//!
//! Nothing here asks for beauty: contours may run either way round, be notched or concave, and slices may be unevenly
//! spaced, small or irregular. What is refused is what no lattice can be built from, and what is absurdly large.

use std::fmt;

use glam::{DVec2, DVec3};

use crate::{Case, Slice, contour};

/// Fewest slices of a case.
pub const MIN_SLICES: usize = 3;
/// Most slices of a case.
pub const MAX_SLICES: usize = 2000;
/// Most corners of one contour.
pub const MAX_CORNERS: usize = 10_000;
/// Most corners of all contours of a case together; bounds the time that a hostile file can cost to a few seconds.
pub const MAX_CASE_CORNERS: usize = 300_000;
/// Largest coordinate, mm.
pub const MAX_COORDINATE_MM: f64 = 10_000.0;
/// Smallest area that a capsule encloses, mm².
pub const MIN_CAPSULE_AREA_MM2: f64 = 1.0;
/// Smallest area that a urethra or a transition zone encloses, mm².
pub const MIN_INNER_AREA_MM2: f64 = 0.01;
/// How far a corner of the transition zone may stand outside the capsule, mm: two outlines drawn by hand or cut from a
/// mask may share an edge and differ by a voxel there.
pub const TRANSITION_ZONE_TOLERANCE_MM: f64 = 1.0;

/// How far outside of the box around a gland's contours its landmarks may lie, mm: neck, verumontanum and sphincter ...
pub const LANDMARK_OUTSIDE_MM: f64 = 30.0;
/// ... and ureteral orifices, which lie in the bladder.
pub const ORIFICE_OUTSIDE_MM: f64 = 80.0;

/// A contour counts as open when its closing edge is longer than this share of the perimeter...
const OPEN_SHARE: f64 = 0.1;
/// ... and this many times longer than its longest other edge.
const OPEN_RATIO: f64 = 5.0;

/// Which contour of a slice.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ContourKind {
    /// The outer boundary.
    Capsule,
    /// The lumen.
    Urethra,
    /// The boundary of the transition zone.
    TransitionZone,
}

impl fmt::Display for ContourKind {
    fn fmt(&self, formatter: &mut fmt::Formatter) -> fmt::Result {
        formatter.write_str(match self {
            Self::Capsule => "capsule",
            Self::Urethra => "urethra",
            Self::TransitionZone => "transition_zone",
        })
    }
}

/// What is wrong with one contour on its own.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum ContourFault {
    /// No area can be enclosed.
    #[error("is empty: it has {found} distinct corners, expected at least 3")]
    Empty {
        /// Distinct corners.
        found: usize,
    },
    /// A file of absurd size.
    #[error("has {found} corners, expected at most {MAX_CORNERS}")]
    TooManyCorners {
        /// Corners.
        found: usize,
    },
    /// NaN, infinite or absurdly far away.
    #[error(
        "corner {corner} is ({}, {}), expected finite coordinates within ±{MAX_COORDINATE_MM} mm",
        value.x,
        value.y
    )]
    BadCorner {
        /// Index of the corner.
        corner: usize,
        /// Its coordinates.
        value: DVec2,
    },
    /// The drawing stops before it comes back to its start.
    #[error(
        "is open: {gap_mm:.3} mm lie between its last and first corner, {:.0} % of its perimeter, and no other edge is \
         longer than {longest_mm:.3} mm; expected a closed contour",
        100.0 * gap_mm / perimeter_mm
    )]
    Open {
        /// Length of the closing edge, mm.
        gap_mm: f64,
        /// Longest of the drawn edges, mm.
        longest_mm: f64,
        /// Perimeter with the closing edge, mm.
        perimeter_mm: f64,
    },
    /// Two edges share a point.
    #[error(
        "crosses itself: edges {first} and {second} meet at ({:.3}, {:.3}) mm; expected a simple closed contour",
        point.x,
        point.y
    )]
    Crossing {
        /// The edge that begins at the corner of this index.
        first: usize,
        /// The other edge.
        second: usize,
        /// Where, mm.
        point: DVec2,
    },
    /// A sliver.
    #[error("encloses {area_mm2:.4} mm², expected at least {least_mm2} mm²")]
    NoArea {
        /// Enclosed area, mm².
        area_mm2: f64,
        /// Least area of its kind, mm².
        least_mm2: f64,
    },
}

/// A rule that a case breaks.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum CaseRuleError {
    /// No spline runs through fewer.
    #[error("slices: the case has {found} slices, expected at least {MIN_SLICES}")]
    TooFewSlices {
        /// Slices.
        found: usize,
    },
    /// A file of absurd size.
    #[error("slices: the case has {found} slices, expected at most {MAX_SLICES}")]
    TooManySlices {
        /// Slices.
        found: usize,
    },
    /// A file of absurd size.
    #[error("slices: the contours have {found} corners together, expected at most {MAX_CASE_CORNERS}")]
    TooManyCorners {
        /// Corners of all contours.
        found: usize,
    },
    /// NaN, infinite or absurdly far away.
    #[error("slices[{slice}].z: is {z}, expected a finite height within ±{MAX_COORDINATE_MM} mm")]
    BadHeight {
        /// Index of the slice.
        slice: usize,
        /// Its height, mm.
        z: f64,
    },
    /// Out of order or repeated.
    #[error(
        "slices[{slice}].z: {z} mm {} the slice before it ({previous} mm); expected heights that rise from slice to slice",
        if z == previous { "repeats" } else { "lies below" }
    )]
    HeightOrder {
        /// Index of the slice.
        slice: usize,
        /// Its height, mm.
        z: f64,
        /// Height of the slice before, mm.
        previous: f64,
    },
    /// A contour is wrong on its own.
    #[error("slices[{slice}].{contour}: {fault}")]
    Contour {
        /// Index of the slice.
        slice: usize,
        /// Which contour.
        contour: ContourKind,
        /// What is wrong.
        fault: ContourFault,
    },
    /// The lumen touches, crosses or lies outside the capsule.
    #[error(
        "slices[{slice}].urethra: reaches outside the capsule near ({:.3}, {:.3}) mm; expected it wholly inside, not \
         touching",
        point.x,
        point.y
    )]
    UrethraOutside {
        /// Index of the slice.
        slice: usize,
        /// A point of the urethra on or outside the capsule, mm.
        point: DVec2,
    },
    /// The transition zone leaves the gland.
    #[error(
        "slices[{slice}].transition_zone: corner {corner} lies {distance_mm:.3} mm outside the capsule, expected at most \
         {TRANSITION_ZONE_TOLERANCE_MM} mm"
    )]
    TransitionZoneOutside {
        /// Index of the slice.
        slice: usize,
        /// Index of the corner.
        corner: usize,
        /// Distance to the capsule, mm.
        distance_mm: f64,
    },
    /// A landmark that is no place.
    #[error(
        "landmarks.{landmark}: is ({}, {}, {}), expected finite coordinates within ±{MAX_COORDINATE_MM} mm",
        value.x,
        value.y,
        value.z
    )]
    BadLandmark {
        /// Field of the landmarks.
        landmark: &'static str,
        /// Its coordinates.
        value: DVec3,
    },
    /// A landmark that is a place, but none of this gland.
    #[error(
        "landmarks.{landmark}: is ({}, {}, {}), {distance_mm:.0} mm from the box around the contours, expected at most \
         {most_mm} mm",
        value.x,
        value.y,
        value.z
    )]
    FarLandmark {
        /// Field of the landmarks.
        landmark: &'static str,
        /// Its coordinates.
        value: DVec3,
        /// How far outside of the box around the contours, mm.
        distance_mm: f64,
        /// The most of its kind, mm.
        most_mm: f64,
    },
    /// The capsule leaves no room for a lumen that must be approximated.
    #[error(
        "slices[{slice}].capsule: the largest circle inside it has a radius of {radius_mm:.3} mm, too thin for an \
         approximated urethra; expected at least {least_mm} mm"
    )]
    TooThin {
        /// Index of the slice.
        slice: usize,
        /// Radius of the largest circle found inside, mm.
        radius_mm: f64,
        /// Least radius, mm.
        least_mm: f64,
    },
}

impl CaseRuleError {
    /// Path of the field that breaks the rule, for example `slices[3].capsule`.
    pub fn field(&self) -> String {
        match self {
            Self::TooFewSlices { .. } | Self::TooManySlices { .. } | Self::TooManyCorners { .. } => "slices".into(),
            Self::BadHeight { slice, .. } | Self::HeightOrder { slice, .. } => format!("slices[{slice}].z"),
            Self::Contour { slice, contour, .. } => format!("slices[{slice}].{contour}"),
            Self::UrethraOutside { slice, .. } => format!("slices[{slice}].urethra"),
            Self::TransitionZoneOutside { slice, .. } => format!("slices[{slice}].transition_zone"),
            Self::BadLandmark { landmark, .. } | Self::FarLandmark { landmark, .. } => format!("landmarks.{landmark}"),
            Self::TooThin { slice, .. } => format!("slices[{slice}].capsule"),
        }
    }
}

impl Case {
    /// Checks every rule, and names the first that is broken.
    ///
    /// # Errors
    ///
    /// One variant of [`CaseRuleError`] a rule; its text names the field with the index of the slice.
    pub fn validate(&self) -> Result<(), CaseRuleError> {
        match self.faults().into_iter().next() {
            Some(fault) => Err(fault),
            None => Ok(()),
        }
    }

    /// Every rule that is broken, of each slice the first. What is absurdly large is not looked into.
    pub fn faults(&self) -> Vec<CaseRuleError> {
        let found = self.slices.len();
        if found < MIN_SLICES {
            return vec![CaseRuleError::TooFewSlices { found }];
        }
        if found > MAX_SLICES {
            return vec![CaseRuleError::TooManySlices { found }];
        }
        let corners = self
            .slices
            .iter()
            .flat_map(contours)
            .map(|(_, contour)| contour.len())
            .sum();
        if corners > MAX_CASE_CORNERS {
            return vec![CaseRuleError::TooManyCorners { found: corners }];
        }
        let mut faults = Vec::new();
        let mut previous = f64::NEG_INFINITY;
        for (slice, Slice { z, .. }) in self.slices.iter().enumerate() {
            let z = *z;
            if !z.is_finite() || z.abs() > MAX_COORDINATE_MM {
                faults.push(CaseRuleError::BadHeight { slice, z });
                continue;
            }
            if z <= previous {
                faults.push(CaseRuleError::HeightOrder { slice, z, previous });
            }
            previous = z;
        }
        for (index, slice) in self.slices.iter().enumerate() {
            faults.extend(validate_slice(index, slice).err());
        }
        // Of bad contours nobody can tell what is far.
        let bounds = if faults.is_empty() { self.bounds() } else { None };
        faults.extend(self.landmark_faults(bounds));
        faults
    }

    /// The corners of the box around all capsules, mm; none without corners.
    fn bounds(&self) -> Option<[DVec3; 2]> {
        let corners = (self.slices.iter()).flat_map(|slice| slice.capsule.iter().map(|corner| corner.extend(slice.z)));
        corners.fold(None, |bounds, corner| match bounds {
            None => Some([corner; 2]),
            Some([low, high]) => Some([low.min(corner), high.max(corner)]),
        })
    }

    /// Landmarks that are no places, and, where these bounds are known, those that are none of this gland.
    fn landmark_faults(&self, bounds: Option<[DVec3; 2]>) -> impl Iterator<Item = CaseRuleError> {
        let landmarks = &self.landmarks;
        let [left, right] = landmarks.ureteral_orifices.map_or([None; 2], |pair| pair.map(Some));
        let places = [
            ("bladder_neck", landmarks.bladder_neck),
            ("verumontanum", landmarks.verumontanum),
            ("external_sphincter", landmarks.external_sphincter),
            ("ureteral_orifices[0]", left),
            ("ureteral_orifices[1]", right),
        ];
        let is_good = |value: DVec3| value.is_finite() && value.abs().max_element() <= MAX_COORDINATE_MM;
        places.into_iter().filter_map(move |(landmark, value)| {
            let value = value?;
            if !is_good(value) {
                return Some(CaseRuleError::BadLandmark { landmark, value });
            }
            let [low, high] = bounds?;
            let distance_mm = value.distance(value.clamp(low, high));
            let most_mm = match landmark.starts_with("ureteral") {
                true => ORIFICE_OUTSIDE_MM,
                false => LANDMARK_OUTSIDE_MM,
            };
            (distance_mm > most_mm).then_some(CaseRuleError::FarLandmark {
                landmark,
                value,
                distance_mm,
                most_mm,
            })
        })
    }
}

fn contours(slice: &Slice) -> impl Iterator<Item = (ContourKind, &[DVec2])> {
    let urethra = slice.urethra.as_deref().map(|contour| (ContourKind::Urethra, contour));
    let transition_zone = slice
        .transition_zone
        .as_deref()
        .map(|contour| (ContourKind::TransitionZone, contour));
    [(ContourKind::Capsule, slice.capsule.as_slice())]
        .into_iter()
        .chain(urethra)
        .chain(transition_zone)
}

fn validate_slice(index: usize, slice: &Slice) -> Result<(), CaseRuleError> {
    for (kind, contour) in contours(slice) {
        let least_mm2 = if kind == ContourKind::Capsule {
            MIN_CAPSULE_AREA_MM2
        } else {
            MIN_INNER_AREA_MM2
        };
        validate_contour(contour, least_mm2).map_err(|fault| CaseRuleError::Contour {
            slice: index,
            contour: kind,
            fault,
        })?;
    }
    let capsule = &slice.capsule;
    if let Some(urethra) = &slice.urethra {
        let outside = contour::first_meeting(urethra, capsule)
            .map(|meeting| meeting.point)
            .or_else(|| {
                urethra
                    .iter()
                    .copied()
                    .find(|&corner| !contour::contains(capsule, corner))
            });
        if let Some(point) = outside {
            return Err(CaseRuleError::UrethraOutside { slice: index, point });
        }
    }
    for (corner, &point) in slice.transition_zone.iter().flatten().enumerate() {
        let distance_mm = -contour::clearance(capsule, point);
        if distance_mm > TRANSITION_ZONE_TOLERANCE_MM {
            return Err(CaseRuleError::TransitionZoneOutside {
                slice: index,
                corner,
                distance_mm,
            });
        }
    }
    Ok(())
}

/// A contour on its own. It counts as open when its closing edge is longer than 10 % of the perimeter and more than five
/// times as long as its longest drawn edge: coarse outlines of a few long edges are closed, and so is an outline whose
/// corners are unevenly spaced; a dense outline that stops a tenth of its way before the start is not.
fn validate_contour(corners: &[DVec2], least_mm2: f64) -> Result<(), ContourFault> {
    if corners.len() > MAX_CORNERS {
        return Err(ContourFault::TooManyCorners { found: corners.len() });
    }
    for (corner, &value) in corners.iter().enumerate() {
        if !(value.is_finite() && value.abs().max_element() <= MAX_COORDINATE_MM) {
            return Err(ContourFault::BadCorner { corner, value });
        }
    }
    let repeats = contour::edges(corners).filter(|[a, b]| a == b).count();
    let distinct = (corners.len() - repeats).max(corners.len().min(1));
    if distinct < 3 {
        return Err(ContourFault::Empty { found: distinct });
    }
    if let Some(contour::Meeting { first, second, point }) = contour::self_crossing(corners) {
        return Err(ContourFault::Crossing { first, second, point });
    }
    let area_mm2 = contour::signed_area(corners).abs();
    if area_mm2 < least_mm2 {
        return Err(ContourFault::NoArea { area_mm2, least_mm2 });
    }
    let lengths: Vec<f64> = contour::edges(corners).map(|[a, b]| a.distance(b)).collect();
    let (&gap_mm, drawn) = lengths.split_last().unwrap_or((&0.0, &[]));
    let longest_mm = drawn.iter().copied().fold(0.0, f64::max);
    let perimeter_mm: f64 = lengths.iter().sum();
    if gap_mm > OPEN_SHARE * perimeter_mm && gap_mm > OPEN_RATIO * longest_mm {
        return Err(ContourFault::Open {
            gap_mm,
            longest_mm,
            perimeter_mm,
        });
    }
    Ok(())
}

/// Drops corners that repeat the one before, and a last corner that repeats the first: neither changes the contour, and
/// many programs write the latter.
pub(crate) fn drop_repeated_corners(case: &mut Case) {
    for slice in &mut case.slices {
        let inner = slice.urethra.iter_mut().chain(slice.transition_zone.iter_mut());
        for contour in inner.chain([&mut slice.capsule]) {
            contour.dedup();
            while contour.len() > 1 && contour.first() == contour.last() {
                contour.pop();
            }
        }
    }
}
