//! What hard cases once showed to be wrong, each with the smallest scene that showed it: numbers at the edge of what single
//! precision holds.

mod common;

use common::networks::{chain, tissue};
use common::{block_mesh, tube};
use glam::Vec3;
use resecta_solver::{CollapseLaw, Contact, Material, ShearResistance, Tissue, TissueMesh, TissuePoint};

const FRAME_S: f64 = 1.0 / 60.0;

/// Advances a tissue to which something was done at some nodes. Each of these may be put aside, once, and the rest goes on.
fn goes_on(case: &str, mut tissue: Tissue, allowed: &[u32], contacts: &[Contact]) {
    let Ok(report) = tissue.advance(FRAME_S, contacts) else {
        return; // Refused by name.
    };
    let named: Vec<u32> = report.put_aside.iter().map(|aside| aside.node).collect();
    assert!(
        named.windows(2).all(|pair| pair[0] < pair[1]),
        "{case}: named twice: {named:?}"
    );
    assert!(
        named.iter().all(|node| allowed.contains(node)),
        "{case}: {named:?} of {allowed:?}"
    );
    assert_eq!(tissue.validate(), Ok(()), "{case}");
    let again = tissue.advance(FRAME_S, contacts).expect("the rest goes on");
    assert_eq!(again.put_aside, [], "{case}: named before");
    assert_eq!(tissue.validate(), Ok(()), "{case}");
}

#[test]
fn a_node_set_far_away_is_refused_or_put_aside_alone() {
    for far in [1e6f32, 1e25, f32::MAX] {
        let mut tissue = tube(18.0, ShearResistance::Diagonals);
        if tissue.set_position(40, Vec3::splat(far)).is_ok() {
            goes_on(&format!("at {far} mm"), tissue, &[40], &[]);
        }
    }
}

#[test]
fn a_contact_that_is_finite_but_beyond_all_scenes_stops_nothing_but_its_nodes() {
    for far in [1e18f32, 1e25, f32::MAX] {
        let start = || tube(18.0, ShearResistance::Diagonals);
        let offset = Contact::with_plane(TissuePoint::node(40), Vec3::X, [far; 2]);
        goes_on(&format!("offset {far} mm"), start(), &[40], &[offset]);
    }
}

#[test]
fn a_collapse_law_with_a_number_that_is_none_leaves_the_rest_going_on() {
    for number in [f32::NAN, f32::INFINITY, f32::MAX] {
        for law in [
            CollapseLaw::CompressionForce { share: number },
            CollapseLaw::HydraulicPressure { resistance_un: number },
        ] {
            let mut tissue = tube(18.0, ShearResistance::Diagonals);
            let near = tissue.pentahedra_near(40, 3.0);
            let cut: Vec<u32> = near
                .iter()
                .flat_map(|&pentahedron| tissue.pentahedron_nodes(pentahedron))
                .collect();
            let allowed: Vec<u32> = (0..tissue.spring_count() as u32)
                .map(|spring| tissue.spring(spring).nodes)
                .filter(|ends| ends.iter().any(|end| cut.contains(end)))
                .flatten()
                .collect();
            tissue.resect(&near, Some(law));
            goes_on(&format!("{law:?}"), tissue, &allowed, &[]);
        }
    }
}

#[test]
fn a_spring_beyond_all_stiffness_is_refused_or_its_nodes_are_named() {
    for stiffness in [1e18f32, 1e20, 1e30, f32::MAX] {
        let mut tissue = tube(18.0, ShearResistance::Diagonals);
        let ends = tissue.spring(10).nodes;
        if tissue.set_spring_stiffness(10, stiffness).is_ok() {
            goes_on(&format!("{stiffness} µN/mm"), tissue, &ends, &[]);
        }
    }
}

#[test]
fn a_spring_beyond_all_length_is_refused_or_its_nodes_are_named_once() {
    for length in [1e10f32, 1e20, f32::MAX] {
        let mut tissue = tube(18.0, ShearResistance::Diagonals);
        let ends = tissue.spring(10).nodes;
        if tissue.set_spring_rest_length(10, length).is_ok() {
            goes_on(&format!("{length} mm"), tissue, &ends, &[]);
        }
    }
}

