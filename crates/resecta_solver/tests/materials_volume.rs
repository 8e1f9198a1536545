//! Blocks of cubes whose pentahedra hold their volume, against linear elasticity at the same modulus and Poisson's ratio
//! (`tests/reference/elasticity.py`). `cargo test --release --test materials_volume -- --nocapture` prints the tables of
//! `docs/materials.md`.

mod common;

use std::f64::consts::FRAC_PI_2;

use common::blocks::{LOADINGS, MODULUS, PUNCH, STRAIN, block, height, missed};
use glam::{DVec3, Vec3};
use resecta_anatomy::wedge;
use resecta_solver::{Material, ShearResistance, Tissue, TissueMesh};

const CUBES: [f64; 3] = [2.0; 3];
const RATIOS: [f64; 5] = [0.25, 0.3, 0.4, 0.45, 0.49];

/// Per cent. Single precision rounds the strain of long blocks by some thousandths.
const NEAR: f64 = 0.8;

/// As much as makes a node stay where it is, g.
const HELD_G: f32 = 1e9;

/// A block of a material with that ratio, damped so that it comes to rest fast, and how long a wave takes through it, s.
fn of_ratio(mesh: &TissueMesh, shear: ShearResistance, ratio: Option<f64>, height: f64) -> (Tissue, f64) {
    let density = Material::default().density_g_per_mm3;
    let crossing = height / (MODULUS / density).sqrt();
    let volume = mesh
        .pentahedra
        .iter()
        .map(|nodes| wedge::volume(nodes, |node| mesh.positions[node as usize]));
    let wave_number = FRAC_PI_2 / (0.5 * volume.sum::<f64>().cbrt());
    let material = Material {
        modulus_pa: MODULUS,
        poisson_ratio: ratio,
        viscosity_pa_s: 0.6 / crossing * density / (wave_number * wave_number),
        support_pa_per_mm: 0.0,
        shear,
        ..Material::default()
    };
    (Tissue::new(mesh, &material).expect("a block is a tissue"), crossing)
}

fn settle(tissue: &mut Tissue, crossing: f64) {
    tissue.advance_steps(0.1 * crossing, 600).expect("a stable step");
}

/// Forces of springs and pentahedra on some nodes, µN.
fn force_on(tissue: &Tissue, nodes: &[u32]) -> DVec3 {
    let mut force = DVec3::ZERO;
    for spring in (0..tissue.spring_count() as u32).map(|spring| tissue.spring(spring)) {
        let [a, b] = spring.nodes.map(|node| tissue.precise_position(node));
        let (along, length) = (b - a).normalize_and_length();
        let pull = along * f64::from(spring.stiffness) * (length - f64::from(spring.rest_length));
        let [at_a, at_b] = spring.nodes.map(|node| nodes.contains(&node));
        force += pull * (f64::from(at_a) - f64::from(at_b));
    }
    for pentahedron in tissue.living_pentahedron_indices() {
        let corners = tissue.pentahedron_nodes(pentahedron);
        let gradients = wedge::gradients(&corners, |node| tissue.precise_position(node));
        for (corner, gradient) in corners.into_iter().zip(gradients) {
            if nodes.contains(&corner) {
                force += tissue.pressure_pa(pentahedron) * gradient;
            }
        }
    }
    force
}

/// Moves plate or punch, as `strain` times the height, and lets the rest follow. Gives the nodes under it.
fn press(tissue: &mut Tissue, height: f64, loading: &str, strain: f64, crossing: f64) -> (Vec<u32>, DVec3) {
    let near = |a: f32, b: f64| (f64::from(a) - b).abs() < 1e-3;
    let nodes: Vec<(u32, Vec3)> = (0..tissue.node_count() as u32)
        .map(|node| (node, tissue.rest_position(node)))
        .collect();
    let at = |z: f64| nodes.iter().filter(move |(_, place)| near(place.z, z));
    let punch = (PUNCH + 1e-3) as f32;
    let under = |place: &Vec3| loading != "indent" || place.truncate().abs().max_element() < punch;
    let top: Vec<u32> = at(height)
        .filter(|(_, place)| under(place))
        .map(|(node, _)| *node)
        .collect();
    for &(node, _) in at(0.0) {
        tissue.set_mass(node, HELD_G).expect("a mass");
    }
    let moved = strain * height * if loading == "shear" { DVec3::X } else { DVec3::Z };
    for &node in &top {
        tissue.set_mass(node, HELD_G).expect("a mass");
        let place = tissue.rest_position(node).as_dvec3() + moved;
        tissue.set_position(node, place.as_vec3()).expect("a place");
    }
    settle(tissue, crossing);
    (top, moved)
}

