//! Text to exercise, with the place of every fault.

use std::path::Path;

use crate::{
    errors::ExerciseError,
    exercise::Exercise,
    extension::{Extensions, while_known},
};

impl Exercise {
    /// Reads an exercise from RON and checks every rule that needs nothing but the text. `file` is named in errors.
    ///
    /// # Errors
    /// The first of [`Exercise::examine`].
    pub fn from_ron(text: &str, file: &Path) -> Result<Self, ExerciseError> {
        Self::from_ron_with(text, file, &Extensions::default())
    }

    /// As [`Exercise::from_ron`], where the text may name metrics and goals of these extensions.
    ///
    /// # Errors
    /// The first of [`Exercise::examine`].
    pub fn from_ron_with(text: &str, file: &Path, extensions: &Extensions) -> Result<Self, ExerciseError> {
        match Self::examine(text, file, extensions) {
            Ok((exercise, faults)) => faults.into_iter().next().map_or(Ok(exercise), Err),
            Err(slip) => Err(slip),
        }
    }

    /// Reads an exercise from RON, with every rule that it breaks of those that need nothing but the text, which may name metrics and
    /// goals of these extensions.
    ///
    /// # Errors
    /// [`ExerciseError::Syntax`]: the text is no exercise. What follows the first slip is not known.
    pub fn examine(
        text: &str,
        file: &Path,
        extensions: &Extensions,
    ) -> Result<(Self, Vec<ExerciseError>), ExerciseError> {
        let read = while_known(extensions, || resecta_text::read(text));
        let exercise: Self = read.map_err(|slip| ExerciseError::of_slip(file, slip))?;
        let faults = exercise.faults().into_iter().map(|rule| {
            let (file, rule) = (file.into(), rule.into());
            ExerciseError::Rule { file, rule }.placed(text)
        });
        let faults = faults.collect();
        Ok((exercise, faults))
    }
}
