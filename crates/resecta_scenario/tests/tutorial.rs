//! The shipped tutorial, played by its shipped script on the whole stack.

use std::fs;

use resecta_scenario::{EndReason, MetricId, Metrics, RunLog, StepProgress, Trace, assets, testing::Trial};

#[test]
fn whoever_has_lost_the_marked_tissue_is_told_the_way_back() {
    let mut trial = Trial::new(());
    trial.start("tutorial").unwrap();
    // Up the urethra, the tip up, rolled, far into the bladder, and rolled back.
    trial.steps_by(420, |step, hands| {
        let after = |begin_s: f32| (step as f32 / 60.0 - begin_s).clamp(0.0, 1.0);
        hands.insertion_mm = 4.0 + 16.5 * after(0.0) + 69.5 * after(3.0);
        hands.pitch_deg = -25.0 + 5.5 * after(1.0) + 13.5 * after(3.0);
        hands.roll_deg = 35.0 * (after(2.0) - after(5.0));
    });
    let progress = trial.app.world().resource::<StepProgress>();
    assert_eq!((progress.done_at_s.len(), progress.share), (4, 0.0));
    let way = progress.away.expect("the dyed lobe is behind");
    assert!(way.z > 15.0 && way.z > way.x.abs() && way.z > way.y.abs(), "{way}");

    // Back over it, and along it.
    trial.steps_by(120, |step, hands| {
        hands.insertion_mm = 90.0 - 66.0 * (step + 1) as f32 / 120.0
    });
    let progress = trial.app.world().resource::<StepProgress>();
    assert!(progress.away.is_none() && progress.done_at_s.len() == 4, "{progress:?}");
    trial.steps_by(60, |step, hands| {
        hands.insertion_mm = 24.0 + 15.0 * (step + 1) as f32 / 60.0
    });
    assert_eq!(trial.app.world().resource::<StepProgress>().done_at_s.len(), 5);
}

#[test]
fn whoever_runs_the_lens_into_tissue_has_done_nothing_until_they_see_again() {
    let mut trial = Trial::new(());
    trial.start("tutorial").unwrap();
    // Straight on, into the floor.
    trial.steps_by(90, |step, hands| {
        hands.insertion_mm = 4.0 + 30.0 * (step + 1) as f32 / 90.0
    });
    let trial_progress = |trial: &Trial| trial.app.world().resource::<StepProgress>().clone();
    let progress = trial_progress(&trial);
    assert!(progress.is_blind && progress.done_at_s.len() <= 1, "{progress:?}");
    let done = progress.done_at_s.len();
    // The tip is raised to where it still sees nothing but the floor, then to where the urethra leads.
    trial.steps_by(30, |_, hands| hands.pitch_deg = -20.0);
    assert_eq!(trial_progress(&trial).done_at_s.len(), done);
    trial.steps_by(60, |step, hands| {
        hands.pitch_deg = -20.0 + 11.0 * (step + 1) as f32 / 60.0
    });
    let progress = trial_progress(&trial);
    assert!(!progress.is_blind && progress.done_at_s.len() > done, "{progress:?}");
}

#[test]
fn whoever_does_what_the_tutorial_says_finishes_it() {
    let mut trial = Trial::new(());
    trial.app.init_resource::<Trace>().init_resource::<RunLog>();
    trial.start("tutorial").unwrap();
    let script = assets::find().unwrap().join("scripts/tutorial.ron");
    trial.follow_script(&fs::read_to_string(script).unwrap()).unwrap();
    assert_eq!(trial.play(), EndReason::GoalsReached);

    let world = trial.app.world();
    let metrics = world.resource::<Metrics>();
    let steps = trial.active().exercise.steps.len();
    assert_eq!(metrics.value(MetricId::StepsDone), steps as f64);
    let report = trial.report();
    let times: Vec<f64> = report.steps.iter().map(|step| step.done_at_s.unwrap()).collect();
    assert!(times.len() == steps && times.is_sorted_by(|a, b| a < b), "{times:?}");
    let rows = &world.resource::<Trace>().rows;
    assert_eq!(rows.last().unwrap().steps_done as usize, steps);
    // A row before a step is done has one step less than the row in which it is.
    assert!(rows.windows(2).all(|pair| pair[1].steps_done - pair[0].steps_done <= 1));
    let log = &world.resource::<RunLog>().samples;
    assert_eq!(log.last().unwrap().time_s, metrics.elapsed_s());
    assert!((log.last().unwrap().removed_ml - metrics.removal.volume_mm3 / 1000.0).abs() < 1e-12);
    assert!(log.is_sorted_by(|a, b| a.removed_ml <= b.removed_ml && a.blood_ml <= b.blood_ml));
}
