//! Our tissue and rapier's soft bodies on one scene: what each costs for which error, as tables in Markdown.
//! `cargo bench -p resecta_methods --features rapier --bench beside_rapier`, with cells a side as arguments, or 9 and 21 (1,000
//! and 10,648 nodes).
//!
//! The block of `scene.rs` swings for 0.2 s, which is timed, and is at rest at 0.7 s. Two errors, since the two models are not
//! the same: `swing` is that of the nodes' places against the same model in steps so short that it changes no more, as a share
//! of how far they moved, both RMS over nodes and frames; `lean` that of the block at rest against the finite elements of
//! `lean.py`, which is the same for all.

mod engines;
mod scene;

use cpu_time::ThreadTime;
use engines::{Engine, FRAME_S, Rapier};
use glam::DVec3;
use rapier_soft::prelude::SoftBodySolver;
use resecta_solver::Network;
use scene::{block, lean_mm, lean_of};

/// Frames that are timed and compared.
const SWING: usize = 12;
/// Frames until rest: a 30,000th of the swing is left.
const REST: usize = 42;
/// A swing of less CPU time is made so many times, and the median counts.
const SHORT_S: f64 = 1.0;
const REPEATS: usize = 5;

const CONSTRAINTS: Rapier = Rapier {
    solver: SoftBodySolver::Constraints,
    steps: 1,
    substeps: 4,
    sweeps: 1,
    gradients: 20,
};
const FEM: Rapier = Rapier {
    solver: SoftBodySolver::Fem,
    ..CONSTRAINTS
};

/// Settings of rapier, those that it comes with first for either solver.
const RAPIER: [Rapier; 11] = [
    CONSTRAINTS,
    Rapier {
        sweeps: 4,
        ..CONSTRAINTS
    },
    Rapier {
        substeps: 16,
        ..CONSTRAINTS
    },
    Rapier {
        steps: 4,
        ..CONSTRAINTS
    },
    Rapier {
        steps: 16,
        ..CONSTRAINTS
    },
    FEM,
    Rapier {
        substeps: 1,
        gradients: 400,
        ..FEM
    },
    Rapier { gradients: 400, ..FEM },
    Rapier {
        steps: 4,
        substeps: 1,
        ..FEM
    },
    Rapier {
        steps: 16,
        substeps: 1,
        ..FEM
    },
    Rapier {
        steps: 64,
        substeps: 1,
        ..FEM
    },
];

/// Steps a frame of the finer of two solutions from which rapier's own truth is extrapolated.
const FINE: usize = 128;

fn main() {
    let mut sizes: Vec<usize> = std::env::args().filter_map(|argument| argument.parse().ok()).collect();
    if sizes.is_empty() {
        sizes = vec![9, 21];
    }
    for cells in sizes {
        table(cells);
    }
}

fn table(cells: usize) {
    let network = block(cells);
    let (nodes, springs, tetrahedra) = (network.positions.len(), network.springs.len(), 5 * cells.pow(3));
    println!("\n{nodes} nodes, {springs} springs, {tetrahedra} tetrahedra:\n");
    println!("| engine | CPU time a second of motion, s | swing, % | lean, % |\n|---|---|---|---|");
    let exact = Swing::of(Engine::Springs, &network, cells).places;
    for engine in [Engine::Ours, Engine::OursTimes(2), Engine::OursTimes(4)] {
        row(engine, &network, cells, &exact);
    }
    let exact = converged(&network, cells);
    for settings in RAPIER {
        row(Engine::Rapier(settings), &network, cells, &exact);
    }
    if let Some(missed) = scene::trilinear_missed(cells) {
        println!("| trilinear finite elements on the same cubes | | | {missed:+.1} |");
    }
}

/// rapier's own truth: both its solvers are of first order and tend to the same positions, so a solution in twice as long
/// steps tells how far the fine one is from there.
fn converged(network: &Network, cells: usize) -> Vec<DVec3> {
    let steps = |steps| {
        let settings = Rapier {
            steps,
            substeps: 1,
            ..FEM
        };
        Swing::of(Engine::Rapier(settings), network, cells).places
    };
    let coarse = steps(FINE / 2);
    let fine = steps(FINE);
    fine.into_iter()
        .zip(coarse)
        .map(|(fine, coarse)| 2.0 * fine - coarse)
        .collect()
}

/// A swing that was made.
struct Swing {
    /// Of every node after every frame, mm.
    places: Vec<DVec3>,
    cpu_s: f64,
    /// The engine, to go on with.
    run: engines::Run,
}

impl Swing {
    fn of(engine: Engine, network: &Network, cells: usize) -> Swing {
        let mut run = engine.begin(network, cells);
        let (mut places, mut cpu_s) = (Vec::new(), 0.0);
        for _ in 0..SWING {
            let clock = ThreadTime::now();
            run.frame();
            cpu_s += clock.elapsed().as_secs_f64();
            places.extend(run.positions());
        }
        Swing { places, cpu_s, run }
    }
}

fn row(engine: Engine, network: &Network, cells: usize, exact: &[DVec3]) {
    let Swing { places, cpu_s, mut run } = Swing::of(engine, network, cells);
    let mut times = vec![cpu_s];
    if cpu_s < SHORT_S {
        times.extend((1..REPEATS).map(|_| Swing::of(engine, network, cells).cpu_s));
        times.sort_by(f64::total_cmp);
    }
    for _ in SWING..REST {
        run.frame();
    }
    let squares = |of: &mut dyn Iterator<Item = (DVec3, DVec3)>| of.map(|(a, b)| a.distance_squared(b)).sum::<f64>();
    let moved = squares(&mut exact.iter().copied().zip(network.positions.iter().copied().cycle()));
    let missed = squares(&mut exact.iter().copied().zip(places));
    let a_second = times[times.len() / 2] / (SWING as f64 * FRAME_S);
    let swing = 100.0 * (missed / moved).sqrt();
    let lean = 100.0 * (lean_of(network, &run.positions()) / lean_mm() - 1.0);
    println!("| {engine} | {a_second:.3} | {swing:.3} | {lean:+.1} |");
}
