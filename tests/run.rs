//! `resecta run`: what it writes, and that it writes the same again.

mod common;

use std::{fs, path::Path};

use common::{EXERCISE, SCRIPT, command, names, succeed, write};
use resecta::{
    instrument::{InstrumentLimits, InstrumentRecording, InstrumentScript, InstrumentState},
    scenario::{COLUMNS, Library},
};

const RESULTS: [&str; 6] = [
    "gland.vtu",
    "report.html",
    "report.json",
    "run.resecta-run",
    "timing.json",
    "trace.csv",
];

fn play(folder: &Path, out: &str, more: &[&str]) {
    let arguments = ["run", "test.exercise.ron", "--script", "script.ron", "--out", out];
    succeed(folder, arguments.iter().chain(more));
}

#[test]
fn equal_runs_write_equal_bytes_on_one_thread_or_two_but_for_their_wall_times() {
    let folder = tempfile::tempdir().unwrap();
    write(folder.path(), "test.exercise.ron", EXERCISE);
    write(folder.path(), "script.ron", SCRIPT);
    for (out, threads) in [("first/", "1"), ("again", "1"), ("two", "2")] {
        play(folder.path(), out, &["--threads", threads]);
        assert_eq!(names(&folder.path().join(out)), RESULTS, "{out}");
    }
    for name in RESULTS {
        let read = |out: &str| fs::read(folder.path().join(out).join(name)).unwrap();
        for out in ["again", "two"] {
            assert!(
                name == "timing.json" || read("first") == read(out),
                "{name} differs between first and {out}"
            );
        }
    }

    let read = |name: &str| fs::read_to_string(folder.path().join("first").join(name)).unwrap();
    let report: serde_json::Value = serde_json::from_str(&read("report.json")).unwrap();
    let value = |id: &str| {
        let metrics = report["metrics"].as_array().unwrap();
        let metric = metrics.iter().find(|metric| metric["id"] == id).unwrap();
        metric["value"].as_f64().unwrap()
    };
    assert_eq!(report["run"]["ended"], "input_ended");
    assert!(value("removed_mm3") > 0.0, "the script was to cut: {report}");
    assert_eq!(value("strokes"), 2.0);
    let inside = report["run"]["self_overlap_share"].as_f64().unwrap();
    assert!((0.0..0.01).contains(&inside), "tissue in tissue: {inside}");

    // A row a step, and the last one is what the report says.
    let trace = read("trace.csv");
    let rows: Vec<&str> = trace.lines().collect();
    assert_eq!(rows[0], COLUMNS);
    assert_eq!(rows.len() as u64 - 1, report["run"]["steps"].as_u64().unwrap());
    let column = COLUMNS.split(',').position(|column| column == "removed_mm3").unwrap();
    let last = rows.last().unwrap().split(',').nth(column).unwrap();
    assert_eq!(last.parse::<f64>().unwrap(), value("removed_mm3"));

    // Stages follow each other without a gap: together they are all of the time.
    let timing: serde_json::Value = serde_json::from_str(&read("timing.json")).unwrap();
    let of_stage = |stage: &serde_json::Value| stage["wall_s"].as_f64().unwrap();
    let of_stages: f64 = timing["stages"].as_array().unwrap().iter().map(of_stage).sum();
    let share = of_stages / timing["simulate_s"].as_f64().unwrap();
    assert!((share - 1.0).abs() < 0.05, "{share}: {timing}");
    // The run is shorter than a minute, so its first minute is all of it.
    let minutes = timing["minutes"].as_array().unwrap();
    let share = minutes[0]["mean_ms"].as_f64().unwrap() / timing["step_ms"]["mean"].as_f64().unwrap();
    assert!(minutes.len() == 1 && (share - 1.0).abs() < 0.05, "{share}: {timing}");

    // The mesh holds what was not removed.
    let gland = read("gland.vtu");
    let [rest_volumes, fill] = ["rest_volume", "fill"].map(|name| numbers(&gland, name));
    let left_mm3: f64 = rest_volumes.iter().zip(fill).map(|(volume, fill)| volume * fill).sum();
    let lost_mm3 = report["lattice"]["volume_mm3"].as_f64().unwrap() - left_mm3;
    assert!((lost_mm3 - value("removed_mm3")).abs() < 1e-6 * left_mm3, "{lost_mm3}");
}

