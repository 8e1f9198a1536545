//! How far a pressure opens the lumen of an uncut gland, and what a closed form says of a round tube.

use std::f64::consts::PI;

use bevy::math::{DMat2, DVec2, Vec3};
use resecta_anatomy::{Case, Landmark};
use resecta_fluid::PA_PER_CMH2O;
use resecta_instrument::{InstrumentSource, InstrumentState};
use resecta_scenario::{Library, headless};
use resecta_solver::{Material, NodeKind};
use resecta_tissue::{Tissue, TissueDiagnostics};

use crate::measured::MeasuredError;

/// The exercise whose settings are taken: it is dry, so that a pressure may be set.
const EXERCISE: &str = "first_cuts";
/// Where the instrument waits, mm: below the verumontanum, out of the part that is measured.
const AWAY_MM: f32 = -10.0;
/// Steps until tissue has come to rest: 4 s.
const STEPS: usize = 240;
/// Number of planes across the gland in which the lumen is measured.
const PLANES: usize = 7;
/// From where to where they lie, as shares of the way from the verumontanum to the bladder neck: at the ends the wall ends, and the
/// middle lobe bulges into the bladder.
const BETWEEN: [f64; 2] = [0.2, 0.8];

/// The lumen of a gland at rest under a pressure. Areas are means over the planes, mm².
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub struct Opening {
    /// The pressure of the water in it, cmH2O.
    pub pressure_cmh2o: f64,
    /// Area of the lumen.
    pub area_mm2: f64,
    /// Area of the narrowest plane.
    pub least_mm2: f64,
    /// Area within the capsule.
    pub gland_mm2: f64,
    /// Area of the lumen of a round tube of this material on its bed: closed form, for the areas that lumen and gland have without
    /// pressure.
    pub tube_mm2: f64,
    /// Elements inside out.
    pub inverted: usize,
}

/// Opens the lumen of a shipped gland by some pressures, cmH2O, of which the first is none. The instrument waits below the verumontanum.
///
/// # Errors
///
/// [`MeasuredError`] when the exercise or the case cannot be loaded.
pub fn openings(library: &Library, case: &str, pressures_cmh2o: &[f64]) -> Result<Vec<Opening>, MeasuredError> {
    let mut openings: Vec<Opening> = Vec::new();
    for &pressure_cmh2o in pressures_cmh2o {
        let (mut opening, material) = open(library, case, pressure_cmh2o)?;
        let at_rest = openings.first().unwrap_or(&opening);
        let radii = [at_rest.area_mm2, at_rest.gland_mm2].map(|area| (area / PI).sqrt());
        let opens_mm = tube_opens_mm(&material, radii, PA_PER_CMH2O * pressure_cmh2o);
        opening.tube_mm2 = PI * (radii[0] + opens_mm).powi(2);
        openings.push(opening);
    }
    Ok(openings)
}

fn open(library: &Library, case: &str, pressure_cmh2o: f64) -> Result<(Opening, Material), MeasuredError> {
    let mut loaded = library.load(EXERCISE)?.on_case(case, library.load_case(case)?);
    let exercise = &mut loaded.exercise;
    exercise.models.water_pressure_cmh2o = Some(pressure_cmh2o);
    let start = exercise.instrument.start.unwrap_or_default();
    exercise.instrument.start = Some(InstrumentState {
        insertion_mm: AWAY_MM,
        ..start
    });
    exercise.goals.clear();
    let prepared = loaded.prepare()?;
    let planes = planes(&prepared.loaded.case);
    let material = prepared.material.clone();
    let mut app = headless::app(None);
    headless::finish_plugins(&mut app);
    app.update();
    let active = headless::start(&mut app, prepared, InstrumentSource::Requests);
    for _ in 0..STEPS {
        app.update();
    }
    let tissue = app.world().get::<Tissue>(active.tissue).map(Tissue::solver);
    let areas = |kind| -> Vec<f64> {
        let of_planes = planes
            .iter()
            .map(|&z| tissue.map_or(0.0, |tissue| area_mm2(tissue, kind, z as f32)));
        of_planes.collect()
    };
    let (lumen, gland) = (areas(NodeKind::Mucosa), areas(NodeKind::Capsule));
    let mean = |areas: &[f64]| areas.iter().sum::<f64>() / PLANES as f64;
    let opening = Opening {
        pressure_cmh2o,
        area_mm2: mean(&lumen),
        least_mm2: lumen.iter().copied().fold(f64::INFINITY, f64::min),
        gland_mm2: mean(&gland),
        tube_mm2: 0.0,
        inverted: app.world().resource::<TissueDiagnostics>().inverted,
    };
    Ok((opening, material))
}

