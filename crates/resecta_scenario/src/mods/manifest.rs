//! The manifest of a mod: what its file `mod.ron` says.

use std::path::{Path, PathBuf};

use schemars::JsonSchema;
use semver::{Version, VersionReq};
use serde::Deserialize;

use crate::{
    errors::{ExerciseError, RuleError},
    template::check_name,
};

/// File of the manifest in a mod's folder.
pub const MANIFEST: &str = "mod.ron";
/// Largest manifest that is read, bytes.
pub const MAX_MANIFEST_BYTES: u64 = 64 << 10;
/// Most characters of a title.
const MAX_TITLE: usize = 80;
/// Most characters of a description.
const MAX_DESCRIPTION: usize = 2000;

/// The manifest as its author wrote it.
#[derive(Debug, Clone, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename = "Mod")]
pub(crate) struct ManifestText {
    /// Name of the mod in files and commands: small letters, digits and `_`, a letter first. No two mods may share one.
    pub id: String,
    /// Name shown to the player, at most 80 characters.
    pub title: String,
    /// Version of the mod, such as `"1.0.0"`.
    pub version: String,
    /// What it is about, at most 2000 characters. Default: nothing.
    #[serde(default)]
    pub description: String,
    /// Versions of Resecta that it works with, such as `"0.1"` or `">=0.1, <0.3"`.
    pub resecta: String,
    /// Mods that must be there, too. Default: none.
    #[serde(default)]
    pub needs: Vec<NeedText>,
    /// Ids of mods that must not be there. Default: none.
    #[serde(default)]
    pub conflicts: Vec<String>,
}

/// A mod that another needs.
#[derive(Debug, Clone, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename = "Need")]
pub(crate) struct NeedText {
    /// Its id.
    pub id: String,
    /// Versions of it that will do, such as `"1.2"`. Default: any.
    #[serde(default = "any_version")]
    pub version: String,
}

fn any_version() -> String {
    "*".into()
}

/// What a mod says of itself.
#[derive(Debug, Clone, PartialEq)]
pub struct Manifest {
    /// Name in files and commands.
    pub id: String,
    /// Name shown to the player.
    pub title: String,
    /// What it is about; may be empty.
    pub description: String,
    /// Its version.
    pub version: Version,
    /// Mods that must be there, too, in which versions.
    pub needs: Vec<(String, VersionReq)>,
    /// Ids of mods that must not be there.
    pub conflicts: Vec<String>,
}

impl Manifest {
    /// Reads a manifest and checks every rule that needs nothing but its text. `file` is named in errors.
    ///
    /// # Errors
    /// All that is wrong with it.
    pub(crate) fn examine(text: &str, file: &Path) -> Result<Self, Vec<ExerciseError>> {
        let read = resecta_text::read::<ManifestText>(text);
        let said = read.map_err(|slip| vec![ExerciseError::of_slip(file, slip)])?;
        let mut rules = Rules(Vec::new());
        rules.id("id", &said.id);
        rules.text("title", &said.title, MAX_TITLE);
        if said.description.chars().count() > MAX_DESCRIPTION {
            let expected = format!("at most {MAX_DESCRIPTION} characters");
            let long = format!("{} characters long", said.description.chars().count());
            rules.0.push(RuleError::new("description", long, expected));
        }
        let version = Version::parse(&said.version);
        if version.is_err() {
            rules.quoted("version", &said.version, "a version of three numbers, such as 1.0.0");
        }
        if let Some(works_with) = rules.requirement("resecta", &said.resecta)
            && !works_with.matches(&ours())
        {
            rules.quoted(
                "resecta",
                &said.resecta,
                format!("versions with {} among them, which this is", ours()),
            );
        }
        let mut needs: Vec<(String, VersionReq)> = Vec::new();
        for (number, need) in said.needs.iter().enumerate() {
            let field = format!("needs[{number}].id");
            rules.id(&field, &need.id);
            if need.id == said.id {
                rules.quoted(&field, &need.id, "another mod than this one");
            } else if needs.iter().any(|(id, _)| *id == need.id) {
                rules.quoted(&field, &need.id, "a mod that is not named before");
            }
            let version = rules.requirement(&format!("needs[{number}].version"), &need.version);
            needs.push((need.id.clone(), version.unwrap_or_default()));
        }
        for (number, id) in said.conflicts.iter().enumerate() {
            let field = format!("conflicts[{number}]");
            rules.id(&field, id);
            if *id == said.id || needs.iter().any(|(need, _)| need == id) {
                rules.quoted(&field, id, "a mod that is neither this one nor needed");
            }
        }
        match version {
            Ok(version) if rules.0.is_empty() => Ok(Self {
                id: said.id,
                title: said.title,
                description: said.description,
                version,
                needs,
                conflicts: said.conflicts,
            }),
            _ => Err(rules
                .0
                .into_iter()
                .map(|rule| broken(file.into(), text, rule))
                .collect()),
        }
    }
}

/// A broken rule with its place in the text of a file.
pub(crate) fn broken(file: PathBuf, text: &str, rule: RuleError) -> ExerciseError {
    let rule = rule.into();
    ExerciseError::Rule { file, rule }.placed(text)
}

/// The version of Resecta.
fn ours() -> Version {
    Version::parse(env!("CARGO_PKG_VERSION")).expect("cargo takes no other version")
}

/// The rules that a manifest breaks.
struct Rules(Vec<RuleError>);

impl Rules {
    fn quoted(&mut self, field: &str, value: &str, expected: impl Into<String>) {
        self.0
            .push(RuleError::new(field, format_args!("\"{value}\""), expected));
    }

    fn id(&mut self, field: &str, id: &str) {
        if let Err(expected) = check_name(id) {
            self.quoted(field, id, expected.trim_start_matches("expected "));
        }
    }

    fn text(&mut self, field: &str, text: &str, most: usize) {
        let length = text.chars().count();
        if text.trim().is_empty() {
            self.0.push(RuleError::new(field, "empty", "some text"));
        } else if length > most {
            let expected = format!("at most {most} characters");
            self.0.push(RuleError::new(
                field,
                format_args!("{length} characters long"),
                expected,
            ));
        }
    }

    fn requirement(&mut self, field: &str, text: &str) -> Option<VersionReq> {
        let read = VersionReq::parse(text);
        if read.is_err() {
            self.quoted(
                field,
                text,
                "versions, such as \"1.2\" (1.2.0 up to 2) or \">=1.2, <1.5\"",
            );
        }
        read.ok()
    }
}
