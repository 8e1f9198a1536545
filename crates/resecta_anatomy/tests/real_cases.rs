//! Real outlines: every one is imported, completed, and written and read without loss.

mod common;

use std::path::Path;

use glam::DVec2;
use resecta_anatomy::import::{MaskOptions, contours_json, import, nifti_mask};
use resecta_anatomy::{Case, Slice, contour};

/// Spacing of the ultrasound labels; their headers state a quarter of it.
const TRUS: MaskOptions = MaskOptions {
    spacing_mm: Some([1.6; 3]),
    channel: 0,
    endpoint_channels: Some([1, 2]),
    axes: resecta_anatomy::import::Axes::PLS,
};

fn check_complete(case: &Case, file: &Path) {
    case.validate().unwrap();
    for (index, slice) in case.slices.iter().enumerate() {
        let urethra = slice.urethra.as_ref().unwrap();
        let clearance = urethra
            .iter()
            .map(|&corner| contour::clearance(&slice.capsule, corner))
            .fold(f64::MAX, f64::min);
        assert!(clearance > 0.05, "{} slice {index}: {clearance}", file.display());
    }
    assert!(case.slices.iter().any(|slice| slice.transition_zone.is_some()));
    let landmarks = &case.landmarks;
    let verumontanum = landmarks.verumontanum.unwrap();
    let sphincter = landmarks.external_sphincter.unwrap();
    assert!(sphincter.z < verumontanum.z && verumontanum.z < landmarks.bladder_neck.unwrap().z);
    assert_eq!(
        &case.clone().complete().unwrap(),
        case,
        "completing twice is completing once"
    );
    assert_eq!(
        &Case::from_ron(&case.to_ron(), file).unwrap(),
        case,
        "what is written reads back"
    );
}

#[test]
fn every_contour_file_and_label_becomes_a_complete_case() {
    let Some(cases) = common::shared_cases() else { return };
    let mut files = common::files(&cases, ".contours.json");
    files.extend(common::files(&cases.join("trus-volumes/labels"), ".nii.gz"));
    assert!(files.len() > 40);
    for file in files {
        let case = import(&file, &TRUS).unwrap_or_else(|error| panic!("{error}"));
        check_complete(&case, &file);
    }
}

#[test]
fn a_label_gives_the_same_slices_as_its_contour_file() {
    let Some(cases) = common::shared_cases() else { return };
    for name in ["case000009", "case000014", "case000026"] {
        let ours = nifti_mask(&cases.join(format!("trus-volumes/labels/{name}.nii.gz")), &TRUS).unwrap();
        let theirs = contours_json(&cases.join(format!("trus-volumes/contours/{name}.contours.json"))).unwrap();
        let area = |slice: &Slice| contour::signed_area(&slice.capsule).abs();
        let mut compared = 0;
        for slice in &theirs.slices {
            let Some(same) = ours.slices.iter().find(|other| (other.z - slice.z).abs() < 0.01) else {
                continue;
            };
            compared += 1;
            let apart = contour::centroid(&same.capsule).distance(contour::centroid(&slice.capsule));
            assert!(apart < 1.0, "{name} at {}: centroids {apart} mm apart", slice.z);
            // The contour files were cut from a smoothed mask, which shrinks the smallest slices.
            assert!(
                (area(same) - area(slice)).abs() < 0.03 * area(slice) + 16.0,
                "{name} at {}",
                slice.z
            );
        }
        assert!(compared + 2 >= theirs.slices.len());
        let neck = |case: &Case| case.landmarks.bladder_neck.unwrap().truncate();
        assert!(neck(&ours).distance(neck(&theirs)) < 2.5);
    }
}

#[test]
fn a_drawn_urethra_stays_and_one_that_touches_the_capsule_is_pulled_inside() {
    let Some(cases) = common::shared_cases() else { return };
    let file = cases.join("visible-human/VH_M.contours.json");
    let case = contours_json(&file).unwrap();
    let raw: serde_json::Value = serde_json::from_slice(&std::fs::read(&file).unwrap()).unwrap();
    let (mut kept, mut pulled) = (0, 0);
    for (index, slice) in case.slices.iter().enumerate() {
        let drawn: Option<Vec<DVec2>> = serde_json::from_value(raw["slices"][index]["urethra"].clone()).unwrap();
        let noted = case
            .approximated
            .iter()
            .any(|note| note.what == format!("slices[{index}].urethra"));
        assert_eq!(drawn.as_ref() == slice.urethra.as_ref(), !noted, "slice {index}");
        if let Some(drawn) = drawn {
            kept += usize::from(!noted);
            pulled += usize::from(noted);
            let ours = contour::centroid(slice.urethra.as_ref().unwrap());
            assert!(ours.distance(contour::centroid(&drawn)) < 1.5, "slice {index}");
        }
    }
    assert_eq!(kept + pulled, 21);
    assert!(kept >= 13 && pulled > 0, "{kept} kept, {pulled} pulled inside");
    assert_eq!(case.source.licence, "CC BY 4.0");
}
