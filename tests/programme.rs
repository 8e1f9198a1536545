//! The shipped programme: who shows an exercise earns at least silver, nobody at the instrument earns no medal,
//! and limits end the run of somebody reckless.

mod common;

use common::{LONG, SHORT};
use resecta::{
    fluid::{VesselKind, Vessels},
    players::{self, Player, PlayersPlugin},
    scenario::{EndReason, Medal, Report},
    testing::Trial,
};

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

fn earns_silver(exercise: &&str) {
    let report = shown(exercise);
    assert!(
        report.score.medal >= Some(Medal::Silver),
        "{exercise}: {:?} for {} points",
        report.score.medal,
        report.score.total
    );
}

#[test]
fn whoever_shows_a_short_exercise_earns_at_least_silver() {
    SHORT.iter().for_each(earns_silver);
}

#[test]
#[ignore = "many minutes"]
fn whoever_shows_a_long_exercise_earns_at_least_silver() {
    LONG.iter().for_each(earns_silver);
}

#[test]
fn every_exercise_that_ships_is_shown_and_the_tutorial_to_its_end() {
    for exercise in Trial::new(()).library().unwrap().exercise_names() {
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
    for exercise in SHORT.into_iter().chain(LONG) {
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
fn limits_end_the_run_of_somebody_reckless() {
    for exercise in ["left_lobe", "right_lobe", "apex", "imported_gland"] {
        let mut trial = started(exercise);
        players::seat(trial.app.world_mut(), Player::Careless);
        let ended = trial.play();
        assert!(
            matches!(ended, EndReason::Perforated | EndReason::SphincterInjured),
            "{exercise}: {ended:?}"
        );
        assert!(trial.report().score.medal < Some(Medal::Gold), "{exercise}");
    }
}
