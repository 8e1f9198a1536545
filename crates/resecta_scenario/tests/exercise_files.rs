//! Exercise files: what a good one says, and what a bad one is told.

use std::{
    fs,
    path::{Path, PathBuf},
};

use proptest::prelude::*;
use resecta_instrument::InstrumentState;
use resecta_scenario::{Exercise, ExerciseError, Extensions, Library, Models};
use resecta_solver::{CollapseLaw, ShearResistance};
use resecta_tissue::CuttingRule;

/// Keeps every rule; each bad file below differs from it in one thing.
const GOOD: &str = r#"(
    title: "Title",
    briefing: "Do it.",
    case: "medium",
    marked: (
        zones: [MiddleLobe],
        clock: (from: 5, to: 7),
        depth_mm: (from: 0, to: 12),
    ),
    goals: [RemoveMarked(share: 0.8)],
    limits: (time_s: 300),
    scoring: [
        (metric: "marked_removed_share", points: 80, from: 0, to: 0.8, basis: "ours"),
        (metric: "elapsed_s", points: 20, from: 300, to: 100, basis: "ours"),
    ],
)"#;

fn parse(text: &str) -> Result<Exercise, ExerciseError> {
    Exercise::from_ron(text, Path::new("mine.exercise.ron"))
}

/// The message for `GOOD` with `replacement` in place of `original`.
fn message(original: &str, replacement: &str) -> String {
    assert_eq!(GOOD.matches(original).count(), 1, "{original}");
    match parse(&GOOD.replace(original, replacement)) {
        Ok(_) => panic!("{replacement} was taken"),
        Err(error) => error.to_string(),
    }
}

#[test]
fn what_is_left_out_has_its_stated_default() {
    let exercise = parse(GOOD).unwrap();
    assert_eq!(exercise.alpha_deg, 14.0);
    assert_eq!(exercise.models, Models::default());
    assert_eq!(exercise.models.collapse, Some(CollapseLaw::default()));
    assert_eq!(exercise.instrument.start, None);
}

#[test]
fn everything_can_be_said_with_or_without_some() {
    let all = |some: &str, end: &str| {
        let fields = format!(
            "material: {some}\"ex_vivo\"{end},
            models: (
                collapse: {some}HydraulicPressure(resistance_un: 200){end},
                shear: {some}PreTension(0.03){end},
                collision: false,
                cutting: Sphere(radius_mm: 4),
            ),
            instrument: (
                pivot_mm: {some}(0, 1.5, -10){end},
                axis: {some}(0, 0, 1){end},
                start: {some}(insertion_mm: 20, pitch_deg: -3){end},
            ),
            case:"
        );
        parse(&GOOD.replace("case:", &fields)).unwrap()
    };
    let exercise = all("", "");
    assert_eq!(exercise, all("Some(", ")"));
    assert_eq!(
        exercise.models.collapse,
        Some(CollapseLaw::HydraulicPressure { resistance_un: 200.0 })
    );
    assert_eq!(exercise.models.shear, Some(ShearResistance::PreTension(0.03)));
    assert_eq!(exercise.models.cutting, CuttingRule::Sphere { radius_mm: 4.0 });
    let start = InstrumentState {
        insertion_mm: 20.0,
        pitch_deg: -3.0,
        ..InstrumentState::default()
    };
    assert_eq!(exercise.instrument.start, Some(start));
    let none = parse(&GOOD.replace("case:", "models: (collapse: None), case:")).unwrap();
    assert_eq!(none.models.collapse, None);
}

#[test]
fn an_exercise_written_out_reads_back_the_same() {
    let exercise = parse(GOOD).unwrap();
    let text = ron::ser::to_string_pretty(&exercise, ron::ser::PrettyConfig::new()).unwrap();
    assert_eq!(parse(&text).unwrap(), exercise);
}

#[test]
fn slips_of_syntax_are_placed() {
    assert_eq!(
        message("share: 0.8)]", "share: 0.8]"),
        "mine.exercise.ron:10:36: goals[0].RemoveMarked: expected `,` or a closing bracket before `]`"
    );
    assert_eq!(
        message("briefing:", "breifing:"),
        "mine.exercise.ron:3:5: breifing: there is no field `breifing`; expected one of `title`, `briefing`, `case`, `alpha_deg`, \
         `material`, `models`, `begun`, `instrument`, `marked`, `steps`, `goals`, `limits`, `scoring`, `total_pars`, `shown_by`; did you mean \
         `briefing`?"
    );
    assert_eq!(
        message("MiddleLobe", "MidleLobe"),
        "mine.exercise.ron:6:17: marked.zones[0]: there is no `MidleLobe`; expected one of `LateralLobe`, `MiddleLobe`, \
         `Peripheral`, `Other`; did you mean `MiddleLobe`?"
    );
    let unknown = message("elapsed_s", "elapsed");
    assert_eq!(
        unknown,
        "mine.exercise.ron:14:18: scoring[1].metric: unknown metric \"elapsed\"; did you mean `elapsed_s`?"
    );
    assert_eq!(
        message("time_s: 300", "time_s: \"long\""),
        "mine.exercise.ron:11:22: limits.time_s: expected a number, found `\"long\"`"
    );
}

