//! Records: what is written is read, what is damaged is refused, what is played again is the same.

mod common;

use std::{fs, path::Path, sync::LazyLock};

use common::{app, coarse, played, scripted};
use proptest::prelude::*;
use resecta_anatomy::Case;
use resecta_records::{Build, Damage, Difference, FORMAT, Hands, RecordError, Replay, RunRecord, rescore};
use resecta_scenario::{EndReason, Exercise, Extensions, Library, assets, headless};

/// A run of `first_cuts`, and its bytes.
static RUN: LazyLock<(RunRecord, Vec<u8>)> = LazyLock::new(|| {
    let record = scripted(coarse("first_cuts"));
    let bytes = record.to_bytes().0;
    (record, bytes)
});

const FILE: &str = "a.resecta-run";

fn read(bytes: &[u8]) -> Result<(RunRecord, String), RecordError> {
    RunRecord::from_bytes(bytes, Path::new(FILE))
}

fn check(record: &RunRecord) -> Option<Difference> {
    let mut app = headless::app(None);
    let checked = Replay::check(&mut app, record.clone(), Path::new(FILE), |_| {});
    let (difference, report) = checked.unwrap();
    assert!(difference.is_some() || report.to_json() == record.report);
    difference
}

#[test]
fn what_is_written_is_read() {
    let (record, bytes) = &*RUN;
    let folder = tempfile::tempdir().unwrap();
    let (file, identity) = record.save_into(&folder.path().join("records")).unwrap();
    assert_eq!(fs::read(&file).unwrap(), *bytes);
    let (again, same) = RunRecord::load(&file).unwrap();
    assert_eq!((&again, &same), (record, &identity));
    assert_eq!(again.results().run.ended, EndReason::InputEnded);
    assert_eq!(again.results().run.steps, record.states.len() as u64);
    // The same again is the same file.
    assert_eq!(record.save_into(&folder.path().join("records")).unwrap().0, file);
    assert_eq!(fs::read_dir(folder.path().join("records")).unwrap().count(), 1);
}

#[test]
fn equal_runs_have_equal_bytes() {
    assert_eq!(scripted(coarse("first_cuts")).to_bytes().0, RUN.1);
}

#[test]
fn every_shipped_exercise_and_case_comes_back_from_a_record_as_it_was() {
    let library = Library::new(assets::find().unwrap());
    for name in library.exercise_names() {
        let loaded = library.load(&name).unwrap();
        let text = ron::to_string(&loaded.exercise).unwrap();
        let exercise = Exercise::from_ron(&text, Path::new(FILE)).unwrap();
        assert_eq!(exercise, loaded.exercise, "{name}");
        let case = Case::from_ron(&loaded.case.to_ron(), Path::new(FILE)).unwrap();
        assert_eq!(case, *loaded.case, "{name}");
    }
}

#[test]
fn a_replay_goes_the_same_way_and_the_score_is_the_same() {
    let (record, _) = &*RUN;
    assert!(record.hashes.len() >= 2, "{} steps", record.states.len());
    assert_eq!(check(record), None);
    let card = rescore(record, Path::new(FILE), &Extensions::default()).unwrap();
    assert_eq!(card.total, record.results().score.total);
}

#[test]
fn a_run_with_a_briefing_blood_and_water_ended_by_hand_plays_again() {
    let mut app = app();
    app.update();
    // Whoever played before leaves nothing behind.
    let first = played(&mut app, coarse("first_cuts"), 3, 20, "Anna");
    let second = played(&mut app, coarse("middle_lobe"), 17, 120, "Anna");
    assert_eq!((first.begins_after, second.begins_after), (3, 17));
    assert_eq!(second.results().run.steps, 120);
    assert_eq!(second.seeds.len(), 1);
    for record in [first, second] {
        assert_eq!(read(&record.to_bytes().0).unwrap().0, record);
        assert_eq!(check(&record), None);
    }
}

#[test]
fn the_first_difference_is_told() {
    let mut record = RUN.0.clone();
    record.states[40].yaw_deg += 0.5;
    let difference = check(&record).unwrap();
    assert!(matches!(difference, Difference::Gland { step: 60, .. }), "{difference}");
    assert!(
        difference.to_string().contains("from 31 at the earliest"),
        "{difference}"
    );

    let mut record = RUN.0.clone();
    record.report = record.report.replacen("\"strokes\"", "\"strikes\"", 1);
    let difference = check(&record).unwrap();
    assert!(
        matches!(&difference, Difference::Results { field, .. } if field.starts_with("metrics[")),
        "{difference}"
    );

    let mut record = RUN.0.clone();
    record.report = record.report.replacen("\"input_ended\"", "\"time_up\"", 1);
    let difference = check(&record).unwrap();
    assert!(matches!(difference, Difference::End { .. }), "{difference}");
}

