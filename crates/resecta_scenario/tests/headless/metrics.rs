//! What the metrics count, and what they do not.

use std::path::Path;

use crate::bench::{Bench, CAPSULE_MM2, DENSITY, STEP_S, VOLUME, assert_near, resection};
use bevy::{
    ecs::schedule::{LogLevel, ScheduleBuildSettings},
    prelude::*,
};
use resecta_instrument::{InstrumentPlayback, InstrumentState};
use resecta_scenario::{
    ActiveExercise, CapsulePerforated, EndReason, Exercise, Limits, Medal, MetricId, Metrics, Pars, Part, RunState,
    ScenarioPlugin, ScoreCard, Trace,
};
use resecta_solver::NodeKind;
use resecta_tissue::ToolPartKind;

#[test]
fn time_is_steps_times_their_length() {
    let mut bench = Bench::new();
    bench.step(90);
    assert_near(bench.value(MetricId::Elapsed), 90.0 * STEP_S);
}

#[test]
fn a_briefing_counts_nothing_even_afterwards() {
    let mut bench = Bench::new();
    bench.app.insert_resource(RunState::Briefing);
    bench.state.cut = true;
    bench.resect(0..10);
    bench.contact(ToolPartKind::Loop, NodeKind::Capsule, 3.0);
    bench.step(1);
    bench.app.insert_resource(RunState::Running);
    bench.state.cut = false;
    bench.step(1);
    for &metric in MetricId::ALL.iter().filter(|&&metric| metric != MetricId::Elapsed) {
        assert_eq!(bench.value(metric), 0.0, "{metric}");
    }
    assert_near(bench.value(MetricId::Elapsed), STEP_S);
}

#[test]
fn zones_add_up_to_what_was_removed() {
    let mut bench = Bench::new();
    bench.resect(0..7);
    bench.step(1);
    bench.resect(55..70);
    bench.resect(80..81);
    bench.step(1);
    assert_near(bench.value(MetricId::Removed), 23.0 * VOLUME);
    assert_near(bench.value(MetricId::RemovedMass), 23.0 * VOLUME * DENSITY);
    assert_near(bench.value(MetricId::MiddleLobeRemoved), 12.0 * VOLUME);
    assert_near(bench.value(MetricId::PeripheralRemoved), 11.0 * VOLUME);
    assert_near(bench.value(MetricId::HealthyRemoved), 11.0 * VOLUME);
    assert_near(bench.value(MetricId::AdenomaRemovedShare), 12.0 / 60.0);
}

#[test]
fn only_marked_tissue_counts_as_marked_and_all_of_it_is_a_share_of_one() {
    let mut bench = Bench::new();
    bench.resect(30..50);
    bench.step(1);
    assert_near(bench.value(MetricId::MarkedRemoved), 10.0 * VOLUME);
    assert_near(bench.value(MetricId::MarkedRemovedShare), 0.25);
    assert_near(bench.value(MetricId::UnmarkedShare), 0.5);
    bench.resect(0..30);
    bench.step(1);
    assert_eq!(bench.value(MetricId::MarkedRemovedShare), 1.0);
}

#[test]
fn another_tissue_is_not_counted() {
    let mut bench = Bench::new();
    let other = bench.app.world_mut().spawn_empty().id();
    let message = resection(other, Some(bench.instrument), 0..10);
    bench.app.world_mut().write_message(message);
    bench.step(1);
    assert_eq!(bench.value(MetricId::Removed), 0.0);
}

#[test]
fn tissue_that_a_system_removed_is_removed_but_no_contact() {
    let mut bench = Bench::new();
    bench.state.coagulate = true;
    let message = resection(bench.tissue, None, 0..10);
    bench.app.world_mut().write_message(message);
    bench.step(1);
    assert_near(bench.value(MetricId::Removed), 10.0 * VOLUME);
    assert_near(bench.value(MetricId::CurrentWithoutContact), STEP_S);
}

#[test]
fn a_chattering_touch_is_one_and_a_later_touch_another() {
    let mut bench = Bench::new();
    bench.state.coagulate = true;
    for _ in 0..3 {
        bench.step_touching(2, ToolPartKind::Loop, NodeKind::Capsule);
        bench.step(10);
    }
    assert_eq!(bench.value(MetricId::CapsuleTouches), 1.0);
    assert_near(bench.value(MetricId::CapsuleTouchTime), 6.0 * STEP_S);
    bench.step(10);
    bench.step_touching(1, ToolPartKind::Loop, NodeKind::Capsule);
    assert_eq!(bench.value(MetricId::CapsuleTouches), 2.0);
}

