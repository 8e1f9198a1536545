//! Images in: geometry as told, and every contradiction an error that names the file and the field.

use std::fs;
use std::path::{Path, PathBuf};

use glam::DVec2;
use image::{GrayImage, Luma, Rgb, RgbImage};
use resecta_annotate::{Geometry, Heights, ImageError, SIDECAR, Stack, StackError, Window, read_stack};
use tempfile::TempDir;

/// A folder of pictures of 6 x 4 pixels, one for each name, whose grey level tells column, row and picture.
fn folder(names: &[&str], sidecar: &str) -> TempDir {
    let folder = TempDir::new().unwrap();
    for (index, name) in names.iter().enumerate() {
        let level = |x, y| Luma([(40 * index as u32 + 6 * y + x + 1) as u8]);
        GrayImage::from_fn(6, 4, level).save(folder.path().join(name)).unwrap();
    }
    if !sidecar.is_empty() {
        fs::write(folder.path().join(SIDECAR), sidecar).unwrap();
    }
    folder
}

fn read(folder: &TempDir) -> Result<Stack, StackError> {
    read_stack(folder.path(), &Geometry::default())
}

const NAMES: [&str; 3] = ["f1.png", "f2.png", "f10.png"];

#[track_caller]
fn refused(sidecar: &str, parts: &[&str]) {
    let message = read(&folder(&NAMES, sidecar)).unwrap_err().to_string();
    for part in parts {
        assert!(message.contains(part), "{message:?} lacks {part:?}");
    }
}

#[test]
fn a_folder_of_pictures_becomes_a_stack_in_the_axes_of_a_case() {
    let folder = folder(
        &["f10.png", "f9.png", "f1.png"],
        "(unit: mm, spacing: (0.5, 0.25), z: Even(first: -4, distance: 2.5), depth: 1.0)",
    );
    let stack = read(&folder).unwrap();
    let heights: Vec<f64> = stack.slices().iter().map(|slice| slice.z_mm).collect();
    assert_eq!(heights, [-4.0, -1.5, 1.0]);
    // f1 was written last, so its levels are the third ones.
    let level = stack.slices()[0].image.grey_at(DVec2::new(1.0, 0.5)).unwrap();
    assert!((level - (80.0 + 12.0 + 2.0 + 1.0) / 255.0).abs() < 1e-6);
}

#[test]
fn columns_rows_and_order_may_run_any_way() {
    // The same pixel is found by any code, once the code says where it lies.
    for (axes, x, y, image) in [
        ("LPS", 2, 1, 0),
        ("RPS", 3, 1, 0),
        ("LAS", 2, 2, 0),
        ("RAI", 3, 2, 2),
        ("PLS", 2, 1, 0),
        ("ARI", 1, 4, 2),
    ] {
        let folder = folder(
            &NAMES,
            &format!("(spacing: (0.5, 0.5), z: Even(distance: 2), axes: \"{axes}\")"),
        );
        let stack = read(&folder).unwrap();
        let (column, row) = if axes.starts_with(['L', 'R']) { (2, 1) } else { (1, 2) };
        let expected = (6 * row + column + 1) as f32 / 255.0;
        let point = 0.5 * DVec2::new(f64::from(x), f64::from(y));
        let level = stack.slices()[image].image.grey_at(point).unwrap();
        assert!((level - expected).abs() < 1e-6, "{axes}");
    }
}

#[test]
fn a_window_moves_nothing() {
    for axes in ["LPS", "RAS", "PLS", "ARS"] {
        let read = |window| {
            let geometry = Geometry {
                spacing: Some([0.5, 0.25]),
                z: Some(Heights::Even {
                    first: 0.0,
                    distance: 1.0,
                }),
                axes: Some(axes.parse().unwrap()),
                window,
                ..Geometry::default()
            };
            read_stack(folder(&NAMES, "").path(), &geometry).unwrap()
        };
        let window = Window {
            left: 1,
            top: 1,
            width: 4,
            height: 2,
        };
        let (whole, part) = (read(None), read(Some(window)));
        let (whole, part) = (&whole.slices()[1].image, &part.slices()[1].image);
        assert_eq!(part.width() * part.height(), 8, "{axes}");
        for (x, y) in [(0, 0), (1, 1), (part.width() - 1, part.height() - 1)] {
            let place = part.place(x, y);
            assert_eq!(part.grey_at(place), whole.grey_at(place), "{axes}");
        }
    }
}

#[test]
fn heights_may_be_named_in_any_order() {
    let folder = folder(
        &NAMES,
        "(spacing: (0.5, 0.5), z: Files([(\"f10.png\", 3), (\"f1.png\", 9)]))",
    );
    let stack = read(&folder).unwrap();
    assert_eq!(stack.slices().len(), 2);
    let first = &stack.slices()[0];
    assert_eq!((first.z_mm, first.image.grey()[0]), (3.0, 81.0 / 255.0));
}

