//! The reference as a page: a table of fields for each type, in the order in which they are met.

use std::fmt::Write;

use serde_json::Value;

use super::units;

const HEAD: &str = "\
# Exercise files: the reference

Made from the source by `resecta reference --out docs`; a test holds it to be current. The schema beside it, `exercise.schema.json`,
says the same to programs. [mods.md](mods.md) says how files make a mod, and what an editor can do with the schema.

Files are [RON](https://github.com/ron-rs/ron): `(name: value, other: [1, 2])`, comments behind `//`. What has a default may be left
out; `Some(..)` may be left out around a value. Lengths are in mm, times in s, unless a name ends in another unit; the unit `1` is a
share or a mere number.
";

/// The page of these types: name, file, schema.
pub fn page(types: &[(&str, &str, Value)]) -> String {
    let mut page = HEAD.to_owned();
    let mut done: Vec<String> = Vec::new();
    for (name, file, schema) in types {
        let _ = write!(page, "\n## {name}: `{file}`\n\n");
        Section { page: &mut page }.whole(schema);
        let mut waiting = references(schema);
        while !waiting.is_empty() {
            let next = waiting.remove(0);
            let Some(part) = schema["$defs"].get(&next).filter(|_| !done.contains(&next)) else {
                continue;
            };
            let _ = write!(page, "\n### {next}\n\n");
            Section { page: &mut page }.whole(part);
            // Parts of a part stand behind it.
            waiting.splice(0..0, references(part));
            done.push(next);
        }
    }
    page
}

/// The types that a type names, but for what stands in its own `$defs`.
fn references(schema: &Value) -> Vec<String> {
    let mut found = Vec::new();
    match schema {
        Value::Object(fields) => {
            for (name, value) in fields.iter().filter(|(name, _)| *name != "$defs") {
                match value {
                    Value::String(path) if name == "$ref" => found.extend(referred(path)),
                    value => found.extend(references(value)),
                }
            }
        }
        Value::Array(values) => found.extend(values.iter().flat_map(references)),
        _ => {}
    }
    found
}

fn referred(path: &str) -> Option<String> {
    path.rsplit('/').next().map(str::to_owned)
}

struct Section<'a> {
    page: &'a mut String,
}

impl Section<'_> {
    /// Description and fields, or variants, of a type.
    fn whole(&mut self, schema: &Value) {
        if let Some(text) = schema["description"].as_str() {
            let _ = write!(self.page, "{text}\n\n");
        }
        let variants = variants(schema);
        if schema["properties"].is_object() {
            let _ = writeln!(
                self.page,
                "| field | type | unit | range | default | |\n|---|---|---|---|---|---|"
            );
            self.fields("", schema);
        } else if !variants.is_empty() {
            let _ = writeln!(self.page, "| one of | type | unit | range | |\n|---|---|---|---|---|");
            variants.iter().for_each(|variant| self.variant(variant));
        }
    }

    fn fields(&mut self, before: &str, schema: &Value) {
        for (name, field, is_required) in fields(schema) {
            let default = match (is_required, field.get("default")) {
                (true, _) => "required".into(),
                (false, Some(default)) => written(default, field),
                (false, None) => "none".into(),
            };
            let _ = writeln!(
                self.page,
                "| `{before}{name}` | {} | {} | {} | {default} | {} |",
                kind(field),
                unit(name, field),
                range(field),
                cell(field),
            );
        }
    }

    /// A variant, with a row for each of its fields.
    fn variant(&mut self, variant: &Value) {
        if let Some(name) = variant["const"].as_str() {
            let unit = variant["x-unit"].as_str().unwrap_or_default();
            let _ = writeln!(self.page, "| `{name}` | | {unit} | | {} |", cell(variant));
        }
        for (name, inner, _) in fields(variant) {
            if !inner["properties"].is_object() {
                let (kind, unit, range) = (kind(inner), unit("", inner), range(inner));
                let _ = writeln!(
                    self.page,
                    "| `{name}(..)` | {kind} | {unit} | {range} | {} |",
                    cell(variant)
                );
                continue;
            }
            let names: Vec<String> = fields(inner).iter().map(|(name, ..)| format!("{name}: ..")).collect();
            let _ = writeln!(
                self.page,
                "| `{name}({})` | | | | {} |",
                names.join(", "),
                cell(variant)
            );
            for (field_name, field, _) in fields(inner) {
                let (kind, unit, range) = (kind(field), unit(field_name, field), range(field));
                let _ = writeln!(
                    self.page,
                    "| … `{field_name}` | {kind} | {unit} | {range} | {} |",
                    cell(field)
                );
            }
        }
    }
}

