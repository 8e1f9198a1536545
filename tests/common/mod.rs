//! What the tests of this package share.

// Every test program uses a part of this.
#![allow(dead_code)]

use std::{
    fs,
    path::{Path, PathBuf},
    process::{Command, Output},
};

/// A small exercise on a coarse lattice.
pub const EXERCISE: &str = r#"(
    title: "Test",
    briefing: "Cut.",
    case: "small",
    alpha_deg: 15,
    marked: (zones: [LateralLobe, MiddleLobe]),
    goals: [RemoveMarked(share: 0.9)],
    limits: (time_s: 3),
    scoring: [(metric: "removed_mm3", points: 10, from: 0, to: 500, basis: "test")],
)
"#;

/// Two strokes from beside the verumontanum, one to either side. Where they go is not the point, only that they cut.
pub const SCRIPT: &str = "(
    keys: [
        (time_s: 0, roll_deg: 90, stroke_mm: 0),
        (time_s: 0.3, stroke_mm: 12),
        (time_s: 0.4, stroke_mm: 12, yaw_deg: 0, cut: true),
        (time_s: 0.6, yaw_deg: 4),
        (time_s: 1.0, stroke_mm: 0, cut: false, yaw_deg: 4, roll_deg: 90),
        (time_s: 1.8, stroke_mm: 12, roll_deg: -90, yaw_deg: -4),
        (time_s: 1.9, stroke_mm: 12, cut: true),
        (time_s: 2.2, stroke_mm: 0, cut: false),
    ],
)
";

/// Writes [`EXERCISE`] into a folder.
pub fn write_exercise(folder: &Path) -> PathBuf {
    write(folder, "test.exercise.ron", EXERCISE)
}

/// Writes a file into a folder.
pub fn write(folder: &Path, name: &str, text: impl AsRef<[u8]>) -> PathBuf {
    let file = folder.join(name);
    fs::write(&file, text).unwrap();
    file
}

/// The program, to be run in a folder, without a display.
pub fn command<I: AsRef<std::ffi::OsStr>>(folder: &Path, arguments: impl IntoIterator<Item = I>) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_resecta"));
    command.args(arguments).current_dir(folder);
    command.env_remove("DISPLAY").env_remove("WAYLAND_DISPLAY");
    // Not the mods of whoever runs the tests.
    command.env("RESECTA_MODS_DIR", folder.join("mods"));
    command
}

/// Runs the program in a folder.
pub fn resecta<I: AsRef<std::ffi::OsStr>>(folder: &Path, arguments: impl IntoIterator<Item = I>) -> Output {
    command(folder, arguments).output().unwrap()
}

/// Runs the program, which must succeed, and returns what it printed.
pub fn succeed<I: AsRef<std::ffi::OsStr>>(folder: &Path, arguments: impl IntoIterator<Item = I>) -> String {
    let output = resecta(folder, arguments);
    let stderr = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{stderr}");
    String::from_utf8(output.stdout).unwrap()
}

/// Runs the program, which must refuse, and returns its one message.
pub fn refuse<I: AsRef<std::ffi::OsStr>>(folder: &Path, arguments: impl IntoIterator<Item = I>) -> String {
    let output = resecta(folder, arguments);
    let stderr = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(1), "{stderr}");
    assert!(stderr.starts_with("error: "), "{stderr}");
    assert_eq!(output.stdout, b"", "{stderr}");
    stderr
}

/// The names of the files in a folder, sorted.
pub fn names(folder: &Path) -> Vec<String> {
    let entries = fs::read_dir(folder).unwrap();
    let mut names: Vec<String> = entries
        .map(|entry| entry.unwrap().file_name().to_string_lossy().into_owned())
        .collect();
    names.sort();
    names
}

/// The folder of test data beside the checkout, or `RESECTA_SHARED`. Absent, it says so loudly, and panics under CI, which
/// has it.
pub fn shared() -> Option<PathBuf> {
    let folder = match std::env::var_os("RESECTA_SHARED") {
        Some(folder) => folder.into(),
        // Cargo runs tests in the folder of their package.
        None => PathBuf::from("../shared"),
    };
    if folder.join("cases").is_dir() {
        // Programs are run in other folders.
        return Some(folder.canonicalize().unwrap());
    }
    assert!(std::env::var_os("CI").is_none(), "no test data at {}", folder.display());
    eprintln!("SKIPPED: no test data at {}", folder.display());
    None
}

/// Whether there is no Vulkan driver to draw with. Says so loudly, and panics under CI, which has one.
pub fn no_driver() -> bool {
    let Err(missing) = resecta::view::adapter_available() else {
        return false;
    };
    assert!(std::env::var_os("CI").is_none(), "{missing}");
    eprintln!("SKIPPED: {missing}");
    true
}
