//! Speed beside error, of one core and of the graphics processor in one run: blocks of a thousand to a million nodes.
//!
//! ```text
//! cargo run --release -p resecta_gpu --example measure [MOST_NODES]
//! ```
//!
//! A block's nodes are joined along the axes and across the faces (18 neighbours), one side is held, the rest swings under
//! loads. A substep is timed with all that belongs to it: the checks of the bound, what is recorded, submitted and waited
//! for; the best of three rounds. The error is the distance from a solution in double precision, root mean square over the
//! nodes, after 64 substeps of half the bound.

use std::time::Instant;

use glam::DVec3;
use resecta_gpu::{Gpu, GpuTissue};
use resecta_solver::reference::{self, Inertia};
use resecta_solver::{Network, Tissue};

/// Nodes along an edge: some 10^3, 10^4, 10^5 and 10^6 in all.
const EDGES: [u32; 7] = [10, 16, 22, 32, 46, 68, 100];

/// Substeps until the error is taken, and in a round that is timed.
const UNTIL_ERROR: u32 = 64;
const ROUND: u32 = 384;

type Failure = Box<dyn std::error::Error>;

fn main() -> Result<(), Failure> {
    let most = match std::env::args().nth(1) {
        Some(most) => most.parse()?,
        None => 1_000_000,
    };
    let gpu = Gpu::open()?;
    println!(
        "Graphics processor: {}. Beside it one core of this machine.\n",
        gpu.adapter()
    );
    println!(
        "{:>8} {:>9} {:>11} {:>11} {:>6} {:>10} {:>10} {:>10} {:>10} {:>8} {:>8}",
        "nodes",
        "springs",
        "core, µs",
        "GPU, µs",
        "times",
        "core, mm",
        "GPU, mm",
        "apart, mm",
        "way, mm",
        "copy, ms",
        "read, ms"
    );
    for edge in EDGES.into_iter().filter(|edge| edge.pow(3) <= most) {
        measure(&gpu, edge)?;
    }
    Ok(())
}

fn measure(gpu: &Gpu, edge: u32) -> Result<(), Failure> {
    let mut plain = Tissue::from_network(&block(edge))?;
    let start = positions(&plain);
    let step_s = 0.5 * plain.bound_s();
    let exact = reference::positions_after(&plain, step_s * f64::from(UNTIL_ERROR), UNTIL_ERROR, Inertia::AsStepped);
    let since = Instant::now();
    let mut moving = GpuTissue::new(gpu, &plain)?;
    let copy_ms = 1e3 * since.elapsed().as_secs_f64();

    plain.advance_steps(step_s, UNTIL_ERROR.into())?;
    moving.advance_steps(step_s, UNTIL_ERROR.into())?;
    let since = Instant::now();
    let moved = moving.positions()?;
    let read_ms = 1e3 * since.elapsed().as_secs_f64();
    let plain_moved = positions(&plain);

    let core_us = best_us(|| Ok(plain.advance_steps(step_s, ROUND.into())?.substeps))?;
    let gpu_us = best_us(|| Ok(moving.advance_steps(step_s, ROUND.into())?.substeps))?;
    println!(
        "{:>8} {:>9} {core_us:>11.1} {gpu_us:>11.1} {:>6.2} {:>10.2e} {:>10.2e} {:>10.2e} {:>10.2e} {copy_ms:>8.1} {read_ms:>8.1}",
        plain.node_count(),
        plain.spring_count(),
        core_us / gpu_us,
        rms(&plain_moved, &exact),
        rms(&moved, &exact),
        rms(&plain_moved, &moved),
        rms(&exact, &start),
    );
    Ok(())
}

/// The least time a substep takes in three rounds, µs.
fn best_us(mut round: impl FnMut() -> Result<u32, Failure>) -> Result<f64, Failure> {
    let mut best = f64::INFINITY;
    for _ in 0..3 {
        let since = Instant::now();
        let substeps = round()?;
        best = best.min(1e6 * since.elapsed().as_secs_f64() / f64::from(substeps));
    }
    Ok(best)
}

/// A block of so many nodes an edge, 1 mm apart.
fn block(edge: u32) -> Network {
    let count = edge.pow(3);
    let place = |node: u32| [node % edge, node / edge % edge, node / edge / edge];
    let positions: Vec<DVec3> = (0..count).map(|node| place(node).map(f64::from).into()).collect();
    // Along the axes and across the faces, each once.
    let ways = [
        [1, 0, 0],
        [0, 1, 0],
        [0, 0, 1],
        [1, 1, 0],
        [1, -1, 0],
        [1, 0, 1],
        [1, 0, -1],
        [0, 1, 1],
        [0, 1, -1],
    ];
    let other = |node: u32, way: [i32; 3]| -> Option<u32> {
        let mut index = 0;
        for axis in [2, 1, 0] {
            let at = place(node)[axis]
                .checked_add_signed(way[axis])
                .filter(|at| *at < edge)?;
            index = index * edge + at;
        }
        Some(index)
    };
    let mut springs = Vec::new();
    for way in ways {
        springs.extend((0..count).filter_map(|node| Some([node, other(node, way)?])));
    }
    let swing = |place: &DVec3| DVec3::new((0.7 * place.y).sin(), (0.9 * place.z).cos(), (0.5 * place.x).sin()) * 20.0;
    Network {
        velocities: positions.iter().map(swing).collect(),
        masses: vec![1e-3; positions.len()],
        damping: vec![1e-2; positions.len()],
        loads: vec![DVec3::new(30.0, -20.0, 10.0); positions.len()],
        fixed: (0..count).map(|node| place(node)[2] == 0).collect(),
        stiffness: vec![1000.0; springs.len()],
        rest_lengths: springs
            .iter()
            .map(|[a, b]: &[u32; 2]| positions[*a as usize].distance(positions[*b as usize]))
            .collect(),
        springs,
        positions,
    }
}

fn positions(tissue: &Tissue) -> Vec<DVec3> {
    (0..tissue.node_count() as u32)
        .map(|node| tissue.precise_position(node))
        .collect()
}

/// Root mean square distance, mm.
fn rms(one: &[DVec3], other: &[DVec3]) -> f64 {
    let sum: f64 = one
        .iter()
        .zip(other)
        .map(|(one, other)| one.distance_squared(*other))
        .sum();
    (sum / one.len() as f64).sqrt()
}
