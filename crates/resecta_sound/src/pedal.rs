//! A pedal: a click when it goes down, and a softer, lower one when it comes up.

use crate::wave::{Oscillator, Strike, sine};

/// What rings: Hz, time constant in s, loudness.
const PARTS: [(f64, f64, f64); 2] = [(1900.0, 0.004, 0.20), (210.0, 0.010, 0.25)];
const ATTACK_S: f64 = 0.0004;
/// Loudness of the way up beside that of the way down.
const UP: f64 = 0.5;

#[derive(Debug, Clone)]
pub struct Pedal {
    is_down: bool,
    parts: [(Oscillator, Strike, f64); 2],
}

impl Pedal {
    pub fn new(rate_hz: f64) -> Self {
        Self {
            is_down: false,
            parts: PARTS.map(|(frequency_hz, decay_s, level)| {
                let strike = Strike::new(ATTACK_S, decay_s, rate_hz);
                (Oscillator::new(frequency_hz, rate_hz), strike, level)
            }),
        }
    }

    pub fn next(&mut self, is_down: bool) -> f64 {
        let moves = std::mem::replace(&mut self.is_down, is_down) != is_down;
        let strength = if is_down { 1.0 } else { UP };
        let mut sum = 0.0;
        for (oscillator, strike, level) in &mut self.parts {
            if moves {
                strike.hit(strength, 1.0);
            }
            if strike.sounds() {
                sum += *level * strike.next() * sine(oscillator.next());
            }
        }
        sum
    }
}
