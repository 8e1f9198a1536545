//! Contour files: JSON with the slices' contours in mm.
//!
//! `{"unit":"mm","slices":[{"z":_,"capsule":[[x,y],..],"urethra":[[x,y],..]|null,"transition_zone":[[x,y],..]|null}]}`,
//! optionally with `name`, `source`, `licence` and `urethra_endpoints` (`apex_point_xyz`, `base_point_xyz`). Other keys
//! are for people and are passed over.

use std::f64::consts::TAU;
use std::path::Path;

use glam::{DVec2, DVec3};
use serde::Deserialize;

use super::{ImportError, read, stem};
use crate::case_file::MAX_FILE_BYTES;
use crate::complete::{UrethraEnds, round};
use crate::validate::drop_repeated_corners;
use crate::{Case, CaseRuleError, CaseSource, Contour, Landmarks, Slice, Unit, contour};

#[derive(Deserialize)]
struct ContourFile {
    unit: Unit,
    #[serde(default)]
    name: Option<String>,
    #[serde(default)]
    source: Option<String>,
    #[serde(default)]
    licence: Option<String>,
    #[serde(default)]
    urethra_endpoints: Option<Endpoints>,
    slices: Vec<FileSlice>,
}

#[derive(Deserialize)]
struct Endpoints {
    #[serde(default)]
    apex_point_xyz: Option<DVec3>,
    #[serde(default)]
    base_point_xyz: Option<DVec3>,
}

#[derive(Deserialize)]
struct FileSlice {
    z: f64,
    capsule: Contour,
    #[serde(default)]
    urethra: Option<Contour>,
    #[serde(default)]
    transition_zone: Option<Contour>,
    /// All contours of a zone drawn as several; `transition_zone` then is the largest of them.
    #[serde(default)]
    transition_zone_parts: Vec<Contour>,
}

/// A drawn urethra may reach this far over the capsule and still be taken to lie inside, mm: two outlines cut from one mask
/// share an edge where the lumen leaves the gland.
const SHARED_EDGE_MM: f64 = 0.5;
/// Wall put back between such a urethra and the capsule: this share of the way from the centre, at most one millimetre.
const WALL_SHARE: f64 = 0.3;
/// See [`WALL_SHARE`].
const WALL_MM: f64 = 1.0;
/// Rays on which it is drawn anew.
const RAYS: usize = 36;

const SHARED_EDGE_RULE: &str = "the drawn contour touches the capsule; drawn anew along rays from its centre, at least 1 mm \
                                or 0.3 of the way inside the capsule";
const PARTS_RULE: &str = "the source drew several parts; this is their convex hull";

/// Makes a case from a contour file.
///
/// A urethra that touches the capsule, or lies over it by up to 0.5 mm, is pulled inside; a transition zone drawn as several
/// parts (two lobes beside the urethra) becomes their convex hull; marked end points of the urethra guide its
/// approximation. All of it is recorded in [`Case::approximated`].
///
/// # Errors
///
/// [`ImportError::Read`], [`ImportError::TooLarge`], [`ImportError::Syntax`], [`ImportError::Rule`].
pub fn contours_json(path: &Path) -> Result<Case, ImportError> {
    let bytes = read(path, MAX_FILE_BYTES)?;
    contours_json_str(&String::from_utf8_lossy(&bytes), path)
}

