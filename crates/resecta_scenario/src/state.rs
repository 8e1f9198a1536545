//! Where a run stands, and what scenarios listen to.

use bevy::prelude::*;
use serde::{Deserialize, Serialize};

/// Whether the exercise is being introduced, played, or over. Metrics are taken only while it runs; whoever drives the
/// app (a player's key, the headless runner) sets it to `Running`, and may end it.
#[derive(Resource, Reflect, Debug, Clone, Copy, PartialEq, Eq, Default)]
#[reflect(Resource, Default)]
pub enum RunState {
    /// Loaded and shown, not measured.
    #[default]
    Briefing,
    /// Being played.
    Running,
    /// Over; metrics and score stay as they are.
    Ended(EndReason),
}

/// Why a run ended.
#[derive(Reflect, Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum EndReason {
    /// Every goal was reached.
    GoalsReached,
    /// The time of the exercise is up.
    TimeUp,
    /// More of the capsule was cut out than the exercise bears.
    Perforated,
    /// The sphincter was injured as often as the exercise bears.
    SphincterInjured,
    /// More blood was lost than the exercise bears.
    BloodLost,
    /// More irrigant got into veins than the exercise bears.
    Absorbed,
    /// The script or recording that plays it came to its end.
    InputEnded,
    /// The player ended it.
    Player,
}

impl EndReason {
    /// Whether it was ended for harm to the patient: no medal is earned then.
    pub const fn is_harm(self) -> bool {
        match self {
            EndReason::Perforated | EndReason::SphincterInjured | EndReason::BloodLost | EndReason::Absorbed => true,
            EndReason::GoalsReached | EndReason::TimeUp | EndReason::InputEnded | EndReason::Player => false,
        }
    }

    /// Why the run ended, as the end of a sentence that begins with the time.
    pub const fn words(self) -> &'static str {
        match self {
            EndReason::GoalsReached => "every goal was reached",
            EndReason::TimeUp => "the time was up",
            EndReason::Perforated => "the capsule was cut open",
            EndReason::SphincterInjured => "the sphincter was injured",
            EndReason::BloodLost => "too much blood was lost",
            EndReason::Absorbed => "too much irrigant got into the veins",
            EndReason::InputEnded => "the input came to its end",
            EndReason::Player => "it was ended",
        }
    }
}

/// Some of a tissue's capsule was cut out during this step by the instrument of the running exercise.
#[derive(EntityEvent, Debug, Clone, PartialEq)]
pub struct CapsulePerforated {
    /// The tissue.
    #[event_target]
    pub tissue: Entity,
    /// Area of the capsule that went in this step, mm².
    pub area_mm2: f64,
    /// The deepest point of the loop at the end of the step, mm.
    pub point: Vec3,
}
