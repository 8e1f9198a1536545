//! Scripts: continuous where they should be, and refused by file, line, key and field where they are bad.

use std::path::Path;

use proptest::prelude::*;
use resecta_instrument::{InstrumentField, InstrumentLimits, InstrumentScript, InstrumentState, ScriptError};

fn read(text: &str) -> Result<InstrumentScript, ScriptError> {
    InstrumentScript::from_ron(text, Path::new("bad.ron"), &InstrumentLimits::default())
}

fn at(script: &InstrumentScript, time_s: f64) -> InstrumentState {
    script.sample(time_s, &InstrumentState::default())
}

proptest! {
    #[test]
    fn a_script_is_continuous_and_within_limits(
        steps in prop::collection::vec((0.6..2.0f64, 0.0..100.0f32, -20.0..20.0f32, 0.0..30.0f32), 2..8),
    ) {
        let mut time_s = 0.0;
        let mut keys = String::new();
        for (duration_s, insertion_mm, pitch_deg, stroke_mm) in &steps {
            keys += &format!("(time_s: {time_s:?}, insertion_mm: {insertion_mm:?}, pitch_deg: {pitch_deg:?}, stroke_mm: {stroke_mm:?}),");
            time_s += duration_s;
        }
        let limits = InstrumentLimits::default();
        let script = read(&format!("(keys: [{keys}])")).expect("a valid script");
        let tiny_s = 1e-4;
        for count in 0..2000 {
            let time_s = f64::from(count) * script.duration_s() / 1990.0;
            let (now, soon) = (at(&script, time_s), at(&script, time_s + tiny_s));
            for field in InstrumentField::ALL {
                let limit = limits.of(field);
                let change = f64::from((soon.get(field) - now.get(field)).abs());
                prop_assert!(change <= f64::from(limit.max_speed) * tiny_s * 1.01 + 1e-4);
                prop_assert!(limit.contains(now.get(field)));
            }
        }
    }

    #[test]
    fn no_text_makes_the_reader_panic(text in "[\\x00-\\x7f]{0,200}") {
        let _ = read(&text);
    }

    #[test]
    fn no_damage_to_a_script_makes_the_reader_panic(place in 0..90usize, with in any::<char>()) {
        let good = "(keys: [(time_s: 0.0, pitch_deg: 1.0, /* , */ cut: true), (time_s: 1.0, insertion_mm: 30)])";
        let mut text: Vec<char> = good.chars().collect();
        text[place % good.len()] = with;
        let _ = read(&text.into_iter().collect::<String>());
    }
}

#[test]
fn numbers_are_linear_between_keys_and_pedals_hold() {
    let script = read(
        "(keys: [
            (time_s: 0.0, insertion_mm: 10),
            (time_s: 1.0, stroke_mm: 20.0, cut: true),
            (time_s: 2.0, insertion_mm: 30),
            (time_s: 2.5, cut: false, coagulate: true),
            (time_s: 3.0, stroke_mm: 0.0),
        ])",
    )
    .expect("a valid script");
    assert_eq!(
        at(&script, 1.0).insertion_mm,
        20.0,
        "linear over a key that does not name it"
    );
    assert_eq!(at(&script, 0.0).stroke_mm, 20.0, "held before its first key");
    assert_eq!(at(&script, 2.0).stroke_mm, 10.0);
    assert_eq!(at(&script, 9.0).insertion_mm, 30.0, "held after its last key");
    let pedals = |time_s| (at(&script, time_s).cut, at(&script, time_s).coagulate);
    assert_eq!(pedals(0.9), (false, false));
    assert_eq!(pedals(1.0), (true, false));
    assert_eq!(pedals(2.4), (true, false));
    assert_eq!(pedals(3.0), (false, true));
    assert_eq!(pedals(3.1), (false, false), "up once the script is over");
    let start = InstrumentState {
        roll_deg: 12.0,
        ..Default::default()
    };
    assert_eq!(
        script.sample(1.0, &start).roll_deg,
        12.0,
        "a field that no key names stays as it was"
    );
}

/// Every bad script and the message its author gets.
const BAD: [(&str, &str); 13] = [
    ("(keys: [])", "bad.ron: keys is empty, expected at least one key"),
    (
        "(keys: [\n  (time_s: 0.0),\n  (time_s: 2.0),\n  (time_s: 1.0),\n])",
        "bad.ron:4:12: keys[2]: time_s is 1, expected later than 2, the time of the key before",
    ),
    (
        "(keys: [(time_s: 1.0),\n(time_s: 1.0)])",
        "bad.ron:2:10: keys[1]: time_s is 1, expected later than 1, the time of the key before",
    ),
    (
        "(keys: [(time_s: -1.0)])",
        "bad.ron:1:18: keys[0]: time_s is -1, expected 0 or later",
    ),
    (
        "(keys: [(time_s: NaN)])",
        "bad.ron:1:18: keys[0]: time_s is NaN, expected a finite number",
    ),
    (
        "(\n// A remark (with a bracket.\nkeys: [(time_s: 0.0, pitch_deg: NaN)])",
        "bad.ron:3:33: keys[0]: pitch_deg is NaN, expected a finite number",
    ),
    (
        "(keys: [(time_s: 0.0, stroke_mm: 30.5)])",
        "bad.ron:1:34: keys[0]: stroke_mm is 30.5, expected 0 to 30",
    ),
    (
        "(keys: [(time_s: 0.0, roll_deg: inf)])",
        "bad.ron:1:33: keys[0]: roll_deg is inf, expected a finite number",
    ),
    (
        "(keys: [\n(time_s: 0.0, insertion_mm: 0),\n(time_s: 0.1, insertion_mm: 60)])",
        "bad.ron:3:29: keys[1]: insertion_mm changes by 600.0 a second since 0 s, expected at most 200",
    ),
    (
        "(keys: [\n(time_s: 0.0, insertion_cm: 3)])",
        "bad.ron:2:15: keys[0].insertion_cm: there is no field `insertion_cm`; expected one of",
    ),
    (
        "(keys: [\n(insertion_mm: 3)])",
        "bad.ron:2:1: keys[0].time_s: is missing",
    ),
    (
        "(keys: [\n(time_s: 0.0, cut: 1)])",
        "bad.ron:2:20: keys[0].cut: expected true or false, found `1`",
    ),
    (
        "(keys: [(time_s: 0.0)]",
        "bad.ron:1:23: expected `,` or a closing bracket before the end of the file",
    ),
];

#[test]
fn each_bad_script_is_refused_by_place_and_rule() {
    for (text, expected) in BAD {
        let message = read(text).expect_err(text).to_string();
        assert!(
            message.starts_with(expected),
            "{text}\n  says     {message}\n  expected {expected}"
        );
    }
}

#[test]
fn a_script_that_is_not_there_is_named() {
    let error = InstrumentScript::load(Path::new("no/such.ron"), &InstrumentLimits::default()).expect_err("no file");
    assert!(error.to_string().starts_with("no/such.ron: cannot be read"), "{error}");
}
