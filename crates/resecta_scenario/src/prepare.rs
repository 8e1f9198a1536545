//! From a loaded exercise to everything that will be spawned. All that can fail fails here, before the world is touched.

use std::collections::BTreeMap;

use bevy::prelude::*;
use resecta_anatomy::{Case, Lattice, LatticeOptions, Zone};
use resecta_fluid::PA_PER_CMH2O;
use resecta_instrument::{InstrumentState, Resectoscope};
use resecta_solver::{Effort, Material, ShearResistance, TissueMesh};
use resecta_tissue::{CutDetail, Tissue};
use serde::Serialize;

use crate::{
    admit, anchor,
    chips::{self, PreparedChips},
    errors::{ExerciseError, RuleError},
    exercise::{InstrumentSetup, Marked},
    false_passage,
    library::LoadedExercise,
    reach,
    region::MarkedRegion,
    rules,
    walls::Walls,
    water::PreparedWater,
};

/// An exercise ready to be spawned: the gland built, the region marked, the instrument placed.
pub struct PreparedExercise {
    /// What it was prepared from.
    pub loaded: LoadedExercise,
    /// The gland's lattice in numbers.
    pub lattice: LatticeSummary,
    /// The marked tissue.
    pub marked: MarkedRegion,
    /// The tissue below the verumontanum.
    pub distal: MarkedRegion,
    /// What each pentahedron had lost before the start, mm³ at rest; others nothing.
    pub gone_mm3: BTreeMap<u32, f64>,
    /// Urethra and capsule at rest.
    pub walls: Walls,
    /// Volume at rest of every zone at the start, mm³, indexed by [`Zone::index`].
    pub zone_mm3: [f64; Zone::COUNT],
    /// Area at rest of the whole capsule, mm².
    pub capsule_mm2: f64,
    /// Name of the material preset.
    pub material_name: String,
    /// The material, with the exercise's own resistance to shear.
    pub material: Material,
    /// The gland, as far as it is cut already.
    pub tissue: Tissue,
    /// The instrument.
    pub resectoscope: Resectoscope,
    /// Where it starts.
    pub start: InstrumentState,
    /// Its blood and water.
    pub(crate) water: Option<PreparedWater>,
    /// Its floating chips.
    pub(crate) chips: Option<PreparedChips>,
}

/// A lattice in numbers.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize)]
pub struct LatticeSummary {
    /// Angle between rays, degrees: the one asked for, made to divide the circle.
    pub angle_deg: f64,
    /// Mean segment length, mm.
    pub segment_mm: f64,
    /// Number of nodes.
    pub nodes: usize,
    /// Number of springs, with those that resist shear.
    pub springs: usize,
    /// Number of pentahedra.
    pub pentahedra: usize,
    /// Volume at rest, mm³.
    pub volume_mm3: f64,
}

