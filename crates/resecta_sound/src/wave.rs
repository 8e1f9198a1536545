//! What sounds are made of: oscillators, noise, ramps, strikes that die away, and a band of frequencies.

use std::f64::consts::{PI, TAU};

/// The sine of an angle in turns, to 1e-7: of additions and products alone, the same bits on every machine.
pub fn sine(turns: f64) -> f64 {
    let turn = turns - (turns + 0.5).floor();
    let quarter = match turn {
        late if late > 0.25 => 0.5 - late,
        early if early < -0.25 => -0.5 - early,
        middle => middle,
    };
    let x = TAU * quarter;
    let s = x * x;
    x * (1.0 - s / 6.0 * (1.0 - s / 20.0 * (1.0 - s / 42.0 * (1.0 - s / 72.0 * (1.0 - s / 110.0)))))
}

/// An angle that grows by the sample.
#[derive(Debug, Clone)]
pub struct Oscillator {
    turns: f64,
    step: f64,
}

impl Oscillator {
    pub fn new(frequency_hz: f64, rate_hz: f64) -> Self {
        Self {
            turns: 0.0,
            step: frequency_hz / rate_hz,
        }
    }

    /// The next angle, turns.
    pub fn next(&mut self) -> f64 {
        self.turns += self.step;
        self.turns -= self.turns.floor();
        self.turns
    }
}

/// Chance that follows from a seed (xorshift64*, Vigna 2016).
#[derive(Debug, Clone)]
pub struct Noise(u64);

impl Noise {
    /// Every seed will do.
    pub fn new(seed: u64) -> Self {
        // A step of splitmix64: seeds that are close give numbers that are not, and the state is never 0.
        let mut mixed = seed.wrapping_add(0x9e37_79b9_7f4a_7c15);
        mixed = (mixed ^ (mixed >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        mixed = (mixed ^ (mixed >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        Self((mixed ^ (mixed >> 31)) | 1)
    }

    /// From 0 to 1.
    pub fn chance(&mut self) -> f64 {
        self.0 ^= self.0 >> 12;
        self.0 ^= self.0 << 25;
        self.0 ^= self.0 >> 27;
        let bits = self.0.wrapping_mul(0x2545_f491_4f6c_dd1d) >> 11;
        bits as f64 / (1u64 << 53) as f64
    }

    /// From -1 to 1.
    pub fn white(&mut self) -> f64 {
        2.0 * self.chance() - 1.0
    }
}

/// A number that follows its target no faster than it may: a start and an end without a click, and an end that is reached.
#[derive(Debug, Clone)]
pub struct Ramp {
    value: f64,
    step: f64,
}

impl Ramp {
    /// From 0 to 1 takes `seconds`.
    pub fn new(seconds: f64, rate_hz: f64) -> Self {
        Self {
            value: 0.0,
            step: (seconds * rate_hz).max(1.0).recip(),
        }
    }

    pub fn next(&mut self, target: f64) -> f64 {
        let way = target - self.value;
        self.value = if way.abs() <= self.step {
            target
        } else {
            self.value + self.step.copysign(way)
        };
        self.value
    }
}

/// The loudness of something that is struck: it rises within `attack` and dies away with `decay`.
#[derive(Debug, Clone)]
pub struct Strike {
    driven: f64,
    level: f64,
    rise: f64,
    left: f64,
}

/// Nobody hears less than this: it is ended.
const INAUDIBLE: f64 = 1e-6;

impl Strike {
    /// Time constants, s.
    pub fn new(attack_s: f64, decay_s: f64, rate_hz: f64) -> Self {
        Self {
            driven: 0.0,
            level: 0.0,
            rise: 1.0 - (-1.0 / (attack_s * rate_hz)).exp(),
            left: (-1.0 / (decay_s * rate_hz)).exp(),
        }
    }

    /// Strikes; what still sounds is added to, up to `most`.
    pub fn hit(&mut self, strength: f64, most: f64) {
        self.driven = (self.driven + strength).min(most);
    }

    /// Whether it still sounds.
    pub fn sounds(&self) -> bool {
        self.driven > 0.0 || self.level > 0.0
    }

    pub fn next(&mut self) -> f64 {
        self.level += (self.driven - self.level) * self.rise;
        self.driven *= self.left;
        if self.driven < INAUDIBLE && self.level < INAUDIBLE {
            (self.driven, self.level) = (0.0, 0.0);
        }
        self.level
    }
}

/// A band of frequencies: a state-variable filter of the second order, with a gain of 1 in its middle.
#[derive(Debug, Clone)]
pub struct Band {
    g: f64,
    k: f64,
    held: [f64; 2],
}

impl Band {
    /// About `middle_hz`, `middle_hz / quality` wide.
    pub fn new(middle_hz: f64, quality: f64, rate_hz: f64) -> Self {
        // Below what a rate can carry.
        let turns = (middle_hz / rate_hz).min(0.45) / 2.0;
        Self {
            g: (2.0 * PI * turns).tan(),
            k: quality.recip(),
            held: [0.0; 2],
        }
    }

    pub fn next(&mut self, sample: f64) -> f64 {
        let [first, second] = self.held;
        let band = (first + self.g * (sample - second)) / (1.0 + self.g * (self.g + self.k));
        let low = second + self.g * band;
        self.held = [2.0 * band - first, 2.0 * low - second];
        self.k * band
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_sine_is_the_sine() {
        for step in -4000..4000 {
            let turns = f64::from(step) / 1000.0;
            let error = sine(turns) - (TAU * turns).sin();
            assert!(error.abs() < 1e-7, "{turns} is off by {error}");
        }
    }

    #[test]
    fn every_seed_makes_noise_about_zero() {
        for seed in [0, 1, u64::MAX, 0x9e37_79b9_7f4a_7c15] {
            let mut noise = Noise::new(seed);
            let samples: Vec<f64> = (0..20_000).map(|_| noise.white()).collect();
            let mean = samples.iter().sum::<f64>() / samples.len() as f64;
            let power = samples.iter().map(|sample| sample * sample).sum::<f64>() / samples.len() as f64;
            // Even noise has a power of 1/3; five standard errors.
            assert!(
                mean.abs() < 0.02 && (power - 1.0 / 3.0).abs() < 0.011,
                "{seed}: {mean}, {power}"
            );
        }
    }

    #[test]
    fn a_band_passes_its_middle_and_holds_back_the_rest() {
        let rate = 48_000.0;
        let gain = |frequency: f64| {
            let (mut band, mut oscillator) = (Band::new(900.0, 2.0, rate), Oscillator::new(frequency, rate));
            let out: Vec<f64> = (0..9600).map(|_| band.next(sine(oscillator.next()))).collect();
            out[4800..].iter().fold(0.0, |most: f64, sample| most.max(sample.abs()))
        };
        assert!((gain(900.0) - 1.0).abs() < 0.01, "{}", gain(900.0));
        assert!(gain(90.0) < 0.1 && gain(9000.0) < 0.1);
    }
}
