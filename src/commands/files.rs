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
