//! A ring of springs under pre-tension, loaded alike all around: what it does follows from a small linear system, exactly at
//! any deformation.

mod common;

use std::f64::consts::{PI, TAU};

use common::networks::{at_rest, tissue};
use glam::DVec3;
use resecta_solver::{Network, Tissue};

const ANGLES: usize = 24;
/// Layers that move; one more is held.
const LAYERS: usize = 4;
const STIFFNESS: f64 = 1_000.0;
const MASS: f64 = 0.01;

fn radius(layer: usize) -> f64 {
    6.0 + 2.0 * layer as f64
}

fn node(angle: usize, layer: usize) -> u32 {
    (angle % ANGLES * (LAYERS + 1) + layer) as u32
}

fn way(angle: usize) -> DVec3 {
    let (sin, cos) = (TAU * angle as f64 / ANGLES as f64).sin_cos();
    DVec3::new(cos, sin, 0.0)
}

/// Every spring is shorter at rest than drawn by the share `tension`.
fn annulus(tension: f64, damping_rate: f64) -> Network {
    let mut positions = Vec::new();
    let mut springs = Vec::new();
    for angle in 0..ANGLES {
        for layer in 0..=LAYERS {
            positions.push(way(angle) * radius(layer));
            springs.push([node(angle, layer), node(angle + 1, layer)]);
            if layer < LAYERS {
                springs.push([node(angle, layer), node(angle, layer + 1)]);
            }
        }
    }
    let mut network = at_rest(positions, springs, MASS, STIFFNESS, damping_rate * MASS);
    network
        .rest_lengths
        .iter_mut()
        .for_each(|length| *length *= 1.0 - tension);
    for angle in 0..ANGLES {
        network.fixed[node(angle, LAYERS) as usize] = true;
    }
    network
}

/// Pushes each node of the innermost layer outward.
fn push(network: &mut Network, force: f64) {
    for angle in 0..ANGLES {
        network.loads[node(angle, 0) as usize] = way(angle) * force;
    }
}

/// The matrix A and the right side b of A r = b for the radii of the layers that move:
/// `k (r_l - r_(l-1) - l0r) - k (r_(l+1) - r_l - l0r) + 4 k sin²(π/na) r_l - 2 k l0t_l sin(π/na) = f_l`.
fn system(tension: f64, force: f64) -> ([[f64; LAYERS]; LAYERS], [f64; LAYERS]) {
    let sin = (PI / ANGLES as f64).sin();
    let radial = 2.0 * (1.0 - tension);
    let (mut matrix, mut right) = ([[0.0; LAYERS]; LAYERS], [0.0; LAYERS]);
    for layer in 0..LAYERS {
        let hoop = 2.0 * radius(layer) * sin * (1.0 - tension);
        matrix[layer][layer] += STIFFNESS * (1.0 + 4.0 * sin * sin);
        right[layer] += STIFFNESS * (2.0 * hoop * sin - radial);
        if layer > 0 {
            matrix[layer][layer] += STIFFNESS;
            matrix[layer][layer - 1] = -STIFFNESS;
            right[layer] += STIFFNESS * radial;
        }
        if layer + 1 < LAYERS {
            matrix[layer][layer + 1] = -STIFFNESS;
        } else {
            right[layer] += STIFFNESS * radius(LAYERS);
        }
    }
    right[0] += force;
    (matrix, right)
}

/// Gauss without pivoting: the matrix is dominated by its diagonal.
fn solved(mut matrix: [[f64; LAYERS]; LAYERS], mut right: [f64; LAYERS]) -> [f64; LAYERS] {
    for pivot in 0..LAYERS {
        for row in pivot + 1..LAYERS {
            let factor = matrix[row][pivot] / matrix[pivot][pivot];
            let above = matrix[pivot];
            for (value, above) in matrix[row].iter_mut().zip(above) {
                *value -= factor * above;
            }
            right[row] -= factor * right[pivot];
        }
    }
    let mut unknown = [0.0; LAYERS];
    for row in (0..LAYERS).rev() {
        let known: f64 = (row + 1..LAYERS)
            .map(|column| matrix[row][column] * unknown[column])
            .sum();
        unknown[row] = (right[row] - known) / matrix[row][row];
    }
    unknown
}

/// Squares of frequencies and modes (columns) of a symmetric matrix over the mass, by Jacobi's rotations.
fn modes(mut matrix: [[f64; LAYERS]; LAYERS]) -> ([f64; LAYERS], [[f64; LAYERS]; LAYERS]) {
    let mut vectors = [[0.0; LAYERS]; LAYERS];
    (0..LAYERS).for_each(|n| vectors[n][n] = 1.0);
    let pairs = || (0..LAYERS).flat_map(|p| (p + 1..LAYERS).map(move |q| (p, q)));
    for (p, q) in (0..30).flat_map(|_| pairs()) {
        let angle = 0.5 * (2.0 * matrix[p][q]).atan2(matrix[q][q] - matrix[p][p]);
        let (sin, cos) = angle.sin_cos();
        for row in 0..LAYERS {
            let (a, b) = (matrix[row][p], matrix[row][q]);
            (matrix[row][p], matrix[row][q]) = (cos * a - sin * b, sin * a + cos * b);
            let (a, b) = (vectors[row][p], vectors[row][q]);
            (vectors[row][p], vectors[row][q]) = (cos * a - sin * b, sin * a + cos * b);
        }
        let (first, second) = (matrix[p], matrix[q]);
        matrix[p] = std::array::from_fn(|column| cos * first[column] - sin * second[column]);
        matrix[q] = std::array::from_fn(|column| sin * first[column] + cos * second[column]);
    }
    (std::array::from_fn(|n| matrix[n][n] / MASS), vectors)
}