impl LoadedExercise {
    /// Builds gland, marks and instrument. Takes a second or so; safe on another thread.
    ///
    /// # Errors
    /// [`ExerciseError`]: a case that gives no lattice or no tissue, an instrument that cannot be placed, marks that
    /// select nothing.
    pub fn prepare(self) -> Result<PreparedExercise, ExerciseError> {
        let broken = |rule: RuleError| ExerciseError::Rule {
            file: self.file.clone(),
            rule: rule.into(),
        };
        let options = LatticeOptions {
            alpha_deg: self.exercise.alpha_deg,
            ..default()
        };
        let lattice = Lattice::build(&self.case, &options).map_err(|source| ExerciseError::Lattice {
            file: self.file.clone(),
            place: None,
            source,
        })?;

        let neck_z = self.case.landmarks.bladder_neck.map(|neck| neck.z);
        let walls = Walls::of_lattice(&lattice, neck_z);
        let marked = MarkedRegion::of_lattice(&self.exercise.marked, &lattice, &self.case.landmarks);
        if marked.total_mm3() <= 0.0 {
            let expected = "a region with tissue in it: widen zones, clock, height or depth";
            return Err(broken(RuleError::new("marked", "empty on this gland", expected)));
        }

        for (index, step) in self.exercise.steps.iter().enumerate() {
            let lacked = (step.until.landmark()).filter(|landmark| landmark.place(&self.case).is_none());
            if let Some(landmark) = lacked {
                let field = format!("steps[{index}].until.{}.landmark", step.until.parts().0);
                return Err(broken(RuleError::new(
                    field,
                    landmark.name(),
                    "a landmark that the case has",
                )));
            }
        }

        let material_name = self
            .exercise
            .material
            .clone()
            .unwrap_or_else(|| self.case.material.clone());
        let mut material = Material::preset(&material_name).ok_or_else(|| {
            let field = format!("material of case \"{}\"", self.case.name);
            broken(RuleError::unknown_name(
                field,
                &material_name,
                "a material preset",
                Material::preset_names(),
            ))
        })?;
        let models = &self.exercise.models;
        material.shear = models.shear.unwrap_or(material.shear);
        material.poisson_ratio = models
            .poisson_ratio
            .or(material.poisson_ratio)
            .or(tissues_ratio(&material));
        rules::of_material(&material).map_err(broken)?;
        let mut mesh = TissueMesh::from_lattice(&lattice, material.shear);
        if let Some(neck_z) = neck_z {
            mesh.end_capsule_at(neck_z);
        }
        let mut tissue = resecta_solver::Tissue::new(&mesh, &material).map_err(|source| ExerciseError::Tissue {
            file: self.file.clone(),
            place: None,
            source,
        })?;
        tissue.set_effort(Effort::fast(material.modulus_pa));
        tissue
            .set_mobility(Some(anchor::mobility(&self.case)))
            .map_err(|refused| {
                broken(RuleError::new(
                    "landmarks.external_sphincter",
                    refused,
                    "a place near the gland",
                ))
            })?;
        let mut gland = Tissue::new(tissue);
        let gone_mm3 = match &self.exercise.begun {
            Some(begun) => begun
                .cut(&mut gland, models, &walls, &self.case.landmarks)
                .map_err(broken)?,
            None => BTreeMap::new(),
        };
        let marked = marked.without(&gone_mm3);
        if marked.total_mm3() <= 0.0 {
            let expected = "a region of which the trenches of `begun` leave something";
            return Err(broken(RuleError::new("marked", "cut away at the start", expected)));
        }
        let tissue = gland.solver();

        let capsule_mm2 = (0..tissue.pentahedron_count() as u32).map(|index| f64::from(tissue.capsule_area_mm2(index)));
        let capsule_mm2 = capsule_mm2.sum();
        let mut zone_mm3 = [0.0; Zone::COUNT];
        for index in 0..tissue.pentahedron_count() as u32 {
            zone_mm3[tissue.pentahedron_zone(index).index()] += tissue.rest_volume_mm3(index);
        }
        for (&index, gone) in &gone_mm3 {
            zone_mm3[tissue.pentahedron_zone(index).index()] -= gone;
        }
        let mass_g = zone_mm3.iter().sum::<f64>() * material.density_g_per_mm3;
        reach::check_on_gland(&self.exercise, mass_g, &zone_mm3).map_err(broken)?;

        let mut resectoscope = place(&self.exercise.instrument, &self.case).map_err(broken)?;
        resectoscope.holds_n = false_passage::holds_n(material.modulus_pa, resectoscope.geometry.sheath_diameter_mm);
        let start = match self.exercise.instrument.start {
            Some(start) => start,
            None => beside_verumontanum(&resectoscope, &self.case),
        };
        let water = models.water.as_ref().map(|water| water.prepare(tissue));
        let mut water = water.transpose().map_err(broken)?;
        if let (Some(water), Some(begun)) = (&mut water, &self.exercise.begun) {
            water.begin(begun, tissue).map_err(broken)?;
        }
        let start = water.as_ref().map_or(start, |water| water.with_taps(start));
        if let CutDetail::Field { spacing_mm } = models.detail {
            // If the gland cannot be cut so finely, the plugin reports it in the first step.
            gland.refine(spacing_mm).ok();
        }
        let pressure_cmh2o = models.water_pressure_cmh2o;
        let constant_pa = pressure_cmh2o.map_or(0.0, |pressure| pressure * PA_PER_CMH2O);
        let pressure_pa = water.as_ref().map_or(constant_pa, PreparedWater::pressure_pa);
        gland
            .solver_mut()
            .set_water_pressure_pa(pressure_pa as f32)
            .map_err(|error| broken(RuleError::new("models.water", "unusable", error.to_string())))?;
        let way = admit::way_in(&walls, &resectoscope, &start);
        gland
            .make_room(&way, admit::STEP)
            .map_err(|error| broken(RuleError::new("instrument.start", "unusable", error.to_string())))?;
        let tissue = gland.solver();
        let density = material.density_g_per_mm3;
        let floating = (models.chips).map(|settings| chips::prepare(settings, &self.case, &resectoscope, density));
        let floating = floating.transpose().map_err(broken)?;
        Ok(PreparedExercise {
            lattice: LatticeSummary {
                angle_deg: lattice.angle_deg,
                segment_mm: lattice.segment_mm,
                nodes: tissue.node_count(),
                springs: tissue.spring_count(),
                pentahedra: tissue.pentahedron_count(),
                volume_mm3: tissue.initial_volume_mm3(),
            },
            zone_mm3,
            capsule_mm2,
            distal: MarkedRegion::of_lattice(&Marked::below_verumontanum(), &lattice, &self.case.landmarks),
            gone_mm3,
            walls,
            marked,
            material_name,
            material,
            tissue: gland,
            resectoscope,
            start,
            water,
            chips: floating,
            loaded: self,
        })
    }
}

