//! The shipped programme: who shows an exercise earns at least silver, and the record of that plays again to the same bits with
//! another number of threads; nobody at the instrument earns no medal, and limits end the run of somebody reckless.

mod common;

use std::fs;

use common::succeed;
use resecta::{
    fluid::{VesselKind, Vessels},
    players::{self, Player, PlayersPlugin},
    scenario::{EndReason, Medal, Report},
    testing::Trial,
};
use serde_json::Value;

/// A list of exercises, and a test for each, so that they are played side by side: always (`cfg(all())`), or only when asked for.
macro_rules! played {
    ($list:ident, $module:ident, $when:meta: $($exercise:ident)*) => {
        const $list: &[&str] = &[$(stringify!($exercise)),*];
        mod $module {
            $(
                #[test]
                #[$when]
                fn $exercise() {
                    super::earns_silver_and_plays_again(stringify!($exercise));
                }
            )*
        }
    };
}

played!(SHORT, whoever_shows_a_short_exercise_earns_silver_and_its_record_plays_again, cfg(all()):
    orientation irrigation loop_control first_cuts middle_lobe left_lobe right_lobe apex haemostasis imported_gland
    five_minutes);
played!(LONG, whoever_shows_a_long_exercise_earns_silver_and_its_record_plays_again, ignore = "many minutes each":
    operation_small full_operation operation_large);

/// Plays an exercise as whoever shows it, on one thread, and its record on two.
fn earns_silver_and_plays_again(exercise: &str) {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let play = format!("run {exercise} --player reference --out out --threads 1");
    succeed(folder, play.split(' '));
    let report: Value = serde_json::from_slice(&fs::read(folder.join("out/report.json")).unwrap()).unwrap();
    let (medal, points) = (&report["score"]["medal"], &report["score"]["total"]);
    let earned: Option<Medal> = serde_json::from_value(medal.clone()).unwrap();
    assert!(earned >= Some(Medal::Silver), "{exercise}: {medal} for {points} points");
    let told = succeed(folder, "replay out/run.resecta-run --check --threads 2".split(' '));
    assert!(
        told.contains("every hash and all results as recorded"),
        "{exercise}: {told}"
    );
}

fn started(exercise: &str) -> Trial {
    let mut trial = Trial::new(PlayersPlugin);
    trial.start(exercise).unwrap();
    trial
}

fn shown(exercise: &str) -> Report {
    let mut trial = started(exercise);
    assert!(players::show(trial.app.world_mut()), "nobody shows {exercise}");
    trial.play();
    trial.report()
}

#[test]
fn every_exercise_that_ships_is_shown_and_the_tutorial_to_its_end() {
    let played = [SHORT, LONG, &["tutorial"]].concat();
    for exercise in Trial::new(()).library().unwrap().exercise_names() {
        assert!(played.contains(&exercise.as_str()), "no test plays {exercise}");
        let mut trial = started(&exercise);
        assert!(players::show(trial.app.world_mut()), "nobody shows {exercise}");
    }
    let report = shown("tutorial");
    assert!(
        report.score.goals.iter().all(|goal| goal.reached),
        "{:?}",
        report.score.goals
    );
}

#[test]
fn nobody_at_the_instrument_earns_nothing() {
    for exercise in SHORT.iter().chain(LONG) {
        let mut trial = started(exercise);
        // No limit of time is nearer than a minute: what is not earned in five seconds of doing nothing is not earned in more.
        trial.steps(300);
        let report = trial.report();
        assert_eq!((report.score.total, report.score.medal), (0.0, None), "{exercise}");
    }
}

#[test]
fn arteries_and_veins_bleed_where_haemostasis_is_practised() {
    let mut trial = started("haemostasis");
    trial.steps(60);
    let world = trial.app.world_mut();
    let mut vessels = world.query::<&Vessels>();
    let open = vessels.iter(world).flat_map(Vessels::open).map(|open| open.vessel.kind);
    let (arteries, veins): (Vec<_>, Vec<_>) = open.partition(|kind| *kind == VesselKind::Arterial);
    assert!(
        arteries.len() >= 3 && veins.len() >= 3,
        "{} and {}",
        arteries.len(),
        veins.len()
    );
}

#[test]
fn limits_end_the_run_of_somebody_reckless_and_no_medal_is_earned() {
    for exercise in SHORT.iter().chain(LONG) {
        let mut trial = started(exercise);
        players::seat(trial.app.world_mut(), Player::Careless);
        let ended = trial.play();
        let report = trial.report();
        let (elapsed_s, score) = (report.run.elapsed_s, &report.score);
        println!(
            "{exercise}: {ended:?} after {elapsed_s:.1} s, {:.1} points, {:?}",
            score.total, score.medal
        );
        assert!(
            matches!(ended, EndReason::Perforated | EndReason::SphincterInjured),
            "{exercise}: {ended:?}"
        );
        assert_eq!(score.medal, None, "{exercise}: {score:?}");
    }
}
