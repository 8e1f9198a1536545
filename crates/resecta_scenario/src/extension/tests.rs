use std::path::Path;

use bevy::prelude::*;

use super::*;
use crate::{errors::ExerciseError, exercise::Goal, library::Library, metrics::Better, metrics::MetricId};

const fn row(id: &'static str) -> MetricInfo {
    MetricInfo {
        id,
        title: "Longest rest",
        unit: "s",
        better: Better::More,
        doc: "The longest time at rest.",
    }
}

macro_rules! metric {
    ($type:ident, $id:literal) => {
        #[derive(Component, Default)]
        struct $type;

        impl MetricExtension for $type {
            const INFO: MetricInfo = row($id);
            const ADVICE: Option<&'static str> = Some("Rest.");

            fn value(&self) -> f64 {
                1.0
            }
        }
    };
}

metric!(Rest, "longest_rest_s");
metric!(OtherRest, "longest_rest_s");
metric!(Shadow, "elapsed_s");
metric!(Nameless, "Longest rest");

impl GoalExtension for Rest {
    const NAME: &'static str = "rested";
    const WORDS: &'static str = "Rest for a while";

    fn share(&self) -> f64 {
        0.5
    }
}

impl ExerciseExtension for Rest {
    const NAME: &'static str = "rest";

    fn exercise() -> Exercise {
        let mut extensions = Extensions::default();
        extensions.add_metric::<Rest>();
        extensions.add_goal::<Rest>();
        Exercise::from_ron_with(TEXT, Path::new("rest.exercise.ron"), &extensions).unwrap()
    }
}

impl ExerciseExtension for OtherRest {
    const NAME: &'static str = "first_cuts";

    fn exercise() -> Exercise {
        Rest::exercise()
    }
}

const TEXT: &str = r#"(
    title: "Rest",
    briefing: "Hold still.",
    case: "small",
    marked: (zones: [MiddleLobe]),
    steps: [(say: "Rest.", until: Extension("rested"))],
    goals: [Extension("rested")],
    limits: (time_s: 20),
    scoring: [(metric: "longest_rest_s", points: 60, from: 0, to: 1, basis: "test")],
)"#;

fn library() -> Library {
    Library::new(Path::new("../../assets"))
}

fn of_rest() -> Extensions {
    let mut extensions = Extensions::default();
    extensions.add_goal::<Rest>();
    extensions.add_metric::<Rest>();
    extensions.add_exercise::<Rest>();
    assert_eq!(extensions.refused(), []);
    extensions
}

#[test]
fn a_file_names_what_is_registered_and_nothing_else() {
    let file = Path::new("mine.exercise.ron");
    let library = library().with_extensions(of_rest());
    let exercise = library.load_text(TEXT, file).unwrap().exercise;
    assert_eq!(exercise.scoring[0].metric, MetricId::of::<Rest>());
    assert_eq!(exercise.goals, [Goal::Extension(GoalId::of::<Rest>())]);
    let places: Vec<String> = exercise.extensions().map(|(field, _)| field).collect();
    assert_eq!(places, ["steps[0].until", "goals[0]", "scoring[0].metric"]);

    for (slip, expected) in [
        (
            TEXT.replace("longest_rest_s", "longst_rest_s"),
            "mine.exercise.ron:9:24: scoring[0].metric: unknown metric \"longst_rest_s\"; did you mean `longest_rest_s`?",
        ),
        (
            TEXT.replace("longest_rest_s", "elapsed"),
            "mine.exercise.ron:9:24: scoring[0].metric: unknown metric \"elapsed\"; did you mean `elapsed_s`?",
        ),
        (
            TEXT.replace("goals: [Extension(\"rested\")]", "goals: [Extension(\"restd\")]"),
            "mine.exercise.ron:7:13: goals[0].Extension: unknown goal of an extension \"restd\"; did you mean `rested`?",
        ),
    ] {
        let error = library.load_text(&slip, file).map(drop).unwrap_err();
        assert_eq!(error.to_string(), expected);
    }
    let unknown = Exercise::from_ron(TEXT, file).map(drop).unwrap_err().to_string();
    assert!(unknown.contains("unknown goal of an extension \"rested\""), "{unknown}");
}

