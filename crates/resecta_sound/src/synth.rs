//! All sounds together.

use thiserror::Error;

use crate::{
    alarm::Alarm, crackle::Crackle, current::Tone, limiter::limit, pedal::Pedal, state::SoundState, water::Stream,
    wave::Ramp,
};

/// Time from silence to full volume, s.
const VOLUME_RAMP_S: f64 = 0.03;

/// A rate of samples that cannot carry these sounds.
#[derive(Error, Debug, Clone, Copy, PartialEq, Eq)]
#[error("rate_hz is {rate_hz}, expected 8,000 to 768,000")]
pub struct RateError {
    /// The rate, Hz.
    pub rate_hz: u32,
}

/// Makes samples, one after the other, of what is to be heard.
#[derive(Debug, Clone)]
pub struct Synth {
    rate_hz: u32,
    cutting: Tone,
    coagulation: Tone,
    crackle: Crackle,
    inflow: Stream,
    outflow: Stream,
    pedals: [Pedal; 2],
    alarms: [Alarm; 3],
    volume: Ramp,
}

impl Synth {
    /// In silence. All that is left to chance follows from the seed.
    ///
    /// # Errors
    /// [`RateError`] for a rate (samples a second) that is not between 8,000 and 768,000.
    pub fn new(rate_hz: u32, seed: u64) -> Result<Self, RateError> {
        if !(8_000..=768_000).contains(&rate_hz) {
            return Err(RateError { rate_hz });
        }
        let rate = f64::from(rate_hz);
        Ok(Self {
            rate_hz,
            cutting: Tone::cutting(rate),
            coagulation: Tone::coagulation(rate),
            crackle: Crackle::new(rate, seed),
            inflow: Stream::inflow(rate, seed.wrapping_add(1)),
            outflow: Stream::outflow(rate, seed.wrapping_add(2)),
            pedals: [Pedal::new(rate), Pedal::new(rate)],
            alarms: [Alarm::capsule(rate), Alarm::pressure(rate), Alarm::clouded(rate)],
            volume: Ramp::new(VOLUME_RAMP_S, rate),
        })
    }

    /// Samples a second.
    pub fn rate_hz(&self) -> u32 {
        self.rate_hz
    }

    /// The next samples, between -1 and 1: what is to be heard meanwhile.
    pub fn render(&mut self, heard: &SoundState, samples: &mut [f32]) {
        let heard = heard.in_range();
        for sample in samples {
            *sample = self.next(&heard);
        }
    }

    fn next(&mut self, heard: &SoundState) -> f32 {
        let &SoundState { cut, coagulate, .. } = heard;
        let alarms = [heard.capsule_touched, heard.pressure_high, heard.view_clouded];
        let mut sum = self.cutting.next(cut) + self.coagulation.next(coagulate && !cut);
        sum += self.crackle.next(cut, coagulate, f64::from(heard.contact));
        sum += self.inflow.next(heard.inflow_ml_per_s) + self.outflow.next(heard.outflow_ml_per_s);
        for (pedal, is_down) in self.pedals.iter_mut().zip([cut, coagulate]) {
            sum += pedal.next(is_down);
        }
        for (alarm, is_on) in self.alarms.iter_mut().zip(alarms) {
            sum += alarm.next(is_on);
        }
        // Loudness as the ear has it goes with a power of the slider's way.
        let volume = self.volume.next(f64::from(heard.volume));
        limit(volume * volume * sum) as f32
    }
}
