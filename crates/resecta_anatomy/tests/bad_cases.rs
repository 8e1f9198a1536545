//! Bad files: each error names the file, the slice and the rule.

use std::f64::consts::TAU;
use std::path::Path;

use glam::{DVec2, DVec3};
use resecta_anatomy::generate::{GlandSpec, generate};
use resecta_anatomy::import::{Axes, MaskOptions, contours_json_str, import, nifti_mask_bytes};
use resecta_anatomy::{Case, Contour};

const FILE: &str = "cases/mine.case.ron";

fn good() -> Case {
    generate(&GlandSpec {
        volume_ml: 40.0,
        median_lobe_mm: 5.0,
        seed: 3,
    })
    .unwrap()
}

/// A capsule of three slices and nothing else, as many bring it.
fn bare(capsule: impl Fn(usize) -> Contour) -> Case {
    let mut case = good();
    case.slices.truncate(3);
    case.landmarks = Default::default();
    for (index, slice) in case.slices.iter_mut().enumerate() {
        slice.capsule = capsule(index);
        (slice.urethra, slice.transition_zone) = (None, None);
    }
    case
}

fn circle(radius: f64, corners: usize) -> Contour {
    (0..corners)
        .map(|corner| radius * DVec2::from_angle(TAU * corner as f64 / corners as f64))
        .collect()
}

/// Writes the spoilt case as text, reads it, and asks its error for every part.
fn assert_refused(spoil: impl Fn(&mut Case), parts: &[&str]) {
    let mut case = good();
    spoil(&mut case);
    assert_text_refused(&case.to_ron(), parts);
}

fn assert_text_refused(text: &str, parts: &[&str]) {
    let error = Case::from_ron(text, Path::new(FILE)).unwrap_err().to_string();
    println!("{error}");
    for part in [FILE].iter().chain(parts) {
        assert!(error.contains(part), "{part:?} is not in {error:?}");
    }
}

#[test]
fn fewer_than_three_slices() {
    assert_refused(|case| case.slices.truncate(2), &["slices", "has 2", "at least 3"]);
}

#[test]
fn an_empty_contour() {
    assert_refused(
        |case| case.slices[4].capsule.clear(),
        &["slices[4].capsule", "empty", "at least 3"],
    );
    assert_refused(
        |case| case.slices[4].urethra = Some(vec![DVec2::ONE; 5]),
        &["slices[4].urethra", "empty", "1 distinct"],
    );
}

#[test]
fn an_open_contour() {
    assert_refused(
        |case| case.slices[2].capsule.truncate(58),
        &["slices[2].capsule", "open", "closed contour"],
    );
}

#[test]
fn a_self_crossing_contour() {
    assert_refused(
        |case| case.slices[5].capsule.swap(10, 14),
        &["slices[5].capsule", "crosses itself", "edges"],
    );
}

#[test]
fn a_coordinate_that_is_no_number() {
    assert_refused(
        |case| case.slices[1].capsule[7].x = f64::NAN,
        &["slices[1].capsule", "corner 7", "NaN", "finite"],
    );
    assert_refused(
        |case| case.slices[1].capsule[7].y = f64::INFINITY,
        &["slices[1].capsule", "corner 7", "inf"],
    );
    assert_refused(|case| case.slices[3].z = f64::NAN, &["slices[3].z", "NaN", "finite"]);
}

#[test]
fn a_coordinate_beyond_ten_metres() {
    assert_refused(
        |case| case.slices[1].capsule[7].x = 1e9,
        &["slices[1].capsule", "corner 7", "10000"],
    );
}

#[test]
fn heights_out_of_order_or_repeated() {
    assert_refused(|case| case.slices.swap(3, 4), &["slices[4].z", "lies below", "rise"]);
    assert_refused(
        |case| case.slices[4].z = case.slices[3].z,
        &["slices[4].z", "repeats", "rise"],
    );
}

