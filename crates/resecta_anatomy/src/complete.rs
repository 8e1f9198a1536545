//! Completion: what a case does not give is approximated by a stated rule, and the case says so.
//!
//! The urethra cannot be seen in ultrasound, so the papers approximate it; most data have none. The rules here are ours.
//! They look at nothing but the case, so completing twice is completing once.

use std::f64::consts::TAU;

use glam::{DVec2, DVec3};

use crate::transition_zone::{self, published_share};
use crate::validate::drop_repeated_corners;
use crate::{Approximation, Case, CaseRuleError, Contour, Slice, contour};

/// Radius of an approximated lumen at rest, mm. A resectoscope's sheath (8.0 to 8.7 mm wide) distends it later.
pub const LUMEN_RADIUS_MM: f64 = 2.5;
/// Most that the radius of an approximated lumen takes of the largest circle inside the capsule.
const LUMEN_SHARE: f64 = 0.4;
/// Share of the remaining room that must stay between an approximated lumen and the capsule ...
const WALL_SHARE: f64 = 0.3;
/// ... but never more than this, mm.
const WALL_MM: f64 = 3.0;
/// Corners of an approximated lumen.
const LUMEN_CORNERS: usize = 36;
/// Places tried along each side of the capsule's box when the wanted centre of a lumen has no room.
const SEARCH_STEPS: usize = 32;
/// Radius of the largest circle in the capsule below which no lumen is approximated, mm.
const LEAST_ROOM_MM: f64 = 0.2;

/// Share of the prostatic urethra that lies between bladder neck and verumontanum: 34 of 45 mm (uroluts abstract).
pub(crate) const NECK_TO_VERUMONTANUM: f64 = 34.0 / 45.0;
/// How far behind (+) or before (-) the middle of the gland the urethra runs at apex, verumontanum and base, as a share of
/// the gland's anterior-posterior size: it comes in central, is hindmost at the verumontanum, where it bends, and leaves
/// at the anterior side of the base.
const BEND: [(f64, f64); 3] = [(0.0, 0.0), (1.0 - NECK_TO_VERUMONTANUM, 0.04), (1.0, -0.2)];

/// How far the external sphincter's centre lies below the lowest slice, mm (practice).
const SPHINCTER_BELOW_APEX_MM: f64 = 5.0;
/// The trigone as an equilateral triangle with this side, mm, rising backwards at 45 degrees from the neck (practice).
const TRIGONE_SIDE_MM: f64 = 25.0;

const LUMEN_RULE: &str = "circle of 2.5 mm radius, less in small slices, on a line through the capsule's middle that bends \
                          at the verumontanum; moved to the nearest place with room where the wall would be thin";
const LUMEN_BETWEEN_RULE: &str = "circle of 2.5 mm radius, less in small slices, centred on the line between the nearest \
                                  drawn urethras, straight up or down beyond the last; moved to the nearest place with \
                                  room where the wall would be thin";
const LUMEN_ENDPOINT_RULE: &str = "circle of 2.5 mm radius, less in small slices, on a line through the capsule's middle \
                                   that bends at the verumontanum, shifted to pass the given end points; moved to the \
                                   nearest place with room where the wall would be thin";
const TRANSITION_ZONE_RULE: &str = "capsule scaled about the urethra from about the verumontanum up, to the published share of \
                                    the volume at this gland's size";
const NECK_RULE: &str = "centre of the urethra in the highest slice";
const VERUMONTANUM_RULE: &str = "on the posterior wall of the urethra, 34/45 of its length below the bladder neck";
const SPHINCTER_RULE: &str = "5 mm below the centre of the urethra in the lowest slice";
const ORIFICES_RULE: &str = "corners of an equilateral trigone of 25 mm that rises backwards at 45 degrees from the \
                             bladder neck";

/// Where the urethra leaves and enters the gland, where someone marked it, mm.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(crate) struct UrethraEnds {
    pub apex: Option<DVec3>,
    pub base: Option<DVec3>,
}