/// Poisson's ratio of a material that has none of its own: tissue is mostly water. A lattice without diagonals, as the papers have it,
/// stays as it is.
fn tissues_ratio(material: &Material) -> Option<f64> {
    (material.shear == ShearResistance::Diagonals).then_some(TISSUES_RATIO)
}

/// Soft tissue is nearly incompressible, 0.45 to 0.49. With the lower one no more than a few elements in ten thousand turn inside out
/// around a sheath, and a step takes least.
const TISSUES_RATIO: f64 = 0.45;

/// The resectoscope through the pivot. Anterior is -y in every case.
fn place(setup: &InstrumentSetup, case: &Case) -> Result<Resectoscope, RuleError> {
    let landmark = |field: &str, name: &str, place: Option<bevy::math::DVec3>| {
        let expected = format!("three numbers, for the case has no {name}");
        place
            .map(|place| place.as_vec3())
            .ok_or_else(|| RuleError::new(field, "absent", expected))
    };
    let pivot = match setup.pivot_mm {
        Some(pivot) => Vec3::from(pivot),
        None => landmark(
            "instrument.pivot_mm",
            "external sphincter",
            case.landmarks.external_sphincter,
        )?,
    };
    let axis = match setup.axis {
        Some(axis) => Vec3::from(axis),
        None => landmark("instrument.axis", "bladder neck", case.landmarks.bladder_neck)? - pivot,
    };
    let mut scope = Resectoscope::new(pivot, axis, Vec3::NEG_Y)
        .map_err(|error| RuleError::new("instrument", "unusable", error.to_string()))?;
    if let Some(optic) = setup.optic_deg {
        scope.geometry.lens_deg = optic;
    }
    Ok(scope)
}

/// On the axis, the tip as high as the verumontanum, loop drawn in.
fn beside_verumontanum(resectoscope: &Resectoscope, case: &Case) -> InstrumentState {
    let verumontanum = case.landmarks.verumontanum.map(|place| place.as_vec3());
    let distance = verumontanum.map_or(0.0, |place| (place - resectoscope.pivot()).dot(resectoscope.axis()));
    let limit = resectoscope.limits.insertion_mm;
    InstrumentState {
        insertion_mm: distance.clamp(limit.min, limit.max),
        ..default()
    }
}
