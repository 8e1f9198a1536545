//! The marked region: which volume elements of a gland an exercise is about.

use std::f64::consts::TAU;

use bevy::math::{DVec2, DVec3};
use resecta_anatomy::{Landmarks, Lattice, wedge};

use crate::exercise::{ClockRange, HeightRange, Marked};

/// The marked pentahedra of one gland and their volume at rest.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct MarkedRegion {
    /// Volume at rest of each pentahedron by index, mm³; 0 outside the region.
    volumes_mm3: Vec<f64>,
    total_mm3: f64,
}

impl MarkedRegion {
    /// A region from the volume at rest of each pentahedron, 0 for those outside.
    pub fn new(volumes_mm3: Vec<f64>) -> Self {
        let total_mm3 = volumes_mm3.iter().sum();
        Self { volumes_mm3, total_mm3 }
    }

    /// The elements of a lattice that meet every condition of `marked`. A height from a landmark that the case lacks
    /// marks nothing; a completed case has both.
    pub fn of_lattice(marked: &Marked, lattice: &Lattice, landmarks: &Landmarks) -> Self {
        let urethra = Urethra::of_lattice(lattice);
        let position = |node: u32| lattice.positions[node as usize];
        let volume = |(index, nodes): (usize, &[u32; 6])| {
            let centroid = wedge::centroid(nodes, position);
            let inside = marked.zones.contains(&lattice.zones[index])
                && marked
                    .height
                    .is_none_or(|height| height.contains(centroid.z, landmarks))
                && marked.clock.is_none_or(|clock| clock.contains(urethra.hour(centroid)))
                && marked
                    .depth_mm
                    .is_none_or(|depth| depth.contains(urethra.depth_mm(centroid)));
            if inside { wedge::volume(nodes, position) } else { 0.0 }
        };
        Self::new(lattice.pentahedra.iter().enumerate().map(volume).collect())
    }

    /// Whether a pentahedron is marked.
    pub fn contains(&self, pentahedron: u32) -> bool {
        self.volume_mm3(pentahedron) > 0.0
    }

    /// Volume at rest of a pentahedron, mm³; 0 for one outside the region.
    pub fn volume_mm3(&self, pentahedron: u32) -> f64 {
        self.volumes_mm3.get(pentahedron as usize).copied().unwrap_or(0.0)
    }

    /// Volume at rest of the whole region, mm³.
    pub fn total_mm3(&self) -> f64 {
        self.total_mm3
    }

    /// The marked pentahedra, ascending.
    pub fn pentahedra(&self) -> impl Iterator<Item = u32> + '_ {
        let marked = self.volumes_mm3.iter().enumerate().filter(|&(_, &volume)| volume > 0.0);
        marked.map(|(index, _)| index as u32)
    }
}

impl ClockRange {
    /// Whether an hour (0 to below 12) lies between `from` and `to`, going clockwise.
    pub fn contains(self, hour: f64) -> bool {
        let from = self.from % 12.0;
        if self.to > from {
            from <= hour && hour < self.to
        } else {
            from <= hour || hour < self.to
        }
    }
}

impl crate::exercise::Range {
    /// Whether a number lies inside.
    pub fn contains(self, value: f64) -> bool {
        self.from <= value && value < self.to
    }
}

impl HeightRange {
    /// Whether a height on the axis (case coordinates, mm) lies inside.
    pub fn contains(self, z_mm: f64, landmarks: &Landmarks) -> bool {
        let (distance_mm, from_mm, to_mm) = match self {
            Self::BelowBladderNeck { from_mm, to_mm } => {
                (landmarks.bladder_neck.map(|neck| neck.z - z_mm), from_mm, to_mm)
            }
            Self::AboveVerumontanum { from_mm, to_mm } => (
                landmarks.verumontanum.map(|verumontanum| z_mm - verumontanum.z),
                from_mm,
                to_mm,
            ),
        };
        distance_mm.is_some_and(|distance_mm| from_mm <= distance_mm && distance_mm < to_mm)
    }
}

/// The urethra of a lattice: its innermost layer, a closed contour a slice.
struct Urethra {
    rings: Vec<Ring>,
}

struct Ring {
    z: f64,
    /// Centre of the lattice's rays.
    centre: DVec2,
    wall: Vec<DVec2>,
}

impl Urethra {
    fn of_lattice(lattice: &Lattice) -> Self {
        let shape = lattice.shape;
        let wall_node = |slice, angle| lattice.positions[shape.index(slice, angle, 0) as usize].truncate();
        let ring = |(slice, centre): (u32, &DVec3)| Ring {
            z: centre.z,
            centre: centre.truncate(),
            wall: (0..shape.angles).map(|angle| wall_node(slice, angle)).collect(),
        };
        Self {
            rings: (0..shape.slices).zip(&lattice.centres).map(ring).collect(),
        }
    }

    /// The two rings that a height lies between, and how far it is from the first to the second (0 to 1).
    fn around(&self, z: f64) -> (&Ring, &Ring, f64) {
        let upper = self
            .rings
            .partition_point(|ring| ring.z <= z)
            .clamp(1, self.rings.len() - 1);
        let (below, above) = (&self.rings[upper - 1], &self.rings[upper]);
        (below, above, ((z - below.z) / (above.z - below.z)).clamp(0.0, 1.0))
    }

    /// Hour on the clock face about the middle of the urethra at the point's height, 0 to below 12.
    fn hour(&self, point: DVec3) -> f64 {
        let (below, above, share) = self.around(point.z);
        clock_hour(point.truncate() - below.centre.lerp(above.centre, share))
    }

    /// Distance from the wall of the urethra in the transverse plane, mm.
    fn depth_mm(&self, point: DVec3) -> f64 {
        let (below, above, share) = self.around(point.z);
        let wall: Vec<DVec2> = below
            .wall
            .iter()
            .zip(&above.wall)
            .map(|(a, b)| a.lerp(*b, share))
            .collect();
        let next = wall.iter().cycle().skip(1);
        let squared = wall
            .iter()
            .zip(next)
            .map(|(&a, &b)| squared_distance(point.truncate(), a, b));
        squared.fold(f64::INFINITY, f64::min).sqrt()
    }
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
    fn a_range_and_its_complement_hold_every_hour_once() {
        for from in 0..=48 {
            for to in (0..=48).filter(|to| (to - from) % 48 != 0) {
                let range = ClockRange {
                    from: f64::from(from) / 4.0,
                    to: f64::from(to) / 4.0,
                };
                let complement = ClockRange {
                    from: range.to,
                    to: range.from,
                };
                for step in 0..1200 {
                    let hour = f64::from(step) / 100.0;
                    assert!(range.contains(hour) != complement.contains(hour), "{range:?} {hour}");
                }
            }
        }
    }

    #[test]
    fn twelve_hours_are_all_hours() {
        let all = ClockRange { from: 0.0, to: 12.0 };
        assert!((0..1200).all(|step| all.contains(f64::from(step) / 100.0)));
    }

    #[test]
    fn distance_to_a_segment_is_to_its_nearest_point() {
        let (a, b) = (DVec2::ZERO, DVec2::new(4.0, 0.0));
        assert_eq!(squared_distance(DVec2::new(2.0, 3.0), a, b), 9.0);
        assert_eq!(squared_distance(DVec2::new(7.0, 4.0), a, b), 25.0);
        assert_eq!(squared_distance(DVec2::new(3.0, 4.0), a, a), 25.0);
    }
}
