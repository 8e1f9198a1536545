//! `resecta import`, `generate` and `mesh` on what ships and on real glands.

mod common;

use std::{fs, path::Path};

use common::{EXERCISE, SCRIPT, names, refuse, resecta, succeed, write};
use resecta::anatomy::{Case, Lattice, LatticeOptions};

/// The number that follows `name` in what `mesh` prints.
fn number(printed: &str, name: &str) -> f64 {
    let line = printed.lines().find(|line| line.starts_with(name));
    let line = line.unwrap_or_else(|| panic!("no {name} in {printed}"));
    let word = line[name.len()..]
        .split_whitespace()
        .find(|word| word.parse::<f64>().is_ok());
    word.unwrap_or_else(|| panic!("no number in {line}")).parse().unwrap()
}

/// Meshes a case at 8 degrees; every pentahedron must be positive and the volume within 1.5 % of the contours'.
fn mesh(folder: &Path, case: &str) -> String {
    let printed = succeed(folder, ["mesh", case, "--alpha", "8", "--out", "gland.vtu"]);
    assert!(number(&printed, "element quality") > 0.0, "{printed}");
    let (lattice, contours) = (number(&printed, "lattice volume"), number(&printed, "contour volume"));
    assert!((lattice - contours).abs() <= 0.015 * contours, "{printed}");
    let vtu = fs::read_to_string(folder.join("gland.vtu")).unwrap();
    let cells = format!("NumberOfCells=\"{}\"", number(&printed, "pentahedra"));
    assert!(vtu.contains(&cells), "{printed}");
    printed
}

#[test]
fn every_shipped_case_meshes_and_says_what_it_is() {
    let folder = tempfile::tempdir().unwrap();
    for case in ["small", "medium", "large"] {
        let printed = mesh(folder.path(), case);
        assert!(printed.contains("seed"), "the source says how it was made: {printed}");
    }
    let printed = mesh(folder.path(), "paper");
    assert_eq!(number(&printed, "nodes"), 10_800.0);
    assert_eq!(number(&printed, "springs"), 30_960.0);
    assert_eq!(names(folder.path()), ["gland.vtu"]);
}

#[test]
fn the_angle_is_the_one_knob_and_the_axial_points_can_be_set() {
    let folder = tempfile::tempdir().unwrap();
    let coarse = succeed(folder.path(), ["mesh", "small", "--alpha", "12"]);
    let fine = succeed(folder.path(), ["mesh", "small", "--alpha", "6"]);
    assert!(number(&fine, "nodes") > 3.0 * number(&coarse, "nodes"));
    let set = succeed(folder.path(), ["mesh", "small", "--alpha", "12", "--axial-points", "9"]);
    assert!(set.contains("9 slices"), "{set}");
    assert_eq!(names(folder.path()), [""; 0], "nothing is written without --out");
}

#[test]
fn a_shipped_case_comes_from_the_generate_command_bit_for_bit() {
    let folder = tempfile::tempdir().unwrap();
    let arguments = ["generate", "--volume-ml", "60", "--median-lobe-mm", "8", "--seed", "7"];
    succeed(folder.path(), arguments.into_iter().chain(["--out", "new.case.ron"]));
    let written = fs::read_to_string(folder.path().join("new.case.ron")).unwrap();
    let shipped = Path::new("assets/cases/medium.case.ron");
    assert_eq!(written, fs::read_to_string(shipped).unwrap());
    assert_eq!(written, succeed(folder.path(), arguments));
    mesh(folder.path(), "new.case.ron");
}

#[test]
fn real_glands_import_and_mesh() {
    let Some(shared) = common::shared() else { return };
    let cases = shared.join("cases");
    let folder = tempfile::tempdir().unwrap();
    let import = |input: &str, more: &[&str]| {
        let input = cases.join(input);
        let arguments = ["import", input.to_str().unwrap(), "--out", "real.case.ron"];
        let printed = succeed(folder.path(), arguments.iter().chain(more));
        assert!(printed.contains("approximated"), "{printed}");
        let meshed = mesh(folder.path(), "real.case.ron");
        assert!(meshed.contains("approximated"), "{meshed}");
        meshed
    };
    let mask = import(
        "trus-volumes/labels/case000009.nii.gz",
        &[
            "--spacing",
            "1.6",
            "--name",
            "TRUS 9",
            "--source",
            "DeepReg test data",
            "--licence",
            "Apache-2.0",
        ],
    );
    for said in ["TRUS 9", "DeepReg test data", "Apache-2.0"] {
        assert!(mask.contains(said), "{mask}");
    }
    import("visible-human/VH_M.5mm.contours.json", &[]);
    for shape in ["Shape_001", "Shape_003", "Shape_005"] {
        import(&format!("mr-shapes/{shape}.5mm.contours.json"), &[]);
    }
}

