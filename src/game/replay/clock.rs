//! How many steps a frame makes: by real time and the chosen speed, or as many as can be on the way to a place.

use std::time::Instant;

use bevy::{
    prelude::*,
    tasks::{AsyncComputeTaskPool, Task, block_on, poll_once},
    time::{TimeSystems, TimeUpdateStrategy},
};
use resecta_records::{RecordError, Replay, RunRecord};
use resecta_scenario::{Extensions, PreparedExercise, STEP_HZ};
use resecta_tissue::TissueDiagnostics;

use super::Shown;

/// Speeds to choose from, of real time.
pub const SPEEDS: [f64; 6] = [0.1, 0.25, 0.5, 1.0, 2.0, 4.0];
/// The one at first.
const REAL_TIME: usize = 3;
/// Real time that the steps of a frame may take in play, s: a machine that cannot keep up shows fewer steps a second, not fewer
/// frames.
const PLAY_S: f64 = 0.08;
/// The same on the way to a place nearby.
const SEEK_S: f64 = 0.25;
/// The same where it is far: nothing is shown on the way but how far it is.
const FAR_S: f64 = 1.0;
/// A way of so many steps is long enough to leave the views out.
const FAR: u64 = 60;

pub fn plugin(app: &mut App) {
    app.add_systems(First, (take_back, decide).chain().before(TimeSystems));
}

/// Where the replay is and how it goes on.
#[derive(Resource, Debug)]
pub struct ReplayClock {
    /// Whether time goes.
    pub is_playing: bool,
    /// Index of [`SPEEDS`].
    pub speed: usize,
    /// Steps of the record before the first that is shown: those of the briefing, but at least one, for only a step puts the
    /// instrument in its place.
    begins_after: u64,
    /// Steps of the whole record.
    steps: u64,
    /// Where it is, in steps of the record.
    at: u64,
    /// Where it is to go.
    seeks: Option<u64>,
    /// Steps that are due and not made yet.
    due: f64,
    last: Option<Instant>,
}

/// The gland as it was at first, being built again to go back.
#[derive(Resource)]
struct GoingBack(Task<Result<PreparedExercise, RecordError>>);

impl ReplayClock {
    /// At the begin of the run: the briefing before it is skipped.
    pub fn of(record: &RunRecord) -> Self {
        let begins_after = record.begins_after.max(1);
        Self {
            is_playing: true,
            speed: REAL_TIME,
            begins_after,
            steps: record.states.len() as u64,
            at: 0,
            seeks: Some(begins_after),
            due: 0.0,
            last: None,
        }
    }

    /// Steps of the run so far.
    pub fn played(&self) -> u64 {
        self.at.saturating_sub(self.begins_after)
    }

    /// Steps of the whole run.
    pub fn length(&self) -> u64 {
        self.steps - self.begins_after
    }

    /// Where it is going, in steps of the run.
    pub fn seeks(&self) -> Option<u64> {
        self.seeks.map(|step| step.saturating_sub(self.begins_after))
    }

    /// Whether it has a long way to go, back or on.
    pub fn is_far(&self) -> bool {
        self.seeks.is_some_and(|to| to < self.at || to > self.at + FAR)
    }

    /// Whether it is going back.
    pub fn goes_back(&self) -> bool {
        self.seeks.is_some_and(|to| to < self.at)
    }

    /// Goes to a step of the run.
    pub fn seek(&mut self, step: u64) {
        self.seeks = Some(
            step.saturating_add(self.begins_after)
                .clamp(self.begins_after, self.steps),
        );
    }

    /// Goes on from here by seconds of the run, back where they are negative.
    pub fn skip(&mut self, seconds: f64) {
        let from = self.seeks().unwrap_or(self.played()) as f64;
        self.seek((from + seconds * STEP_HZ).max(0.0) as u64);
    }

    /// Stays where it has come on its way to somewhere else; on the way back that is the start of the run, from which it goes on.
    pub fn stay(&mut self) {
        self.is_playing = false;
        self.seeks = self.goes_back().then_some(self.begins_after);
    }

    /// Begins or stops; at the end it begins anew.
    pub fn toggle(&mut self) {
        self.is_playing = !self.is_playing;
        if self.is_playing && self.at >= self.steps && self.seeks.is_none() {
            self.seek(0);
        }
    }

    /// How many steps a frame makes that comes `elapsed_s` after the last one, where a step takes `cost_s`.
    fn steps_now(&mut self, elapsed_s: f64, cost_s: f64) -> u32 {
        let most = |budget_s: f64| (budget_s / cost_s).clamp(1.0, 1000.0);
        let left = self.steps - self.at;
        if let Some(to) = self.seeks {
            self.due = 0.0;
            let budget_s = if self.is_far() { FAR_S } else { SEEK_S };
            let steps = (to.saturating_sub(self.at) as f64).min(most(budget_s)) as u64;
            if self.at + steps >= to {
                self.seeks = None;
            }
            return steps.min(left) as u32;
        }
        if !self.is_playing || left == 0 {
            self.due = 0.0;
            self.is_playing &= left > 0;
            return 0;
        }
        // What a frame could not make is not made up for.
        self.due = (self.due + elapsed_s * STEP_HZ * SPEEDS[self.speed]).min(most(PLAY_S).floor());
        let steps = (self.due as u64).min(left);
        self.due -= steps as f64;
        steps as u32
    }
}