#[test]
fn damping_beyond_all_drag_holds_its_node() {
    for damping in [1e10f32, 1e30, f32::MAX] {
        let mut tissue = tube(18.0, ShearResistance::Diagonals);
        if tissue.set_damping(10, damping).is_ok() {
            goes_on(&format!("{damping} g/s"), tissue, &[10], &[]);
        }
    }
    let mut network = chain(4, 1.0, 1e-20, 1_000.0, 1e30);
    network.stiffness.fill(1e-20);
    if let Ok(tissue) = Tissue::from_network(&network) {
        goes_on("a network", tissue, &[1, 2, 3], &[]);
    }
}

#[test]
fn a_tissue_that_is_built_is_valid_whatever_its_size_and_material() {
    let build = |case: String, mesh: &TissueMesh, material: &Material| {
        if let Ok(tissue) = Tissue::new(mesh, material) {
            assert_eq!(tissue.validate(), Ok(()), "{case}");
            goes_on(&case, tissue, &[], &[]);
        }
    };
    let plain = Material::default();
    for edge in [1e-20, 1e-16, 1e-12, 1e12, 1e15, 1e20] {
        build(format!("edges of {edge} mm"), &block_mesh([2, 2, 2], edge), &plain);
    }
    let mut mesh = block_mesh([2, 2, 2], 1.0);
    mesh.capsule = vec![0, 1, 2, 3];
    type Put = fn(&mut Material, f64);
    let fields: [(&str, Put); 4] = [
        ("modulus", |material, value| material.modulus_pa = value),
        ("density", |material, value| material.density_g_per_mm3 = value),
        ("viscosity", |material, value| material.viscosity_pa_s = value),
        ("support", |material, value| material.support_pa_per_mm = value),
    ];
    for ((name, put), value) in fields
        .into_iter()
        .flat_map(|field| [1e-60, 1e-43, 1e39, 1e300].map(|value| (field, value)))
    {
        let mut material = plain.clone();
        put(&mut material, value);
        build(format!("{name} {value}"), &mesh, &material);
    }
}

#[test]
fn the_bound_does_not_depend_on_the_unit_of_mass() {
    let bound = |scale: f64| {
        let mut network = chain(12, 1.0, 0.01 * scale, 1_000.0 * scale, 0.0);
        network.positions[5].x += 0.1;
        tissue(&network).bound_s()
    };
    let exact = bound(1.0);
    for power in [-40, -60, -70, -80, -90] {
        let ratio = bound(2.0f64.powi(power)) / exact;
        assert!(ratio < 1.001, "2^{power}: {ratio} times too long");
    }
}

#[test]
fn inverted_elements_recover_or_are_reported() {
    type Shape = (&'static str, fn(Vec3) -> Vec3);
    let shapes: [Shape; 3] = [
        ("stretched three times", |place| place * 3.0),
        ("flat", |place| Vec3::new(place.x, place.y, 15.0)),
        ("turned within itself", |place| {
            Vec3::new(place.y, -place.x, 30.0 - place.z)
        }),
    ];
    for (name, shape) in shapes {
        let mut tissue = tube(18.0, ShearResistance::Diagonals);
        for node in 0..tissue.node_count() as u32 {
            let place = shape(tissue.position(node));
            tissue.set_position(node, place).expect("a finite position");
        }
        for _ in 0..300 {
            tissue.advance(FRAME_S, &[]).expect("divided if need be");
        }
        let inverted: Vec<u32> = tissue
            .living_pentahedron_indices()
            .filter(|&pentahedron| tissue.volume_of(pentahedron) <= 0.0)
            .collect();
        // Springs alone do not turn back what was turned far inside out.
        assert_eq!(tissue.inverted_pentahedra(), inverted, "{name}");
        println!(
            "{name}: {} of {} stay inverted",
            inverted.len(),
            tissue.living_pentahedra()
        );
    }
}
