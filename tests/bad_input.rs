//! Bad input is refused: exit code 1, one message that names the file, the field and the rule, and nothing is written.

mod common;

use std::path::Path;

use common::{EXERCISE, SCRIPT, names, refuse, resecta, write};

/// A case of three square slices.
const CASE: &str = r#"(
    name: "Square",
    source: (description: "test", licence: "CC0-1.0"),
    unit: mm,
    slices: [
        (z: 0, capsule: [(-10, -10), (10, -10), (10, 10), (-10, 10)]),
        (z: 10, capsule: [(-12, -12), (12, -12), (12, 12), (-12, 12)]),
        (z: 20, capsule: [(-10, -10), (10, -10), (10, 10), (-10, 10)]),
    ],
)
"#;

/// The program must refuse these arguments in this folder, name all of `named` and leave the folder as it is.
fn refused(folder: &Path, arguments: &[&str], named: &[&str]) {
    let before = names(folder);
    let message = refuse(folder, arguments);
    for name in named {
        assert!(message.contains(name), "`{name}` is not in: {message}");
    }
    assert_eq!(names(folder), before, "{message}");
}

/// `text` with its one `old` replaced.
fn with(text: &str, old: &str, new: &str) -> String {
    assert_eq!(text.matches(old).count(), 1, "{old}");
    text.replace(old, new)
}

#[test]
fn bad_cases() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    write(folder, "good.case.ron", CASE);
    common::succeed(folder, ["mesh", "good.case.ron"]);
    let bad = [
        (with(CASE, "(z: 20", "(z: 5"), ["slice", "z"]),
        (with(CASE, "(z: 20", "(z: NaN"), ["NaN", "slice"]),
        (with(CASE, "unit: mm", "unit: furlong"), ["unit", "furlong"]),
        (with(CASE, "name:", "nome:"), ["nome", "name"]),
        (
            with(
                CASE,
                "(-12, -12), (12, -12), (12, 12)",
                "(-12, -12), (12, 12), (12, -12)",
            ),
            ["slice", "cross"],
        ),
        (
            with(
                CASE,
                "(z: 10, capsule: [(-12, -12), (12, -12), (12, 12), (-12, 12)])",
                "(z: 10, capsule: [])",
            ),
            ["slice", "capsule"],
        ),
        (CASE.replace("(z: 20", "// (z: 20"), ["slices", "3"]),
    ];
    for (text, rule) in bad {
        write(folder, "bad.case.ron", text);
        refused(
            folder,
            &["mesh", "bad.case.ron", "--out", "gland.vtu"],
            &["bad.case.ron", rule[0], rule[1]],
        );
    }
    let unknown = ["mesh", "mediun", "--out", "gland.vtu"];
    refused(folder, &unknown, &["mediun", "medium", ".case.ron"]);
    refused(
        folder,
        &["mesh", "no/such.case.ron"],
        &["no/such.case.ron", "cannot be read"],
    );
    refused(
        folder,
        &["mesh", "small", "--alpha", "0", "--out", "gland.vtu"],
        &["small", "alpha", "0"],
    );
    refused(folder, &["mesh", "small", "--alpha", "0.01"], &["alpha", "nodes"]);
    refused(
        folder,
        &["mesh", "small", "--out", "no/such/gland.vtu"],
        &["no/such/gland.vtu", "written"],
    );
}

