//! Hard cases of what a tissue is built from: NaN, infinity, the wrong sign, numbers beyond single precision and indices that
//! name nothing are refused by field and index.

mod common;

use common::block_mesh;
use common::networks::chain;
use glam::DVec3;
use resecta_solver::{Material, MeshError, Network, NetworkError, ShearResistance, Tissue, TissueMesh};

const NO_NUMBERS: [f32; 3] = [f32::NAN, f32::INFINITY, f32::NEG_INFINITY];

#[test]
fn a_network_with_a_value_that_cannot_be_is_refused_by_field_and_index() {
    type Put = fn(&mut Network, f64);
    let anything: [(&str, Put); 3] = [
        ("positions", |network, value| network.positions[2].y = value),
        ("velocities", |network, value| network.velocities[2].z = value),
        ("loads", |network, value| network.loads[2].x = value),
    ];
    let not_negative: [(&str, Put); 4] = [
        ("masses", |network, value| network.masses[2] = value),
        ("damping", |network, value| network.damping[2] = value),
        ("stiffness", |network, value| network.stiffness[2] = value),
        ("rest_lengths", |network, value| network.rest_lengths[2] = value),
    ];
    // The last is finite, but not in single precision.
    let never = [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, 1e39];
    let check = |name: &str, put: Put, value: f64| {
        let mut network = chain(5, 1.0, 0.01, 100.0, 0.1);
        put(&mut network, value);
        match Tissue::from_network(&network) {
            Err(NetworkError::Value { field, index: 2, .. }) => assert_eq!(field, name),
            other => panic!("{name} {value}: {:?}", other.map(|_| ())),
        }
    };
    for (name, put) in anything.into_iter().chain(not_negative) {
        never.into_iter().for_each(|value| check(name, put, value));
    }
    for (name, put) in not_negative {
        check(name, put, -1.0);
    }
    for mass in [0.0, -0.0, 1e-39] {
        check("masses", not_negative[0].1, mass);
    }
}

#[test]
fn a_material_with_a_value_that_cannot_be_is_refused_by_field() {
    type Put = fn(&mut Material, f64);
    let fields: [(&str, Put, &[f64]); 5] = [
        (
            "modulus_pa",
            |material, value| material.modulus_pa = value,
            &[0.0, -1.0],
        ),
        (
            "density_g_per_mm3",
            |material, value| material.density_g_per_mm3 = value,
            &[0.0, -1.0],
        ),
        (
            "viscosity_pa_s",
            |material, value| material.viscosity_pa_s = value,
            &[-1.0],
        ),
        (
            "support_pa_per_mm",
            |material, value| material.support_pa_per_mm = value,
            &[-1.0],
        ),
        (
            "shear.PreTension",
            |material, value| material.shear = ShearResistance::PreTension(value as f32),
            &[-0.01, 0.3],
        ),
    ];
    let mesh = block_mesh([1, 1, 1], 1.0);
    for (name, put, besides) in fields {
        for value in NO_NUMBERS.map(f64::from).into_iter().chain(besides.iter().copied()) {
            let mut material = Material::default();
            put(&mut material, value);
            match Tissue::new(&mesh, &material) {
                Err(MeshError::Material { field, .. }) => assert_eq!(field, name),
                other => panic!("{name} {value}: {:?}", other.map(|_| ())),
            }
        }
    }
}

#[test]
fn a_mesh_with_a_value_or_an_index_that_cannot_be_is_refused_by_name() {
    let good = block_mesh([2, 1, 1], 1.0);
    let refused = |change: &dyn Fn(&mut TissueMesh)| -> String {
        let mut mesh = good.clone();
        change(&mut mesh);
        let error = Tissue::new(&mesh, &Material::default()).map(|_| ());
        error.expect_err("it is refused").to_string()
    };
    for value in NO_NUMBERS {
        assert!(refused(&|mesh| mesh.positions[3].x = value.into()).contains("node 3"));
        assert!(refused(&|mesh| mesh.shares[4].fraction = value).contains("share 4"));
    }
    assert!(refused(&|mesh| mesh.shares[4].fraction = -1.0).contains("share 4"));
    // Finite, but not in single precision: the first pentahedron there has no volume.
    assert!(refused(&|mesh| mesh.positions[0].x = 1e39).contains("pentahedron 0"));
    assert!(refused(&|mesh| mesh.pentahedra[1][5] = 99).contains("pentahedron 1"));
    assert!(refused(&|mesh| mesh.springs[2] = [0, 99]).contains("spring 2"));
    assert!(refused(&|mesh| mesh.lumen = vec![0, 99]).contains("lumen entry 1"));
    assert!(refused(&|mesh| mesh.capsule = vec![99]).contains("capsule entry 0"));
    assert!(refused(&|mesh| mesh.covered = vec![0, 1, 99]).contains("covered entry 2"));
    assert!(refused(&|mesh| mesh.shares[3].pentahedron = 99).contains("share 3"));
    assert!(refused(&|mesh| mesh.shares[3].spring = 99).contains("share 3"));
    assert!(refused(&|mesh| mesh.positions.push(DVec3::ZERO)).contains("node 12"));
    assert!(refused(&|mesh| mesh.zones.clear()).contains("0 zones"));
    assert!(refused(&|mesh| mesh.pentahedra.clear()).contains("pentahedra"));
    assert!(refused(&|mesh| mesh.springs.clear()).contains("springs"));
}
