//! The veil before a lens that is pressed on tissue: it sees its own light in that tissue, and nothing else.
//!
//! How much is hidden follows from one distance without a step anywhere, and eases towards it in simulated time: tissue that
//! gives way and comes back by tenths of a millimetre from step to step must not flicker.

use bevy::prelude::*;
use resecta_instrument::{InstrumentState, Resectoscope};
use resecta_scenario::ActiveExercise;
use resecta_tissue::{TissueProbe, TissueSystems};

use super::cameras::EndoscopeCamera;

/// The distance asked for is that of a point so far before the lens, mm: what the side of the sheath lies on hides nothing.
const AHEAD_MM: f32 = 1.0;
/// Distances of that point from tissue, mm, at which the veil begins and is full. A wall straight ahead is 3 mm from the lens
/// where it begins; beside the lens, the sheath keeps tissue further away.
const BEGINS_MM: f32 = 2.0;
const FULL_MM: f32 = 0.1;
/// In this time the veil makes up for all but 1/e of what it lags behind, s.
const EASE_S: f32 = 0.2;

pub fn plugin(app: &mut App) {
    app.add_systems(FixedPostUpdate, (ease, ask).chain().before(TissueSystems::WriteBack));
}

/// What tissue at the lens of an endoscope camera hides.
#[derive(Component, Debug, Clone, Copy, Default, PartialEq)]
#[require(TissueProbe)]
pub struct Veil {
    /// Share of the picture's light that is the tissue's own, 0 to 1.
    pub share: f32,
    /// Where in the picture the tissue is nearest: x to the right, y up, at most 1 long, 0 if straight ahead.
    pub side: Vec2,
}

impl Veil {
    /// The veil where nothing has moved for long. The distance is negative in tissue.
    fn at_rest(signed_mm: f32, side: Vec2) -> Self {
        let nearness = ((BEGINS_MM - signed_mm) / (BEGINS_MM - FULL_MM)).clamp(0.0, 1.0);
        Self {
            share: nearness * nearness * (3.0 - 2.0 * nearness),
            side,
        }
    }

    /// The veil some time later.
    fn eased(self, target: Self, seconds: f32) -> Self {
        let share = 1.0 - (-seconds / EASE_S).exp();
        Self {
            share: self.share + (target.share - self.share) * share,
            side: self.side.lerp(target.side, share),
        }
    }
}

/// Follows what was answered in the last step.
fn ease(time: Res<Time>, mut lenses: Query<(&TissueProbe, &Transform, &mut Veil), With<EndoscopeCamera>>) {
    for (probe, lens, mut veil) in &mut lenses {
        let distance = probe.distance_mm.unwrap_or(f32::INFINITY);
        let sign = if probe.inside { -1.0 } else { 1.0 };
        // From within, the nearest surface lies where the lens came from.
        let towards = probe
            .nearest
            .map_or(Vec3::ZERO, |nearest| sign * (nearest - probe.point));
        let side = (lens.rotation.inverse() * towards.normalize_or_zero()).truncate();
        let next = veil.eased(Veil::at_rest(sign * distance, side), time.delta_secs());
        veil.set_if_neq(next);
    }
}

/// Asks where the lens is in this step.
fn ask(
    active: Option<Res<ActiveExercise>>,
    instruments: Query<(&Resectoscope, &InstrumentState)>,
    mut probes: Query<&mut TissueProbe, With<EndoscopeCamera>>,
) {
    let Some((scope, state)) = active.and_then(|active| instruments.get(active.instrument).ok()) else {
        return;
    };
    let lens = scope.lens_pose(state);
    for mut probe in &mut probes {
        probe.point = lens.transform_point(Vec3::NEG_Z * AHEAD_MM).into();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const STEP_S: f32 = 1.0 / 60.0;

    fn share(signed_mm: f32) -> f32 {
        Veil::at_rest(signed_mm, Vec2::ZERO).share
    }

    #[test]
    fn the_nearer_the_tissue_the_more_it_hides() {
        let mut before = 1.0;
        for step in -300..400 {
            let now = share(0.01 * step as f32);
            assert!((0.0..=before).contains(&now), "{step}: {before}, then {now}");
            before = now;
        }
        // A wall straight ahead of the lens: 3 mm away, 1.5 mm, at the lens.
        assert_eq!(share(3.0 - AHEAD_MM), 0.0);
        assert!(share(1.5 - AHEAD_MM) > 0.8);
        assert_eq!(share(0.0 - AHEAD_MM), 1.0);
        // Further than a probe looks.
        assert_eq!((share(f32::INFINITY), share(f32::NEG_INFINITY)), (0.0, 1.0));
    }

    #[test]
    fn a_surface_that_hops_by_tenths_of_a_millimetre_does_not_flicker() {
        for about in -10..40 {
            let about = 0.1 * about as f32;
            let mut veil = Veil::at_rest(about, Vec2::ZERO);
            for step in 0..200 {
                let hop = if step % 2 == 0 { 0.1 } else { -0.1 };
                let next = veil.eased(Veil::at_rest(about + hop, Vec2::ZERO), STEP_S);
                let change = (next.share - veil.share).abs();
                assert!(change < 0.02, "{change} of the light in a frame about {about} mm");
                veil = next;
            }
        }
    }

    #[test]
    fn a_probe_that_is_wrong_for_a_step_is_not_seen() {
        let far = Veil::at_rest(3.0, Vec2::ZERO);
        let once = far.eased(Veil::at_rest(-3.0, Vec2::ZERO), STEP_S);
        assert!(once.share < 0.1);
        let mut veil = far;
        for _ in 0..60 {
            veil = veil.eased(Veil::at_rest(-3.0, Vec2::ZERO), STEP_S);
        }
        assert!(veil.share > 0.95, "all is hidden within a second: {}", veil.share);
    }
}
