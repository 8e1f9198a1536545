//! Hard cases of cutting: a cut in every step, all of it cut away, bridges of one node, a capsule freed wholly, loads that go
//! with what carries them, and cuts in tissue that lies flat, inside out or in a point.

mod common;

use common::networks::uniform;
use common::{block_mesh, tube};
use glam::{DVec3, Vec3};
use resecta_solver::{CollapseLaw, Material, NodeKind, ShearResistance, Tissue, TissueMesh};

const LAWS: [Option<CollapseLaw>; 3] = [
    None,
    Some(CollapseLaw::CompressionForce { share: 0.05 }),
    Some(CollapseLaw::HydraulicPressure { resistance_un: 500.0 }),
];

fn living(tissue: &Tissue) -> impl Iterator<Item = u32> + '_ {
    (0..tissue.node_count() as u32).filter(|&node| tissue.is_node_alive(node))
}

/// How far the furthest living node is from where it rests, mm.
fn furthest_from_rest(tissue: &Tissue) -> f32 {
    living(tissue)
        .map(|node| tissue.position(node).distance(tissue.rest_position(node)))
        .fold(0.0, f32::max)
}

#[test]
fn a_cut_each_step_for_a_thousand_steps_keeps_the_tissue_valid() {
    for (law, shear) in LAWS.into_iter().zip([
        ShearResistance::None,
        ShearResistance::Diagonals,
        ShearResistance::PreTension(0.03),
    ]) {
        let mut tissue = tube(12.0, shear);
        let initial = tissue.initial_volume_mm3();
        let mut uniform = uniform();
        let mut removed = 0.0;
        for step in 0..1_000 {
            let left: Vec<u32> = tissue.living_pentahedron_indices().collect();
            let first = left[(uniform() * left.len() as f64) as usize];
            let mut cut = vec![first];
            cut.extend(tissue.pieces_cut_free(&cut));
            removed += tissue.resect(&cut, law).rest_volume_mm3;
            let report = tissue.advance(1.0 / 60.0, &[]).expect("what is left goes on");
            assert_eq!(report.put_aside, [], "{law:?}, step {step}");
            if step % 20 == 19 {
                assert_eq!(tissue.validate(), Ok(()), "{law:?}, step {step}");
                assert!((removed - tissue.removed_volume_mm3()).abs() < 1e-9 * initial);
            }
        }
        // Nothing but resection forces moves it, and they are slight: no node leaves the organ.
        let furthest = furthest_from_rest(&tissue);
        assert!(furthest < 40.0, "{law:?}: {furthest} mm");
    }
}

#[test]
fn all_cut_at_once_or_one_by_one_leaves_nothing_and_goes_on() {
    for (law, at_once) in LAWS.into_iter().flat_map(|law| [(law, true), (law, false)]) {
        let mut tissue = Tissue::new(&block_mesh([3, 2, 2], 2.0), &Material::default()).expect("a block is a tissue");
        let all: Vec<u32> = tissue.living_pentahedron_indices().collect();
        for cut in all.chunks(if at_once { all.len() } else { 1 }) {
            tissue.set_load(35, Vec3::X * 100.0).expect("the last node goes last");
            tissue.resect(cut, law);
            let report = tissue.advance(1.0 / 60.0, &[]).expect("what is left goes on");
            assert_eq!((report.put_aside, tissue.validate()), (vec![], Ok(())), "{law:?}");
        }
        let left = (
            tissue.living_nodes(),
            tissue.living_springs(),
            tissue.living_pentahedra(),
        );
        assert_eq!(left, (0, 0, 0));
        assert_eq!(tissue.bound_s(), f64::INFINITY, "no spring limits the step");
        let energy = tissue.energy();
        assert_eq!((energy.kinetic, energy.elastic), (0.0, 0.0));
    }
}

/// Two blocks of 2 cubes a side that share one corner.
fn bridged() -> TissueMesh {
    let one = block_mesh([2, 2, 2], 2.0);
    let count = one.positions.len() as u32;
    // The last node of the first is the first of the second.
    let second = |node: u32| node + count - 1;
    let mut positions = one.positions.clone();
    positions.extend(one.positions[1..].iter().map(|place| *place + DVec3::splat(4.0)));
    let mut pentahedra = one.pentahedra.clone();
    pentahedra.extend(one.pentahedra.iter().map(|nodes| nodes.map(second)));
    TissueMesh::from_pentahedra(positions, pentahedra)
}

#[test]
fn a_bridge_of_one_node_holds_and_carries_force_until_it_is_cut() {
    // Little enough drag for the force to cross in the time at hand.
    let material = Material {
        viscosity_pa_s: 0.5,
        ..Material::default()
    };
    let mut tissue = Tissue::new(&bridged(), &material).expect("two blocks that touch are a tissue");
    assert_eq!(tissue.validate(), Ok(()));
    let (bridge, far, near) = (26, 52, 0);
    tissue.set_load(far, Vec3::splat(300.0)).expect("a finite load");
    for _ in 0..60 {
        let report = tissue.advance(1.0 / 60.0, &[]).expect("a plain advance");
        assert_eq!((report.put_aside, tissue.validate()), (vec![], Ok(())));
    }
    // Both drift on together, against the drag of both.
    let mean = |tissue: &Tissue, nodes: std::ops::Range<u32>| -> Vec3 {
        let count = nodes.len() as f32;
        nodes.map(|node| tissue.velocity(node)).sum::<Vec3>() / count
    };
    let (pulled, drawn) = (mean(&tissue, 27..53), mean(&tissue, 0..26));
    assert!(
        drawn.dot(pulled) > 0.5 * pulled.length_squared(),
        "{drawn} behind {pulled}"
    );
    // Cut off on one side: the node stays with the other, and what was drawn stops.
    let around: Vec<u32> = tissue.pentahedra_around(bridge).filter(|&found| found >= 16).collect();
    tissue.resect(&around, None);
    assert!(tissue.is_node_alive(bridge));
    for _ in 0..60 {
        tissue.advance(1.0 / 60.0, &[]).expect("a plain advance");
        assert_eq!(tissue.validate(), Ok(()));
    }
    let (stopped, on) = (tissue.velocity(near).length(), tissue.velocity(far).length());
    assert!(stopped < 1e-3 * on, "{stopped} mm/s against {on}");
}

