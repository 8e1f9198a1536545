//! The patient's circulation: what arteries and veins bleed with.
//!
//! An open vessel bleeds at its rate r when it is cut, and clots: the rate falls by exp(-t / τ) with the time t since then,
//! until 1 % is left, when it is closed.
//!
//! ```text
//! artery   q(t) = r exp(-t / τ) (1 - A cos 2π f t)     the mean over a beat, without clotting, is r
//! vein     q(t) = r exp(-t / τ) (1 - p / P)+           stops where the bladder's pressure p passes that in the veins P
//! ```
//!
//! f is the heart rate, the same beat for all arteries, A the pulsatility. Over a step both are integrated in closed form, so
//! totals do not depend on the length of steps (of veins as far as p changes in a step together with what is left by
//! clotting: see `bleeding.rs`). Pressure in the bladder does not slow arteries: theirs is some 130 cmH2O.
//!
//! | quantity | default | basis |
//! |---|---|---|
//! | heart rate | 70 a minute | practice |
//! | A | 0.5 | ours: the jet never stops and is seen to beat |
//! | P | 15 cmH2O | ours: some 11 mmHg, a central venous pressure of a patient on his back |

use std::f64::consts::TAU;

use bevy::prelude::*;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::{
    refused::{Checked, FluidError, check},
    vessels::VesselKind,
};

/// An open vessel with less than this share of its rate left is closed by its clot.
pub(crate) const LEAST_SHARE: f64 = 0.01;

/// What all vessels of the patient share. Module docs of `circulation.rs` have the equations and the basis of the defaults.
#[derive(Reflect, Serialize, Deserialize, JsonSchema, Debug, Clone, Copy, PartialEq)]
#[serde(deny_unknown_fields, default)]
pub struct CirculationSettings {
    /// Beats a minute; 20 to 250.
    #[schemars(range(min = 20.0, max = 250.0))]
    pub heart_rate_per_min: f64,
    /// How much arterial bleeding swings about its mean, as a share of it; 0 to 1.
    #[schemars(range(min = 0.0, max = 1.0))]
    pub pulsatility: f64,
    /// Pressure in the veins about the prostate, cmH2O; 0.1 to 100.
    #[schemars(range(min = 0.1, max = 100.0))]
    pub venous_pressure_cmh2o: f64,
    /// How far from a vessel a coagulating loop still closes it, mm; 0 to 20.
    #[schemars(range(min = 0.0, max = 20.0))]
    pub coagulation_radius_mm: f64,
    /// How long it has to stay, without a break, s; 0 to 60.
    #[schemars(range(min = 0.0, max = 60.0))]
    pub coagulation_dwell_s: f64,
}

impl Default for CirculationSettings {
    /// The radius is about half a loop's width, and the dwell half a second: both ours.
    fn default() -> Self {
        Self {
            heart_rate_per_min: 70.0,
            pulsatility: 0.5,
            venous_pressure_cmh2o: 15.0,
            coagulation_radius_mm: 3.0,
            coagulation_dwell_s: 0.5,
        }
    }
}

/// The patient's circulation: one an app, for all its tissues.
#[derive(Resource, Reflect, Debug, Clone, PartialEq, Default)]
#[reflect(Resource, Default)]
pub struct Circulation {
    /// Change them at any time; what makes no sense is put back and told.
    pub settings: CirculationSettings,
    #[reflect(ignore)]
    phase: f64,
    #[reflect(ignore)]
    lost_ml: [f64; VesselKind::COUNT],
}

impl Circulation {
    /// A circulation at the start of a beat.
    ///
    /// # Errors
    /// [`FluidError`] names the first setting that is out of range.
    pub fn new(settings: CirculationSettings) -> Result<Self, FluidError> {
        Self::check(&settings)?;
        Ok(Self { settings, ..default() })
    }

    /// How far the present beat is, 0 to 1; arteries bleed least at 0 and most at 1/2.
    pub fn beat(&self) -> f64 {
        self.phase
    }

    /// Blood lost through vessels of a kind since it was made, ml.
    pub fn lost_ml(&self, kind: VesselKind) -> f64 {
        self.lost_ml[kind as usize]
    }

    /// Blood lost since it was made, ml.
    pub fn blood_loss_ml(&self) -> f64 {
        self.lost_ml.iter().sum()
    }

    pub(crate) fn lose(&mut self, kind: VesselKind, ml: f64) {
        self.lost_ml[kind as usize] += ml;
    }

    /// The heart beats on for some seconds.
    pub(crate) fn beat_on(&mut self, seconds: f64) {
        self.phase = (self.phase + self.settings.heart_rate_per_min / 60.0 * seconds).rem_euclid(1.0);
    }

    /// What a vessel that would bleed at `rate` ml/s against no pressure, were it not for the pulse, loses in some seconds, ml.
    pub(crate) fn bleeds_ml(&self, kind: VesselKind, rate: f64, clotting_s: f64, seconds: f64) -> f64 {
        let clotting = clotting_s.recip();
        let steady = crate::balance::phi(clotting, seconds);
        match kind {
            VesselKind::Venous => rate * steady,
            VesselKind::Arterial => {
                let settings = &self.settings;
                let omega = TAU * settings.heart_rate_per_min / 60.0;
                let swing = decaying_cosine(TAU * self.phase, omega, clotting, seconds);
                // Rounding alone could take it below 0.
                (rate * (steady - settings.pulsatility * swing)).max(0.0)
            }
        }
    }
}

/// The integral of exp(-decay s) cos(start + omega s) over 0 to t: the real part of
/// `exp(i start) (exp((i omega - decay) t) - 1) / (i omega - decay)`.
fn decaying_cosine(start: f64, omega: f64, decay: f64, t: f64) -> f64 {
    let left = (-decay * t).exp();
    let (sin, cos) = (omega * t).sin_cos();
    let (real, imaginary) = (left * cos - 1.0, left * sin);
    let (sin, cos) = start.sin_cos();
    let (real, imaginary) = (cos * real - sin * imaginary, cos * imaginary + sin * real);
    (imaginary * omega - real * decay) / (omega * omega + decay * decay)
}

impl Checked for Circulation {
    type Settings = CirculationSettings;
    const NAME: &'static str = "Circulation";

    fn settings(&self) -> &CirculationSettings {
        &self.settings
    }

    fn set(&mut self, settings: CirculationSettings) {
        self.settings = settings;
    }

    fn check(settings: &CirculationSettings) -> Result<(), FluidError> {
        let CirculationSettings {
            heart_rate_per_min,
            pulsatility,
            venous_pressure_cmh2o,
            coagulation_radius_mm,
            coagulation_dwell_s,
        } = *settings;
        check(
            "heart_rate_per_min",
            heart_rate_per_min,
            20.0..=250.0,
            "20 to 250 a minute",
        )?;
        check("pulsatility", pulsatility, 0.0..=1.0, "0 to 1")?;
        check(
            "venous_pressure_cmh2o",
            venous_pressure_cmh2o,
            0.1..=100.0,
            "0.1 to 100 cmH2O",
        )?;
        check("coagulation_radius_mm", coagulation_radius_mm, 0.0..=20.0, "0 to 20 mm")?;
        check("coagulation_dwell_s", coagulation_dwell_s, 0.0..=60.0, "0 to 60 s")
    }
}
