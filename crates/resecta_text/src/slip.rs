//! RON to a value, with the place of the first slip.

use std::fmt;

use ron::{
    Options,
    error::{Error, SpannedError},
    extensions::Extensions,
};
use serde::de::DeserializeOwned;

use crate::{
    names::{did_you_mean, nearest},
    place::{BYTE_ORDER_MARK, Place, place_of},
};

/// Why a text could not be read.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Slip {
    /// Where.
    pub place: Place,
    /// Path of the field, for example `scoring[2].metric`; `.` for the file as a whole.
    pub field: String,
    /// What is wrong there and what was expected.
    pub message: String,
    /// The nearest valid name, where a name is unknown.
    pub nearest: Option<String>,
}

impl fmt::Display for Slip {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (field, nearest) = (at_field(&self.field), did_you_mean(&self.nearest));
        write!(f, "{}: {field}{}{nearest}", self.place, self.message)
    }
}

/// The field of a [`Slip`] at the beginning of a message; nothing for the file as a whole.
fn at_field(field: &str) -> String {
    if field == "." {
        String::new()
    } else {
        format!("{field}: ")
    }
}

/// Reads a value from RON; `Some(..)` may be left out around a value, and a byte-order mark before the text is passed over.
///
/// # Errors
/// The first [`Slip`]: what follows it cannot be told apart any more.
pub fn read<T: DeserializeOwned>(text: &str) -> Result<T, Slip> {
    let text = text.strip_prefix(BYTE_ORDER_MARK).unwrap_or(text);
    let options = Options::default().with_default_extension(Extensions::IMPLICIT_SOME);
    let mut deserializer =
        ron::Deserializer::from_str_with_options(text, &options).map_err(|error| slip(text, &error, ".".into()))?;
    let value = serde_path_to_error::deserialize(&mut deserializer).map_err(|error| {
        let path = error.path().to_string();
        // A slip inside a list of fields has no field yet; the path then ends in a question mark.
        let field = path.trim_end_matches('?').trim_end_matches('.');
        let field = if field.is_empty() { "." } else { field }.to_owned();
        slip(text, &deserializer.span_error(error.into_inner()), field)
    })?;
    deserializer
        .end()
        .map_err(|error| slip(text, &deserializer.span_error(error), ".".into()))?;
    Ok(value)
}

fn slip(text: &str, error: &SpannedError, field: String) -> Slip {
    let of = |position: ron::error::Position| Place {
        line: position.line,
        column: position.col,
    };
    let (start, end) = (of(error.span.start), of(error.span.end));
    let mut place = match error.code {
        // The reader has passed over these; at all else it has stopped before.
        Error::NoSuchStructField { .. }
        | Error::NoSuchEnumVariant { .. }
        | Error::DuplicateStructField { .. }
        | Error::ExpectedStringEnd
        | Error::ExpectedDifferentStructName { .. }
        | Error::InvalidEscape(_)
        | Error::NoSuchExtension(_)
        | Error::UnclosedBlockComment => start,
        // Which key of a map it is under is not told: the reader has stopped near it.
        Error::Message(_) if field.contains('?') => end,
        // The reader does not tell where what lacks or exceeds something began.
        Error::MissingStructField { .. }
        | Error::ExpectedDifferentLength { .. }
        | Error::IntegerOutOfBounds
        | Error::InvalidValueForType { .. }
        | Error::Message(_) => place_of(text, &field).unwrap_or(end),
        _ => end,
    };
    if matches!(error.code, Error::NoSuchEnumVariant { .. }) {
        place = text_start(text, place);
    }
    let found = found(text, place);
    let mut message = message(&error.code, &found);
    if error.code == Error::ExpectedComma && text[..place.byte(text)].ends_with('"') {
        // Without its end a text runs on to the beginning of the next one.
        message.push_str("; or a text before has no closing `\"`");
    }
    Slip {
        place,
        nearest: nearest_name(&error.code),
        message,
        field: match &error.code {
            Error::MissingStructField { field: missing, .. } if field == "." => (*missing).to_owned(),
            Error::MissingStructField { field: missing, .. } => format!("{field}.{missing}"),
            _ => field,
        },
    }
}

/// The first place from here on that is not blank.
fn text_start(text: &str, place: Place) -> Place {
    let byte = place.byte(text);
    let rest = &text[byte..];
    Place::at(text, byte + rest.len() - rest.trim_start().len())
}

