//! Golden hashes: how every shipped gland moves and is cut in the first ten seconds of its exercise, to the bit.
//!
//! A change that should not alter the motion leaves them as they are. One that must says why, and renews them in the same commit:
//! `RENEW_GOLDEN=1 cargo test --release --test golden`.
//!
//! Sines and cosines differ in their last bits between systems, so they hold on one.
#![cfg(all(target_os = "linux", target_arch = "x86_64"))]

use std::{env, fmt::Write, fs, path::PathBuf};

use resecta::{
    players::{self, Player, PlayersPlugin},
    testing::Trial,
};

const STEPS: u32 = 600;

fn file() -> PathBuf {
    [env!("CARGO_MANIFEST_DIR"), "tests", "golden", "hashes.txt"]
        .iter()
        .collect()
}

fn hash(exercise: &str) -> String {
    let mut trial = Trial::new(PlayersPlugin);
    trial
        .start(exercise)
        .unwrap_or_else(|error| panic!("{exercise}: {error}"));
    players::seat(trial.app.world_mut(), Player::Careful);
    trial.steps(STEPS);
    trial.state_hash()
}

#[test]
fn every_exercise_begins_as_it_did() {
    let mut now = String::new();
    let library = Trial::new(PlayersPlugin).library().expect("the assets are there");
    for exercise in library.exercise_names() {
        writeln!(now, "{exercise} {}", hash(&exercise)).expect("a text can be written to");
    }
    if env::var_os("RENEW_GOLDEN").is_some() {
        fs::write(file(), &now).expect("the list can be written");
        return;
    }
    let before = fs::read_to_string(file()).expect("the list is there");
    let changed: Vec<&str> = now
        .lines()
        .filter(|line| !before.lines().any(|other| other == *line))
        .collect();
    assert!(
        changed.is_empty() && now.lines().count() == before.lines().count(),
        "not as in {}: {changed:#?}\nIf the motion was to change, say why and renew it: RENEW_GOLDEN=1 cargo test --release --test golden",
        file().display()
    );
}
