//! On which line each key of a script begins.
//!
//! RON tells the place of what it cannot parse but not of what it could. A key that parsed and breaks a rule is found by
//! this scan for the tuples inside the list inside the outermost tuple.

/// The line (from 1) on which each key begins. The text must have parsed as a script.
pub fn key_lines(text: &str) -> Vec<usize> {
    /// Brackets that are open around a key: the script's and the list's.
    const KEY_DEPTH: usize = 2;
    let mut lines = Vec::new();
    let mut depth = 0_usize;
    let mut line = 1;
    let mut rest = text;
    while let Some(next) = rest.chars().next() {
        let length = match next {
            '/' if rest.starts_with("//") => rest.find('\n').unwrap_or(rest.len()),
            '/' if rest.starts_with("/*") => block_comment_length(rest),
            '(' | '[' | '{' => {
                if next == '(' && depth == KEY_DEPTH {
                    lines.push(line);
                }
                depth += 1;
                1
            }
            ')' | ']' | '}' => {
                depth = depth.saturating_sub(1);
                1
            }
            _ => next.len_utf8(),
        };
        let (passed, after) = rest.split_at(length);
        line += passed.matches('\n').count();
        rest = after;
    }
    lines
}

/// Bytes of the comment that `text` begins with; RON's block comments nest.
fn block_comment_length(text: &str) -> usize {
    let mut depth = 0_usize;
    let mut length = 0;
    while length < text.len() {
        let rest = &text[length..];
        if rest.starts_with("/*") {
            depth += 1;
            length += 2;
        } else if rest.starts_with("*/") {
            depth -= 1;
            length += 2;
            if depth == 0 {
                break;
            }
        } else {
            length += rest.chars().next().map_or(1, char::len_utf8);
        }
    }
    length
}

#[cfg(test)]
mod tests {
    use super::key_lines;

    #[test]
    fn keys_are_found_among_comments_and_brackets() {
        let text = "// ( [ (\n(\n  keys: [ /* ( /* [ */\n( */\n    (time_s: 0.0), (time_s: 1.0),\n\n    (\n time_s: 2.0)\n]\n)";
        assert_eq!(key_lines(text), [5, 5, 7]);
    }

    #[test]
    fn an_attribute_is_no_key() {
        assert_eq!(key_lines("#![enable(implicit_some)]\n(keys: [\n(time_s: 0)])"), [3]);
    }
}
