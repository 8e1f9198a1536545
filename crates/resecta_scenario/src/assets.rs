//! Where the shipped assets are: cases, exercises, scripts; and where the player's mods are.

use std::path::{Path, PathBuf};

use thiserror::Error;

/// Folders that tell a folder of our assets from any other of that name.
const PARTS: [&str; 2] = ["cases", "exercises"];

/// Place of the shipped model of the prostate in ultrasound within the folder of assets.
pub const PROSTATE_MODEL: &str = "models/prostate.pdm";

/// Names a folder of mods in place of the player's own.
pub const MODS_VARIABLE: &str = "RESECTA_MODS_DIR";

/// The folder of the player's mods, which need not be there: `resecta/mods` in their data folder (`~/.local/share` on Linux), or
/// what [`MODS_VARIABLE`] says. None where the system names no such folder.
pub fn mods_folder() -> Option<PathBuf> {
    match std::env::var_os(MODS_VARIABLE) {
        Some(folder) => Some(folder.into()),
        None => Some(dirs::data_dir()?.join("resecta/mods")),
    }
}

/// No folder of assets at any of the places where it may be.
#[derive(Debug, Error)]
#[error("no folder `assets` with {} in it; looked at {}", PARTS.join(" and "), list(looked))]
pub struct AssetsMissing {
    /// The places, in the order of looking.
    pub looked: Vec<PathBuf>,
}

/// The folder of shipped assets: `assets` in the working directory, else beside the executable, else in the source of this
/// package.
///
/// # Errors
/// [`AssetsMissing`] lists these places.
pub fn find() -> Result<PathBuf, AssetsMissing> {
    let working_directory = PathBuf::new();
    let beside_executable = std::env::current_exe()
        .ok()
        .and_then(|executable| Some(executable.parent()?.to_owned()));
    // This crate lies two folders below the package.
    let source = Path::new(env!("CARGO_MANIFEST_DIR"))
        .ancestors()
        .nth(2)
        .map(Path::to_owned);
    first_of(
        [Some(working_directory), beside_executable, source]
            .into_iter()
            .flatten(),
    )
}

/// The assets in the first of these folders that holds any.
fn first_of(folders: impl IntoIterator<Item = PathBuf>) -> Result<PathBuf, AssetsMissing> {
    let mut looked = Vec::new();
    for folder in folders {
        let assets = folder.join("assets");
        if PARTS.iter().all(|part| assets.join(part).is_dir()) {
            return Ok(assets);
        }
        looked.push(assets);
    }
    Err(AssetsMissing { looked })
}

fn list(places: &[PathBuf]) -> String {
    let places: Vec<String> = places.iter().map(|place: &PathBuf| quoted(place)).collect();
    places.join(", ")
}

fn quoted(place: &Path) -> String {
    format!("`{}`", place.display())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_folder_is_ours_only_with_its_parts_and_the_first_wins() {
        let folder = tempfile::tempdir().unwrap();
        let [foreign, first, second] = ["foreign", "first", "second"].map(|name| folder.path().join(name));
        std::fs::create_dir_all(foreign.join("assets/textures")).unwrap();
        for ours in [&first, &second] {
            for part in PARTS {
                std::fs::create_dir_all(ours.join("assets").join(part)).unwrap();
            }
        }
        let found = first_of([foreign.clone(), first.clone(), second]).unwrap();
        assert_eq!(found, first.join("assets"));
        let missing = first_of([foreign.clone()]).unwrap_err();
        assert!(
            missing
                .to_string()
                .contains(&foreign.join("assets").display().to_string()),
            "{missing}"
        );
    }
}
