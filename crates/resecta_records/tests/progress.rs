//! Progress: kept once, told as it was, and never at the cost of what was kept before.

use std::{collections::BTreeMap, fs};

use resecta_records::{
    Progress, ProgressError,
    progress::{Export, FIRST_TRAINEE, PastRun, curves, table, to_csv},
};
use resecta_scenario::{EndReason, Medal};

fn run(identity: &str, trainee: &str, ended_unix_s: u64, score: f64) -> PastRun {
    PastRun {
        identity: identity.into(),
        trainee: trainee.into(),
        exercise: "first_cuts".into(),
        title: "First cuts".into(),
        exercise_hash: "abc".into(),
        case: "Medium, generated".into(),
        version: "0.1.0".into(),
        ended: Some(EndReason::GoalsReached),
        ended_unix_s,
        steps: 600,
        elapsed_s: 10.0,
        score,
        out_of: 100.0,
        medal: (score > 50.0).then_some(Medal::Silver),
        record: None,
        metrics: BTreeMap::from([("elapsed_s".into(), 10.0), ("removed_g".into(), score / 30.0)]),
    }
}

#[test]
fn what_was_kept_is_read_again_in_the_order_of_time() {
    let folder = tempfile::tempdir().unwrap();
    let (mut progress, notes) = Progress::of_folder(folder.path()).unwrap();
    assert_eq!(notes, [""; 0]);
    let runs = [
        run("b", "Anna", 20, 70.0),
        run("a", "Anna", 10, 40.0),
        run("c", "Ben", 15, 1.0 / 3.0),
    ];
    assert_eq!(progress.add(&runs).unwrap(), 3);
    drop(progress);
    let (progress, _) = Progress::of_folder(folder.path()).unwrap();
    assert_eq!(progress.runs(Some("anna")).unwrap(), [runs[1].clone(), runs[0].clone()]);
    assert_eq!(progress.runs(None).unwrap().len(), 3);
    assert_eq!(progress.trainees().unwrap(), ["Anna", "Ben"]);
}

#[test]
fn what_is_imported_twice_is_there_once() {
    let [here, there] = [tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap()];
    let (mut first, _) = Progress::of_folder(there.path()).unwrap();
    first
        .add(&[run("a", "Anna", 10, 40.0), run("b", "Anna", 20, 60.0)])
        .unwrap();
    let file = there.path().join("export.json");
    fs::write(&file, Export::new(first.runs(None).unwrap()).to_json()).unwrap();

    let (mut second, _) = Progress::of_folder(here.path()).unwrap();
    second.add(&[run("b", "Anna", 20, 60.0)]).unwrap();
    assert_eq!(second.import(&file).unwrap(), (2, 1));
    assert_eq!(second.import(&file).unwrap(), (2, 0));
    assert_eq!(second.runs(None).unwrap(), first.runs(None).unwrap());
}

#[test]
fn imports_that_are_none_are_refused_and_leave_all_as_it_was() {
    let folder = tempfile::tempdir().unwrap();
    let (mut progress, _) = Progress::of_folder(folder.path()).unwrap();
    let good = Export::new(vec![run("a", "Anna", 10, 40.0)]).to_json();
    for (text, wanted) in [
        ("half a", "expected a record"),
        ("{\"format\":2,\"runs\":7}", "version 2"),
        (&good.replace("\"Anna\"", "\" \""), "is no name"),
        (
            &good.replace("\"removed_g\"", "\"removed_g\": 1e999, \"x\""),
            "out of range",
        ),
        (&good.replace("\"steps\"", "\"stops\""), "stops"),
    ] {
        let file = folder.path().join("export.json");
        fs::write(&file, text).unwrap();
        let error = progress.import(&file).unwrap_err().to_string();
        assert!(
            error.starts_with(&format!("{}: ", file.display())) && error.contains(wanted),
            "{error}"
        );
    }
    assert_eq!(progress.runs(None).unwrap(), []);
    assert_eq!(progress.trainees().unwrap(), [""; 0]);
}

#[test]
fn a_database_of_a_later_program_and_what_is_none_are_refused_by_name_and_stay() {
    let folder = tempfile::tempdir().unwrap();
    let later = folder.path().join("later.sqlite");
    drop(Progress::open(&later).unwrap());
    let connection = rusqlite::Connection::open(&later).unwrap();
    connection.pragma_update(None, "user_version", 7).unwrap();
    drop(connection);
    let error = Progress::open(&later).unwrap_err();
    assert!(
        matches!(error, ProgressError::LaterVersion { version: 7, .. }),
        "{error}"
    );

    let none = folder.path().join("none.sqlite");
    fs::write(&none, "scores, mostly".repeat(100)).unwrap();
    let error = Progress::open(&none).unwrap_err().to_string();
    assert!(
        error.contains("none.sqlite") && error.contains("not a database"),
        "{error}"
    );
    assert!(fs::read_to_string(&none).unwrap().starts_with("scores"));
}

#[test]
fn every_connection_keeps_what_it_says_it_kept() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("p.sqlite");
    drop(Progress::open(&file).unwrap());
    let connection = rusqlite::Connection::open(&file).unwrap();
    let pragma = |name: &str| -> String {
        connection
            .query_row(&format!("PRAGMA {name}"), [], |row| row.get(0))
            .unwrap()
    };
    assert_eq!(pragma("journal_mode"), "wal");
    let version: u32 = connection
        .query_row("PRAGMA user_version", [], |row| row.get(0))
        .unwrap();
    assert_eq!(version, 1);
}

