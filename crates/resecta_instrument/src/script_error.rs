//! What can be wrong with a script, said so that its author finds the place.

use std::path::PathBuf;

use resecta_text::{Place, Slip};
use thiserror::Error;

/// Why a script was refused.
#[derive(Error, Debug)]
pub enum ScriptError {
    /// The file cannot be read.
    #[error("{}: cannot be read: {source}", file.display())]
    Read {
        /// The script's file.
        file: PathBuf,
        /// Why.
        source: std::io::Error,
    },
    /// The file is no script: bad RON, an unknown field or a value of the wrong type.
    #[error("{}:{slip}", file.display())]
    Syntax {
        /// The script's file.
        file: PathBuf,
        /// Where in it, what is wrong there, and what was expected.
        slip: Box<Slip>,
    },
    /// The script has no key.
    #[error("{}: keys is empty, expected at least one key", file.display())]
    Empty {
        /// The script's file.
        file: PathBuf,
    },
    /// A key breaks a rule.
    #[error("{}:{place}: keys[{key}]: {rule}", file.display())]
    Rule {
        /// The script's file.
        file: PathBuf,
        /// Where the field's value stands.
        place: Place,
        /// Index of the key, from 0.
        key: usize,
        /// The rule.
        rule: ScriptRule,
    },
}

/// The rule that a key breaks. Values are in the unit that the field's name ends in.
#[derive(Error, Debug, Clone, Copy, PartialEq)]
pub enum ScriptRule {
    /// A number is NaN or infinite.
    #[error("{field} is {value}, expected a finite number")]
    NotFinite {
        /// The field.
        field: &'static str,
        /// Its value.
        value: f64,
    },
    /// A time lies before the start of the script.
    #[error("time_s is {time_s}, expected 0 or later")]
    BeforeStart {
        /// The key's time, s.
        time_s: f64,
    },
    /// A time is not later than the one before.
    #[error("time_s is {time_s}, expected later than {latest_s}, the time of the key before")]
    TimeOrder {
        /// The key's time, s.
        time_s: f64,
        /// The time of the key before, s.
        latest_s: f64,
    },
    /// A value lies outside of the instrument's range.
    #[error("{field} is {value}, expected {min} to {max}")]
    OutOfLimits {
        /// The field.
        field: &'static str,
        /// Its value.
        value: f32,
        /// Smallest value allowed.
        min: f32,
        /// Largest value allowed.
        max: f32,
    },
    /// A value is too far from the last one for the time between them.
    #[error("{field} changes by {speed:.1} a second since {from_s} s, expected at most {max_speed}")]
    TooFast {
        /// The field.
        field: &'static str,
        /// The speed asked for, field's unit per second.
        speed: f64,
        /// Time of the last key that names the field, s.
        from_s: f64,
        /// The fastest allowed, field's unit per second.
        max_speed: f32,
    },
}

impl ScriptRule {
    /// The field of the key.
    pub fn field(&self) -> &'static str {
        match self {
            Self::NotFinite { field, .. } | Self::OutOfLimits { field, .. } | Self::TooFast { field, .. } => field,
            Self::BeforeStart { .. } | Self::TimeOrder { .. } => "time_s",
        }
    }
}
