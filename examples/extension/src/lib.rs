//! Holding still: a metric, a goal and an exercise that uses both.

use bevy::prelude::*;
use resecta::prelude::*;
use resecta::scenario::{Goal, GoalId, ScoreRule};

/// How long the tip was held still at a stretch, s.
#[derive(Component, Default)]
pub struct Stillness {
    now_s: f64,
    longest_s: f64,
    tip: Vec3,
}

impl MetricExtension for Stillness {
    const INFO: MetricInfo = MetricInfo {
        id: "longest_stillness_s",
        title: "Longest stillness",
        unit: "s",
        better: Better::More,
        doc: "The longest time for which the tip moved by less than 0.01 mm a step.",
    };
    const ADVICE: Option<&'static str> = Some("Rest your hand before you press a pedal.");

    fn value(&self) -> f64 {
        self.longest_s
    }
}

impl GoalExtension for Stillness {
    const NAME: &'static str = "held_still";
    const WORDS: &'static str = "Hold the tip still for 2 s";

    fn share(&self) -> f64 {
        self.longest_s / 2.0
    }
}

/// Finds nothing, and costs nothing, where the exercise names neither.
fn follow(time: Res<Time>, mut tips: Query<(&mut Stillness, &Resectoscope, &InstrumentState)>) {
    for (mut still, resectoscope, state) in &mut tips {
        let tip = resectoscope.tip(state);
        let moved_mm = still.tip.distance(tip);
        still.tip = tip;
        still.now_s = if moved_mm < 0.01 {
            still.now_s + time.delta_secs_f64()
        } else {
            0.0
        };
        still.longest_s = still.longest_s.max(still.now_s);
    }
}

/// "Hold still": on a shipped gland, with nothing to cut.
pub struct HoldStill;

impl ExerciseExtension for HoldStill {
    const NAME: &'static str = "hold_still";

    fn exercise() -> Exercise {
        let mut exercise = Exercise::new("Hold still", "Hold the tip where it is.", "small", 10.0);
        exercise.alpha_deg = 15.0;
        exercise.goals = vec![Goal::Extension(GoalId::of::<Stillness>())];
        exercise.scoring = vec![ScoreRule::new(
            MetricId::of::<Stillness>(),
            100.0,
            0.0,
            2.0,
            "Our choice.",
        )];
        exercise
    }
}

/// Add it to any app with Resecta's plugins, or hand it to `resecta::game::run_with`.
pub struct SteadyHandPlugin;

impl Plugin for SteadyHandPlugin {
    fn build(&self, app: &mut App) {
        app.add_metric::<Stillness>()
            .add_goal::<Stillness>()
            .add_exercise::<HoldStill>()
            .add_systems(FixedPostUpdate, follow.in_set(ScenarioSystems::Extend));
    }
}
