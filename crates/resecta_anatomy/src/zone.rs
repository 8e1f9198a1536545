//! The zones of the gland: which tissue a pentahedron belongs to.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// The tissue that a pentahedron belongs to. Messages, scores and colours go by it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize, JsonSchema)]
#[repr(u8)]
pub enum Zone {
    /// Transition zone left or right of the urethra: the adenoma's lateral lobes.
    LateralLobe,
    /// Transition zone behind the urethra (5 to 7 o'clock) and above the verumontanum: the middle lobe.
    MiddleLobe,
    /// What lies between the transition zone and the capsule.
    Peripheral,
    /// Tissue of an organ that has no such zones.
    Other,
}

impl Zone {
    /// How many zones there are: the length of an array indexed by [`Zone::index`].
    pub const COUNT: usize = 4;

    /// Every zone, in the order of [`Zone::index`].
    pub const ALL: [Zone; Zone::COUNT] = [Zone::LateralLobe, Zone::MiddleLobe, Zone::Peripheral, Zone::Other];

    /// A dense index, for arrays by zone.
    pub const fn index(self) -> usize {
        self as usize
    }

    /// Whether a resection aims at this zone (lateral or middle lobe).
    pub const fn is_adenoma(self) -> bool {
        matches!(self, Zone::LateralLobe | Zone::MiddleLobe)
    }

    /// The name used in reports, as in the RON files.
    pub const fn name(self) -> &'static str {
        match self {
            Zone::LateralLobe => "LateralLobe",
            Zone::MiddleLobe => "MiddleLobe",
            Zone::Peripheral => "Peripheral",
            Zone::Other => "Other",
        }
    }
}
