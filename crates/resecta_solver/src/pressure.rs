//! With which pressure a pentahedron holds its volume.
//!
//! A lattice of springs has the Poisson's ratio that Cauchy's relations leave it (`docs/materials.md`). With the term a
//! pentahedron of rest volume V0 and volume V has, beside its springs, the energy
//!
//! ```text
//! K V0 (J - 1)² / 2           for J = V / V0 from -1 to 1
//! K V0 (J - 1 - ln J)         above
//! K V0 (1 - J + ln -J)        below
//! ```
//!
//! with the bulk stiffness K: it presses on its corners with the pressure `p = K (1 - J) / max(|J|, 1)`, force `p dV/dx`.
//! One turned inside out is pressed back with K to 2 K however far it is, one blown up pulls with K at most: were they
//! to go on like a square, tissue that starts at random places would ask for steps that cannot be made.
//!
//! # The barrier
//!
//! That alone does not keep a pentahedron upright that a tool squeezes. One of less than [`SQUEEZED`] of its volume presses
//! with more, by t = [`SQUEEZED`] - J and B = [`STIFFENING`]:
//!
//! ```text
//! K B t² / (2 SQUEEZED)        until it has no volume
//! K B (t - SQUEEZED / 2)       until it is inside out by SQUEEZED; the pressure there goes for all beyond
//! ```
//!
//! Continuous, with a continuous slope that rises to B K where there is no volume left: the bound of a substep follows from
//! the slope, and one that jumped would outrun it within a step. Measured over the first minute of the medium operation (7,400
//! pentahedra): without it up to 5 are inside out, one of them for 0.5 s; with it up to 3, none for longer than 0.05 s, for 29
//! substeps a step instead of 23. With B = 15 and a slope that jumps the tissue came apart.

use glam::DVec3;
use resecta_anatomy::wedge;

use crate::tissue::Tissue;

/// Below this share of its volume at rest a pentahedron counts as squeezed.
pub(crate) const SQUEEZED: f32 = 0.5;

/// Slope of the barrier where there is no volume left, over K.
pub(crate) const STIFFENING: f32 = 8.0;

/// Pressure over bulk stiffness of a pentahedron whose volume is `ratio` times that at rest.
pub(crate) fn pressure_over_stiffness(ratio: f64) -> f64 {
    let (squeezed, stiffening) = (f64::from(SQUEEZED), f64::from(STIFFENING));
    let below = (squeezed - ratio).clamp(0.0, 2.0 * squeezed);
    let upright = below.min(squeezed);
    let barrier = stiffening * (0.5 * upright * upright / squeezed + (below - upright));
    (1.0 - ratio) / ratio.abs().max(1.0) + barrier
}

/// Its energy over bulk stiffness and rest volume.
pub(crate) fn energy_over_stiffness(ratio: f64) -> f64 {
    let of_volume = if ratio > 1.0 {
        ratio - 1.0 - ratio.ln()
    } else if ratio < -1.0 {
        1.0 - ratio + (-ratio).ln()
    } else {
        0.5 * (ratio - 1.0) * (ratio - 1.0)
    };
    of_volume + barrier_over_stiffness(ratio)
}

/// What the barrier adds to that.
fn barrier_over_stiffness(ratio: f64) -> f64 {
    let (squeezed, stiffening) = (f64::from(SQUEEZED), f64::from(STIFFENING));
    let below = (squeezed - ratio).max(0.0);
    let upright = below.min(squeezed);
    let inverted = (below - upright).min(squeezed);
    let beyond = below - upright - inverted;
    let energy = upright.powi(3) / (6.0 * squeezed) + 0.5 * inverted * (squeezed + inverted) + 1.5 * squeezed * beyond;
    stiffening * energy
}

impl Tissue {
    /// Whether pentahedra hold their volume: whether the material has a [`crate::Material::poisson_ratio`] that asks for it.
    pub fn holds_volume(&self) -> bool {
        self.volumes.is_some()
    }

    /// Pressure with which a pentahedron holds its volume, Pa; negative where it is larger than at rest. 0 in a tissue
    /// whose material has no [`crate::Material::poisson_ratio`], and where it has been removed.
    pub fn pressure_pa(&self, pentahedron: u32) -> f64 {
        let ratio = self.volume_of(pentahedron) / self.rest_volume_mm3(pentahedron);
        self.volume_stiffness_pa(pentahedron) * pressure_over_stiffness(ratio)
    }

    /// Bulk stiffness of a pentahedron by what it holds, Pa; 0 where there is none.
    pub(crate) fn volume_stiffness_pa(&self, pentahedron: u32) -> f64 {
        let volumes = self.volumes.as_ref();
        volumes.map_or(0.0, |volumes| {
            volumes.stiffness_pa(pentahedron) * self.fill(pentahedron)
        })
    }

    /// Forces of the pentahedra with the nodes at some places, added to a force a node, µN: in double precision, by the
    /// gradients of `wedge`.
    pub(crate) fn add_volume_forces(&self, positions: &[DVec3], forces: &mut [DVec3]) {
        if self.volumes.is_none() {
            return;
        }
        let position = |node: u32| positions[node as usize];
        for pentahedron in self.living_pentahedron_indices() {
            let nodes = self.pentahedron_nodes(pentahedron);
            let ratio = wedge::volume(&nodes, position) / self.rest_volume_mm3(pentahedron);
            let pressure = self.volume_stiffness_pa(pentahedron) * pressure_over_stiffness(ratio);
            for (node, gradient) in nodes.into_iter().zip(wedge::gradients(&nodes, position)) {
                forces[node as usize] += pressure * gradient;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pressure_is_what_energy_falls_by() {
        for n in -400..400 {
            let ratio = 0.01 * f64::from(n);
            let fall = energy_over_stiffness(ratio - 1e-5) - energy_over_stiffness(ratio + 1e-5);
            let pressure = pressure_over_stiffness(ratio);
            assert!((fall / 2e-5 - pressure).abs() < 1e-4, "{ratio}: {fall}, {pressure}");
        }
    }
}
