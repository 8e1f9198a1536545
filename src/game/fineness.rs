//! How finely the endoscope's picture is drawn: on a machine that cannot keep up, with fewer pixels, before the simulation has to
//! fall behind.
//!
//! Frames that take too long lower it by a step. Where that does not shorten them (the time goes elsewhere), it is taken back
//! and left alone for a while. Frames that are in time again for a while raise it, each time that this was too early after
//! twice as long.

use bevy::prelude::*;

use super::pace::{self, Pace};
use crate::view::{EndoscopeCamera, Fineness};

/// Shares of the pixels a side. Two steps halve their number.
const STEPS: [f32; 5] = [1.0, 0.84, 0.71, 0.59, 0.5];
/// Frames longer than this are late, s. A step of the simulation is 1/60 s.
const LATE_S: f32 = 1.0 / 45.0;
/// Frames shorter than this are in time, s; a display's 60 a second are.
const IN_TIME_S: f32 = 1.0 / 57.0;
/// After a change the frames get this long until they are judged, s: some times the memory of their mean.
const WATCH_S: f32 = 3.0;
/// A step down must shorten frames by this share to have helped.
const HELPS: f32 = 0.04;
/// So long it is left alone when lowering did not help, s.
const REST_S: f32 = 30.0;
/// Frames must be in time so long before it is raised, s: at first, and at most.
const RAISE_S: [f32; 2] = [5.0, 160.0];

pub fn plugin(app: &mut App) {
    app.init_resource::<Finesse>()
        .add_systems(First, adapt.after(pace::measure));
}

/// What is known about how fine this machine can draw.
#[derive(Resource, Debug, Clone, PartialEq)]
struct Finesse {
    /// Index into [`STEPS`].
    step: usize,
    /// The last change, until it is judged.
    change: Option<Change>,
    /// Time since then, or since it was left alone, s.
    since_s: f32,
    /// How long to leave it alone, s.
    rest_s: f32,
    /// For how long frames have been in time, s.
    in_time_s: f32,
    /// After how long it is raised, s.
    raise_s: f32,
}

#[derive(Debug, Clone, Copy, PartialEq)]
enum Change {
    /// From frames of such a length, s.
    Lowered {
        frame_s: f32,
    },
    Raised,
}

impl Default for Finesse {
    fn default() -> Self {
        Finesse {
            step: 0,
            change: None,
            since_s: 0.0,
            rest_s: WATCH_S,
            in_time_s: 0.0,
            raise_s: RAISE_S[0],
        }
    }
}

impl Finesse {
    fn share(&self) -> f32 {
        STEPS[self.step]
    }

    /// Adds a frame of `real_s`, when frames have come to take `frame_s` in the mean.
    fn add_frame(&mut self, real_s: f32, frame_s: f32) {
        self.since_s += real_s;
        self.in_time_s = if frame_s <= IN_TIME_S {
            self.in_time_s + real_s
        } else {
            0.0
        };
        if self.since_s < self.rest_s {
            return;
        }
        match self.change.take() {
            Some(Change::Lowered { frame_s: before_s }) if frame_s > before_s * (1.0 - HELPS) => {
                self.go(self.step - 1, None, REST_S);
            }
            Some(Change::Raised) if frame_s > LATE_S => {
                self.raise_s = (2.0 * self.raise_s).min(RAISE_S[1]);
                self.go(self.step + 1, None, WATCH_S);
            }
            _ if frame_s > LATE_S && self.step + 1 < STEPS.len() => {
                self.go(self.step + 1, Some(Change::Lowered { frame_s }), WATCH_S);
            }
            _ if self.in_time_s >= self.raise_s && self.step > 0 => {
                self.go(self.step - 1, Some(Change::Raised), WATCH_S);
            }
            _ => {}
        }
    }

    fn go(&mut self, step: usize, change: Option<Change>, rest_s: f32) {
        (self.step, self.change, self.rest_s) = (step, change, rest_s);
        (self.since_s, self.in_time_s) = (0.0, 0.0);
    }
}

fn adapt(
    real: Res<Time<Real>>,
    simulated: Res<Time<Virtual>>,
    pace: Res<Pace>,
    mut finesse: ResMut<Finesse>,
    mut cameras: Query<&mut Fineness, With<EndoscopeCamera>>,
) {
    // On still screens frames cost something else.
    if simulated.is_paused() {
        return;
    }
    finesse.add_frame(real.delta_secs(), pace.frame_s);
    for mut fineness in &mut cameras {
        fineness.set_if_neq(Fineness(finesse.share()));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What a machine comes to on which a frame takes `fixed_s` and, at full fineness, `pixels_s` more: the share after each
    /// of so many seconds.
    fn course(finesse: &mut Finesse, seconds: usize, fixed_s: f32, pixels_s: f32) -> Vec<f32> {
        let mut pace = Pace::default();
        let mut shares = Vec::new();
        let (mut time_s, mut next_s) = (0.0, 1.0);
        while shares.len() < seconds {
            let frame_s = (fixed_s + pixels_s * finesse.share().powi(2)).max(1.0 / 60.0);
            pace.add_frame(frame_s, frame_s);
            finesse.add_frame(frame_s, pace.frame_s);
            time_s += frame_s;
            if time_s >= next_s {
                shares.push(finesse.share());
                next_s += 1.0;
            }
        }
        shares
    }

    #[test]
    fn a_machine_that_keeps_up_draws_every_pixel() {
        let shares = course(&mut Finesse::default(), 120, 0.004, 0.010);
        assert!(shares.iter().all(|share| *share == 1.0));
    }

    #[test]
    fn a_slow_one_draws_as_few_as_bring_it_in_time() {
        // 34 ms at full fineness; within 1/45 s from 0.71 on.
        let shares = course(&mut Finesse::default(), 60, 0.006, 0.028);
        assert_eq!(shares.last(), Some(&0.71));
        // The slowest there is stays at the last step.
        let shares = course(&mut Finesse::default(), 60, 0.006, 0.200);
        assert_eq!(shares.last(), Some(&STEPS[STEPS.len() - 1]));
    }

    #[test]
    fn where_pixels_are_not_what_takes_the_time_none_are_given_up_for_long() {
        let shares = course(&mut Finesse::default(), 300, 0.060, 0.001);
        let full = shares.iter().filter(|share| **share == 1.0).count();
        assert!(full as f32 > 0.85 * shares.len() as f32, "{full} of 300 s");
    }

    #[test]
    fn what_was_slow_for_a_while_is_fine_again() {
        let mut finesse = Finesse::default();
        course(&mut finesse, 30, 0.006, 0.060);
        assert!(finesse.share() < 0.75);
        let shares = course(&mut finesse, 60, 0.004, 0.010);
        assert_eq!(shares.last(), Some(&1.0));
    }

    #[test]
    fn a_machine_between_two_steps_does_not_go_up_and_down_for_ever() {
        // Late at full fineness, in time at the next.
        let shares = course(&mut Finesse::default(), 600, 0.001, 0.0225);
        let changes = shares.windows(2).filter(|pair| pair[0] != pair[1]).count();
        assert!((2..=16).contains(&changes), "{changes} changes in 10 minutes");
    }
}