#[test]
fn a_depth_gives_the_spacing_and_says_so() {
    let stack = read(&folder(&NAMES, "(depth: 2.0, z: Even(distance: 1))")).unwrap();
    assert_eq!(stack.slices()[0].image.spacing_mm(), [0.5, 0.5]);
    assert!(
        stack.notes.iter().any(|note| note.what == "spacing"),
        "{:?}",
        stack.notes
    );
}

#[test]
fn missing_and_contradictory_geometry_is_told_by_name() {
    refused("", &["spacing: is told neither"]);
    refused("(spacing: (0.3, 0.3))", &["z: is told neither"]);
    refused(
        "(\n  spacing: (0.3, 0),\n  z: Even(distance: 1))",
        &["stack.ron:2:18: spacing[1]: is 0", "expected 0.01 to 5 mm"],
    );
    refused(
        "(spacing: (NaN, 1), z: Even(distance: 1))",
        &["stack.ron", "spacing[0]: is NaN"],
    );
    refused("(spacing: (1, 1), z: Even(distance: -1))", &["z.distance: is -1"]);
    refused(
        "(spacing: (1, 1), z: Even(first: inf, distance: 1))",
        &["z.first: is inf"],
    );
    refused(
        "(\nspacing: (1, 1),\nz: Files([(\"f1.png\", 0), (\"f2.png\", 0)]))",
        &["stack.ron:3", "z[1]: f2.png at 0 mm, but z[0] is f1.png at 0 mm"],
    );
    refused(
        "(spacing: (1, 1), z: Files([(\"f3.png\", 0)]))",
        &["names f3.png, which is not in the folder"],
    );
    refused(
        "(spacing: (1, 1), z: Files([(\"../f1.png\", 0)]))",
        &["names ../f1.png, which is not in the folder"],
    );
    refused(
        "(spacing: (1, 1), z: Even(distance: 1), depth: 30)",
        &["depth: is 30 mm, but the rows span 4.0 mm"],
    );
    refused(
        "(spacing: (1, 1), z: Even(distance: 1), axes: \"LSP\")",
        &["axes", "their code ends in S or I"],
    );
    refused(
        "(spacing: (1, 1), z: Even(distance: 1), axes: \"XYZ\")",
        &["stack.ron", "axes", "XYZ"],
    );
    refused(
        "(spacing: (1, 1), z: Even(distance: 1), window: (left: 5, top: 0, width: 2, height: 4))",
        &["f1.png: window: ", "the picture has 6 x 4"],
    );
    refused(
        "(\n  unit: cm, spacing: (1, 1))",
        &["stack.ron:2:", "there is no `cm`; expected `mm`"],
    );
    refused("(\n  spacin: (1, 1))", &["stack.ron:2:3", "did you mean `spacing`"]);
}

#[test]
fn what_the_caller_says_is_checked_as_the_sidecar_is() {
    let geometry = Geometry {
        spacing: Some([0.3, f64::NAN]),
        ..Geometry::default()
    };
    let error = read_stack(folder(&NAMES, "").path(), &geometry).unwrap_err();
    assert!(error.to_string().contains("spacing[1]: is NaN"), "{error}");
}

#[test]
fn pictures_that_are_no_ultrasound_are_told_by_name() {
    let sidecar = "(spacing: (1, 1), z: Even(distance: 1))";
    let photo = folder(&NAMES, sidecar);
    RgbImage::from_fn(6, 4, |x, y| Rgb([40 * x as u8, 60 * y as u8, 90]))
        .save(photo.path().join("f2.png"))
        .unwrap();
    let error = read(&photo).unwrap_err();
    assert!(
        matches!(error, StackError::Coloured { ref file, .. } if file.ends_with("f2.png")),
        "{error}"
    );

    let empty = folder(&NAMES, sidecar);
    GrayImage::from_pixel(6, 4, Luma([7]))
        .save(empty.path().join("f10.png"))
        .unwrap();
    let error = read(&empty).unwrap_err();
    assert!(
        matches!(&error, StackError::Image { file, error: ImageError::Blank { .. } } if file.ends_with("f10.png")),
        "{error}"
    );

    let sizes = folder(&NAMES, sidecar);
    GrayImage::from_fn(6, 5, |x, _| Luma([x as u8]))
        .save(sizes.path().join("f2.png"))
        .unwrap();
    let error = read(&sizes).unwrap_err();
    assert!(
        matches!(&error, StackError::Sizes { file, .. } if file.ends_with("f2.png")),
        "{error}"
    );

    let none = folder(&[], sidecar);
    assert!(matches!(read(&none), Err(StackError::NoPictures { .. })));
    let other = none.path().join("other.mha");
    fs::write(&other, "no kind of image that is read").unwrap();
    let error = read_stack(&other, &Geometry::default()).unwrap_err();
    assert!(matches!(error, StackError::Kind { .. }), "{error}");
    let error = read_stack(Path::new("nowhere.mha"), &Geometry::default()).unwrap_err();
    assert!(
        matches!(error, StackError::File(_)) && error.to_string().contains("nowhere.mha"),
        "{error}"
    );
}

