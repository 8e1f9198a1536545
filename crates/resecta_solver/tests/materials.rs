//! Blocks and a tube under small loads against linear elasticity: finite elements (`tests/reference/elasticity.py`) and a
//! closed form. `cargo test --release --test materials -- --nocapture` prints the tables of `docs/materials.md`.
//!
//! Blocks are pulled where the finite elements are squeezed, which is the same for small strains: a lattice without
//! shear resistance buckles under any push.

mod common;

use std::f64::consts::TAU;

use common::blocks::{LOADINGS, MODULUS, PUNCH, STRAIN, block, height, missed, reference};
use common::tube_lattice;
use glam::DVec3;
use resecta_solver::{Material, Network, ShearResistance, Tissue, TissueMesh};

const PRE_TENSION: f32 = 0.05;
const CELLS: [[f64; 3]; 5] = [
    [2.0, 2.0, 2.0],
    [2.0, 3.0, 2.0],
    [2.0, 2.0, 4.0],
    [2.0, 6.0, 2.0],
    [6.0, 2.0, 6.0],
];
fn material(shear: ShearResistance) -> Material {
    Material {
        modulus_pa: MODULUS,
        shear,
        ..Material::default()
    }
}

/// Nodes and springs of a tissue, in balance as it lies.
fn network_of(tissue: &Tissue) -> Network {
    let nodes = tissue.node_count();
    let springs: Vec<_> = (0..tissue.spring_count() as u32)
        .map(|spring| tissue.spring(spring))
        .collect();
    let mut network = Network {
        positions: (0..nodes as u32).map(|node| tissue.precise_position(node)).collect(),
        velocities: vec![DVec3::ZERO; nodes],
        masses: (0..nodes as u32).map(|node| tissue.mass_g(node).into()).collect(),
        damping: Vec::new(),
        loads: Vec::new(),
        fixed: vec![false; nodes],
        springs: springs.iter().map(|spring| spring.nodes).collect(),
        stiffness: springs.iter().map(|spring| spring.stiffness.into()).collect(),
        rest_lengths: springs.iter().map(|spring| spring.rest_length.into()).collect(),
    };
    network.loads = pulls(&network, &network.positions).iter().map(|pull| -*pull).collect();
    network
}

/// Sum of the springs' pulls on every node, µN.
fn pulls(network: &Network, positions: &[DVec3]) -> Vec<DVec3> {
    let mut pulls = vec![DVec3::ZERO; positions.len()];
    for (spring, &[a, b]) in network.springs.iter().enumerate() {
        let (along, length) = (positions[b as usize] - positions[a as usize]).normalize_and_length();
        let pull = along * network.stiffness[spring] * (length - network.rest_lengths[spring]);
        pulls[a as usize] += pull;
        pulls[b as usize] -= pull;
    }
    pulls
}

/// Where the nodes come to rest. `size_mm` is how far waves have to go.
fn settled(network: &mut Network, size_mm: f64) -> Vec<DVec3> {
    let crossing = size_mm / (MODULUS / Material::default().density_g_per_mm3).sqrt();
    network.damping = network.masses.iter().map(|mass| 0.6 / crossing * mass).collect();
    let mut tissue = Tissue::from_network(network).expect("a network");
    tissue.advance_steps(0.1 * crossing, 600).expect("a stable step");
    (0..network.positions.len() as u32)
        .map(|node| tissue.precise_position(node))
        .collect()
}

/// Force over displacement and modulus, mm, and cross-contraction over stretch where the sides are free.
fn stiffness(tissue: &Tissue, width: f64, height: f64, loading: &str) -> (f64, f64) {
    let mut network = network_of(tissue);
    let rest = network.positions.clone();
    let near = |a: f64, b: f64| (a - b).abs() < 1e-3;
    let ends = |z: f64| {
        (0..rest.len())
            .filter(|&node| near(rest[node].z, z))
            .collect::<Vec<usize>>()
    };
    let (bottom, mut top) = (ends(0.0), ends(height));
    if loading == "stretch" {
        // An end's load is shared by its nodes as their masses are, which is by area.
        let force = MODULUS * STRAIN * width * width;
        for (end, sense) in [(&bottom, -1.0), (&top, 1.0)] {
            let mass: f64 = end.iter().map(|&node| network.masses[node]).sum();
            end.iter()
                .for_each(|&node| network.loads[node].z += sense * force * network.masses[node] / mass);
        }
        let came = settled(&mut network, height);
        let mean = |end: &[usize]| end.iter().map(|&node| came[node].z).sum::<f64>() / end.len() as f64;
        let stretch = mean(&top) - mean(&bottom) - height;
        let side = |sign: f64| {
            came.iter()
                .zip(&rest)
                .filter(move |(_, rest)| near(rest.x, sign * width / 2.0))
        };
        let wider = |sign: f64| side(sign).map(|(came, rest)| came.x - rest.x).sum::<f64>() / side(sign).count() as f64;
        let contraction = (wider(-1.0) - wider(1.0)) / width;
        return (force / MODULUS / stretch, contraction / (stretch / height));
    }
    let moved = STRAIN * height * if loading == "shear" { DVec3::X } else { DVec3::Z };
    if loading == "indent" {
        top.retain(|&node| rest[node].truncate().abs().max_element() < PUNCH + 1e-3);
    }
    bottom.iter().chain(&top).for_each(|&node| network.fixed[node] = true);
    top.iter().for_each(|&node| network.positions[node] += moved);
    let came = settled(&mut network, height);
    let pulls = pulls(&network, &came);
    let force: DVec3 = top.iter().map(|&node| -pulls[node] - network.loads[node]).sum();
    (force.dot(moved) / moved.length_squared() / MODULUS, 0.0)
}