#[test]
fn a_load_that_is_taken_off_or_cut_away_leaves_nothing_behind() {
    for is_cut in [false, true] {
        let mut tissue = tube(12.0, ShearResistance::Diagonals);
        let node = 45;
        tissue
            .set_load(node, Vec3::new(2e3, -1e3, 500.0))
            .expect("a finite load");
        tissue.advance(0.3, &[]).expect("a plain advance");
        let pulled = furthest_from_rest(&tissue);
        assert!(pulled > 0.1, "{pulled} mm");
        if is_cut {
            let around: Vec<u32> = tissue.pentahedra_around(node).collect();
            let resection = tissue.resect(&around, None);
            assert_eq!(resection.nodes.contains(&node), !tissue.is_node_alive(node));
            assert!(!tissue.is_node_alive(node) && tissue.load(node) == Vec3::ZERO);
        } else {
            tissue.set_load(node, Vec3::ZERO).expect("a finite load");
        }
        let mut last = tissue.energy().total();
        for _ in 0..180 {
            tissue.advance(1.0 / 60.0, &[]).expect("a plain advance");
            let energy = tissue.energy().total();
            let rounding = common::networks::rounding_nj(&tissue);
            assert!(energy <= last * (1.0 + 1e-6) + rounding, "{energy} after {last} nJ");
            last = energy;
        }
        let left = furthest_from_rest(&tissue);
        assert!(left < 1e-3 * pulled, "cut {is_cut}: {left} of {pulled} mm");
    }
}

#[test]
fn a_capsule_freed_wholly_lets_the_rest_fall_at_the_speed_of_its_drag() {
    let mut tissue = tube(12.0, ShearResistance::Diagonals);
    let mut shell: Vec<u32> = living(&tissue)
        .filter(|&node| tissue.node_kind(node) == NodeKind::Capsule)
        .flat_map(|node| tissue.pentahedra_around(node).collect::<Vec<_>>())
        .collect();
    shell.sort_unstable();
    shell.dedup();
    tissue.resect(&shell, None);
    assert_eq!(tissue.validate(), Ok(()));
    assert!(tissue.living_pentahedra() > 0 && living(&tissue).all(|node| tissue.node_kind(node) != NodeKind::Capsule));
    let nodes: Vec<u32> = living(&tissue).collect();
    let gravity = 9_810.0;
    for &node in &nodes {
        let load = Vec3::Z * gravity * tissue.mass_g(node);
        tissue.set_load(node, load).expect("a finite load");
    }
    for _ in 0..30 {
        let report = tissue.advance(1.0 / 60.0, &[]).expect("a plain advance");
        assert_eq!((report.put_aside, tissue.validate()), (vec![], Ok(())));
        assert_eq!(tissue.energy().support, 0.0, "no bed holds it");
    }
    for &node in &nodes {
        let speed = tissue.load(node) / tissue.damping_g_per_s(node);
        let off = (tissue.velocity(node) - speed).length() / speed.length();
        assert!(off < 1e-3, "node {node}: {off}");
    }
}

#[test]
fn cuts_in_tissue_that_lies_flat_inside_out_or_in_a_point_keep_it_valid() {
    type Shape = (&'static str, fn(Vec3) -> Vec3);
    let shapes: [Shape; 4] = [
        ("flat", |place| Vec3::new(place.x, place.y, 15.0)),
        ("inside out", |place| Vec3::new(-place.x, place.y, place.z)),
        ("in a point", |_| Vec3::new(0.0, 0.0, 15.0)),
        ("on a line", |place| Vec3::new(0.0, 0.0, place.z)),
    ];
    for ((name, shape), law) in shapes.into_iter().flat_map(|shape| LAWS.map(|law| (shape, law))) {
        let case = format!("{name}, {law:?}");
        let mut tissue = tube(18.0, ShearResistance::Diagonals);
        let initial = tissue.initial_volume_mm3();
        for node in 0..tissue.node_count() as u32 {
            let place = shape(tissue.position(node));
            tissue.set_position(node, place).expect("a finite position");
        }
        for node in [0u32, 300, 700] {
            let near = tissue.pentahedra_near(node, 4.0);
            let resection = tissue.resect(&near, law);
            assert!(resection.current_volume_mm3.is_finite(), "{case}");
            let report = tissue.advance(1.0 / 60.0, &[]).expect("what is left goes on");
            assert_eq!((report.put_aside, tissue.validate()), (vec![], Ok(())), "{case}");
        }
        tissue.advance(0.5, &[]).expect("what is left goes on");
        assert_eq!(tissue.validate(), Ok(()), "{case}");
        let left: f64 = tissue
            .living_pentahedron_indices()
            .map(|pentahedron| tissue.rest_volume_mm3(pentahedron))
            .sum();
        assert!(
            (left + tissue.removed_volume_mm3() - initial).abs() < 1e-9 * initial,
            "{case}"
        );
        assert!(tissue.energy().total().is_finite(), "{case}");
    }
}
