//! The pressure of water on the surface, against a closed form and laws.

mod common;

use common::{block_mesh, blocks::block, tube_lattice_of};
use glam::{DMat2, DVec2, DVec3, Vec3};
use resecta_solver::{Material, NodeKind, ShearResistance, Tissue, TissueMesh};

/// A tube so long that its ends do not count.
const INNER_MM: f64 = 15.0;
const OUTER_MM: f64 = 25.0;
const LENGTH_MM: f64 = 100.0;

/// A tube along z on its bed, its ends held by it too.
fn tube_on_bed(poisson_ratio: Option<f64>, alpha_deg: f64) -> Tissue {
    let lattice = tube_lattice_of([INNER_MM, OUTER_MM], (LENGTH_MM / 5.0) as u32, alpha_deg);
    let shear = ShearResistance::Diagonals;
    let material = Material {
        shear,
        poisson_ratio,
        ..Material::default()
    };
    let mut mesh = TissueMesh::from_lattice(&lattice, shear);
    let is_end = |place: &DVec3| place.z < 1e-3 || place.z > LENGTH_MM - 1e-3;
    mesh.covered = (0u32..)
        .zip(&mesh.positions)
        .filter(|(_, place)| is_end(place))
        .map(|(node, _)| node)
        .collect();
    Tissue::new(&mesh, &material).expect("a tube is a tissue")
}

/// How far the wall of the lumen has moved outwards halfway along the tube, mean, mm.
fn opened_mm(tissue: &Tissue) -> f64 {
    let radius = |place: Vec3| place.as_dvec3().truncate().length();
    let is_middle = |node: &u32| {
        let rest = tissue.rest_position(*node);
        tissue.node_kind(*node) == NodeKind::Mucosa && (f64::from(rest.z) - 0.5 * LENGTH_MM).abs() < 5.0
    };
    let moved: Vec<f64> = (0..tissue.node_count() as u32)
        .filter(is_middle)
        .map(|node| radius(tissue.position(node)) - radius(tissue.rest_position(node)))
        .collect();
    moved.iter().sum::<f64>() / moved.len() as f64
}

/// What the lumen opens by under 1 % of the modulus, over the closed form: u = A r + B / r (Lamé, the length given), where the stress
/// 2 (λ + μ) A - 2 μ B / r² along the radius is -p at the lumen and that of the bed, -k u, at the capsule.
fn opening_over_closed_form(poisson: Option<f64>, alpha_deg: f64) -> f64 {
    let Material {
        modulus_pa,
        support_pa_per_mm,
        ..
    } = Material::default();
    let ratio = poisson.unwrap_or(0.25);
    let lambda = modulus_pa * ratio / ((1.0 + ratio) * (1.0 - 2.0 * ratio));
    let mu = 0.5 * modulus_pa / (1.0 + ratio);
    let pressure = 0.01 * modulus_pa;
    let [a, b] = [INNER_MM, OUTER_MM];
    let stress = |r: f64| DVec2::new(2.0 * (lambda + mu), -2.0 * mu / (r * r));
    let bed = stress(b) + support_pa_per_mm * DVec2::new(b, 1.0 / b);
    let unknowns = DMat2::from_cols(stress(a), bed).transpose().inverse() * DVec2::new(-pressure, 0.0);
    let expected = unknowns.dot(DVec2::new(a, 1.0 / a));
    let mut tissue = tube_on_bed(poisson, alpha_deg);
    tissue
        .set_water_pressure_pa(pressure as f32)
        .expect("a pressure in its range");
    for _ in 0..50 {
        tissue.advance(0.02, &[]).expect("a plain step");
    }
    opened_mm(&tissue) / expected
}

#[test]
fn a_thick_tube_opens_as_lame_says() {
    // Cells about as wide as long; how far others are off is in docs/materials.md, whatever presses on them.
    for (poisson, alpha_deg, within) in [(None, 5.0, 0.06), (Some(0.45), 8.0, 0.03), (Some(0.45), 5.0, 0.03)] {
        let opening = opening_over_closed_form(poisson, alpha_deg);
        println!("rays {alpha_deg} degrees apart, Poisson's ratio {poisson:?}: {opening:.3} of the closed form");
        assert!((opening - 1.0).abs() < within, "{poisson:?}, {alpha_deg}: {opening}");
    }
}