/// Heights of the planes, mm.
fn planes(case: &Case) -> Vec<f64> {
    let height = |landmark: Landmark| landmark.place(case).map_or(0.0, |place| place.z);
    let (from, to) = (height(Landmark::Verumontanum), height(Landmark::BladderNeck));
    let shares = (0..PLANES).map(|n| BETWEEN[0] + (BETWEEN[1] - BETWEEN[0]) * n as f64 / (PLANES - 1) as f64);
    shares.map(|share| from + share * (to - from)).collect()
}

/// Area that the surface of a kind encloses at a height, mm²: half the sum of the cross products of where the plane cuts its triangles.
fn area_mm2(tissue: &resecta_solver::Tissue, kind: NodeKind, z: f32) -> f64 {
    let mut twice = 0.0;
    for (_, nodes) in tissue.surface().triangles() {
        if nodes.iter().any(|&node| tissue.node_kind(node) != kind) {
            continue;
        }
        let corners = nodes.map(|node| tissue.position(node) - z * Vec3::Z);
        let edges = [[0, 1], [1, 2], [2, 0]].map(|edge| edge.map(|n: usize| corners[n]));
        let cuts = edges.iter().filter(|[a, b]| (a.z < 0.0) != (b.z < 0.0));
        let cuts: Vec<Vec3> = cuts.map(|[a, b]| a.lerp(*b, a.z / (a.z - b.z))).collect();
        let [from, to] = cuts[..] else { continue };
        let normal = (corners[1] - corners[0]).cross(corners[2] - corners[0]);
        // All pieces go the same way round.
        let goes_on = normal.cross(Vec3::Z).dot(to - from) >= 0.0;
        let (from, to) = if goes_on { (from, to) } else { (to, from) };
        twice += f64::from(from.x * to.y - from.y * to.x);
    }
    0.5 * twice.abs()
}

/// How far the lumen of a long tube opens under a pressure, mm: u = A r + B / r (Lamé, the length given), where the stress
/// 2 (λ + μ) A - 2 μ B / r² along the radius is -p at the lumen and that of the bed, -k u, at the capsule.
fn tube_opens_mm(material: &Material, [a, b]: [f64; 2], pressure_pa: f64) -> f64 {
    /// What a material without a ratio of its own has.
    const OF_SPRINGS: f64 = 0.25;
    let ratio = material.poisson_ratio.unwrap_or(OF_SPRINGS);
    let mu = 0.5 * material.modulus_pa / (1.0 + ratio);
    let lambda = 2.0 * mu * ratio / (1.0 - 2.0 * ratio);
    let stress = |r: f64| DVec2::new(2.0 * (lambda + mu), -2.0 * mu / (r * r));
    let bed = stress(b) + material.support_pa_per_mm * DVec2::new(b, 1.0 / b);
    let unknowns = DMat2::from_cols(stress(a), bed).transpose().inverse() * DVec2::new(-pressure_pa, 0.0);
    unknowns.dot(DVec2::new(a, 1.0 / a))
}

#[cfg(test)]
mod tests {
    use super::*;
    use resecta_anatomy::{Lattice, LatticeOptions, Section};
    use resecta_solver::{ShearResistance, TissueMesh};

    #[test]
    fn the_area_of_a_tube_is_that_of_its_polygons() {
        const STEPS: u32 = 36;
        let angle = std::f64::consts::TAU / f64::from(STEPS);
        let ring = |radius: f64| -> Vec<DVec2> {
            (0..STEPS)
                .map(|n| DVec2::from_angle(f64::from(n) * angle) * radius)
                .collect()
        };
        let (outer, inner) = (ring(15.0), ring(4.0));
        let sections = [0.0, 5.0, 10.0].map(|z| Section {
            z,
            outer: &outer,
            inner: &inner,
        });
        let options = LatticeOptions {
            alpha_deg: 10.0,
            ..LatticeOptions::default()
        };
        let lattice = Lattice::from_sections(&sections, &options).expect("a tube is a lattice");
        let mesh = TissueMesh::from_lattice(&lattice, ShearResistance::None);
        let tissue = resecta_solver::Tissue::new(&mesh, &Material::default()).expect("a tube is a tissue");
        for (kind, radius) in [(NodeKind::Mucosa, 4.0), (NodeKind::Capsule, 15.0)] {
            let polygon = 0.5 * f64::from(STEPS) * radius * radius * angle.sin();
            let area = area_mm2(&tissue, kind, 3.0);
            assert!((area / polygon - 1.0).abs() < 1e-5, "{kind:?}: {area} is not {polygon}");
        }
    }

    #[test]
    fn a_stiffer_bed_and_a_thicker_wall_give_way_less() {
        let opens = |support_pa_per_mm, outer| {
            let material = Material {
                support_pa_per_mm,
                ..Material::default()
            };
            tube_opens_mm(&material, [4.0, outer], 500.0)
        };
        assert!(opens(10.0, 20.0) > opens(1e9, 20.0));
        assert!(
            opens(1e9, 12.0) < opens(1e9, 20.0),
            "what is held near the lumen gives way less"
        );
        assert!(opens(1e9, 20.0) > 0.0);
    }
}