/// A volume of `size` voxels, 0.4 mm as its header has it, each voxel its index in the file.
fn volume(folder: &TempDir, size: [u16; 3], voxel: impl Fn(usize) -> u8) -> PathBuf {
    let mut bytes = vec![0; 352];
    for (at, value) in [
        (0, 348),
        (40, 3),
        (42, size[0]),
        (44, size[1]),
        (46, size[2]),
        (70, 2),
        (72, 8),
    ] {
        bytes[at..at + 2].copy_from_slice(&u16::to_le_bytes(value));
    }
    for at in [80, 84, 88] {
        bytes[at..at + 4].copy_from_slice(&0.4_f32.to_le_bytes());
    }
    bytes[108..112].copy_from_slice(&352_f32.to_le_bytes());
    bytes[344..348].copy_from_slice(b"n+1\0");
    bytes.extend((0..size.iter().map(|&count| usize::from(count)).product()).map(voxel));
    let path = folder.path().join("gland.nii");
    fs::write(&path, bytes).unwrap();
    path
}

#[test]
fn a_volume_needs_its_axes_and_takes_the_spacing_it_is_given() {
    let folder = TempDir::new().unwrap();
    let path = volume(&folder, [4, 5, 6], |index| index as u8 + 1);
    let error = read_stack(&path, &Geometry::default()).unwrap_err();
    assert!(matches!(error, StackError::Missing { field: "axes", .. }), "{error}");

    let mut geometry = Geometry {
        axes: Some("PLS".parse().unwrap()),
        ..Geometry::default()
    };
    let stack = read_stack(&path, &geometry).unwrap();
    let image = &stack.slices()[2].image;
    assert_eq!((image.width(), image.height(), stack.slices().len()), (5, 4, 6));
    assert!((image.spacing_mm()[0] - 0.4).abs() < 1e-6 && (stack.slices()[2].z_mm - 0.8).abs() < 1e-9);
    assert_eq!(stack.notes, []);
    // Axis 0 runs backwards, axis 1 to the left, axis 2 up.
    let level = image.grey()[3 * 5 + 1];
    assert_eq!(level, (3 + 4 + 2 * 20 + 1) as f32 / 255.0);

    geometry.spacing = Some([1.6, 1.6]);
    geometry.z = Some(Heights::Even {
        first: 0.0,
        distance: 1.6,
    });
    let stack = read_stack(&path, &geometry).unwrap();
    assert_eq!(stack.slices()[2].image.spacing_mm(), [1.6, 1.6]);
    assert_eq!(stack.slices()[2].z_mm, 3.2);
    let told = &stack.notes[0];
    assert_eq!(told.what, "spacing");
    assert!(
        told.rule.contains("1.6 x 1.6 x 1.6 mm") && told.rule.contains("header's 0.4"),
        "{told:?}"
    );
}

#[test]
fn a_sidecar_beside_a_volume_is_read_and_the_caller_goes_before_it() {
    let folder = TempDir::new().unwrap();
    let path = volume(&folder, [4, 5, 6], |index| index as u8);
    fs::write(
        folder.path().join("gland.stack.ron"),
        "(axes: \"LPS\", spacing: (1.6, 1.5))",
    )
    .unwrap();
    let stack = read_stack(&path, &Geometry::default()).unwrap();
    assert_eq!(stack.slices()[0].image.spacing_mm(), [1.6, 1.5]);
    let given = Geometry {
        spacing: Some([0.7, 0.8]),
        ..Geometry::default()
    };
    let stack = read_stack(&path, &given).unwrap();
    assert_eq!(stack.slices()[0].image.spacing_mm(), [0.7, 0.8]);
}

#[test]
fn black_slices_at_the_ends_of_a_volume_are_left_out_and_one_within_is_an_error() {
    let folder = TempDir::new().unwrap();
    let geometry = Geometry {
        axes: Some("LPS".parse().unwrap()),
        ..Geometry::default()
    };
    let seen = |levels: &'static [usize]| {
        move |index: usize| {
            if levels.contains(&(index / 20)) {
                (index % 20 + 1) as u8
            } else {
                0
            }
        }
    };
    let path = volume(&folder, [4, 5, 6], seen(&[1, 2, 3]));
    let stack = read_stack(&path, &geometry).unwrap();
    assert_eq!(stack.slices().len(), 3);
    assert!((stack.slices()[0].z_mm - 0.4).abs() < 1e-9);
    assert!(
        stack.notes.iter().any(|note| note.what == "images"),
        "{:?}",
        stack.notes
    );
    for levels in [&[1, 3][..], &[]] {
        let levels: &'static [usize] = levels.to_vec().leak();
        let path = volume(&folder, [4, 5, 6], seen(levels));
        let error = read_stack(&path, &geometry).unwrap_err();
        assert!(
            error.to_string().contains("gland.nii: image") && error.to_string().contains("empty"),
            "{error}"
        );
    }
}
