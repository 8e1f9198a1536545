//! The player's own history: what each run scored, in a small file of the user's own data folder.
//!
//! One JSON object a line. The file is written anew beside the old one and put in its place, so that it is always whole. Lines
//! that are not understood are moved to `history.broken.jsonl` beside it and told; lines of a later version stay as they are.
//! Runs without a window write nothing here.

use std::{
    fs, io,
    io::Write,
    path::{Path, PathBuf},
    time::{SystemTime, UNIX_EPOCH},
};

use bevy::prelude::*;
use resecta_scenario::EndReason;
use serde::{Deserialize, Serialize};

/// Version of a line; a line of a later one is kept and not read.
const VERSION: u32 = 1;
/// Runs of an exercise that are kept besides its best.
const LAST_RUNS: usize = 20;
/// Name of the file.
const FILE: &str = "history.jsonl";
/// Where lines go that are not understood.
const BROKEN_FILE: &str = "history.broken.jsonl";

/// One run.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct PastRun {
    version: u32,
    /// Name of the exercise.
    pub exercise: String,
    /// Points.
    pub score: f64,
    /// Points at best.
    pub out_of: f64,
    /// Simulated time, s.
    pub elapsed_s: f64,
    /// Tissue removed, g.
    pub removed_g: f64,
    /// Whether every goal was reached.
    pub goals_reached: bool,
    /// When it ended, seconds since 1970.
    pub ended_unix_s: u64,
}

impl PastRun {
    /// A run that ends now.
    pub fn now(exercise: &str, [score, out_of, elapsed_s, removed_g]: [f64; 4], reason: EndReason) -> Self {
        Self {
            version: VERSION,
            exercise: exercise.into(),
            score,
            out_of,
            elapsed_s,
            removed_g,
            goals_reached: reason == EndReason::GoalsReached,
            ended_unix_s: SystemTime::now()
                .duration_since(UNIX_EPOCH)
                .map_or(0, |since| since.as_secs()),
        }
    }
}

/// The history, and where it is kept.
#[derive(Resource, Debug, Clone, PartialEq, Default)]
pub struct History {
    /// In the order in which they ended.
    runs: Vec<PastRun>,
    /// Lines of a later version, as they stand.
    foreign: Vec<String>,
    /// None where the system names no folder for it.
    folder: Option<PathBuf>,
    /// What went wrong with the file, for the player.
    pub trouble: Option<String>,
}

impl History {
    /// Reads the history of this user; empty where there is none.
    pub fn load() -> Self {
        match data_folder(|name| std::env::var_os(name).map(PathBuf::from)) {
            Some(folder) => Self::load_from(folder),
            None => Self {
                trouble: Some("no folder for your own data is known here: scores are not kept".into()),
                ..default()
            },
        }
    }

    fn load_from(folder: PathBuf) -> Self {
        let mut history = Self {
            folder: Some(folder.clone()),
            ..default()
        };
        let file = folder.join(FILE);
        let text = match fs::read(&file) {
            Ok(bytes) => String::from_utf8_lossy(&bytes).into_owned(),
            Err(error) if error.kind() == io::ErrorKind::NotFound => return history,
            Err(error) => {
                // Never written over what could not be read.
                history.folder = None;
                history.trouble = Some(format!(
                    "{}: cannot be read, scores are not kept: {error}",
                    file.display()
                ));
                return history;
            }
        };
        let mut broken = Vec::new();
        for line in text.lines().filter(|line| !line.trim().is_empty()) {
            match read_line(line) {
                Line::Run(run) => history.runs.push(run),
                Line::Later => history.foreign.push(line.to_owned()),
                Line::Broken => broken.push(line),
            }
        }
        if !broken.is_empty() {
            history.put_aside(&folder.join(BROKEN_FILE), &broken);
        }
        history
    }

    /// Moves lines that are not understood to a file of their own.
    fn put_aside(&mut self, aside: &Path, broken: &[&str]) {
        let text = format!("{}\n", broken.join("\n"));
        let kept = (fs::OpenOptions::new().create(true).append(true).open(aside))
            .and_then(|mut file| file.write_all(text.as_bytes()).and_then(|()| file.sync_all()))
            .and_then(|()| self.write());
        self.trouble = Some(match kept {
            Ok(()) => format!(
                "{} of your history could not be read; kept in {}",
                if broken.len() == 1 {
                    "a line".to_owned()
                } else {
                    format!("{} lines", broken.len())
                },
                aside.display()
            ),
            Err(error) => {
                self.folder = None;
                format!("{}: cannot be written, scores are not kept: {error}", aside.display())
            }
        });
    }

    /// Adds a run and writes the file.
    pub fn add(&mut self, run: PastRun) {
        self.runs.push(run);
        self.forget_old();
        if let Err(error) = self.write() {
            self.trouble = Some(format!("this score could not be kept: {error}"));
        }
    }

    /// The runs of an exercise, the latest last.
    pub fn of(&self, exercise: &str) -> impl DoubleEndedIterator<Item = &PastRun> {
        self.runs.iter().filter(move |run| run.exercise == exercise)
    }

    /// The best run of an exercise, the first of equals.
    pub fn best(&self, exercise: &str) -> Option<&PastRun> {
        let better = |a: &PastRun, b: &PastRun| b.score > a.score;
        self.of(exercise).reduce(|a, b| if better(a, b) { b } else { a })
    }

    /// Whether nothing was ever played.
    pub fn is_empty(&self) -> bool {
        self.runs.is_empty()
    }

