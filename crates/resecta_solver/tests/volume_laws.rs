//! Laws of pentahedra that hold their volume, whatever the numbers. How well they agree with elasticity is in
//! `materials_volume.rs`, what they make of hard cases in `hard_cases_volume.rs`.

mod common;

use common::blocks::block;
use common::tube_lattice;
use glam::{DVec3, Vec3};
use resecta_solver::reference::{self, Inertia};
use resecta_solver::{CollapseLaw, Material, MeshError, ShearResistance, Tissue, TissueMesh};

const SHEARS: [ShearResistance; 3] = [
    ShearResistance::None,
    ShearResistance::PreTension(0.03),
    ShearResistance::Diagonals,
];

fn tube(shear: ShearResistance, poisson_ratio: Option<f64>) -> Tissue {
    let material = Material {
        poisson_ratio,
        shear,
        ..Material::default()
    };
    Tissue::new(&TissueMesh::from_lattice(&tube_lattice(15.0), shear), &material).expect("a tube is a tissue")
}

/// A block that nothing holds and nothing damps, shaking.
fn free_block() -> Tissue {
    let material = Material {
        poisson_ratio: Some(0.45),
        viscosity_pa_s: 0.0,
        support_pa_per_mm: 0.0,
        ..Material::default()
    };
    let mesh = block([8.0, 6.0, 8.0], [2.0; 3], material.shear);
    let mut tissue = Tissue::new(&mesh, &material).expect("a block is a tissue");
    shake(&mut tissue);
    tissue
}

fn shake(tissue: &mut Tissue) {
    for node in 0..tissue.node_count() as u32 {
        let place = tissue.position(node);
        let velocity = Vec3::new((place.y * 0.7).sin(), (place.z * 0.9).cos(), (place.x * 0.5).sin()) * 60.0;
        tissue.set_velocity(node, velocity).expect("a finite velocity");
    }
}

fn places(tissue: &Tissue) -> Vec<DVec3> {
    (0..tissue.node_count() as u32)
        .map(|node| tissue.precise_position(node))
        .collect()
}

#[test]
fn a_ratio_that_the_springs_have_by_themselves_changes_no_bit() {
    for (shear, ratio) in SHEARS.into_iter().zip([0.0, 0.0, 0.25]) {
        let run = |ratio| {
            let mut tissue = tube(shear, ratio);
            shake(&mut tissue);
            for _ in 0..5 {
                tissue.advance(1.0 / 60.0, &[]).expect("a plain advance");
            }
            let near = tissue.pentahedra_near(100, 4.0);
            tissue.resect(&near, Some(CollapseLaw::default()));
            tissue.advance(1.0 / 60.0, &[]).expect("a plain advance");
            tissue
        };
        let (with, without) = (run(Some(ratio)), run(None));
        assert_eq!(places(&with), places(&without), "{shear:?}");
        assert_eq!(with.energy(), without.energy(), "{shear:?}");
        assert_eq!(with.energy().volume, 0.0, "{shear:?}");
        assert!((0..with.pentahedron_count() as u32).all(|index| with.pressure_pa(index) == 0.0));
    }
}

#[test]
fn ratios_that_no_lattice_can_have_are_refused_by_name() {
    for (shear, ratio) in [
        (ShearResistance::Diagonals, 0.24),
        (ShearResistance::Diagonals, 0.5),
        (ShearResistance::None, -0.1),
        (ShearResistance::None, 0.495),
        (ShearResistance::PreTension(0.02), -1e-9),
        (ShearResistance::PreTension(0.02), f64::NAN),
        (ShearResistance::Diagonals, f64::INFINITY),
    ] {
        let material = Material {
            poisson_ratio: Some(ratio),
            shear,
            ..Material::default()
        };
        let mesh = block([2.0; 3], [1.0; 3], shear);
        match Tissue::new(&mesh, &material) {
            Err(MeshError::Material { field, .. }) => assert_eq!(field, "poisson_ratio"),
            other => panic!("{shear:?}, {ratio}: {:?}", other.map(|_| ())),
        }
    }
}

#[test]
fn a_tissue_at_rest_stays_at_rest() {
    for shear in SHEARS {
        let mut tissue = tube(shear, Some(0.45));
        tissue.advance(0.5, &[]).expect("a plain advance");
        for node in 0..tissue.node_count() as u32 {
            let moved = tissue.position(node).distance(tissue.rest_position(node));
            assert!(moved < 2e-5, "{shear:?}, node {node}: {moved}");
        }
    }
}

#[test]
fn momentum_of_a_free_block_is_constant() {
    let mut tissue = free_block();
    let (before, mass) = (tissue.momentum(), tissue.initial_volume_mm3() * 1e-3);
    tissue.advance(0.2, &[]).expect("a plain advance");
    let change = (tissue.momentum() - before).length() / mass;
    assert!(change < 1e-3, "the mean velocity changed by {change} mm/s");
}

#[test]
fn without_damping_energy_swings_by_the_square_of_the_step_and_does_not_drift() {
    let start = free_block();
    let first = start.energy().total();
    let bound_s = start.clone().bound_s();
    let swing = |part: f64| {
        let mut tissue = start.clone();
        let mut worst = 0.0f64;
        for _ in 0..(400.0 / part) as u32 {
            tissue.advance_steps(part * bound_s, 1).expect("within the bound");
            worst = worst.max((tissue.energy().total() / first - 1.0).abs());
        }
        worst
    };
    let swings = [0.4, 0.2, 0.1].map(swing);
    println!("{swings:?}");
    assert!(swings[0] < 0.02, "{swings:?}");
    for pair in swings.windows(2) {
        let order = (pair[0] / pair[1]).log2();
        assert!((1.7..2.3).contains(&order), "order {order}: {swings:?}");
    }
}