#[test]
fn broken_rules_name_field_value_and_what_was_expected() {
    let cases = [
        (
            ("points: 80", "points: -5"),
            "scoring[0].points is -5; expected 0 or more",
        ),
        (
            ("from: 300, to: 100", "from: 100, to: 300"),
            "scoring[1].to is 300; expected less than `from` (100): less elapsed_s is better",
        ),
        (
            ("from: 0, to: 0.8, basis", "from: 0.8, to: 0.8, basis"),
            "scoring[0].to is 0.8; expected more than `from` (0.8): more marked_removed_share is better",
        ),
        (
            ("share: 0.8", "share: 1.2"),
            "goals[0].RemoveMarked.share is 1.2; expected a share above 0 and at most 1",
        ),
        (
            ("share: 0.8", "share: NaN"),
            "goals[0].RemoveMarked.share is NaN; expected a share above 0 and at most 1",
        ),
        (
            ("time_s: 300", "time_s: inf"),
            "limits.time_s is inf; expected a finite number of s above 0",
        ),
        (
            ("time_s: 300", "time_s: 300, capsule_cut_share: 1.5"),
            "limits.capsule_cut_share is 1.5; expected a share above 0 and at most 1",
        ),
        (
            ("time_s: 300", "time_s: 300, sphincter_injuries: 0"),
            "limits.sphincter_injuries is 0; expected 1 or more",
        ),
        (
            ("time_s: 300", "time_s: 300, blood_lost_ml: 100"),
            "limits.blood_lost_ml is 100; expected nothing, or `models: (water: (bleeding: (..)))`: without it the limit is \
             never reached",
        ),
        (
            (
                "goals:",
                "steps: [(say: \"cut\", until: MarkedRemoved(share: 2))], goals:",
            ),
            "steps[0].until.MarkedRemoved.share is 2; expected a share above 0 and at most 1",
        ),
        (
            (
                "goals:",
                "models: (water: ()), steps: [(say: \"look\", until: ViewClear(share: 0.5, s: 2))], goals:",
            ),
            "steps[0].until is ViewClear; expected another trigger, or `models: (water: (turbidity: (..)))`",
        ),
        (
            ("marked: (", "instrument: (start: (stroke_mm: 42)), marked: ("),
            "instrument.start.stroke_mm is 42; expected 0 to 30, the limits of the instrument",
        ),
        (
            ("marked: (", "instrument: (start: (inflow_tap: 1)), marked: ("),
            "instrument.start.inflow_tap is 1; expected nothing: `models.water.irrigation` says how far the taps are open",
        ),
        (
            ("marked: (", "instrument: (optic_deg: 15), marked: ("),
            "instrument.optic_deg is 15; expected 0, 12 or 30 degrees, the telescopes that there are",
        ),
        (
            ("case: \"medium\"", "case: \"medium\", material: \"ex_vitro\""),
            "material is \"ex_vitro\"; expected a material preset (palpation_5hz, palpation_static, ex_vivo, \
             mr_elastography, papers_lattice); did you mean `ex_vivo`?",
        ),
        (
            ("[MiddleLobe]", "[]"),
            "marked.zones is empty; expected at least one of LateralLobe, MiddleLobe, Peripheral, Other",
        ),
        (
            ("to: 7", "to: 13"),
            "marked.clock.to is 13; expected an hour from 0 to 12",
        ),
        (
            ("(from: 0, to: 12)", "(from: 12, to: 0)"),
            "marked.depth_mm.to is 0; expected more than `marked.depth_mm.from` (12)",
        ),
        (
            (
                "depth_mm: (",
                "height: BelowBladderNeck(from_mm: 5, to_mm: -5), depth_mm: (",
            ),
            "marked.height.BelowBladderNeck.to_mm is -5; expected more than `marked.height.BelowBladderNeck.from_mm` (5)",
        ),
        (
            ("case: \"medium\"", "case: \"medium\", alpha_deg: 0.1"),
            "alpha_deg is 0.1; expected 2 to 60 degrees",
        ),
        (
            ("[RemoveMarked(share: 0.8)]", "[FinishSteps]"),
            "goals[0] is FinishSteps; expected another goal, or `steps: [..]` to finish",
        ),
        (
            ("goals:", "steps: [(say: \" \", until: Advanced(mm: 5))], goals:"),
            "steps[0].say is empty; expected some text",
        ),
        (
            ("goals:", "steps: [(say: \"Go\", until: Advanced(mm: 0))], goals:"),
            "steps[0].until.Advanced.mm is 0; expected a finite number of mm above 0",
        ),
        (
            (
                "goals:",
                "steps: [(say: \"Drain\", until: BladderBelow(ml: 50))], goals:",
            ),
            "steps[0].until is BladderBelow; expected a trigger that a dry exercise has, or `models: (water: (..))`",
        ),
        (
            (
                "100, basis: \"ours\"",
                "100, pars: (bronze: 200, silver: 250, gold: 100, basis: \"b\"), basis: \"ours\"",
            ),
            "scoring[1].pars.silver is 250; expected less than `bronze` (200)",
        ),
        (
            (
                "to: 0.8, basis",
                "to: 0.8, pars: (bronze: 0.5, silver: 0.6, gold: 0.6, basis: \"b\"), basis",
            ),
            "scoring[0].pars.gold is 0.6; expected more than `silver` (0.6)",
        ),
        (
            (
                "to: 0.8, basis",
                "to: 0.8, pars: (bronze: 0.5, silver: 0.6, gold: 0.7, basis: \"\"), basis",
            ),
            "scoring[0].pars.basis is empty; expected where the three values come from",
        ),
        (
            ("[RemoveMarked(share: 0.8)]", "[]"),
            "goals is empty; expected at least one goal",
        ),
        (
            ("100, basis: \"ours\"", "100, basis: \" \""),
            "scoring[1].basis is empty; expected where the two values come from",
        ),
        (
            ("marked: (", "models: (cutting: Sphere(radius_mm: 0)), marked: ("),
            "models.cutting.Sphere.radius_mm is 0; expected a finite number of mm above 0",
        ),
        (
            ("marked: (", "models: (poisson_ratio: Some(0.5)), marked: ("),
            "models.poisson_ratio is 0.5; expected 0 to 0.49",
        ),
        (
            (
                "marked: (",
                "models: (shear: Some(Diagonals), poisson_ratio: Some(0.2)), marked: (",
            ),
            "models.poisson_ratio is 0.2; expected 0.25 to 0.49 with diagonals",
        ),
        (
            (
                "marked: (",
                "models: (water: (irrigation: (bag_height_cmh2o: 500))), marked: (",
            ),
            "models.water.irrigation.bag_height_cmh2o is 500; expected 0 to 100 cmH2O",
        ),
        (
            ("marked: (", "models: (water: (bladder_ml: -1)), marked: ("),
            "models.water.bladder_ml is -1; expected 0 to 1e6 ml",
        ),
        (
            (
                "marked: (",
                "models: (water: (bleeding: (circulation: (pulsatility: 2)))), marked: (",
            ),
            "models.water.bleeding.circulation.pulsatility is 2; expected 0 to 1",
        ),
        (
            ("marked: (", "models: (water: (turbidity: (fossa_ml: 0))), marked: ("),
            "models.water.turbidity.fossa_ml is 0; expected 0.1 to 1,000 ml",
        ),
        (
            ("marked: (", "models: (collapse: CompressionForce(share: 5)), marked: ("),
            "models.collapse.CompressionForce.share is 5; expected a share from 0 to 1",
        ),
        (
            ("marked: (", "models: (shear: PreTension(1.5)), marked: ("),
            "models.shear is 1.5; expected a strain from 0 to 0.2",
        ),
        (
            ("marked: (", "instrument: (axis: (0, 0, 0)), marked: ("),
            "instrument.axis is [0.0, 0.0, 0.0]; expected a direction, not zero",
        ),
    ];
    for ((original, replacement), expected) in cases {
        let told = message(original, replacement);
        let place =
            (told.strip_prefix("mine.exercise.ron:")).and_then(|told| told.strip_suffix(&format!(": {expected}")));
        let place = place.unwrap_or_else(|| panic!("{told}"));
        assert!(place.split(':').all(|number| number.parse::<u32>().is_ok()), "{told}");
    }
}