impl Case {
    /// Fills in what is missing and records each rule used in [`Case::approximated`]. What was given stays as it is, but
    /// for corners that repeat the one before (or the first, at the end), which are dropped.
    ///
    /// - **Urethra**, in each slice without one: a circle of [`LUMEN_RADIUS_MM`], at most 0.4 of the radius of the largest
    ///   circle inside the capsule. Where other slices have a drawn urethra, its centre lies on the line between the
    ///   nearest of them, straight up or down beyond the last. Where none has, it lies on a line fitted through the
    ///   capsule's centroids, displaced as the urethra bends at the verumontanum. Where the wall would be thinner than
    ///   3 mm, or than 0.3 of the room that there is, the centre moves to the place with
    ///   room that is nearest to it and to the centre one slice nearer to the widest.
    /// - **Landmarks**: bladder neck, the urethra's centre in the highest slice; verumontanum, on the posterior wall of the
    ///   urethra, 34/45 of its length below the neck; external sphincter, 5 mm below the urethra's centre in the lowest
    ///   slice; ureteral orifices, the corners of an equilateral trigone of 25 mm that rises backwards at 45 degrees.
    /// - **Transition zone**, only when no slice has one (who drew some slices left the others empty on purpose): the
    ///   capsule scaled about the urethra, growing from nothing a little below the verumontanum, at most 0.97 of the way to the
    ///   capsule, such that its share of the volume is the published one, or as near as that allows.
    ///
    /// # Errors
    ///
    /// The rule that the case breaks ([`Case::validate`]), or [`CaseRuleError::TooThin`] where a capsule leaves no room.
    pub fn complete(self) -> Result<Case, CaseRuleError> {
        self.complete_with(UrethraEnds::default())
    }

    pub(crate) fn complete_with(mut self, ends: UrethraEnds) -> Result<Case, CaseRuleError> {
        drop_repeated_corners(&mut self);
        self.validate()?;
        self.fill_in(ends)
    }

    /// Completes a case that has been checked.
    pub(crate) fn fill_in(mut self, ends: UrethraEnds) -> Result<Case, CaseRuleError> {
        self.complete_urethra(ends)?;
        self.complete_landmarks();
        self.complete_transition_zone();
        Ok(self)
    }

    fn complete_urethra(&mut self, ends: UrethraEnds) -> Result<(), CaseRuleError> {
        let drawn: Vec<DVec3> = self
            .slices
            .iter()
            .filter_map(|slice| Some(contour::centroid(slice.urethra.as_ref()?).extend(slice.z)))
            .collect();
        if drawn.len() == self.slices.len() {
            return Ok(());
        }
        let course = Course::of(&self.slices, ends);
        let rule = if !drawn.is_empty() {
            LUMEN_BETWEEN_RULE
        } else if ends != UrethraEnds::default() {
            LUMEN_ENDPOINT_RULE
        } else {
            LUMEN_RULE
        };
        let mut filled = Vec::new();
        // From the widest slice outwards: where a centre must move, it stays near that of the slice before.
        let area = |&index: &usize| contour::signed_area(&self.slices[index].capsule).abs();
        let count = self.slices.len();
        let widest = (0..count).max_by(|a, b| area(a).total_cmp(&area(b))).unwrap_or(0);
        let upwards = (widest..count).map(|index| (index, index.checked_sub(1).filter(|_| index > widest)));
        let downwards = (0..widest).rev().map(|index| (index, Some(index + 1)));
        for (index, before) in upwards.chain(downwards) {
            let slice = &self.slices[index];
            if slice.urethra.is_some() {
                continue;
            }
            let wanted = if drawn.is_empty() {
                course.at(slice.z)
            } else {
                interpolate(&drawn, slice.z)
            };
            let before = before
                .and_then(|before| self.slices[before].urethra.as_deref())
                .map(contour::centroid);
            self.slices[index].urethra = Some(lumen(index, &slice.capsule, wanted, before.unwrap_or(wanted))?);
            filled.push(index);
        }
        filled.sort_unstable();
        for index in filled {
            self.note(format!("slices[{index}].urethra"), rule);
        }
        Ok(())
    }

    fn complete_landmarks(&mut self) {
        let line = self.urethra_line();
        let (Some(&lowest), Some(&highest)) = (line.first(), line.last()) else {
            return;
        };
        if self.landmarks.bladder_neck.is_none() {
            self.landmarks.bladder_neck = Some(highest);
            self.note("landmarks.bladder_neck".into(), NECK_RULE);
        }
        let neck = self.landmarks.bladder_neck.unwrap_or(highest);
        if self.landmarks.verumontanum.is_none() {
            self.landmarks.verumontanum = Some(self.verumontanum_below(neck, &line));
            self.note("landmarks.verumontanum".into(), VERUMONTANUM_RULE);
        }
        if self.landmarks.external_sphincter.is_none() {
            self.landmarks.external_sphincter = Some(lowest - SPHINCTER_BELOW_APEX_MM * DVec3::Z);
            self.note("landmarks.external_sphincter".into(), SPHINCTER_RULE);
        }
        if self.landmarks.ureteral_orifices.is_none() {
            self.landmarks.ureteral_orifices = Some(trigone(neck));
            self.note("landmarks.ureteral_orifices".into(), ORIFICES_RULE);
        }
    }