/// The share of its volume that a block of `cubes` cubes a side loses under water, over pressure by bulk modulus.
fn squeeze_over_bulk(poisson_ratio: Option<f64>, cubes: u32) -> f64 {
    let ratio = poisson_ratio.unwrap_or(0.25);
    let material = Material {
        poisson_ratio,
        shear: ShearResistance::Diagonals,
        ..Material::default()
    };
    let mut tissue = Tissue::new(
        &block([2.0 * f64::from(cubes); 3], [2.0; 3], ShearResistance::Diagonals),
        &material,
    )
    .expect("a block is a tissue");
    let middle = |tissue: &Tissue| {
        let count = tissue.node_count() as u32;
        let weighed = |node| tissue.precise_position(node) * f64::from(tissue.mass_g(node));
        let mass_g: f64 = (0..count).map(|node| f64::from(tissue.mass_g(node))).sum();
        (0..count).map(weighed).sum::<DVec3>() / mass_g
    };
    let (place, volume_mm3) = (middle(&tissue), tissue.volume_mm3());
    // So little that volume and areas are those at rest: under 0.01 of the modulus springs alone lose 1.5 % less for it.
    let pressure = 0.001 * material.modulus_pa;
    tissue
        .set_water_pressure_pa(pressure as f32)
        .expect("a pressure in its range");
    for _ in 0..50 {
        tissue.advance(0.02, &[]).expect("a plain step");
    }
    let moved_mm = middle(&tissue).distance(place);
    assert!(moved_mm < 1e-4, "water all around moves nothing: {moved_mm} mm");
    let bulk = material.modulus_pa / (3.0 * (1.0 - 2.0 * ratio));
    (1.0 - tissue.volume_mm3() / volume_mm3) / (pressure / bulk)
}

#[test]
fn water_all_around_squeezes_by_the_bulk_modulus() {
    for (poisson_ratio, cubes) in [(None, 4), (None, 8), (Some(0.45), 4), (Some(0.45), 8)] {
        let squeeze = squeeze_over_bulk(poisson_ratio, cubes);
        println!("Poisson's ratio {poisson_ratio:?}, {cubes} cubes: {squeeze:.4} of what the bulk modulus says");
        assert!((squeeze - 1.0).abs() < 0.01, "{poisson_ratio:?}, {cubes}: {squeeze}");
    }
}

#[test]
fn a_pressure_that_is_none_is_refused() {
    let mut tissue = Tissue::new(&block_mesh([1, 1, 1], 2.0), &Material::default()).expect("a cube is a tissue");
    for wrong in [f32::NAN, f32::INFINITY, 2e6] {
        assert!(tissue.set_water_pressure_pa(wrong).is_err(), "{wrong}");
        assert_eq!(tissue.water_pressure_pa(), 0.0);
    }
}

#[test]
fn whatever_was_cut_water_all_around_moves_nothing() {
    let material = Material {
        poisson_ratio: Some(0.45),
        ..Material::default()
    };
    let mut tissue = Tissue::new(&block_mesh([4; 3], 2.0), &material).expect("a block is a tissue");
    // A hollow, and tissue around it of which shares are left.
    tissue.resect(&[40, 41, 42], None);
    let left: Vec<(u32, f64)> = (60..80)
        .map(|pentahedron| (pentahedron, f64::from(pentahedron - 59) / 21.0))
        .collect();
    tissue.thin(&left, None);
    tissue
        .set_water_pressure_pa(0.02 * material.modulus_pa as f32)
        .expect("a pressure in its range");
    // Momentum: the mean of velocities by mass, after a step in which nothing damps what all share.
    let momentum = |tissue: &Tissue| {
        let living = (0..tissue.node_count() as u32).filter(|&node| tissue.is_node_alive(node));
        let each = living.map(|node| tissue.velocity(node).as_dvec3() * f64::from(tissue.inertia_g(node)));
        each.fold((DVec3::ZERO, 0.0), |(sum, size), one| (sum + one, size + one.length()))
    };
    tissue.advance(1e-3, &[]).expect("a plain step");
    let (sum, size) = momentum(&tissue);
    assert!(size > 0.0 && sum.length() < 1e-3 * size, "{sum} of {size}");
    assert_eq!(tissue.inverted_count(), 0);
}

#[test]
fn no_pressure_bursts_a_tube() {
    let mut tissue = tube_on_bed(Some(0.45), 14.0);
    tissue.set_water_pressure_pa(1e6).expect("a pressure in its range");
    for _ in 0..50 {
        tissue.advance(0.02, &[]).expect("a plain step");
    }
    let opened = opened_mm(&tissue);
    println!("opened by {opened:.2} mm");
    assert!(opened > 0.5 && opened < 0.5 * OUTER_MM, "{opened} mm");
    assert_eq!(tissue.inverted_count(), 0);
}
