//! Files that are whole or not there.

use std::{
    ffi::OsString,
    fs::{self, File},
    io::{self, Write},
    path::Path,
};

/// End of a file's name while it is being written.
pub(crate) const PART_SUFFIX: &str = ".part";

/// Writes a file beside its place, hands it to the disk, and puts it in place: whenever the machine stops, the file is the old
/// one or the new one. Once this has returned, it is the new one.
///
/// # Errors
/// The file system's; what was there before is as it was.
pub fn write_whole(path: &Path, bytes: &[u8]) -> io::Result<()> {
    let name = path.file_name().ok_or(io::ErrorKind::InvalidInput)?;
    let mut part = OsString::from(".");
    part.push(name);
    // Another program may write at the same time: each to a file of its own name.
    part.push(format!(".{}{PART_SUFFIX}", std::process::id()));
    let part = path.with_file_name(part);
    let written = File::create(&part)
        .and_then(|mut file| {
            file.write_all(bytes)?;
            file.sync_all()
        })
        .and_then(|()| fs::rename(&part, path))
        .and_then(|()| sync_folder(path));
    if written.is_err() {
        // Why it failed matters more than a left-over file.
        let _ = fs::remove_file(&part);
    }
    written
}

/// The new name is on the disk, too.
#[cfg(unix)]
fn sync_folder(path: &Path) -> io::Result<()> {
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty());
    File::open(folder.unwrap_or(Path::new(".")))?.sync_all()
}

/// Elsewhere folders cannot be opened, and a rename goes through the file system's journal.
#[cfg(not(unix))]
fn sync_folder(_: &Path) -> io::Result<()> {
    Ok(())
}
