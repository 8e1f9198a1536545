//! Where a gland has its vessels.
//!
//! **Arteries** lie in the adenoma (in the whole of a tissue that has none), one a pentahedron at most, drawn with a density that
//! at the hour h of the clock about the urethra (12 anterior, 3 patient's left) is
//!
//! ```text
//! 0.15 + Σ exp(-(h - H)² / 2 σ²)      H = 4, 8 with σ = 0.75 h;  within 8 mm of the bladder neck H = 1, 5, 7, 11, too, σ = 0.5 h
//! ```
//!
//! (large arteries near 4 and 8 o'clock, bleeders of the neck near 5/7 and 1/11; the widths are ours). Diameters are even over a
//! range, rates go as their squares (an opening under one pressure), and are scaled so that all arteries of the adenoma, opened
//! and left alone, lose **15 ml for each g** of it: the mean of 392 patients. Removed at 0.35 to 1.3 g/min that is 5 to 20 ml/min,
//! which is what they lost (5.2 with less than 10 g, 20.3 with more than 80 g). It is an unattended figure here: who coagulates
//! loses less. What is cut near 4 and 8 o'clock alone bleeds more than 15 ml/g, elsewhere less.
//!
//! **Veins** (sinuses) lie within 4 mm of the capsule, drawn evenly by volume: 0.5 for each cm² of capsule, each 6 ml/min against
//! no pressure on the mean, as the square of its diameter. Nobody meets them who stops before the capsule. Numbers are ours.
//!
//! The same tissue, options and seed give the same vessels on every machine up to rounding of elementary functions.

use std::f64::consts::TAU;

use bevy::{math::DVec2, prelude::*};
use resecta_anatomy::random::SplitMix64;
use resecta_solver::{NodeKind, Tissue};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::{
    circulation::LEAST_SHARE,
    refused::{FluidError, check},
    vessels::{Vessel, VesselError, VesselKind, Vessels},
};

/// Arteries anywhere, beside one at the middle of a cluster.
const ANYWHERE: f64 = 0.15;
/// Hours of the clusters all along, and their standard deviation.
const TRUNKS: ([f64; 2], f64) = ([4.0, 8.0], 0.75);
/// The same at the bladder neck.
const NECK: ([f64; 4], f64) = ([1.0, 5.0, 7.0, 11.0], 0.5);
/// g for each mm³ of tissue (convention; 0.98 to 1.05 g/ml were measured).
const GRAMS_PER_MM3: f64 = 1e-3;

/// What a gland's vessels are like. Module docs of `generate.rs` have the rules and the basis of the defaults.
#[derive(Reflect, Serialize, Deserialize, JsonSchema, Debug, Clone, Copy, PartialEq)]
#[serde(deny_unknown_fields, default)]
pub struct VesselOptions {
    /// Arteries for each g of adenoma; 0 to 100. At least one, where it is not 0.
    #[schemars(range(min = 0.0, max = 100.0))]
    pub arteries_per_g: f64,
    /// What they lose in all if nobody closes them, ml for each g of adenoma; 0 to 1,000.
    #[schemars(range(min = 0.0, max = 1000.0))]
    pub blood_ml_per_g: f64,
    /// Their smallest and largest diameter, mm; above 0, to 20, rising.
    pub artery_diameter_mm: [f64; 2],
    /// Time in which a clot lowers an artery's rate to 1/e, s; 1 to 1e9.
    #[schemars(range(min = 1.0, max = 1e9))]
    pub artery_clotting_s: f64,
    /// Height of the bladder neck on the axis, mm; the top of the adenoma where absent.
    pub bladder_neck_z_mm: Option<f64>,
    /// How far from there its arteries lie, mm; 0 to 1,000.
    #[schemars(range(min = 0.0, max = 1000.0))]
    pub neck_mm: f64,
    /// Veins for each cm² of capsule; 0 to 100.
    #[schemars(range(min = 0.0, max = 100.0))]
    pub veins_per_cm2: f64,
    /// Mean rate of a vein that has just been opened, against no pressure, ml/s; 0 to 10.
    #[schemars(range(min = 0.0, max = 10.0))]
    pub vein_rate_ml_per_s: f64,
    /// Their smallest and largest diameter, mm; above 0, to 20, rising.
    pub vein_diameter_mm: [f64; 2],
    /// Time in which a clot lowers a vein's rate to 1/e, s; 1 to 1e9.
    #[schemars(range(min = 1.0, max = 1e9))]
    pub vein_clotting_s: f64,
    /// How far from the capsule veins lie, mm; 0 to 1,000.
    #[schemars(range(min = 0.0, max = 1000.0))]
    pub vein_depth_mm: f64,
}

