//! What a tissue is made of: modulus, density, viscosity, how its lattice resists shear and how it holds its volume.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// How the lattice resists shear. Six-neighbour springs alone are a mechanism: they have no first-order resistance to
/// shear, and any compressed family of them buckles at once.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
pub enum ShearResistance {
    /// None: the lattice of the papers as it stands.
    None,
    /// Springs at rest are stretched by this strain (0 to 0.2; 0.02 to 0.05 is usual). Loads on the nodes balance the
    /// tension in the shape as drawn, so that shape is the one at rest.
    PreTension(f32),
    /// Springs along the face diagonals of the cells.
    Diagonals,
}

/// The material of a tissue. Presets are named after their source: published figures differ by 3 to 10 times.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Material {
    /// Young's modulus, Pa; above 0.
    pub modulus_pa: f64,
    /// Poisson's ratio: by how much of a stretch the tissue gets narrower. None leaves it to the springs, which gives 1/4
    /// with diagonals and 0 without, and costs nothing.
    ///
    /// With a number every pentahedron holds its volume besides and resists turning inside out (`pressure.rs`). From 0.25 to
    /// 0.49 with diagonals; from 0 to 0.49 without, where it is the ratio, and `modulus_pa` the modulus, of a stretch along
    /// the springs, and resistance to shear stays what it is (without tension, springs across a stretch then buckle). Soft
    /// tissue is mostly water, which makes 0.45 to 0.49. Steps get shorter as it rises, to a fifth at 0.49:
    /// `docs/materials.md` has errors and costs.
    #[serde(default)]
    pub poisson_ratio: Option<f64>,
    /// Density, g/mm³; above 0. Water is 0.001.
    pub density_g_per_mm3: f64,
    /// Viscosity, Pa·s; 0 or more. See [`Material::damping_rate`] for how it damps a node.
    pub viscosity_pa_s: f64,
    /// Stiffness of the bed that holds the capsule, Pa per mm of displacement; 0 or more, 0 leaves it free.
    pub support_pa_per_mm: f64,
    /// How the lattice resists shear.
    pub shear: ShearResistance,
}

/// Density of prostate tissue by convention, g/mm³ (measured 0.98 to 1.05 g/ml).
const DENSITY: f64 = 1.0e-3;

/// Largest Poisson's ratio. Bulk stiffness grows without limit towards 1/2.
const LARGEST_RATIO: f64 = 0.49;

/// Poisson's ratio of springs with diagonals, by Cauchy's relations.
const RATIO_OF_DIAGONALS: f64 = 0.25;

/// Stiffness of the capsule's bed: pelvic fat of some 5 kPa, some 10 mm deep.
const SUPPORT: f64 = 500.0;

impl Material {
    /// Name and material of every preset.
    pub const PRESETS: [(&'static str, Material); 5] = [
        // Instrumented palpation in vivo at 5 Hz: 4.61 kPa at a lag of 18.6 ms, which makes 81 Pa·s.
        (
            "palpation_5hz",
            Material::soft(4_610.0, 81.0, ShearResistance::Diagonals),
        ),
        // The same study, static.
        (
            "palpation_static",
            Material::soft(24_800.0, 81.0, ShearResistance::Diagonals),
        ),
        // Benign tissue ex vivo, Urology 2010;76:1007: 17.0 ± 9.0 kPa. Viscosity from the palpation study.
        ("ex_vivo", Material::soft(17_000.0, 81.0, ShearResistance::Diagonals)),
        // MR elastography of BPH, Egypt J Radiol Nucl Med 2021: shear modulus 4.40 ± 0.71 kPa, tripled to Young's.
        (
            "mr_elastography",
            Material::soft(13_200.0, 81.0, ShearResistance::Diagonals),
        ),
        // The lattice as the papers have it, six neighbours a node; the palpation figures.
        ("papers_lattice", Material::soft(4_610.0, 81.0, ShearResistance::None)),
    ];

    const fn soft(modulus_pa: f64, viscosity_pa_s: f64, shear: ShearResistance) -> Material {
        Material {
            modulus_pa,
            poisson_ratio: None,
            density_g_per_mm3: DENSITY,
            viscosity_pa_s,
            support_pa_per_mm: SUPPORT,
            shear,
        }
    }

    /// The preset of that name, if there is one.
    pub fn preset(name: &str) -> Option<Material> {
        let found = Self::PRESETS.iter().find(|(preset, _)| *preset == name);
        found.map(|(_, material)| material.clone())
    }

    /// The names of all presets.
    pub fn preset_names() -> impl Iterator<Item = &'static str> {
        Self::PRESETS.iter().map(|(name, _)| *name)
    }

