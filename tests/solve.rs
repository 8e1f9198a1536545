//! `resecta solve` on the common scenes, against their reference solutions in double precision.

mod common;

use std::{fs, path::Path};

use common::{no_driver, refuse, resecta, shared, succeed};

/// Offset of the positions in a scene: eight letters and eight counts.
const HEADER: usize = 40;

fn positions(bytes: &[u8]) -> Vec<[f64; 3]> {
    let numbers: Vec<f64> = bytes
        .as_chunks()
        .0
        .iter()
        .map(|bytes| f64::from_le_bytes(*bytes))
        .collect();
    numbers.as_chunks().0.to_vec()
}

/// Root mean square distance over all nodes, and the largest one, mm.
fn errors_mm(found: &[[f64; 3]], expected: &[[f64; 3]]) -> (f64, f64) {
    assert_eq!(found.len(), expected.len());
    let squares = found.iter().zip(expected).map(|(found, expected)| {
        let apart = [0, 1, 2].map(|axis| (found[axis] - expected[axis]) * 1e3);
        apart.iter().map(|part| part * part).sum::<f64>()
    });
    let squares: Vec<f64> = squares.collect();
    let largest = squares.iter().copied().fold(0.0, f64::max);
    (
        (squares.iter().sum::<f64>() / squares.len() as f64).sqrt(),
        largest.sqrt(),
    )
}

#[test]
fn common_scenes_end_where_the_reference_solutions_do() {
    let Some(shared) = shared() else { return };
    let folder = tempfile::tempdir().unwrap();
    let peers = shared.join("peers");
    // Time, step, and the error to stay below, RMS and largest, mm: those of a leapfrog step in double precision are 3.8e-4
    // and 2.4e-3 after 0.1 s on `seed`.
    let runs = [
        ("tiny", "0.1", 8e-5, 5e-4, 3e-3),
        ("tiny", "1.0", 8e-5, 2e-5, 1e-4),
        ("seed", "0.1", 8e-5, 5e-4, 3e-3),
        ("seed", "1.0", 8e-5, 2e-5, 1e-4),
    ];
    for (scene, time, step, rms_bound, largest_bound) in runs {
        let references = fs::read_dir(peers.join("refs")).unwrap();
        let is_of_run = |name: &str| {
            name.strip_prefix(scene)
                .and_then(|rest| rest.strip_prefix('_'))
                .and_then(|rest| rest.strip_suffix(&format!("_{time}.bin")))
                .is_some_and(|hash| !hash.contains('_'))
        };
        let reference = references
            .map(|entry| entry.unwrap().path())
            .find(|path| is_of_run(&path.file_name().unwrap().to_string_lossy()))
            .unwrap();
        let steps = (time.parse::<f64>().unwrap() / step).round();
        let scene_file = peers.join("scenes").join(format!("{scene}.bin"));
        let (scene_file, step, steps) = (scene_file.display().to_string(), step.to_string(), steps.to_string());
        let arguments = ["solve", &scene_file, "out.bin", "--dt", &step, "--steps", &steps];
        let line = succeed(folder.path(), arguments);
        let report: serde_json::Value = serde_json::from_str(line.trim()).unwrap();
        assert!(
            report["wall_s"].as_f64().unwrap() > 0.0 && report["cpu_s"].as_f64().is_some(),
            "{line}"
        );
        assert_eq!(report["substeps"].to_string(), steps, "no step needs to be divided");
        let found = positions(&fs::read(folder.path().join("out.bin")).unwrap());
        let (rms, largest) = errors_mm(&found, &positions(&fs::read(&reference).unwrap()));
        println!("{scene}, {time} s: RMS {rms:.2e} mm, largest {largest:.2e} mm");
        assert!(
            rms < rms_bound && largest < largest_bound,
            "{scene}, {time} s: {rms} and {largest} mm"
        );
        let start = positions(&fs::read(&scene_file).unwrap()[HEADER..][..24 * found.len()]);
        assert!(
            errors_mm(&found, &start).0 > 10.0 * rms_bound,
            "the scene moves by more than the bound"
        );
    }
}

