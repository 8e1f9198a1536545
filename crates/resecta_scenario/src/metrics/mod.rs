//! What is measured of a run, step by step.
//!
//! A metric is a row of [`MetricId`]'s table and a field of one of the small accumulators here. Each accumulator sees one
//! [`StepObservation`] a fixed step of a running exercise and nothing else, so the same run measures the same values.

mod capsule;
mod chips;
mod contact_error;
mod current;
mod motion;
mod observation;
mod removal;
mod sphincter;
mod table;
mod view;
mod water;

use std::collections::BTreeMap;

use bevy::prelude::*;

use crate::extension::ExtensionMetric;

pub use capsule::CapsuleTouches;
pub use chips::ChipMasses;
pub use contact_error::ContactError;
pub use current::CurrentUse;
pub use motion::TipMotion;
pub use observation::StepObservation;
pub use removal::Removal;
pub use sphincter::SphincterInjuries;
pub use table::{Better, MetricId, MetricInfo};
pub use view::View;
pub use water::{BloodAndWater, WaterStep};

/// Everything measured of the run so far. Reset when an exercise starts; read values with [`Metrics::value`].
#[derive(Resource, Reflect, Debug, Clone, PartialEq, Default)]
#[reflect(Resource, Default)]
pub struct Metrics {
    /// Steps measured.
    pub steps: u64,
    /// Simulated time of one step, s.
    pub step_s: f64,
    /// What was removed, and from where.
    pub removal: Removal,
    /// Touches and cuts of the capsule.
    pub capsule: CapsuleTouches,
    /// The loop below the verumontanum.
    pub sphincter: SphincterInjuries,
    /// What the current was used for.
    pub current: CurrentUse,
    /// Where the tip went, how deep the instrument pressed and how often it was forced.
    pub motion: TipMotion,
    /// What blood and water did.
    pub water: BloodAndWater,
    /// What the lens saw.
    pub view: View,
    /// Steps of the exercise that are done.
    pub steps_done: u32,
    /// Where the cut tissue is.
    pub chips: ChipMasses,
    /// How far the simulation itself was off.
    pub contact_error: ContactError,
    /// What extensions measure, of the metrics and goals that the exercise names.
    pub extensions: BTreeMap<ExtensionMetric, f64>,
}

impl Metrics {
    /// The value of a metric, in the unit of its table row. Always finite.
    pub fn value(&self, metric: MetricId) -> f64 {
        let Self {
            removal,
            capsule,
            sphincter,
            current,
            motion,
            water,
            chips,
            ..
        } = self;
        match metric {
            MetricId::Elapsed => self.elapsed_s(),
            MetricId::Removed => removal.volume_mm3,
            MetricId::RemovedMass => removal.mass_g(),
            MetricId::LateralLobeRemoved => removal.lateral_lobe_mm3(),
            MetricId::MiddleLobeRemoved => removal.middle_lobe_mm3(),
            MetricId::PeripheralRemoved => removal.peripheral_mm3(),
            MetricId::OtherRemoved => removal.other_mm3(),
            MetricId::AdenomaRemovedShare => removal.adenoma_share(),
            MetricId::MarkedRemoved => removal.marked_mm3,
            MetricId::MarkedRemovedShare => removal.marked_share(),
            MetricId::UnmarkedShare => removal.unmarked_share(),
            MetricId::HealthyRemoved => removal.healthy_mm3(),
            MetricId::CapsuleTouches => f64::from(capsule.touches),
            MetricId::CapsuleTouchTime => capsule.time_s,
            MetricId::CapsuleCut => capsule.cut_mm2,
            MetricId::CapsuleCutShare => capsule.cut_share(),
            MetricId::SphincterInjuries => f64::from(sphincter.injuries),
            MetricId::FalsePassages => f64::from(motion.false_passages),
            MetricId::CurrentWithoutContact => current.without_contact_s,
            MetricId::Coagulation => current.coagulation_s,
            MetricId::CoagulationPrecision => ratio(current.coagulation_on_vessel_s, current.coagulation_s),
            MetricId::BleedersClosed => ratio(water.coagulated as f64, water.opened() as f64),
            MetricId::TipPath => motion.path_mm,
            MetricId::Strokes => f64::from(current.strokes),
            MetricId::MassPerStroke => ratio(removal.mass_g(), f64::from(current.strokes)),
            MetricId::RemovalRate => ratio(removal.mass_g(), self.elapsed_s() / 60.0),
            MetricId::LargestContactDepth => motion.largest_depth_mm,
            MetricId::BloodLost => water.blood_ml,
            MetricId::BloodInAll => water.blood_ml + water.to_come_ml,
            MetricId::Irrigated => water.irrigated_ml,
            MetricId::IrrigatedPerGram => ratio(water.irrigated_ml, removal.mass_g()),
            MetricId::Absorbed => water.absorbed_ml,
            MetricId::StepsDone => f64::from(self.steps_done),
            MetricId::BlindTime => water.blind_s,
            MetricId::HiddenShare => ratio(self.view.hidden_s, self.elapsed_s()),
            MetricId::Vaporised => removal.vaporised_g(),
            MetricId::ChipsInBladder => chips.in_body_g,
            MetricId::ChipsFlushed => chips.flushed_g,
            MetricId::Extension(metric) => self.extension(metric),
        }
    }

    /// Simulated time of the run, s: steps times the length of a step, so that no rounding piles up.
    pub fn elapsed_s(&self) -> f64 {
        self.steps as f64 * self.step_s
    }

    /// The value of an extension's metric; 0 of one that the exercise does not name.
    pub(crate) fn extension(&self, metric: ExtensionMetric) -> f64 {
        self.extensions.get(&metric).copied().unwrap_or_default()
    }

    pub(crate) fn count_step(&mut self, observation: &StepObservation) {
        self.steps += 1;
        self.step_s = observation.step_s;
    }
}

/// 0 of nothing.
fn ratio(part: f64, whole: f64) -> f64 {
    if whole > 0.0 { part / whole } else { 0.0 }
}
