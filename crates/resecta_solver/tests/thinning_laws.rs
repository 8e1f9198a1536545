//! Laws of cuts finer than the elements: what must hold when pentahedra are thinned rather than removed.

mod common;

use common::tube;
use proptest::prelude::*;
use resecta_solver::{CollapseLaw, ShearResistance, Tissue};

fn mass(tissue: &Tissue) -> f64 {
    let living = (0..tissue.node_count() as u32).filter(|&node| tissue.is_node_alive(node));
    living.map(|node| f64::from(tissue.mass_g(node))).sum()
}

fn held(tissue: &Tissue) -> f64 {
    let of = |pentahedron| tissue.rest_volume_mm3(pentahedron) * tissue.fill(pentahedron);
    tissue.living_pentahedron_indices().map(of).sum()
}

#[test]
fn mass_and_stiffness_follow_the_fill() {
    let whole = tube(15.0, ShearResistance::Diagonals);
    let mut tissue = whole.clone();
    let all: Vec<(u32, f64)> = whole.living_pentahedron_indices().map(|index| (index, 0.3)).collect();
    let resection = tissue.thin(&all, None);
    assert!((resection.rest_volume_mm3 / whole.initial_volume_mm3() - 0.7).abs() < 1e-12);
    assert_eq!(resection.taken_mm3.len(), all.len());
    assert!(resection.pentahedra.is_empty() && resection.springs.is_empty() && resection.surface.is_empty());
    assert!((mass(&tissue) / mass(&whole) - 0.3).abs() < 1e-5);
    for spring in 0..whole.spring_count() as u32 {
        let ratio = tissue.spring(spring).stiffness / whole.spring(spring).stiffness;
        assert!((ratio - 0.3).abs() < 1e-4, "spring {spring}: {ratio}");
    }
    // Both by the same share: nothing swings faster, once the bound has been measured anew.
    tissue.advance(1.0 / 60.0, &[]).expect("a plain advance");
    let ratio = tissue.bound_s() / whole.clone().bound_s();
    assert!((ratio - 1.0).abs() < 1e-3, "{ratio}");
}

#[test]
fn thinning_to_nothing_is_a_resection() {
    let mut cut = tube(15.0, ShearResistance::Diagonals);
    let mut thinned = cut.clone();
    let near = cut.pentahedra_near(45, 5.0);
    let whole = cut.resect(&near, None);
    let mut sum = 0.0;
    for left in [0.8, 0.35, 0.02] {
        let left: Vec<(u32, f64)> = near.iter().map(|&index| (index, left)).collect();
        sum += thinned.thin(&left, None).rest_volume_mm3;
    }
    let nothing: Vec<(u32, f64)> = near.iter().map(|&index| (index, 0.0)).collect();
    let last = thinned.thin(&nothing, None);
    assert!((sum + last.rest_volume_mm3 - whole.rest_volume_mm3).abs() < 1e-9);
    assert_eq!(
        (&last.pentahedra, &last.springs, &last.nodes),
        (&whole.pentahedra, &whole.springs, &whole.nodes)
    );
    assert_eq!(last.surface, whole.surface);
    assert_eq!(last.capsule_area_mm2, whole.capsule_area_mm2);
    assert_eq!(thinned.validate(), Ok(()));
    for node in (0..cut.node_count() as u32).filter(|&node| cut.is_node_alive(node)) {
        let ratio = thinned.mass_g(node) / cut.mass_g(node);
        assert!((ratio - 1.0).abs() < 1e-5, "node {node}: {ratio}");
    }
    for spring in (0..cut.spring_count() as u32).filter(|&spring| cut.is_spring_alive(spring)) {
        let (one, other) = (thinned.spring(spring).stiffness, cut.spring(spring).stiffness);
        assert!(
            (one - other).abs() <= 1e-4 * other,
            "spring {spring}: {one} and {other}"
        );
    }
}

#[test]
fn without_a_law_thinning_tissue_at_rest_moves_nothing() {
    for shear in [ShearResistance::PreTension(0.03), ShearResistance::Diagonals] {
        let mut tissue = tube(12.0, shear);
        let near = tissue.pentahedra_near(45, 5.0);
        let left: Vec<(u32, f64)> = near
            .iter()
            .zip(1..)
            .map(|(&index, n)| (index, 1.0 / f64::from(n)))
            .collect();
        tissue.thin(&left, None);
        tissue.advance(0.2, &[]).expect("a plain advance");
        for node in (0..tissue.node_count() as u32).filter(|&node| tissue.is_node_alive(node)) {
            let moved = tissue.position(node).distance(tissue.rest_position(node));
            assert!(moved < 1e-4, "{shear:?}: node {node} moved by {moved} mm");
        }
    }
}

