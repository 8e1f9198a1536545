//! What was removed: volumes at rest, by zone and inside the marked region.

use bevy::prelude::*;
use resecta_anatomy::Zone;

use super::StepObservation;

/// Volumes removed so far and what they are shares of.
#[derive(Reflect, Debug, Clone, PartialEq, Default)]
pub struct Removal {
    /// All tissue removed, mm³ at rest.
    pub volume_mm3: f64,
    /// What vaporised of it, mm³ at rest.
    pub vaporised_mm3: f64,
    /// All tissue removed by zone, mm³ at rest, indexed by [`Zone::index`].
    pub by_zone_mm3: [f64; Zone::COUNT],
    /// Removed inside the marked region, mm³ at rest.
    pub marked_mm3: f64,
    /// Volume at rest of the whole marked region, mm³.
    pub marked_total_mm3: f64,
    /// Volume at rest of every zone, mm³, indexed by [`Zone::index`].
    pub zone_total_mm3: [f64; Zone::COUNT],
    /// Density of the tissue, g/mm³.
    pub density_g_per_mm3: f64,
}

impl Removal {
    /// Takes one step into account.
    pub fn observe(&mut self, step: &StepObservation) {
        self.volume_mm3 += step.removed_mm3;
        self.vaporised_mm3 += step.vaporised_mm3;
        for (sum, volume) in self.by_zone_mm3.iter_mut().zip(step.removed_by_zone_mm3) {
            *sum += volume;
        }
        self.marked_mm3 += step.marked_removed_mm3;
    }

    /// Mass removed, g.
    pub fn mass_g(&self) -> f64 {
        self.volume_mm3 * self.density_g_per_mm3
    }

    /// Mass that vaporised, g.
    pub fn vaporised_g(&self) -> f64 {
        self.vaporised_mm3 * self.density_g_per_mm3
    }

    /// Removed from the lateral lobes, mm³.
    pub fn lateral_lobe_mm3(&self) -> f64 {
        self.by_zone_mm3[Zone::LateralLobe.index()]
    }

    /// Removed from the middle lobe, mm³.
    pub fn middle_lobe_mm3(&self) -> f64 {
        self.by_zone_mm3[Zone::MiddleLobe.index()]
    }

    /// Removed between transition zone and capsule, mm³.
    pub fn peripheral_mm3(&self) -> f64 {
        self.by_zone_mm3[Zone::Peripheral.index()]
    }

    /// Removed from tissue of no zone of the prostate, mm³.
    pub fn other_mm3(&self) -> f64 {
        self.by_zone_mm3[Zone::Other.index()]
    }

    /// Removed tissue that is no adenoma, mm³.
    pub fn healthy_mm3(&self) -> f64 {
        sum_of_zones(&self.by_zone_mm3, |zone| !zone.is_adenoma())
    }

    /// Removed share of the adenoma, 0 to 1; 0 for a gland without one.
    pub fn adenoma_share(&self) -> f64 {
        let adenoma = |of: &[f64; Zone::COUNT]| sum_of_zones(of, Zone::is_adenoma);
        share(adenoma(&self.by_zone_mm3), adenoma(&self.zone_total_mm3))
    }

    /// Removed share of a zone, 0 to 1; 0 for one that the gland has nothing of.
    pub fn zone_share(&self, zone: Zone) -> f64 {
        share(self.by_zone_mm3[zone.index()], self.zone_total_mm3[zone.index()])
    }

    /// Removed share of the marked region, 0 to 1; 0 for an empty region.
    pub fn marked_share(&self) -> f64 {
        share(self.marked_mm3, self.marked_total_mm3)
    }

    /// Share of all that was removed that was not marked, 0 to 1; 0 before anything was.
    pub fn unmarked_share(&self) -> f64 {
        share(self.volume_mm3 - self.marked_mm3, self.volume_mm3)
    }
}

fn sum_of_zones(volumes: &[f64; Zone::COUNT], of: impl Fn(Zone) -> bool) -> f64 {
    let zones = Zone::ALL.into_iter().filter(|&zone| of(zone));
    zones.map(|zone| volumes[zone.index()]).sum()
}

/// Sums of the same volumes in another order differ in the last bits: a share never passes 1 for that.
pub(super) fn share(part: f64, whole: f64) -> f64 {
    if whole > 0.0 {
        (part / whole).clamp(0.0, 1.0)
    } else {
        0.0
    }
}
