//! Solids of springs against beam theory.

mod common;

use std::collections::BTreeMap;

use common::networks::{at_rest, tissue};
use glam::DVec3;
use resecta_solver::Network;

/// Of an isotropic lattice of cubes of 1 mm with springs along edges and face diagonals, µN/mm. Its modulus in Pa is 2.5 times
/// that over the edge in mm (Born and Huang 1954), its Poisson's ratio 1/4.
const STIFFNESS: f64 = 1000.0;
const MODULUS_PA: f64 = 2.5 * STIFFNESS;
const POISSON: f64 = 0.25;
/// Mass of a node, g, and length of the beam over its width.
const MASS: f64 = 1e-3;
const SLENDERNESS: u32 = 6;

/// A beam of `n` by `n` cubes along z. Every cube lends its edges a quarter and its face diagonals half of their stiffness.
fn beam(n: u32) -> Network {
    let length = SLENDERNESS * n;
    let index = |[x, y, z]: [u32; 3]| (z * (n + 1) + y) * (n + 1) + x;
    let places = (0..=length).flat_map(|z| (0..=n).flat_map(move |y| (0..=n).map(move |x| [x, y, z])));
    let positions: Vec<DVec3> = places.map(|place| DVec3::from(place.map(f64::from))).collect();
    let mut springs: BTreeMap<[u32; 2], f64> = BTreeMap::new();
    let corners = |at: [u32; 3]| (0..8u32).map(move |c| [at[0] + (c & 1), at[1] + (c >> 1 & 1), at[2] + (c >> 2)]);
    for cell in (0..length).flat_map(|z| (0..n).flat_map(move |y| (0..n).map(move |x| [x, y, z]))) {
        for a in corners(cell) {
            for b in corners(cell) {
                let (a, b) = (index(a), index(b));
                let apart = positions[a as usize].distance_squared(positions[b as usize]);
                let share = if apart < 1.5 { 0.25 } else { 0.5 };
                if a < b && apart < 2.5 {
                    *springs.entry([a, b]).or_default() += share * STIFFNESS;
                }
            }
        }
    }
    let (ends, stiffness): (Vec<[u32; 2]>, Vec<f64>) = springs.into_iter().unzip();
    let mut network = at_rest(positions, ends, MASS, STIFFNESS, 0.0);
    network.stiffness = stiffness;
    network
}

/// How far the free end of a clamped beam sinks under a force, over Timoshenko's theory.
fn sinking_over_theory(n: u32) -> f64 {
    let mut network = beam(n);
    let (width, length) = (f64::from(n), f64::from(SLENDERNESS * n));
    let (area, second_moment) = (width * width, width.powi(4) / 12.0);
    let shear_factor = 10.0 * (1.0 + POISSON) / (12.0 + 11.0 * POISSON);
    let shear_modulus = MODULUS_PA / (2.0 * (1.0 + POISSON));
    let compliance =
        length.powi(3) / (3.0 * MODULUS_PA * second_moment) + length / (shear_factor * shear_modulus * area);
    let sinking = 1e-3 * length;
    let force = sinking / compliance;
    let end = |place: &DVec3| (place.z - length).abs() < 1e-9;
    let at_end = network.positions.iter().filter(|place| end(place)).count() as f64;
    // Critical damping of the slowest bending of the clamped beam.
    let slowest = 1.875f64.powi(2) * (MODULUS_PA * second_moment / (MASS * area)).sqrt() / length.powi(2);
    network.damping.fill(2.0 * slowest * MASS);
    for (place, (fixed, load)) in network
        .positions
        .iter()
        .zip(network.fixed.iter_mut().zip(&mut network.loads))
    {
        *fixed = place.z == 0.0;
        if end(place) {
            *load = DVec3::X * force / at_end;
        }
    }
    let mut tissue = tissue(&network);
    tissue.advance_steps(25.0 / slowest, 1).expect("a plain step");
    let moved = (0u32..).zip(&network.positions).filter(|(_, place)| end(place));
    let moved: f64 = moved
        .map(|(node, place)| (tissue.precise_position(node) - *place).x)
        .sum();
    moved / at_end / sinking
}

#[test]
fn a_clamped_beam_sinks_as_beam_theory_says_with_an_error_of_order_two() {
    let [coarse, fine] = [4, 8].map(sinking_over_theory);
    // By Richardson: what is left with infinitely many cubes is the clamped end, which theory leaves out.
    let limit = (4.0 * fine - coarse) / 3.0;
    println!("4 cubes: {coarse:.4}, 8 cubes: {fine:.4}, in the limit {limit:.4} of the theory");
    assert!((limit - 1.0).abs() < 0.02, "{limit}");
    assert!((fine - limit).abs() < 0.04, "{fine}");
    assert!((coarse - limit).abs() > 2.0 * (fine - limit).abs());
}
