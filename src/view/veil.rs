//! The veil before a lens that is pressed on tissue: it sees its own light in that tissue, and nothing else.
//!
//! How near tissue is, is asked at a few points before the lens, so that a wall which lies against one side of it hides that side
//! alone. How much each hides follows from one distance without a step anywhere, and eases towards it in simulated time:
//! tissue that gives way and comes back by tenths of a millimetre from step to step must not flicker.

use bevy::prelude::*;
use resecta_instrument::{InstrumentState, Resectoscope};
use resecta_scenario::ActiveExercise;
use resecta_tissue::{TissueProbe, TissueSystems};

use super::ViewSystems;

/// The points that are asked for lie so far from the lens, mm: one straight ahead, the others by an angle beside it.
const AHEAD_MM: f32 = 2.0;
const BESIDE_DEG: f32 = 28.0;
/// Where the others lie in the picture: above, below, left and right of the middle.
const BESIDE: [Vec2; 4] = [Vec2::Y, Vec2::NEG_Y, Vec2::NEG_X, Vec2::X];
/// Distances of such a point from tissue, mm, negative in tissue, at which the veil begins and is full. A wall straight ahead is
/// 3 mm from the lens where it begins.
const BEGINS_MM: f32 = 0.9;
const FULL_MM: f32 = -0.9;
/// In this time the veil makes up for all but 1/e of what it lags behind, s.
const EASE_S: f32 = 0.2;
/// Share of the middle of the picture from which on there is nothing to see.
const BLIND: f32 = 0.5;
/// How long a picture of a moment waits for the lens to come out of tissue, s: a stroke is over by then.
pub const PICTURE_WAITS_S: f64 = 1.4;

pub fn plugin(app: &mut App) {
    app.add_systems(FixedPostUpdate, (ease, ask).chain().before(TissueSystems::WriteBack))
        .add_systems(Update, add_feelers.in_set(ViewSystems::Dress));
}

/// What tissue at the lens of an endoscope camera hides: shares of the picture's light that are the tissue's own, 0 to 1.
#[derive(Component, Debug, Clone, Copy, Default, PartialEq)]
pub struct Veil {
    /// In the middle of the picture.
    pub middle: f32,
    /// Above, below, left and right of it, [`Veil::beside`] away.
    pub around: [f32; 4],
}

impl Veil {
    /// Whether tissue hides so much that a picture would show nothing.
    pub fn is_blind(&self) -> bool {
        self.middle > BLIND
    }

    /// Tangent of the angle by which the points lie beside the middle.
    pub fn beside() -> f32 {
        BESIDE_DEG.to_radians().tan()
    }
}

/// A point before a camera's lens.
#[derive(Component, Debug)]
#[require(TissueProbe)]
enum Feeler {
    Middle,
    /// One of [`BESIDE`].
    Around(usize),
}

impl Feeler {
    /// From the lens, in its frame, mm.
    fn place(&self) -> Vec3 {
        let beside = match self {
            Feeler::Middle => Vec2::ZERO,
            Feeler::Around(side) => BESIDE[*side] * Veil::beside(),
        };
        beside.extend(-1.0).normalize() * AHEAD_MM
    }
}

fn add_feelers(cameras: Query<Entity, Added<Veil>>, mut commands: Commands) {
    for camera in &cameras {
        commands.entity(camera).with_children(|camera| {
            camera.spawn(Feeler::Middle);
            for side in 0..BESIDE.len() {
                camera.spawn(Feeler::Around(side));
            }
        });
    }
}

/// What tissue hides where nothing has moved for long. The distance is negative in tissue.
fn at_rest(signed_mm: f32) -> f32 {
    let nearness = ((BEGINS_MM - signed_mm) / (BEGINS_MM - FULL_MM)).clamp(0.0, 1.0);
    nearness * nearness * (3.0 - 2.0 * nearness)
}

/// What it hides some time after it hid `share`.
fn eased(share: f32, target: f32, seconds: f32) -> f32 {
    target + (share - target) * (-seconds / EASE_S).exp()
}

/// Follows what was answered in the last step.
fn ease(time: Res<Time>, feelers: Query<(&Feeler, &TissueProbe, &ChildOf)>, mut veils: Query<&mut Veil>) {
    for (feeler, probe, camera) in &feelers {
        let Ok(mut veil) = veils.get_mut(camera.parent()) else {
            continue;
        };
        let distance = probe.distance_mm.unwrap_or(f32::INFINITY);
        let target = at_rest(if probe.inside { -distance } else { distance });
        let share = match feeler {
            Feeler::Middle => &mut veil.middle,
            Feeler::Around(side) => &mut veil.around[*side],
        };
        *share = eased(*share, target, time.delta_secs());
    }
}

/// Asks where the lens is in this step.
fn ask(
    active: Option<Res<ActiveExercise>>,
    instruments: Query<(&Resectoscope, &InstrumentState)>,
    mut feelers: Query<(&Feeler, &mut TissueProbe)>,
) {
    let Some((scope, state)) = active.and_then(|active| instruments.get(active.instrument).ok()) else {
        return;
    };
    let lens = scope.lens_pose(state);
    for (feeler, mut probe) in &mut feelers {
        probe.point = lens.transform_point(feeler.place()).into();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const STEP_S: f32 = 1.0 / 60.0;

    #[test]
    fn the_nearer_the_tissue_the_more_it_hides() {
        let mut before = 1.0;
        for step in -300..400 {
            let now = at_rest(0.01 * step as f32);
            assert!((0.0..=before).contains(&now), "{step}: {before}, then {now}");
            before = now;
        }
        // Further than a probe looks.
        assert_eq!((at_rest(f32::INFINITY), at_rest(f32::NEG_INFINITY)), (0.0, 1.0));
    }

    #[test]
    fn a_wall_ahead_hides_all_at_the_lens_and_nothing_at_3_mm() {
        let feelers = [Feeler::Middle].into_iter().chain((0..4).map(Feeler::Around));
        for feeler in feelers {
            let veil = |wall_mm: f32| at_rest(wall_mm + feeler.place().z);
            assert_eq!((veil(0.0), veil(3.0)), (1.0, 0.0), "{feeler:?}");
            assert!(veil(1.5) > 0.7, "{feeler:?} {}", veil(1.5));
        }
    }

    #[test]
    fn a_surface_that_hops_by_tenths_of_a_millimetre_does_not_flicker() {
        for about in -20..30 {
            let about = 0.1 * about as f32;
            let mut share = at_rest(about);
            for step in 0..200 {
                let hop = if step % 2 == 0 { 0.1 } else { -0.1 };
                let next = eased(share, at_rest(about + hop), STEP_S);
                let change = (next - share).abs();
                assert!(change < 0.02, "{change} of the light in a frame about {about} mm");
                share = next;
            }
        }
    }

    #[test]
    fn a_probe_that_is_wrong_for_a_step_is_hardly_seen_and_a_second_in_tissue_is_red() {
        let once = eased(0.0, at_rest(-3.0), STEP_S);
        assert!(once < 0.1, "{once}");
        let second = (0..60).fold(0.0, |share, _| eased(share, at_rest(-3.0), STEP_S));
        assert!(second > 0.99, "{second}");
    }
}
