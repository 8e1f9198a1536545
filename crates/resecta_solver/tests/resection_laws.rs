//! Laws of resection: what must hold after any cut.

mod common;

use common::{block_mesh, tube};
use glam::Vec3;
use proptest::prelude::*;
use resecta_solver::{CollapseLaw, Material, ShearResistance, Tissue, Zone};

const LAWS: [Option<CollapseLaw>; 3] = [
    None,
    Some(CollapseLaw::CompressionForce { share: 0.05 }),
    Some(CollapseLaw::HydraulicPressure { resistance_un: 500.0 }),
];

fn left(tissue: &Tissue) -> f64 {
    tissue
        .living_pentahedron_indices()
        .map(|pentahedron| tissue.rest_volume_mm3(pentahedron))
        .sum()
}

#[test]
fn a_new_tissue_is_consistent() {
    for shear in [
        ShearResistance::None,
        ShearResistance::PreTension(0.03),
        ShearResistance::Diagonals,
    ] {
        assert_eq!(tube(12.0, shear).validate(), Ok(()), "{shear:?}");
    }
    let block = Tissue::new(&block_mesh([3, 4, 5], 1.5), &Material::default()).expect("a block is a tissue");
    assert_eq!(block.validate(), Ok(()));
}

#[test]
fn mass_is_density_times_volume_before_and_after_a_cut() {
    let mut tissue = tube(12.0, ShearResistance::Diagonals);
    let mass = |tissue: &Tissue| -> f64 {
        (0..tissue.node_count() as u32)
            .filter(|&node| tissue.is_node_alive(node))
            .map(|node| f64::from(tissue.mass_g(node)))
            .sum()
    };
    assert!((mass(&tissue) / (tissue.initial_volume_mm3() * 1e-3) - 1.0).abs() < 1e-4);
    let near = tissue.pentahedra_near(0, 5.0);
    tissue.resect(&near, None);
    assert!((mass(&tissue) / (left(&tissue) * 1e-3) - 1.0).abs() < 1e-4);
}

#[test]
fn nodes_about_a_point_are_those_that_live_and_are_no_further() {
    let mut tissue = tube(12.0, ShearResistance::Diagonals);
    let near = tissue.pentahedra_near(0, 5.0);
    tissue.resect(&near, None);
    let all: Vec<u32> = (0..tissue.node_count() as u32)
        .filter(|&node| tissue.is_node_alive(node))
        .collect();
    assert!(all.len() < tissue.node_count(), "some are gone");
    for (point, radius_mm) in [
        (tissue.position(0), 6.0),
        (tissue.position(900) + Vec3::new(0.3, -0.2, 0.1), 3.0),
        (Vec3::splat(1e4), 10.0),
        (Vec3::NAN, 10.0),
    ] {
        let far = |node: &u32| tissue.position(*node).distance(point);
        let within: Vec<u32> = all.iter().copied().filter(|node| far(node) <= radius_mm).collect();
        assert_eq!(tissue.nodes_within(point, radius_mm), within, "{point}");
        let nearest = within.iter().copied().min_by(|a, b| far(a).total_cmp(&far(b)));
        assert_eq!(tissue.nearest_node(point, radius_mm), nearest, "{point}");
    }
}

#[test]
fn the_enclosed_volume_falls_by_what_a_cut_says_it_removed_even_in_deformed_tissue() {
    let mut tissue = tube(12.0, ShearResistance::Diagonals);
    for node in 0..200 {
        tissue
            .set_load(node, Vec3::new(300.0, 100.0, -200.0))
            .expect("a finite load");
    }
    tissue.advance(0.1, &[]).expect("a plain advance");
    let before = tissue.volume_mm3();
    let near = tissue.pentahedra_near(30, 4.0);
    let resection = tissue.resect(&near, None);
    assert!((before - tissue.volume_mm3() - resection.current_volume_mm3).abs() < 1e-6 * before);
    assert!(
        (resection.rest_volume_mm3 - resection.current_volume_mm3).abs() > 1e-6,
        "the tissue was deformed"
    );
    assert!((resection.by_zone_mm3[Zone::Other.index()] - resection.rest_volume_mm3).abs() < 1e-9);
}