#[test]
fn only_the_loop_with_current_on_the_capsule_is_a_touch() {
    let mut bench = Bench::new();
    bench.step_touching(5, ToolPartKind::Loop, NodeKind::Capsule);
    bench.state.cut = true;
    bench.step_touching(5, ToolPartKind::Sheath, NodeKind::Capsule);
    bench.step_touching(5, ToolPartKind::Loop, NodeKind::Inner);
    assert_eq!(bench.value(MetricId::CapsuleTouches), 0.0);
    assert_eq!(bench.value(MetricId::CapsuleTouchTime), 0.0);
}

#[test]
fn current_is_wasted_only_while_the_loop_is_out_of_tissue() {
    let mut bench = Bench::new();
    bench.step(10);
    bench.state.cut = true;
    bench.step(7);
    bench.step_touching(5, ToolPartKind::Loop, NodeKind::Mucosa);
    bench.resect(0..1);
    bench.step(1);
    bench.step_touching(3, ToolPartKind::Sheath, NodeKind::Mucosa);
    assert_near(bench.value(MetricId::CurrentWithoutContact), 10.0 * STEP_S);
}

#[test]
fn coagulation_is_the_blue_pedal_alone() {
    let mut bench = Bench::new();
    bench.state.coagulate = true;
    bench.step(6);
    bench.state.cut = true;
    bench.step(6);
    assert_near(bench.value(MetricId::Coagulation), 6.0 * STEP_S);
}

#[test]
fn a_cut_is_a_press_of_the_pedal_that_removed_tissue() {
    let mut bench = Bench::new();
    for (first, removes) in [(0, true), (10, false), (20, true)] {
        bench.state.cut = true;
        bench.step(2);
        for index in first..first + 4 {
            if removes {
                bench.resect(index..index + 1);
            }
            bench.step(1);
        }
        bench.state.cut = false;
        bench.step(1);
    }
    assert_eq!(bench.value(MetricId::Strokes), 2.0);
    assert_near(bench.value(MetricId::MassPerStroke), 4.0 * VOLUME * DENSITY);
}

#[test]
fn each_visit_below_the_verumontanum_with_current_on_is_an_injury() {
    let mut bench = Bench::new();
    let below = 95..96;
    bench.contact_at(ToolPartKind::Loop, below.start);
    bench.step(1);
    assert_eq!(bench.value(MetricId::SphincterInjuries), 0.0, "without current");
    bench.state.coagulate = true;
    bench.contact_at(ToolPartKind::Sheath, below.start);
    bench.contact_at(ToolPartKind::Loop, below.start - 1);
    bench.step(1);
    assert_eq!(
        bench.value(MetricId::SphincterInjuries),
        0.0,
        "the sheath, or the loop above"
    );
    for _ in 0..3 {
        bench.contact_at(ToolPartKind::Loop, below.start);
        bench.step(10);
    }
    assert_eq!(bench.value(MetricId::SphincterInjuries), 1.0, "chatter is one");
    bench.state = InstrumentState {
        cut: true,
        ..Default::default()
    };
    bench.step(10);
    bench.resect(below);
    bench.step(1);
    assert_eq!(bench.value(MetricId::SphincterInjuries), 2.0);
}

#[test]
fn rates_are_of_what_was_removed_and_0_of_nothing() {
    let mut bench = Bench::new();
    bench.step(60);
    for metric in [
        MetricId::RemovalRate,
        MetricId::IrrigatedPerGram,
        MetricId::CoagulationPrecision,
    ] {
        assert_eq!(bench.value(metric), 0.0, "{metric}");
    }
    bench.resect(0..8);
    bench.step(60);
    assert_near(
        bench.value(MetricId::RemovalRate),
        8.0 * VOLUME * DENSITY / (120.0 * STEP_S / 60.0),
    );
}

