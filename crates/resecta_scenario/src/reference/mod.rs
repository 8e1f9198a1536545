//! The reference of exercise files, and a schema of them: both made from the types that read the files, so that neither can say
//! anything else than what is read.
//!
//! Types, fields and their descriptions are those of the source; defaults are what the types say when they are written; ranges stand
//! beside the fields as attributes, and a test holds them to the rules. Units are in the names of fields (`_mm`, `_ml_per_s`), or in
//! an attribute `x-unit` where a name has none.

mod page;
mod units;

use std::collections::BTreeMap;

use schemars::{JsonSchema, schema_for};
use serde_json::Value;

use crate::{curriculum::Curriculum, exercise::Exercise, mods::ManifestText};

/// File of the reference.
pub const REFERENCE_FILE: &str = "exercise_reference.md";
/// File of the schema.
pub const SCHEMA_FILE: &str = "exercise.schema.json";

/// The JSON Schema (draft 2020-12) of an exercise.
pub fn schema() -> String {
    let schema = tidy(schema_of::<Exercise>());
    // A tree of names and numbers: JSON writes all of it.
    let mut text = serde_json::to_string_pretty(&schema).expect("a schema is plain data");
    text.push('\n');
    text
}

/// The reference of exercises, manifests of mods and curricula, as a page of Markdown.
pub fn reference() -> String {
    page::page(&[
        ("Exercise", "exercises/NAME.exercise.ron", tidy(schema_of::<Exercise>())),
        ("Mod", "mod.ron", tidy(schema_of::<ManifestText>())),
        ("Curriculum", "curriculum.ron", tidy(schema_of::<Curriculum>())),
    ])
}

fn schema_of<T: JsonSchema>() -> Value {
    schema_for!(T).to_value()
}

/// The same with names in alphabetical order, whatever was built with it, without what only a reader of the source can follow.
fn tidy(value: Value) -> Value {
    match value {
        Value::Object(fields) => {
            let fields: BTreeMap<String, Value> = fields.into_iter().collect();
            let fields = fields.into_iter().map(|(name, value)| {
                let value = match value {
                    Value::String(text) if name == "description" => Value::String(plain(&text)),
                    value => tidy(value),
                };
                (name, value)
            });
            fields.collect::<serde_json::Map<String, Value>>().into()
        }
        Value::Array(values) => values.into_iter().map(tidy).collect(),
        Value::Number(number) => match number.as_f64() {
            // A default of single precision, as it is written.
            Some(value) if number.is_f64() && f64::from(value as f32) == value => {
                let written: f64 = (value as f32).to_string().parse().unwrap_or(value);
                Value::from(written)
            }
            _ => Value::Number(number),
        },
        value => value,
    }
}

/// A comment of the source as text: paragraphs in one line each, names of types without links.
fn plain(text: &str) -> String {
    let paragraphs = text.split("\n\n");
    let paragraphs: Vec<String> = paragraphs
        .map(|paragraph| paragraph.split_whitespace().collect::<Vec<_>>().join(" "))
        .collect();
    let text = paragraphs.join("\n\n");
    let mut parts = text.split("`](");
    let mut plain = parts.next().unwrap_or_default().to_owned();
    for part in parts {
        // Where a link leads.
        let behind = part.split_once(')').map_or(part, |(_, behind)| behind);
        plain.push('`');
        plain.push_str(behind);
    }
    plain.replace("[`", "`").replace("`]", "`")
}