#[test]
fn an_old_history_is_taken_in_once() {
    let folder = tempfile::tempdir().unwrap();
    let old = folder.path().join("history.jsonl");
    let line = |score: f64, time: u64| {
        format!(
            "{{\"version\":1,\"exercise\":\"first_cuts\",\"score\":{score},\"out_of\":100.0,\"elapsed_s\":61.5,\"removed_g\":1.25,\
             \"goals_reached\":true,\"ended_unix_s\":{time}}}\n"
        )
    };
    let text = format!("{}half a li\n{}", line(40.0, 5), line(70.5, 9));
    fs::write(&old, &text).unwrap();
    let (progress, notes) = Progress::of_folder(folder.path()).unwrap();
    assert_eq!(notes.len(), 1);
    assert!(
        notes[0].contains("2 scores") && notes[0].contains("1 lines of it"),
        "{}",
        notes[0]
    );
    let runs = progress.runs(Some(FIRST_TRAINEE)).unwrap();
    assert_eq!(runs.iter().map(|run| run.score).collect::<Vec<_>>(), [40.0, 70.5]);
    assert_eq!(runs[1].metrics["removed_g"], 1.25);
    assert!(!old.exists());
    drop(progress);

    // A kill between the two would have left the file: it doubles nothing.
    fs::write(&old, &text).unwrap();
    let (progress, _) = Progress::of_folder(folder.path()).unwrap();
    assert_eq!(progress.runs(None).unwrap().len(), 2);
}

#[test]
fn names_are_names_and_the_same_in_other_letters() {
    let folder = tempfile::tempdir().unwrap();
    let (mut progress, _) = Progress::of_folder(folder.path()).unwrap();
    assert_eq!(progress.present_trainee().unwrap(), None);
    assert_eq!(progress.set_present_trainee("  Anna ").unwrap(), "Anna");
    assert_eq!(progress.set_present_trainee("ANNA").unwrap(), "Anna");
    assert_eq!(progress.present_trainee().unwrap().as_deref(), Some("Anna"));
    for name in ["", "  ", "a\nb", &"x".repeat(41)] {
        assert!(
            matches!(progress.add_trainee(name), Err(ProgressError::Name { .. })),
            "{name:?}"
        );
    }
    assert_eq!(progress.trainees().unwrap(), ["Anna"]);
}

#[test]
fn curves_tell_each_metric_run_by_run() {
    let runs: Vec<PastRun> = (1..=10)
        .map(|n| run(&n.to_string(), "Anna", n, 10.0 * n as f64))
        .collect();
    let curves = curves(&runs.iter().collect::<Vec<_>>());
    let titles: Vec<&str> = curves.iter().map(|curve| curve.metric.as_str()).collect();
    assert_eq!(titles, ["score", "elapsed_s", "removed_g"]);
    assert_eq!(curves[0].best, Some(100.0));
    assert_eq!(curves[0].points[3], (4, 40.0));
    assert_eq!((curves[1].best, curves[2].best), (Some(10.0), None));

    let text = table(&runs);
    assert!(text.starts_with("Anna: First cuts (first_cuts), 10 runs\n"), "{text}");
    let score = text.lines().find(|line| line.trim().starts_with("Score")).unwrap();
    let cells: Vec<&str> = score.split_whitespace().collect();
    assert_eq!(
        cells[cells.len() - 9..],
        ["30.0", "40.0", "50.0", "60.0", "70.0", "80.0", "90.0", "100.0", "100.0"]
    );
    let widths: Vec<usize> = text.lines().skip(1).map(str::len).collect();
    assert!(widths.iter().all(|width| *width <= 2 + 28 + 8 + 90), "{text}");
}

#[test]
fn a_run_that_was_broken_off_is_the_best_only_where_none_was_finished() {
    let ended = |n: u64, reason| PastRun {
        ended: Some(reason),
        metrics: BTreeMap::from([("elapsed_s".into(), 100.0 - n as f64)]),
        ..run(&n.to_string(), "Anna", n, 50.0)
    };
    let mut runs = vec![
        ended(1, EndReason::GoalsReached),
        ended(2, EndReason::GoalsReached),
        ended(90, EndReason::Player),
    ];
    let best_s = |runs: &[PastRun]| {
        let curves = curves(&runs.iter().collect::<Vec<_>>());
        let time = curves.iter().find(|curve| curve.metric == "elapsed_s");
        time.and_then(|curve| curve.best)
    };
    assert_eq!(best_s(&runs), Some(98.0));
    runs.drain(..2);
    assert_eq!(best_s(&runs), Some(10.0));
}

#[test]
fn tables_for_spreadsheets_quote_what_needs_it() {
    let mut odd = run("a", "Anna, \"the\" hand", 10, 40.0);
    odd.metrics.remove("removed_g");
    let text = to_csv(&[odd, run("b", "Ben", 11, 50.0)]);
    let lines: Vec<&str> = text.lines().collect();
    assert!(
        lines[0].starts_with("identity,trainee,") && lines[0].ends_with(",elapsed_s,removed_g"),
        "{text}"
    );
    assert!(
        lines[1].starts_with("a,\"Anna, \"\"the\"\" hand\",first_cuts,"),
        "{text}"
    );
    assert!(lines[1].ends_with(",10,"), "{text}");
}
