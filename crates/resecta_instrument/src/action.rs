//! What the operator can do with the instrument.

use bevy::prelude::*;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::InstrumentField;

/// Something that the operator can do with the instrument. Settings files name it as it stands here.
#[derive(Reflect, Serialize, Deserialize, JsonSchema, Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum InstrumentAction {
    /// Push the sheath towards the bladder.
    Advance,
    /// Pull the sheath back.
    Withdraw,
    /// Raise the tip, towards 12 o'clock.
    TipUp,
    /// Lower the tip, towards 6 o'clock.
    TipDown,
    /// Turn the tip to the operator's left, towards 9 o'clock.
    TipLeft,
    /// Turn the tip to the operator's right, towards 3 o'clock.
    TipRight,
    /// Roll counter-clockwise.
    RollLeft,
    /// Roll clockwise.
    RollRight,
    /// Push the loop out.
    LoopOut,
    /// Pull the loop in.
    LoopIn,
    /// Cutting pedal.
    Cut,
    /// Coagulation pedal.
    Coagulate,
    /// Open the tap of the inflow.
    InflowOpen,
    /// Close the tap of the inflow.
    InflowClose,
    /// Open the tap of the outflow.
    OutflowOpen,
    /// Close the tap of the outflow.
    OutflowClose,
}

impl InstrumentAction {
    /// Every action, in the order of the help.
    pub const ALL: [InstrumentAction; 16] = [
        InstrumentAction::Advance,
        InstrumentAction::Withdraw,
        InstrumentAction::TipUp,
        InstrumentAction::TipDown,
        InstrumentAction::TipLeft,
        InstrumentAction::TipRight,
        InstrumentAction::RollLeft,
        InstrumentAction::RollRight,
        InstrumentAction::LoopOut,
        InstrumentAction::LoopIn,
        InstrumentAction::Cut,
        InstrumentAction::Coagulate,
        InstrumentAction::InflowOpen,
        InstrumentAction::InflowClose,
        InstrumentAction::OutflowOpen,
        InstrumentAction::OutflowClose,
    ];

    /// A dense index, the place in [`InstrumentAction::ALL`].
    pub const fn index(self) -> usize {
        self as usize
    }

    /// The field that the action moves and in which sense; nothing for a pedal.
    pub const fn movement(self) -> Option<(InstrumentField, f32)> {
        match self {
            InstrumentAction::Advance => Some((InstrumentField::Insertion, 1.0)),
            InstrumentAction::Withdraw => Some((InstrumentField::Insertion, -1.0)),
            InstrumentAction::TipUp => Some((InstrumentField::Pitch, 1.0)),
            InstrumentAction::TipDown => Some((InstrumentField::Pitch, -1.0)),
            InstrumentAction::TipLeft => Some((InstrumentField::Yaw, -1.0)),
            InstrumentAction::TipRight => Some((InstrumentField::Yaw, 1.0)),
            InstrumentAction::RollLeft => Some((InstrumentField::Roll, -1.0)),
            InstrumentAction::RollRight => Some((InstrumentField::Roll, 1.0)),
            InstrumentAction::LoopOut => Some((InstrumentField::Stroke, 1.0)),
            InstrumentAction::LoopIn => Some((InstrumentField::Stroke, -1.0)),
            InstrumentAction::Cut | InstrumentAction::Coagulate => None,
            InstrumentAction::InflowOpen => Some((InstrumentField::InflowTap, 1.0)),
            InstrumentAction::InflowClose => Some((InstrumentField::InflowTap, -1.0)),
            InstrumentAction::OutflowOpen => Some((InstrumentField::OutflowTap, 1.0)),
            InstrumentAction::OutflowClose => Some((InstrumentField::OutflowTap, -1.0)),
        }
    }

    /// What the help calls it.
    pub const fn label(self) -> &'static str {
        match self {
            InstrumentAction::Advance => "Advance the sheath",
            InstrumentAction::Withdraw => "Withdraw the sheath",
            InstrumentAction::TipUp => "Tip up",
            InstrumentAction::TipDown => "Tip down",
            InstrumentAction::TipLeft => "Tip left",
            InstrumentAction::TipRight => "Tip right",
            InstrumentAction::RollLeft => "Roll counter-clockwise",
            InstrumentAction::RollRight => "Roll clockwise",
            InstrumentAction::LoopOut => "Loop out",
            InstrumentAction::LoopIn => "Loop in",
            InstrumentAction::Cut => "Cutting pedal",
            InstrumentAction::Coagulate => "Coagulation pedal",
            InstrumentAction::InflowOpen => "Open the inflow tap",
            InstrumentAction::InflowClose => "Close the inflow tap",
            InstrumentAction::OutflowOpen => "Open the outflow tap",
            InstrumentAction::OutflowClose => "Close the outflow tap",
        }
    }
}