#[test]
fn an_imported_case_reads_back_as_it_was_made() {
    let folder = tempfile::tempdir().unwrap();
    let ring = |radius: f64| -> Vec<[f64; 2]> {
        let corner = |turn: f64| [radius * (turn * 0.3).cos(), radius * (turn * 0.3).sin()];
        (0..20).map(|turn| corner(f64::from(turn))).collect()
    };
    let slices: Vec<_> = (0..6)
        .map(|slice| serde_json::json!({"z": 5 * slice, "capsule": ring(20.0), "urethra": null, "transition_zone": null}))
        .collect();
    let contours = serde_json::json!({"unit": "mm", "slices": slices});
    write(folder.path(), "ring.contours.json", contours.to_string());
    succeed(
        folder.path(),
        [
            "import",
            "ring.contours.json",
            "--out",
            "ring.case.ron",
            "--name",
            "Ring",
        ],
    );
    let case = Case::load(&folder.path().join("ring.case.ron")).unwrap();
    assert_eq!((case.name.as_str(), case.slices.len()), ("Ring", 6));
    assert_eq!(
        case.to_ron(),
        fs::read_to_string(folder.path().join("ring.case.ron")).unwrap()
    );
    Lattice::build(&case, &LatticeOptions::default()).unwrap();
}

#[test]
fn validate_tells_every_fault_of_every_file_and_ends_with_a_count() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    write(folder, "good.exercise.ron", EXERCISE);
    let bad = EXERCISE
        .replace("share: 0.9", "share: 1.9")
        .replace("time_s: 3", "time_s: 0");
    write(folder, "bad.exercise.ron", bad);
    write(folder, "notes.txt", "");
    let output = resecta(folder, ["validate", "."]);
    assert_eq!(output.status.code(), Some(1));
    assert_eq!(
        String::from_utf8(output.stdout).unwrap(),
        "./bad.exercise.ron:7:33: goals[0].RemoveMarked.share is 1.9; expected a share above 0 and at most 1\n\
         ./bad.exercise.ron:8:22: limits.time_s is 0; expected a finite number of s above 0\n\
         ./good.exercise.ron: good\n\
         ./notes.txt: passed over: neither exercise nor case\n"
    );
    let told = String::from_utf8(output.stderr).unwrap();
    assert_eq!(told, "error: 2 faults in 1 of 2 files\n");
    let printed = succeed(folder, ["validate", "good.exercise.ron"]);
    assert_eq!(printed, "good.exercise.ron: good\n1 of 1 files good\n");
    assert_eq!(resecta(folder, ["validate"]).status.code(), Some(2));
}

#[test]
fn what_new_writes_is_good_and_plays_at_once() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    succeed(folder, ["new", "exercise", "my_first"]);
    succeed(folder, ["new", "case", "own"]);
    assert_eq!(names(folder), ["my_first.exercise.ron", "own.case.ron"]);
    succeed(folder, ["validate", "."]);
    write(folder, "script.ron", SCRIPT);
    let run = ["run", "my_first.exercise.ron", "--script", "script.ron", "--out", "out"];
    let printed = succeed(folder, run);
    assert!(printed.starts_with("My first: "), "{printed}");
    mesh(folder, "own.case.ron");
}

#[test]
fn new_replaces_nothing_and_takes_only_names() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    write(folder, "mine.exercise.ron", "mine");
    let message = refuse(folder, ["new", "exercise", "mine"]);
    assert!(message.contains("mine.exercise.ron: is there already"), "{message}");
    assert_eq!(fs::read_to_string(folder.join("mine.exercise.ron")).unwrap(), "mine");
    for bad in ["../mine", "/mine", "My", "a.b", ""] {
        assert_eq!(resecta(folder, ["new", "case", bad]).status.code(), Some(2), "{bad}");
    }
    assert_eq!(names(folder), ["mine.exercise.ron"]);
}

#[test]
fn a_new_mod_plays_by_its_path_and_by_its_name_where_the_game_finds_it() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    write(folder, "script.ron", SCRIPT);
    fs::create_dir(folder.join("mods")).unwrap();
    let printed = succeed(&folder.join("mods"), ["new", "mod", "my_mod"]);
    assert!(
        printed.starts_with("my_mod: written; play it: resecta --exercise my_mod/exercises/first.exercise.ron\n"),
        "{printed}"
    );
    let printed = succeed(folder, ["validate", "mods"]);
    assert!(printed.ends_with("3 of 3 files good\n"), "{printed}");
    for (name, out) in [
        ("my_mod/first", "by_name"),
        ("mods/my_mod/exercises/first.exercise.ron", "by_path"),
    ] {
        succeed(folder, ["run", name, "--script", "script.ron", "--out", out]);
    }
    let report = |out: &str| fs::read_to_string(folder.join(out).join("report.json")).unwrap();
    assert_eq!(report("by_name"), report("by_path"));
    let told = refuse(
        folder,
        ["run", "my_mod/frist", "--script", "script.ron", "--out", "none"],
    );
    assert!(
        told.ends_with("no such exercise file; did you mean `my_mod/first`?\n"),
        "{told}"
    );
    // A second one of its name cannot be told from it.
    let told = refuse(&folder.join("mods"), ["new", "mod", "my_mod"]);
    assert_eq!(
        told,
        "error: my_mod: is there already; another name writes another file\n"
    );
}
