//! Killed at any moment, nothing is lost that was told as kept, and nothing is half there.

mod common;

use std::{
    collections::BTreeSet,
    env, fs,
    io::{BufRead, BufReader, Write},
    path::{Path, PathBuf},
    process::{Command, Stdio},
    thread,
    time::Duration,
};

use common::{coarse, scripted};
use resecta_records::{Hands, Progress, RunRecord, folder::RECORDS, progress::PastRun};

/// Tells the child where to save, and from which number on.
const FOLDER: &str = "RESECTA_TEST_FOLDER";
const FROM: &str = "RESECTA_TEST_FROM";
/// Runs that are saved in all.
const RUNS: u64 = 200;

/// The child: saves runs as the game does, and tells each that is saved. Alone it does nothing.
#[test]
fn child() {
    let Some(folder) = env::var_os(FOLDER).map(PathBuf::from) else {
        return;
    };
    let from: u64 = env::var(FROM).unwrap().parse().unwrap();
    let (mut record, _) = RunRecord::load(&folder.join("first.resecta-run")).unwrap();
    let (mut progress, _) = Progress::of_folder(&folder).unwrap();
    for number in from..RUNS {
        record.hands = Hands::Person {
            trainee: format!("Trainee {}", number % 3),
            ended_unix_s: number,
        };
        let (file, identity) = record.save_into(&folder.join(RECORDS)).unwrap();
        let run = PastRun {
            record: Some(file.file_name().unwrap().to_string_lossy().into_owned()),
            ..PastRun::of_record(&record, &identity, 0)
        };
        progress.add(&[run]).unwrap();
        println!("saved {number} {identity}");
        std::io::stdout().flush().unwrap();
    }
}

#[test]
fn two_hundred_runs_survive_kills_at_any_moment() {
    let folder = tempfile::tempdir().unwrap();
    scripted(coarse("first_cuts"))
        .save(&folder.path().join("first.resecta-run"))
        .unwrap();
    let mut saved = BTreeSet::new();
    let (mut next, mut kills) = (0, 0u64);
    while next < RUNS {
        // Not evenly spread on purpose: from before the first save to the middle of any.
        let after = Duration::from_micros(20_000 + (kills * 7919 + 13) % 240_000);
        let told = one_child(folder.path(), next, after);
        next = told.iter().map(|(number, _)| number + 1).max().unwrap_or(next);
        saved.extend(told.into_iter().map(|(_, identity)| identity));
        kills += 1;
        assert!(kills < 2000, "{next} runs after {kills} kills");
    }
    assert_eq!(saved.len() as u64, RUNS);
    assert!(kills > 3, "{kills} kills are no test");

    // Every record is whole, those that nobody told of, too.
    let mut files = 0;
    for entry in fs::read_dir(folder.path().join(RECORDS)).unwrap() {
        let file = entry.unwrap().path();
        if !file.file_name().unwrap().to_string_lossy().starts_with('.') {
            RunRecord::load(&file).unwrap();
            files += 1;
        }
    }
    assert!(files >= RUNS);
    let (progress, _) = Progress::of_folder(folder.path()).unwrap();
    let runs = progress.runs(None).unwrap();
    let kept: BTreeSet<String> = runs.iter().map(|run| run.identity.clone()).collect();
    assert!(
        saved.is_subset(&kept),
        "{} of {} are there",
        saved.intersection(&kept).count(),
        saved.len()
    );
    // And every row has all of its metrics.
    let metrics = runs[0].metrics.len();
    assert!(metrics > 20 && runs.iter().all(|run| run.metrics.len() == metrics));
    // A record without a row was found when the database was opened.
    assert_eq!(runs.len() as u64, files);
}

/// Starts a child and kills it after a while. Returns what it told.
fn one_child(folder: &Path, from: u64, after: Duration) -> Vec<(u64, String)> {
    let mut child = Command::new(env::current_exe().unwrap())
        .args(["--exact", "child", "--nocapture", "--test-threads=1"])
        .env(FOLDER, folder)
        .env(FROM, from.to_string())
        .stdout(Stdio::piped())
        .stderr(Stdio::null())
        .spawn()
        .unwrap();
    let lines = BufReader::new(child.stdout.take().unwrap()).lines();
    let reader = thread::spawn(move || {
        let words = |line: String| -> Option<(u64, String)> {
            // The harness writes a name before the first line.
            let told = line.split_once("saved ")?.1;
            let (number, identity) = told.split_once(' ')?;
            (identity.len() == 64).then_some((number.parse().ok()?, identity.to_owned()))
        };
        lines.map_while(Result::ok).filter_map(words).collect()
    });
    thread::sleep(after);
    // SIGKILL on Unix: nothing of the program runs any more.
    let _ = child.kill();
    child.wait().unwrap();
    reader.join().unwrap()
}
