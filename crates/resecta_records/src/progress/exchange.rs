//! Progress as files that other machines and programs read.

use std::{fs::File, io::Read, path::Path};

use serde::{Deserialize, Serialize};

use super::{PastRun, Progress, ProgressError, run};
use crate::record::{RECORD_SUFFIX, RunRecord};

/// Version of the JSON export.
pub const EXPORT_FORMAT: u32 = 1;
/// Largest export that is read, bytes: some hundred thousand runs.
const MAX_EXPORT_BYTES: u64 = 256 << 20;

/// The JSON export: everything but the records themselves.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Export {
    /// [`EXPORT_FORMAT`].
    pub format: u32,
    /// In the order in which they ended.
    pub runs: Vec<PastRun>,
}

impl Export {
    /// The export of these runs.
    pub fn new(runs: Vec<PastRun>) -> Self {
        Self {
            format: EXPORT_FORMAT,
            runs,
        }
    }

    /// Its text.
    pub fn to_json(&self) -> String {
        // Plain data with string keys: JSON writes all of it.
        let mut text = serde_json::to_string_pretty(self).expect("an export is plain data");
        text.push('\n');
        text
    }

    fn load(file: &Path) -> Result<Self, String> {
        let mut bytes = Vec::new();
        let read = File::open(file).and_then(|file| file.take(MAX_EXPORT_BYTES + 1).read_to_end(&mut bytes));
        read.map_err(|error| error.to_string())?;
        if bytes.len() as u64 > MAX_EXPORT_BYTES {
            return Err(format!(
                "is larger than {MAX_EXPORT_BYTES} bytes, the most that is read"
            ));
        }
        #[derive(Deserialize)]
        struct Versioned {
            format: u32,
        }
        let wanted = format!("expected a record ({RECORD_SUFFIX}) or what `resecta progress --json` writes");
        let versioned: Versioned = serde_json::from_slice(&bytes).map_err(|error| format!("{error}; {wanted}"))?;
        if versioned.format != EXPORT_FORMAT {
            return Err(format!(
                "is an export of version {}; this program knows {EXPORT_FORMAT}",
                versioned.format
            ));
        }
        serde_json::from_slice(&bytes).map_err(|error| error.to_string())
    }
}

impl Progress {
    /// Adds what another machine exported, or the run of a record. Returns how many runs the file has, and how many of them were
    /// new.
    ///
    /// # Errors
    /// [`ProgressError`] names the file and what is wrong with it; nothing of it was added then.
    pub fn import(&mut self, file: &Path) -> Result<(usize, usize), ProgressError> {
        let runs = if file.to_string_lossy().ends_with(RECORD_SUFFIX) {
            let (record, identity) = RunRecord::load(file)?;
            vec![PastRun::of_record(&record, &identity, run::ended_at(file))]
        } else {
            let export = Export::load(file);
            let export = export.map_err(|what| ProgressError::Import {
                file: file.into(),
                what,
            })?;
            export.runs
        };
        let added = self.add(&runs).map_err(|error| match error {
            ProgressError::Name { .. } | ProgressError::Run { .. } => ProgressError::Import {
                file: file.into(),
                what: error.to_string(),
            },
            other => other,
        })?;
        Ok((runs.len(), added))
    }
}

/// The runs as a table, a row a run and a column a metric: for spreadsheets. Metrics that a run lacks are empty.
pub fn to_csv(runs: &[PastRun]) -> String {
    let mut metrics: Vec<&str> = runs
        .iter()
        .flat_map(|run| run.metrics.keys().map(String::as_str))
        .collect();
    metrics.sort_unstable();
    metrics.dedup();
    let columns = [
        "identity",
        "trainee",
        "exercise",
        "title",
        "case",
        "version",
        "ended",
        "ended_unix_s",
        "steps",
        "score",
        "out_of",
        "medal",
    ];
    let mut text = String::new();
    let mut row = |cells: Vec<String>| {
        text.push_str(&cells.iter().map(|cell| quoted(cell)).collect::<Vec<_>>().join(","));
        text.push('\n');
    };
    row(columns.iter().chain(&metrics).map(|name| name.to_string()).collect());
    for run in runs {
        let medal = run.medal.and_then(run::word).unwrap_or_default();
        let mut cells = vec![
            run.identity.clone(),
            run.trainee.clone(),
            run.exercise.clone(),
            run.title.clone(),
            run.case.clone(),
            run.version.clone(),
            run.ended.and_then(run::word).unwrap_or_default(),
            run.ended_unix_s.to_string(),
            run.steps.to_string(),
            run.score.to_string(),
            run.out_of.to_string(),
            medal,
        ];
        let values = metrics.iter().map(|metric| run.metrics.get(*metric));
        cells.extend(values.map(|value| value.map_or(String::new(), f64::to_string)));
        row(cells);
    }
    text
}

/// A cell of a table as RFC 4180 has it.
fn quoted(cell: &str) -> String {
    if cell.contains([',', '"', '\n', '\r']) {
        format!("\"{}\"", cell.replace('"', "\"\""))
    } else {
        cell.to_owned()
    }
}
