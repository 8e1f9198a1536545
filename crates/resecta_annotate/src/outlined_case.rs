//! The case made of outlines in a stack.

use glam::DVec2;
use resecta_anatomy::{Case, CaseRuleError, CaseSource, Contour, LUMEN_RADIUS_MM, Landmarks, Slice, Unit, contour};

use crate::stack::note;
use crate::{Flag, Stack};

/// A hundredth of a millimetre is more than an outline knows.
const ROUNDING: f64 = 100.0;
/// Least radius of the lumen about a place that was marked, mm: nearer to the capsule than twice this it is no urethra, which
/// the rules of cases tell.
const LEAST_LUMEN_MM: f64 = 0.5;
/// Corners of that lumen.
const LUMEN_CORNERS: usize = 36;

/// One outline on its way into a case.
pub(crate) struct CaseSlice<'a> {
    /// Height, mm.
    pub z_mm: f64,
    /// Corners, mm.
    pub capsule: &'a [DVec2],
    /// What is to be noted of it; nothing where somebody drew it.
    pub rule: Option<String>,
    /// Where the urethra passes, mm, where that is known.
    pub urethra: Option<DVec2>,
}

/// The case of outlines by rising height; what they do not say by the rules of [`Case::complete`].
pub(crate) fn case_of<'a>(
    outlines: impl Iterator<Item = CaseSlice<'a>>,
    stack: &Stack,
    name: &str,
    source: CaseSource,
) -> Result<Case, CaseRuleError> {
    let mut approximated = stack.notes.clone();
    let slices = outlines.enumerate().map(|(index, outline)| {
        approximated.extend(outline.rule.map(|rule| note(format!("slices[{index}].capsule"), rule)));
        Slice {
            z: outline.z_mm,
            capsule: outline.capsule.iter().map(round).collect(),
            urethra: outline.urethra.map(|place| lumen(outline.capsule, place)),
            transition_zone: None,
        }
    });
    let slices = slices.collect();
    Case {
        name: name.to_owned(),
        source,
        unit: Unit::Millimetre,
        material: "palpation_5hz".into(),
        landmarks: Landmarks::default(),
        approximated,
        slices,
    }
    .complete()
}

/// What is noted of an outline that a search found.
pub(crate) fn found_rule(image: usize, error_mm: f64, flags: &[Flag]) -> String {
    let mut rule =
        format!("found in image {image} by the point distribution model; mean error expected {error_mm:.1} mm");
    for flag in flags {
        rule.push_str(&format!("; {flag}"));
    }
    rule
}

/// What a note of [`found_rule`] says: error in mm, and flags. None of any other note.
pub(crate) fn read_found_rule(rule: &str) -> Option<(f64, Vec<Flag>)> {
    let mut parts = rule.split("; ");
    parts.next()?.strip_prefix("found in image ")?;
    let error_mm = parts
        .next()?
        .strip_prefix("mean error expected ")?
        .strip_suffix(" mm")?;
    let flag = |part: &str| {
        [Flag::PoorFit, Flag::Unusual]
            .into_iter()
            .find(|flag| flag.to_string() == part)
            .or_else(|| {
                let share: f64 = part.split(' ').next()?.parse().ok()?;
                Some(Flag::LeavesImage { share: share / 100.0 })
            })
            // What is not understood is to be looked at.
            .unwrap_or(Flag::PoorFit)
    };
    Some((error_mm.parse().ok()?, parts.map(flag).collect()))
}

fn lumen(capsule: &[DVec2], centre: DVec2) -> Contour {
    let radius = (0.5 * contour::clearance(capsule, centre)).clamp(LEAST_LUMEN_MM, LUMEN_RADIUS_MM);
    let corner =
        |index: usize| centre + radius * DVec2::from_angle(std::f64::consts::TAU * index as f64 / LUMEN_CORNERS as f64);
    (0..LUMEN_CORNERS).map(|index| round(&corner(index))).collect()
}

fn round(place: &DVec2) -> DVec2 {
    // The sum turns -0 into 0.
    (*place * ROUNDING).round() / ROUNDING + DVec2::ZERO
}
