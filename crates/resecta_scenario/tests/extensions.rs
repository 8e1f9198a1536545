//! Metrics, goals and exercises of an extension, on the whole stack.

use bevy::{
    ecs::schedule::{LogLevel, ScheduleBuildSettings},
    prelude::*,
};
use resecta_instrument::InstrumentState;
use resecta_scenario::{
    Better, EndReason, Exercise, ExerciseExtension, Extensions, Goal, GoalExtension, GoalId, MetricExtension, MetricId,
    MetricInfo, Metrics, RunState, ScenarioAppExt, ScenarioSystems, ScoreRule, advice, testing::Trial,
};
use resecta_tissue::TissueContact;

/// How far the loop was out at most, mm.
#[derive(Component, Default)]
struct Reach(f64);

impl MetricExtension for Reach {
    const INFO: MetricInfo = MetricInfo {
        id: "largest_reach_mm",
        title: "Largest reach",
        unit: "mm",
        better: Better::More,
        doc: "How far the loop was out at most.",
    };
    const ADVICE: Option<&'static str> = Some("Push the loop out further.");

    fn value(&self) -> f64 {
        // What is not finite is passed over.
        if self.0 > 11.0 { f64::NAN } else { self.0 }
    }
}

impl GoalExtension for Reach {
    const NAME: &'static str = "reached_out";
    const WORDS: &'static str = "Push the loop out by 10 mm";

    fn share(&self) -> f64 {
        self.0 / 10.0
    }
}

/// An exercise of it, without harm to anyone.
struct Reaching;

impl ExerciseExtension for Reaching {
    const NAME: &'static str = "reaching";

    fn exercise() -> Exercise {
        Exercise::from_ron_with(TEXT, "reaching.exercise.ron".as_ref(), &extensions()).unwrap()
    }
}

fn extensions() -> Extensions {
    let mut extensions = Extensions::default();
    extensions.add_metric::<Reach>();
    extensions.add_goal::<Reach>();
    extensions
}

const TEXT: &str = r#"(
    title: "Reaching",
    briefing: "Push the loop out.",
    case: "small",
    alpha_deg: 20,
    models: (collision: false),
    marked: (zones: [MiddleLobe]),
    steps: [(say: "Wait.", until: Waited(s: 0.1)), (say: "Push.", until: Extension("reached_out"))],
    goals: [Extension("reached_out"), FinishSteps],
    limits: (time_s: 20),
    scoring: [
        (metric: "largest_reach_mm", points: 60, from: 0, to: 20, basis: "test",
            pars: (bronze: 5, silver: 8, gold: 12, basis: "test")),
        (metric: "reached_out", points: 40, from: 0, to: 1, basis: "test"),
    ],
)"#;

fn follow(mut reaches: Query<(&mut Reach, &InstrumentState)>) {
    for (mut reach, state) in &mut reaches {
        reach.0 = reach.0.max(f64::from(state.stroke_mm));
    }
}

fn plugin(app: &mut App) {
    app.add_exercise::<Reaching>()
        .add_goal::<Reach>()
        .add_metric::<Reach>()
        .add_systems(FixedPostUpdate, follow.in_set(ScenarioSystems::Extend));
}

/// Pushes the loop out by a mm in every tenth step.
fn push(trial: &mut Trial, steps: u32) {
    trial.steps_by(steps, |step, state| state.stroke_mm = step as f32 / 10.0);
}

#[test]
fn an_extension_measures_ends_steps_and_the_run_and_is_reported() {
    let mut trial = Trial::new(plugin);
    trial.app.configure_schedules(ScheduleBuildSettings {
        ambiguity_detection: LogLevel::Error,
        ..default()
    });
    trial.start("reaching").unwrap();
    push(&mut trial, 91);
    let near = |value: f64, wanted: f64| assert!((value - wanted).abs() < 0.02, "{value} is not {wanted}");
    near(trial.value("largest_reach_mm"), 9.0);
    near(trial.value("reached_out"), 0.9);
    let goal = &trial.report().score.goals[0];
    assert_eq!((goal.goal.as_str(), goal.at_least), (Reach::WORDS, 1.0));
    assert!(!goal.reached);
    assert_eq!(trial.value("steps_done"), 1.0, "the other step waits for the goal");

    trial.steps_by(20, |step, state| state.stroke_mm = 9.1 + step as f32 / 10.0);
    assert_eq!(trial.state(), RunState::Ended(EndReason::GoalsReached));
    let report = trial.report();
    assert_eq!(trial.value("steps_done"), 2.0);
    let line = &report.score.lines[0];
    assert_eq!((line.metric, line.unit), (MetricId::of::<Reach>(), "mm"));
    near(line.points, 30.0);
    assert_eq!(line.medal.map(|medal| medal.name()), Some("silver"));
    let reported = report.metrics.iter().map(|metric| metric.id);
    let of_extensions = [
        MetricId::of::<Reach>(),
        MetricId::Extension(GoalId::of::<Reach>().metric()),
    ];
    assert!(reported.skip(MetricId::ALL.len()).eq(of_extensions));
    let json = report.to_json();
    assert!(json.contains("\"id\": \"largest_reach_mm\""), "{json}");
    let said = advice(&report.score, trial.app.world().resource::<Metrics>(), 3);
    let sentences: Vec<&str> = said.iter().map(|advice| advice.sentence).collect();
    assert_eq!(sentences, ["Push the loop out further."]);
}

