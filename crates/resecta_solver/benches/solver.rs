//! What the solver costs, part by part, from a thousand nodes to a million: `cargo bench -p resecta_solver --bench solver`.
//!
//! Blocks of cubes with six neighbours a node, the lattice of the papers. Compare within one run only.

#![allow(missing_docs)] // The functions that criterion makes have none.

#[path = "../tests/common/mod.rs"]
mod common;

use std::hint::black_box;

use common::{block_mesh, tube_lattice};
use criterion::{BatchSize, BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use glam::Vec3;
use resecta_solver::{CollapseLaw, Material, ShearResistance, Tissue, TissueMesh};

/// Nodes along each edge of a block: 1,000, 10,648, 103,823 and 1,000,000 nodes.
const EDGES: [u32; 4] = [10, 22, 47, 100];

/// Steps in a row, to weigh the start of a run little.
const STEPS: u64 = 16;

/// A block that shakes.
fn block(edge: u32) -> Tissue {
    let material = Material {
        shear: ShearResistance::None,
        ..Material::default()
    };
    let mut tissue = Tissue::new(&block_mesh([edge - 1; 3], 2.0), &material).expect("a block is a tissue");
    for node in 0..tissue.node_count() as u32 {
        let place = tissue.position(node);
        let wave = Vec3::new((place.y * 0.7).sin(), (place.z * 0.9).cos(), (place.x * 0.5).sin());
        tissue.set_velocity(node, wave * 20.0).expect("a finite velocity");
    }
    tissue
}

fn substep(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("substep");
    for edge in EDGES {
        let mut tissue = block(edge);
        let step_s = 0.5 * tissue.bound_s();
        group.throughput(Throughput::Elements(STEPS * tissue.node_count() as u64));
        group.sample_size(20);
        group.bench_function(BenchmarkId::from_parameter(tissue.node_count()), |bencher| {
            bencher.iter(|| black_box(tissue.advance_steps(step_s, STEPS)));
        });
    }
}

/// The tube of the tests with about the papers' 10,800 nodes, each lattice with and without volume terms.
fn materials(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("material");
    let lattice = tube_lattice(7.5);
    for shear in [ShearResistance::None, ShearResistance::Diagonals] {
        for poisson_ratio in [None, Some(0.45)] {
            let material = Material {
                poisson_ratio,
                shear,
                ..Material::default()
            };
            let mesh = TissueMesh::from_lattice(&lattice, shear);
            let mut tissue = Tissue::new(&mesh, &material).expect("a tube is a tissue");
            let bound_s = tissue.bound_s();
            let name = format!(
                "{shear:?}, {poisson_ratio:?}, {} nodes, bound {:.0} µs",
                tissue.node_count(),
                1e6 * bound_s
            );
            group.throughput(Throughput::Elements(STEPS * tissue.node_count() as u64));
            group.sample_size(20);
            group.bench_function(BenchmarkId::from_parameter(name), |bencher| {
                bencher.iter(|| black_box(tissue.advance_steps(0.5 * bound_s, STEPS)));
            });
        }
    }
}

fn bound(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("bound");
    for edge in EDGES {
        let mut tissue = block(edge);
        let place = tissue.position(0);
        group.throughput(Throughput::Elements(tissue.node_count() as u64));
        group.sample_size(20);
        group.bench_function(BenchmarkId::from_parameter(tissue.node_count()), |bencher| {
            bencher.iter(|| {
                // An edit makes it be measured anew.
                tissue.set_position(0, place).expect("a finite position");
                black_box(tissue.bound_s())
            });
        });
    }
}

fn cut(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("cut of 5 mm");
    for edge in &EDGES[..3] {
        let tissue = block(*edge);
        let middle = tissue.node_count() as u32 / 2;
        group.sample_size(20);
        group.bench_function(BenchmarkId::from_parameter(tissue.node_count()), |bencher| {
            let cut = |tissue: &mut Tissue| {
                let mut found = tissue.pentahedra_near(middle, 5.0);
                found.extend(tissue.pieces_cut_free(&found));
                black_box(tissue.resect(&found, Some(CollapseLaw::default())));
            };
            bencher.iter_batched_ref(|| tissue.clone(), cut, BatchSize::LargeInput);
        });
    }
}

criterion_group!(benches, substep, materials, bound, cut);
criterion_main!(benches);
