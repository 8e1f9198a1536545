//! Writing results: a file is either the old one or the whole new one.

use std::{fs, io, path::Path};

use resecta_text::write_whole_with;

use super::Failure;

/// Writes a file through `write`, which gets the path of a temporary file in the same folder.
pub fn write_with(file: &Path, write: impl FnOnce(&Path) -> io::Result<()>) -> Result<(), Failure> {
    write_whole_with(file, write).map_err(|source| Failure::Write {
        file: file.into(),
        source,
    })
}

/// Writes a file.
pub fn write(file: &Path, bytes: impl AsRef<[u8]>) -> Result<(), Failure> {
    write_with(file, |temporary| fs::write(temporary, bytes))
}

/// Makes sure, before long work, that the folder of a file that is to be written is there.
pub fn check_folder_of(file: &Path) -> Result<(), Failure> {
    let folder = file.parent().filter(|folder| !folder.as_os_str().is_empty());
    match folder.map(fs::metadata) {
        Some(Err(source)) => Err(Failure::Write {
            file: file.into(),
            source,
        }),
        _ => Ok(()),
    }
}

/// Takes away the pictures that an earlier run left in a folder: beside another run's report they would pass for that run's.
pub fn remove_pictures(folder: &Path) -> Result<(), Failure> {
    let of_run = |name: &str| {
        let kinds = ["endoscope_", "outside_", "moment_"];
        name.ends_with(".png") && kinds.iter().any(|kind| name.starts_with(kind))
    };
    let at = |file: &Path| {
        let file = file.to_owned();
        move |source| Failure::Write { file, source }
    };
    for entry in fs::read_dir(folder).map_err(at(folder))? {
        let entry = entry.map_err(at(folder))?;
        if entry.file_name().to_str().is_some_and(of_run) {
            fs::remove_file(entry.path()).map_err(at(&entry.path()))?;
        }
    }
    Ok(())
}

/// Makes sure that files can be written into `folder`, and makes the folder where only it is missing.
///
/// A missing parent is refused: it is more often a slip than a wish.
pub fn prepare_folder(folder: &Path) -> Result<(), Failure> {
    let refused = |rule: String| Failure::OutFolder {
        folder: folder.into(),
        rule,
    };
    if folder.exists() && !folder.is_dir() {
        return Err(refused("is a file; expected a folder".into()));
    }
    if !folder.exists() {
        fs::create_dir(folder).map_err(|error| refused(format!("cannot be made: {error}")))?;
    }
    let probe = folder.join(format!(".probe.{}.tmp", std::process::id()));
    fs::write(&probe, b"")
        .and_then(|()| fs::remove_file(&probe))
        .map_err(|error| refused(format!("cannot be written into: {error}")))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pictures_of_an_earlier_run_go_and_all_else_stays() {
        let folder = tempfile::tempdir().unwrap();
        let old = ["endoscope_000.png", "outside_012.png", "moment_view.png"];
        let others = ["report.html", "mine.png", "endoscope_000.txt", "moment.png"];
        for name in old.into_iter().chain(others) {
            fs::write(folder.path().join(name), b"").unwrap();
        }
        remove_pictures(folder.path()).unwrap();
        assert!(old.iter().all(|name| !folder.path().join(name).exists()));
        assert!(others.iter().all(|name| folder.path().join(name).exists()));
        assert!(remove_pictures(&folder.path().join("none")).is_err());
    }
}
