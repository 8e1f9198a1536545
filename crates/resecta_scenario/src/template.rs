//! A file to begin with: what `resecta new` writes. It keeps every rule, plays at once and says what may be changed.

use crate::{
    library::{CASE_SUFFIX, EXERCISE_SUFFIX},
    mods::MANIFEST,
};
use resecta_anatomy::{
    Case,
    generate::{GlandSpec, generate},
};

/// Versions of Resecta like this one.
const RESECTA: &str = concat!(env!("CARGO_PKG_VERSION_MAJOR"), ".", env!("CARGO_PKG_VERSION_MINOR"));

/// Most characters of the name of an exercise or a case.
const MAX_NAME: usize = 64;

/// The gland of a new case.
const GLAND: GlandSpec = GlandSpec {
    volume_ml: 40.0,
    median_lobe_mm: 6.0,
    seed: 1,
};

/// Checks the name of an exercise or a case, which is a name of files on every system: small letters of English, digits
/// and `_`, a letter first.
///
/// # Errors
/// What is wrong with it.
pub fn check_name(name: &str) -> Result<(), String> {
    // Files of these names cannot be made on Windows, whatever follows them.
    let is_device = ["con", "prn", "aux", "nul"].contains(&name)
        || (name.len() == 4
            && (name.starts_with("com") || name.starts_with("lpt"))
            && name.ends_with(|c: char| c.is_ascii_digit()));
    if is_device {
        return Err("expected another name: files of this one cannot be made on Windows".into());
    }
    let is_name = name.starts_with(|c: char| c.is_ascii_lowercase())
        && name
            .chars()
            .all(|c| c.is_ascii_lowercase() || c.is_ascii_digit() || c == '_');
    if is_name && name.len() <= MAX_NAME {
        Ok(())
    } else {
        Err(format!(
            "expected a name of small letters, digits and `_`, a letter first, at most {MAX_NAME}, such as `my_first`"
        ))
    }
}

/// The text of an exercise to begin with.
pub fn new_exercise(name: &str) -> String {
    TEMPLATE.replace("TITLE", &title(name))
}

/// The text of a case to begin with: a generated gland.
pub fn new_case(name: &str) -> String {
    let case = Case {
        name: title(name),
        // What the generator makes of these dimensions is tested.
        ..generate(&GLAND).expect("a gland of published dimensions")
    };
    format!("{CASE_HEAD}{}", case.to_ron())
}

/// The files of a mod to begin with, by their paths in its folder: a manifest, an exercise and its case.
pub fn new_mod(name: &str) -> [(String, String); 3] {
    let manifest = MANIFEST_TEMPLATE
        .replace("TITLE", &title(name))
        .replace("VERSION", RESECTA);
    let manifest = manifest.replace("ID", name);
    let (of_shipped, of_own) = ("    case: \"medium\",", "    case: \"own\",");
    let exercise = new_exercise("first").replace(of_shipped, of_own);
    let exercise = exercise.replace(
        "or a file beside this one: \"my.case.ron\" (resecta new\n    // case my); in a mod also one of its cases/ by its name: \"my\".",
        "or one of the mod's\n    // cases/ by its name.",
    );
    [
        (MANIFEST.into(), manifest),
        (format!("exercises/first{EXERCISE_SUFFIX}"), exercise),
        (format!("cases/own{CASE_SUFFIX}"), new_case("own")),
    ]
}

/// `my_first` as a title: `My first`.
fn title(name: &str) -> String {
    let words = name.replace('_', " ");
    let mut letters = words.chars();
    letters
        .next()
        .map_or_else(String::new, |first| first.to_uppercase().chain(letters).collect())
}

const TEMPLATE: &str = r#"// An exercise of Resecta. Look for slips:  resecta validate THIS_FILE
//                         Play it:         resecta --exercise THIS_FILE
(
    title: "TITLE",
    briefing: "Resect the marked part of the middle lobe. Push the loop out over it, press the cutting pedal, draw the loop back, \
               release.",

    // The gland: small, medium, large, larger_left_lobe or paper, which ship, or a file beside this one: "my.case.ron" (resecta new
    // case my); in a mod also one of its cases/ by its name: "my".
    case: "medium",
    // Angle between two rays of the lattice, degrees: 8 is fine, 10 runs faster.
    alpha_deg: 14,

    // Where the sheath begins; without this line beside the verumontanum.
    instrument: (start: (insertion_mm: 4, pitch_deg: -25)),

    // What the exercise is about: zones (LateralLobe, MiddleLobe, Peripheral, Other), hours on the clock as seen through the lens (12
    // is up), heights and depths in mm.
    marked: (
        zones: [MiddleLobe],
        clock: (from: 5, to: 7),
        height: BelowBladderNeck(from_mm: -20, to_mm: 20),
        depth_mm: (from: 0, to: 12),
    ),

    // To add water and blood: models: (water: (bleeding: (), turbidity: ())),
    // To teach step by step:  steps: [(say: "Advance by 15 mm.", hint: "Why.", until: Advanced(mm: 15))], and the goal FinishSteps.

    goals: [RemoveMarked(share: 0.8)],

    // What ends a run early: time in s; also capsule_cut_share, sphincter_injuries, blood_lost_ml, absorbed_ml.
    limits: (time_s: 300),

    // Each line earns points as its metric goes from `from` (none) to `to` (all).
    scoring: [
        (
            metric: "marked_removed_share",
            points: 70,
            from: 0,
            to: 0.8,
            basis: "My choice: the goal.",
            // Medals. They earn no points.
            pars: (bronze: 0.6, silver: 0.7, gold: 0.8, basis: "My choice."),
        ),
        (
            metric: "capsule_touches",
            points: 30,
            from: 3,
            to: 0,
            basis: "My choice: none is needed.",
            // Counts only once something was done.
            needs: (metric: "marked_removed_share", at_least: 0.4),
        ),
    ],

    // Medals for the total, which open levels: total_pars: (bronze: 60, silver: 80, gold: 90, basis: "My choice."),

    // Who shows it at the briefing: Careful, a scripted player, or Script("name"), a script that moves the instrument.
    shown_by: Careful,
)
"#;

const MANIFEST_TEMPLATE: &str = r#"// A mod of Resecta: exercises and cases in a folder. Look for slips:  resecta validate THIS_FOLDER
(
    // Its name in files and commands. Its exercises are ID/first and so on.
    id: "ID",
    title: "TITLE",
    version: "0.1.0",
    description: "",

    // Versions of Resecta that it works with.
    resecta: "VERSION",

    // Mods that must be there, too: needs: [(id: "other_mod", version: "1.2")], whose cases are then "other_mod/name".
    // Mods that must not:           conflicts: ["another_mod"],
)
"#;

const CASE_HEAD: &str = "\
// A case of Resecta: one gland, in mm; +x is the patient's left, +y posterior, +z towards the bladder.
// This one was generated. Change its contours, or write over them what you have measured:
//   resecta import FILE --out X.case.ron      makes a case from contours or a segmentation mask,
//   resecta generate --help                   makes others like this one.
// `urethra`, `transition_zone` and `landmarks` may be left out: rules that `approximated` then names fill them in.
// Look for slips: resecta validate THIS_FILE. Its numbers: resecta mesh THIS_FILE.
";
