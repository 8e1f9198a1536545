//! Hard cases of shape: elements that are flat, twice there or inside out, tissue that starts in such shapes, tiny cells,
//! things alone, and a tool driven through at 1 m/s.

mod common;

use common::networks::{at_rest, chain, rounding_nj, tissue, uniform};
use common::{block_mesh, drive_tool_through, tube};
use glam::{DVec3, Vec3};
use resecta_solver::{Material, MeshError, NetworkError, ShearResistance, Tissue, TissueMesh};

const SHEARS: [ShearResistance; 3] = [
    ShearResistance::None,
    ShearResistance::PreTension(0.03),
    ShearResistance::Diagonals,
];

fn inverted(tissue: &Tissue) -> usize {
    tissue
        .living_pentahedron_indices()
        .filter(|&pentahedron| tissue.volume_of(pentahedron) <= 0.0)
        .count()
}

#[test]
fn a_pentahedron_that_is_flat_inside_out_or_twice_there_is_refused_by_name() {
    let build = |change: &dyn Fn(&mut Vec<DVec3>, &mut Vec<[u32; 6]>)| {
        let mesh = block_mesh([2, 1, 1], 1.0);
        let (mut positions, mut pentahedra) = (mesh.positions, mesh.pentahedra);
        change(&mut positions, &mut pentahedra);
        let mesh = TissueMesh::from_pentahedra(positions, pentahedra);
        let error = Tissue::new(&mesh, &Material::default()).map(|_| ());
        error.expect_err("it is refused")
    };
    let flat = build(&|positions, _| positions[6..].iter_mut().for_each(|place| place.z = 0.0));
    assert!(
        matches!(flat, MeshError::Inverted { index: 0, .. } | MeshError::NoLength(_)),
        "{flat}"
    );
    // One cell alone is squeezed to a sheet of the other.
    let sheared = build(&|positions, _| {
        positions[6..]
            .iter_mut()
            .for_each(|place| *place = DVec3::new(place.x + 5.0, place.y, 0.0))
    });
    assert!(matches!(sheared, MeshError::Inverted { index: 0, .. }), "{sheared}");
    let inside_out = build(&|_, pentahedra| {
        pentahedra[2].swap(1, 2);
        pentahedra[2].swap(4, 5);
    });
    assert!(
        matches!(inside_out, MeshError::Inverted { index: 2, .. }),
        "{inside_out}"
    );
    let mirrored = build(&|positions, _| positions.iter_mut().for_each(|place| place.x = -place.x));
    assert!(matches!(mirrored, MeshError::Inverted { index: 0, .. }), "{mirrored}");
    let twice = build(&|_, pentahedra| pentahedra.push(pentahedra[3]));
    assert!(matches!(twice, MeshError::NotManifold(_)), "{twice}");
    let folded = build(&|_, pentahedra| pentahedra[1][2] = pentahedra[1][1]);
    assert!(!folded.to_string().is_empty());
}

