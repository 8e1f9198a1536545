//! Threads inside one tissue: the same bits with any number of them.

mod common;

use common::networks::{cube, tissue};
use common::tube;
use glam::{DVec3, Vec3};
use resecta_solver::{CollapseLaw, Contact, ShearResistance, Tissue, TissuePoint};

const STEP_S: f64 = 1.0 / 60.0;

/// Positions and velocities of all nodes.
fn state(tissue: &Tissue) -> Vec<(DVec3, Vec3)> {
    (0..tissue.node_count() as u32)
        .map(|node| (tissue.precise_position(node), tissue.velocity(node)))
        .collect()
}

/// What an operation does to a tissue: pushes, pulls, cuts, and a while of rest.
fn operate(tissue: &mut Tissue) -> Vec<(DVec3, Vec3)> {
    let middle = tissue.node_count() as u32 / 2;
    tissue
        .set_load(middle, Vec3::new(400.0, -300.0, 200.0))
        .expect("a finite load");
    let top = tissue.position(7);
    let push = Contact::with_plane(
        TissuePoint::on_triangle([7, 8, 9], [0.2, 0.3, 0.5]),
        Vec3::X,
        [top.x, top.x + 0.3],
    );
    let mut states = Vec::new();
    for step in 0..8 {
        if step == 3 {
            let near = tissue.pentahedra_near(middle, 4.0);
            tissue.resect(&near, Some(CollapseLaw::default()));
        }
        let contacts: &[Contact] = if step < 4 { &[push] } else { &[] };
        tissue.advance(STEP_S, contacts).expect("a plain advance");
        if step == 6 && tissue.is_node_alive(11) {
            tissue.set_velocity(11, Vec3::splat(30.0)).expect("a finite velocity");
        }
        states.extend(state(tissue));
    }
    states
}

#[test]
fn the_number_of_threads_changes_no_bit() {
    // A lattice of rings, in which springs close over nearly all sites, with and without diagonals; and a network with few
    // springs in the same direction.
    let mut shuffled = cube(17, 1e-3, 300.0, 0.05);
    for (n, ends) in shuffled.springs.iter_mut().enumerate() {
        if n % 11 == 0 {
            ends.swap(0, 1);
        }
        if n % 37 == 0 {
            ends[1] = (ends[0] + n as u32 * 7919) % 17u32.pow(3);
            if ends[0] == ends[1] {
                ends[1] = (ends[0] + 1) % 17u32.pow(3);
            }
        }
    }
    let scenes: [(&str, Tissue); 3] = [
        ("tube", tube(4.0, ShearResistance::None)),
        ("tube with diagonals", tube(4.0, ShearResistance::Diagonals)),
        ("network", tissue(&shuffled)),
    ];
    for (name, scene) in scenes {
        let mut one = scene.clone();
        assert_eq!(one.threads(), 1);
        let expected = operate(&mut one);
        for threads in [2, 3] {
            let mut several = scene.clone();
            assert_eq!(
                several.set_threads(threads),
                threads,
                "{name}: {} nodes",
                several.node_count()
            );
            assert!(operate(&mut several) == expected, "{name} with {threads} threads");
        }
    }
}

#[test]
fn sleepers_stay_where_they_are_whatever_the_number_of_threads() {
    let mut one = tube(4.0, ShearResistance::Diagonals);
    let mut two = one.clone();
    two.set_threads(2);
    let mut shares = Vec::new();
    for step in 0..16 {
        for tissue in [&mut one, &mut two] {
            if step == 6 {
                tissue.set_load(40, Vec3::Y * 300.0).expect("a finite load");
            }
            tissue.advance(STEP_S, &[]).expect("a plain advance");
        }
        assert!(state(&one) == state(&two));
        assert_eq!(one.sleeping_share(), two.sleeping_share());
        shares.push(one.sleeping_share());
    }
    assert!(shares.iter().any(|share| (0.01..0.99).contains(share)), "{shares:?}");
}

#[test]
fn small_tissues_stay_with_one_thread() {
    assert_eq!(tube(18.0, ShearResistance::None).set_threads(8), 1);
    let mut large = tube(4.0, ShearResistance::None);
    assert_eq!(
        [large.set_threads(2), large.set_threads(0), large.set_threads(1)],
        [2, 1, 1]
    );
}
