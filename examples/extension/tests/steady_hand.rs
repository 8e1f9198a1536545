use bevy::prelude::*;
use resecta::{prelude::*, testing::Trial};
use steady_hand::{SteadyHandPlugin, Stillness};

#[test]
fn a_hand_that_rests_for_two_seconds_has_reached_the_goal() -> Result {
    let mut trial = Trial::new(SteadyHandPlugin);
    trial.start("hold_still")?;
    trial.steps_by(60, |_, instrument| instrument.pitch_deg += 0.1);
    assert!(trial.value("longest_stillness_s") < 0.1);
    assert_eq!(trial.play(), EndReason::GoalsReached);
    assert!(trial.value("longest_stillness_s") >= 2.0);
    assert_eq!(trial.report().score.total, 100.0);
    Ok(())
}

#[test]
fn an_exercise_that_does_not_name_it_does_not_have_it() -> Result {
    let mut trial = Trial::new(SteadyHandPlugin);
    trial.start("first_cuts")?;
    trial.steps(1);
    assert!(trial.on_instrument::<Stillness>().is_none());
    Ok(())
}

#[test]
fn the_same_script_gives_the_same_bits() -> Result {
    let play = || -> Result<String> {
        let mut trial = Trial::new(SteadyHandPlugin);
        trial.start("hold_still")?;
        trial.follow_script("(keys: [(time_s: 0, stroke_mm: 0), (time_s: 1, stroke_mm: 12, pitch_deg: -5)])")?;
        trial.play();
        Ok(trial.report().to_json())
    };
    assert_eq!(play()?, play()?);
    Ok(())
}
