//! Who shows an exercise to somebody who wants to watch before they play, and earns its medals in tests.

use std::path::{Path, PathBuf};

use resecta_instrument::{InstrumentLimits, InstrumentScript};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::{
    errors::{ExerciseError, RuleError},
    exercise::Exercise,
    library::{Library, is_path, names_in},
    mods::{Mod, SCRIPTS},
};

/// End of a script file's name.
const SCRIPT_SUFFIX: &str = ".ron";

/// Who shows how an exercise is done.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub enum ShownBy {
    /// The careful one of the scripted players: it cuts the marked tissue layer by layer, off the capsule and above the verumontanum,
    /// and closes bleeders.
    Careful,
    /// A script of the instrument, by the name of a shipped one (`"orientation"` is `scripts/orientation.ron` among the assets) or of one
    /// of the exercise's own mod, or by the path of a `*.ron` file, relative to the exercise file.
    Script(String),
}

/// What shows an exercise, its script read.
#[derive(Debug, Clone, PartialEq)]
pub enum Demonstration {
    /// The careful one of the scripted players.
    Careful,
    /// A script.
    Script(InstrumentScript),
}

impl Library {
    /// What shows this exercise, which stands in `file`, of this mod.
    pub(crate) fn demonstration(
        &self,
        exercise: &Exercise,
        file: &Path,
        of: Option<&Mod>,
    ) -> Result<Option<Demonstration>, ExerciseError> {
        let script = match &exercise.shown_by {
            None => return Ok(None),
            Some(ShownBy::Careful) => return Ok(Some(Demonstration::Careful)),
            Some(ShownBy::Script(script)) => script,
        };
        let found = match of {
            Some(of) => self.script_of_mod(script, file, of),
            None => self.script_file(script, file),
        };
        let found = found.map_err(|rule| ExerciseError::Rule {
            file: file.into(),
            rule: rule.into(),
        })?;
        let script = InstrumentScript::load(&found, &InstrumentLimits::default());
        let script = script.map_err(|source| ExerciseError::Script {
            file: file.into(),
            place: None,
            source: source.into(),
        })?;
        Ok(Some(Demonstration::Script(script)))
    }

    fn script_file(&self, script: &str, exercise_file: &Path) -> Result<PathBuf, RuleError> {
        if is_path(script, SCRIPT_SUFFIX) {
            let path = exercise_file.parent().unwrap_or(Path::new("")).join(script);
            return there(script, path);
        }
        let shipped = self.assets().join(SCRIPTS);
        named(script, &[("a shipped script", &shipped)])
    }

    fn script_of_mod(&self, script: &str, exercise_file: &Path, of: &Mod) -> Result<PathBuf, RuleError> {
        let refused = |expected: &'static str| RuleError::new(FIELD, quoted(script), expected);
        if is_path(script, SCRIPT_SUFFIX) {
            let folder = exercise_file.parent().unwrap_or(of.folder());
            let path = of.fence.path(folder, script).map_err(refused)?;
            return there(script, path);
        }
        let shipped = self.assets().join(SCRIPTS);
        let own = of.fence.path(of.folder(), SCRIPTS).map_err(refused)?;
        named(script, &[("a script of the mod", &own), ("a shipped one", &shipped)])
    }
}

/// The path of the field in errors.
const FIELD: &str = "shown_by.Script";

fn quoted(script: &str) -> String {
    format!("\"{script}\"")
}

fn there(script: &str, path: PathBuf) -> Result<PathBuf, RuleError> {
    if path.is_file() {
        return Ok(path);
    }
    let expected = format!("a script file, but there is none at {}", path.display());
    Err(RuleError::new(FIELD, quoted(script), expected))
}

/// The script of a name in the first of these folders that has it.
fn named(script: &str, folders: &[(&str, &Path)]) -> Result<PathBuf, RuleError> {
    let mut expected = Vec::new();
    let mut all = Vec::new();
    for (what, folder) in folders {
        let names = names_in(folder, SCRIPT_SUFFIX);
        if names.iter().any(|name| name == script) {
            return Ok(folder.join(format!("{script}{SCRIPT_SUFFIX}")));
        }
        let list = match names.join(", ") {
            none if none.is_empty() => "there is none".into(),
            list => list,
        };
        expected.push(format!("{what} ({list})"));
        all.extend(names);
    }
    let names = all.iter().map(String::as_str);
    Err(RuleError::unknown_name(FIELD, script, expected.join(" or "), names))
}
