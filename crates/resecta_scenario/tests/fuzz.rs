//! Parsers on shipped files with slips at random: never a panic, and every error has its place.
//!
//! A longer run: `PROPTEST_CASES=100000 cargo test --release --workspace --test fuzz`.

use std::{
    fs,
    path::{Path, PathBuf},
    sync::LazyLock,
};

use proptest::prelude::*;
use resecta_anatomy::{Case, CaseError};
use resecta_scenario::{
    Curriculum, Exercise, ExerciseError, Extensions, Mod, ModError, Mods, Place, mods, new_exercise, new_mod,
};

/// Bits of text that files are made of.
const BITS: [&str; 34] = [
    "(",
    ")",
    "[",
    "]",
    "{",
    "}",
    ",",
    ":",
    "\"",
    "'",
    "\\",
    "/*",
    "*/",
    "//",
    "\n",
    "-",
    "1e999",
    "NaN",
    "-1",
    "0",
    "1e-320",
    "Some(",
    "None",
    "true",
    "r#\"",
    "\"#",
    "é",
    "\u{202e}",
    "\0",
    "#![enable(implicit_some)]",
    "time_s",
    "share: ",
    "..",
    "../",
];

/// One slip: at this share of the text, of so many characters.
#[derive(Debug, Clone)]
enum Slip {
    Delete(usize),
    Double(usize),
    Insert(&'static str),
    Put(char),
    Cut,
    /// The same characters from elsewhere.
    Move(f64, usize),
}

fn slip() -> impl Strategy<Value = (f64, Slip)> {
    let what = prop_oneof![
        3 => (1..20_usize).prop_map(Slip::Delete),
        2 => (1..60_usize).prop_map(Slip::Double),
        4 => proptest::sample::select(&BITS[..]).prop_map(Slip::Insert),
        3 => any::<char>().prop_map(Slip::Put),
        1 => Just(Slip::Cut),
        2 => (0.0..1.0, 1..40_usize).prop_map(|(from, length)| Slip::Move(from, length)),
    ];
    (0.0..1.0, what)
}

fn with_slips(text: &str, slips: &[(f64, Slip)]) -> String {
    let mut text: Vec<char> = text.chars().collect();
    for (at, slip) in slips {
        let place = |share: f64, text: &[char]| (share * text.len() as f64) as usize;
        let at = place(*at, &text);
        let end = |length: usize, from: usize, text: &[char]| (from + length).min(text.len());
        match slip {
            Slip::Delete(length) => drop(text.drain(at..end(*length, at, &text))),
            Slip::Double(length) => {
                let again = text[at..end(*length, at, &text)].to_vec();
                text.splice(at..at, again);
            }
            Slip::Insert(bit) => drop(text.splice(at..at, bit.chars())),
            Slip::Put(character) => {
                if let Some(there) = text.get_mut(at) {
                    *there = *character;
                }
            }
            Slip::Cut => text.truncate(at),
            Slip::Move(from, length) => {
                let from = place(*from, &text);
                let moved = text[from..end(*length, from, &text)].to_vec();
                text.splice(at..at, moved);
            }
        }
    }
    text.into_iter().collect()
}

/// What ships with these names' end, and what `resecta new` writes.
fn shipped(folder: &str, end: &str) -> Vec<String> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../assets").join(folder);
    let mut files: Vec<PathBuf> = fs::read_dir(folder)
        .unwrap()
        .map(|entry| entry.unwrap().path())
        .collect();
    files.retain(|file| file.to_string_lossy().ends_with(end));
    files.sort();
    files.iter().map(|file| fs::read_to_string(file).unwrap()).collect()
}

static EXERCISES: LazyLock<Vec<String>> = LazyLock::new(|| {
    let mut texts = shipped("exercises", ".exercise.ron");
    texts.push(new_exercise("new"));
    texts
});
static CASES: LazyLock<Vec<String>> = LazyLock::new(|| shipped("cases", ".case.ron"));
static CURRICULA: LazyLock<Vec<String>> = LazyLock::new(|| shipped("", "curriculum.ron"));

fn slips_in(texts: &'static LazyLock<Vec<String>>) -> impl Strategy<Value = String> {
    let text = (0..texts.len()).prop_map(|index| texts[index].as_str());
    (text, proptest::collection::vec(slip(), 1..6)).prop_map(|(text, slips)| with_slips(text, &slips))
}

/// A place is in the text, or just behind its end.
fn is_in(place: Place, text: &str) -> bool {
    let lines: Vec<&str> = text.split('\n').collect();
    let line = place.line.checked_sub(1).and_then(|line| lines.get(line));
    line.is_some_and(|line| place.column >= 1 && place.column <= line.chars().count() + 1)
}

fn is_told(error: &ExerciseError, text: &str) -> bool {
    match error {
        ExerciseError::Syntax { slip, .. } => is_in(slip.place, text) && !slip.message.is_empty(),
        // What a file does not mention has no place.
        ExerciseError::Rule { rule, .. } => {
            !rule.field.is_empty() && !rule.expected.is_empty() && rule.place.is_none_or(|place| is_in(place, text))
        }
        _ => false,
    }
}

proptest! {
    #[test]
    fn exercises(text in slips_in(&EXERCISES)) {
        match Exercise::examine(&text, Path::new("x.exercise.ron"), &Extensions::default()) {
            Ok((_, faults)) => prop_assert!(faults.iter().all(|fault| is_told(fault, &text)), "{faults:?}"),
            Err(slip) => prop_assert!(is_told(&slip, &text), "{slip}"),
        }
    }

    #[test]
    fn cases(text in slips_in(&CASES)) {
        for error in Case::examine(&text, Path::new("x.case.ron")).err().into_iter().flatten() {
            let place = match &error {
                CaseError::Syntax { slip, .. } => Some(slip.place),
                CaseError::Rule { place, .. } => Some(*place),
                _ => None,
            };
            let is_told = place.is_some_and(|place| is_in(place, &text));
            prop_assert!(is_told, "{error}");
        }
    }

    #[test]
    fn curricula(text in slips_in(&CURRICULA)) {
        if let Err(slip) = resecta_text::read::<Curriculum>(&text) {
            prop_assert!(is_in(slip.place, &text) && !slip.message.is_empty(), "{slip:?}");
        }
    }

    #[test]
    fn manifests(slips in proptest::collection::vec(slip(), 1..6)) {
        let [(_, manifest), ..] = new_mod("mine");
        let manifest = manifest.replace("// Mods that must", "needs: [(id: \"other\", version: \"1\")], conflicts: [\"third\"], //");
        let text = with_slips(&manifest, &slips);
        let folder = tempfile::tempdir().unwrap();
        fs::write(folder.path().join(mods::MANIFEST), &text).unwrap();
        let found = Mods::of([folder.path().to_owned()]);
        prop_assert_eq!(found.good().iter().map(Mod::folder).count() + found.aside().len(), 1);
        for fault in found.aside().iter().flat_map(|aside| &aside.faults) {
            let is_told = matches!(&**fault, ModError::Manifest(error) if is_told(error, &text));
            prop_assert!(is_told, "{fault}");
        }
    }
}