    /// Damping over mass of every node, 1/s, in a tissue of that volume (mm³).
    ///
    /// Equation (1) damps a node against a resting medium, while viscosity is measured as a loss inside the tissue. The
    /// rate is chosen so that the slowest mode of the organ, a quarter wave over the depth H from its middle to its
    /// surface, loses as much as viscosity η would take from it: rate = η (π / 2H)² / density. H is half the cube root
    /// of the volume.
    pub fn damping_rate(&self, volume_mm3: f64) -> f64 {
        let depth = 0.5 * volume_mm3.cbrt();
        let wave_number = std::f64::consts::PI / (2.0 * depth);
        self.viscosity_pa_s * wave_number * wave_number / self.density_g_per_mm3
    }

    /// Poisson's ratio of the springs alone.
    fn least_ratio(&self) -> f64 {
        match self.shear {
            ShearResistance::Diagonals => RATIO_OF_DIAGONALS,
            ShearResistance::None | ShearResistance::PreTension(_) => 0.0,
        }
    }

    /// Modulus that the springs are to have and bulk stiffness of the volume terms, Pa, which together have
    /// [`Material::modulus_pa`] and [`Material::poisson_ratio`]; no bulk stiffness where the springs have these by
    /// themselves.
    ///
    /// Springs with diagonals have λ = μ and bring μ, volume terms the rest of λ. Those without have a ratio of 0: beside a
    /// bulk stiffness K their modulus E_s becomes E_s (E_s + 3 K) / (E_s + 2 K) and the ratio K / (E_s + 2 K), so that E_s is
    /// 2 μ and K is λ.
    pub(crate) fn moduli_pa(&self) -> (f64, Option<f64>) {
        let least = self.least_ratio();
        let Some(ratio) = self.poisson_ratio.filter(|&ratio| ratio > least) else {
            return (self.modulus_pa, None);
        };
        let shear_modulus = self.modulus_pa / (2.0 * (1.0 + ratio));
        let lambda = 2.0 * shear_modulus * ratio / (1.0 - 2.0 * ratio);
        if least > 0.0 {
            (2.0 * (1.0 + least) * shear_modulus, Some(lambda - shear_modulus))
        } else {
            (2.0 * shear_modulus, Some(lambda))
        }
    }

    /// The first field out of its range: its name, its value and what was expected.
    pub fn out_of_range(&self) -> Option<(&'static str, f64, &'static str)> {
        let positive = |value: f64| value.is_finite() && value > 0.0;
        let not_negative = |value: f64| value.is_finite() && value >= 0.0;
        if !positive(self.modulus_pa) {
            return Some(("modulus_pa", self.modulus_pa, "a finite number above 0"));
        }
        if !positive(self.density_g_per_mm3) {
            return Some(("density_g_per_mm3", self.density_g_per_mm3, "a finite number above 0"));
        }
        if !not_negative(self.viscosity_pa_s) {
            return Some(("viscosity_pa_s", self.viscosity_pa_s, "a finite number, 0 or more"));
        }
        if !not_negative(self.support_pa_per_mm) {
            return Some((
                "support_pa_per_mm",
                self.support_pa_per_mm,
                "a finite number, 0 or more",
            ));
        }
        let least_ratio = self.least_ratio();
        if let Some(ratio) = self.poisson_ratio
            && !(least_ratio..=LARGEST_RATIO).contains(&ratio)
        {
            let expected = if least_ratio > 0.0 {
                "0.25 to 0.49 with diagonals"
            } else {
                "0 to 0.49"
            };
            return Some(("poisson_ratio", ratio, expected));
        }
        match self.shear {
            ShearResistance::PreTension(strain) if !(0.0..=0.2).contains(&strain) => {
                Some(("shear.PreTension", strain.into(), "a strain from 0 to 0.2"))
            }
            _ => None,
        }
    }
}

impl Default for Material {
    /// The preset `palpation_5hz`.
    fn default() -> Self {
        let (_, material) = &Self::PRESETS[0];
        material.clone()
    }
}