#[test]
fn a_urethra_outside_the_capsule() {
    let shift = |case: &mut Case, x: f64| {
        for corner in case.slices[3].urethra.iter_mut().flatten() {
            corner.x += x;
        }
    };
    assert_refused(|case| shift(case, 100.0), &["slices[3].urethra", "outside the capsule"]);
    assert_refused(
        |case| shift(case, case.slices[3].capsule[0].x),
        &["slices[3].urethra", "outside the capsule"],
    );
}

#[test]
fn a_transition_zone_outside_the_capsule() {
    assert_refused(
        |case| case.slices[5].transition_zone = Some(circle(60.0, 40)),
        &["slices[5].transition_zone", "outside the capsule", "at most 1 mm"],
    );
}

#[test]
fn a_landmark_that_is_nowhere() {
    assert_refused(
        |case| case.landmarks.verumontanum = Some(DVec3::new(0.0, f64::NAN, 2.0)),
        &["landmarks.verumontanum", "NaN", "finite"],
    );
}

#[test]
fn a_capsule_without_room_for_a_urethra() {
    let sliver = |_| {
        [(0.0, 0.0), (40.0, 0.0), (40.0, 0.1), (0.0, 0.1)]
            .map(DVec2::from)
            .to_vec()
    };
    let text = bare(sliver).to_ron();
    assert_text_refused(&text, &["slices[", "capsule", "too thin"]);
}

#[test]
fn absurdly_many_corners_or_slices() {
    assert_refused(
        |case| case.slices[0].capsule = circle(10.0, 10_001),
        &["slices[0].capsule", "10001", "at most 10000"],
    );
    let mut case = bare(|_| circle(10.0, 3));
    case.slices = vec![case.slices[0].clone(); 2001];
    assert_text_refused(&case.to_ron(), &["2001 slices", "at most 2000"]);
}

#[test]
fn wrong_text_is_pointed_at() {
    let text = good().to_ron();
    assert_text_refused(&text.replacen("unit: mm", "unit: cm", 1), &[":7:", "unit", "cm", "mm"]);
    assert_text_refused(&text.replacen("z: 5.0", "height: 5.0", 1), &["slices[1]", "height"]);
    assert_text_refused(
        &text.replacen("z: 5.0", "z: \"5\"", 1),
        &["slices[1].z", "expected a number, found `\"5\"`"],
    );
    assert_text_refused(&text.replacen("unit: mm,", "", 1), &["unit", "missing"]);
    assert_text_refused(&text.replacen("slices: [", "slices: ", 1), &["slices"]);
    assert_text_refused(&format!("{text} 7"), &["nothing more", "`7`"]);
    assert_text_refused("", &[":1:1"]);
}

#[test]
fn a_missing_file_is_named() {
    let error = Case::load(Path::new("no/such.case.ron")).unwrap_err().to_string();
    assert!(error.starts_with("no/such.case.ron: cannot be read"), "{error}");
}

#[test]
fn a_failed_save_leaves_the_old_file() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("gland.case.ron");
    let case = good();
    case.save(&path).unwrap();
    case.save(&path).unwrap();
    assert_eq!(Case::load(&path).unwrap(), case);
    assert_eq!(
        std::fs::read_dir(folder.path()).unwrap().count(),
        1,
        "no temporary file is left"
    );
    let error = case
        .save(&folder.path().join("missing/gland.case.ron"))
        .unwrap_err()
        .to_string();
    assert!(error.contains("gland.case.ron: cannot be written"), "{error}");
}