#[test]
fn tissue_that_starts_in_any_shape_neither_blows_up_nor_gains_energy_at_any_step() {
    type Shape = (&'static str, fn(Vec3) -> Vec3);
    let shapes: [Shape; 7] = [
        ("stretched three times", |place| place * 3.0),
        ("flat", |place| Vec3::new(place.x, place.y, 15.0)),
        ("on a line", |place| Vec3::new(0.0, 0.0, place.z)),
        ("in a point", |_| Vec3::new(0.0, 0.0, 15.0)),
        ("inside out", |place| Vec3::new(-place.x, place.y, place.z)),
        ("turned within itself", |place| {
            Vec3::new(place.y, -place.x, 30.0 - place.z)
        }),
        ("at random", |place| {
            let wild = |a: Vec3| ((a.dot(place) * 12.9898).sin() * 43_758.547).rem_euclid(1.0);
            Vec3::new(wild(Vec3::X) - 0.5, wild(Vec3::Y) - 0.5, wild(Vec3::Z)) * 30.0
        }),
    ];
    for ((name, shape), shear) in shapes.into_iter().flat_map(|shape| SHEARS.map(|shear| (shape, shear))) {
        let mut start = tube(18.0, shear);
        for node in 0..start.node_count() as u32 {
            let place = shape(start.position(node));
            start.set_position(node, place).expect("a finite position");
        }
        let first = start.energy().total();
        for step_s in [1e-5, 1e-3, 1.0 / 60.0, 0.2] {
            let case = format!("{name}, {shear:?}, steps of {step_s} s");
            let mut tissue = start.clone();
            for _ in 0..(0.6f64 / step_s).ceil().min(100.0) as u32 {
                let report = tissue.advance(step_s, &[]).expect("divided if need be");
                assert_eq!(report.put_aside, [], "{case}");
                let energy = tissue.energy().total();
                // A symplectic step swings about the true energy, most where a mode is near the bound.
                assert!(
                    energy <= 1.05 * first + rounding_nj(&tissue),
                    "{case}: {energy} of {first} nJ"
                );
            }
            assert_eq!(tissue.validate(), Ok(()), "{case}");
            // Springs that all pull have one place to rest, with every element the right way round. (Diagonals may come to
            // rest elsewhere.)
            if matches!(shear, ShearResistance::PreTension(_)) && step_s > 1e-2 {
                assert_eq!(inverted(&tissue), 0, "{case}");
            }
        }
    }
}

#[test]
fn a_node_pushed_through_its_cells_comes_back_and_the_cells_turn_right_again() {
    let start = tube(12.0, ShearResistance::Diagonals);
    let inner: Vec<u32> = (0..start.node_count() as u32)
        .filter(|&node| start.pentahedra_around(node).count() == 12)
        .collect();
    for &node in inner.iter().step_by(97) {
        let mut tissue = start.clone();
        let longest = (0..start.spring_count() as u32)
            .map(|spring| start.spring(spring))
            .filter(|spring| spring.nodes.contains(&node))
            .map(|spring| spring.rest_length)
            .fold(0.0, f32::max);
        let through = 1.5 * longest * start.rest_position(node).with_z(0.0).normalize();
        tissue
            .set_position(node, start.rest_position(node) + through)
            .expect("a finite position");
        assert!(inverted(&tissue) > 0, "node {node} is through");
        for _ in 0..120 {
            tissue.advance(1.0 / 60.0, &[]).expect("a plain advance");
        }
        assert_eq!(inverted(&tissue), 0, "node {node}");
        let left = tissue.position(node).distance(tissue.rest_position(node));
        assert!(left < 1e-3 * through.length(), "node {node} is {left} mm away");
    }
}

#[test]
fn tiny_cells_alone_or_beside_large_ones_move_like_any_others() {
    for edge in [1e-6, 1e-3, 1.0, 1e3] {
        let mut tissue = Tissue::new(&block_mesh([2, 2, 2], edge), &Material::default()).expect("a tiny block");
        tissue
            .set_velocity(13, Vec3::new(0.1, 0.2, -0.1) * edge as f32)
            .expect("a finite velocity");
        let first = tissue.energy().total();
        let report = tissue.advance(1.0 / 60.0, &[]).expect("a plain advance");
        assert_eq!((report.put_aside, tissue.validate()), (vec![], Ok(())), "edge {edge}");
        assert!(
            tissue.energy().total() <= 1.05 * first + rounding_nj(&tissue),
            "edge {edge}"
        );
    }
    // One layer of cells is thinner than the rest by any ratio.
    for thin in [1e-2, 1e-4, 1e-5] {
        let mut mesh = block_mesh([3, 3, 3], 1.0);
        for place in mesh.positions.iter_mut().filter(|place| place.z > 1.5) {
            place.z -= 1.0 - thin;
        }
        let mut tissue = Tissue::new(&mesh, &Material::default()).expect("a thin layer is a layer");
        let mut uniform = uniform();
        for node in 0..64 {
            let velocity = Vec3::new(uniform() as f32, uniform() as f32, uniform() as f32) * 20.0;
            tissue.set_velocity(node, velocity).expect("a finite velocity");
        }
        tissue.bound_s(); // gives the nodes their inertias
        let first = tissue.energy().total();
        for _ in 0..30 {
            let report = tissue.advance(1.0 / 60.0, &[]).expect("divided if need be");
            assert_eq!((report.put_aside, tissue.validate()), (vec![], Ok(())), "{thin}");
            let energy = tissue.energy().total();
            assert!(
                energy <= 1.05 * first + rounding_nj(&tissue),
                "{thin}: {energy} of {first} nJ"
            );
        }
    }
}

#[test]
fn a_single_node_and_a_single_pentahedron_move_by_themselves() {
    assert!(matches!(
        Tissue::from_network(&Default::default()),
        Err(NetworkError::Size(0))
    ));
    // Without a spring nothing limits the step, and x = F / m t² / 2 is what leapfrog makes exactly.
    let mut network = at_rest(vec![DVec3::ZERO], Vec::new(), 0.01, 0.0, 0.0);
    network.loads[0] = DVec3::new(8e-3, 0.0, -4e-3);
    let mut alone = tissue(&network);
    for step_s in [1e-3, 0.1, 1.0] {
        alone.advance_steps(step_s, 10).expect("no spring limits the step");
    }
    let time = 10.0 * (1e-3 + 0.1 + 1.0);
    let exact = network.loads[0] / 0.01 * time * time / 2.0;
    let off = alone.precise_position(0).distance(exact) / exact.length();
    assert!(off < 40.0 * f64::from(f32::EPSILON), "{off}");

    let mesh = block_mesh([1, 1, 1], 2.0);
    let mut one = Tissue::new(&mesh, &Material::default()).expect("a cube is a tissue");
    one.resect(&[1], None);
    assert_eq!((one.living_pentahedra(), one.validate()), (1, Ok(())));
    one.set_load(0, Vec3::X * 100.0).expect("a finite load");
    for _ in 0..60 {
        let report = one.advance(1.0 / 60.0, &[]).expect("a plain advance");
        assert_eq!((report.put_aside, one.validate()), (vec![], Ok(())));
    }
    assert_eq!(inverted(&one), 0);
}

#[test]
fn springs_side_by_side_add_up_and_one_from_a_node_to_itself_does_nothing() {
    let mut single = chain(4, 1.0, 0.01, 3_000.0, 0.1);
    single.loads[3] = DVec3::new(40.0, 20.0, 0.0);
    let mut double = single.clone();
    double.stiffness.fill(1_000.0);
    for n in 1..4u32 {
        for (ends, stiffness) in [([n, n - 1], 1_500.0), ([n - 1, n], 500.0)] {
            double.springs.push(ends);
            double.stiffness.push(stiffness);
            double.rest_lengths.push(1.0);
        }
    }
    double.springs.push([2, 2]);
    double.stiffness.push(5_000.0);
    double.rest_lengths.push(1.0);
    let (mut single, mut double) = (tissue(&single), tissue(&double));
    let step_s = 0.4 * single.bound_s().min(double.bound_s());
    for tissue in [&mut single, &mut double] {
        tissue.advance_steps(step_s, 500).expect("within the bound");
    }
    for node in 0..4 {
        let apart = single.precise_position(node).distance(double.precise_position(node));
        // A length rounded otherwise, for three springs, in all steps.
        assert!(
            apart < 3.0 * 4.0 * f64::from(f32::EPSILON) * 500.0f64.sqrt(),
            "node {node}: {apart}"
        );
    }
}

#[test]
fn a_tool_driven_through_at_a_metre_a_second_leaves_tissue_that_comes_back() {
    for (step_s, shear) in [1.0 / 240.0, 1.0 / 60.0]
        .into_iter()
        .flat_map(|step_s| SHEARS.map(|shear| (step_s, shear)))
    {
        let case = format!("{shear:?}, steps of {step_s} s");
        let mut tissue = tube(12.0, shear);
        let rest = tissue.volume_mm3();
        drive_tool_through(&mut tissue, step_s, |tissue, report| {
            assert_eq!((report.put_aside, report.contacts_refused), (vec![], 0), "{case}");
            assert_eq!(tissue.validate(), Ok(()), "{case}");
        });
        let mut last = tissue.energy().total();
        let pressed = last;
        for _ in 0..180 {
            let report = tissue.advance(1.0 / 60.0, &[]).expect("divided if need be");
            assert_eq!(report.put_aside, [], "{case}");
            let energy = tissue.energy().total();
            assert!(
                energy <= 1.05 * last + rounding_nj(&tissue),
                "{case}: {energy} after {last} nJ"
            );
            last = energy;
        }
        assert_eq!(tissue.validate(), Ok(()), "{case}");
        // What resists shear comes back whole; the bare lattice may have buckled.
        if shear != ShearResistance::None {
            assert_eq!(inverted(&tissue), 0, "{case}");
            let off = (tissue.volume_mm3() / rest - 1.0).abs();
            assert!(off < 1e-6, "{case}: the volume is off by {off}");
        }
        assert!(last < 0.1 * pressed, "{case}: {last} of {pressed} nJ");
    }
}