    fn complete_transition_zone(&mut self) {
        if self.slices.iter().any(|slice| slice.transition_zone.is_some()) {
            return;
        }
        let Some(verumontanum) = self.landmarks.verumontanum else {
            return;
        };
        let share = published_share(self.slice_volume_mm3() / 1000.0);
        transition_zone::fill(&mut self.slices, verumontanum.z, share);
        let filled: Vec<usize> = (0..self.slices.len())
            .filter(|&index| self.slices[index].transition_zone.is_some())
            .collect();
        for index in filled {
            self.note(format!("slices[{index}].transition_zone"), TRANSITION_ZONE_RULE);
        }
    }

    /// Centres of the urethra by rising height, mm, where there is one.
    fn urethra_line(&self) -> Vec<DVec3> {
        let centre = |slice: &Slice| Some(contour::centroid(slice.urethra.as_ref()?).extend(slice.z));
        self.slices.iter().filter_map(centre).collect()
    }

    /// The place on the posterior wall of the lumen at 34/45 of the way along the urethra from `neck` to its lowest point.
    fn verumontanum_below(&self, neck: DVec3, line: &[DVec3]) -> DVec3 {
        let mut way: Vec<DVec3> = line.iter().copied().filter(|point| point.z < neck.z).collect();
        way.push(neck);
        let length: f64 = way.windows(2).map(|pair| pair[0].distance(pair[1])).sum();
        let mut left = (1.0 - NECK_TO_VERUMONTANUM) * length;
        let mut centre = way[0];
        for pair in way.windows(2) {
            let step = pair[0].distance(pair[1]);
            if left <= step && step > 0.0 {
                centre = pair[0].lerp(pair[1], left / step);
                break;
            }
            left -= step;
        }
        let wall: Vec<DVec3> = self
            .slices
            .iter()
            .filter_map(|slice| {
                let urethra = slice.urethra.as_ref()?;
                let depth = contour::bounds(urethra)[1].y - contour::centroid(urethra).y;
                Some(DVec3::new(0.0, depth, slice.z))
            })
            .collect();
        centre + DVec3::Y * interpolate(&wall, centre.z).y
    }

    /// Volume inside the capsule by the trapezium rule over the slices' areas, mm³.
    pub(crate) fn slice_volume_mm3(&self) -> f64 {
        self.slices
            .windows(2)
            .map(|pair| {
                let area = |slice: &Slice| contour::signed_area(&slice.capsule).abs();
                0.5 * (area(&pair[0]) + area(&pair[1])) * (pair[1].z - pair[0].z)
            })
            .sum()
    }

    pub(crate) fn note(&mut self, what: String, rule: &str) {
        self.approximated.push(Approximation {
            what,
            rule: rule.to_owned(),
        });
    }
}

/// The ureteral orifices above a bladder neck: left, right, mm.
pub(crate) fn trigone(neck: DVec3) -> [DVec3; 2] {
    let height = TRIGONE_SIDE_MM * 0.75_f64.sqrt();
    let behind = neck + height * DVec3::new(0.0, 0.5_f64.sqrt(), 0.5_f64.sqrt());
    [
        behind + 0.5 * TRIGONE_SIDE_MM * DVec3::X,
        behind - 0.5 * TRIGONE_SIDE_MM * DVec3::X,
    ]
}

/// A convex lumen strictly inside the capsule, as near to the wanted centre, and to that of the slice before, as the wall
/// allows.
fn lumen(slice: usize, capsule: &[DVec2], wanted: DVec2, before: DVec2) -> Result<Contour, CaseRuleError> {
    let room = contour::inscribed(capsule);
    if room.radius_mm < LEAST_ROOM_MM {
        return Err(CaseRuleError::TooThin {
            slice,
            radius_mm: room.radius_mm,
            least_mm: LEAST_ROOM_MM,
        });
    }
    let radius = LUMEN_RADIUS_MM.min(LUMEN_SHARE * room.radius_mm);
    let needed = radius + WALL_MM.min(WALL_SHARE * (room.radius_mm - radius));
    let centre = nearest_clear(capsule, wanted, before, needed).unwrap_or(room.centre);
    Ok(ellipse(centre, DVec2::splat(radius)))
}