/// What stands at a place, as a message names it.
fn found(text: &str, place: Place) -> String {
    /// Characters of a word that are shown.
    const SHOWN: usize = 24;
    let rest = &text[place.byte(text)..];
    let rest = rest.trim_start();
    let Some(first) = rest.chars().next() else {
        return "the end of the file".into();
    };
    let is_word = |c: char| c.is_alphanumeric() || "_+-.".contains(c);
    let length = match first {
        '"' => rest[1..].find('"').map_or(rest.len(), |end| end + 2),
        _ if is_word(first) => rest.find(|c| !is_word(c)).unwrap_or(rest.len()),
        _ => first.len_utf8(),
    };
    let word = &rest[..length];
    let line = word.lines().next().unwrap_or(word);
    if line.len() < word.len() || line.chars().count() > SHOWN {
        let shown: String = line.chars().take(SHOWN).collect();
        format!("`{shown}…`")
    } else {
        format!("`{word}`")
    }
}

/// What is wrong, and what was expected.
fn message(error: &Error, found: &str) -> String {
    let expected = |what: &str| format!("expected {what}, found {found}");
    match error {
        Error::Eof => "the file ends before all brackets are closed".into(),
        Error::ExpectedArray => expected("a list that begins with `[`"),
        Error::ExpectedArrayEnd => expected("`]`"),
        Error::ExpectedBoolean => expected("true or false"),
        Error::ExpectedComma if is_fraction(found) => {
            format!("expected `,` or a closing bracket before {found}; the number here is a whole one")
        }
        Error::ExpectedComma => format!("expected `,` or a closing bracket before {found}"),
        Error::ExpectedFloat => expected("a number"),
        Error::ExpectedInteger => expected("a whole number"),
        Error::IntegerOutOfBounds => expected("a whole number, 0 or more and not too large"),
        Error::ExpectedOption => expected("a value or `None`"),
        Error::ExpectedOptionEnd => expected("`)` after the value in `Some(`"),
        Error::ExpectedMapColon => expected("`:` after the name of the field"),
        Error::ExpectedDifferentStructName { expected, found } => {
            format!("expected `(` or `{expected}(`, found `{found}`")
        }
        Error::ExpectedStructLike | Error::ExpectedNamedStructLike(_) => expected("`(`"),
        Error::ExpectedStructLikeEnd => expected("`)`"),
        Error::ExpectedString => expected("text in double quotes"),
        Error::ExpectedStringEnd => "the text that begins here has no closing `\"`".into(),
        Error::ExpectedIdentifier | Error::InvalidIdentifier(_) | Error::SuggestRawIdentifier(_) => {
            let hint = match found.trim_matches('`').chars().next() {
                Some('-' | '0'..='9') => "; a field is written `name: value`, and a number with a decimal point",
                Some('"') => "; names of fields and of choices are written without quotes",
                Some('#') => "; a comment begins with `//`",
                _ => "",
            };
            expected("a name") + hint
        }
        Error::InvalidEscape(_) => "unknown escape in a text; a backslash is written `\\\\`".into(),
        Error::InvalidValueForType { expected, found } => format!("expected {expected}, found {found}"),
        Error::ExpectedDifferentLength { expected, found } => format!("expected {expected}, found {found}"),
        Error::NoSuchExtension(name) => format!("there is no extension `{name}`"),
        Error::UnclosedBlockComment => "the comment that begins here has no closing `*/`".into(),
        Error::TrailingCharacters => expected("nothing more after the last bracket"),
        Error::NoSuchEnumVariant { expected, found, .. } => format!("there is no `{found}`{}", one_of(expected)),
        Error::NoSuchStructField { expected, found, .. } => format!("there is no field `{found}`{}", one_of(expected)),
        Error::MissingStructField { .. } => "is missing".into(),
        Error::DuplicateStructField { field, .. } => format!("`{field}` is given twice"),
        Error::ExceededRecursionLimit => "brackets are nested too deeply".into(),
        other => other.to_string(),
    }
}

/// Whether what was found is the rest of a number behind its decimal point.
fn is_fraction(found: &str) -> bool {
    let digits = found.trim_matches('`').strip_prefix('.');
    digits.is_some_and(|digits| digits.starts_with(|c: char| c.is_ascii_digit()))
}

fn one_of(names: &[&str]) -> String {
    let list: Vec<String> = names.iter().map(|name| format!("`{name}`")).collect();
    match list.as_slice() {
        [] => String::new(),
        [one] => format!("; expected {one}"),
        _ => format!("; expected one of {}", list.join(", ")),
    }
}

