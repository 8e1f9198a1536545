//! How fast the game runs: frames, and simulated time against real time.

use bevy::prelude::*;

/// Time constant of the means, s.
const MEMORY_S: f32 = 1.0;
/// Below this share of real time the simulation counts as slow; a late frame now and then does not.
const SLOW: f32 = 0.95;

pub fn plugin(app: &mut App) {
    app.init_resource::<Pace>()
        .add_systems(First, measure.after(bevy::time::TimeSystems));
}

/// Running means of the frame.
#[derive(Resource, Debug, Clone, PartialEq)]
pub struct Pace {
    /// Real time of a frame, s.
    pub frame_s: f32,
    /// Simulated time by real time; 1 where the machine keeps up.
    pub share: f32,
}

impl Default for Pace {
    fn default() -> Self {
        Pace {
            frame_s: 0.0,
            share: 1.0,
        }
    }
}

impl Pace {
    /// Whether the simulation runs slower than real time.
    pub fn is_slow(&self) -> bool {
        self.share < SLOW
    }

    /// Begins anew: as if the machine had kept up so far.
    pub fn forget(&mut self) {
        self.share = 1.0;
    }

    pub(super) fn add_frame(&mut self, real_s: f32, simulated_s: f32) {
        if real_s <= 0.0 {
            return;
        }
        let weight = 1.0 - (-real_s / MEMORY_S).exp();
        self.frame_s += (real_s - self.frame_s) * if self.frame_s == 0.0 { 1.0 } else { weight };
        self.share += (simulated_s / real_s - self.share) * weight;
    }
}

/// `Time<Virtual>` leaves out what a frame could not make up for: that is the time lost.
pub(super) fn measure(real: Res<Time<Real>>, simulated: Res<Time<Virtual>>, mut pace: ResMut<Pace>) {
    if !simulated.is_paused() {
        // What is shown slower than it is keeps up, too.
        pace.add_frame(real.delta_secs(), simulated.delta_secs() / simulated.relative_speed());
    }
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use bevy::time::TimeUpdateStrategy;

    use super::*;

    #[test]
    fn the_share_comes_to_what_is_simulated() {
        let mut pace = Pace::default();
        for _ in 0..200 {
            pace.add_frame(0.1, 0.05);
        }
        assert!((pace.share - 0.5).abs() < 1e-3 && pace.is_slow());
        assert!((pace.frame_s - 0.1).abs() < 1e-4);
    }

    #[test]
    fn one_late_frame_is_not_slow() {
        let mut pace = Pace::default();
        for frame in 0..120 {
            let real = if frame == 100 { 0.08 } else { 0.0167 };
            pace.add_frame(real, real.min(0.05));
        }
        assert!(!pace.is_slow(), "{pace:?}");
    }

    #[test]
    fn what_is_shown_at_half_its_speed_keeps_up() {
        let mut app = App::new();
        app.add_plugins((bevy::time::TimePlugin, plugin))
            .insert_resource(TimeUpdateStrategy::ManualDuration(Duration::from_millis(16)));
        app.world_mut().resource_mut::<Time<Virtual>>().set_relative_speed(0.5);
        (0..300).for_each(|_| app.update());
        let pace = app.world().resource::<Pace>();
        assert!((pace.share - 1.0).abs() < 1e-3, "{pace:?}");
    }
}
