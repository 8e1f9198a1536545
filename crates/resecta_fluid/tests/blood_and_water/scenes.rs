//! Apps, vessels and clocks that the tests share.

use std::time::Duration;

use bevy::{ecs::schedule::SingleThreadedExecutor, math::DVec3, prelude::*, time::TimeUpdateStrategy};
use resecta_fluid::prelude::*;
use resecta_solver::{Material, TissueMesh};
use resecta_tissue::{Tissue, TissueResected};

/// Nanoseconds of a step at 60 Hz and at 7 Hz: no whole parts of each other.
pub const AT_60_HZ: u64 = 16_666_667;
pub const AT_7_HZ: u64 = 142_857_143;

/// An app whose updates are single steps of whatever length, with all models and no settings changed.
pub fn app() -> App {
    let mut app = App::new();
    app.add_plugins((MinimalPlugins, FluidPlugins::new(Update)))
        .insert_resource(Time::<Virtual>::from_max_delta(Duration::from_secs(1_000_000)))
        .insert_resource(TimeUpdateStrategy::ManualDuration(Duration::ZERO))
        .init_resource::<Bladder>()
        .init_resource::<Irrigation>()
        .init_resource::<Circulation>()
        .init_resource::<Turbidity>()
        .init_resource::<Absorption>();
    // Handing such small systems to threads takes longer than running them.
    app.edit_schedule(Update, |schedule| {
        schedule.set_executor(SingleThreadedExecutor::new());
    });
    // The clock starts with the first update, which makes no step.
    app.update();
    app
}

/// One step.
pub fn step(app: &mut App, nanoseconds: u64) {
    let step = Duration::from_nanos(nanoseconds);
    app.insert_resource(TimeUpdateStrategy::ManualDuration(step));
    app.update();
}

/// Steps of `nanoseconds` for `seconds` in all, the last one as short as it has to be.
pub fn run(app: &mut App, seconds: f64, nanoseconds: u64) {
    let mut left = (seconds * 1e9).round() as u64;
    while left > 0 {
        let next = left.min(nanoseconds);
        step(app, next);
        left -= next;
    }
}

/// A block of `n`³ cubes of 2 mm, each of two pentahedra.
pub fn block(n: u32) -> resecta_solver::Tissue {
    let index = |x: u32, y: u32, z: u32| (z * (n + 1) + y) * (n + 1) + x;
    let mut positions = Vec::new();
    for z in 0..=n {
        for y in 0..=n {
            positions.extend((0..=n).map(|x| DVec3::new(x.into(), y.into(), z.into()) * 2.0));
        }
    }
    let mut pentahedra = Vec::new();
    for z in 0..n {
        for y in 0..n {
            for x in 0..n {
                let c = |dx, dy, dz| index(x + dx, y + dy, z + dz);
                pentahedra.push([c(0, 0, 0), c(1, 1, 0), c(1, 0, 0), c(0, 0, 1), c(1, 1, 1), c(1, 0, 1)]);
                pentahedra.push([c(0, 0, 0), c(0, 1, 0), c(1, 1, 0), c(0, 0, 1), c(0, 1, 1), c(1, 1, 1)]);
            }
        }
    }
    let mesh = TissueMesh::from_pentahedra(positions, pentahedra);
    resecta_solver::Tissue::new(&mesh, &Material::default()).expect("a block is a tissue")
}

/// A vessel in the middle of a pentahedron that bleeds along +z and never clots.
pub fn vessel(tissue: &resecta_solver::Tissue, pentahedron: u32, kind: VesselKind, rate_ml_per_s: f64) -> Vessel {
    Vessel {
        pentahedron,
        place: tissue.rest_centroid(pentahedron),
        direction: Vec3::Z,
        kind,
        diameter_mm: 1.0,
        rate_ml_per_s,
        clotting_s: f64::INFINITY,
    }
}

/// A vessel of each kind and rate, in pentahedra 0, 1, ... of a small block.
pub fn vessels(of: &[(VesselKind, f64)]) -> Vec<Vessel> {
    let tissue = block(4);
    let with = |(pentahedron, &(kind, rate)): (u32, &(VesselKind, f64))| vessel(&tissue, pentahedron, kind, rate);
    (0..).zip(of).map(with).collect()
}

/// Spawns a small block with these vessels, all of them cut. A step of length zero opens them.
pub fn spawn_cut(app: &mut App, vessels: Vec<Vessel>) -> Entity {
    let mut tissue = block(4);
    let cut: Vec<(u32, f64)> = vessels.iter().map(|vessel| (vessel.pentahedron, 0.25)).collect();
    let told = tissue.thin(&cut, None);
    let vessels = Vessels::new(vessels).expect("good vessels");
    let entity = app.world_mut().spawn((Tissue::new(tissue), vessels)).id();
    app.world_mut().write_message(TissueResected {
        tissue: entity,
        tool: None,
        pentahedra: told.pentahedra,
        taken_mm3: told.taken_mm3,
        volume_mm3: told.rest_volume_mm3,
        by_zone_mm3: told.by_zone_mm3,
        capsule_area_mm2: 0.0,
    });
    step(app, 0);
    entity
}

/// All messages of one kind that are still held.
pub fn messages<M: Message + Clone>(app: &App) -> Vec<M> {
    let messages = app.world().resource::<Messages<M>>();
    messages.iter_current_update_messages().cloned().collect()
}

/// Whether two numbers agree within a share of the larger.
#[track_caller]
pub fn assert_near(got: f64, want: f64, share: f64) {
    let off = (got - want).abs() / got.abs().max(want.abs()).max(1e-300);
    assert!(off <= share || got == want, "{got} against {want}: off by {off:.2e}");
}