#[test]
fn cutting_the_same_pentahedra_twice_removes_them_once() {
    let mut tissue = tube(12.0, ShearResistance::Diagonals);
    let near = tissue.pentahedra_near(0, 4.0);
    let first = tissue.resect(&near, None);
    assert_eq!(first.pentahedra, near);
    let again = tissue.resect(&near, None);
    assert_eq!(again.rest_volume_mm3, 0.0);
    assert!(again.pentahedra.is_empty() && again.surface.is_empty());
}

#[test]
fn everything_can_be_cut_away() {
    for law in LAWS {
        let mut tissue = tube(15.0, ShearResistance::Diagonals);
        let all: Vec<u32> = tissue.living_pentahedron_indices().collect();
        for cut in all.chunks(97) {
            tissue.resect(cut, law);
            tissue.advance(1.0 / 60.0, &[]).expect("what is left goes on");
        }
        assert_eq!(
            (
                tissue.living_nodes(),
                tissue.living_springs(),
                tissue.living_pentahedra()
            ),
            (0, 0, 0)
        );
        assert_eq!(tissue.surface().triangles().count(), 0);
        assert_eq!(tissue.validate(), Ok(()));
        assert!((tissue.removed_volume_mm3() / tissue.initial_volume_mm3() - 1.0).abs() < 1e-12);
        tissue.advance(1.0 / 60.0, &[]).expect("nothing at all goes on too");
    }
}

#[test]
fn removing_springs_never_adds_energy() {
    let mut tissue = tube(12.0, ShearResistance::Diagonals);
    for node in 0..200 {
        tissue
            .set_load(node, Vec3::new(0.0, 400.0, 0.0))
            .expect("a finite load");
    }
    tissue.advance(0.1, &[]).expect("a plain advance");
    for node in [10, 80, 150] {
        let before = tissue.energy().total();
        let near = tissue.pentahedra_near(node, 4.0);
        tissue.resect(&near, None);
        assert!(tissue.energy().total() <= before);
    }
}

#[test]
fn both_laws_move_the_tissue_into_the_cavity_and_not_at_once() {
    for law in [LAWS[1], LAWS[2]] {
        let mut tissue = tube(12.0, ShearResistance::Diagonals);
        let contact = 3 * 15;
        let centre = tissue.position(contact);
        let near = tissue.pentahedra_near(contact, 5.0);
        let resection = tissue.resect(&near, law);
        // The nodes on the wall of the cavity: corners of the faces that the cut exposed.
        let mut wall: Vec<u32> = resection
            .surface
            .filled
            .iter()
            .filter_map(|&slot| tissue.surface().triangle(slot))
            .flatten()
            .collect();
        wall.sort_unstable();
        wall.dedup();
        let distance = |tissue: &Tissue| -> f32 {
            wall.iter()
                .map(|&node| tissue.position(node).distance(centre))
                .sum::<f32>()
                / wall.len() as f32
        };
        let start = distance(&tissue);
        tissue.advance(1.0 / 60.0, &[]).expect("a plain advance");
        let first = start - distance(&tissue);
        for _ in 0..120 {
            tissue.advance(1.0 / 60.0, &[]).expect("a plain advance");
        }
        let last = start - distance(&tissue);
        assert!(last > 0.05, "{law:?}: the wall came {last} mm closer");
        assert!(first < 0.2 * last, "{law:?}: {first} of {last} mm in the first step");
        assert!(last < 2.0, "{law:?}: a slight collapse, not {last} mm");
    }
}

#[test]
fn without_a_law_a_cut_in_tissue_at_rest_moves_nothing() {
    for shear in [
        ShearResistance::None,
        ShearResistance::PreTension(0.03),
        ShearResistance::Diagonals,
    ] {
        let mut tissue = tube(12.0, shear);
        let near = tissue.pentahedra_near(45, 5.0);
        tissue.resect(&near, None);
        tissue.advance(0.2, &[]).expect("a plain advance");
        for node in (0..tissue.node_count() as u32).filter(|&node| tissue.is_node_alive(node)) {
            let moved = tissue.position(node).distance(tissue.rest_position(node));
            assert!(moved < 1e-4, "{shear:?}: node {node} moved by {moved} mm");
        }
    }
}

