//! The optional folder of real cases.

use std::path::{Path, PathBuf};

/// The folder `shared/cases` beside the checkout (or under `RESECTA_SHARED`), or `None`, said loudly. On a build server
/// (`CI` is set) it must be there.
pub fn shared_cases() -> Option<PathBuf> {
    // Cargo runs tests in the folder of their package.
    let shared = std::env::var_os("RESECTA_SHARED").map_or_else(|| PathBuf::from("../../../shared"), PathBuf::from);
    let cases = shared.join("cases");
    if cases.is_dir() {
        return Some(cases);
    }
    assert!(
        std::env::var_os("CI").is_none(),
        "{} is missing, and CI is set",
        cases.display()
    );
    eprintln!(
        "SKIPPED: {} is missing, so nothing was tested on real cases",
        cases.display()
    );
    None
}

/// Every file below a folder, sorted, whose path ends so.
pub fn files(folder: &Path, ending: &str) -> Vec<PathBuf> {
    let mut found = Vec::new();
    let mut open = vec![folder.to_path_buf()];
    while let Some(folder) = open.pop() {
        for entry in std::fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                open.push(path);
            } else if path.to_string_lossy().ends_with(ending) {
                found.push(path);
            }
        }
    }
    found.sort();
    found
}