#[test]
fn with_damping_and_no_load_energy_never_grows() {
    let mut tissue = tube(ShearResistance::Diagonals, Some(0.49));
    shake(&mut tissue);
    let first = tissue.energy().total();
    let mut last = first;
    for _ in 0..120 {
        tissue.advance(1.0 / 60.0, &[]).expect("a plain advance");
        let energy = tissue.energy().total();
        // Positions are rounded to single precision.
        assert!(energy <= last * (1.0 + 1e-6) + 1e-6 * first, "{energy} after {last}");
        last = energy;
    }
    assert!(last < 1e-3 * first, "{last} of {first}");
}

#[test]
fn the_step_is_of_order_two_against_the_reference() {
    let mut start = tube(ShearResistance::Diagonals, Some(0.45));
    for node in 0..start.node_count() as u32 {
        let place = start.position(node);
        let velocity = Vec3::new(place.z, place.x, place.y) * 3.0;
        start.set_velocity(node, velocity).expect("a finite velocity");
    }
    let time = 0.004;
    let exact = reference::positions_after(&start, time, 800, Inertia::AsStepped);
    let error = |steps: u64| {
        let mut tissue = start.clone();
        tissue
            .advance_steps(time / steps as f64, steps)
            .expect("within the bound");
        let squares = places(&tissue)
            .iter()
            .zip(&exact)
            .map(|(came, exact)| came.distance_squared(*exact))
            .sum::<f64>();
        (squares / exact.len() as f64).sqrt()
    };
    let (coarse, fine) = (error(80), error(160));
    let order = (coarse / fine).log2();
    assert!((1.8..2.3).contains(&order), "order {order}: {coarse} then {fine} mm");
}

#[test]
fn a_cut_takes_the_energy_and_the_pressure_of_what_it_removes() {
    let mut tissue = tube(ShearResistance::Diagonals, Some(0.45));
    for node in 0..tissue.node_count() as u32 {
        let place = tissue.position(node);
        let squeezed = Vec3::new(0.9 * place.x, place.y, place.z) + 0.05 * Vec3::new(place.y.sin(), 0.0, place.x.cos());
        tissue.set_position(node, squeezed).expect("a finite place");
    }
    let near = tissue.pentahedra_near(200, 6.0);
    let before = tissue.energy().volume;
    let others: f64 = {
        let mut rest = tissue.clone();
        let all: Vec<u32> = (0..tissue.pentahedron_count() as u32)
            .filter(|index| !near.contains(index))
            .collect();
        rest.resect(&all, None);
        rest.energy().volume
    };
    assert!(others > 0.0 && near.iter().any(|&index| tissue.pressure_pa(index) > 0.0));
    let bound_s = tissue.bound_s();
    tissue.resect(&near, None);
    let after = tissue.energy().volume;
    assert!(
        (before - after - others).abs() < 1e-9 * before,
        "{before} - {after} is not {others}"
    );
    assert!(near.iter().all(|&index| tissue.pressure_pa(index) == 0.0));
    assert_eq!(tissue.validate(), Ok(()));
    assert!(tissue.bound_s() >= 0.3 * bound_s);
    tissue.advance(0.5, &[]).expect("a plain advance");
    assert_eq!(tissue.validate(), Ok(()));
}

#[test]
fn a_watch_sees_the_same_pressure_and_a_cut_in_both_solutions() {
    let mut tissue = tube(ShearResistance::Diagonals, Some(0.45));
    shake(&mut tissue);
    tissue.begin_watch();
    tissue.advance(1.0 / 60.0, &[]).expect("a plain advance");
    let near = tissue.pentahedra_near(200, 5.0);
    tissue.resect(&near, Some(CollapseLaw::default()));
    tissue.advance(1.0 / 60.0, &[]).expect("a plain advance");
    let error = tissue.end_watch().expect("a watch was begun");
    assert!(error > 0.0 && error < 0.05, "{error} mm");
}

#[test]
fn what_comes_to_rest_sleeps_and_wakes_when_a_neighbour_moves() {
    let mut tissue = tube(ShearResistance::None, Some(0.45));
    for _ in 0..30 {
        tissue.advance(1.0 / 60.0, &[]).expect("a plain advance");
    }
    assert_eq!(tissue.sleeping_share(), 1.0);
    let mut awake = tissue.clone();
    awake.set_load(50, Vec3::new(2e4, 0.0, 0.0)).expect("a load");
    tissue.set_load(50, Vec3::new(2e4, 0.0, 0.0)).expect("a load");
    for _ in 0..60 {
        awake.advance_steps(1.0 / 60.0, 1).expect("a plain step");
        tissue.advance(1.0 / 60.0, &[]).expect("a plain advance");
    }
    let pairs = places(&tissue).into_iter().zip(places(&awake));
    let apart = pairs.map(|(one, other)| one.distance(other)).fold(0.0, f64::max);
    assert!(apart < 0.02, "{apart} mm");
}