    /// Leaves of each exercise its best and its last runs.
    fn forget_old(&mut self) {
        let runs = &self.runs;
        let keep: Vec<bool> = (runs.iter().enumerate())
            .map(|(index, run)| {
                let later = runs[index + 1..].iter().filter(|other| other.exercise == run.exercise);
                later.count() < LAST_RUNS || self.best(&run.exercise).is_some_and(|best| std::ptr::eq(best, run))
            })
            .collect();
        let mut keep = keep.into_iter();
        self.runs.retain(|_| keep.next().unwrap_or(true));
    }

    fn write(&self) -> io::Result<()> {
        let Some(folder) = &self.folder else { return Ok(()) };
        fs::create_dir_all(folder)?;
        let mut text = String::new();
        for run in &self.runs {
            text.push_str(&serde_json::to_string(run)?);
            text.push('\n');
        }
        for line in &self.foreign {
            text.push_str(line);
            text.push('\n');
        }
        // Another game may write at the same time: each to a file of its own name.
        let temporary = folder.join(format!("{FILE}.{}.tmp", std::process::id()));
        let mut file = fs::File::create(&temporary)?;
        file.write_all(text.as_bytes())?;
        file.sync_all()?;
        fs::rename(&temporary, folder.join(FILE))
    }
}

enum Line {
    Run(PastRun),
    Later,
    Broken,
}

fn read_line(line: &str) -> Line {
    #[derive(Deserialize)]
    struct Versioned {
        version: u32,
    }
    match serde_json::from_str::<Versioned>(line) {
        Ok(Versioned { version }) if version > VERSION => Line::Later,
        _ => match serde_json::from_str::<PastRun>(line) {
            Ok(run) if run.score.is_finite() && run.out_of.is_finite() => Line::Run(run),
            _ => Line::Broken,
        },
    }
}

/// Where a program keeps its user's data, by the system's own rules.
fn data_folder(variable: impl Fn(&str) -> Option<PathBuf>) -> Option<PathBuf> {
    let absolute = |name| variable(name).filter(|path| path.is_absolute());
    let base = if cfg!(target_os = "windows") {
        absolute("APPDATA")
    } else if cfg!(target_os = "macos") {
        absolute("HOME").map(|home| home.join("Library/Application Support"))
    } else {
        absolute("XDG_DATA_HOME").or_else(|| absolute("HOME").map(|home| home.join(".local/share")))
    };
    base.map(|base| base.join("resecta"))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn run(exercise: &str, score: f64) -> PastRun {
        PastRun::now(exercise, [score, 100.0, 60.0, 1.5], EndReason::GoalsReached)
    }

    #[test]
    fn what_was_kept_is_read_again() {
        let folder = tempfile::tempdir().unwrap();
        let place = folder.path().join("deep/resecta");
        let mut history = History::load_from(place.clone());
        assert!(history.is_empty() && history.trouble.is_none());
        for score in [40.0, 70.0, 55.0] {
            history.add(run("first_cuts", score));
        }
        history.add(run("other", 90.0));
        assert_eq!(history.trouble, None);
        let again = History::load_from(place);
        assert_eq!(again, history);
        assert_eq!(again.best("first_cuts").unwrap().score, 70.0);
        assert_eq!(again.of("first_cuts").count(), 3);
        assert!(again.best("third").is_none());
    }

    #[test]
    fn broken_lines_are_kept_aside_and_told_and_later_ones_stay() {
        let folder = tempfile::tempdir().unwrap();
        let place = folder.path().to_owned();
        History::load_from(place.clone()).add(run("first_cuts", 40.0));
        let file = place.join(FILE);
        let later = "{\"version\":2,\"exercise\":7}";
        let text = fs::read_to_string(&file).unwrap();
        fs::write(&file, format!("{{half a li\n{later}\n{text}")).unwrap();

        let mut history = History::load_from(place.clone());
        assert_eq!(history.of("first_cuts").count(), 1);
        assert!(history.trouble.as_deref().unwrap().contains("a line of your history"));
        assert_eq!(fs::read_to_string(place.join(BROKEN_FILE)).unwrap(), "{half a li\n");
        history.add(run("first_cuts", 50.0));
        let text = fs::read_to_string(&file).unwrap();
        assert!(text.contains(later) && !text.contains("half a li"), "{text}");
        // Told once: the next start finds a whole file.
        assert_eq!(History::load_from(place).trouble, None);
    }

    #[test]
    fn the_best_run_outlives_the_last_ones() {
        let folder = tempfile::tempdir().unwrap();
        let mut history = History::load_from(folder.path().to_owned());
        history.add(run("first_cuts", 99.0));
        for _ in 0..30 {
            history.add(run("first_cuts", 10.0));
        }
        assert_eq!(history.of("first_cuts").count(), LAST_RUNS + 1);
        assert_eq!(history.best("first_cuts").unwrap().score, 99.0);
    }

    #[test]
    fn a_file_that_cannot_be_written_is_told_and_costs_nothing_else() {
        let folder = tempfile::tempdir().unwrap();
        let place = folder.path().join("a file");
        fs::write(&place, "").unwrap();
        let mut history = History {
            folder: Some(place),
            ..default()
        };
        history.add(run("first_cuts", 40.0));
        assert!(history.trouble.is_some());
        assert_eq!(history.of("first_cuts").count(), 1);
    }

    #[test]
    #[cfg(target_os = "linux")]
    fn the_folder_is_the_users_own() {
        let folder = |xdg: Option<&str>, home: Option<&str>| {
            data_folder(|name| match name {
                "XDG_DATA_HOME" => xdg.map(PathBuf::from),
                "HOME" => home.map(PathBuf::from),
                _ => None,
            })
        };
        assert_eq!(folder(Some("/data"), Some("/home/me")), Some("/data/resecta".into()));
        assert_eq!(
            folder(Some("relative"), Some("/home/me")),
            Some("/home/me/.local/share/resecta".into())
        );
        assert_eq!(folder(None, None), None);
    }
}
