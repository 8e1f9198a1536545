//! What can be wrong with an exercise, said so that its author can mend it: file, place, field, value, what was expected.

use std::{
    fmt, io,
    path::{Path, PathBuf},
};

use resecta_anatomy::{CaseError, LatticeError};
use resecta_instrument::ScriptError;
use resecta_solver::MeshError;
pub use resecta_text::nearest;
use resecta_text::{Place, Slip, did_you_mean, place_of};
use thiserror::Error;

/// Why an exercise was refused. Nothing changes in the running world when one is returned.
#[derive(Debug, Error)]
pub enum ExerciseError {
    /// The exercise file cannot be read.
    #[error("{}: cannot be read: {source}", file.display())]
    Read {
        /// The file asked for.
        file: PathBuf,
        /// What the system says.
        source: io::Error,
    },
    /// No exercise of that name, or no file at that path.
    #[error("{}: no such exercise file{}", file.display(), did_you_mean(nearest))]
    Missing {
        /// The file looked for.
        file: PathBuf,
        /// The nearest name of an exercise that is there.
        nearest: Option<String>,
    },
    /// An exercise of a mod that cannot be used.
    #[error("{name}: its {why}")]
    Aside {
        /// What was asked for.
        name: String,
        /// What is wrong with the mod.
        why: String,
    },
    /// A name that exercises of several mods have.
    #[error("{name}: several mods have an exercise of this name; expected one of {}", found.join(", "))]
    Ambiguous {
        /// What was asked for.
        name: String,
        /// The exercises, by `mod/name`.
        found: Vec<String>,
    },
    /// The text is not an exercise: a slip of syntax, an unknown field or name, a value of the wrong kind.
    #[error("{}:{slip}", file.display())]
    Syntax {
        /// The exercise file.
        file: PathBuf,
        /// Where in it, what is wrong there, and what was expected.
        slip: Box<Slip>,
    },
    /// A field that reads well but breaks a rule.
    #[error("{}{}: {rule}", file.display(), behind_colon(&rule.place))]
    Rule {
        /// The exercise file.
        file: PathBuf,
        /// The field and the rule.
        rule: Box<RuleError>,
    },
    /// The case that the exercise names is bad itself.
    #[error("{}{}: case: {source}", file.display(), behind_colon(place))]
    Case {
        /// The exercise file.
        file: PathBuf,
        /// Where the field stands in it; none where the file does not mention it.
        place: Option<Place>,
        /// What is wrong with the case.
        source: Box<CaseError>,
    },
    /// The script that shows the exercise is bad itself.
    #[error("{}{}: shown_by: {source}", file.display(), behind_colon(place))]
    Script {
        /// The exercise file.
        file: PathBuf,
        /// Where the field stands in it; none where the file does not mention it.
        place: Option<Place>,
        /// What is wrong with the script.
        source: Box<ScriptError>,
    },
    /// No lattice can be built from the case at the exercise's resolution.
    #[error("{}{}: alpha_deg: {source}", file.display(), behind_colon(place))]
    Lattice {
        /// The exercise file.
        file: PathBuf,
        /// Where the field stands in it; none where the file does not mention it.
        place: Option<Place>,
        /// What the lattice builder says.
        source: LatticeError,
    },
    /// The lattice makes no tissue.
    #[error("{}{}: models: {source}", file.display(), behind_colon(place))]
    Tissue {
        /// The exercise file.
        file: PathBuf,
        /// Where the field stands in it; none where the file does not mention it.
        place: Option<Place>,
        /// What the solver says.
        source: MeshError,
    },
}

impl ExerciseError {
    /// A slip of syntax in a file.
    pub(crate) fn of_slip(file: &Path, slip: Slip) -> Self {
        Self::Syntax {
            file: file.into(),
            slip: slip.into(),
        }
    }

    /// The error with the place of its field in the text of the exercise file, where it has one and it is not known yet.
    pub(crate) fn placed(mut self, text: &str) -> Self {
        let (place, field) = match &mut self {
            Self::Rule { rule, .. } => {
                let RuleError { place, field, .. } = rule.as_mut();
                (place, field.as_str())
            }
            Self::Case { place, .. } => (place, "case"),
            Self::Script { place, .. } => (place, "shown_by"),
            Self::Lattice { place, .. } => (place, "alpha_deg"),
            Self::Tissue { place, .. } => (place, "models"),
            Self::Read { .. }
            | Self::Missing { .. }
            | Self::Aside { .. }
            | Self::Ambiguous { .. }
            | Self::Syntax { .. } => {
                return self;
            }
        };
        *place = place.or_else(|| place_of(text, field));
        self
    }
}

fn behind_colon(place: &Option<Place>) -> String {
    place.map(|place| format!(":{place}")).unwrap_or_default()
}

/// A field, its value and the rule that it breaks.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct RuleError {
    /// Path of the field, for example `goals[0].share`.
    pub field: String,
    /// The value found.
    pub value: String,
    /// What was expected.
    pub expected: String,
    /// The nearest valid name, where a name is unknown.
    pub nearest: Option<String>,
    /// Where the field stands in the file, or what should hold it; none where the file does not mention it.
    pub place: Option<Place>,
}

impl RuleError {
    /// A broken rule on a value that is no name.
    pub fn new(field: impl Into<String>, value: impl fmt::Display, expected: impl Into<String>) -> Self {
        Self {
            field: field.into(),
            value: value.to_string(),
            expected: expected.into(),
            nearest: None,
            place: None,
        }
    }

    /// An unknown name; the nearest of `valid` is suggested.
    pub fn unknown_name<'a>(
        field: impl Into<String>,
        name: &str,
        expected: impl Into<String>,
        valid: impl IntoIterator<Item = &'a str>,
    ) -> Self {
        Self {
            nearest: nearest(name, valid),
            ..Self::new(field, format_args!("\"{name}\""), expected)
        }
    }
}

impl fmt::Display for RuleError {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self {
            field,
            value,
            expected,
            nearest,
            ..
        } = self;
        write!(
            formatter,
            "{field} is {value}; expected {expected}{}",
            did_you_mean(nearest)
        )
    }
}

impl std::error::Error for RuleError {}
