//! The name that was meant.

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

/// The end of a message that suggests a name; empty where there is none.
pub fn did_you_mean(nearest: &Option<String>) -> String {
    nearest
        .as_ref()
        .map(|name| format!("; did you mean `{name}`?"))
        .unwrap_or_default()
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