/// As [`contours_json`], from text; `file` is named in errors.
///
/// # Errors
///
/// [`ImportError::Syntax`] or [`ImportError::Rule`].
pub fn contours_json_str(text: &str, file: &Path) -> Result<Case, ImportError> {
    let mut deserializer = serde_json::Deserializer::from_str(text);
    let parsed: ContourFile = serde_path_to_error::deserialize(&mut deserializer)
        .map_err(|error| (error.path().to_string(), error.into_inner()))
        .and_then(|parsed| {
            deserializer
                .end()
                .map(|()| parsed)
                .map_err(|error| (".".to_owned(), error))
        })
        .map_err(|(path, error)| ImportError::Syntax {
            file: file.into(),
            line: error.line(),
            column: error.column(),
            field: if path == "." { "file".to_owned() } else { path },
            message: error.to_string(),
        })?;
    let rule = |rule| ImportError::Rule {
        file: file.into(),
        rule,
    };
    let ends = parsed
        .urethra_endpoints
        .as_ref()
        .map_or_else(UrethraEnds::default, |ends| UrethraEnds {
            apex: ends.apex_point_xyz,
            base: ends.base_point_xyz,
        });
    let parts: Vec<usize> = (0..parsed.slices.len())
        .filter(|&index| parsed.slices[index].transition_zone_parts.len() > 1)
        .collect();
    let mut case = Case {
        name: parsed.name.unwrap_or_else(|| stem(file)),
        source: CaseSource {
            description: parsed.source.unwrap_or_else(|| "unknown".into()),
            licence: parsed.licence.unwrap_or_else(|| "unknown".into()),
        },
        unit: parsed.unit,
        material: Case::DEFAULT_MATERIAL.into(),
        landmarks: Landmarks::default(),
        approximated: Vec::new(),
        slices: parsed
            .slices
            .into_iter()
            .map(
                |FileSlice {
                     z,
                     capsule,
                     urethra,
                     transition_zone,
                     transition_zone_parts: parts,
                 }| {
                    let transition_zone = if parts.len() > 1 {
                        Some(convex_hull(parts.concat()))
                    } else {
                        transition_zone
                    };
                    Slice {
                        z,
                        capsule,
                        urethra,
                        transition_zone,
                    }
                },
            )
            .collect(),
    };
    for index in parts {
        case.note(format!("slices[{index}].transition_zone"), PARTS_RULE);
    }
    drop_repeated_corners(&mut case);
    pull_urethras_inside(&mut case).map_err(rule)?;
    case.complete_with(ends).map_err(rule)
}

/// The convex hull of some points, counter-clockwise (Andrew's monotone chain).
fn convex_hull(mut points: Vec<DVec2>) -> Contour {
    points.sort_by(|a, b| a.x.total_cmp(&b.x).then(a.y.total_cmp(&b.y)));
    let chain = |points: &mut dyn Iterator<Item = DVec2>| {
        let mut hull: Contour = Vec::new();
        for point in points {
            while let [.., a, b] = hull[..]
                && (b - a).perp_dot(point - b) <= 0.0
            {
                hull.pop();
            }
            hull.push(point);
        }
        hull.pop();
        hull
    };
    let mut hull = chain(&mut points.iter().copied());
    hull.extend(chain(&mut points.iter().rev().copied()));
    hull
}

/// Redraws each urethra that merely touches the capsule; stops at the first other broken rule.
fn pull_urethras_inside(case: &mut Case) -> Result<(), CaseRuleError> {
    let mut redrawn = None;
    loop {
        let slice = match case.validate() {
            Ok(()) => return Ok(()),
            // Slices are checked in order: the same one twice means that drawing anew did not help.
            Err(CaseRuleError::UrethraOutside { slice, .. }) if redrawn.is_none_or(|last| last < slice) => slice,
            Err(rule) => return Err(rule),
        };
        let Slice { capsule, urethra, .. } = &mut case.slices[slice];
        let inside = urethra.as_ref().and_then(|urethra| redraw(urethra, capsule));
        if inside.is_some() {
            *urethra = inside;
            case.note(format!("slices[{slice}].urethra"), SHARED_EDGE_RULE);
        }
        redrawn = Some(slice);
    }
}

fn redraw(urethra: &[DVec2], capsule: &[DVec2]) -> Option<Contour> {
    if urethra
        .iter()
        .any(|&corner| contour::clearance(capsule, corner) < -SHARED_EDGE_MM)
    {
        return None;
    }
    let centroid = contour::centroid(urethra);
    let centre = if contour::contains(urethra, centroid) {
        centroid
    } else {
        contour::inscribed(urethra).centre
    };
    (0..RAYS)
        .map(|ray| {
            let direction = DVec2::from_angle(TAU * ray as f64 / RAYS as f64);
            let lumen = contour::ray(urethra, centre, direction)?;
            let wall = contour::ray(capsule, centre, direction)?;
            Some(round(
                centre + direction * lumen.min(wall - WALL_MM.min(WALL_SHARE * wall)),
            ))
        })
        .collect()
}
