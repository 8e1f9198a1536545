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

/// The force that each plate is pressed with at rest, N: the one below, then that above.
fn plates(ratio: f64, effort: Effort) -> [f64; 2] {
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
    let mut forces = [0.0; 2];
    for step in 0..((PRESSES_S + RESTS_S) / STEP_S) as u32 {
        let [from, to] = [step, step + 1].map(|step| pressed(f64::from(step) * STEP_S));
        let plate = |nodes: &[u32], normal: Vec3, offset: f32| -> Vec<Contact> {
            let contact =
                |&node: &u32| Contact::with_plane(TissuePoint::node(node), normal, [offset + from, offset + to]);
            nodes.iter().map(contact).collect()
        };
        let mut contacts = plate(&below, Vec3::Z, 0.0);
        contacts.extend(plate(&above, Vec3::NEG_Z, -SIDE_MM as f32));
        tissue.advance(STEP_S, &contacts).expect("a stable step");
        let touches: Vec<f64> = tissue.touches().map(|touch| f64::from(touch.force_un.z)).collect();
        let (on_below, on_above) = touches.split_at(below.len());
        forces = [on_below, on_above].map(|of| of.iter().sum::<f64>() * 1e-6);
    }
    forces
}

#[test]
fn a_pressed_block_takes_what_its_modulus_says() {
    let strain = f64::from(PRESSED_MM) / SIDE_MM;
    let expected_n = MODULUS * SIDE_MM * SIDE_MM * strain * 1e-6;
    // Springs stretch by engineering strain and the area grows by twice the ratio: the second order is of the strain's size. Where
    // inertias are raised, velocities go to neighbours before the plates take them (`viscosity.rs`), and some to the medium.
    for (effort, most_missed) in [(Effort::FULL, 0.02), (Effort::FAST, 0.06)] {
        for ratio in [0.25, 0.45] {
            let [below_n, above_n] = plates(ratio, effort);
            let missed = below_n / expected_n - 1.0;
            println!("ratio {ratio}, {effort:?}: {:+.1} %", 100.0 * missed);
            // Action and reaction: it rests.
            assert!((below_n + above_n).abs() < 0.001 * expected_n, "{below_n} {above_n}");
            assert!(missed.abs() < most_missed, "{below_n} of {expected_n}");
        }
    }
}
