//! Where a field stands in a text of RON.
//!
//! A scanner that knows brackets, texts and comments, and nothing of types: it follows the path of a field from bracket to
//! bracket. It is used on texts that have been read without a slip, or up to their first one.

use std::fmt;

/// What some editors write before a text.
pub(crate) const BYTE_ORDER_MARK: char = '\u{feff}';

/// A place in a text.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct Place {
    /// Line, from 1.
    pub line: usize,
    /// Column in characters, from 1.
    pub column: usize,
}

impl Default for Place {
    /// The beginning.
    fn default() -> Self {
        Self { line: 1, column: 1 }
    }
}

impl Place {
    /// The place of a byte.
    pub(crate) fn at(text: &str, byte: usize) -> Self {
        let before = &text[..byte];
        let line_start = before.rfind('\n').map_or(0, |end| end + 1);
        Self {
            line: before.matches('\n').count() + 1,
            column: before[line_start..].chars().count() + 1,
        }
    }

    /// The byte at a place; the end of the text where there is none.
    pub(crate) fn byte(self, text: &str) -> usize {
        let mut start = 0;
        for _ in 1..self.line {
            match text[start..].find('\n') {
                Some(end) => start += end + 1,
                None => return text.len(),
            }
        }
        let mut places = text[start..].char_indices().map(|(byte, _)| start + byte);
        places.nth(self.column.saturating_sub(1)).unwrap_or(text.len())
    }
}

impl fmt::Display for Place {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(formatter, "{}:{}", self.line, self.column)
    }
}

/// Where the value of a field begins, for example of `goals[0].RemoveMarked.share`; `.` is the whole. Where the text leaves out
/// the end of the path, the place of what holds it; none where it leaves out all of it.
pub fn place_of(text: &str, field: &str) -> Option<Place> {
    let text = text.strip_prefix(BYTE_ORDER_MARK).unwrap_or(text);
    let mut scanner = Scanner { text, at: 0 };
    scanner.skip_attributes();
    if field == "." {
        return Some(Place::at(text, scanner.at));
    }
    let mut found = None;
    let mut path = segments(field).peekable();
    while let Some(&segment) = path.peek() {
        scanner.skip_blank();
        let start = scanner.at;
        if let Some(name) = scanner.name() {
            scanner.skip_blank();
            if segment == Segment::Name(name) && found.is_some() {
                path.next();
                found = Some(start);
                continue;
            }
            if name == "Some" && scanner.enter(&['(']) {
                continue;
            }
        }
        let entered = match segment {
            Segment::Name(name) => scanner.enter(&['(']) && scanner.find_field(name),
            Segment::Index(index) => scanner.enter(&['[', '(']) && scanner.find_element(index),
        };
        if !entered {
            break;
        }
        path.next();
        found = Some(scanner.at);
    }
    found.map(|byte| Place::at(text, byte))
}

/// A step of a path.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Segment<'a> {
    /// A field, or a variant.
    Name(&'a str),
    /// An element of a list.
    Index(usize),
}

fn segments(field: &str) -> impl Iterator<Item = Segment<'_>> {
    let parts = field.split(['.', '[']).filter(|part| !part.is_empty());
    parts.map(|part| match part.strip_suffix(']').map(str::parse) {
        Some(Ok(index)) => Segment::Index(index),
        _ => Segment::Name(part),
    })
}

/// Reads a text from bracket to bracket.
struct Scanner<'a> {
    text: &'a str,
    at: usize,
}