#[test]
fn what_is_no_record_is_refused_by_name() {
    let text = |bytes: &[u8]| read(bytes).unwrap_err().to_string();
    assert_eq!(
        text(b"\x89PNG"),
        "a.resecta-run: is no record of a run: it does not begin as one"
    );
    let bytes = &RUN.1;
    let mut later = bytes.clone();
    later[16] += 1;
    let version = FORMAT + 1;
    assert_eq!(
        text(&later),
        format!("a.resecta-run: is a record of version {version}; this program knows {FORMAT}")
    );
    let short = bytes.len() - 7;
    assert_eq!(
        text(&bytes[..short]),
        format!(
            "a.resecta-run: is {short} bytes long where {} were written: it is cut short or continued",
            bytes.len()
        )
    );
    let mut changed = bytes.clone();
    changed[short] ^= 16;
    assert!(text(&changed).contains("its checksum is not that of its contents"));

    let missing = RunRecord::load(Path::new("nowhere/b.resecta-run"))
        .unwrap_err()
        .to_string();
    assert!(
        missing.starts_with("nowhere/b.resecta-run: cannot be read: "),
        "{missing}"
    );
}

#[test]
fn another_build_is_named() {
    let mut record = RUN.0.clone();
    assert!(record.of_this_build(Path::new(FILE)).is_ok());
    record.build.sources = "0123456789abcdef".into();
    let told = record.of_this_build(Path::new(FILE)).unwrap_err().to_string();
    assert!(
        told.contains("0123456789abcdef") && told.contains(&Build::this().sources),
        "{told}"
    );
}

#[test]
fn an_exercise_of_a_record_that_cannot_be_played_is_told() {
    let mut record = RUN.0.clone();
    record.exercise = record.exercise.replacen("elapsed_s", "elapsed_weeks", 1);
    let told = record
        .exercise(Path::new(FILE), &Extensions::default())
        .unwrap_err()
        .to_string();
    assert!(
        told.starts_with("a.resecta-run: the exercise in it is refused: "),
        "{told}"
    );
    assert!(told.contains("elapsed_weeks"), "{told}");
}

#[test]
fn names_of_exercises_are_no_paths() {
    let mut record = RUN.0.clone();
    record.name = "../../etc/passwd".into();
    record.hands = Hands::Player("careful".into());
    let folder = tempfile::tempdir().unwrap();
    let (file, _) = record.save_into(folder.path()).unwrap();
    assert_eq!(file.parent(), Some(folder.path()));
    assert_eq!(RunRecord::load(&file).unwrap().0, record);
}

#[test]
fn every_flipped_byte_is_refused() {
    let bytes = &RUN.1;
    for at in (0..bytes.len()).step_by(bytes.len() / 400 + 1).chain(0..80) {
        let mut changed = bytes.clone();
        changed[at] ^= 1 << (at % 8);
        let error = read(&changed).map(|_| at).unwrap_err();
        assert!(matches!(error, RecordError::Damaged { .. }), "byte {at}: {error}");
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn damage_is_refused_and_never_panics(
        at in any::<prop::sample::Index>(),
        with in prop::collection::vec(any::<u8>(), 0..20),
        cut in any::<prop::sample::Index>(),
    ) {
        let mut bytes = RUN.1.clone();
        let at = at.index(bytes.len());
        let end = (at + with.len()).min(bytes.len());
        bytes.splice(at..end, with);
        bytes.truncate(cut.index(bytes.len()) + 1);
        prop_assume!(bytes != RUN.1);
        let error = read(&bytes).unwrap_err();
        let is_damage = matches!(error, RecordError::Damaged { .. });
        prop_assert!(is_damage, "{}", error);
    }
}

/// A file whose checksum holds was written by a program: even then nothing panics.
#[test]
fn contents_that_are_none_are_refused() {
    let cases: [(&str, fn(&mut RunRecord)); 4] = [
        ("report", |record| record.report = "{}".into()),
        ("come before the run", |record| record.begins_after = 1 << 40),
        ("come before the run", |record| record.step_s = -1.0),
        ("bytes for", |record| record.hashes.push(1)),
    ];
    for (wanted, change) in cases {
        let mut record = RUN.0.clone();
        change(&mut record);
        let error = read(&record.to_bytes().0).unwrap_err();
        let is_named =
            matches!(&error, RecordError::Damaged { damage: Damage::Contents { what }, .. } if what.contains(wanted));
        assert!(is_named, "{wanted}: {error}");
    }
}
