//! One run, as progress keeps it.

use std::{
    collections::BTreeMap,
    fs,
    path::Path,
    time::{SystemTime, UNIX_EPOCH},
};

use resecta_scenario::{EndReason, Medal};
use serde::{Deserialize, Serialize, de::DeserializeOwned};

use crate::record::{self, Hands, RunRecord};

/// What one run came to.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PastRun {
    /// The hash of its record; another string where it has none.
    pub identity: String,
    /// Who played.
    pub trainee: String,
    /// Name of the exercise.
    pub exercise: String,
    /// Its title.
    pub title: String,
    /// BLAKE3 of the exercise's text in the record: runs of one name and two hashes were two exercises. Empty where it is not known.
    pub exercise_hash: String,
    /// Name of the case.
    pub case: String,
    /// Version of the program.
    pub version: String,
    /// Why it ended; none where it is not known.
    pub ended: Option<EndReason>,
    /// When, seconds since 1970.
    pub ended_unix_s: u64,
    /// Fixed steps.
    pub steps: u64,
    /// Simulated time, s.
    pub elapsed_s: f64,
    /// Points.
    pub score: f64,
    /// Points at best.
    pub out_of: f64,
    /// What they earned.
    pub medal: Option<Medal>,
    /// Name of its record in the folder of records, where it is there.
    #[serde(skip)]
    pub record: Option<String>,
    /// Every metric, in the unit of its table row.
    pub metrics: BTreeMap<String, f64>,
}

impl PastRun {
    /// The run of a record, which ended then, unless the record tells when.
    pub fn of_record(record: &RunRecord, identity: &str, ended_unix_s: u64) -> Self {
        let results = record.results();
        let (trainee, ended_unix_s) = match &record.hands {
            Hands::Person { trainee, ended_unix_s } => (trainee.clone(), *ended_unix_s),
            Hands::Player(name) => (format!("player {name}"), ended_unix_s),
            Hands::Script(name) => (format!("script {name}"), ended_unix_s),
            Hands::Recording(name) => (format!("recording {name}"), ended_unix_s),
        };
        Self {
            identity: identity.into(),
            trainee: trainee.chars().take(super::MAX_NAME).collect(),
            exercise: record.name.clone(),
            title: results.exercise.title,
            exercise_hash: record::hash(&record.exercise),
            case: results.case.name,
            version: record.build.version.clone(),
            ended: Some(results.run.ended),
            ended_unix_s,
            steps: results.run.steps,
            elapsed_s: results.run.elapsed_s,
            score: results.score.total,
            out_of: results.score.out_of,
            medal: results.score.medal,
            record: None,
            metrics: (results.metrics.into_iter())
                .map(|metric| (metric.id, metric.value))
                .collect(),
        }
    }

    /// A metric of the run, or its score.
    pub fn value(&self, metric: &str) -> Option<f64> {
        match metric {
            SCORE => Some(self.score),
            _ => self.metrics.get(metric).copied(),
        }
    }

    /// What no run can be.
    pub(super) fn check(&self) -> Result<(), String> {
        let numbers = [
            ("elapsed_s", self.elapsed_s),
            ("score", self.score),
            ("out_of", self.out_of),
        ];
        let metrics = self.metrics.iter().map(|(metric, value)| (metric.as_str(), *value));
        if let Some((name, value)) = numbers.into_iter().chain(metrics).find(|(_, value)| !value.is_finite()) {
            return Err(format!("{name} is {value}, expected a number"));
        }
        if self.identity.is_empty() || self.exercise.is_empty() {
            return Err("has no identity or no exercise".into());
        }
        // The database has signed numbers.
        if self.steps > i64::MAX as u64 || self.ended_unix_s > i64::MAX as u64 {
            return Err("steps or time are out of range".into());
        }
        Ok(())
    }
}

/// The score among the names of metrics.
pub(super) const SCORE: &str = "score";

/// The one word of a plain enum, as files have it.
pub(super) fn word<T: Serialize>(value: T) -> Option<String> {
    serde_json::to_value(value).ok()?.as_str().map(str::to_owned)
}

/// What a word stands for; none where it is of a later program.
pub(super) fn of_word<T: DeserializeOwned>(word: String) -> Option<T> {
    serde_json::from_value(word.into()).ok()
}

/// When a file was last written, seconds since 1970.
pub(super) fn ended_at(file: &Path) -> u64 {
    let written = fs::metadata(file)
        .and_then(|about| about.modified())
        .unwrap_or(SystemTime::UNIX_EPOCH);
    written.duration_since(UNIX_EPOCH).map_or(0, |since| since.as_secs())
}
