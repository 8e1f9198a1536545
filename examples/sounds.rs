//! Writes every sound of the game, one after the other, as a WAV file to listen to, and prints which begins when.
//!
//! `cargo run --release --example sounds -- sounds.wav`

use resecta::sound::{tour, wav};

const RATE_HZ: u32 = 48_000;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let path = std::env::args().nth(1).ok_or("which file? `-- sounds.wav`")?;
    let mut samples = Vec::new();
    for stop in tour(RATE_HZ, 1)? {
        println!("{:5.1} s  {}", samples.len() as f64 / f64::from(RATE_HZ), stop.name);
        samples.extend(stop.samples);
    }
    std::fs::write(&path, wav(RATE_HZ, &samples)).map_err(|error| format!("{path}: {error}"))?;
    Ok(())
}
