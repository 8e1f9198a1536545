//! The force of a contact against a closed form: a block between two plates without friction takes E A ε, whatever its Poisson's ratio.

mod common;

use common::blocks::{MODULUS, block};
use glam::Vec3;
use resecta_solver::{Contact, Effort, Material, ShearResistance, Tissue, TissuePoint};

/// Side of the block, mm, how far the plates come together, mm, and time to do so and then to rest, s.
const SIDE_MM: f64 = 24.0;
const PRESSED_MM: f32 = 0.48;
const PRESSES_S: f64 = 0.5;
const RESTS_S: f64 = 1.0;
const STEP_S: f64 = 1.0 / 60.0;

/// What plates are pressed with at rest.
struct Pressed {
    /// The force on each, N: the one below, then that above.
    forces_n: [f64; 2],
    /// How many contacts each has.
    contacts: usize,
    /// The most that a node lies inside a plate, mm.
    sunk_mm: f32,
}

/// Plates whose contacts push with no more than a force each.
fn plates(ratio: f64, effort: Effort, most_force_un: f32) -> Pressed {
    let mesh = block([SIDE_MM; 3], [2.0; 3], ShearResistance::Diagonals);
    let material = Material {
        modulus_pa: MODULUS,
        poisson_ratio: Some(ratio),
        support_pa_per_mm: 0.0,
        shear: ShearResistance::Diagonals,
        ..Material::default()
    };
    let mut tissue = Tissue::new(&mesh, &material).expect("a block is a tissue");
    tissue.set_effort(effort);
    let at = |z: f32| -> Vec<u32> {
        let nodes = 0..tissue.node_count() as u32;
        nodes
            .filter(|&node| (tissue.rest_position(node).z - z).abs() < 1e-3)
            .collect()
    };
    let (below, above) = (at(0.0), at(SIDE_MM as f32));
    let pressed = |time_s: f64| 0.5 * PRESSED_MM * (time_s / PRESSES_S).min(1.0) as f32;
    let mut pressed_with = Pressed {
        forces_n: [0.0; 2],
        contacts: below.len(),
        sunk_mm: 0.0,
    };
    for step in 0..((PRESSES_S + RESTS_S) / STEP_S) as u32 {
        let [from, to] = [step, step + 1].map(|step| pressed(f64::from(step) * STEP_S));
        let plate = |nodes: &[u32], normal: Vec3, offset: f32| -> Vec<Contact> {
            let contact = |&node: &u32| Contact {
                most_force_un,
                ..Contact::with_plane(TissuePoint::node(node), normal, [offset + from, offset + to])
            };
            nodes.iter().map(contact).collect()
        };
        let mut contacts = plate(&below, Vec3::Z, 0.0);
        contacts.extend(plate(&above, Vec3::NEG_Z, -SIDE_MM as f32));
        tissue.advance(STEP_S, &contacts).expect("a stable step");
        let touches: Vec<f64> = tissue.touches().map(|touch| f64::from(touch.force_un.z)).collect();
        let (on_below, on_above) = touches.split_at(below.len());
        pressed_with.forces_n = [on_below, on_above].map(|of| of.iter().sum::<f64>() * 1e-6);
        let sunk = below.iter().map(|&node| to - tissue.position(node).z);
        pressed_with.sunk_mm = sunk.fold(0.0, f32::max);
    }
    pressed_with
}

#[test]
fn a_pressed_block_takes_what_its_modulus_says() {
    let strain = f64::from(PRESSED_MM) / SIDE_MM;
    let expected_n = MODULUS * SIDE_MM * SIDE_MM * strain * 1e-6;
    // Springs stretch by engineering strain and the area grows by twice the ratio: the second order is of the strain's size. Where
    // inertias are raised, velocities go to neighbours before the plates take them (`viscosity.rs`), and some to the medium.
    for (effort, most_missed) in [(Effort::FULL, 0.02), (Effort::fast(MODULUS), 0.06)] {
        for ratio in [0.25, 0.45] {
            let [below_n, above_n] = plates(ratio, effort, f32::INFINITY).forces_n;
            let missed = below_n / expected_n - 1.0;
            println!("ratio {ratio}, {effort:?}: {:+.1} %", 100.0 * missed);
            // Action and reaction: it rests.
            assert!((below_n + above_n).abs() < 0.001 * expected_n, "{below_n} {above_n}");
            assert!(missed.abs() < most_missed, "{below_n} of {expected_n}");
        }
    }
}

#[test]
fn a_plate_that_may_not_push_as_hard_lets_tissue_in_and_pushes_no_harder() {
    let whole = plates(0.45, Effort::FULL, f32::INFINITY);
    assert!(whole.sunk_mm < 1e-3, "{} mm", whole.sunk_mm);
    let half_n = 0.5 * whole.forces_n[0];
    let each_un = (half_n / whole.contacts as f64 * 1e6) as f32;
    let half = plates(0.45, Effort::FULL, each_un);
    // Half of the force presses the block half as far in, and nodes at the rim, which bear less, all the way.
    assert!(
        (0.9..1.001).contains(&(half.forces_n[0] / half_n)),
        "{:?} of {half_n}",
        half.forces_n
    );
    assert!(
        (0.2..0.35).contains(&(half.sunk_mm / PRESSED_MM)),
        "{} mm",
        half.sunk_mm
    );
    let ample = plates(0.45, Effort::FULL, 100.0 * each_un);
    assert!(ample.sunk_mm < 1e-3 && (ample.forces_n[0] / whole.forces_n[0] - 1.0).abs() < 1e-3);
}
