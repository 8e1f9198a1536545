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
    /// Its lumen, mm, where that was drawn; what reaches beyond the capsule is not taken.
    pub lumen: Option<&'a Contour>,
    /// The same of the transition zone.
    pub transition_zone: Option<&'a Contour>,
}

/// What a case says beside its slices, where it was not filled in by rule.
#[derive(Debug, Clone, PartialEq, Default)]
pub(crate) struct Beside {
    pub landmarks: Landmarks,
    pub material: Option<String>,
}

impl Beside {
    /// What a case says that no rule filled in.
    pub fn of(case: &Case) -> Beside {
        let known = &case.landmarks;
        Beside {
            landmarks: Landmarks {
                bladder_neck: known.bladder_neck.filter(|_| is_drawn(case, "landmarks.bladder_neck")),
                verumontanum: known.verumontanum.filter(|_| is_drawn(case, "landmarks.verumontanum")),
                external_sphincter: (known.external_sphincter)
                    .filter(|_| is_drawn(case, "landmarks.external_sphincter")),
                ureteral_orifices: (known.ureteral_orifices).filter(|_| is_drawn(case, "landmarks.ureteral_orifices")),
            },
            material: Some(case.material.clone()),
        }
    }
}

/// Whether no rule filled in a field of a case.
pub(crate) fn is_drawn(case: &Case, what: &str) -> bool {
    !case.approximated.iter().any(|note| note.what == what)
}

const LEFT_OUT_RULE: &str = "left out: it reached beyond the capsule that was mended";

/// The case of outlines by rising height; what they do not say by the rules of [`Case::complete`].
pub(crate) fn case_of<'a>(
    outlines: impl Iterator<Item = CaseSlice<'a>>,
    beside: &Beside,
    stack: &Stack,
    name: &str,
    source: CaseSource,
) -> Result<Case, CaseRuleError> {
    let mut approximated = stack.notes.clone();
    let slices = outlines.enumerate().map(|(index, outline)| {
        approximated.extend(outline.rule.map(|rule| note(format!("slices[{index}].capsule"), rule)));
        let capsule = outline.capsule;
        let is_inside = |drawn: &&Contour| drawn.iter().all(|place| contour::contains(capsule, *place));
        let zone = outline.transition_zone.filter(is_inside);
        if outline.transition_zone.is_some() && zone.is_none() {
            approximated.push(note(format!("slices[{index}].transition_zone"), LEFT_OUT_RULE));
        }
        let drawn = outline.lumen.filter(is_inside).cloned();
        Slice {
            z: outline.z_mm,
            capsule: capsule.iter().map(round).collect(),
            urethra: drawn.or_else(|| Some(lumen(capsule, outline.urethra?))),
            transition_zone: zone.cloned(),
        }
    });
    let slices = slices.collect();
    Case {
        name: name.to_owned(),
        source,
        unit: Unit::Millimetre,
        material: (beside.material.clone()).unwrap_or_else(|| Case::DEFAULT_MATERIAL.into()),
        landmarks: beside.landmarks.clone(),
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn notes_are_read_as_they_are_written() {
        let flags = vec![Flag::LeavesImage { share: 0.25 }, Flag::PoorFit, Flag::Unusual];
        assert_eq!(read_found_rule(&found_rule(3, 2.5, &flags)), Some((2.5, flags)));
        assert_eq!(read_found_rule(&found_rule(3, 0.4, &[])), Some((0.4, Vec::new())));
        assert_eq!(read_found_rule("copied from that of image 2"), None);
    }
}
