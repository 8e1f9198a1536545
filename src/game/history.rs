//! What the trainees of this machine have played: the record of each run as a file, and what it came to in a database, both in the
//! user's own data folder. Runs without a window write nothing here.

use std::{
    path::PathBuf,
    sync::Mutex,
    time::{SystemTime, UNIX_EPOCH},
};

use bevy::prelude::*;
use resecta_records::{
    Hands, Progress, ProgressError, RecordError, RunRecord,
    folder::RECORDS,
    progress::{FIRST_TRAINEE, PastRun},
};
#[cfg(test)]
use resecta_scenario::Medal;
use thiserror::Error;

/// The runs of the present trainee, and where they are kept.
#[derive(Resource, Debug, Default)]
pub struct History {
    /// None where nothing can be kept: runs are then known until the game is closed.
    kept: Option<Mutex<Progress>>,
    /// Who plays.
    trainee: String,
    /// Everybody who ever did, by name.
    trainees: Vec<String>,
    /// In the order in which they ended.
    runs: Vec<PastRun>,
    /// The record of the last run, once it is on the disk.
    pub record: Option<PathBuf>,
    /// What went wrong, for the player.
    pub trouble: Option<String>,
}

#[derive(Debug, Error)]
enum KeepError {
    #[error(transparent)]
    Record(#[from] RecordError),
    #[error(transparent)]
    Progress(#[from] ProgressError),
}

impl History {
    /// That of this user, with who played last; empty where there is none.
    pub fn load() -> Self {
        let opened = Progress::of_user().and_then(|(progress, notes)| Ok((Self::of(progress)?, notes)));
        match opened {
            Ok((history, notes)) => Self {
                trouble: (!notes.is_empty()).then(|| notes.join("\n")),
                ..history
            },
            Err(error) => Self {
                trainee: FIRST_TRAINEE.into(),
                trouble: Some(format!("scores are not kept: {error}")),
                ..default()
            },
        }
    }

    fn of(mut progress: Progress) -> Result<Self, ProgressError> {
        let present = progress.present_trainee()?.unwrap_or(FIRST_TRAINEE.into());
        let trainee = progress.set_present_trainee(&present)?;
        Ok(Self {
            runs: progress.runs(Some(&trainee))?,
            trainees: progress.trainees()?,
            kept: Some(progress.into()),
            trainee,
            ..default()
        })
    }

    /// Who plays.
    pub fn trainee(&self) -> &str {
        if self.trainee.is_empty() {
            FIRST_TRAINEE
        } else {
            &self.trainee
        }
    }

    /// Everybody who may.
    pub fn trainees(&self) -> &[String] {
        &self.trainees
    }

    /// Lets somebody play, who may be new. Who cannot is told in [`trouble`](Self::trouble).
    pub fn choose(&mut self, name: &str) {
        let Some(kept) = &mut self.kept else { return };
        let progress = kept.get_mut().unwrap_or_else(|broken| broken.into_inner());
        let chosen = (progress.set_present_trainee(name))
            .and_then(|trainee| Ok((progress.runs(Some(&trainee))?, progress.trainees()?, trainee)));
        self.trouble = None;
        match chosen {
            Ok((runs, trainees, trainee)) => (self.runs, self.trainees, self.trainee) = (runs, trainees, trainee),
            Err(error) => self.trouble = Some(error.to_string()),
        }
    }

    /// Keeps the run that ends now: its record as a file, then what it came to.
    pub fn add(&mut self, mut record: RunRecord) {
        let now = SystemTime::now().duration_since(UNIX_EPOCH);
        record.hands = Hands::Person {
            trainee: self.trainee().into(),
            ended_unix_s: now.map_or(0, |since| since.as_secs()),
        };
        self.record = None;
        match self.keep(&record) {
            Ok(run) => self.runs.push(run),
            Err(error) => {
                self.trouble = Some(format!("this run could not be kept: {error}"));
                self.runs.push(PastRun::of_record(&record, "", 0));
            }
        }
    }

    fn keep(&mut self, record: &RunRecord) -> Result<PastRun, KeepError> {
        let Some(kept) = &mut self.kept else {
            return Ok(PastRun::of_record(record, "", 0));
        };
        let progress = kept.get_mut().unwrap_or_else(|broken| broken.into_inner());
        let folder = progress.file().with_file_name(RECORDS);
        let (file, identity) = record.save_into(&folder)?;
        let name = file.file_name().map(|name| name.to_string_lossy().into_owned());
        let run = PastRun {
            record: name,
            ..PastRun::of_record(record, &identity, 0)
        };
        progress.add(std::slice::from_ref(&run))?;
        self.record = Some(file);
        Ok(run)
    }

    /// The record of a run, where it is still there.
    pub fn file_of(&self, run: &PastRun) -> Option<PathBuf> {
        let progress = self.kept.as_ref()?.lock().ok()?;
        let file = progress.file().with_file_name(RECORDS).join(run.record.as_ref()?);
        file.is_file().then_some(file)
    }

    /// The runs of the present trainee, the latest last.
    pub fn runs(&self) -> &[PastRun] {
        &self.runs
    }

    /// Those of an exercise, the latest last.
    pub fn of_exercise(&self, exercise: &str) -> impl DoubleEndedIterator<Item = &PastRun> {
        self.runs.iter().filter(move |run| run.exercise == exercise)
    }

    /// The best run of an exercise, the first of equals.
    pub fn best(&self, exercise: &str) -> Option<&PastRun> {
        let better = |a: &PastRun, b: &PastRun| b.score > a.score;
        self.of_exercise(exercise)
            .reduce(|a, b| if better(a, b) { b } else { a })
    }

    /// A run of an exercise with a score, for tests.
    #[cfg(test)]
    pub fn add_played(&mut self, exercise: &str, score: f64) {
        self.runs.push(PastRun {
            score,
            ..tests::run("", exercise)
        });
    }

    /// A run of an exercise that earned a medal when it was played and no points by today's score, for tests.
    #[cfg(test)]
    pub fn add_medal(&mut self, exercise: &str, medal: Medal) {
        self.runs.push(PastRun {
            medal: Some(medal),
            ..tests::run("", exercise)
        });
    }

    /// Whether this trainee never played.
    pub fn is_empty(&self) -> bool {
        self.runs.is_empty()
    }
}

#[cfg(test)]
mod tests {
    use std::fs;

    use resecta_records::progress::DATABASE;

    use super::*;

    pub fn run(identity: &str, exercise: &str) -> PastRun {
        let json = format!(
            r#"{{"identity":"{identity}","trainee":"Anna","exercise":"{exercise}","title":"First cuts","exercise_hash":"",
            "case":"","version":"","ended":null,"ended_unix_s":0,"steps":1,"elapsed_s":1.0,"score":0.0,
            "out_of":100.0,"medal":null,"metrics":{{}}}}"#
        );
        serde_json::from_str(&json).unwrap()
    }

