//! What sleeps, what wakes it, and that sleep does not show.

mod common;

use common::tube;
use glam::Vec3;
use resecta_solver::{CollapseLaw, Contact, ShearResistance, Tissue, TissuePoint};

const STEP_S: f64 = 1.0 / 60.0;

fn advance(tissue: &mut Tissue, steps: u32) {
    for _ in 0..steps {
        tissue.advance(STEP_S, &[]).expect("a plain advance");
    }
}

/// A tube that has had the time to fall asleep.
fn sleeper() -> Tissue {
    let mut tissue = tube(12.0, ShearResistance::Diagonals);
    advance(&mut tissue, 10);
    assert_eq!(tissue.sleeping_share(), 1.0);
    tissue
}

fn load(tissue: &mut Tissue, node: u32, force: Vec3) {
    tissue.set_load(node, force).expect("a finite load");
}

fn largest_distance(one: &Tissue, other: &Tissue) -> f32 {
    (0..one.node_count() as u32)
        .map(|node| one.position(node).distance(other.position(node)))
        .fold(0.0, f32::max)
}

#[test]
fn a_tissue_at_rest_falls_asleep_and_is_computed_no_more() {
    let mut tissue = sleeper();
    let version = tissue.motion_version();
    let report = tissue.advance(STEP_S, &[]).expect("a plain advance");
    assert_eq!((report.substeps, tissue.motion_version()), (0, version));
    assert_eq!(tissue.energy().kinetic, 0.0, "sleepers have no velocity");
    assert!(tissue.advance(-1.0, &[]).is_err(), "what is no step is refused as ever");
}

#[test]
fn a_fine_lattice_sleeps_though_rounding_makes_it_tremble() {
    // The finer, the higher the frequencies, and the faster the nodes tremble: here faster than the aim a second.
    let mut tissue = tube(4.0, ShearResistance::Diagonals);
    advance(&mut tissue, 1);
    let fastest = |tissue: &Tissue| {
        let speeds = (0..tissue.node_count() as u32).map(|node| tissue.velocity(node).length());
        speeds.fold(0.0, f32::max)
    };
    assert!(fastest(&tissue) > tissue.error_aim_mm());
    advance(&mut tissue, 4);
    assert_eq!(tissue.sleeping_share(), 1.0);
}

#[test]
fn a_pressed_tissue_comes_to_rest_and_sleeps() {
    let mut tissue = sleeper();
    load(&mut tissue, 40, Vec3::new(0.0, 300.0, 0.0));
    let mut steps = 0;
    while tissue.sleeping_share() < 1.0 {
        assert!(steps < 600, "{} of it sleeps after 10 s", tissue.sleeping_share());
        advance(&mut tissue, 1);
        steps += 1;
    }
    assert!(steps > 5, "nothing moved");
}

#[test]
fn sleep_does_not_show() {
    // An aim that is this small keeps a tissue awake.
    let mut awake = tube(12.0, ShearResistance::Diagonals);
    awake.set_error_aim_mm(1e-7).expect("a plain aim");
    let mut tissue = tube(12.0, ShearResistance::Diagonals);
    let (mut partly, mut worst) = (false, 0.0f32);
    for round in 0..6 {
        let node = 37 + 211 * round;
        for tissue in [&mut tissue, &mut awake] {
            load(tissue, node, Vec3::new(150.0, -80.0, 60.0));
        }
        for _ in 0..50 {
            advance(&mut tissue, 1);
            advance(&mut awake, 1);
            partly |= (0.1..0.9).contains(&tissue.sleeping_share());
            worst = worst.max(largest_distance(&tissue, &awake));
        }
    }
    assert_eq!(awake.sleeping_share(), 0.0);
    assert!(partly, "parts of it sleep on their own");
    assert!(worst < tissue.error_aim_mm(), "{worst} mm apart");
}

#[test]
fn edits_contacts_and_cuts_wake() {
    let triangle = sleeper().surface().triangle(0).expect("a tube has a surface");
    let wakers: [(&str, Box<dyn Fn(&mut Tissue)>); 6] = [
        ("load", Box::new(|tissue| load(tissue, 7, Vec3::X))),
        (
            "velocity",
            Box::new(|tissue| tissue.set_velocity(7, Vec3::X).expect("a finite velocity")),
        ),
        (
            "position",
            Box::new(|tissue| {
                let place = tissue.position(7) + Vec3::X;
                tissue.set_position(7, place).expect("a finite position");
            }),
        ),
        (
            "spring",
            Box::new(|tissue| tissue.set_spring_rest_length(3, 5.0).expect("a finite length")),
        ),
        (
            "cut",
            Box::new(|tissue| {
                let near = tissue.pentahedra_near(7, 4.0);
                tissue.resect(&near, Some(CollapseLaw::default()));
            }),
        ),
        (
            "contact",
            Box::new(move |tissue| {
                let normal = Vec3::Z;
                let height = tissue.position(triangle[0]).dot(normal);
                let contact = Contact::with_plane(TissuePoint::node(triangle[0]), normal, [height, height + 1.0]);
                tissue.advance(STEP_S, &[contact]).expect("a plain advance");
            }),
        ),
    ];
    for (name, wake) in wakers {
        let mut tissue = sleeper();
        wake(&mut tissue);
        assert!(tissue.sleeping_share() < 1.0, "{name}");
        let before: Vec<Vec3> = (0..tissue.node_count() as u32)
            .map(|node| tissue.position(node))
            .collect();
        advance(&mut tissue, 2);
        let moved = (0..)
            .zip(&before)
            .any(|(node, before)| tissue.position(node) != *before);
        assert!(moved, "{name}");
    }
}

#[test]
fn what_is_under_way_does_not_fall_asleep() {
    // A load so small that its node hardly moves in a step, and then does not stop.
    let mut tissue = sleeper();
    for node in 0..tissue.node_count() as u32 {
        load(&mut tissue, node, Vec3::new(0.0, 0.0, 0.05));
    }
    let start = tissue.position(100).z;
    advance(&mut tissue, 120);
    let mut awake = tube(12.0, ShearResistance::Diagonals);
    awake.set_error_aim_mm(1e-7).expect("a plain aim");
    for node in 0..awake.node_count() as u32 {
        load(&mut awake, node, Vec3::new(0.0, 0.0, 0.05));
    }
    advance(&mut awake, 120);
    assert!(awake.position(100).z > start, "the load moves it");
    let apart = largest_distance(&tissue, &awake);
    assert!(apart < tissue.error_aim_mm(), "{apart} mm apart");
}
