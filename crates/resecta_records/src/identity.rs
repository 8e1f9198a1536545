//! Which build of the program this is.

use std::fmt;

use serde::{Deserialize, Serialize};

/// A build of the program. Two that are equal play a record to the same bits.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Build {
    /// Version of the program.
    pub version: String,
    /// Processor and system, such as `x86_64-linux`: elementary functions round as each system has them.
    pub platform: String,
    /// Hash of the simulation's sources, of the versions of what it depends on and of the compiler, hexadecimal.
    pub sources: String,
}

impl Build {
    /// This one.
    pub fn this() -> Self {
        use std::env::consts::{ARCH, OS};
        Self {
            version: env!("CARGO_PKG_VERSION").into(),
            platform: format!("{ARCH}-{OS}"),
            sources: env!("RESECTA_SOURCES").into(),
        }
    }
}

impl fmt::Display for Build {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self {
            version,
            platform,
            sources,
        } = self;
        write!(formatter, "resecta {version} for {platform} (sources {sources})")
    }
}