fn decide(
    diagnostics: Res<TissueDiagnostics>,
    shown: Res<Shown>,
    going_back: Option<Res<GoingBack>>,
    mut clock: ResMut<ReplayClock>,
    mut strategy: ResMut<TimeUpdateStrategy>,
    mut is_first: Local<Option<()>>,
    mut commands: Commands,
) {
    let now = Instant::now();
    let elapsed_s = clock.last.replace(now).map_or(0.0, |last| (now - last).as_secs_f64());
    let mut steps = 0;
    if going_back.is_some() {
        // Nothing moves until it is there.
    } else if clock.seeks.is_some_and(|to| to < clock.at) {
        let (record, file) = (shown.record.clone(), shown.file.clone());
        let build = async move { Replay::prepare(&record, &file, &Extensions::default()) };
        commands.insert_resource(GoingBack(AsyncComputeTaskPool::get().spawn(build)));
    } else if is_first.replace(()).is_some() {
        let cost_s = diagnostics.step().as_secs_f64().max(1e-3);
        steps = clock.steps_now(elapsed_s, cost_s);
    }
    clock.at += u64::from(steps);
    *strategy = TimeUpdateStrategy::FixedTimesteps(steps);
}

/// Puts the gland as it was at first into the world, once it is built.
fn take_back(
    going_back: Option<ResMut<GoingBack>>,
    shown: Res<Shown>,
    mut clock: ResMut<ReplayClock>,
    mut commands: Commands,
) {
    let Some(mut going_back) = going_back else { return };
    let Some(prepared) = block_on(poll_once(&mut going_back.0)) else {
        return;
    };
    commands.remove_resource::<GoingBack>();
    match prepared {
        Ok(prepared) => {
            clock.at = 0;
            let record = shown.record.clone();
            commands.queue(move |world: &mut World| Replay::start(world, record, prepared));
        }
        // It was built from the same record before.
        Err(error) => {
            warn!("{error}");
            clock.seeks = None;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn clock() -> ReplayClock {
        ReplayClock {
            is_playing: true,
            speed: REAL_TIME,
            begins_after: 10,
            steps: 610,
            at: 10,
            seeks: None,
            due: 0.0,
            last: None,
        }
    }

    fn frames(clock: &mut ReplayClock, frames: u32, elapsed_s: f64, cost_s: f64) {
        for _ in 0..frames {
            clock.at += u64::from(clock.steps_now(elapsed_s, cost_s));
        }
    }

    #[test]
    fn real_time_is_real_time_at_any_rate_of_frames_and_ends_at_the_end() {
        for rate in [13.0, 60.0, 144.0] {
            let mut clock = clock();
            frames(&mut clock, (4.0 * rate) as u32, 1.0 / rate, 1e-3);
            assert!(clock.played().abs_diff(240) <= 5, "{rate}: {}", clock.played());
            frames(&mut clock, (8.0 * rate) as u32, 1.0 / rate, 1e-3);
            assert_eq!((clock.played(), clock.is_playing), (clock.length(), false));
        }
    }

    #[test]
    fn a_slow_machine_shows_fewer_steps_and_keeps_its_frames() {
        let mut clock = clock();
        clock.speed = SPEEDS.len() - 1;
        assert_eq!(clock.steps_now(10.0, 0.02), 4);
        assert_eq!(clock.steps_now(0.0, 0.02), 0);
    }

    #[test]
    fn whoever_does_not_want_to_wait_stays_where_it_has_come() {
        let mut clock = clock();
        clock.seek(500);
        frames(&mut clock, 1, 0.1, 0.01);
        assert!(clock.is_far());
        clock.stay();
        let played = clock.played();
        assert!((1..500).contains(&played) && !clock.is_playing && clock.seeks().is_none());
        // The way back leads to the start.
        clock.seek(played - 1);
        clock.stay();
        assert_eq!(clock.seeks(), Some(0));
    }

    #[test]
    fn seeking_arrives_there_and_no_further_playing_or_not() {
        for is_playing in [false, true] {
            let mut clock = clock();
            clock.is_playing = is_playing;
            clock.seek(100);
            while clock.seeks().is_some() {
                frames(&mut clock, 1, 0.1, 0.01);
            }
            assert_eq!((clock.played(), clock.is_playing), (100, is_playing));
            clock.skip(f64::MAX);
            assert_eq!(clock.seeks(), Some(clock.length()));
            clock.skip(f64::MIN);
            assert_eq!(clock.seeks(), Some(0));
        }
    }
}