#[test]
fn odd_but_sound_contours_are_accepted() {
    let read = |case: Case| Case::from_ron(&case.to_ron(), Path::new(FILE)).unwrap_or_else(|error| panic!("{error}"));
    // Clockwise, with the first corner repeated at the end, and unevenly spaced slices.
    let mut case = bare(|index| {
        let mut contour: Contour = circle(10.0 + index as f64, 40).into_iter().rev().collect();
        contour.push(contour[0]);
        contour
    });
    case.slices[2].z = 17.3;
    assert_eq!(read(case).slices[0].capsule.len(), 40);
    // A deep notch, a concave posterior side, a small irregular end slice, few corners, a far centre.
    let notched = [
        (0.0, 0.0),
        (20.0, 0.0),
        (20.0, 20.0),
        (11.0, 20.0),
        (10.0, 3.0),
        (9.0, 20.0),
        (0.0, 20.0),
    ];
    let small = [(3.0, 3.0), (7.0, 2.0), (6.0, 5.0), (4.5, 4.0), (3.0, 6.0)];
    for shift in [DVec2::ZERO, DVec2::new(-4000.0, 900.0)] {
        let case = read(bare(|index| {
            let corners = if index == 0 { small.to_vec() } else { notched.to_vec() };
            corners.into_iter().map(|corner| DVec2::from(corner) + shift).collect()
        }));
        case.validate().unwrap();
        assert!(case.approximated.len() >= 7);
    }
}

#[test]
fn a_contour_file_error_names_line_and_field() {
    let json = |unit: &str, second: &str| {
        format!(
            "{{\"unit\":\"{unit}\",\n\"slices\":[{{\"z\":0,\"capsule\":[[0,0],[9,0],[9,9],[0,9]]}},\n{{\"z\":{second},\
             \"capsule\":[[0,0],[9,0],[9,9],[0,9]]}},{{\"z\":9,\"capsule\":[[0,0],[9,0],[9,9],[0,9]]}}]}}"
        )
    };
    let refused = |text: &str, parts: &[&str]| {
        let error = contours_json_str(text, Path::new("mine.json")).unwrap_err().to_string();
        for part in ["mine.json"].iter().chain(parts) {
            assert!(error.contains(part), "{part:?} is not in {error:?}");
        }
    };
    let file = Path::new("mine.json");
    assert_eq!(contours_json_str(&json("mm", "5"), file).unwrap().slices.len(), 3);
    refused(&json("inch", "5"), &[":1:", "unit", "inch"]);
    refused(&json("mm", "-5"), &["slices[1].z", "lies below"]);
    refused(&json("mm", "1e999"), &[":3:", "slices[1].z", "out of range"]);
    refused(
        &json("mm", "5").replace("capsule", "outline"),
        &["slices[0]", "capsule"],
    );
    refused("[1, 2", &["mine.json:1"]);
}

#[test]
fn only_known_endings_are_imported() {
    let error = import(Path::new("gland.mha"), &MaskOptions::default())
        .unwrap_err()
        .to_string();
    assert!(error.contains("gland.mha") && error.contains(".nii"), "{error}");
}

/// A ball in a NIfTI volume of 8-bit voxels, little endian.
fn ball(size: [u16; 3], radius: f64) -> Vec<u8> {
    let mut bytes = vec![0; 352];
    bytes[0..4].copy_from_slice(&348_i32.to_le_bytes());
    for (index, count) in [3, size[0], size[1], size[2], 1, 1, 1, 1].into_iter().enumerate() {
        bytes[40 + 2 * index..42 + 2 * index].copy_from_slice(&count.to_le_bytes());
    }
    bytes[70..72].copy_from_slice(&2_i16.to_le_bytes());
    bytes[72..74].copy_from_slice(&8_i16.to_le_bytes());
    for (index, spacing) in [1.0_f32, 2.0, 1.0, 3.0].into_iter().enumerate() {
        bytes[76 + 4 * index..80 + 4 * index].copy_from_slice(&spacing.to_le_bytes());
    }
    bytes[108..112].copy_from_slice(&352_f32.to_le_bytes());
    bytes[344..348].copy_from_slice(b"n+1\0");
    for z in 0..size[2] {
        for y in 0..size[1] {
            for x in 0..size[0] {
                let offset = DVec3::new(x.into(), y.into(), z.into()) - DVec3::new(9.0, 12.0, 8.0);
                bytes.push(u8::from(offset.length() < radius));
            }
        }
    }
    bytes
}

