//! Files that are whole or not there.

use std::{
    ffi::OsString,
    fs::{self, File, OpenOptions},
    io,
    path::Path,
};

/// Writes a file beside its place, hands it to the disk, and puts it in place: whenever the machine stops, the file is the old
/// one or the new one. Once this has returned, it is the new one.
///
/// # Errors
/// The file system's; what was there before is as it was.
pub fn write_whole(path: &Path, bytes: &[u8]) -> io::Result<()> {
    write_whole_with(path, |part| fs::write(part, bytes))
}

/// As [`write_whole`], with the file beside its place written by `write`, which gets its path.
///
/// # Errors
/// As [`write_whole`], and those of `write`.
pub fn write_whole_with(path: &Path, write: impl FnOnce(&Path) -> io::Result<()>) -> io::Result<()> {
    let name = path.file_name().ok_or(io::ErrorKind::InvalidInput)?;
    let mut part = OsString::from(".");
    part.push(name);
    // Another program may write at the same time: each to a file of its own name.
    part.push(format!(".{}.part", std::process::id()));
    let part = path.with_file_name(part);
    let written = write(&part)
        .and_then(|()| OpenOptions::new().write(true).open(&part)?.sync_all())
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_is_the_old_one_or_the_new_one_and_nothing_is_left_beside_it() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("run.txt");
        write_whole(&file, b"old").unwrap();
        let half = |part: &Path| {
            fs::write(part, b"ne")?;
            Err(io::Error::other("the disk is full"))
        };
        let error = write_whole_with(&file, half).unwrap_err();
        assert_eq!(error.to_string(), "the disk is full");
        assert_eq!(fs::read(&file).unwrap(), b"old");
        write_whole(&file, b"new").unwrap();
        assert_eq!(fs::read(&file).unwrap(), b"new");
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
        assert!(write_whole(Path::new("/"), b"").is_err());
    }
}