#[test]
fn a_recording_plays_like_the_script_that_it_records() {
    let folder = tempfile::tempdir().unwrap();
    write(folder.path(), "test.exercise.ron", EXERCISE);
    write(folder.path(), "script.ron", SCRIPT);
    play(folder.path(), "script", &[]);

    let trace = fs::read_to_string(folder.path().join("script/trace.csv")).unwrap();
    let mut rows = trace.lines().map(|line| line.split(',').collect::<Vec<_>>());
    let columns = rows.next().unwrap();
    let state = |row: Vec<&str>| {
        let cell = |name| row[columns.iter().position(|column| *column == name).unwrap()];
        let number = |name| cell(name).parse::<f32>().unwrap();
        InstrumentState {
            insertion_mm: number("insertion_mm"),
            pitch_deg: number("pitch_deg"),
            yaw_deg: number("yaw_deg"),
            roll_deg: number("roll_deg"),
            stroke_mm: number("stroke_mm"),
            inflow_tap: number("inflow_tap"),
            outflow_tap: number("outflow_tap"),
            cut: cell("cut") == "1",
            coagulate: cell("coagulate") == "1",
        }
    };
    let states: Vec<InstrumentState> = rows.map(state).collect();
    let recording = InstrumentRecording {
        step_s: 1.0 / 60.0,
        without_taps: false,
        start: states[0],
        states,
    };
    let file = folder.path().join("recording.csv");
    recording.save(&file).unwrap();
    InstrumentRecording::load(&file, &InstrumentLimits::default()).unwrap();
    let arguments = [
        "run",
        "test.exercise.ron",
        "--recording",
        "recording.csv",
        "--out",
        "recording",
    ];
    succeed(folder.path(), arguments);
    let replayed = fs::read_to_string(folder.path().join("recording/trace.csv")).unwrap();
    // The recording ends a step after its last state, where the script ended after its last key.
    for (step, (scripted, replayed)) in trace.lines().zip(replayed.lines()).enumerate() {
        assert_eq!(scripted, replayed, "step {step}");
    }
}

#[test]
fn a_run_without_a_window_leaves_the_settings_of_the_player_alone() {
    let folder = tempfile::tempdir().unwrap();
    write(folder.path(), "test.exercise.ron", EXERCISE);
    write(folder.path(), "script.ron", SCRIPT);
    let settings = tempfile::tempdir().unwrap();
    write(settings.path(), "settings.ron", "(broken");
    let arguments = ["run", "test.exercise.ron", "--script", "script.ron", "--out", "out"];
    let mut run = command(folder.path(), arguments);
    let output = run.env("RESECTA_CONFIG_DIR", settings.path()).output().unwrap();
    assert!(output.status.success());
    assert_eq!(names(settings.path()), ["settings.ron"], "neither read nor set aside");
}

#[test]
fn the_shipped_script_fits_the_instrument_and_the_exercise() {
    let assets = resecta::assets::find().unwrap();
    let exercise = Library::new(&assets).load("first_cuts").unwrap();
    let limits = exercise.clone().prepare().unwrap().resectoscope.limits;
    let script = InstrumentScript::load(&assets.join("scripts/first_cuts.ron"), &limits).unwrap();
    assert!(script.duration_s() < exercise.exercise.limits.time_s);
}

#[test]
fn an_exercise_over_an_imported_gland_runs() {
    let Some(shared) = common::shared() else { return };
    let folder = tempfile::tempdir().unwrap();
    let contours = shared.join("cases/mr-shapes/Shape_001.5mm.contours.json");
    let import = ["import", contours.to_str().unwrap(), "--out", "real.case.ron"];
    succeed(folder.path(), import);
    let exercise = EXERCISE.replace("\"small\"", "\"real.case.ron\"");
    write(folder.path(), "test.exercise.ron", exercise);
    write(folder.path(), "script.ron", SCRIPT);
    play(folder.path(), "out", &[]);
    assert_eq!(names(&folder.path().join("out")), RESULTS);
}

/// Numbers of the first array of that name.
fn numbers(vtu: &str, name: &str) -> Vec<f64> {
    let start = vtu.find(&format!("Name=\"{name}\"")).unwrap();
    let body = &vtu[start + vtu[start..].find('>').unwrap() + 1..];
    let words = body[..body.find('<').unwrap()].split_whitespace();
    words.map(|word| word.parse().unwrap()).collect()
}