impl Default for VesselOptions {
    /// 0.8 arteries a gram (32 in an adenoma of 40 g), 0.4 to 1 mm wide, each some 4 ml/min, with 5 minutes to clot.
    fn default() -> Self {
        Self {
            arteries_per_g: 0.8,
            blood_ml_per_g: 15.0,
            artery_diameter_mm: [0.4, 1.0],
            artery_clotting_s: 300.0,
            bladder_neck_z_mm: None,
            neck_mm: 8.0,
            veins_per_cm2: 0.5,
            vein_rate_ml_per_s: 0.1,
            vein_diameter_mm: [1.0, 3.0],
            vein_clotting_s: 300.0,
            vein_depth_mm: 4.0,
        }
    }
}

impl VesselOptions {
    fn check(&self) -> Result<(), FluidError> {
        let diameters = |field, [least, most]: [f64; 2]| {
            let expected = "two numbers above 0, to 20 mm, rising";
            check(field, least, 1e-6..=20.0, expected)?;
            check(field, most, least..=20.0, expected)
        };
        check("arteries_per_g", self.arteries_per_g, 0.0..=100.0, "0 to 100 a g")?;
        check("blood_ml_per_g", self.blood_ml_per_g, 0.0..=1e3, "0 to 1,000 ml a g")?;
        diameters("artery_diameter_mm", self.artery_diameter_mm)?;
        check("artery_clotting_s", self.artery_clotting_s, 1.0..=1e9, "1 to 1e9 s")?;
        if let Some(z_mm) = self.bladder_neck_z_mm {
            check("bladder_neck_z_mm", z_mm, -1e4..=1e4, "within 10 m")?;
        }
        check("neck_mm", self.neck_mm, 0.0..=1e3, "0 to 1,000 mm")?;
        check("veins_per_cm2", self.veins_per_cm2, 0.0..=100.0, "0 to 100 a cm²")?;
        check(
            "vein_rate_ml_per_s",
            self.vein_rate_ml_per_s,
            0.0..=10.0,
            "0 to 10 ml/s",
        )?;
        diameters("vein_diameter_mm", self.vein_diameter_mm)?;
        check("vein_clotting_s", self.vein_clotting_s, 1.0..=1e9, "1 to 1e9 s")?;
        check("vein_depth_mm", self.vein_depth_mm, 0.0..=1e3, "0 to 1,000 mm")
    }
}

impl Vessels {
    /// Plausible vessels of a gland at rest, whose axes are those of a case: +x patient's left, +y posterior, +z towards the
    /// bladder.
    ///
    /// # Errors
    /// [`VesselError`]: an option out of its range, or more vessels than pentahedra to carry them.
    pub fn generate(tissue: &Tissue, options: &VesselOptions, seed: u64) -> Result<Vessels, VesselError> {
        options.check()?;
        let mut random = SplitMix64::new(seed);
        let gland = Gland::new(tissue);
        let mut vessels = gland.arteries(options, &mut random)?;
        vessels.extend(gland.veins(options, &mut random)?);
        Vessels::new(vessels)
    }
}

/// A gland at rest.
struct Gland<'a> {
    tissue: &'a Tissue,
    lumen: Vec<Vec3>,
}

