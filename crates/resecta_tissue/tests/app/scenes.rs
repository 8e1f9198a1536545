//! Tissues, tools and apps that the tests share.

use bevy::{math::DVec2, math::DVec3, prelude::*, time::TimeUpdateStrategy};
use resecta_anatomy::{Lattice, LatticeOptions, Section};
use resecta_solver::{Material, ShearResistance, TissueMesh};
use resecta_tissue::{TissueInconsistent, prelude::*};

/// Length of a step, s.
pub const STEP_S: f32 = 1.0 / 60.0;

/// An app that makes one step an update and fails when something is inconsistent.
pub fn app() -> App {
    let mut app = unstarted_app();
    // The clock starts with the first update, which makes no step.
    app.update();
    app
}

/// The same before its first update.
pub fn unstarted_app() -> App {
    let mut app = App::new();
    app.add_plugins((MinimalPlugins, TissuePlugin::default()))
        .insert_resource(Time::<Fixed>::from_hz(60.0))
        .insert_resource(TimeUpdateStrategy::FixedTimesteps(1))
        .add_systems(FixedLast, |mut found: MessageReader<TissueInconsistent>| {
            if let Some(found) = found.read().next() {
                panic!("{}", found.inconsistency);
            }
        });
    app
}

/// Settings under which every structural change is checked, and whole elements are cut.
pub fn checked() -> TissueSettings {
    TissueSettings {
        check_consistency: true,
        detail: CutDetail::Elements,
        ..default()
    }
}

/// A block of cubes of `edge` mm with a corner at `corner`, held by a stiff bed where `held` says so.
pub fn block(n: [u32; 3], edge: f64, corner: Vec3, held: impl Fn(Vec3) -> bool) -> resecta_solver::Tissue {
    let index = |x: u32, y: u32, z: u32| (z * (n[1] + 1) + y) * (n[0] + 1) + x;
    let mut positions = Vec::new();
    for z in 0..=n[2] {
        for y in 0..=n[1] {
            for x in 0..=n[0] {
                positions.push(corner.as_dvec3() + DVec3::new(x.into(), y.into(), z.into()) * edge);
            }
        }
    }
    let mut pentahedra = Vec::new();
    for z in 0..n[2] {
        for y in 0..n[1] {
            for x in 0..n[0] {
                let c = |dx, dy, dz| index(x + dx, y + dy, z + dz);
                pentahedra.push([c(0, 0, 0), c(1, 1, 0), c(1, 0, 0), c(0, 0, 1), c(1, 1, 1), c(1, 0, 1)]);
                pentahedra.push([c(0, 0, 0), c(0, 1, 0), c(1, 1, 0), c(0, 0, 1), c(0, 1, 1), c(1, 1, 1)]);
            }
        }
    }
    let capsule = (0..)
        .zip(&positions)
        .filter(|(_, place)| held(place.as_vec3()))
        .map(|(node, _)| node)
        .collect();
    let mut mesh = TissueMesh::from_pentahedra(positions, pentahedra);
    mesh.capsule = capsule;
    let material = Material {
        support_pa_per_mm: 50_000.0,
        ..Material::default()
    };
    resecta_solver::Tissue::new(&mesh, &material).expect("a block is a tissue")
}

/// A block of 20 x 20 x 12 mm on the plane z = 0, its bottom held.
pub fn small_block() -> resecta_solver::Tissue {
    block([10, 10, 6], 2.0, Vec3::new(-10.0, -10.0, 0.0), |place| place.z == 0.0)
}

/// A straight tube from z = 0 with a lumen of 2.5 mm radius, nearly incompressible.
pub fn tube(alpha_deg: f64, outer_mm: f64, length_mm: f64) -> resecta_solver::Tissue {
    let circle = |radius: f64| -> Vec<DVec2> {
        (0..180)
            .map(|n| DVec2::from_angle(f64::from(n) * std::f64::consts::TAU / 180.0) * radius)
            .collect()
    };
    let (outer, inner) = (circle(outer_mm), circle(2.5));
    let sections: Vec<Section> = (0..8)
        .map(|n| Section {
            z: length_mm / 7.0 * f64::from(n),
            outer: &outer,
            inner: &inner,
        })
        .collect();
    let options = LatticeOptions { alpha_deg, ..default() };
    let lattice = Lattice::from_sections(&sections, &options).expect("a tube is a lattice");
    let material = Material {
        shear: ShearResistance::Diagonals,
        poisson_ratio: Some(0.45),
        ..Material::default()
    };
    resecta_solver::Tissue::new(&TissueMesh::from_lattice(&lattice, material.shear), &material)
        .expect("a tube is a tissue")
}

/// A resectoscope's loop: a half circle of thin wire that hangs along -Y and moves along Z, centre at the origin.
pub fn loop_tool(pose: Isometry3d) -> TissueTool {
    let point = |n: u32| {
        let (sin, cos) = (std::f32::consts::PI * n as f32 / 8.0).sin_cos();
        Vec3::new(3.25 * cos, -4.5 * sin, 0.0)
    };
    let parts = (0..8)
        .map(|n| ToolPart {
            a: point(n),
            b: point(n + 1),
            radius_mm: 0.2,
            kind: ToolPartKind::Loop,
        })
        .collect();
    TissueTool::new(parts, pose).with_cutter(LoopCutter {
        width_mm: 6.5,
        depth_mm: 4.5,
        kerf: Kerf::default(),
        centre: Vec3::ZERO,
        travel: Vec3::Z,
        down: Vec3::NEG_Y,
    })
}

/// A sheath of 26 Fr (8.3 mm) whose tip is at the origin and whose shaft goes back along +Z.
pub fn sheath_tool(pose: Isometry3d) -> TissueTool {
    let radius_mm = 4.15;
    let part = ToolPart {
        a: Vec3::new(0.0, 0.0, radius_mm),
        b: Vec3::new(0.0, 0.0, 100.0),
        radius_mm,
        kind: ToolPartKind::Sheath,
    };
    TissueTool::new(vec![part], pose)
}

/// The state of a tissue, for comparison bit by bit.
pub fn bits(app: &App, tissue: Entity) -> Vec<[u32; 6]> {
    let solver = app.world().get::<Tissue>(tissue).expect("the tissue").solver();
    let of = |node| [solver.position(node), solver.velocity(node)];
    (0..solver.node_count() as u32)
        .map(|node| {
            let [place, velocity] = of(node).map(|vector| vector.to_array().map(f32::to_bits));
            [place[0], place[1], place[2], velocity[0], velocity[1], velocity[2]]
        })
        .collect()
}

/// All messages of one kind that are still held.
pub fn messages<M: Message + Clone>(app: &App) -> Vec<M> {
    let messages = app.world().resource::<Messages<M>>();
    messages.iter_current_update_messages().cloned().collect()
}
