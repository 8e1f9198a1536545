//! Scores of programs before the database: `history.jsonl`, a JSON object a line. It is read once.

use std::{
    collections::BTreeMap,
    fs, io,
    path::{Path, PathBuf},
};

use resecta_scenario::EndReason;
use serde::Deserialize;

use super::{PastRun, Progress, ProgressError};
use crate::record::hash;

/// Name of the file in the user's folder.
const FILE: &str = "history.jsonl";
/// What it is called once it was read.
const READ_FILE: &str = "history.imported.jsonl";

/// A line. What later programs added to it is passed over.
#[derive(Deserialize)]
struct OldRun {
    exercise: String,
    score: f64,
    out_of: f64,
    elapsed_s: f64,
    removed_g: f64,
    goals_reached: bool,
    ended_unix_s: u64,
}

impl Progress {
    /// Adds the scores of an old history in this folder as this trainee's, and calls its file otherwise, so that it is read once.
    /// Returns how many there were and how many lines were not understood; nothing where there is no such file.
    ///
    /// # Errors
    /// [`ProgressError`] names the file; it is then as it was.
    pub fn import_history(&mut self, folder: &Path, trainee: &str) -> Result<Option<(usize, usize)>, ProgressError> {
        let file = folder.join(FILE);
        let failed = |file: PathBuf| {
            move |error: io::Error| ProgressError::Import {
                file,
                what: error.to_string(),
            }
        };
        let text = match fs::read(&file) {
            Ok(bytes) => String::from_utf8_lossy(&bytes).into_owned(),
            Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(None),
            Err(error) => return Err(failed(file)(error)),
        };
        let lines: Vec<&str> = text.lines().filter(|line| !line.trim().is_empty()).collect();
        let runs = (lines.iter().enumerate()).filter_map(|(number, line)| run_of(line, number, trainee));
        let runs: Vec<PastRun> = runs.collect();
        self.add(&runs)?;
        // A kill before this reads the file again, to the same runs.
        fs::rename(&file, folder.join(READ_FILE)).map_err(failed(file))?;
        Ok(Some((runs.len(), lines.len() - runs.len())))
    }
}

fn run_of(line: &str, number: usize, trainee: &str) -> Option<PastRun> {
    let old: OldRun = serde_json::from_str(line).ok()?;
    let run = PastRun {
        identity: format!("history-{}", hash(&format!("{number} {line}"))),
        trainee: trainee.into(),
        title: old.exercise.clone(),
        exercise: old.exercise,
        exercise_hash: String::new(),
        case: String::new(),
        version: String::new(),
        ended: old.goals_reached.then_some(EndReason::GoalsReached),
        ended_unix_s: old.ended_unix_s,
        steps: 0,
        elapsed_s: old.elapsed_s,
        score: old.score,
        out_of: old.out_of,
        medal: None,
        record: None,
        metrics: BTreeMap::from([("elapsed_s".into(), old.elapsed_s), ("removed_g".into(), old.removed_g)]),
    };
    run.check().ok().map(|()| run)
}
