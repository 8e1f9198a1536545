//! The one table of metrics: what the exercise file may name, the report prints and a panel shows.

use std::{borrow::Cow, fmt, ops::RangeInclusive};

use bevy::reflect::Reflect;
use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::{Deserialize, Deserializer, Serialize, Serializer, de};

use crate::extension::{ExtensionMetric, known_metric};

/// Which way a metric improves. Pars of a score line must run that way.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Reflect)]
pub enum Better {
    /// More is better.
    More,
    /// Less is better.
    Less,
    /// Neither: it describes a run.
    Neither,
}

/// What a metric is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct MetricInfo {
    /// Name in exercise files and reports.
    pub id: &'static str,
    /// Name shown to the player.
    pub title: &'static str,
    /// Unit; `1` for shares and counts.
    pub unit: &'static str,
    /// Which way it improves.
    pub better: Better,
    /// What is measured, and what counts.
    pub doc: &'static str,
}

macro_rules! metrics {
    ($($(#[doc = $doc:literal])+ $variant:ident = $id:literal, $title:literal, $unit:literal, $better:ident;)+) => {
        /// A metric of a run; written in files by its id, for example `"marked_removed_share"`.
        #[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Reflect)]
        pub enum MetricId {
            $($(#[doc = $doc])+ $variant,)+
            /// A metric of an extension.
            Extension(ExtensionMetric),
        }

        impl MetricId {
            /// Every built-in metric, in the order of reports.
            pub const ALL: &'static [MetricId] = &[$(MetricId::$variant,)+];

            /// What this metric is.
            pub const fn info(self) -> MetricInfo {
                match self {
                    $(MetricId::$variant => MetricInfo {
                        id: $id,
                        title: $title,
                        unit: $unit,
                        better: Better::$better,
                        doc: concat!($($doc),+).trim_ascii(),
                    },)+
                    MetricId::Extension(metric) => metric.info(),
                }
            }
        }
    };
}

metrics! {
    /// Simulated time from the start of the run.
    Elapsed = "elapsed_s", "Time", "s", Less;
    /// Volume of all tissue removed, by its volume at rest.
    Removed = "removed_mm3", "Volume removed", "mm3", Neither;
    /// Mass of all tissue removed: volume at rest times the density of the material. Chips weigh 21 to 25 % less.
    RemovedMass = "removed_g", "Tissue removed", "g", Neither;
    /// Volume removed from the lateral lobes.
    LateralLobeRemoved = "lateral_lobe_removed_mm3", "Lateral lobes removed", "mm3", More;
    /// Volume removed from the middle lobe.
    MiddleLobeRemoved = "middle_lobe_removed_mm3", "Middle lobe removed", "mm3", More;
    /// Volume removed between transition zone and capsule.
    PeripheralRemoved = "peripheral_removed_mm3", "Peripheral zone removed", "mm3", Less;
    /// Volume removed from tissue that belongs to no zone of the prostate.
    OtherRemoved = "other_removed_mm3", "Other tissue removed", "mm3", Neither;
    /// Removed share of the adenoma, lateral and middle lobes together.
    AdenomaRemovedShare = "adenoma_removed_share", "Adenoma removed", "1", More;
    /// Volume removed inside the marked region.
    MarkedRemoved = "marked_removed_mm3", "Marked volume removed", "mm3", More;
    /// Removed share of the marked region.
    MarkedRemovedShare = "marked_removed_share", "Marked tissue removed", "1", More;
    /// Share of all that was removed that was not marked; 0 before anything was.
    UnmarkedShare = "unmarked_share", "Cut beside the mark", "1", Less;
    /// Volume removed that is no adenoma.
    HealthyRemoved = "healthy_removed_mm3", "Healthy tissue removed", "mm3", Less;
    /// Separate times that the loop met the capsule with current on: touching or cutting it, at least 0.25 s apart. It ends at the
    /// bladder neck.
    CapsuleTouches = "capsule_touches", "Capsule touched", "1", Less;
    /// Time with the loop on the capsule and current on.
    CapsuleTouchTime = "capsule_touch_s", "Time on the capsule", "s", Less;
    /// Area of capsule that was cut out.
    CapsuleCut = "capsule_cut_mm2", "Area of capsule cut", "mm2", Less;
    /// Share of the capsule's surface that was cut out.
    CapsuleCutShare = "capsule_cut_share", "Capsule cut", "1", Less;
    /// Separate times that the loop met tissue below the verumontanum with current on: touching or cutting it, at least 0.25 s
    /// apart. There the sphincter lies.
    SphincterInjuries = "sphincter_injuries", "Sphincter injuries", "1", Less;
    /// Times that the sheath was pushed on where tissue held it, until the tissue tore: a false passage. Pushing on in the same place
    /// counts once.
    FalsePassages = "false_passages", "False passages", "1", Less;
    /// Time with current on while the loop neither touched nor removed tissue, or was drawn in.
    CurrentWithoutContact = "current_without_contact_s", "Current without contact", "s", Less;
    /// Time with the coagulating current on.
    Coagulation = "coagulation_s", "Coagulation", "s", Neither;
    /// Share of the time with the coagulating current on in which the loop touched tissue within reach of a vessel that bled
    /// until then; 0 before the first.
    CoagulationPrecision = "coagulation_precision_share", "Coagulation on bleeders", "1", More;
    /// Share of the vessels that have bled that a coagulating current has closed; 0 before the first.
    BleedersClosed = "bleeders_closed_share", "Bleeders closed", "1", More;
    /// Length of the path of the sheath's tip.
    TipPath = "tip_path_mm", "Path of the tip", "mm", Less;
    /// Presses of the cutting pedal that removed tissue.
    Strokes = "strokes", "Cuts", "1", Neither;
    /// Mass removed per press of the cutting pedal that removed tissue; 0 before the first.
    MassPerStroke = "g_per_stroke", "Mass per cut", "g", More;
    /// Mass removed a minute, over the whole time; 0 at the start.
    RemovalRate = "g_per_min", "Removal rate", "g/min", More;
    /// Deepest overlap of the instrument with tissue at the beginning of a step.
    LargestContactDepth = "largest_contact_depth_mm", "Largest contact depth", "mm", Less;
    /// Blood lost through opened vessels; 0 where the exercise has none.
    BloodLost = "blood_lost_ml", "Blood lost", "ml", Less;
    /// Blood lost, and what vessels that are left open would go on to lose against no pressure until their clots close them: it
    /// does not stop with the run.
    BloodInAll = "blood_in_all_ml", "Blood in all", "ml", Less;
    /// Irrigant that came from the bag.
    Irrigated = "irrigated_ml", "Irrigant used", "ml", Less;
    /// Irrigant that came from the bag for each gram removed; 0 before anything was.
    IrrigatedPerGram = "irrigated_ml_per_g", "Irrigant for a gram", "ml/g", Less;
    /// Irrigant that got into opened veins.
    Absorbed = "absorbed_ml", "Irrigant absorbed", "ml", Less;
    /// Steps of the exercise that are done; 0 where it has none.
    StepsDone = "steps_done", "Steps done", "1", More;
    /// Time in which less than 30 % of the light came back to the lens.
    BlindTime = "blind_s", "Time without a view", "s", Less;
    /// Share of the time in which tissue less than 4 mm from the lens hid most of what it looks at: four or five of five directions, the
    /// middle of the picture and two thirds of the way to its rim.
    HiddenShare = "hidden_share", "Tissue before the lens", "1", Less;
    /// Mass of the removed tissue that the cutting current vaporised, so that it is in no chip. It counts when a stroke's chip is made.
    Vaporised = "vaporised_g", "Vaporised", "g", Less;
    /// Mass of cut tissue that is still in bladder and urethra, shreds included; 0 where the exercise lets no chips float.
    ChipsInBladder = "chips_in_bladder_g", "Chips in the bladder", "g", Less;
    /// Mass of cut tissue that was flushed out through the sheath; 0 where the exercise lets no chips float.
    ChipsFlushed = "chips_flushed_g", "Chips flushed out", "g", More;
}

impl MetricId {
    /// Whether its values are shares, read in per cent: those whose ids end so.
    pub fn is_share(self) -> bool {
        self.info().id.ends_with("_share")
    }

    /// What its values can be: 0 to 1 for shares, 0 or more for all else that is built in.
    pub fn range(self) -> RangeInclusive<f64> {
        match self {
            MetricId::Extension(_) => f64::NEG_INFINITY..=f64::INFINITY,
            _ if self.is_share() => 0.0..=1.0,
            _ => 0.0..=f64::INFINITY,
        }
    }

    /// The built-in metric of this id.
    pub fn from_id(id: &str) -> Option<Self> {
        Self::ALL.iter().copied().find(|metric| metric.info().id == id)
    }
}

impl fmt::Display for MetricId {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(self.info().id)
    }
}

impl Serialize for MetricId {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(self.info().id)
    }
}

impl JsonSchema for MetricId {
    fn schema_name() -> Cow<'static, str> {
        "MetricId".into()
    }

    fn json_schema(_: &mut SchemaGenerator) -> Schema {
        let ids = MetricId::ALL.iter().map(|metric| {
            let MetricInfo { id, doc, unit, .. } = metric.info();
            json_schema!({"type": "string", "const": id, "description": doc.trim(), "x-unit": unit})
        });
        let ids: Vec<Schema> = ids.collect();
        json_schema!({
            "description": "A metric, by id: one of those below, or an extension's.",
            "anyOf": [{"oneOf": ids}, {"type": "string"}],
        })
    }
}

impl<'de> Deserialize<'de> for MetricId {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        known_metric(&String::deserialize(deserializer)?).map_err(de::Error::custom)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ids_are_unique_and_read_back() {
        for &metric in MetricId::ALL {
            assert_eq!(MetricId::from_id(metric.info().id), Some(metric));
            let text = serde_json::to_string(&metric).unwrap();
            assert_eq!(serde_json::from_str::<MetricId>(&text).unwrap(), metric);
        }
    }

    #[test]
    fn every_metric_says_what_it_measures() {
        for metric in MetricId::ALL {
            let info = metric.info();
            assert!(
                info.doc.ends_with('.') && !info.title.is_empty() && !info.unit.is_empty(),
                "{info:?}"
            );
        }
    }
}
