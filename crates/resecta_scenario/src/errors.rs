//! What can be wrong with an exercise, said so that its author can mend it: file, place, field, value, what was expected.

use std::{fmt, io, path::PathBuf};

use resecta_anatomy::{CaseError, LatticeError};
use resecta_solver::MeshError;
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
    /// The text is not an exercise: a slip of syntax, an unknown field or name, a value of the wrong kind.
    #[error("{}:{line}:{column}: {field}: {message}{}", file.display(), did_you_mean(nearest))]
    Syntax {
        /// The exercise file.
        file: PathBuf,
        /// Line, from 1.
        line: usize,
        /// Column, from 1.
        column: usize,
        /// Path of the field, for example `scoring[2].metric`; `.` for the file as a whole.
        field: String,
        /// What is wrong there.
        message: String,
        /// The nearest valid name, where a name is unknown.
        nearest: Option<String>,
    },
    /// A field that reads well but breaks a rule.
    #[error("{}: {rule}", file.display())]
    Rule {
        /// The exercise file.
        file: PathBuf,
        /// The field and the rule.
        rule: RuleError,
    },
    /// The case that the exercise names is bad itself.
    #[error("{}: case: {source}", file.display())]
    Case {
        /// The exercise file.
        file: PathBuf,
        /// What is wrong with the case.
        source: CaseError,
    },
    /// No lattice can be built from the case at the exercise's resolution.
    #[error("{}: alpha_deg: {source}", file.display())]
    Lattice {
        /// The exercise file.
        file: PathBuf,
        /// What the lattice builder says.
        source: LatticeError,
    },
    /// The lattice makes no tissue.
    #[error("{}: models: {source}", file.display())]
    Tissue {
        /// The exercise file.
        file: PathBuf,
        /// What the solver says.
        source: MeshError,
    },
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
}

impl RuleError {
    /// A broken rule on a value that is no name.
    pub fn new(field: impl Into<String>, value: impl fmt::Display, expected: impl Into<String>) -> Self {
        Self {
            field: field.into(),
            value: value.to_string(),
            expected: expected.into(),
            nearest: None,
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
        } = self;
        write!(
            formatter,
            "{field} is {value}; expected {expected}{}",
            did_you_mean(nearest)
        )
    }
}

impl std::error::Error for RuleError {}

fn did_you_mean(nearest: &Option<String>) -> String {
    nearest
        .as_ref()
        .map(|name| format!("; did you mean `{name}`?"))
        .unwrap_or_default()
}

/// The valid name that resembles `name` most, if any does (Jaro-Winkler similarity of at least 0.7; the first of equals).
pub fn nearest<'a>(name: &str, valid: impl IntoIterator<Item = &'a str>) -> Option<String> {
    let wanted = name.to_lowercase();
    let mut best = (0.7, None);
    for candidate in valid {
        let likeness = strsim::jaro_winkler(&wanted, &candidate.to_lowercase());
        if likeness > best.0 {
            best = (likeness, Some(candidate));
        }
    }
    best.1.map(str::to_owned)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_nearest_name_is_the_one_with_a_slip_and_none_for_gibberish() {
        let valid = ["small", "medium", "large"];
        assert_eq!(nearest("mediun", valid).as_deref(), Some("medium"));
        assert_eq!(nearest("Larg", valid).as_deref(), Some("large"));
        assert_eq!(nearest("qqq", valid), None);
    }
}
