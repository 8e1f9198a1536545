//! The fence around a mod's folder: what of it may be read, and how much of it there may be.
//!
//! Whatever a mod names is looked up inside its own folder: no absolute path, no `..`, nothing hidden, no link that leads out. The
//! limits bound what it can cost to read.

use std::{
    fs, io,
    path::{Component, Path, PathBuf},
};

use thiserror::Error;

/// Files and folders in a mod.
pub const MAX_MOD_ENTRIES: usize = 500;
/// Folders within folders of a mod.
pub const MAX_MOD_DEPTH: usize = 4;
/// Bytes of all files of a mod together.
pub const MAX_MOD_BYTES: u64 = 8 << 20;
/// Bytes of one file of a mod: some twenty of the largest case that ships.
pub const MAX_MOD_FILE_BYTES: u64 = 1 << 20;
/// Exercises in a mod.
pub const MAX_MOD_EXERCISES: usize = 64;

/// What is wrong with a file or folder of a mod, or with its name.
#[derive(Debug, Error)]
pub enum FenceFault {
    /// The system says no.
    #[error("cannot be read: {0}")]
    Read(#[from] io::Error),
    /// No manifest.
    #[error("there is no {} in this folder{}", super::MANIFEST, nearest.as_ref().map(|name| format!(", but {name}")).unwrap_or_default())]
    NoManifest {
        /// What may be meant for it.
        nearest: Option<String>,
    },
    /// A link out of the folder.
    #[error("leads out of the mod's folder; expected a file in it: a mod reads nothing else")]
    LeadsOut,
    /// A device, a pipe or the like.
    #[error("is neither file nor folder; a mod holds nothing else")]
    Special,
    /// Too many files.
    #[error("more than {MAX_MOD_ENTRIES} files and folders, the most that a mod holds")]
    TooMany,
    /// Folders within folders.
    #[error("more than {MAX_MOD_DEPTH} folders deep, the most in a mod")]
    TooDeep,
    /// A large file.
    #[error("has {bytes} bytes; expected at most {MAX_MOD_FILE_BYTES}, the most of a file of a mod")]
    TooLarge {
        /// Its size.
        bytes: u64,
    },
    /// Large together.
    #[error("its files have {bytes} bytes together; expected at most {MAX_MOD_BYTES}, the most of a mod")]
    TooLargeTogether {
        /// Their size.
        bytes: u64,
    },
    /// Too many exercises.
    #[error("{found} exercises; expected at most {MAX_MOD_EXERCISES}, the most of a mod")]
    TooManyExercises {
        /// How many.
        found: usize,
    },
}

/// The folder of a mod.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Fence {
    /// As it was named.
    root: PathBuf,
    /// Without links. The folder itself may be one: that is its owner's doing, not the mod's.
    real: PathBuf,
}

/// What a walk through a folder has met.
#[derive(Default)]
struct Walk {
    entries: usize,
    bytes: u64,
}

impl Fence {
    /// Around this folder, once all in it is within the limits.
    pub fn around(root: &Path) -> Result<Self, (PathBuf, FenceFault)> {
        let at_root = |error: io::Error| (root.to_owned(), FenceFault::Read(error));
        let fence = Self {
            root: root.into(),
            real: root.canonicalize().map_err(at_root)?,
        };
        let mut walk = Walk::default();
        fence.walk(root, MAX_MOD_DEPTH, &mut walk)?;
        if walk.bytes > MAX_MOD_BYTES {
            return Err((root.into(), FenceFault::TooLargeTogether { bytes: walk.bytes }));
        }
        Ok(fence)
    }

    fn walk(&self, folder: &Path, depth: usize, walk: &mut Walk) -> Result<(), (PathBuf, FenceFault)> {
        let at = |path: &Path| {
            let path = path.to_owned();
            move |error: io::Error| (path, FenceFault::Read(error))
        };
        let mut entries = Vec::new();
        for entry in fs::read_dir(folder).map_err(at(folder))? {
            let entry = entry.map_err(at(folder))?;
            walk.entries += 1;
            if walk.entries > MAX_MOD_ENTRIES {
                return Err((self.root.clone(), FenceFault::TooMany));
            }
            // Never read, so never a matter: `.git` and the like.
            if !is_hidden(&entry.file_name()) {
                entries.push(entry.path());
            }
        }
        // Of several faults the same one is told on every system.
        entries.sort();
        for entry in entries {
            let is_link = entry.is_symlink();
            let real = entry.canonicalize().map_err(at(&entry))?;
            if !real.starts_with(&self.real) {
                return Err((entry, FenceFault::LeadsOut));
            }
            let what = fs::metadata(&real).map_err(at(&entry))?;
            if what.is_dir() {
                // What a link within the folder leads to is met elsewhere.
                if depth == 0 {
                    return Err((entry, FenceFault::TooDeep));
                } else if !is_link {
                    self.walk(&entry, depth - 1, walk)?;
                }
            } else if !what.is_file() {
                return Err((entry, FenceFault::Special));
            } else {
                let bytes = what.len();
                if bytes > MAX_MOD_FILE_BYTES {
                    return Err((entry, FenceFault::TooLarge { bytes }));
                }
                walk.bytes += bytes;
            }
        }
        Ok(())
    }

    /// The folder as it was named.
    pub fn root(&self) -> &Path {
        &self.root
    }

    /// Whether a path leads to something in the folder.
    pub fn holds(&self, path: &Path) -> bool {
        path.canonicalize().is_ok_and(|real| real.starts_with(&self.real))
    }

    /// The path of something that a file in `folder` of this mod refers to; it need not be there.
    ///
    /// # Errors
    /// What was expected.
    pub fn path(&self, folder: &Path, reference: &str) -> Result<PathBuf, &'static str> {
        // A path of one system is one on the others, too, or on none.
        if reference.contains(['\\', ':']) {
            return Err("a path with `/` between folders, inside the mod's own folder");
        }
        let relative = Path::new(reference);
        for part in relative.components() {
            match part {
                Component::Normal(name) if is_hidden(name) => return Err("a path without hidden files or folders"),
                Component::Normal(_) | Component::CurDir => {}
                Component::ParentDir => return Err("a path inside the mod's own folder, without `..`"),
                Component::RootDir | Component::Prefix(_) => {
                    return Err("a path inside the mod's own folder, not an absolute one");
                }
            }
        }
        let path = folder.join(relative);
        if path.exists() && !self.holds(&path) {
            return Err("a path inside the mod's own folder, not a link out of it");
        }
        Ok(path)
    }
}

fn is_hidden(name: &std::ffi::OsStr) -> bool {
    name.to_string_lossy().starts_with('.')
}