#[test]
fn every_rule_that_is_broken_is_told_with_its_place() {
    let text = GOOD
        .replace("points: 80", "points: -5")
        .replace("share: 0.8", "share: 1.2")
        .replace("to: 7", "to: 13");
    let (_, faults) = Exercise::examine(&text, Path::new("mine.exercise.ron"), &Extensions::default()).unwrap();
    let told: Vec<String> = faults.iter().map(ToString::to_string).collect();
    assert_eq!(
        told,
        [
            "mine.exercise.ron:7:30: marked.clock.to is 13; expected an hour from 0 to 12",
            "mine.exercise.ron:10:33: goals[0].RemoveMarked.share is 1.2; expected a share above 0 and at most 1",
            "mine.exercise.ron:13:50: scoring[0].points is -5; expected 0 or more",
        ]
    );
}

/// A folder of assets with cases that are files by name only.
fn library(folder: &Path) -> Library {
    fs::create_dir_all(folder.join("cases")).unwrap();
    fs::create_dir_all(folder.join("exercises")).unwrap();
    for case in ["small", "medium"] {
        fs::write(folder.join("cases").join(format!("{case}.case.ron")), "(name: 3)").unwrap();
    }
    fs::write(folder.join("exercises/mine.exercise.ron"), GOOD).unwrap();
    Library::new(folder)
}

