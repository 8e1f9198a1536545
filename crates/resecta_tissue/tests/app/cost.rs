//! What the stages cost, printed: `cargo test --release -p resecta_tissue --test app -- cost --ignored --nocapture`.

use bevy::prelude::*;
use resecta_tissue::prelude::*;

use crate::scenes::{app, sheath_tool, tube};

#[test]
#[ignore = "a measurement, not a law"]
fn cost_of_the_stages_at_some_ten_thousand_nodes() {
    let mut app = app();
    app.init_resource::<Assets<Mesh>>();
    app.world_mut().spawn(Tissue::new(tube(8.0, 22.0, 45.0)));
    let turned = Quat::from_rotation_x(std::f32::consts::PI);
    let pose = |z: f32| Isometry3d::new(Vec3::new(0.0, 0.0, z), turned);
    let tool = app.world_mut().spawn(sheath_tool(pose(-5.0))).id();
    let mut sum = TissueDiagnostics::default();
    const STEPS: u32 = 120;
    for step in 0..STEPS {
        app.world_mut().get_mut::<TissueTool>(tool).unwrap().pose = pose(-5.0 + 40.0 * step as f32 / STEPS as f32);
        app.update();
        if step == 0 {
            continue;
        }
        let of_step = app.world().resource::<TissueDiagnostics>();
        sum.prepare += of_step.prepare;
        sum.collide += of_step.collide;
        sum.resect += of_step.resect;
        sum.integrate += of_step.integrate;
        sum.write_back += of_step.write_back;
        sum.rebuild_mesh += of_step.rebuild_mesh;
    }
    let last = app.world().resource::<TissueDiagnostics>();
    println!(
        "{} nodes, {} springs, {} pentahedra",
        last.nodes, last.springs, last.pentahedra
    );
    println!(
        "{} substeps, {} contacts in the last step",
        last.substeps, last.contacts
    );
    for (stage, time) in [
        ("prepare", sum.prepare),
        ("collide", sum.collide),
        ("resect", sum.resect),
        ("integrate", sum.integrate),
        ("write back", sum.write_back),
        ("rebuild mesh", sum.rebuild_mesh),
    ] {
        println!(
            "{stage:>12}: {:7.3} ms",
            time.as_secs_f64() * 1e3 / f64::from(STEPS - 1)
        );
    }
}