#[test]
fn a_mask_lies_where_its_axes_and_spacing_say() {
    let bytes = ball([20, 22, 18], 6.2);
    let read = |axes: &str, spacing_mm| {
        let options = MaskOptions {
            axes: axes.parse().unwrap(),
            spacing_mm,
            ..MaskOptions::default()
        };
        nifti_mask_bytes(&bytes, Path::new("ball.nii"), &options).unwrap()
    };
    let middle = |case: &Case| {
        let slice = &case.slices[case.slices.len() / 2];
        resecta_anatomy::contour::centroid(&slice.capsule).extend(slice.z)
    };
    // Header: 2 x 1 x 3 mm; axis 0 runs backwards, axis 1 to the left, axis 2 up.
    assert!(middle(&read("PLS", None)).distance(DVec3::new(12.0, 18.0, 24.0)) < 0.01);
    assert!(middle(&read("PLS", Some([1.0; 3]))).distance(DVec3::new(12.0, 9.0, 8.0)) < 0.01);
    assert!(middle(&read("LPS", None)).distance(DVec3::new(18.0, 12.0, 24.0)) < 0.01);
    // Reversed axes count from the other end: 20, 22 and 18 voxels long.
    assert!(middle(&read("RAI", Some([1.0; 3]))).distance(DVec3::new(10.0, 9.0, 9.0)) < 0.01);
}

#[test]
fn a_hostile_mask_is_refused_with_its_field() {
    let refused = |spoil: &dyn Fn(&mut Vec<u8>), options: &MaskOptions, part: &str| {
        let mut bytes = ball([20, 22, 18], 6.2);
        spoil(&mut bytes);
        let error = nifti_mask_bytes(&bytes, Path::new("ball.nii"), options)
            .unwrap_err()
            .to_string();
        assert!(
            error.contains("ball.nii") && error.contains(part),
            "{part:?} is not in {error:?}"
        );
    };
    let plain = MaskOptions::default();
    let put =
        |at: usize, value: Vec<u8>| move |bytes: &mut Vec<u8>| bytes[at..at + value.len()].copy_from_slice(&value);
    refused(&put(42, 60_000_u16.to_le_bytes().to_vec()), &plain, "dim");
    refused(
        &put(42, [1024_u16, 1024, 1024].map(u16::to_le_bytes).concat()),
        &plain,
        "dim",
    );
    refused(&put(42, vec![0, 0]), &plain, "NIfTI");
    refused(&put(40, vec![2, 0]), &plain, "dim");
    refused(&put(70, 128_i16.to_le_bytes().to_vec()), &plain, "datatype");
    refused(&put(72, (-8_i16).to_le_bytes().to_vec()), &plain, "bitpix");
    refused(&put(80, 0_f32.to_le_bytes().to_vec()), &plain, "pixdim");
    refused(&put(80, f32::NAN.to_le_bytes().to_vec()), &plain, "pixdim");
    refused(&put(108, f32::NAN.to_le_bytes().to_vec()), &plain, "vox_offset");
    refused(&put(108, 1e8_f32.to_le_bytes().to_vec()), &plain, "cannot be read");
    refused(&put(112, f32::NAN.to_le_bytes().to_vec()), &plain, "voxels");
    refused(&put(344, b"what".to_vec()), &plain, "NIfTI");
    refused(&|bytes| bytes.truncate(5000), &plain, "NIfTI");
    refused(&|bytes| bytes.truncate(100), &plain, "NIfTI");
    refused(&|bytes| bytes[352..].fill(0), &plain, "channel 0 has no outline");
    refused(
        &|_| (),
        &MaskOptions {
            channel: 1,
            ..plain.clone()
        },
        "channel",
    );
    refused(
        &|_| (),
        &MaskOptions {
            spacing_mm: Some([1.0, 0.0, 1.0]),
            ..plain.clone()
        },
        "spacing",
    );
    assert!("PSL?".parse::<Axes>().is_err());
}