impl<'a> Scanner<'a> {
    fn rest(&self) -> &'a str {
        &self.text[self.at..]
    }

    /// Passes over what comes before the first value: extensions of the format.
    fn skip_attributes(&mut self) {
        self.skip_blank();
        while self.rest().starts_with("#!") {
            self.at += self.rest().find(']').map_or(self.rest().len(), |end| end + 1);
            self.skip_blank();
        }
    }

    /// Passes over spaces, ends of lines and comments.
    fn skip_blank(&mut self) {
        loop {
            let rest = self.rest();
            let blank = rest.len() - rest.trim_start().len();
            let comment = &rest[blank..];
            self.at += blank
                + if comment.starts_with("//") {
                    comment.find('\n').unwrap_or(comment.len())
                } else if comment.starts_with("/*") {
                    block_comment(comment)
                } else if blank > 0 {
                    0
                } else {
                    return;
                };
        }
    }

    /// Takes a name of a field or of a variant.
    fn name(&mut self) -> Option<&'a str> {
        let rest = self.rest();
        let is_first = |c: char| c.is_alphabetic() || c == '_';
        if !rest.starts_with(is_first) || raw_text(rest).is_some() {
            return None;
        }
        let end = rest.find(|c: char| !(c.is_alphanumeric() || c == '_'));
        let name = &rest[..end.unwrap_or(rest.len())];
        self.at += name.len();
        Some(name)
    }

    /// Takes one of these brackets.
    fn enter(&mut self, brackets: &[char]) -> bool {
        self.skip_blank();
        let is_there = self.rest().starts_with(brackets);
        self.at += usize::from(is_there);
        is_there
    }

    /// From behind `(` to the value of the field of this name.
    fn find_field(&mut self, wanted: &str) -> bool {
        loop {
            self.skip_blank();
            let Some(name) = self.name() else { return false };
            self.skip_blank();
            if !self.rest().starts_with(':') {
                return false;
            }
            self.at += 1;
            self.skip_blank();
            if name == wanted {
                return true;
            }
            if !self.skip_value() {
                return false;
            }
        }
    }

    /// From behind a bracket to the element of this number.
    fn find_element(&mut self, index: usize) -> bool {
        let is_there = (0..index).all(|_| self.skip_value());
        self.skip_blank();
        is_there && !self.rest().is_empty() && !self.rest().starts_with([')', ']'])
    }

    /// Passes over a value and the comma behind it; false where no comma follows.
    fn skip_value(&mut self) -> bool {
        let mut depth = 0;
        loop {
            self.skip_blank();
            let rest = self.rest();
            let Some(next) = rest.chars().next() else { return false };
            let length = match next {
                '"' => quoted(rest),
                'r' => raw_text(rest).unwrap_or(1),
                // A quote in quotes.
                '\'' => ["'\"'", "'\\\"'", "'\\''"]
                    .into_iter()
                    .find(|character| rest.starts_with(character))
                    .map_or(1, str::len),
                '(' | '[' | '{' => {
                    depth += 1;
                    1
                }
                ')' | ']' | '}' if depth == 0 => return false,
                ')' | ']' | '}' => {
                    depth -= 1;
                    1
                }
                ',' if depth == 0 => {
                    self.at += 1;
                    return true;
                }
                other => other.len_utf8(),
            };
            self.at += length;
        }
    }
}

/// Length of the comment that a text begins with, comments within it included.
fn block_comment(text: &str) -> usize {
    let (mut at, mut depth) = (2, 1);
    while depth > 0 {
        let (open, close) = (text[at..].find("/*"), text[at..].find("*/"));
        match (open, close) {
            (Some(open), Some(close)) if open < close => {
                depth += 1;
                at += open + 2;
            }
            (_, Some(close)) => {
                depth -= 1;
                at += close + 2;
            }
            _ => return text.len(),
        }
    }
    at
}

/// Length of the quoted text that a text begins with.
fn quoted(text: &str) -> usize {
    let mut is_escaped = false;
    for (byte, character) in text.char_indices().skip(1) {
        match character {
            _ if is_escaped => is_escaped = false,
            '\\' => is_escaped = true,
            '"' => return byte + 1,
            _ => {}
        }
    }
    text.len()
}

/// Length of the raw text, `r#".."#`, that a text begins with, if it does.
fn raw_text(text: &str) -> Option<usize> {
    let behind = text.strip_prefix('r')?;
    let hashes = behind.len() - behind.trim_start_matches('#').len();
    let content = behind[hashes..].strip_prefix('"')?;
    let end = format!("\"{}", "#".repeat(hashes));
    let length = content.find(&end).map_or(content.len(), |at| at + end.len());
    Some(1 + hashes + 1 + length)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const TEXT: &str = r##"// Made by hand: (title: "no").
Exercise(
    title: "A ( [ \" // text",
    raw: r#"a " ( b"#, /* comment: ( */
    marked: Some((zones: [LateralLobe, MiddleLobe])),
    goals: [FinishSteps, RemoveMarked(share: 1.9)],
    instrument: (pivot_mm: (0, 1, é)),
    limits: (time_s: 3),
)
"##;

    #[test]
    fn a_field_is_found_by_its_path() {
        let place = |field| place_of(TEXT, field).map(|place| (place.line, place.column));
        assert_eq!(place("."), Some((2, 1)));
        assert_eq!(place("title"), Some((3, 12)));
        assert_eq!(place("marked.zones"), Some((5, 26)));
        assert_eq!(place("marked.zones[1]"), Some((5, 40)));
        assert_eq!(place("goals[0]"), Some((6, 13)));
        assert_eq!(place("goals[1].RemoveMarked.share"), Some((6, 46)));
        assert_eq!(place("instrument.pivot_mm[2]"), Some((7, 35)));
        assert_eq!(place("limits.time_s"), Some((8, 22)));
    }

    #[test]
    fn what_is_left_out_is_where_its_holder_is() {
        let place = |field| place_of(TEXT, field).map(|place| (place.line, place.column));
        assert_eq!(place("limits.absorbed_ml"), Some((8, 13)));
        assert_eq!(place("marked.zones[2]"), Some((5, 26)));
        assert_eq!(place("models.water"), None);
        assert_eq!(place_of("", "title"), None);
    }

    proptest! {
        #[test]
        fn any_text_is_survived(text in "[()\\[\\]{}:,\"'r#/*a-c é\n\\\\]{0,60}", field in "[a-c.\\[\\]0-2]{0,9}") {
            let _ = place_of(&text, &field);
        }
    }
}
