//! The contours of a case at any height, between its slices.

use std::f64::consts::TAU;

use bevy::math::{DVec2, Vec2};
use resecta_anatomy::{Case, Slice, contour};

/// Rays from the middle of a contour.
const RAYS: usize = 72;

/// A contour of a case at a height, mm: between two slices, where rays from the contours' middles meet them, mixed by height.
/// Empty above the last slice, below the first, and where one of the two slices has no such contour.
pub fn at_height(case: &Case, z_mm: f64, of: impl Fn(&Slice) -> Option<&[DVec2]>) -> Vec<Vec2> {
    let above = case.slices.partition_point(|slice| slice.z < z_mm);
    let Some(upper) = case.slices.get(above) else {
        return Vec::new();
    };
    let lower = match above.checked_sub(1) {
        Some(below) => &case.slices[below],
        None if upper.z == z_mm => upper,
        None => return Vec::new(),
    };
    let (Some(low), Some(high)) = (of(lower), of(upper)) else {
        return Vec::new();
    };
    let share = (z_mm - lower.z) / (upper.z - lower.z);
    let share = if share.is_finite() { share.clamp(0.0, 1.0) } else { 0.0 };
    let middles = [contour::centroid(low), contour::centroid(high)];
    let ray = |n: usize| {
        let direction = DVec2::from_angle(TAU * n as f64 / RAYS as f64);
        let low = middles[0] + direction * contour::ray(low, middles[0], direction)?;
        let high = middles[1] + direction * contour::ray(high, middles[1], direction)?;
        Some(low.lerp(high, share).as_vec2())
    };
    (0..RAYS).filter_map(ray).collect()
}

/// Middle and half the side of the square that holds the capsules of all slices, mm, with a margin.
pub fn frame(case: &Case) -> (Vec2, f32) {
    let corners = case.slices.iter().flat_map(|slice| &slice.capsule);
    let (low, high) = corners.fold((DVec2::INFINITY, DVec2::NEG_INFINITY), |(low, high), &corner| {
        (low.min(corner), high.max(corner))
    });
    if !(low.is_finite() && high.is_finite()) {
        return (Vec2::ZERO, 1.0);
    }
    let half = 0.5 * (high - low).max_element() as f32;
    ((0.5 * (low + high)).as_vec2(), 1.08 * half.max(1.0))
}

#[cfg(test)]
mod tests {
    use resecta_anatomy::{CaseSource, Landmarks, Unit};

    use super::*;

    /// A cone: circles of radius 10 at z = 0 and 20 at z = 10, about (3, 0) and (3, 4).
    fn cone() -> Case {
        let circle = |middle: DVec2, radius: f64| {
            (0..720)
                .map(|n| middle + radius * DVec2::from_angle(TAU * f64::from(n) / 720.0))
                .collect()
        };
        let slice = |z, middle, radius| Slice {
            z,
            capsule: circle(middle, radius),
            urethra: None,
            transition_zone: None,
        };
        Case {
            name: "cone".into(),
            source: CaseSource::default(),
            unit: Unit::default(),
            material: String::new(),
            landmarks: Landmarks::default(),
            approximated: Vec::new(),
            slices: vec![
                slice(0.0, DVec2::new(3.0, 0.0), 10.0),
                slice(10.0, DVec2::new(3.0, 4.0), 20.0),
            ],
        }
    }

    #[test]
    fn between_the_circles_of_a_cone_lie_circles() {
        let case = cone();
        for z in [0.0, 2.5, 9.0, 10.0] {
            let found = at_height(&case, z, |slice| Some(&slice.capsule));
            assert_eq!(found.len(), RAYS);
            let middle = Vec2::new(3.0, 0.4 * z as f32);
            for point in found {
                assert!((point.distance(middle) - (10.0 + z as f32)).abs() < 2e-3, "{z} {point}");
            }
        }
    }

    #[test]
    fn there_is_nothing_beyond_the_ends_and_nothing_that_the_case_does_not_have() {
        let case = cone();
        for z in [-0.1, 10.1, f64::NAN] {
            assert!(at_height(&case, z, |slice| Some(&slice.capsule)).is_empty(), "{z}");
        }
        assert!(at_height(&case, 5.0, |slice| slice.urethra.as_deref()).is_empty());
    }

    #[test]
    fn the_frame_holds_every_capsule() {
        let (middle, half) = frame(&cone());
        for point in cone().slices.iter().flat_map(|slice| &slice.capsule) {
            assert!((point.as_vec2() - middle).abs().max_element() <= half);
        }
    }
}
