//! The generator's tones: a clear one while the cutting current flows, a lower and rougher one while the coagulating does, which
//! comes in bursts.

use crate::wave::{Oscillator, Ramp, sine};

/// Tone of the cutting current, Hz.
pub const CUTTING_HZ: f64 = 660.0;
/// Tone of the coagulating current, Hz.
pub const COAGULATION_HZ: f64 = 440.0;

/// Loudness of the fundamental, and its overtones beside it.
const LEVEL: f64 = 0.17;
const OVERTONES: [f64; 2] = [0.30, 0.14];
/// The hum that swells it: Hz, and by which share.
const CUTTING_HUM: (f64, f64) = (100.0, 0.15);
const COAGULATION_HUM: (f64, f64) = (50.0, 0.45);
/// Time in which a tone begins and ends, s.
const RAMP_S: f64 = 0.012;

/// One of the tones.
#[derive(Debug, Clone)]
pub struct Tone {
    tone: Oscillator,
    hum: Oscillator,
    depth: f64,
    gain: Ramp,
}

impl Tone {
    pub fn cutting(rate_hz: f64) -> Self {
        Self::new(CUTTING_HZ, CUTTING_HUM, rate_hz)
    }

    pub fn coagulation(rate_hz: f64) -> Self {
        Self::new(COAGULATION_HZ, COAGULATION_HUM, rate_hz)
    }

    fn new(tone_hz: f64, (hum_hz, depth): (f64, f64), rate_hz: f64) -> Self {
        Self {
            tone: Oscillator::new(tone_hz, rate_hz),
            hum: Oscillator::new(hum_hz, rate_hz),
            depth,
            gain: Ramp::new(RAMP_S, rate_hz),
        }
    }

    pub fn next(&mut self, flows: bool) -> f64 {
        let gain = self.gain.next(f64::from(flows));
        if gain == 0.0 {
            return 0.0;
        }
        let turns = self.tone.next();
        let overtones: f64 = (2..)
            .zip(OVERTONES)
            .map(|(nth, share)| share * sine(f64::from(nth) * turns))
            .sum();
        LEVEL * gain * (1.0 + self.depth * sine(self.hum.next())) * (sine(turns) + overtones)
    }
}
