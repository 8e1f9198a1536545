//! Alarms: pulses of a tone, told apart by pitch, number and pace. The graver the higher and the quicker.
//!
//! | alarm | tone | pulses | again after |
//! |---|---|---|---|
//! | capsule touched | 988 Hz | 3 of 0.09 s | 0.6 s |
//! | pressure in the bladder | 587 Hz | 2 of 0.18 s | 2.4 s |
//! | view clouded | 330 Hz | 1 of 0.35 s | 4 s |
//!
//! What has begun is played to the end of its pulses: an alarm for a moment is heard whole, and one that comes and goes does
//! not stutter.

use crate::wave::{Oscillator, Ramp, sine};

/// Tone of the alarm that the capsule was touched, Hz.
pub const CAPSULE_HZ: f64 = 988.0;
/// Tone of the alarm of too much pressure, Hz.
pub const PRESSURE_HZ: f64 = 587.0;
/// Tone of the alarm of a clouded view, Hz.
pub const CLOUDED_HZ: f64 = 330.0;

const LEVEL: f64 = 0.26;
const OVERTONE: f64 = 0.25;
const RAMP_S: f64 = 0.008;

/// Pulses, and when they come again, s.
struct Pattern {
    pulses: u32,
    pulse_s: f64,
    pause_s: f64,
    again_s: f64,
}

#[derive(Debug, Clone)]
pub struct Alarm {
    tone: Oscillator,
    gain: Ramp,
    /// Samples: of a pulse, of a pulse and its pause, of all pulses, until they come again.
    pulse: u64,
    beat: u64,
    pulses: u64,
    again: u64,
    /// Samples since it began; none while there is none.
    since: Option<u64>,
}

impl Alarm {
    pub fn capsule(rate_hz: f64) -> Self {
        let pattern = Pattern {
            pulses: 3,
            pulse_s: 0.09,
            pause_s: 0.06,
            again_s: 0.6,
        };
        Self::new(CAPSULE_HZ, &pattern, rate_hz)
    }

    pub fn pressure(rate_hz: f64) -> Self {
        let pattern = Pattern {
            pulses: 2,
            pulse_s: 0.18,
            pause_s: 0.10,
            again_s: 2.4,
        };
        Self::new(PRESSURE_HZ, &pattern, rate_hz)
    }

    pub fn clouded(rate_hz: f64) -> Self {
        let pattern = Pattern {
            pulses: 1,
            pulse_s: 0.35,
            pause_s: 0.0,
            again_s: 4.0,
        };
        Self::new(CLOUDED_HZ, &pattern, rate_hz)
    }

    fn new(tone_hz: f64, pattern: &Pattern, rate_hz: f64) -> Self {
        let samples = |seconds: f64| (seconds * rate_hz).max(1.0) as u64;
        let beat = samples(pattern.pulse_s + pattern.pause_s);
        Self {
            tone: Oscillator::new(tone_hz, rate_hz),
            gain: Ramp::new(RAMP_S, rate_hz),
            pulse: samples(pattern.pulse_s),
            beat,
            pulses: beat * u64::from(pattern.pulses),
            again: samples(pattern.again_s),
            since: None,
        }
    }

    pub fn next(&mut self, is_on: bool) -> f64 {
        self.since = match self.since {
            Some(since) if since + 1 < self.again => Some(since + 1),
            _ => is_on.then_some(0),
        };
        let is_pulse = |since: u64| since < self.pulses && since % self.beat < self.pulse;
        let gain = self.gain.next(f64::from(self.since.is_some_and(is_pulse)));
        if gain == 0.0 {
            return 0.0;
        }
        let turns = self.tone.next();
        LEVEL * gain * (sine(turns) + OVERTONE * sine(2.0 * turns))
    }
}
