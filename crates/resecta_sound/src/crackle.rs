//! Sparks where current meets tissue: bursts of a thousandth of a second at random, over a hiss.

use crate::wave::{Band, Noise, Ramp, Strike};

/// Middle of what is heard, Hz, and how narrow it is.
const MIDDLE_HZ: f64 = 3200.0;
const QUALITY: f64 = 0.8;
/// Sparks a second where all of the loop meets tissue, under either current.
const CUTTING_PER_S: f64 = 200.0;
const COAGULATION_PER_S: f64 = 70.0;
/// A spark's time constants, s.
const ATTACK_S: f64 = 0.0002;
const DECAY_S: f64 = 0.0015;
/// Loudness of sparks, and of the hiss beside them.
const LEVEL: f64 = 0.45;
const HISS: f64 = 0.12;
const RAMP_S: f64 = 0.01;

#[derive(Debug, Clone)]
pub struct Crackle {
    rate_hz: f64,
    noise: Noise,
    band: Band,
    spark: Strike,
    contact: Ramp,
}

impl Crackle {
    pub fn new(rate_hz: f64, seed: u64) -> Self {
        Self {
            rate_hz,
            noise: Noise::new(seed),
            band: Band::new(MIDDLE_HZ, QUALITY, rate_hz),
            spark: Strike::new(ATTACK_S, DECAY_S, rate_hz),
            contact: Ramp::new(RAMP_S, rate_hz),
        }
    }

    pub fn next(&mut self, cut: bool, coagulate: bool, contact: f64) -> f64 {
        let per_s = match (cut, coagulate) {
            (true, _) => CUTTING_PER_S,
            (_, true) => COAGULATION_PER_S,
            _ => 0.0,
        };
        let contact = self.contact.next(if per_s > 0.0 { contact } else { 0.0 });
        if contact == 0.0 && !self.spark.sounds() {
            return 0.0;
        }
        if self.noise.chance() < per_s * contact / self.rate_hz {
            self.spark.hit(0.4 + 0.6 * self.noise.chance(), 1.5);
        }
        LEVEL * self.band.next(self.noise.white()) * (self.spark.next() + HISS * contact)
    }
}
