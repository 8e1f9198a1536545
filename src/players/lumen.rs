//! How hands bring the sheath along the urethra: it bends, and a sheath that goes straight to where it is wanted ploughs through
//! tissue instead.

use bevy::{math::DVec3, prelude::*};
use resecta_instrument::{InstrumentState, Resectoscope};

use super::hand::approach;

/// Nearer than the first to the depth at which it is wanted, mm, the sheath points where it is wanted; further off than the second it
/// points along the lumen. Strokes that lie side by side, and the places of a search, are within the first.
const NEAR_MM: [f32; 2] = [8.0, 12.0];
/// The sheath waits for its direction where that is this far off, degrees: at the depth of the bladder neck its radius.
const OFF_DEG: f32 = 4.0;
/// It waits for its loop where that is this far out yet, mm: what the sheath hides.
const OUT_MM: f32 = 3.0;

/// The middles of the urethra, from the apex to the bladder neck, 1 mm apart in height.
#[derive(Debug, Clone, Default)]
pub(super) struct Lumen {
    pub middles: Vec<DVec3>,
}

impl Lumen {
    /// The pitch and the yaw, degrees, that point the sheath at the middle of the lumen at a depth; `None` of a case without slices.
    fn direction_deg(&self, scope: &Resectoscope, insertion_mm: f32) -> Option<[f32; 2]> {
        let off = |middle: &Vec3| (middle.distance(scope.pivot()) - insertion_mm).abs();
        let middles = self.middles.iter().map(|middle| middle.as_vec3());
        let nearest = middles.min_by(|a, b| off(a).total_cmp(&off(b)))?;
        Some(scope.turned_to(nearest - scope.pivot()))
    }

    /// A step on the way to `to`, as [`approach`]: the sheath follows the lumen until it is near, the loop drawn in as far as that.
    pub fn follow(
        &self,
        scope: &Resectoscope,
        now: &InstrumentState,
        to: &InstrumentState,
        drawn_in_mm: f32,
        [haste, step_s]: [f32; 2],
    ) -> InstrumentState {
        let mut to = *to;
        let [near, far] = NEAR_MM;
        let share = (((to.insertion_mm - now.insertion_mm).abs() - near) / (far - near)).clamp(0.0, 1.0);
        if let Some([pitch_deg, yaw_deg]) = self.direction_deg(scope, now.insertion_mm) {
            to.pitch_deg = to.pitch_deg.lerp(pitch_deg, share);
            to.yaw_deg = to.yaw_deg.lerp(yaw_deg, share);
            // A loop that is out hooks what the sheath slides past.
            to.stroke_mm = to.stroke_mm.lerp(now.stroke_mm.min(drawn_in_mm), share);
        }
        let mut next = approach(scope, now, &to, haste, step_s);
        let off_deg = (to.pitch_deg - now.pitch_deg).hypot(to.yaw_deg - now.yaw_deg);
        let off_mm = now.stroke_mm - to.stroke_mm;
        let pace = (1.0 - off_deg / OFF_DEG).min(1.0 - off_mm / OUT_MM).max(1.0 - share);
        next.insertion_mm = now.insertion_mm.lerp(next.insertion_mm, pace.clamp(0.0, 1.0));
        next
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::players::hand::is_at;

    #[test]
    fn the_tip_stays_in_the_middle_of_a_bent_lumen_until_it_is_near_and_arrives() {
        let scope = Resectoscope::new(Vec3::new(0.0, 0.0, -5.0), Vec3::Z, Vec3::NEG_Y).unwrap();
        // Straight for 15 mm, then 35 degrees towards anterior.
        let bent = |z: i32| DVec3::new(0.0, -0.7 * f64::from((z - 15).max(0)), z.into());
        let lumen = Lumen {
            middles: (0..50).map(bent).collect(),
        };
        let mut state = InstrumentState {
            insertion_mm: 10.0,
            pitch_deg: -20.0,
            ..default()
        };
        let to = InstrumentState {
            insertion_mm: 55.0,
            pitch_deg: 30.0,
            yaw_deg: 5.0,
            ..default()
        };
        let mut furthest_mm: f32 = 0.0;
        let steps = (0..600).take_while(|_| {
            if state.insertion_mm > 10.5 && to.insertion_mm - state.insertion_mm > NEAR_MM[1] {
                let tip = scope.tip(&state);
                let off = (lumen.middles.iter()).map(|middle| middle.as_vec3().distance(tip));
                furthest_mm = furthest_mm.max(off.fold(f32::INFINITY, f32::min));
            }
            state = lumen.follow(&scope, &state, &to, 0.0, [0.2, 1.0 / 60.0]);
            !is_at(&scope, &state, &to)
        });
        assert!(steps.count() < 600, "it does not arrive: {state:?}");
        // The sheath's radius is 4 mm.
        assert!(furthest_mm < 3.0, "{furthest_mm} mm off the middle");
    }
}
