//! Tissues that the tests share, and how far apart two motions are.
#![allow(dead_code)] // Each test file uses some of them.

use glam::{DVec3, Vec3};
use resecta_gpu::Gpu;
use resecta_solver::{Material, Network, Tissue, TissueMesh};

/// The adapter. Where there is none it says so loudly, and panics under CI, which has one.
pub fn gpu() -> Option<Gpu> {
    match Gpu::open() {
        Ok(gpu) => Some(gpu),
        Err(missing) => {
            assert!(std::env::var_os("CI").is_none(), "{missing}");
            eprintln!("SKIPPED: {missing}");
            None
        }
    }
}

/// A block of `n` cubes of 2 mm a side, each cut into two pentahedra; the bottom is on the capsule.
pub fn block(n: [u32; 3], material: &Material) -> Tissue {
    let index = |x: u32, y: u32, z: u32| (z * (n[1] + 1) + y) * (n[0] + 1) + x;
    let mut positions = Vec::new();
    let mut pentahedra = Vec::new();
    for z in 0..=n[2] {
        for y in 0..=n[1] {
            for x in 0..=n[0] {
                positions.push(DVec3::new(x.into(), y.into(), z.into()) * 2.0);
                if x < n[0] && y < n[1] && z < n[2] {
                    let c = |dx, dy, dz| index(x + dx, y + dy, z + dz);
                    pentahedra.push([c(0, 0, 0), c(1, 1, 0), c(1, 0, 0), c(0, 0, 1), c(1, 1, 1), c(1, 0, 1)]);
                    pentahedra.push([c(0, 0, 0), c(0, 1, 0), c(1, 1, 0), c(0, 0, 1), c(0, 1, 1), c(1, 1, 1)]);
                }
            }
        }
    }
    let mut mesh = TissueMesh::from_pentahedra(positions, pentahedra);
    mesh.capsule = (0..(n[0] + 1) * (n[1] + 1)).collect();
    Tissue::new(&mesh, material).expect("a block is a tissue")
}

/// A block that nothing holds and nothing damps, shaking.
pub fn swinging_block() -> Tissue {
    let material = Material {
        viscosity_pa_s: 0.0,
        support_pa_per_mm: 0.0,
        ..Material::default()
    };
    let mut tissue = block([5, 4, 6], &material);
    shake(&mut tissue, 60.0);
    tissue
}

/// Gives every node a velocity, up to some mm/s a component.
pub fn shake(tissue: &mut Tissue, fastest: f32) {
    for node in 0..tissue.node_count() as u32 {
        let place = tissue.position(node);
        let velocity = Vec3::new((place.y * 0.7).sin(), (place.z * 0.9).cos(), (place.x * 0.5).sin()) * fastest;
        tissue.set_velocity(node, velocity).expect("a finite velocity");
    }
}

/// A cube of `n` nodes a side, 1 mm apart, joined along the axes and across the faces, one side held.
pub fn cube(n: u32, damping: f64) -> Network {
    let place = |node: u32| [node % n, node / n % n, node / n / n];
    let positions: Vec<DVec3> = (0..n * n * n).map(|node| place(node).map(f64::from).into()).collect();
    let mut springs = Vec::new();
    for a in 0..n * n * n {
        for b in a + 1..n * n * n {
            if positions[a as usize].distance_squared(positions[b as usize]) < 2.5 {
                springs.push([a, b]);
            }
        }
    }
    let count = positions.len();
    Network {
        velocities: vec![DVec3::ZERO; count],
        masses: vec![1e-3; count],
        damping: vec![damping; count],
        loads: positions
            .iter()
            .map(|place| DVec3::new(20.0 * place.z, 0.0, -9.0))
            .collect(),
        fixed: (0..n * n * n).map(|node| place(node)[0] == 0).collect(),
        stiffness: vec![1000.0; springs.len()],
        rest_lengths: springs
            .iter()
            .map(|[a, b]| positions[*a as usize].distance(positions[*b as usize]))
            .collect(),
        springs,
        positions,
    }
}

/// The precise positions of a tissue.
pub fn positions(tissue: &Tissue) -> Vec<DVec3> {
    (0..tissue.node_count() as u32)
        .map(|node| tissue.precise_position(node))
        .collect()
}

/// Root mean square distance, mm.
pub fn rms(one: &[DVec3], other: &[DVec3]) -> f64 {
    assert_eq!(one.len(), other.len());
    let sum: f64 = one
        .iter()
        .zip(other)
        .map(|(one, other)| one.distance_squared(*other))
        .sum();
    (sum / one.len() as f64).sqrt()
}
