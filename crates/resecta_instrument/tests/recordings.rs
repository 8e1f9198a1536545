//! Recordings: the file keeps every bit, and a bad one is refused by line and field.

use std::path::Path;

use proptest::prelude::*;
use resecta_instrument::{InstrumentLimits, InstrumentRecording, InstrumentState, RecordingError};

fn read(text: &str) -> Result<InstrumentRecording, RecordingError> {
    InstrumentRecording::from_csv(text, Path::new("bad.csv"), &InstrumentLimits::default())
}

fn any_state() -> impl Strategy<Value = InstrumentState> {
    let numbers = (
        0.0..120.0f32,
        -35.0..35.0f32,
        -1e-30..1e-30f32,
        -180.0..180.0f32,
        0.0..30.0f32,
        [0.0..=1.0f32, 0.0..=1.0f32],
    );
    (numbers, any::<[bool; 2]>()).prop_map(
        |((insertion_mm, pitch_deg, yaw_deg, roll_deg, stroke_mm, [inflow_tap, outflow_tap]), [cut, coagulate])| {
            InstrumentState {
                insertion_mm,
                pitch_deg,
                yaw_deg,
                roll_deg,
                stroke_mm,
                inflow_tap,
                outflow_tap,
                cut,
                coagulate,
            }
        },
    )
}

proptest! {
    #[test]
    fn the_file_keeps_every_bit(start in any_state(), states in prop::collection::vec(any_state(), 0..40)) {
        let recording = InstrumentRecording { step_s: 1.0 / 60.0, without_taps: false, start, states };
        let again = read(&recording.to_csv()).expect("a valid recording");
        prop_assert_eq!(&again, &recording);
        prop_assert_eq!(again.to_csv(), recording.to_csv());
    }

    #[test]
    fn no_text_makes_the_reader_panic(text in "(resecta instrument recording [12],step_s,)?[\\x00-\\x7f]{0,100}") {
        let _ = read(&text);
    }
}

#[test]
fn saving_and_loading_gives_the_same_recording() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join("run.csv");
    let recording = InstrumentRecording {
        step_s: 1.0 / 60.0,
        ..Default::default()
    };
    recording.save(&path).expect("written");
    assert_eq!(
        InstrumentRecording::load(&path, &InstrumentLimits::default()).expect("read"),
        recording
    );
    assert_eq!(
        std::fs::read_dir(folder.path()).expect("listed").count(),
        1,
        "nothing unfinished is left"
    );
}

#[test]
fn a_bad_recording_is_refused_by_line_and_field() {
    let good = InstrumentRecording {
        step_s: 0.5,
        states: vec![InstrumentState::default()],
        ..Default::default()
    }
    .to_csv();
    let broken = |from: &str, to: &str| read(&good.replacen(from, to, 1)).expect_err(to).to_string();
    let row = "0,0,0,0,0,0,0,0,0\n";
    assert!(good.ends_with(&row.repeat(2)), "{good}");
    let line_four = |cells: &str| broken(&row.repeat(2), &format!("{row}{cells}\n"));
    assert_eq!(
        line_four("0,NaN,0,0,0,0,0,0,0"),
        "bad.csv:4: pitch_deg is \"NaN\", expected a number from -35 to 35"
    );
    assert_eq!(
        line_four("0,0,0,0,31,0,0,0,0"),
        "bad.csv:4: stroke_mm is \"31\", expected a number from 0 to 30"
    );
    assert_eq!(
        line_four("0,0,0,0,0,0,1.1,0,0"),
        "bad.csv:4: outflow_tap is \"1.1\", expected a number from 0 to 1"
    );
    assert_eq!(
        line_four("0,0,0,0,0,0,0,2,0"),
        "bad.csv:4: cut is \"2\", expected 0 or 1"
    );
    assert_eq!(line_four("0,0,0"), "bad.csv:4: row is \"0,0,0\", expected 9 cells");
    assert_eq!(
        broken(",0.5\n", ",-1\n"),
        "bad.csv:1: step_s is \"-1\", expected a positive number of seconds"
    );
    assert!(broken("recording 2", "recording 3").starts_with("bad.csv:1: header is "));
    assert!(broken(&row.repeat(2), "").starts_with("bad.csv:3: row is \"\", expected the state before"));
}

#[test]
fn a_recording_from_before_the_taps_reads_and_writes_the_same() {
    let text = "resecta instrument recording 1,step_s,0.5\n\
        insertion_mm,pitch_deg,yaw_deg,roll_deg,stroke_mm,cut,coagulate\n\
        30,0,0,0,0,0,0\n30,1,0,0,5,1,0\n";
    let recording = read(text).expect("an old file");
    assert!(recording.without_taps);
    assert_eq!(recording.states[0].stroke_mm, 5.0);
    assert_eq!(recording.to_csv(), text);
}
