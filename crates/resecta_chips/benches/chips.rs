//! What a step of chips costs: `cargo bench --workspace --bench chips`.
//!
//! Blocks of chips' sizes in a bladder of 33 mm, at 1/60 s: `stirred` while a stream of 4 ml/s and the sheath go through them,
//! `resting` when they lie still. Compare within one run only.

#[path = "../tests/floating/scenes.rs"]
#[allow(dead_code)] // Here some of them are used.
mod scenes;

use bevy::math::Vec3;
use criterion::{BenchmarkId, Criterion};
use resecta_chips::TissueAt;
use scenes::{STEP_S, heap, scope, settings, still};

fn main() {
    let mut criterion = Criterion::default().configure_from_args();
    let mut group = criterion.benchmark_group("chips");
    for count in [0usize, 10, 50, 100] {
        let mut pool = heap(count, settings());
        group.bench_function(BenchmarkId::new("resting", count), |bencher| {
            bencher.iter(|| pool.step(STEP_S, &still(), |_| TissueAt::Unknown));
        });
        // Goes on from sample to sample: setting up a heap takes longer than stirring it.
        let mut step = 0u32;
        group.bench_function(BenchmarkId::new("stirred", count), |bencher| {
            bencher.iter(|| {
                let tip = |step: u32| {
                    let (sin, cos) = (0.02 * step as f32).sin_cos();
                    Vec3::new(12.0 * sin, 22.0 + 3.0 * cos, -14.0)
                };
                step += 1;
                pool.step(STEP_S, &scope(tip(step), tip(step + 1), 4.0, 4.0), |_| {
                    TissueAt::Unknown
                })
            });
        });
    }
    group.finish();
    criterion.final_summary();
}
