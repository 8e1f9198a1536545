//! What is to be heard.

/// What is to be heard from now on. Whatever is no number counts as 0, and what is out of its range as the end of it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SoundState {
    /// Whether the cutting pedal is down. A pedal is heard when it goes down and up.
    pub cut: bool,
    /// Whether the coagulation pedal is down. Of both, cutting is heard.
    pub coagulate: bool,
    /// How much tissue the loop meets, 0 (none) to 1: heard while a current flows.
    pub contact: f32,
    /// Flow of irrigant from the bag, ml/s, >= 0.
    pub inflow_ml_per_s: f32,
    /// Flow through the outflow, ml/s, >= 0.
    pub outflow_ml_per_s: f32,
    /// Alarm: the capsule was touched.
    pub capsule_touched: bool,
    /// Alarm: too much pressure in the bladder.
    pub pressure_high: bool,
    /// Alarm: blood hides the view.
    pub view_clouded: bool,
    /// How loud all of it is, 0 (silent) to 1.
    pub volume: f32,
}

impl Default for SoundState {
    /// Nothing, at full volume.
    fn default() -> Self {
        Self::NOTHING
    }
}

impl SoundState {
    /// Nothing, at full volume.
    pub const NOTHING: SoundState = SoundState {
        cut: false,
        coagulate: false,
        contact: 0.0,
        inflow_ml_per_s: 0.0,
        outflow_ml_per_s: 0.0,
        capsule_touched: false,
        pressure_high: false,
        view_clouded: false,
        volume: 1.0,
    };

    /// The same with all that can be heard in range.
    pub(crate) fn in_range(&self) -> Self {
        let within = |value: f32, most: f32| if value.is_nan() { 0.0 } else { value.clamp(0.0, most) };
        SoundState {
            contact: within(self.contact, 1.0),
            inflow_ml_per_s: within(self.inflow_ml_per_s, f32::MAX),
            outflow_ml_per_s: within(self.outflow_ml_per_s, f32::MAX),
            volume: within(self.volume, 1.0),
            ..*self
        }
    }
}