#[test]
fn to_an_aim_the_solver_chooses_steps_that_keep_it() {
    let Some(shared) = shared() else { return };
    let folder = tempfile::tempdir().unwrap();
    let scene = shared.join("peers/scenes/seed.bin").display().to_string();
    let solve = |out: &str, more: &[&str]| -> serde_json::Value {
        let arguments = [&["solve", &scene, out, "--dt", "0.2", "--steps", "5"], more].concat();
        serde_json::from_str(succeed(folder.path(), arguments).trim()).unwrap()
    };
    let (full, aimed) = (solve("full.bin", &[]), solve("aimed.bin", &["--method", "to-aim"]));
    let read = |name: &str| positions(&fs::read(folder.path().join(name)).unwrap());
    let (error, _) = errors_mm(&read("aimed.bin"), &read("full.bin"));
    let number = |report: &serde_json::Value, key: &str| report[key].as_f64().unwrap();
    println!("error {error:.2e} mm, told {:.2e}", number(&aimed, "error_told_mm"));
    assert!(error < 0.01 && number(&aimed, "error_told_mm") < 0.01, "{error}");
    let substeps = number(&aimed, "substeps") + number(&aimed, "substeps_beside");
    assert!(substeps < 0.7 * number(&full, "substeps"), "{substeps}");
    assert_eq!(full["error_told_mm"], serde_json::Value::Null);
    let arguments = ["solve", &scene, "bad.bin", "--dt", "1", "--steps", "1", "--aim", "0"];
    let message = refuse(folder.path(), arguments);
    assert!(message.contains("--aim") && message.contains("above 0"), "{message}");
}

#[test]
fn a_graphics_processor_takes_the_nodes_to_the_same_places() {
    let Some(shared) = shared() else { return };
    if no_driver() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let scene = shared.join("peers/scenes/tiny.bin").display().to_string();
    let run = |out: &str, on: &[&str]| -> serde_json::Value {
        let plain = ["solve", &scene, out, "--dt", "8e-5", "--steps", "1250"];
        let line = succeed(folder.path(), plain.iter().chain(on).copied());
        serde_json::from_str(line.trim()).unwrap()
    };
    let (plain, other) = (run("plain.bin", &[]), run("gpu.bin", &["--method", "gpu"]));
    assert!(plain["adapter"].is_null() && !other["adapter"].as_str().unwrap().is_empty());
    assert_eq!(plain["substeps"], other["substeps"]);
    let read = |name: &str| positions(&fs::read(folder.path().join(name)).unwrap());
    let (rms, largest) = errors_mm(&read("gpu.bin"), &read("plain.bin"));
    println!("apart: RMS {rms:.2e} mm, largest {largest:.2e} mm");
    // A thirtieth of the error of the step on this scene.
    assert!(rms < 1e-5 && largest < 1e-4, "{rms} and {largest} mm apart");
}

#[test]
fn the_same_scene_gives_the_same_bytes() {
    let Some(shared) = shared() else { return };
    let folder = tempfile::tempdir().unwrap();
    let scene = shared.join("peers/scenes/tiny.bin").display().to_string();
    for out in ["one.bin", "two.bin"] {
        succeed(folder.path(), ["solve", &scene, out, "--dt", "1e-3", "--steps", "50"]);
    }
    let read = |name: &str| fs::read(folder.path().join(name)).unwrap();
    assert_eq!(read("one.bin"), read("two.bin"));
}

#[test]
fn bad_scenes_and_steps_are_refused_by_name() {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("short.bin"), b"MSSCENE1abc").unwrap();
    fs::write(folder.path().join("other.bin"), b"something else").unwrap();
    let refused = |scene: &str, expected: &str| {
        let arguments = ["solve", scene, "out.bin", "--dt", "1e-4", "--steps", "5"];
        let message = refuse(folder.path(), arguments);
        assert!(message.contains(scene) && message.contains(expected), "{message}");
        assert!(!folder.path().join("out.bin").exists());
    };
    refused("short.bin", "ends within counts: 3 bytes, expected 32");
    refused("other.bin", "does not begin with MSSCENE1");
    refused("absent.bin", "cannot be read");
    let Some(shared) = shared() else { return };
    let scene = shared.join("peers/scenes/tiny.bin").display().to_string();
    for step in ["0", "-1e-4", "NaN", "inf"] {
        let step = format!("--dt={step}");
        let message = refuse(
            Path::new(folder.path()),
            ["solve", &scene, "out.bin", &step, "--steps", "5"],
        );
        assert!(message.contains("expected a finite time above 0"), "{message}");
    }
    assert_eq!(
        resecta(folder.path(), ["solve", "x", "y", "--dt", "1", "--steps", "-1"])
            .status
            .code(),
        Some(2)
    );
}