    fn scored(identity: &str, score: u32) -> PastRun {
        PastRun {
            score: score.into(),
            ended_unix_s: score.into(),
            ..run(identity, "first_cuts")
        }
    }

    #[test]
    fn each_trainee_has_runs_of_their_own_and_who_played_last_plays_next() {
        let folder = tempfile::tempdir().unwrap();
        let open = || History::of(Progress::open(&folder.path().join(DATABASE)).unwrap()).unwrap();
        let mut history = open();
        assert_eq!(history.trainee(), FIRST_TRAINEE);
        let progress = history.kept.as_mut().unwrap().get_mut().unwrap();
        progress
            .add(&[scored("a", 40), scored("b", 70), scored("c", 55)])
            .unwrap();
        assert!(history.is_empty());
        history.choose("anna");
        assert_eq!(
            (history.trainee(), history.of_exercise("first_cuts").count()),
            ("Anna", 3)
        );
        assert_eq!(history.best("first_cuts").unwrap().score, 70.0);
        assert!(history.best("other").is_none());

        let recorded = PastRun {
            record: Some("a.resecta-run".into()),
            ..run("a", "first_cuts")
        };
        assert_eq!(history.file_of(&recorded), None, "nobody wrote it");
        fs::create_dir(folder.path().join(RECORDS)).unwrap();
        let file = folder.path().join(RECORDS).join("a.resecta-run");
        fs::write(&file, "").unwrap();
        assert_eq!(history.file_of(&recorded), Some(file));
        assert_eq!(history.file_of(&run("a", "first_cuts")), None);
        drop(history);

        let mut history = open();
        assert_eq!((history.trainee(), history.runs().len()), ("Anna", 3));
        history.choose(" ");
        assert!(
            history
                .trouble
                .as_deref()
                .is_some_and(|words| words.contains("is no name"))
        );
        assert_eq!(history.trainee(), "Anna");
        history.choose("Ben");
        assert!(history.is_empty() && history.trouble.is_none());
        assert_eq!(history.trainees(), ["Anna", "Ben", FIRST_TRAINEE]);
    }
}
