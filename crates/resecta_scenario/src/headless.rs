//! The simulation without a window and without a clock: one step an update, as fast as the machine can.
//!
//! What is simulated does not depend on the number of threads or on the speed of the machine: systems that touch the same
//! data are ordered, and no wall time enters.

use std::num::NonZeroUsize;

use bevy::{app::TaskPoolPlugin, ecs::schedule::SingleThreadedExecutor, prelude::*, time::TimeUpdateStrategy};
use resecta_instrument::InstrumentSource;

use crate::{
    active::{ActiveExercise, spawn_exercise},
    metrics::Metrics,
    plugins::ResectaPlugins,
    prepare::PreparedExercise,
    state::{EndReason, RunState},
};

/// An app with [`ResectaPlugins`] and no window, whose every update but the first is exactly one fixed step. The first
/// only sets the clocks.
///
/// `threads` is the number of threads for Bevy's pools, by default as many as the machine has; the first app of a process
/// decides for all. Systems run one after the other on the app's own thread: the pools serve drawing and what a system spreads over them.
pub fn app(threads: Option<NonZeroUsize>) -> App {
    let mut app = App::new();
    app.add_plugins((
        MinimalPlugins.set(TaskPoolPlugin {
            task_pool_options: threads.map_or_else(default, |threads| TaskPoolOptions::with_num_threads(threads.get())),
        }),
        ResectaPlugins,
    ));
    app.insert_resource(one_step_an_update());
    // The systems of a step are one chain. Handing them to a pool costs half a millisecond a step, however many threads it has.
    for (_, schedule) in app.world_mut().resource_mut::<Schedules>().iter_mut() {
        schedule.set_executor(SingleThreadedExecutor::new());
    }
    app
}

/// The clock of a run without a window, for apps built another way.
pub fn one_step_an_update() -> TimeUpdateStrategy {
    TimeUpdateStrategy::FixedTimesteps(1)
}

/// Puts the exercise into the app, gives the instrument its input and starts the run.
pub fn start(app: &mut App, prepared: PreparedExercise, input: InstrumentSource) -> ActiveExercise {
    let active = spawn_exercise(app.world_mut(), prepared);
    app.world_mut().entity_mut(active.instrument).insert(input);
    app.insert_resource(RunState::Running);
    active
}

/// Updates the app until the run ends, and calls `after_update` after every update.
///
/// Ends at the latest when the exercise's time is up. Without a run that was [`start`]ed it returns
/// [`EndReason::Player`] at once: nobody plays.
pub fn play(app: &mut App, mut after_update: impl FnMut(&World)) -> EndReason {
    finish_plugins(app);
    loop {
        match app.world().get_resource() {
            Some(RunState::Running) => {}
            Some(RunState::Ended(reason)) => return *reason,
            Some(RunState::Briefing) | None => return EndReason::Player,
        }
        app.update();
        after_update(app.world());
    }
}

/// Steps of the run so far.
pub fn steps(world: &World) -> u64 {
    world.get_resource::<Metrics>().map_or(0, |metrics| metrics.steps)
}

/// What `App::run` does before the first update, for an app that is driven by hand.
pub fn finish_plugins(app: &mut App) {
    use bevy::app::PluginsState;
    if app.plugins_state() == PluginsState::Cleaned {
        return;
    }
    while app.plugins_state() == PluginsState::Adding {
        bevy::tasks::tick_global_task_pools_on_main_thread();
    }
    app.finish();
    app.cleanup();
}