/// The fields of a type, those that must be there first: name, schema, whether it must.
fn fields(schema: &Value) -> Vec<(&str, &Value, bool)> {
    let required = schema["required"].as_array();
    let is_required = |name: &str| required.is_some_and(|names| names.iter().any(|other| other == name));
    let fields = schema["properties"].as_object().into_iter().flatten();
    let mut fields: Vec<_> = fields
        .map(|(name, field)| (name.as_str(), field, is_required(name)))
        .collect();
    fields.sort_by_key(|(name, _, is_required)| (!is_required, *name));
    fields
}

/// What an enumeration chooses from; a list of names alone has no descriptions.
fn variants(schema: &Value) -> Vec<&Value> {
    let several = [&schema["oneOf"], &schema["anyOf"]]
        .into_iter()
        .filter_map(Value::as_array)
        .flatten();
    several
        .flat_map(|one| match one["oneOf"].as_array() {
            Some(inner) => inner.iter().collect(),
            None => vec![one],
        })
        .collect()
}

/// What a field holds.
fn kind(field: &Value) -> String {
    if let Some(name) = field["$ref"].as_str().and_then(referred) {
        return format!("[{name}](#{})", name.to_lowercase());
    }
    if let Some(inner) = field["anyOf"].as_array().and_then(|inner| inner.first()) {
        return kind(inner);
    }
    let types: Vec<&str> = match &field["type"] {
        Value::Array(types) => types.iter().filter_map(Value::as_str).collect(),
        one => one.as_str().into_iter().collect(),
    };
    match types.iter().find(|name| **name != "null").copied().unwrap_or_default() {
        "number" => "number".into(),
        "integer" => "whole number".into(),
        "string" => "text".into(),
        "boolean" => "true or false".into(),
        "array" => match field["minItems"].as_u64().filter(|_| field["maxItems"].is_u64()) {
            Some(count) => format!("({count} of: {})", kind(&field["items"])),
            None => format!("list of {}", kind(&field["items"])),
        },
        other => other.into(),
    }
}

fn unit(name: &str, field: &Value) -> String {
    let said = field["x-unit"].as_str().map(str::to_owned);
    said.or_else(|| units::of_name(name)).unwrap_or_default()
}

/// The numbers that a field may have, or how many elements.
fn range(field: &Value) -> String {
    let number = |name: &str| field[name].as_f64().map(decimal);
    let least = number("minimum");
    let above = number("exclusiveMinimum");
    let most = number("maximum");
    match (least, above, most) {
        (Some(least), _, Some(most)) => format!("{least} to {most}"),
        // Numbers that cannot be below 0 anyway say nothing by it.
        (Some(least), _, None)
            if least == "0" && field["format"].as_str().is_some_and(|kind| kind.starts_with("uint")) =>
        {
            String::new()
        }
        (Some(least), _, None) => format!("{least} or more"),
        (None, Some(above), Some(most)) => format!("above {above}, to {most}"),
        (None, Some(above), None) => format!("above {above}"),
        (None, None, Some(most)) => format!("to {most}"),
        (None, None, None) => match (field["minItems"].as_u64(), field["maxItems"].as_u64()) {
            (Some(least), None) => format!("at least {least}"),
            _ => String::new(),
        },
    }
}

/// A number as it is written in files.
fn decimal(number: f64) -> String {
    if number.abs() >= 1e6 {
        format!("{number:e}")
    } else {
        number.to_string()
    }
}

/// A default as it is written in a file.
fn written(default: &Value, field: &Value) -> String {
    match default {
        Value::Null => "none".into(),
        Value::Bool(value) => format!("`{value}`"),
        Value::Number(number) => format!("`{}`", number.as_f64().map_or_else(|| number.to_string(), decimal)),
        Value::String(text) if text.is_empty() => "empty".into(),
        // A name of a variant stands without quotes.
        Value::String(text) if kind(field).starts_with('[') => format!("`{text}`"),
        Value::String(text) => format!("`\"{text}\"`"),
        Value::Array(values) if values.is_empty() => "empty".into(),
        Value::Array(values) => {
            let values: Vec<String> = values
                .iter()
                .map(|value| written(value, field).replace('`', ""))
                .collect();
            format!("`({})`", values.join(", "))
        }
        Value::Object(fields) => match fields.iter().next() {
            // A variant with its fields.
            Some((name, Value::Object(inner))) if fields.len() == 1 && name.starts_with(char::is_uppercase) => {
                let inner: Vec<String> = (inner.iter())
                    .map(|(name, value)| format!("{name}: {}", written(value, field).replace('`', "")))
                    .collect();
                format!("`{name}({})`", inner.join(", "))
            }
            _ => "its own defaults".into(),
        },
    }
}

/// A description in a cell of a table.
fn cell(schema: &Value) -> String {
    let text = schema["description"].as_str().unwrap_or_default();
    text.replace("\n\n", " ").replace('|', "\\|")
}
