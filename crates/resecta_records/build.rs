//! Tells builds apart by what the simulation is made of: records play again to the same bits on the same build.

use std::{
    env, fs,
    path::{Path, PathBuf},
    process::Command,
};

/// The crates that decide what a step does, and what it is worth.
const SIMULATION: [&str; 8] = [
    "resecta_anatomy",
    "resecta_chips",
    "resecta_field",
    "resecta_fluid",
    "resecta_instrument",
    "resecta_scenario",
    "resecta_solver",
    "resecta_tissue",
];

fn main() {
    let mut hash = Fnv1a(0xcbf2_9ce4_8422_2325);
    let manifest = PathBuf::from(env::var_os("CARGO_MANIFEST_DIR").unwrap_or_default());
    let crates = manifest.parent().map(Path::to_path_buf).unwrap_or_default();
    for name in SIMULATION {
        let source = crates.join(name).join("src");
        println!("cargo::rerun-if-changed={}", source.display());
        add_folder(&source, &mut hash);
    }
    // Another release of a dependency may round otherwise.
    let lock = crates.join("../Cargo.lock");
    println!("cargo::rerun-if-changed={}", lock.display());
    add_file(&lock, &mut hash);
    let rustc = env::var_os("RUSTC").unwrap_or_else(|| "rustc".into());
    if let Ok(version) = Command::new(rustc).arg("--version").output() {
        hash.write(&version.stdout);
    }
    println!("cargo::rustc-env=RESECTA_SOURCES={:016x}", hash.0);
}

/// Every source in a folder, by name: the file system's order is its own.
fn add_folder(folder: &Path, hash: &mut Fnv1a) {
    let Ok(entries) = fs::read_dir(folder) else { return };
    let mut paths: Vec<PathBuf> = entries.flatten().map(|entry| entry.path()).collect();
    paths.sort();
    for path in paths {
        if path.is_dir() {
            add_folder(&path, hash);
        } else if path.extension().is_some_and(|end| end == "rs") {
            add_file(&path, hash);
        }
    }
}

/// A file's name and text, whatever ends its lines.
fn add_file(file: &Path, hash: &mut Fnv1a) {
    let name = file.file_name().unwrap_or_default().to_string_lossy();
    hash.write(name.as_bytes());
    let mut bytes = fs::read(file).unwrap_or_default();
    bytes.retain(|&byte| byte != b'\r');
    hash.write(&bytes);
}

/// The hash of Fowler, Noll and Vo, 64 bit: enough to tell builds apart.
struct Fnv1a(u64);

impl Fnv1a {
    fn write(&mut self, bytes: &[u8]) {
        for &byte in bytes {
            self.0 = (self.0 ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3);
        }
    }
}
