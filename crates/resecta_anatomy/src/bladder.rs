//! The bladder's place and shape over a gland: a sphere that is open where it sits on it.
//!
//! No case gives a bladder; this is a rule. Its radius is that of 150 ml, a filling of practice, whatever it holds.

use glam::{DVec2, DVec3};

use crate::Case;

/// Radius of the bladder, mm: 150 ml, a filling of practice.
const RADIUS_MM: f64 = 33.0;
/// The most of the radius that the opening takes, so that a wide gland leaves a bladder.
const WIDEST_RIM: f64 = 0.8;

/// A sphere without what lies below a plane across the axis.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BladderShape {
    /// Centre of the sphere, mm.
    pub centre: DVec3,
    /// Its radius, mm.
    pub radius_mm: f64,
    /// Height of the opening from the centre, mm: negative, it is below.
    pub open_z: f64,
}

impl BladderShape {
    /// The bladder over a gland; none for a case without bladder neck or slices.
    ///
    /// The wall meets the gland's rim: the widest point of the last slice lies on it, and the opening a millimetre below the
    /// gland's top or the bladder neck, whichever is higher.
    pub fn of_case(case: &Case) -> Option<Self> {
        let neck = case.landmarks.bladder_neck?;
        let last = case.slices.last().filter(|slice| !slice.capsule.is_empty())?;
        let middle = last.capsule.iter().sum::<DVec2>() / last.capsule.len() as f64;
        let widest = (last.capsule.iter())
            .map(|point| point.distance(middle))
            .fold(0.0, f64::max);
        let rim = widest.min(RADIUS_MM * WIDEST_RIM);
        let open_z = -(RADIUS_MM * RADIUS_MM - rim * rim).sqrt();
        Some(Self {
            centre: middle.extend(last.z.max(neck.z) - open_z - 1.0),
            radius_mm: RADIUS_MM,
            open_z,
        })
    }

    /// Height of the opening, mm, in the case's coordinates.
    pub fn opening_z(&self) -> f64 {
        self.centre.z + self.open_z
    }

    /// The point of the wall before or behind a place, mm: at its height and as far to the side, so that what a case or a rule
    /// puts near the midline stays there. The nearest height at which there is wall stands for one at which there is none.
    pub fn on_wall(&self, place: DVec3) -> DVec3 {
        let offset = place - self.centre;
        let z = offset.z.clamp(self.open_z, self.radius_mm);
        let ring_mm = (self.radius_mm * self.radius_mm - z * z).max(0.0).sqrt();
        let x = offset.x.clamp(-ring_mm, ring_mm);
        let depth_mm = (ring_mm * ring_mm - x * x).max(0.0).sqrt();
        self.centre + DVec3::new(x, depth_mm.copysign(offset.y), z)
    }

    /// Radius of the opening, mm.
    pub fn rim_mm(&self) -> f64 {
        (self.radius_mm * self.radius_mm - self.open_z * self.open_z)
            .max(0.0)
            .sqrt()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::generate::{GlandSpec, generate};

    #[test]
    fn its_wall_meets_the_gland() {
        let case = generate(&GlandSpec {
            volume_ml: 60.0,
            median_lobe_mm: 8.0,
            seed: 7,
        })
        .expect("a usual gland");
        let shape = BladderShape::of_case(&case).expect("a generated gland has a neck");
        let last = case.slices.last().expect("it has slices");
        let middle = shape.centre.truncate();
        let widest = (last.capsule.iter())
            .map(|point| point.distance(middle))
            .fold(0.0, f64::max);
        assert!((shape.rim_mm() - widest.min(0.8 * shape.radius_mm)).abs() < 1e-9);
        assert!(shape.opening_z() > last.z - 1.5 && shape.opening_z() < shape.centre.z);
    }
    #[test]
    fn a_place_comes_to_the_wall_before_or_behind_it() {
        let shape = BladderShape {
            centre: DVec3::new(1.0, 2.0, 50.0),
            radius_mm: 33.0,
            open_z: -20.0,
        };
        for place in [
            DVec3::new(13.5, -13.0, 45.0),
            DVec3::new(-11.5, 17.0, 60.0),
            DVec3::new(1.0, 40.0, 31.0),
        ] {
            let on_wall = shape.on_wall(place);
            assert!((on_wall.distance(shape.centre) - 33.0).abs() < 1e-9);
            assert_eq!((on_wall.x, on_wall.z), (place.x, place.z));
            assert_eq!(on_wall.y < 2.0, place.y < 2.0);
        }
        // Below the opening, beside and above the sphere.
        for (place, x, z) in [
            (DVec3::new(3.0, 0.0, 20.0), 3.0, 30.0),
            (DVec3::new(90.0, 0.0, 50.0), 34.0, 50.0),
            (DVec3::new(1.0, 2.0, 99.0), 1.0, 83.0),
        ] {
            let on_wall = shape.on_wall(place);
            assert!((on_wall.distance(shape.centre) - 33.0).abs() < 1e-9);
            assert_eq!((on_wall.x, on_wall.z), (x, z));
        }
    }
}
