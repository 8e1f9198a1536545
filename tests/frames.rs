//! `resecta run --frames`: pictures of both views, and the same results as without them. Needs a Vulkan driver.

mod common;

use std::{collections::BTreeSet, fs, path::Path};

use bevy::math::DVec3;
use common::{EXERCISE, names, no_driver, succeed, write};
use resecta::anatomy::Case;

#[test]
fn pictures_show_both_views_and_change_nothing() {
    if no_driver() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    write(folder.path(), "test.exercise.ron", EXERCISE);
    let script = "(keys: [(time_s: 0, insertion_mm: 20), (time_s: 0.2, stroke_mm: 8)])";
    write(folder.path(), "script.ron", script);
    let arguments = ["run", "test.exercise.ron", "--script", "script.ron", "--out"];
    succeed(folder.path(), arguments.into_iter().chain(["plain"]));
    succeed(
        folder.path(),
        arguments.into_iter().chain(["pictures", "--frames", "2"]),
    );

    let [plain, pictures] = ["plain", "pictures"].map(|out| folder.path().join(out));
    let is_of_both = |name: &&String| !["timing.json", "report.html"].contains(&name.as_str());
    for result in names(&plain).iter().filter(is_of_both) {
        let read = |out: &Path| fs::read(out.join(result)).unwrap();
        assert!(read(&plain) == read(&pictures), "{result} differs");
    }
    // The page holds the pictures, and is the same but for them.
    let page = |out: &Path| fs::read_to_string(out.join("report.html")).unwrap();
    let with_pictures = page(&pictures);
    let (before, rest) = with_pictures.split_once("<h2>Key moments</h2>").unwrap();
    let (moments, after) = rest.split_at(rest.find("<h2>").unwrap());
    assert!(moments.contains("At the end") && moments.contains("src=\"data:image/png;base64,iVBOR"));
    assert!(page(&plain) == format!("{before}{after}"), "the page differs elsewhere");
    for name in ["endoscope_000", "endoscope_001", "outside_000", "outside_001"] {
        let picture = image::open(pictures.join(format!("{name}.png"))).unwrap().to_rgb8();
        let colours: BTreeSet<[u8; 3]> = picture.pixels().map(|pixel| pixel.0).collect();
        assert!(colours.len() > 50, "{name} has {} colours", colours.len());
    }
}

#[test]
fn a_run_by_a_scripted_player_has_pictures_too() {
    if no_driver() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    write(
        folder.path(),
        "test.exercise.ron",
        EXERCISE.replace("time_s: 3", "time_s: 1"),
    );
    let arguments = [
        "run",
        "test.exercise.ron",
        "--player",
        "careful",
        "--frames",
        "1",
        "--out",
        "out",
    ];
    succeed(folder.path(), arguments);
    let out = folder.path().join("out");
    assert!(out.join("endoscope_000.png").is_file());
    let page = fs::read_to_string(out.join("report.html")).unwrap();
    assert!(page.contains("At the end"), "no key moments");
}

#[test]
fn a_patient_who_lies_elsewhere_looks_the_same() {
    if no_driver() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let mut case = Case::load(Path::new("assets/cases/small.case.ron")).unwrap();
    case.save(&folder.path().join("here.case.ron")).unwrap();
    // Scanners count from a corner of the picture: no axis runs through the gland.
    let by = DVec3::new(48.0, 31.0, 12.0);
    for slice in &mut case.slices {
        slice.z += by.z;
        let contours = [
            Some(&mut slice.capsule),
            slice.urethra.as_mut(),
            slice.transition_zone.as_mut(),
        ];
        contours
            .into_iter()
            .flatten()
            .flatten()
            .for_each(|point| *point += by.truncate());
    }
    let marks = &mut case.landmarks;
    let single = [
        &mut marks.bladder_neck,
        &mut marks.verumontanum,
        &mut marks.external_sphincter,
    ];
    single.into_iter().flatten().for_each(|place| *place += by);
    marks
        .ureteral_orifices
        .iter_mut()
        .flatten()
        .for_each(|place| *place += by);
    case.save(&folder.path().join("there.case.ron")).unwrap();

    // Slowly enough for tissue to make way: what a sheath that appears in its midst does to it depends on rounding.
    write(
        folder.path(),
        "script.ron",
        "(keys: [(time_s: 0, insertion_mm: 0), (time_s: 2, insertion_mm: 20), (time_s: 2.2, stroke_mm: 8)])",
    );
    let pictures = ["here", "there"].map(|place| {
        let exercise = EXERCISE.replace("case: \"small\"", &format!("case: \"{place}.case.ron\""));
        assert_ne!(exercise, EXERCISE);
        let name = format!("{place}.exercise.ron");
        write(folder.path(), &name, exercise);
        let arguments = ["run", &name, "--script", "script.ron", "--out", place, "--frames", "1"];
        succeed(folder.path(), arguments);
        ["endoscope_000", "outside_000"].map(|picture| {
            let file = folder.path().join(place).join(format!("{picture}.png"));
            image::open(file).unwrap().to_rgb8()
        })
    });
    let [here, there] = pictures;
    for (here, there) in here.iter().zip(&there) {
        let apart = here
            .as_raw()
            .iter()
            .zip(there.as_raw())
            .map(|(a, b)| f64::from(a.abs_diff(*b)));
        let mean = apart.sum::<f64>() / here.as_raw().len() as f64;
        // The grain of tissue is drawn by place; outlines and colours are what must not change.
        assert!(mean < 12.0, "mean difference {mean} of 255");
    }
}

#[test]
fn without_a_driver_nothing_runs() {
    let folder = tempfile::tempdir().unwrap();
    write(folder.path(), "test.exercise.ron", EXERCISE);
    write(folder.path(), "script.ron", common::SCRIPT);
    let arguments = [
        "run",
        "test.exercise.ron",
        "--script",
        "script.ron",
        "--out",
        "out",
        "--frames",
        "1",
    ];
    // A renderer of another system: no driver of this machine can be it.
    let foreign = if cfg!(target_os = "windows") { "metal" } else { "dx12" };
    let output = common::command(folder.path(), arguments)
        .env("WGPU_BACKEND", foreign)
        .output()
        .unwrap();
    let message = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(1), "{message}");
    assert!(message.contains("frames: no graphics adapter was found"), "{message}");
    assert!(!folder.path().join("out").exists());
}