impl Gland<'_> {
    fn new(tissue: &Tissue) -> Gland<'_> {
        let nodes = || (0..tissue.node_count() as u32).filter(|&node| tissue.is_node_alive(node));
        let place = |node| tissue.rest_position(node);
        let is_lumen = |&node: &u32| tissue.node_kind(node) == NodeKind::Mucosa;
        let mut lumen: Vec<Vec3> = nodes().filter(is_lumen).map(place).collect();
        if lumen.is_empty() {
            lumen = nodes().map(place).collect();
        }
        Gland { tissue, lumen }
    }

    fn arteries(&self, options: &VesselOptions, random: &mut SplitMix64) -> Result<Vec<Vessel>, VesselError> {
        let living = || self.tissue.living_pentahedron_indices();
        let is_adenoma = |&index: &u32| self.tissue.pentahedron_zone(index).is_adenoma();
        let mut places: Vec<u32> = living().filter(is_adenoma).collect();
        if places.is_empty() {
            places = living().collect();
        }
        let volume_mm3 = |index: u32| self.tissue.rest_volume_mm3(index);
        let mass_g = places.iter().map(|&index| volume_mm3(index)).sum::<f64>() * GRAMS_PER_MM3;
        let height = |index: u32| f64::from(self.tissue.rest_centroid(index).z);
        let top = places
            .iter()
            .map(|&index| height(index))
            .fold(f64::NEG_INFINITY, f64::max);
        let neck = options.bladder_neck_z_mm.unwrap_or(top);
        let weight = |&index: &u32| {
            let is_neck = (height(index) - neck).abs() <= options.neck_mm;
            volume_mm3(index) * density(self.hour(index), is_neck)
        };
        let weights: Vec<f64> = places.iter().map(weight).collect();
        let wanted = match options.arteries_per_g * mass_g {
            0.0 => 0,
            wanted => (wanted.round() as usize).max(1),
        };
        let drawn = draw(&places, weights, wanted, random)?;
        let mut arteries: Vec<Vessel> = drawn
            .into_iter()
            .map(|index| {
                let diameter_mm = random.between(options.artery_diameter_mm);
                self.vessel(index, VesselKind::Arterial, diameter_mm, options.artery_clotting_s)
            })
            .collect();
        let all: f64 = arteries.iter().map(|vessel| vessel.rate_ml_per_s).sum();
        let rate = options.blood_ml_per_g * mass_g / (options.artery_clotting_s * (1.0 - LEAST_SHARE));
        arteries
            .iter_mut()
            .for_each(|vessel| vessel.rate_ml_per_s *= rate / all);
        Ok(arteries)
    }

    fn veins(&self, options: &VesselOptions, random: &mut SplitMix64) -> Result<Vec<Vessel>, VesselError> {
        let nodes = 0..self.tissue.node_count() as u32;
        let capsule: Vec<Vec3> = nodes
            .filter(|&node| self.tissue.is_node_alive(node) && self.tissue.node_kind(node) == NodeKind::Capsule)
            .map(|node| self.tissue.rest_position(node))
            .collect();
        let squared = (options.vein_depth_mm * options.vein_depth_mm) as f32;
        let is_near = |&index: &u32| {
            let centroid = self.tissue.rest_centroid(index);
            capsule.iter().any(|place| place.distance_squared(centroid) <= squared)
        };
        let places: Vec<u32> = self.tissue.living_pentahedron_indices().filter(is_near).collect();
        let area_mm2 = |index| f64::from(self.tissue.capsule_area_mm2(index));
        let area_cm2 = self.tissue.living_pentahedron_indices().map(area_mm2).sum::<f64>() / 100.0;
        let weights = places.iter().map(|&index| self.tissue.rest_volume_mm3(index)).collect();
        let wanted = (options.veins_per_cm2 * area_cm2).round() as usize;
        let drawn = draw(&places, weights, wanted, random)?;
        let mut veins: Vec<Vessel> = drawn
            .into_iter()
            .map(|index| {
                let diameter_mm = random.between(options.vein_diameter_mm);
                self.vessel(index, VesselKind::Venous, diameter_mm, options.vein_clotting_s)
            })
            .collect();
        let mean = veins.iter().map(|vessel| vessel.rate_ml_per_s).sum::<f64>() / veins.len().max(1) as f64;
        let rate = options.vein_rate_ml_per_s;
        veins.iter_mut().for_each(|vessel| vessel.rate_ml_per_s *= rate / mean);
        Ok(veins)
    }

    /// A vessel in the middle of a pentahedron, towards the urethra, its rate the square of its diameter.
    fn vessel(&self, pentahedron: u32, kind: VesselKind, diameter_mm: f64, clotting_s: f64) -> Vessel {
        let place = self.tissue.rest_centroid(pentahedron);
        let inwards = -self.urethra_to(pentahedron).as_vec2();
        Vessel {
            pentahedron,
            place,
            direction: inwards.extend(0.0).normalize_or(Vec3::Z),
            kind,
            diameter_mm: diameter_mm as f32,
            rate_ml_per_s: diameter_mm * diameter_mm,
            clotting_s,
        }
    }

    /// From the middle of the urethra at its height to a pentahedron, in the transverse plane.
    fn urethra_to(&self, pentahedron: u32) -> DVec2 {
        let place = self.tissue.rest_centroid(pentahedron);
        let mut sum = (DVec2::ZERO, 0.0);
        let mut all = DVec2::ZERO;
        for node in &self.lumen {
            let away = f64::from((node.z - place.z) / self.tissue.mean_length_mm());
            let weight = (-away * away).exp();
            let here = node.truncate().as_dvec2();
            sum.0 += here * weight;
            sum.1 += weight;
            all += here;
        }
        // Far above or below all of it the whole urethra serves.
        let middle = if sum.1 > 1e-9 {
            sum.0 / sum.1
        } else {
            all / self.lumen.len() as f64
        };
        place.truncate().as_dvec2() - middle
    }

    /// Hour of the clock about the urethra, 0 to 12.
    fn hour(&self, pentahedron: u32) -> f64 {
        let from = self.urethra_to(pentahedron);
        (from.x.atan2(-from.y) / TAU).rem_euclid(1.0) * 12.0
    }
}