/// Force over displacement and modulus of a block, mm, cross-contraction over stretch, and the longest step, µs.
fn measured(cell: [f64; 3], shear: ShearResistance, ratio: f64, loading: &str, width: f64) -> (f64, f64, f64) {
    let height = height(width);
    let mesh = block([width, width, height], cell, shear);
    let (mut tissue, crossing) = of_ratio(&mesh, shear, Some(ratio), height);
    let longest = 1e6 * undamped_bound(&mesh, shear, ratio);
    if loading != "stretch" {
        let (top, moved) = press(&mut tissue, height, loading, STRAIN, crossing);
        let force = -force_on(&tissue, &top);
        return (force.dot(moved) / moved.length_squared() / MODULUS, 0.0, longest);
    }
    let force = MODULUS * STRAIN * width * width;
    let nodes = 0..tissue.node_count() as u32;
    let rest = |tissue: &Tissue, node| tissue.rest_position(node).as_dvec3();
    let on = |axis: usize, place: f64| -> Vec<u32> {
        nodes
            .clone()
            .filter(|&node| (rest(&tissue, node)[axis] - place).abs() < 1e-3)
            .collect()
    };
    let (bottom, top) = (on(2, 0.0), on(2, height));
    let (left, right) = (on(0, -0.5 * width), on(0, 0.5 * width));
    for (end, sense) in [(&bottom, -1.0), (&top, 1.0)] {
        // By area, as the masses are.
        let mass: f64 = end.iter().map(|&node| f64::from(tissue.mass_g(node))).sum();
        for &node in end {
            let share = f64::from(tissue.mass_g(node)) / mass;
            tissue
                .set_load(node, (sense * force * share * DVec3::Z).as_vec3())
                .expect("a load");
        }
    }
    settle(&mut tissue, crossing);
    let mean = |nodes: &[u32], axis: usize| {
        let moved = nodes
            .iter()
            .map(|&node| (tissue.precise_position(node) - rest(&tissue, node))[axis]);
        moved.sum::<f64>() / nodes.len() as f64
    };
    let stretch = mean(&top, 2) - mean(&bottom, 2);
    let contraction = (mean(&left, 0) - mean(&right, 0)) / width;
    (force / MODULUS / stretch, contraction / (stretch / height), longest)
}

/// The longest step of a block that nothing damps, s.
fn undamped_bound(mesh: &TissueMesh, shear: ShearResistance, ratio: f64) -> f64 {
    let material = Material {
        modulus_pa: MODULUS,
        poisson_ratio: Some(ratio),
        viscosity_pa_s: 0.0,
        shear,
        ..Material::default()
    };
    Tissue::new(mesh, &material).expect("a block is a tissue").bound_s()
}

/// Per cent against finite elements of that ratio, and the cross-contraction; printed as a row.
fn row(cell: [f64; 3], ratio: f64) -> ([f64; 7], f64) {
    let (mut contraction, mut longest) = (0.0, 0.0);
    let errors = LOADINGS.map(|(loading, width)| {
        let found = measured(cell, ShearResistance::Diagonals, ratio, loading, width);
        if (loading, width) == ("stretch", 24.0) {
            (contraction, longest) = (found.1, found.2);
        }
        missed(found.0, loading, width, ratio)
    });
    let [x, y, z] = cell;
    let columns = errors.map(|error| format!("{error:+.1}")).join(" | ");
    println!("| {ratio} | {x} x {y} x {z} | {columns} | {contraction:.3} | {longest:.0} |");
    (errors, contraction)
}

