//! How many steps a late frame makes up for.
//!
//! Where drawing is what takes long, a picture that comes ten times a second shows six steps, and the simulation keeps real time: it is
//! computed while the picture before is drawn. Where the steps themselves take long, more of them in a frame would only make frames
//! longer.

use std::time::{Duration, Instant};

use bevy::{
    app::{RunFixedMainLoop, RunFixedMainLoopSystems},
    prelude::*,
};
use resecta_scenario::CATCH_UP_S;

use super::pace::Pace;

/// Simulated time that a frame makes up for at most, s; at least it is [`CATCH_UP_S`], as in every app.
const MOST_CATCH_UP_S: f32 = 0.25;
/// Share of a frame that steps may fill.
const STEPS_SHARE: f32 = 2.0 / 3.0;
/// Weight of a frame's steps in the mean of what a step takes.
const STEP_WEIGHT: f32 = 0.1;

/// Lets late frames make up for as much as steps have time for in them.
pub fn plugin(app: &mut App) {
    app.init_resource::<StepTime>()
        .add_systems(
            RunFixedMainLoop,
            (
                begin_steps.in_set(RunFixedMainLoopSystems::BeforeFixedMainLoop),
                end_steps.in_set(RunFixedMainLoopSystems::AfterFixedMainLoop),
            ),
        )
        .add_systems(Last, catch_up);
}

/// What a step takes, all that runs in it.
#[derive(Resource, Debug, Default)]
struct StepTime {
    /// When the steps of this frame began, and the simulated time then.
    began: Option<(Instant, Duration)>,
    /// Running mean, s; 0 before the first.
    step_s: f32,
}

fn begin_steps(fixed: Res<Time<Fixed>>, mut steps: ResMut<StepTime>) {
    steps.began = Some((Instant::now(), fixed.elapsed()));
}

fn end_steps(fixed: Res<Time<Fixed>>, mut steps: ResMut<StepTime>) {
    let Some((began, elapsed)) = steps.began.take() else {
        return;
    };
    let made = (fixed.elapsed() - elapsed).div_duration_f32(fixed.timestep());
    if made >= 0.5 {
        let step_s = began.elapsed().as_secs_f32() / made;
        let weight = if steps.step_s == 0.0 { 1.0 } else { STEP_WEIGHT };
        steps.step_s += (step_s - steps.step_s) * weight;
    }
}

fn catch_up(pace: Res<Pace>, steps: Res<StepTime>, fixed: Res<Time<Fixed>>, mut simulated: ResMut<Time<Virtual>>) {
    let most_s = most_s(pace.frame_s, steps.step_s, fixed.timestep().as_secs_f32());
    // What is shown at half its speed makes as much simulated time of twice the real time.
    let real_s = most_s / simulated.relative_speed();
    simulated.set_max_delta(Duration::try_from_secs_f32(real_s).unwrap_or(Duration::MAX));
}

/// The simulated time that a frame may make up for, s, where frames take `frame_s` and a step of `timestep_s` takes `step_s`.
fn most_s(frame_s: f32, step_s: f32, timestep_s: f32) -> f32 {
    let steps = (STEPS_SHARE * frame_s / step_s).ceil();
    // Before the first step nothing is known of what one takes.
    match steps.is_finite() {
        true => (steps * timestep_s).clamp(CATCH_UP_S, MOST_CATCH_UP_S),
        false => CATCH_UP_S,
    }
}

#[cfg(test)]
mod tests {
    use bevy::time::TimeUpdateStrategy;

    use super::*;

    /// Steps a frame once it has settled, where drawing takes so long, beside the steps or after them.
    fn steps_a_frame(draw_s: f32, step_s: f32, beside: bool) -> f32 {
        let mut frame_s = draw_s;
        for _ in 0..100 {
            let steps_s = 60.0 * most_s(frame_s, step_s, 1.0 / 60.0) * step_s;
            frame_s = if beside { draw_s.max(steps_s) } else { draw_s + steps_s };
        }
        60.0 * most_s(frame_s, step_s, 1.0 / 60.0)
    }

    #[test]
    fn late_drawing_costs_no_simulated_time_and_late_steps_make_no_frame_longer() {
        // Drawn ten times a second, with steps that keep up: real time.
        assert!((steps_a_frame(0.1, 0.01, true) - 6.0).abs() < 1.01);
        assert!(steps_a_frame(0.1, 0.01, true) >= 6.0);
        // Steps slower than real time: as few a frame as ever.
        for draw_s in [0.001, 0.05] {
            assert!((steps_a_frame(draw_s, 0.04, true) - 3.0).abs() < 1e-3, "{draw_s}");
        }
        // Where nothing goes on beside anything else, drawing keeps a quarter of the time.
        let steps_s = 0.02 * steps_a_frame(0.05, 0.02, false);
        assert!(0.05 / (0.05 + steps_s) > 0.25, "{steps_s}");
        // No frame makes up for more than a quarter of a second.
        assert!(steps_a_frame(1.0, 0.001, false) <= 15.01);
        assert_eq!(most_s(0.1, 0.0, 1.0 / 60.0), CATCH_UP_S);
    }

    #[test]
    fn what_is_shown_slower_is_computed_no_slower() {
        let simulated_s = |speed: f32| {
            let mut app = App::new();
            app.add_plugins((bevy::time::TimePlugin, plugin))
                .init_resource::<Pace>()
                .insert_resource(TimeUpdateStrategy::ManualDuration(Duration::from_millis(200)));
            app.world_mut()
                .resource_mut::<Time<Virtual>>()
                .set_relative_speed(speed);
            (0..10).for_each(|_| app.update());
            app.world().resource::<Time<Virtual>>().delta_secs()
        };
        // A frame takes 0.2 s, of which steps fill no more than they may.
        assert!((simulated_s(1.0) - CATCH_UP_S).abs() < 1e-3, "{}", simulated_s(1.0));
        assert!((simulated_s(0.5) - CATCH_UP_S).abs() < 1e-3, "{}", simulated_s(0.5));
        // What keeps up is shown at its speed.
        assert!((simulated_s(0.1) - 0.02).abs() < 1e-3, "{}", simulated_s(0.1));
    }
}