#[test]
fn more_is_taken_by_a_larger_radius_and_all_of_it_is_near() {
    let tissue = tube(10.0, ShearResistance::None);
    let node = 40;
    let mut last: Vec<u32> = Vec::new();
    for radius in [3.0, 4.0, 5.0, 8.0] {
        let near = tissue.pentahedra_near(node, radius);
        assert!(last.iter().all(|pentahedron| near.contains(pentahedron)));
        assert!(near.len() > last.len());
        let around: Vec<u32> = tissue.pentahedra_around(node).collect();
        for &pentahedron in &near {
            let distance = f64::from(tissue.centroid(pentahedron).distance(tissue.position(node)));
            assert!(distance <= radius || around.contains(&pentahedron));
        }
        last = near;
    }
    for radius in [0.0, -1.0, f64::NAN] {
        assert!(tissue.pentahedra_near(node, radius).is_empty());
    }
    assert!(tissue.pentahedra_near(u32::MAX, 5.0).is_empty());
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 24, ..ProptestConfig::default() })]

    #[test]
    fn random_cuts_keep_the_tissue_consistent_and_conserve_volume(
        cuts in prop::collection::vec((any::<prop::sample::Index>(), 1.0f64..6.0), 1..12),
        law in 0usize..3,
        shear in 0usize..3,
    ) {
        let shear = [ShearResistance::None, ShearResistance::PreTension(0.03), ShearResistance::Diagonals][shear];
        let mut tissue = tube(18.0, shear);
        let initial = tissue.initial_volume_mm3();
        let mut removed = 0.0;
        for (place, radius) in cuts {
            let node = place.index(tissue.node_count()) as u32;
            let near = tissue.pentahedra_near(node, radius);
            let resection = tissue.resect(&near, LAWS[law]);
            removed += resection.rest_volume_mm3;
            tissue.advance(1.0 / 60.0, &[]).expect("what is left goes on");
            prop_assert_eq!(tissue.validate(), Ok(()));
            prop_assert!((left(&tissue) + removed - initial).abs() < 1e-9 * initial);
            prop_assert!((removed - tissue.removed_volume_mm3()).abs() < 1e-9 * initial);
        }
    }
}

#[test]
fn a_piece_that_hangs_by_nothing_comes_free_and_the_organ_does_not() {
    // A row of 20 cubes, cut through near one end: the two cubes beyond hang by nothing.
    let tissue = Tissue::new(&block_mesh([1, 1, 20], 1.0), &Material::default()).expect("a row is a tissue");
    let of_cubes = |cubes: std::ops::Range<u32>| -> Vec<u32> { (2 * cubes.start..2 * cubes.end).collect() };
    assert_eq!(tissue.pieces_cut_free(&of_cubes(17..18)), of_cubes(18..20));
    assert_eq!(tissue.pieces_cut_free(&of_cubes(0..1)), [0u32; 0]);
    // Both ends at once; cut in the middle there are two halves, and neither is a piece of the other.
    let two_cuts: Vec<u32> = of_cubes(2..3).into_iter().chain(of_cubes(17..18)).collect();
    let both_ends: Vec<u32> = of_cubes(0..2).into_iter().chain(of_cubes(18..20)).collect();
    assert_eq!(tissue.pieces_cut_free(&two_cuts), both_ends);
    let halves = Tissue::new(&block_mesh([1, 1, 21], 1.0), &Material::default()).expect("a row is a tissue");
    assert_eq!(halves.pieces_cut_free(&of_cubes(10..11)), [0u32; 0]);
    // What is not there cuts nothing.
    assert_eq!(tissue.pieces_cut_free(&[9999]), [0u32; 0]);
}
