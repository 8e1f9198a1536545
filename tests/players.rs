//! Two scripted players on a whole operation: the score tells them apart in every part.

use std::fs;

use resecta::{
    assets,
    instrument::InstrumentState,
    players::{self, Player, PlayersPlugin},
    scenario::{
        ClockRange, Condition, Library, Limits, LoadedExercise, LoopClearance, MetricId, Part, Report, RunState,
    },
    testing::Trial,
    tissue::CutDetail,
};

/// The shipped operation on a small gland of whole elements, for a limited time; lines count from a smaller share on, and no harm
/// ends it: the careless would be stopped before most is told apart.
fn shortened(time_s: f64, at_least: f64) -> LoadedExercise {
    let assets = assets::find().unwrap();
    let file = assets.join("exercises/full_operation.exercise.ron");
    let text = fs::read_to_string(&file)
        .unwrap()
        .replace("case: \"medium\"", "case: \"small\"");
    let mut loaded = Library::new(assets).load_text(&text, &file).unwrap();
    let exercise = &mut loaded.exercise;
    exercise.alpha_deg = 15.0;
    exercise.models.detail = CutDetail::Elements;
    exercise.limits = Limits::of_time(time_s);
    for rule in &mut exercise.scoring {
        rule.needs = rule.needs.map(|needs| Condition { at_least, ..needs });
    }
    loaded
}

fn play(loaded: LoadedExercise, player: Player) -> Report {
    let mut trial = Trial::new(PlayersPlugin);
    trial.start(loaded).unwrap();
    players::seat(trial.app.world_mut(), player);
    trial.play();
    trial.report()
}

fn value(report: &Report, id: MetricId) -> f64 {
    let metric = report.metrics.iter().find(|metric| metric.id == id);
    metric.expect("every metric is reported").value
}

#[test]
fn both_cut_and_only_the_careless_go_below_the_verumontanum_and_waste_current() {
    let [careful, careless] = [Player::Careful, Player::Careless].map(|player| play(shortened(20.0, 0.3), player));
    for report in [&careful, &careless] {
        assert!(value(report, MetricId::RemovedMass) > 0.3, "{report:?}");
    }
    let of = |id| (value(&careful, id), value(&careless, id));
    let (ours, theirs) = of(MetricId::SphincterInjuries);
    assert!(ours == 0.0 && theirs > 0.0, "careful {ours}, careless {theirs}");
    let (ours, theirs) = of(MetricId::CurrentWithoutContact);
    assert!(ours < theirs, "careful {ours}, careless {theirs}");
}

#[test]
fn the_careful_cut_only_while_the_loop_is_off_the_capsule() {
    let mut loaded = shortened(60.0, 0.3);
    // Low at the side the adenoma lies next to the capsule.
    loaded.exercise.marked.clock = Some(ClockRange { from: 3.0, to: 5.0 });
    let off_mm = Player::Careful.manner().lets_go_at_capsule_mm.unwrap();
    let mut trial = Trial::new(PlayersPlugin);
    trial.start(loaded).unwrap();
    players::seat(trial.app.world_mut(), Player::Careful);
    let (mut before_mm, mut at_capsule, mut cutting) = (f32::INFINITY, 0, 0);
    while trial.state() == RunState::Running {
        trial.steps(1);
        let state = trial.on_instrument::<InstrumentState>().unwrap();
        if state.cut {
            cutting += 1;
            assert!(before_mm > off_mm, "cuts {before_mm} mm from the capsule");
        }
        let clearance = trial.on_instrument::<LoopClearance>().unwrap();
        before_mm = clearance.capsule_mm.expect("a gland has a capsule");
        at_capsule += u32::from(before_mm <= off_mm);
    }
    assert!(
        at_capsule > 0 && cutting > 100,
        "{at_capsule} steps there, {cutting} of cutting"
    );
}

#[test]
fn the_score_tells_the_careful_from_the_careless_in_every_part() {
    let [careful, careless] = [Player::Careful, Player::Careless].map(|player| play(shortened(600.0, 0.3), player));
    for part in Part::ALL {
        let points = |report: &Report| {
            let of_part = report.score.parts.iter().find(|score| score.part == part);
            of_part.expect("every part has lines").points
        };
        let (more, less) = (points(&careful), points(&careless));
        assert!(more > less, "{}: careful {more}, careless {less}", part.name());
    }
    for less_is_expert in [
        MetricId::SphincterInjuries,
        MetricId::CapsuleCutShare,
        MetricId::CurrentWithoutContact,
        MetricId::BlindTime,
        MetricId::BloodInAll,
    ] {
        let (ours, theirs) = (value(&careful, less_is_expert), value(&careless, less_is_expert));
        assert!(ours < theirs, "{less_is_expert}: careful {ours}, careless {theirs}");
    }
    for more_is_expert in [MetricId::AdenomaRemovedShare, MetricId::CoagulationPrecision] {
        let (ours, theirs) = (value(&careful, more_is_expert), value(&careless, more_is_expert));
        assert!(ours > theirs, "{more_is_expert}: careful {ours}, careless {theirs}");
    }
}