fn load_error(library: &Library, text: &str, file: &Path) -> String {
    library.load_text(text, file).unwrap_err().to_string()
}

#[test]
fn a_missing_case_is_named_with_the_nearest() {
    let folder = tempfile::tempdir().unwrap();
    let library = library(folder.path());
    let file = PathBuf::from("mine.exercise.ron");
    assert_eq!(
        load_error(&library, &GOOD.replace("medium", "mediun"), &file),
        "mine.exercise.ron:4:11: case is \"mediun\"; expected the path of a .case.ron file or a shipped case (medium, small); \
         did you mean `medium`?"
    );
    assert_eq!(
        load_error(&library, &GOOD.replace("medium", "glands/my.case.ron"), &file),
        "mine.exercise.ron:4:11: case is \"glands/my.case.ron\"; expected a case file, but there is none at \
         glands/my.case.ron"
    );
}

#[test]
fn a_bad_case_names_both_files() {
    let folder = tempfile::tempdir().unwrap();
    let library = library(folder.path());
    let error = load_error(&library, GOOD, Path::new("mine.exercise.ron"));
    assert!(error.starts_with("mine.exercise.ron:4:11: case: "), "{error}");
    assert!(error.contains("medium.case.ron:1:"), "{error}");
}

#[test]
fn a_missing_exercise_is_named_with_the_nearest() {
    let folder = tempfile::tempdir().unwrap();
    let library = library(folder.path());
    assert_eq!(library.exercise_names(), ["mine"]);
    let error = library.load("min").unwrap_err().to_string();
    assert!(
        error.ends_with("min.exercise.ron: no such exercise file; did you mean `mine`?"),
        "{error}"
    );
    let path = folder.path().join("other.exercise.ron");
    let error = library.load(path.to_str().unwrap()).unwrap_err();
    assert!(matches!(error, ExerciseError::Missing { nearest: None, .. }), "{error}");
}

#[test]
fn what_is_no_text_or_too_large_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let library = library(folder.path());
    let path = folder.path().join("x.exercise.ron");
    for bytes in [vec![0xff; 9], vec![b' '; 2 << 20]] {
        fs::write(&path, bytes).unwrap();
        let error = library.load(path.to_str().unwrap()).unwrap_err();
        assert!(matches!(error, ExerciseError::Read { .. }), "{error}");
    }
}

proptest! {
    #[test]
    fn any_bytes_are_refused_and_never_panic(bytes in prop::collection::vec(any::<u8>(), 0..400)) {
        prop_assert!(parse(&String::from_utf8_lossy(&bytes)).is_err());
    }

    #[test]
    fn any_slip_in_a_good_file_is_survived(at in 0..GOOD.len(), put in prop::sample::select(vec![
        "", "(", ")", "[", "]", ",", "\"", "-", "NaN", "1e999", "Some(", "/*", "\u{0}", "é", "9999999999999999999999",
    ]), drop in 0..12usize) {
        let mut text = GOOD.to_owned();
        let end = (at + drop).min(text.len());
        text.replace_range(at..end, put);
        // Taken or refused, whichever it deserves; a refusal names the file.
        if let Err(error) = parse(&text) {
            prop_assert!(error.to_string().starts_with("mine.exercise.ron"));
        }
    }
}