#[test]
fn an_exercise_in_rust_is_found_by_its_name_and_keeps_the_rules_of_files() {
    let library = library().with_extensions(of_rest());
    assert!(library.exercise_names().contains(&"rest".to_owned()));
    assert!(library.exercise_names().is_sorted());
    let loaded = library.load("rest").unwrap();
    assert_eq!((loaded.name.as_str(), loaded.exercise.title.as_str()), ("rest", "Rest"));

    let rule = |library: &Library, exercise| match library.load_value("mine", exercise) {
        Err(ExerciseError::Rule { rule, .. }) => (rule.field, rule.nearest),
        other => panic!("{other:?}"),
    };
    let broken = Exercise {
        alpha_deg: 100.0,
        ..Rest::exercise()
    };
    assert_eq!(rule(&library, broken).0, "alpha_deg");
    let not_here = rule(&self::library(), Rest::exercise());
    assert_eq!(not_here, ("steps[0].until".into(), None));
    let missing = library.load("ret").map(drop).unwrap_err().to_string();
    assert!(missing.ends_with("did you mean `rest`?"), "{missing}");
}

#[test]
fn a_second_of_one_name_is_refused_by_name_and_the_first_stays() {
    let mut extensions = of_rest();
    // Once more is no other.
    extensions.add_metric::<Rest>();
    extensions.add_goal::<Rest>();
    extensions.add_exercise::<Rest>();
    assert_eq!(extensions.refused(), []);
    extensions.add_metric::<OtherRest>();
    extensions.add_metric::<Shadow>();
    extensions.add_metric::<Nameless>();
    let told: Vec<String> = extensions.refused().iter().map(ToString::to_string).collect();
    let of = |name: &str, what: &str| format!("extension `{}::{name}`: the name {what}", module_path!());
    assert_eq!(
        told,
        [
            of("OtherRest", "\"longest_rest_s\" is taken"),
            of("Shadow", "\"elapsed_s\" is taken"),
            of("Nameless", "\"Longest rest\" is not of a to z, 0 to 9 and _"),
        ]
    );
    assert_eq!(extensions.metric("longest_rest_s"), Some(MetricId::of::<Rest>()));
    assert!(extensions.metric_names().eq(["longest_rest_s", "rested"]));
}

#[test]
fn a_shipped_file_goes_before_an_exercise_in_rust() {
    let mut extensions = of_rest();
    extensions.add_exercise::<OtherRest>();
    let library = library().with_extensions(extensions);
    assert!(library.shadowed().eq([ExtensionError::Shipped { name: "first_cuts" }]));
    assert_ne!(library.load("first_cuts").unwrap().exercise.title, "Rest");
    let names = library.exercise_names();
    assert_eq!(names.iter().filter(|name| *name == "first_cuts").count(), 1);
}

#[test]
fn the_order_of_registration_does_not_matter() {
    let mut app = App::new();
    app.add_exercise::<Rest>()
        .add_metric::<Rest>()
        .add_plugins(crate::ScenarioPlugin::default())
        .add_goal::<Rest>();
    let extensions = app.world().resource::<Extensions>();
    assert!(extensions.metric_names().eq(of_rest().metric_names()));
    assert!(extensions.goal_names().eq(of_rest().goal_names()));
    assert!(extensions.exercise_names().eq(of_rest().exercise_names()));
}

#[test]
fn what_was_known_before_is_known_again_after_a_text_was_read() {
    let extensions = of_rest();
    while_known(&extensions, || {
        while_known(&Extensions::default(), || assert!(known_goal("rested").is_err()));
        assert_eq!(known_goal("rested"), Ok(GoalId::of::<Rest>()));
    });
    assert!(known_goal("rested").is_err());
}
