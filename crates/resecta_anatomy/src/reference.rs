//! A gland by formula that gives the lattice of the papers' example: 10,800 nodes.
//!
//! It is no anatomy. Tests, benchmarks and examples use it where the size of the work must be known and every number
//! follows from a formula; `assets/cases/paper.case.ron` holds the same case as a file.

use std::f64::consts::{PI, TAU};

use glam::{DVec2, DVec3};

use crate::{Case, CaseSource, Contour, Landmarks, Slice, Unit};

/// Slices 5 mm apart, as in the papers.
const SLICES: usize = 7;
const SPACING_MM: f64 = 5.0;
/// Corners of every contour.
const CORNERS: usize = 45;
/// Half the width and half the depth of the widest section.
const HALF_WIDTH_MM: f64 = 26.0;
const HALF_DEPTH_MM: f64 = 20.5;
/// Radius of the lumen.
const LUMEN_MM: f64 = 2.7;
/// Where along the axis the urethra passes the verumontanum, and how far posterior it runs there.
const VERUMONTANUM_Z_MM: f64 = 10.0;
const BEND_MM: f64 = 2.0;

/// The case that yields 45 angles x 20 slices x 12 layers = 10,800 nodes (Padilla and Arámbula, figure 8: "a prostate
/// model with 10800 nodes") at `alpha` = 8 degrees, with 30,960 springs to axis neighbours.
///
/// Sections are ellipses, widest a little above the middle and rounded at both ends; the posterior side is flattened. The
/// lumen is a circle whose centre bends to posterior at the verumontanum. The transition zone is the capsule shrunk to
/// 0.7 above the verumontanum.
pub fn paper_case() -> Case {
    let height = SPACING_MM * (SLICES - 1) as f64;
    let slices = (0..SLICES).map(|i| {
        let z = SPACING_MM * i as f64;
        // From 0.73 at the apex to 1 above the middle and back.
        let swell = 0.73 + 0.27 * (PI * (z / height).powf(1.15)).sin();
        let capsule = contour(|angle| {
            let flattened = if angle.sin() > 0.0 { 0.9 } else { 1.0 };
            DVec2::new(HALF_WIDTH_MM * angle.cos(), HALF_DEPTH_MM * flattened * angle.sin()) * swell
        });
        let middle = urethra_centre(z);
        let zone = capsule
            .iter()
            .map(|&corner| rounded(middle + (corner - middle) * 0.7))
            .collect();
        Slice {
            z,
            urethra: Some(contour(|angle| middle + DVec2::from_angle(angle) * LUMEN_MM)),
            transition_zone: (z > VERUMONTANUM_Z_MM).then_some(zone),
            capsule,
        }
    });
    let on_axis = |z: f64| urethra_centre(z).extend(z);
    Case {
        name: "The papers' size: 10,800 nodes at 8 degrees".into(),
        source: CaseSource {
            description: "Made by formula (resecta_anatomy::reference), not measured".into(),
            licence: "MIT OR Apache-2.0".into(),
        },
        unit: Unit::Millimetre,
        material: Case::DEFAULT_MATERIAL.into(),
        landmarks: Landmarks {
            bladder_neck: Some(on_axis(height)),
            verumontanum: Some(on_axis(VERUMONTANUM_Z_MM) + DVec3::Y * LUMEN_MM),
            external_sphincter: Some(on_axis(-5.0)),
            ureteral_orifices: Some([
                DVec3::new(12.0, 20.0, height + 20.0),
                DVec3::new(-12.0, 20.0, height + 20.0),
            ]),
        },
        approximated: Vec::new(),
        slices: slices.collect(),
    }
}

/// The urethra runs anterior of the middle and bends to posterior at the verumontanum.
fn urethra_centre(z: f64) -> DVec2 {
    DVec2::new(0.0, BEND_MM - 0.15 * (z - VERUMONTANUM_Z_MM).abs())
}

fn contour(place: impl Fn(f64) -> DVec2) -> Contour {
    (0..CORNERS)
        .map(|corner| rounded(place(TAU * corner as f64 / CORNERS as f64)))
        .collect()
}

/// To a thousandth of a millimetre: the file stays readable, and does not hang on the last digits of a sine.
fn rounded(point: DVec2) -> DVec2 {
    (point * 1000.0).round() / 1000.0
}