#[test]
fn the_laws_of_collapse_act_in_proportion() {
    // Thinned in one cut or in many, tissue comes to rest in the same place; and half the law moves it half as far.
    let after = |law: CollapseLaw, steps: i32| {
        let mut tissue = tube(15.0, ShearResistance::Diagonals);
        let near = tissue.pentahedra_near(45, 4.0);
        for step in 1..=steps {
            let left = 0.1f64.powf(f64::from(step) / f64::from(steps));
            let left: Vec<(u32, f64)> = near.iter().map(|&index| (index, left)).collect();
            tissue.thin(&left, Some(law));
        }
        for _ in 0..60 {
            tissue.advance(1.0 / 30.0, &[]).expect("a plain advance");
        }
        tissue
    };
    let moved = |tissue: &Tissue| -> f32 {
        let nodes = 0..tissue.node_count() as u32;
        nodes.fold(0.0, |most, node| {
            most.max(tissue.position(node).distance(tissue.rest_position(node)))
        })
    };
    let apart = |one: &Tissue, other: &Tissue| -> f32 {
        let nodes = 0..one.node_count() as u32;
        nodes.fold(0.0, |most, node| {
            most.max(one.position(node).distance(other.position(node)))
        })
    };
    let laws: [fn(f32) -> CollapseLaw; 2] = [
        |size| CollapseLaw::HydraulicPressure {
            resistance_un: 50.0 * size,
        },
        |size| CollapseLaw::CompressionForce { share: 0.01 * size },
    ];
    for (number, law) in laws.into_iter().enumerate() {
        let once = after(law(1.0), 1);
        let way = moved(&once);
        assert!(way > 0.01, "law {number}: {way} mm");
        let half = moved(&after(law(0.5), 1)) / way;
        assert!((0.45..0.55).contains(&half), "law {number}: {half}");
        // The differences between what the ends hold grow on the way, so the second law lags behind its single step.
        let apart = apart(&once, &after(law(1.0), 8)) / way;
        let most = [0.02, 0.6][number];
        assert!(apart < most, "law {number}: {apart}");
    }
}

#[test]
fn what_makes_no_sense_takes_nothing() {
    let mut tissue = tube(15.0, ShearResistance::Diagonals);
    let count = tissue.pentahedron_count() as u32;
    tissue.thin(&[(3, 0.5)], None);
    let nonsense = [(0, f64::NAN), (1, 1.0), (2, f64::INFINITY), (3, 0.7), (count, 0.0)];
    assert_eq!(tissue.thin(&nonsense, None).rest_volume_mm3, 0.0);
    // Named twice, the least counts; less than nothing is nothing.
    let resection = tissue.thin(&[(5, 0.5), (5, 0.2), (6, -3.0)], None);
    let taken: Vec<u32> = resection.taken_mm3.iter().map(|(index, _)| *index).collect();
    assert_eq!((taken, resection.pentahedra), (vec![5, 6], vec![6]));
    assert_eq!((tissue.fill(5), tissue.fill(6), tissue.fill(count)), (0.2, 0.0, 0.0));
    assert_eq!(tissue.validate(), Ok(()));
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 24, ..ProptestConfig::default() })]

    #[test]
    fn random_thinning_keeps_tissue_consistent_and_conserves_volume_and_mass(
        cuts in prop::collection::vec((any::<prop::sample::Index>(), 1.0f64..5.0, 0.0f64..1.0), 1..12),
        law in 0usize..3,
    ) {
        let law = [
            None,
            Some(CollapseLaw::default()),
            Some(CollapseLaw::HydraulicPressure { resistance_un: 200.0 }),
        ][law];
        let mut tissue = tube(18.0, ShearResistance::Diagonals);
        let initial = tissue.initial_volume_mm3();
        let density = mass(&tissue) / initial;
        for (place, radius, share) in cuts {
            let node = place.index(tissue.node_count()) as u32;
            let near = tissue.pentahedra_near(node, radius);
            // Every third goes.
            let left: Vec<(u32, f64)> = near
                .iter()
                .map(|&index| (index, if index % 3 == 0 { 0.0 } else { tissue.fill(index) * share }))
                .collect();
            let before = held(&tissue);
            let resection = tissue.thin(&left, law);
            prop_assert!((before - held(&tissue) - resection.rest_volume_mm3).abs() < 1e-9 * initial);
            prop_assert!((mass(&tissue) / density - held(&tissue)).abs() < 1e-4 * initial);
            tissue.advance(1.0 / 60.0, &[]).expect("what is left goes on");
            prop_assert_eq!(tissue.validate(), Ok(()));
        }
    }
}