#[test]
fn cubes_have_the_modulus_and_the_ratio_that_are_asked_for() {
    // What is missed is for the width of the mesh, as by finite elements on the same cubes (`materials.rs`), and at high
    // ratios for one pressure a pentahedron. From the lattice's stiffness matrix, worked out without the solver.
    let expected = [
        [0.0, 1.7, 0.5, 8.8, 0.0, 3.8, 0.3],
        [0.0, 1.8, 0.7, 8.5, 0.0, 3.9, 0.4],
        [0.0, 2.4, 1.5, 8.3, 0.0, 4.6, 0.8],
        [0.0, 3.0, 2.2, 8.5, 0.0, 5.4, 1.1],
        [0.0, 4.2, 3.3, 10.0, 0.0, 6.9, 1.4],
    ];
    for (ratio, expected) in RATIOS.into_iter().zip(expected) {
        let (errors, contraction) = row(CUBES, ratio);
        assert!((contraction - ratio).abs() < 2e-3, "{ratio}: {contraction}");
        for ((found, expected), of) in errors.into_iter().zip(expected).zip(LOADINGS) {
            assert!(
                (found - expected).abs() < NEAR,
                "{ratio}, {of:?}: {found:.2} %, expected {expected} %"
            );
        }
    }
}

#[test]
fn cells_that_are_no_cubes_miss_as_much_as_their_springs() {
    // As worked out, likewise, with lateral faces cut along one diagonal; but flat cells squeezed and indented, as measured with bilinear
    // ones: cut, they missed 75.8, 74.2 and 82.8 %.
    for (cell, expected) in [
        ([2.0, 3.0, 2.0], [-20.2, -1.4, -15.1, -8.1, -20.2, -12.8, -18.7]),
        ([2.0, 2.0, 4.0], [118.2, -23.5, 106.1, 87.2, 118.2, 55.6, 117.7]),
        ([2.0, 6.0, 2.0], [-35.0, -5.1, -26.6, -21.1, -35.0, -25.9, -33.0]),
        ([6.0, 2.0, 6.0], [80.6, 19.5, 74.9, 73.5, 80.6, 111.3, 82.3]),
    ] {
        let (errors, _) = row(cell, 0.45);
        for ((found, expected), of) in errors.into_iter().zip(expected).zip(LOADINGS) {
            assert!(
                (found - expected).abs() < NEAR,
                "{cell:?}, {of:?}: {found:.2} %, expected {expected} %"
            );
        }
    }
}

#[test]
fn under_pre_tension_a_stretch_along_the_springs_has_modulus_and_ratio() {
    // Without tension the springs across, which the stretch compresses, buckle.
    for (strain, ratio) in [(0.05, 0.2), (0.05, 0.45), (0.1, 0.45)] {
        let (found, contraction, _) = measured(CUBES, ShearResistance::PreTension(strain), ratio, "stretch", 24.0);
        let error = 100.0 * (found / 24.0 - 1.0);
        println!("PreTension {strain}, {ratio}: {error:+.2} %, contraction {contraction:.4}");
        assert!(error.abs() < 0.3, "{strain}, {ratio}: {error:+.2} %");
        assert!((contraction - ratio).abs() < 0.002, "{strain}, {ratio}: {contraction}");
    }
}

#[test]
fn an_indented_block_loses_less_volume_the_higher_its_ratio() {
    let mesh = block([24.0; 3], CUBES, ShearResistance::Diagonals);
    let mut last = f64::INFINITY;
    for ratio in RATIOS {
        let (mut tissue, crossing) = of_ratio(&mesh, ShearResistance::Diagonals, Some(ratio), 24.0);
        let whole = tissue.volume_mm3();
        press(&mut tissue, 24.0, "indent", -0.1, crossing);
        let lost = whole - tissue.volume_mm3();
        // What the punch pushes away.
        let pushed = 2.4 * (2.0 * PUNCH).powi(2);
        println!("{ratio}: {:.3} of what is pushed away is lost", lost / pushed);
        assert!(lost > 0.0 && lost < 0.95 * last, "{ratio}: {lost} mm³ after {last}");
        last = lost;
    }
}
