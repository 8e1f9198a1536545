//! Writing results: a file is either the old one or the whole new one.

use std::{
    ffi::OsString,
    fs, io,
    path::{Path, PathBuf},
};

use super::Failure;

/// Writes a file through `write`, which gets the path of a temporary file in the same folder.
pub fn write_with(file: &Path, write: impl FnOnce(&Path) -> io::Result<()>) -> Result<(), Failure> {
    let temporary = temporary_beside(file);
    let written = write(&temporary).and_then(|()| fs::rename(&temporary, file));
    written.map_err(|source| {
        // Why it failed matters more than what is left of the temporary file.
        let _ = fs::remove_file(&temporary);
        Failure::Write {
            file: file.into(),
            source,
        }
    })
}

/// Writes a file.
pub fn write(file: &Path, bytes: impl AsRef<[u8]>) -> Result<(), Failure> {
    write_with(file, |temporary| fs::write(temporary, bytes))
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
    let probe = temporary_beside(&folder.join("probe"));
    fs::write(&probe, b"")
        .and_then(|()| fs::remove_file(&probe))
        .map_err(|error| refused(format!("cannot be written into: {error}")))
}

fn temporary_beside(file: &Path) -> PathBuf {
    let mut name = OsString::from(".");
    name.push(file.file_name().unwrap_or_default());
    name.push(format!(".{}.tmp", std::process::id()));
    file.with_file_name(name)
}