/// The wanted place if it keeps a distance from the capsule; else, of a grid over the capsule's box, the place that does
/// and is nearest to the wanted one and to that of the slice before, taken together.
fn nearest_clear(capsule: &[DVec2], wanted: DVec2, before: DVec2, clearance_mm: f64) -> Option<DVec2> {
    let clear = |point: &DVec2| contour::clearance(capsule, *point) >= clearance_mm;
    if clear(&wanted) {
        return Some(wanted);
    }
    let [low, high] = contour::bounds(capsule);
    let mut places: Vec<DVec2> = (0..SEARCH_STEPS * SEARCH_STEPS)
        .map(|place| DVec2::new((place % SEARCH_STEPS) as f64, (place / SEARCH_STEPS) as f64) + 0.5)
        .map(|cell| low + (high - low) * cell / SEARCH_STEPS as f64)
        .collect();
    let way = |place: &DVec2| place.distance(wanted) + place.distance(before);
    places.sort_by(|a, b| way(a).total_cmp(&way(b)));
    places.into_iter().find(clear)
}

/// An ellipse of the corners that every approximated lumen has, rounded to a micrometre.
pub(crate) fn ellipse(centre: DVec2, radii: DVec2) -> Contour {
    (0..LUMEN_CORNERS)
        .map(|corner| centre + radii * DVec2::from_angle(TAU * corner as f64 / LUMEN_CORNERS as f64))
        .map(round)
        .collect()
}

/// Rounded to a micrometre, so that files stay readable and a written case reads back as it was.
pub(crate) fn round(point: DVec2) -> DVec2 {
    // The sum turns -0 into 0.
    (point * 1000.0).round() / 1000.0 + DVec2::ZERO
}

/// Linear interpolation of points by their rising z; the first and last hold beyond the ends.
fn interpolate(points: &[DVec3], z: f64) -> DVec2 {
    let above = points.partition_point(|point| point.z < z);
    match (points.get(above.wrapping_sub(1)), points.get(above)) {
        (Some(low), Some(high)) => low.truncate().lerp(high.truncate(), (z - low.z) / (high.z - low.z)),
        (Some(end), None) | (None, Some(end)) => end.truncate(),
        (None, None) => DVec2::ZERO,
    }
}

/// The course of a urethra that nobody drew.
struct Course {
    bottom: f64,
    height: f64,
    /// Centre of the gland at `bottom`, and how it moves a mm of height.
    centre: DVec2,
    slope: DVec2,
    depth_mm: f64,
    /// Displacements by height that lead through the marked ends.
    shifts: Vec<DVec3>,
}

impl Course {
    fn of(slices: &[Slice], ends: UrethraEnds) -> Course {
        // Least squares with the slices' areas as weights: small irregular end slices hardly count.
        let (mut weight, mut depth, mut mean, mut mean_z) = (0.0, 0.0, DVec2::ZERO, 0.0);
        let measured: Vec<(f64, f64, DVec2)> = slices
            .iter()
            .map(|slice| {
                (
                    contour::signed_area(&slice.capsule).abs(),
                    slice.z,
                    contour::centroid(&slice.capsule),
                )
            })
            .collect();
        for (slice, &(area, z, centroid)) in slices.iter().zip(&measured) {
            let [low, high] = contour::bounds(&slice.capsule);
            weight += area;
            depth += area * (high.y - low.y);
            mean += area * centroid;
            mean_z += area * z;
        }
        (depth, mean, mean_z) = (depth / weight, mean / weight, mean_z / weight);
        let (mut spread, mut along) = (0.0, DVec2::ZERO);
        for &(area, z, centroid) in &measured {
            spread += area * (z - mean_z).powi(2);
            along += area * (z - mean_z) * (centroid - mean);
        }
        let slope = if spread > 0.0 { along / spread } else { DVec2::ZERO };
        let (bottom, top) = (slices[0].z, slices[slices.len() - 1].z);
        let mut course = Course {
            bottom,
            height: top - bottom,
            centre: mean + slope * (bottom - mean_z),
            slope,
            depth_mm: depth,
            shifts: Vec::new(),
        };
        let shift = |end: DVec3| (end.truncate() - course.at(end.z)).extend(end.z);
        let mut shifts: Vec<DVec3> = ends.apex.into_iter().chain(ends.base).map(shift).collect();
        shifts.sort_by(|one, other| one.z.total_cmp(&other.z));
        course.shifts = shifts;
        course
    }

    fn at(&self, z: f64) -> DVec2 {
        let bend = BEND.map(|(height, displacement)| DVec3::new(0.0, displacement * self.depth_mm, height));
        let straight = self.centre + self.slope * (z - self.bottom);
        straight + interpolate(&bend, (z - self.bottom) / self.height) + interpolate(&self.shifts, z)
    }
}