/// Stiffness of a block, cross-contraction, springs a node and the longest step in µs.
fn measured(cell: [f64; 3], shear: ShearResistance, loading: &str, width: f64) -> (f64, f64, f64, f64) {
    let mesh = block([width, width, height(width)], cell, shear);
    let mut tissue = Tissue::new(&mesh, &material(shear)).expect("a block is a tissue");
    let (found, contraction) = stiffness(&tissue, width, height(width), loading);
    let springs_a_node = mesh.springs.len() as f64 / mesh.positions.len() as f64;
    (found, contraction, springs_a_node, 1e6 * tissue.bound_s())
}

/// Errors in per cent against Poisson's ratio 1/4, by cells and loading, which have to be as expected.
#[track_caller]
fn assert_errors(name: &str, shear: ShearResistance, expected: impl Fn(usize, &str, f64, f64) -> f64) {
    for (index, cell) in CELLS.into_iter().enumerate() {
        let (_, contraction, springs, longest) = measured(cell, shear, "stretch", 24.0);
        let errors =
            LOADINGS.map(|(loading, width)| missed(measured(cell, shear, loading, width).0, loading, width, 0.25));
        let [x, y, z] = cell;
        let columns = errors.map(|error| format!("{error:+.1}")).join(" | ");
        println!("| {name} | {x} x {y} x {z} | {columns} | {contraction:.2} | {springs:.1} | {longest:.0} |");
        for (found, (loading, width)) in errors.into_iter().zip(LOADINGS) {
            let expected = expected(index, loading, width, found);
            let near = (found - expected).abs() < 0.5;
            assert!(
                near,
                "{loading} of {width} mm, {cell:?}: {found:.2} %, expected {expected:.2} %"
            );
        }
    }
}

/// Force over displacement and modulus of columns side by side, mm: area over height.
fn column(width: f64) -> f64 {
    width * width / height(width)
}

#[test]
fn without_shear_resistance_a_block_is_columns_side_by_side() {
    assert_errors("None", ShearResistance::None, |cell, loading, width, _| {
        let [x, y, _] = CELLS[cell];
        let stiffness = match loading {
            "shear" => 0.0,
            // The punch bears on the columns under it, those at its rim included whole.
            "indent" => (2.0 * PUNCH + x) * (2.0 * PUNCH + y) / 24.0,
            _ => column(width),
        };
        missed(stiffness, loading, width, 0.25)
    });
}

#[test]
fn pre_tension_gives_the_shear_modulus_of_its_stress() {
    let shear = ShearResistance::PreTension(PRE_TENSION);
    assert_errors("PreTension 5 %", shear, |_, loading, width, found| match loading {
        "shear" => missed(f64::from(PRE_TENSION) * column(width), loading, width, 0.25),
        // The columns around the punch help, by no closed form.
        "indent" => found.clamp(-21.0, -6.0),
        _ => missed(column(width), loading, width, 0.25),
    });
}

#[test]
fn diagonals_agree_with_elasticity_as_far_as_the_cells_allow() {
    // The shares are right for cubes; what those miss is for the width of the mesh. Longer and flatter cells: as measured
    // (docs/materials.md); stretch is confirmed by the cell's homogenised stiffness, 1 / (E S_zzzz) - 1.
    let as_measured = [
        [0.1, 1.7, 0.5, 8.9, 0.1, 3.9, 0.3],
        [-23.8, -5.5, -22.3, -12.6, -23.8, -17.9, -23.3],
        [134.5, -19.2, 127.7, 107.1, 134.5, 68.7, 133.1],
        [-38.1, -10.9, -35.2, -25.2, -38.1, -31.3, -37.3],
        [98.8, 24.8, 94.1, 94.8, 98.8, 127.0, 98.2],
    ];
    assert_errors("Diagonals", ShearResistance::Diagonals, |cell, loading, width, _| {
        let place = LOADINGS.iter().position(|of| *of == (loading, width));
        as_measured[cell][place.expect("one of the loadings")]
    });
}