/// The valid name nearest to an unknown field or variant.
fn nearest_name(error: &Error) -> Option<String> {
    match error {
        Error::NoSuchStructField { expected, found, .. } | Error::NoSuchEnumVariant { expected, found, .. } => {
            nearest(found, expected.iter().copied())
        }
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde::Deserialize;

    #[derive(Debug, Default, Deserialize)]
    #[serde(deny_unknown_fields, default)]
    #[allow(dead_code)]
    struct Part {
        title: String,
        size: f64,
        count: u32,
        is_on: bool,
        zones: Vec<Zone>,
        goal: Option<Goal>,
        place: Option<[f32; 3]>,
    }

    #[derive(Debug, Deserialize)]
    enum Zone {
        Lobe,
        Other,
    }

    #[derive(Debug, Deserialize)]
    #[serde(deny_unknown_fields)]
    #[allow(dead_code)]
    enum Goal {
        Cut { g: f64 },
    }

    #[track_caller]
    fn slips(text: &str, expected: &str) {
        let slip = read::<Part>(text).unwrap_err();
        let told = format!("{} {}: {}", slip.place, slip.field, slip.message);
        assert_eq!(told, expected, "{text}");
    }

    #[test]
    fn every_slip_tells_place_field_and_what_was_expected() {
        slips(
            "(\n  size: \"long\",\n)",
            "2:9 size: expected a number, found `\"long\"`",
        );
        slips(
            "(\n  size: 1\n  count: 2)",
            "3:3 .: expected `,` or a closing bracket before `count`",
        );
        slips(
            "(\n  size: 1.5mm)",
            "2:12 .: expected `,` or a closing bracket before `mm`",
        );
        slips(
            "(\n  size: 1,5)",
            "2:11 .: expected a name, found `5`; a field is written `name: value`, and a number with a decimal point",
        );
        slips("(\n  size: 1,\n", "3:1 .: the file ends before all brackets are closed");
        slips(
            "(\n  title: \"a,\n)",
            "2:10 title: the text that begins here has no closing `\"`",
        );
        slips(
            "(\n  title: 'a')",
            "2:10 title: expected text in double quotes, found `'`",
        );
        slips(
            "(\n  title = \"a\")",
            "2:9 .: expected `:` after the name of the field, found `=`",
        );
        slips(
            "(\n  zones: Lobe)",
            "2:10 zones: expected a list that begins with `[`, found `Lobe`",
        );
        slips(
            "(\n  zones: [Lobe, Obe])",
            "2:17 zones[1]: there is no `Obe`; expected one of `Lobe`, `Other`",
        );
        slips("(\n  goal: Cut)", "2:12 goal.Cut: expected `(`, found `)`");
        slips(
            "(\n  goal: Cut(3))",
            "2:13 goal.Cut: expected a name, found `3`; a field is written `name: value`, and a number with a decimal point",
        );
        slips("(\n  goal: Cut())", "2:9 goal.Cut.g: is missing");
        slips(
            "(\n  goal: Cut(kg: 1))",
            "2:13 goal.Cut.kg: there is no field `kg`; expected `g`",
        );
        slips(
            "(\n  count: -1)",
            "2:10 count: expected a whole number, 0 or more and not too large, found `-1`",
        );
        slips("(\n  is_on: yes)", "2:10 is_on: expected true or false, found `yes`");
        slips("(\n  size: 1, size: 2)", "2:12 .: `size` is given twice");
        slips(
            "(\n  place: (1, 2))",
            "2:10 place: expected an array of length 3, found 2",
        );
        slips("(\n  place: (1, 2, 3, 4))", "2:20 place: expected `)`, found `4`");
        slips(
            "()\nmore",
            "2:1 .: expected nothing more after the last bracket, found `more`",
        );
        slips("", "1:1 .: expected `(`, found the end of the file");
        slips("Part", "1:5 .: expected `(`, found the end of the file");
        slips("Whole()", "1:1 .: expected `(` or `Part(`, found `Whole`");
        slips(
            "(\n  /* open\n)",
            "2:5 .: the comment that begins here has no closing `*/`",
        );
        slips(
            "(\n  title: \"\\q\")",
            "2:11 title: unknown escape in a text; a backslash is written `\\\\`",
        );
        slips("#![enable(foo)]\n()", "1:11 .: there is no extension `foo`");
    }
}
