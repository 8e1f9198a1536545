//! The two walls of a gland at rest, urethra and capsule: where a point lies between them, as a surgeon says it.

use std::f64::consts::TAU;

use bevy::math::{DVec2, DVec3};
use resecta_anatomy::Lattice;

/// Innermost and outermost layer of a lattice, a closed contour each a slice, by rising height.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Walls {
    rings: Vec<Ring>,
    /// Height at which the capsule ends, mm; none where it goes all the way.
    capsule_end_z: Option<f64>,
}

#[derive(Debug, Clone, PartialEq)]
struct Ring {
    z: f64,
    /// Centre of the lattice's rays.
    centre: DVec2,
    urethra: Vec<DVec2>,
    capsule: Vec<DVec2>,
}

impl Walls {
    /// The walls of a lattice at rest. The capsule ends at the bladder neck, at this height, mm, if there is one: see
    /// [`TissueMesh::end_capsule_at`](resecta_solver::TissueMesh::end_capsule_at).
    pub fn of_lattice(lattice: &Lattice, neck_z: Option<f64>) -> Self {
        let shape = lattice.shape;
        let layer = |slice, layer| {
            (0..shape.angles)
                .map(|angle| lattice.positions[shape.index(slice, angle, layer) as usize].truncate())
                .collect()
        };
        let ring = |(slice, centre): (u32, &DVec3)| Ring {
            z: centre.z,
            centre: centre.truncate(),
            urethra: layer(slice, 0),
            capsule: layer(slice, shape.layers - 1),
        };
        Self {
            rings: (0..shape.slices).zip(&lattice.centres).map(ring).collect(),
            capsule_end_z: neck_z,
        }
    }

    /// Heights of the first and the last slice, mm; none without slices.
    pub fn heights_mm(&self) -> Option<(f64, f64)> {
        Some((self.rings.first()?.z, self.rings.last()?.z))
    }

    /// Hour on the clock face about the middle of the urethra at the point's height, 0 to below 12: 12 (0) anterior (-y),
    /// 3 patient's left (+x), 6 posterior (+y).
    pub fn hour(&self, point: DVec3) -> f64 {
        let centre = self.mix(point.z, |below, above, share| below.centre.lerp(above.centre, share));
        centre.map_or(0.0, |centre| clock_hour(point.truncate() - centre))
    }

    /// The middle of the urethra at a height, mm; `None` below the first slice and above the last.
    pub fn middle(&self, z: f64) -> Option<DVec3> {
        let (first, last) = self.heights_mm()?;
        let is_there = (first..=last).contains(&z);
        let middle = self.mix(z, |below, above, share| below.centre.lerp(above.centre, share));
        middle.filter(|_| is_there).map(|middle| middle.extend(z))
    }

    /// The point of the wall of the urethra at a height, in the direction of an hour from its middle, and that direction; none in
    /// a lattice without slices.
    pub fn urethra_at(&self, z: f64, hour: f64) -> Option<(DVec2, DVec2)> {
        let (sin, cos) = (hour / 12.0 * TAU).sin_cos();
        let outwards = DVec2::new(sin, -cos);
        let (centre, wall) = self.mix(z, |below, above, share| {
            let pairs = below.urethra.iter().zip(&above.urethra);
            let wall: Vec<DVec2> = pairs.map(|(a, b)| a.lerp(*b, share)).collect();
            (below.centre.lerp(above.centre, share), wall)
        })?;
        let next = wall.iter().cycle().skip(1);
        let distances = wall.iter().zip(next).filter_map(|(&a, &b)| {
            let (a, b) = (a - centre, b - centre);
            // Where the edge crosses the ray's line.
            let share = outwards.perp_dot(a) / outwards.perp_dot(a - b);
            let place = a.lerp(b, share).dot(outwards);
            ((0.0..=1.0).contains(&share) && place >= 0.0).then_some(place)
        });
        let distance = distances.fold(0.0, f64::max);
        Some((centre + outwards * distance, outwards))
    }

    /// Distance from the wall of the urethra in the transverse plane, mm.
    pub fn depth_mm(&self, point: DVec3) -> f64 {
        self.distance(point, |ring| &ring.urethra)
    }

