//! Irrigant that runs: a rush of the inflow at the sheath, and a lower, gurgling one of the outflow, louder with the flow.

use crate::wave::{Band, Noise, Ramp};

/// Middle of the inflow's rush, Hz.
pub const INFLOW_HZ: f64 = 950.0;
/// Middle of the outflow's, Hz.
pub const OUTFLOW_HZ: f64 = 380.0;
/// The flow from which on it is no louder, ml/s: a tap that is wide open.
pub const FULL_FLOW_ML_PER_S: f32 = 10.0;

/// How narrow they are.
const INFLOW_QUALITY: f64 = 1.0;
const OUTFLOW_QUALITY: f64 = 1.6;
/// Loudness at full flow.
const INFLOW_LEVEL: f64 = 0.30;
const OUTFLOW_LEVEL: f64 = 0.45;
/// Time from silence to full flow, s.
const RAMP_S: f64 = 0.15;
/// A gurgle lasts from the one to the other, s, and takes this share of the loudness.
const GURGLE_S: [f64; 2] = [0.04, 0.13];
const INFLOW_GURGLE: f64 = 0.15;
const OUTFLOW_GURGLE: f64 = 0.65;

/// One of the two.
#[derive(Debug, Clone)]
pub struct Stream {
    rate_hz: f64,
    level: f64,
    depth: f64,
    noise: Noise,
    band: Band,
    gain: Ramp,
    /// How loud the present gurgle is to become, how loud it is, and how many samples it still has.
    aim: f64,
    gurgle: Ramp,
    left: u32,
}

impl Stream {
    pub fn inflow(rate_hz: f64, seed: u64) -> Self {
        let band = Band::new(INFLOW_HZ, INFLOW_QUALITY, rate_hz);
        Self::new(band, INFLOW_LEVEL, INFLOW_GURGLE, rate_hz, seed)
    }

    pub fn outflow(rate_hz: f64, seed: u64) -> Self {
        let band = Band::new(OUTFLOW_HZ, OUTFLOW_QUALITY, rate_hz);
        Self::new(band, OUTFLOW_LEVEL, OUTFLOW_GURGLE, rate_hz, seed)
    }

    fn new(band: Band, level: f64, depth: f64, rate_hz: f64, seed: u64) -> Self {
        Self {
            rate_hz,
            level,
            depth,
            noise: Noise::new(seed),
            band,
            gain: Ramp::new(RAMP_S, rate_hz),
            aim: 0.0,
            gurgle: Ramp::new(GURGLE_S[1], rate_hz),
            left: 0,
        }
    }

    /// At a flow (ml/s, >= 0).
    pub fn next(&mut self, flow_ml_per_s: f32) -> f64 {
        // A root: the ear is to notice a small flow too.
        let wanted = f64::from((flow_ml_per_s / FULL_FLOW_ML_PER_S).min(1.0)).sqrt();
        let gain = self.gain.next(wanted);
        if gain == 0.0 {
            return 0.0;
        }
        if self.left == 0 {
            let [shortest, longest] = GURGLE_S;
            self.left = ((shortest + (longest - shortest) * self.noise.chance()) * self.rate_hz) as u32;
            self.aim = self.noise.chance();
        }
        self.left = self.left.saturating_sub(1);
        let gurgle = 1.0 - self.depth * self.gurgle.next(self.aim);
        self.level * gain * gurgle * self.band.next(self.noise.white())
    }
}