/// Arteries at an hour, beside one at the middle of a cluster.
fn density(hour: f64, is_neck: bool) -> f64 {
    let cluster = |middle: f64, width: f64| {
        let away = (hour - middle + 6.0).rem_euclid(12.0) - 6.0;
        (-0.5 * (away / width).powi(2)).exp()
    };
    let trunks: f64 = TRUNKS.0.iter().map(|&middle| cluster(middle, TRUNKS.1)).sum();
    let neck: f64 = NECK.0.iter().map(|&middle| cluster(middle, NECK.1)).sum();
    ANYWHERE + trunks + if is_neck { neck } else { 0.0 }
}

/// So many different places, drawn by their weights.
fn draw(
    places: &[u32],
    mut weights: Vec<f64>,
    wanted: usize,
    random: &mut SplitMix64,
) -> Result<Vec<u32>, VesselError> {
    // Beyond half of them they are no places of their own any more.
    if 2 * wanted > places.len() {
        return Err(VesselError::TooMany {
            wanted,
            places: places.len(),
        });
    }
    let mut drawn = Vec::with_capacity(wanted);
    while drawn.len() < wanted {
        let mut at = random.unit() * weights.iter().sum::<f64>();
        let found = weights.iter().position(|&weight| {
            at -= weight;
            at < 0.0
        });
        // Rounding can leave a draw past the last one: another is drawn.
        if let Some(found) = found {
            weights[found] = 0.0;
            drawn.push(places[found]);
        }
    }
    Ok(drawn)
}