/// Largest distance of a node from where its layer should be, mm.
fn off(tissue: &Tissue, radii: &[f64; LAYERS]) -> f64 {
    let of = |angle: usize, layer: usize| {
        let place = tissue.precise_position(node(angle, layer));
        place.distance(way(angle) * radii[layer])
    };
    (0..ANGLES)
        .flat_map(|angle| (0..LAYERS).map(move |layer| of(angle, layer)))
        .fold(0.0, f64::max)
}

/// Moves the nodes that are not held by up to a µm, each its own way.
fn disturb(network: &mut Network) {
    let mut uniform = common::networks::uniform();
    for (place, fixed) in network.positions.iter_mut().zip(&network.fixed) {
        let by = DVec3::new(uniform(), uniform(), uniform()) * 2.0 - 1.0;
        *place += if *fixed { DVec3::ZERO } else { by * 1e-3 };
    }
}

#[test]
fn an_annulus_under_tension_comes_to_rest_at_the_radii_of_the_linear_system() {
    for (tension, force) in [(0.02, 5.0), (0.05, 0.0), (0.05, 20.0), (0.05, -20.0)] {
        let (matrix, right) = system(tension, force);
        let radii = solved(matrix, right);
        let mut network = annulus(tension, 60.0);
        push(&mut network, force);
        disturb(&mut network);
        let mut tissue = tissue(&network);
        tissue.advance_steps(1e-3, 4_000).expect("divided if need be");
        // Every spring between a node and the layer that is held is off by the rounding of its length; the hoops make it no more.
        let rounding = LAYERS as f64 * 2.0 * radius(LAYERS) * f64::from(f32::EPSILON);
        let off = off(&tissue, &radii);
        assert!(
            off < 4.0 * rounding,
            "tension {tension}, force {force}: {off} of {rounding} mm"
        );
    }
}

#[test]
fn without_tension_the_same_load_buckles() {
    let deviation = |tension: f64| {
        let (matrix, right) = system(tension, 20.0);
        let mut network = annulus(tension, 60.0);
        push(&mut network, 20.0);
        disturb(&mut network);
        let mut tissue = tissue(&network);
        tissue.advance_steps(1e-3, 4_000).expect("divided if need be");
        off(&tissue, &solved(matrix, right))
    };
    let (taut, slack) = (deviation(0.05), deviation(0.0));
    assert!(taut < 1e-4, "a µm of disturbance dies out: {taut} mm");
    assert!(slack > 1e-2, "a µm of disturbance grows: {slack} mm");
}

#[test]
fn an_annulus_breathes_as_the_sum_of_its_modes_with_an_error_of_order_two() {
    // m r'' + m α r' + A r = b: each mode of A swings by itself, c e^(-α t / 2) (cos wd t + α / 2 wd sin wd t).
    let (tension, rate, time) = (0.05, 30.0, 0.03);
    let (matrix, right) = system(tension, 0.0);
    let rest = solved(matrix, right);
    let start = [0.3, -0.2, 0.25, 0.1];
    let (squares, vectors) = modes(matrix);
    let mut exact = rest;
    for mode in 0..LAYERS {
        let share: f64 = (0..LAYERS).map(|layer| vectors[layer][mode] * start[layer]).sum();
        let wd = (squares[mode] - 0.25 * rate * rate).sqrt();
        let swing = (wd * time).cos() + 0.5 * rate / wd * (wd * time).sin();
        for layer in 0..LAYERS {
            exact[layer] += vectors[layer][mode] * share * (-0.5 * rate * time).exp() * swing;
        }
    }
    let mut network = annulus(tension, rate);
    for (angle, layer) in (0..ANGLES).flat_map(|angle| (0..LAYERS).map(move |layer| (angle, layer))) {
        network.positions[node(angle, layer) as usize] = way(angle) * (rest[layer] + start[layer]);
    }
    let error = |steps: u32| {
        let mut tissue = tissue(&network);
        let report = tissue
            .advance_steps(time / f64::from(steps), steps.into())
            .expect("within the bound");
        assert_eq!(report.substeps, steps, "no step is divided");
        off(&tissue, &exact)
    };
    let errors = [80, 160, 320].map(error);
    for pair in errors.windows(2) {
        let order = (pair[0] / pair[1]).log2();
        assert!((1.95..2.05).contains(&order), "order {order}: {errors:?} mm");
    }
}
