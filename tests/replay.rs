//! `resecta replay`, `score` and `progress`: what `resecta run` wrote plays again, and what is damaged is refused.

mod common;

use std::{fs, path::Path, process::Output};

use common::{EXERCISE, SCRIPT, command, write};

/// Runs the program with a data folder of its own.
fn resecta(folder: &Path, arguments: &[&str]) -> Output {
    let data = folder.join("data");
    command(folder, arguments)
        .env("RESECTA_DATA_DIR", data)
        .output()
        .unwrap()
}

fn succeed(folder: &Path, arguments: &[&str]) -> String {
    let output = resecta(folder, arguments);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8(output.stdout).unwrap()
}

fn refuse(folder: &Path, arguments: &[&str]) -> String {
    let output = resecta(folder, arguments);
    assert_eq!(
        output.status.code(),
        Some(1),
        "{}",
        String::from_utf8_lossy(&output.stdout)
    );
    String::from_utf8(output.stderr).unwrap()
}

const RECORD: &str = "out/run.resecta-run";

fn played() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    write(folder.path(), "test.exercise.ron", EXERCISE);
    write(folder.path(), "script.ron", SCRIPT);
    succeed(
        folder.path(),
        &["run", "test.exercise.ron", "--script", "script.ron", "--out", "out"],
    );
    folder
}

#[test]
fn a_record_needs_no_other_file_and_plays_again_on_one_thread_and_two() {
    let folder = played();
    for file in ["test.exercise.ron", "script.ron", "out/report.json"] {
        fs::remove_file(folder.path().join(file)).unwrap();
    }
    for threads in ["1", "2"] {
        let told = succeed(folder.path(), &["replay", RECORD, "--check", "--threads", threads]);
        assert!(told.contains("every hash and all results as recorded"), "{told}");
    }
    let by_record = succeed(folder.path(), &["score", RECORD]);
    assert!(
        by_record.contains("10 * clamp((removed_mm3 - 0) / (500 - 0), 0, 1)"),
        "{by_record}"
    );
    assert_eq!(by_record, succeed(folder.path(), &["score", RECORD, "--replay"]));
}

#[test]
fn damaged_and_foreign_records_are_refused_by_name() {
    let folder = played();
    let mut bytes = fs::read(folder.path().join(RECORD)).unwrap();
    let middle = bytes.len() / 2;
    bytes[middle] ^= 1;
    write(folder.path(), "damaged.resecta-run", &bytes);
    write(folder.path(), "foreign.resecta-run", "(keys: [])");
    for command in ["replay", "score", "progress"] {
        for (file, wanted) in [
            ("damaged.resecta-run", "it is damaged"),
            ("foreign.resecta-run", "is no record of a run"),
        ] {
            let told = match command {
                "progress" => refuse(folder.path(), &[command, "--import", file]),
                _ => refuse(folder.path(), &[command, file]),
            };
            assert!(
                told.starts_with(&format!("error: {file}: ")) && told.contains(wanted),
                "{told}"
            );
        }
    }
}

#[test]
fn what_is_imported_twice_is_there_once_on_this_machine_and_the_next() {
    let folder = played();
    assert_eq!(succeed(folder.path(), &["progress"]), "no runs yet\n");
    let first = succeed(folder.path(), &["progress", "--import", RECORD]);
    assert!(first.contains("script script.ron: Test (test), 1 run\n"), "{first}");
    assert_eq!(first, succeed(folder.path(), &["progress", "--import", RECORD, RECORD]));
    succeed(folder.path(), &["progress", "--json", "all.json", "--csv", "all.csv"]);
    let table = fs::read_to_string(folder.path().join("all.csv")).unwrap();
    assert_eq!(table.lines().count(), 2, "{table}");

    fs::remove_dir_all(folder.path().join("data")).unwrap();
    assert_eq!(
        first,
        succeed(folder.path(), &["progress", "--import", "all.json", RECORD, "all.json"])
    );
    let told = refuse(folder.path(), &["progress", "--trainee", "Anna"]);
    assert!(
        told.contains("there is no \"Anna\"; there is script script.ron"),
        "{told}"
    );
}

#[test]
fn the_shipped_script_of_first_cuts_plays_again_on_one_thread_and_two() {
    let folder = tempfile::tempdir().unwrap();
    let assets = resecta::assets::find().unwrap();
    let script = fs::read_to_string(assets.join("scripts/first_cuts.ron")).unwrap();
    write(folder.path(), "script.ron", script);
    // The first seconds of it, with the first strokes.
    let exercise = fs::read_to_string(assets.join("exercises/first_cuts.exercise.ron")).unwrap();
    let line = exercise
        .lines()
        .find(|line| line.trim_start().starts_with("limits:"))
        .unwrap();
    write(
        folder.path(),
        "short.exercise.ron",
        exercise.replacen(line, "    limits: (time_s: 6),", 1),
    );
    let mut records = Vec::new();
    for threads in ["1", "2"] {
        let out = format!("out{threads}");
        let run = [
            "run",
            "short.exercise.ron",
            "--script",
            "script.ron",
            "--out",
            &out,
            "--threads",
            threads,
        ];
        succeed(folder.path(), &run);
        let record = format!("{out}/run.resecta-run");
        records.push(fs::read(folder.path().join(&record)).unwrap());
        // Played on as many threads as it was not.
        let others = if threads == "1" { "2" } else { "1" };
        succeed(folder.path(), &["replay", &record, "--check", "--threads", others]);
    }
    assert!(records[0] == records[1], "the records differ");
}