#[test]
fn values_that_are_not_finite_leave_the_value_before() {
    let mut trial = Trial::new(plugin);
    let mut exercise = Reaching::exercise();
    exercise.goals.push(Goal::RemoveMarked { share: 1.0 });
    trial.start(exercise).unwrap();
    push(&mut trial, 131);
    assert!(trial.on_instrument::<Reach>().unwrap().value().is_nan());
    assert!((10.8..=11.0).contains(&trial.value("largest_reach_mm")));
}

#[test]
fn an_exercise_that_does_not_name_it_does_not_have_it_and_a_new_run_has_a_new_one() {
    let mut trial = Trial::new(plugin);
    trial.start("reaching").unwrap();
    push(&mut trial, 31);
    assert!(trial.value("largest_reach_mm") > 2.9);
    trial.start("reaching").unwrap();
    assert_eq!(trial.value("largest_reach_mm"), 0.0);
    trial.steps(1);
    assert_eq!(trial.value("largest_reach_mm"), 0.0);

    trial.start("first_cuts").unwrap();
    trial.steps(1);
    assert!(trial.on_instrument::<Reach>().is_none());
    assert_eq!(trial.report().metrics.len(), MetricId::ALL.len());
}

#[test]
fn an_exercise_made_in_rust_is_that_of_a_file_that_leaves_the_rest_out() {
    let text = r#"(
        title: "Reaching",
        briefing: "Push.",
        case: "small",
        marked: (zones: [LateralLobe, MiddleLobe]),
        goals: [Extension("reached_out")],
        limits: (time_s: 20),
        scoring: [(metric: "largest_reach_mm", points: 60, from: 0, to: 20, basis: "test")],
    )"#;
    let mut made = Exercise::new("Reaching", "Push.", "small", 20.0);
    made.goals = vec![Goal::Extension(GoalId::of::<Reach>())];
    made.scoring = vec![ScoreRule::new(MetricId::of::<Reach>(), 60.0, 0.0, 20.0, "test")];
    let of_file = Exercise::from_ron_with(text, "reaching.exercise.ron".as_ref(), &extensions()).unwrap();
    assert_eq!(made, of_file);
}

#[test]
fn a_trial_sees_messages_and_events_once_each_and_plays_scripts() {
    #[derive(Event, Clone)]
    struct Ended(f64);

    fn tell(state: Res<RunState>, metrics: Res<Metrics>, mut commands: Commands) {
        if state.is_changed() && matches!(*state, RunState::Ended(_)) {
            commands.trigger(Ended(metrics.elapsed_s()));
        }
    }

    let mut trial = Trial::new((plugin, |app: &mut App| {
        app.add_systems(FixedPostUpdate, tell.in_set(ScenarioSystems::Last));
    }));
    trial.watch::<TissueContact>();
    trial.watch_events::<Ended>();
    let mut exercise = Reaching::exercise();
    exercise.models.collision = true;
    trial.start(exercise).unwrap();
    let slip = trial.follow_script("(keys: [(time_s: 0, stroke: 1)])").unwrap_err();
    assert!(slip.to_string().starts_with("script:1:"), "{slip}");
    trial
        .follow_script("(keys: [(time_s: 0, stroke_mm: 0), (time_s: 0.5, stroke_mm: 8, pitch_deg: -6)])")
        .unwrap();
    assert_eq!(trial.play(), EndReason::InputEnded);
    let ends: Vec<f64> = trial.seen::<Ended>().iter().map(|ended| ended.0).collect();
    assert_eq!(ends, [trial.value("elapsed_s")]);
    let depths = trial.seen::<TissueContact>().iter().map(|contact| contact.depth_mm);
    let deepest = depths.fold(0.0, f32::max);
    assert!(deepest > 0.0);
    assert_eq!(f64::from(deepest), trial.value("largest_contact_depth_mm"));
}