    /// Distance from the capsule, mm: in the transverse plane, beyond its end from its rim.
    pub fn capsule_mm(&self, point: DVec3) -> f64 {
        let z = self.capsule_end_z.map_or(point.z, |end| point.z.min(end));
        let across = self.distance(point.with_z(z), |ring| &ring.capsule);
        across.hypot(point.z - z)
    }

    /// How far a point is within the capsule in the transverse plane, mm; negative beyond it. None where the organ does not
    /// reach: past its ends, and past the bladder neck.
    pub fn room_mm(&self, point: DVec3) -> Option<f64> {
        let (first, last) = self.heights_mm()?;
        let end = self.capsule_end_z.map_or(last, |end| end.min(last));
        if !(first..=end).contains(&point.z) {
            return None;
        }
        let contour = self.contour(point.z, |ring| &ring.capsule);
        let distance = distance_to(&contour, point.truncate());
        let is_within = resecta_anatomy::contour::contains(&contour, point.truncate());
        Some(if is_within { distance } else { -distance })
    }

    /// What the two rings about a height make, with how far the height is from the first to the second (0 to 1).
    fn mix<T>(&self, z: f64, of: impl FnOnce(&Ring, &Ring, f64) -> T) -> Option<T> {
        let last = self.rings.len().checked_sub(1)?;
        let upper = self.rings.partition_point(|ring| ring.z <= z).clamp(1.min(last), last);
        let (below, above) = (&self.rings[upper.saturating_sub(1)], &self.rings[upper]);
        let share = (z - below.z) / (above.z - below.z);
        Some(of(
            below,
            above,
            if share.is_finite() { share.clamp(0.0, 1.0) } else { 0.0 },
        ))
    }

    fn distance(&self, point: DVec3, wall: impl Fn(&Ring) -> &Vec<DVec2>) -> f64 {
        distance_to(&self.contour(point.z, wall), point.truncate())
    }

    /// A wall at a height; empty in a lattice without slices.
    fn contour(&self, z: f64, wall: impl Fn(&Ring) -> &Vec<DVec2>) -> Vec<DVec2> {
        let contour = self.mix(z, |below, above, share| {
            let pairs = wall(below).iter().zip(wall(above));
            pairs.map(|(a, b)| a.lerp(*b, share)).collect()
        });
        contour.unwrap_or_default()
    }
}

fn distance_to(contour: &[DVec2], point: DVec2) -> f64 {
    let next = contour.iter().cycle().skip(1);
    let squared = contour.iter().zip(next).map(|(&a, &b)| squared_distance(point, a, b));
    squared.fold(f64::INFINITY, f64::min).sqrt()
}

/// Hour of a direction in the transverse plane: 12 anterior (-y), 3 patient's left (+x), 6 posterior (+y).
fn clock_hour(direction: DVec2) -> f64 {
    let turn = direction.x.atan2(-direction.y) / TAU;
    // A turn just below 0 rounds up to a whole turn: that is hour 0.
    let hour = turn.rem_euclid(1.0) * 12.0;
    if hour < 12.0 { hour } else { 0.0 }
}

fn squared_distance(point: DVec2, a: DVec2, b: DVec2) -> f64 {
    let along = b - a;
    let share = (point - a).dot(along) / along.length_squared();
    let share = if share.is_finite() { share.clamp(0.0, 1.0) } else { 0.0 };
    point.distance_squared(a + along * share)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_clock_goes_round_as_the_surgeon_sees_it() {
        for (direction, hour) in [
            (DVec2::NEG_Y, 0.0),
            (DVec2::X, 3.0),
            (DVec2::Y, 6.0),
            (DVec2::NEG_X, 9.0),
        ] {
            assert!(
                (clock_hour(direction) - hour).abs() < 1e-12,
                "{direction} {}",
                clock_hour(direction)
            );
        }
        assert!(clock_hour(DVec2::new(-1e-300, -1.0)) < 12.0);
    }

    #[test]
    fn distance_to_a_segment_is_to_its_nearest_point() {
        let (a, b) = (DVec2::ZERO, DVec2::new(4.0, 0.0));
        assert_eq!(squared_distance(DVec2::new(2.0, 3.0), a, b), 9.0);
        assert_eq!(squared_distance(DVec2::new(7.0, 4.0), a, b), 25.0);
        assert_eq!(squared_distance(DVec2::new(3.0, 4.0), a, a), 25.0);
    }
}
