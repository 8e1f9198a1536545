//! What a page's times were measured on.

use std::{env::consts::ARCH, fs};

/// The processor as the system names it, with its family and model where the name tells little; its architecture alone where
/// the system names none.
pub fn processor() -> String {
    let listed = fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    named(&listed).unwrap_or_else(|| format!("a processor without a name ({ARCH})"))
}

fn named(listed: &str) -> Option<String> {
    let value = |key: &str| {
        let fields = listed.lines().filter_map(|line| line.split_once(':'));
        fields
            .map(|(name, value)| (name.trim(), value.trim()))
            .find(|&(name, _)| name == key)
            .map(|(_, value)| value)
    };
    let name = value("model name")?;
    Some(match (value("cpu family"), value("model")) {
        (Some(family), Some(model)) => format!("{name} (family {family}, model {model})"),
        _ => name.to_string(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_processor_listed_is_named() {
        let listed = "processor\t: 0\ncpu family\t: 6\nmodel\t\t: 143\nmodel name\t: Some Processor\n\n\
                      processor\t: 1\nmodel name\t: Another\n";
        assert_eq!(named(listed).as_deref(), Some("Some Processor (family 6, model 143)"));
        assert_eq!(named("model name : Bare\n").as_deref(), Some("Bare"));
        assert_eq!(named(""), None);
    }
}