#[test]
fn subtotals_are_of_their_lines_and_the_total_earns_a_medal() {
    let text = r#"(
        title: "Parts",
        briefing: "Cut.",
        case: "none",
        marked: (zones: [MiddleLobe]),
        goals: [RemoveMarked(share: 1)],
        limits: (time_s: 20),
        total_pars: (bronze: 30, silver: 50, gold: 90, basis: "test"),
        scoring: [
            (part: Safety, metric: "capsule_touches", points: 20, from: 2, to: 0, basis: "test"),
            (part: Resection, metric: "marked_removed_share", points: 60, from: 0, to: 1, basis: "test"),
            (part: Safety, metric: "capsule_touch_s", points: 10, from: 1, to: 0, basis: "test"),
            (metric: "elapsed_s", points: 10, from: 20, to: 0, basis: "test"),
        ],
    )"#;
    let exercise = Exercise::from_ron(text, Path::new("parts.exercise.ron")).unwrap();
    let mut metrics = Metrics::default();
    metrics.removal.marked_total_mm3 = 4.0;
    metrics.removal.marked_mm3 = 1.0;
    metrics.capsule.touches = 1;
    let card = ScoreCard::new(&exercise, &metrics);
    let parts: Vec<_> = card
        .parts
        .iter()
        .map(|part| (part.part, part.points, part.out_of))
        .collect();
    assert_eq!(parts, [(Part::Resection, 15.0, 60.0), (Part::Safety, 20.0, 30.0)]);
    assert_eq!((card.total, card.medal), (45.0, Some(Medal::Bronze)));
}

#[test]
fn the_path_of_a_straight_push_and_back_is_twice_its_length() {
    let mut bench = Bench::new();
    for insertion_mm in (0..=20).chain((0..20).rev()) {
        bench.state.insertion_mm = insertion_mm as f32;
        bench.step(3);
    }
    assert!(
        (bench.value(MetricId::TipPath) - 40.0).abs() < 1e-4,
        "{}",
        bench.value(MetricId::TipPath)
    );
}

#[test]
fn turning_about_the_own_axis_and_moving_the_loop_is_no_path() {
    let mut bench = Bench::new();
    bench.state.insertion_mm = 30.0;
    for turn in 0..20 {
        bench.state.roll_deg = turn as f32;
        bench.state.stroke_mm = turn as f32;
        bench.step(1);
    }
    assert!(bench.value(MetricId::TipPath) < 1e-3);
}

#[test]
fn the_largest_depth_stays() {
    let mut bench = Bench::new();
    for depth in [0.5, 2.0, 1.0] {
        bench.contact(ToolPartKind::Sheath, NodeKind::Mucosa, depth);
        bench.step(1);
    }
    bench.step(1);
    assert_near(bench.value(MetricId::LargestContactDepth), 2.0);
}

#[test]
fn the_run_ends_when_the_goals_are_reached_and_nothing_counts_after() {
    let mut bench = Bench::new();
    bench.step(59);
    bench.resect(0..39);
    bench.step(1);
    assert_eq!(bench.run_state(), RunState::Running);
    bench.resect(39..40);
    bench.step(1);
    assert_eq!(bench.run_state(), RunState::Ended(EndReason::GoalsReached));
    let before = bench.app.world().resource::<ScoreCard>().clone();
    bench.resect(40..60);
    bench.step(30);
    let after = bench.app.world().resource::<ScoreCard>();
    assert_eq!(&before, after);
    assert!(after.goals_reached());
    assert_near(after.out_of, 100.0);
    assert_near(after.total, 60.0 + 40.0 * (1.0 - 61.0 * STEP_S / 20.0));
}

#[test]
fn the_run_ends_when_time_is_up() {
    let mut bench = Bench::new();
    bench.step(1199);
    assert_eq!(bench.run_state(), RunState::Running);
    bench.step(1);
    assert_eq!(bench.run_state(), RunState::Ended(EndReason::TimeUp));
}

