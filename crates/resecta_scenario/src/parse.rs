//! Text to exercise, with the place of every slip.

use std::path::Path;

use ron::{Options, error::Error as RonError, extensions::Extensions};

use crate::{
    errors::{ExerciseError, nearest},
    exercise::Exercise,
    extension::{self, while_known},
};

impl Exercise {
    /// Reads an exercise from RON and checks every rule that needs nothing but the text. `file` is named in errors.
    pub fn from_ron(text: &str, file: &Path) -> Result<Self, ExerciseError> {
        Self::from_ron_with(text, file, &extension::Extensions::default())
    }

    /// As [`Exercise::from_ron`], where the text may name metrics and goals of these extensions.
    pub fn from_ron_with(text: &str, file: &Path, extensions: &extension::Extensions) -> Result<Self, ExerciseError> {
        let exercise = while_known(extensions, || parse(text, file))?;
        exercise.validate().map_err(|rule| ExerciseError::Rule {
            file: file.into(),
            rule,
        })?;
        Ok(exercise)
    }
}

fn parse(text: &str, file: &Path) -> Result<Exercise, ExerciseError> {
    let syntax = |error: ron::error::SpannedError, field: String| ExerciseError::Syntax {
        file: file.into(),
        line: error.span.end.line,
        column: error.span.end.col,
        field,
        nearest: nearest_name(&error.code),
        message: error.code.to_string(),
    };
    let options = Options::default().with_default_extension(Extensions::IMPLICIT_SOME);
    let mut deserializer =
        ron::Deserializer::from_str_with_options(text, &options).map_err(|error| syntax(error, ".".into()))?;
    let exercise = serde_path_to_error::deserialize(&mut deserializer).map_err(|error| {
        let path = error.path().to_string();
        // A slip inside a list of fields has no field yet; the path then ends in a question mark.
        let field = path.trim_end_matches('?').trim_end_matches('.');
        let field = if field.is_empty() { "." } else { field }.to_owned();
        syntax(deserializer.span_error(error.into_inner()), field)
    })?;
    deserializer
        .end()
        .map_err(|error| syntax(deserializer.span_error(error), ".".into()))?;
    Ok(exercise)
}

/// The valid name nearest to an unknown field or variant.
fn nearest_name(error: &RonError) -> Option<String> {
    match error {
        RonError::NoSuchStructField { expected, found, .. } | RonError::NoSuchEnumVariant { expected, found, .. } => {
            nearest(found, expected.iter().copied())
        }
        _ => None,
    }
}
