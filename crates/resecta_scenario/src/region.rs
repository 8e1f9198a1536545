//! The marked region: which volume elements of a gland an exercise is about.

use std::collections::BTreeMap;

use resecta_anatomy::{Landmarks, Lattice, Zone, wedge};

use crate::{
    exercise::{ClockRange, HeightRange, Marked},
    walls::Walls,
};

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
        let walls = Walls::of_lattice(lattice, landmarks.bladder_neck.map(|neck| neck.z));
        let position = |node: u32| lattice.positions[node as usize];
        let volume = |(index, nodes): (usize, &[u32; 6])| {
            let centroid = wedge::centroid(nodes, position);
            let inside = marked.zones.contains(&lattice.zones[index])
                && marked
                    .height
                    .is_none_or(|height| height.contains(centroid.z, landmarks))
                && marked.clock.is_none_or(|clock| clock.contains(walls.hour(centroid)))
                && marked
                    .depth_mm
                    .is_none_or(|depth| depth.contains(walls.depth_mm(centroid)));
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

    /// The region without what of it is gone: volumes at rest by pentahedron, mm³.
    pub(crate) fn without(mut self, gone_mm3: &BTreeMap<u32, f64>) -> Self {
        for (&pentahedron, gone) in gone_mm3 {
            if let Some(volume) = self.volumes_mm3.get_mut(pentahedron as usize) {
                *volume = (*volume - gone).max(0.0);
            }
        }
        Self::new(self.volumes_mm3)
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

impl Marked {
    /// All tissue below the verumontanum.
    pub(crate) fn below_verumontanum() -> Self {
        Self {
            zones: Zone::ALL.to_vec(),
            clock: None,
            height: Some(HeightRange::AboveVerumontanum {
                from_mm: f64::NEG_INFINITY,
                to_mm: 0.0,
            }),
            depth_mm: None,
            dyed: false,
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

    /// Its ends on the axis (case coordinates, mm), the one nearer to the apex first; none without the landmark.
    pub(crate) fn ends_mm(self, landmarks: &Landmarks) -> Option<(f64, f64)> {
        Some(match self {
            Self::BelowBladderNeck { from_mm, to_mm } => {
                let neck = landmarks.bladder_neck?;
                (neck.z - to_mm, neck.z - from_mm)
            }
            Self::AboveVerumontanum { from_mm, to_mm } => {
                let verumontanum = landmarks.verumontanum?;
                (verumontanum.z + from_mm, verumontanum.z + to_mm)
            }
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

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
}