#[test]
fn the_run_ends_without_a_medal_when_a_limit_of_harm_is_reached_and_says_which() {
    let limits = Limits::of_time(20.0);
    let capsule = Limits {
        capsule_cut_share: Some(0.1),
        ..limits
    };
    let sphincter = Limits {
        sphincter_injuries: Some(2),
        ..limits
    };
    let blood = Limits {
        blood_lost_ml: Some(30.0),
        ..limits
    };
    let absorbed = Limits {
        absorbed_ml: Some(200.0),
        ..limits
    };
    type Harm = fn(&mut Metrics, f64);
    let harms: [(Limits, Harm, EndReason); 4] = [
        (
            capsule,
            |m, harm| m.capsule.cut_mm2 = harm * 0.1 * CAPSULE_MM2,
            EndReason::Perforated,
        ),
        (
            sphincter,
            |m, harm| m.sphincter.injuries = (harm * 2.0) as u32,
            EndReason::SphincterInjured,
        ),
        (blood, |m, harm| m.water.blood_ml = harm * 30.0, EndReason::BloodLost),
        (
            absorbed,
            |m, harm| m.water.absorbed_ml = harm * 200.0,
            EndReason::Absorbed,
        ),
    ];
    for (limits, harm, reason) in harms {
        let mut bench = Bench::new();
        let exercise = &mut bench.app.world_mut().resource_mut::<ActiveExercise>().exercise;
        exercise.limits = limits;
        // Any total earns gold.
        exercise.total_pars = Some(Pars {
            bronze: -3.0,
            silver: -2.0,
            gold: -1.0,
            basis: "Test.".into(),
        });
        harm(&mut bench.app.world_mut().resource_mut::<Metrics>(), 0.9);
        bench.step(1);
        assert_eq!(bench.run_state(), RunState::Running, "{reason:?}");
        let card = bench.app.world().resource::<ScoreCard>();
        assert_eq!((card.medal, card.harm), (Some(Medal::Gold), None), "{reason:?}");
        harm(&mut bench.app.world_mut().resource_mut::<Metrics>(), 1.01);
        bench.step(1);
        assert_eq!(bench.run_state(), RunState::Ended(reason));
        let card = bench.app.world().resource::<ScoreCard>();
        assert_eq!((card.medal, card.harm), (None, Some(reason)));
    }
}

#[test]
fn the_run_ends_with_its_script() {
    let mut bench = Bench::new();
    bench
        .app
        .world_mut()
        .get_mut::<InstrumentPlayback>(bench.instrument)
        .unwrap()
        .over = true;
    bench.step(1);
    assert_eq!(bench.run_state(), RunState::Ended(EndReason::InputEnded));
}

#[test]
fn cutting_the_capsule_is_a_touch_an_area_and_an_event() {
    #[derive(Resource, Default)]
    struct Heard(Vec<(Entity, f64)>);

    let mut bench = Bench::new();
    bench
        .app
        .init_resource::<Heard>()
        .add_observer(|perforated: On<CapsulePerforated>, mut heard: ResMut<Heard>| {
            heard.0.push((perforated.tissue, perforated.area_mm2));
        });
    bench.state.cut = true;
    let mut message = resection(bench.tissue, Some(bench.instrument), 90..92);
    message.capsule_area_mm2 = 3.5;
    bench.app.world_mut().write_message(message);
    bench.step(1);
    bench.step(3);
    assert_near(bench.value(MetricId::CapsuleCut), 3.5);
    assert_near(bench.value(MetricId::CapsuleCutShare), 3.5 / CAPSULE_MM2);
    assert_eq!(bench.value(MetricId::CapsuleTouches), 1.0);
    assert_eq!(bench.app.world().resource::<Heard>().0, [(bench.tissue, 3.5)]);
}

#[test]
fn a_trace_has_a_row_a_step() {
    let mut bench = Bench::new();
    bench.app.init_resource::<Trace>();
    bench.step(4);
    bench.resect(0..4);
    bench.contact(ToolPartKind::Loop, NodeKind::Mucosa, 0.3);
    bench.step(1);
    let rows = &bench.app.world().resource::<Trace>().rows;
    assert_eq!(rows.iter().map(|row| row.step).collect::<Vec<_>>(), [1, 2, 3, 4, 5]);
    assert_eq!((rows[3].contacts, rows[4].contacts), (0, 1));
    assert_near(rows[4].removed_mm3, 4.0 * VOLUME);
}

#[test]
fn the_order_of_the_systems_is_unambiguous() {
    let mut app = App::new();
    app.add_plugins((MinimalPlugins, ScenarioPlugin::default()));
    app.edit_schedule(FixedPostUpdate, |schedule| {
        schedule.set_build_settings(ScheduleBuildSettings {
            ambiguity_detection: LogLevel::Error,
            ..default()
        });
    });
    app.finish();
    app.world_mut().run_schedule(FixedPostUpdate);
}