#[test]
fn bad_imports_and_impossible_glands() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let out = ["--out", "new.case.ron"];
    let import = |input: &str, more: &[&str], named: &[&str]| {
        let arguments: Vec<&str> = ["import", input].iter().chain(&out).chain(more).copied().collect();
        refused(folder, &arguments, named);
    };
    write(
        folder,
        "open.json",
        r#"{"unit":"mm","slices":[{"z":0,"capsule":[[0,0],[1,1]]}]}"#,
    );
    import("open.json", &[], &["open.json", "slices"]);
    write(folder, "inch.json", r#"{"unit":"inch","slices":[]}"#);
    import("inch.json", &[], &["inch.json", "unit", "inch"]);
    write(folder, "half.json", r#"{"unit":"mm","slices":["#);
    import("half.json", &[], &["half.json:1"]);
    import("inch.json", &["--spacing", "1.6"], &["inch.json", "--spacing", "mask"]);
    write(folder, "noise.nii.gz", [0x1f, 0x8b, 8, 0, 1, 2, 3]);
    import("noise.nii.gz", &[], &["noise.nii.gz"]);
    import("picture.png", &[], &["picture.png", ".nii"]);
    import("absent.json", &[], &["absent.json", "cannot be read"]);
    let generate = |volume: &str, lobe: &str, named: &[&str]| {
        let arguments = [
            "generate",
            "--volume-ml",
            volume,
            "--median-lobe-mm",
            lobe,
            out[0],
            out[1],
        ];
        refused(folder, &arguments, named);
    };
    generate("500", "0", &["volume_ml", "500", "15 to 150"]);
    generate("NaN", "0", &["volume_ml", "NaN"]);
    generate("60", "40", &["median_lobe_mm", "40", "0 to 20"]);
}

#[test]
fn bad_exercises_scripts_and_folders() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    write(folder, "good.exercise.ron", EXERCISE);
    write(folder, "good.ron", SCRIPT);
    let run = |exercise: &str, script: &str, out: &str, named: &[&str]| {
        refused(folder, &["run", exercise, "--script", script, "--out", out], named);
    };

    let exercises = [
        (
            with(EXERCISE, "share: 0.9", "share: 1.9"),
            ["goals[0].RemoveMarked.share", "1.9"],
        ),
        (with(EXERCISE, "briefing", "breifing"), ["breifing", "briefing"]),
        (with(EXERCISE, "\"small\"", "\"smal\""), ["smal", "small"]),
        (with(EXERCISE, "time_s: 3", "time_s: -3"), ["limits.time_s", "-3"]),
        (with(EXERCISE, "alpha_deg: 15", "alpha_deg: 500"), ["alpha_deg", "500"]),
        (
            with(EXERCISE, "removed_mm3", "removed_kg"),
            ["scoring[0].metric", "removed_kg"],
        ),
    ];
    for (text, rule) in exercises {
        write(folder, "bad.exercise.ron", text);
        run(
            "bad.exercise.ron",
            "good.ron",
            "out",
            &["bad.exercise.ron", rule[0], rule[1]],
        );
    }
    run("frist_cuts", "good.ron", "out", &["frist_cuts", "first_cuts"]);
    let on = |case| {
        [
            "run",
            "good.exercise.ron",
            "--case",
            case,
            "--script",
            "good.ron",
            "--out",
            "out",
        ]
    };
    refused(
        folder,
        &on("mediun"),
        &["mediun: no such case", "did you mean `medium`?"],
    );
    refused(folder, &on("no/such.case.ron"), &["no/such.case.ron", "cannot be read"]);

    let scripts = [
        (with(SCRIPT, "time_s: 1.8", "time_s: 0.8"), ["keys[5]", "time_s"]),
        (
            with(SCRIPT, "roll_deg: -90", "roll_deg: -900"),
            ["keys[5]", "-180 to 180"],
        ),
        (with(SCRIPT, "(time_s: 0.3,", "(time_s: 0.1,"), ["keys[1]", "stroke_mm"]),
        (SCRIPT.replace("cut", "kut"), ["kut", "cut"]),
        ("(keys: [])".to_owned(), ["keys", "at least one"]),
        (SCRIPT[..SCRIPT.len() / 2].to_owned(), ["bad.ron:", "keys"]),
    ];
    for (text, rule) in scripts {
        write(folder, "bad.ron", text);
        run("good.exercise.ron", "bad.ron", "out", &["bad.ron", rule[0], rule[1]]);
    }
    run(
        "good.exercise.ron",
        "absent.ron",
        "out",
        &["absent.ron", "cannot be read"],
    );
    write(folder, "bad.csv", "resecta instrument recording 1,step_s,fast\n");
    let recording = ["run", "good.exercise.ron", "--recording", "bad.csv", "--out", "out"];
    refused(folder, &recording, &["bad.csv:1", "step_s", "fast"]);

    run(
        "good.exercise.ron",
        "good.ron",
        "no/such/folder",
        &["no/such/folder", "out"],
    );
    run("good.exercise.ron", "good.ron", "good.ron", &["good.ron", "is a file"]);
}

#[test]
fn the_game_without_a_display_says_how_to_run_without_one() {
    let folder = tempfile::tempdir().unwrap();
    let message = refuse(folder.path(), [""; 0]);
    assert!(message.contains("resecta run first_cuts --script"), "{message}");
    assert_eq!(message.lines().count(), 1, "{message}");
}

#[test]
fn wrong_usage_is_told_from_bad_input_by_its_exit_code() {
    let folder = tempfile::tempdir().unwrap();
    let wrong: [&[&str]; 6] = [
        &["fly"],
        &["run", "first_cuts", "--out", "out"],
        &[
            "run",
            "first_cuts",
            "--script",
            "a.ron",
            "--recording",
            "b.csv",
            "--out",
            "out",
        ],
        &[
            "run",
            "first_cuts",
            "--script",
            "a.ron",
            "--out",
            "out",
            "--threads",
            "0",
        ],
        &["generate", "--volume-ml", "60", "--out", "gland.ron"],
        &["import", "a.nii", "--out", "a.case.ron", "--spacing", "1,2"],
    ];
    for arguments in wrong {
        assert_eq!(
            resecta(folder.path(), arguments).status.code(),
            Some(2),
            "{arguments:?}"
        );
    }
    assert_eq!(names(folder.path()), [""; 0]);
}
