//! `resecta run --frames`: pictures of both views, and the same results as without them. Needs a Vulkan driver.

mod common;

use std::{collections::BTreeSet, fs};

use common::{EXERCISE, names, succeed, write};

#[test]
fn pictures_show_both_views_and_change_nothing() {
    if let Err(missing) = resecta::view::adapter_available() {
        assert!(std::env::var_os("CI").is_none(), "{missing}");
        eprintln!("SKIPPED: {missing}");
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
    for result in names(&plain).iter().filter(|name| *name != "timing.json") {
        let read = |out: &std::path::Path| fs::read(out.join(result)).unwrap();
        assert!(read(&plain) == read(&pictures), "{result} differs");
    }
    for name in ["endoscope_000", "endoscope_001", "outside_000", "outside_001"] {
        let picture = image::open(pictures.join(format!("{name}.png"))).unwrap().to_rgb8();
        let colours: BTreeSet<[u8; 3]> = picture.pixels().map(|pixel| pixel.0).collect();
        assert!(colours.len() > 50, "{name} has {} colours", colours.len());
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
