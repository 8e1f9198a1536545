//! Hands: where the instrument has to be held for the loop to be at a place, and how it gets there.

use bevy::prelude::*;
use resecta_instrument::{InstrumentField, InstrumentState, Resectoscope};

/// The state that holds the loop's deepest point at `place`, hanging towards `outwards`, the loop `stroke_mm` out of the sheath.
/// Taps and pedals are those of `now`.
pub(super) fn hold(
    scope: &Resectoscope,
    now: &InstrumentState,
    place: Vec3,
    outwards: Vec3,
    stroke_mm: f32,
) -> InstrumentState {
    let depth = scope.geometry.loop_depth_mm;
    let mut down = outwards.normalize_or(-scope.up());
    let mut ahead = scope.axis();
    // The loop hangs across the sheath, whose direction follows from where the loop is: converges within some steps.
    for _ in 0..4 {
        ahead = (place - down * depth - scope.pivot()).normalize_or(ahead);
        down = outwards.reject_from_normalized(ahead).normalize_or(down);
    }
    let distance = (place - down * depth - scope.pivot()).length();
    let [pitch_deg, yaw_deg] = scope.turned_to(ahead);
    let mut state = InstrumentState {
        insertion_mm: distance - stroke_mm,
        pitch_deg,
        yaw_deg,
        roll_deg: 0.0,
        stroke_mm,
        ..*now
    };
    let level = scope.sheath_pose(&state).rotation;
    let turned = level.inverse() * down;
    state.roll_deg = (-turned.x).atan2(-turned.y).to_degrees();
    state
}

/// A step on the way from `now` to `to`, at a share of the fastest that the instrument allows; taps and pedals stay.
pub(super) fn approach(
    scope: &Resectoscope,
    now: &InstrumentState,
    to: &InstrumentState,
    haste: f32,
    step_s: f32,
) -> InstrumentState {
    let mut next = *now;
    for field in InstrumentField::ALL {
        if InstrumentField::TAPS.contains(&field) {
            continue;
        }
        let limit = scope.limits.of(field);
        let reach = limit.max_speed * haste * step_s;
        let wanted = to.get(field).clamp(limit.min, limit.max);
        next.set(field, now.get(field) + (wanted - now.get(field)).clamp(-reach, reach));
    }
    next
}

/// Whether the hands are where they were to be.
pub(super) fn is_at(scope: &Resectoscope, now: &InstrumentState, to: &InstrumentState) -> bool {
    InstrumentField::ALL
        .into_iter()
        .filter(|field| !InstrumentField::TAPS.contains(field))
        .all(|field| {
            let limit = scope.limits.of(field);
            (now.get(field) - to.get(field).clamp(limit.min, limit.max)).abs() < 0.05
        })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_loop_is_where_the_hands_were_to_hold_it() {
        let axis = Vec3::new(0.0, -0.15, 1.0);
        let scope = Resectoscope::new(Vec3::new(0.0, -3.0, -5.0), axis, Vec3::NEG_Y).unwrap();
        for hour in 0..12 {
            let (sin, cos) = (hour as f32 / 6.0 * std::f32::consts::PI).sin_cos();
            let outwards = Vec3::new(sin, -cos, 0.0);
            let place = Vec3::new(1.0, -6.0, 40.0) + outwards * 12.0;
            let state = hold(&scope, &InstrumentState::default(), place, outwards, 20.0);
            let pose = scope.loop_pose(&state);
            let deepest = pose.centre + pose.down * scope.geometry.loop_depth_mm;
            assert!(
                deepest.distance(place) < 0.01,
                "{hour} o'clock: {deepest} is not {place}"
            );
            assert!(
                pose.down.dot(outwards) > 0.9,
                "{hour} o'clock hangs towards {}",
                pose.down
            );
            assert_eq!(state.stroke_mm, 20.0);
        }
    }
}