#[test]
fn finite_elements_on_the_same_cubes_miss_nearly_as_much() {
    for [x, y, z] in CELLS {
        let errors = LOADINGS.map(|(loading, width)| {
            let trilinear = reference(&format!("{x}x{y}x{z}"), loading, width, 0.25);
            missed(trilinear, loading, width, 0.25)
        });
        let columns = errors.map(|error| format!("{error:+.1}")).join(" | ");
        println!("| finite elements | {x} x {y} x {z} | {columns} |");
    }
    for (loading, width) in LOADINGS {
        let springs = measured(CELLS[0], ShearResistance::Diagonals, loading, width).0;
        let elements = reference("2x2x2", loading, width, 0.25);
        assert!(
            (springs / elements - 1.0).abs() < 0.02,
            "{loading} of {width} mm: {springs} against {elements}"
        );
    }
}

#[test]
fn poissons_ratio_is_a_quarter_with_diagonals() {
    for (loading, width) in LOADINGS {
        let (found, contraction, ..) = measured(CELLS[0], ShearResistance::Diagonals, loading, width);
        assert!(
            loading != "stretch" || (contraction - 0.25).abs() < 1e-3,
            "{contraction}"
        );
        // What that misses of materials with the same modulus and another ratio.
        let errors = [(0.0, 12.0), (0.4, 8.0), (0.45, 11.0)].map(|(ratio, limit)| {
            let error = missed(found, loading, width, ratio);
            assert!(
                error.abs() < limit,
                "Poisson's ratio {ratio}, {loading} of {width} mm: {error:.1} %"
            );
            error
        });
        println!(
            "| {loading}, {width} mm | {} |",
            errors.map(|error| format!("{error:+.1}")).join(" | ")
        );
    }
}

/// Radial displacement of the lumen's wall under pressure, over that of linear elasticity, of a tube held at its capsule:
/// u = A (r - b² / r), A = -P / (2 (λ + μ) + 2 μ b² / a²) in plane strain.
fn widening(shear: ShearResistance, alpha: f64) -> f64 {
    let lattice = tube_lattice(alpha);
    let mesh = TissueMesh::from_lattice(&lattice, shear);
    let mut network = network_of(&Tissue::new(&mesh, &material(shear)).expect("a tube is a tissue"));
    mesh.capsule
        .iter()
        .for_each(|&node| network.fixed[node as usize] = true);
    let (inner, outer, length) = (4.0, 20.0, 30.0);
    let lame = 0.4 * MODULUS;
    let pressure = STRAIN * MODULUS;
    let a = -pressure / (4.0 * lame + 2.0 * lame * outer * outer / (inner * inner));
    let sound = a * (inner - outer * outer / inner);
    // Plane strain: the ends are held by the traction lambda (e_r + e_t) = 2 lambda A, over their nodes' areas.
    let shape = lattice.shape;
    let place = |node: u32| lattice.positions[node as usize];
    let (first, last) = (0, shape.slices - 1);
    for i in 0..shape.slices {
        for j in 0..shape.angles {
            let radial = place(shape.index(i, j, 0)).truncate().normalize().extend(0.0);
            let part = if i == first || i == last { 0.5 } else { 1.0 };
            let area = part * length / f64::from(shape.slices - 1) * TAU * inner / f64::from(shape.angles);
            network.loads[shape.index(i, j, 0) as usize] += radial * pressure * area;
        }
    }
    for (end, sense) in [(first, -1.0), (last, 1.0)] {
        let nodes: Vec<usize> = (0..shape.layers)
            .flat_map(|k| (0..shape.angles).map(move |j| shape.index(end, j, k) as usize))
            .collect();
        let mass: f64 = nodes.iter().map(|&node| network.masses[node]).sum();
        let area = TAU / 2.0 * (outer * outer - inner * inner);
        for node in nodes {
            network.loads[node].z += sense * 2.0 * lame * a * area * network.masses[node] / mass;
        }
    }
    let came = settled(&mut network, length);
    let middle = shape.slices / 2;
    let mean: f64 = (0..shape.angles)
        .map(|j| {
            let node = shape.index(middle, j, 0);
            came[node as usize].truncate().length() - place(node).truncate().length()
        })
        .sum::<f64>()
        / f64::from(shape.angles);
    mean / sound
}

#[test]
fn a_tube_widens_under_pressure_as_its_cells_allow() {
    // The gland's geometry: cells a third as wide as long at the lumen, 5/3 at the capsule, at any angle. Too stiff
    // along the radius and too soft around nearly cancel: 0.96 follows from the cells' homogenised stiffness.
    for (shear, alpha, expected) in [
        (ShearResistance::Diagonals, 8.0, 0.99),
        (ShearResistance::Diagonals, 4.0, 0.95),
        (ShearResistance::PreTension(PRE_TENSION), 8.0, 0.80),
    ] {
        let widening = widening(shear, alpha);
        println!("tube, rays {alpha} degrees apart, {shear:?}: {widening:.3} of the closed form");
        assert!((widening - expected).abs() < 0.02, "{shear:?}, {alpha}: {widening}");
    }
}
