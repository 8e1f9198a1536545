//! How to test a system against tissue: an app without a window, exactly one step an update, and the same bits each run.
//!
//! In a project of one's own, `scar_tissue_moves_less` would be a `#[test]`.
//!
//! `cargo run --release --example headless_test`

use bevy::{prelude::*, time::TimeUpdateStrategy};
use resecta::{anatomy::generate, prelude::*, solver::Material};

/// The system under test: springs between nodes of the mucosa are scarred, ten times as stiff.
fn scar(mut springs: Query<&mut Spring, Added<Spring>>, tissues: Query<&Tissue>) {
    for mut spring in &mut springs {
        let Ok(tissue) = tissues.get(spring.tissue) else {
            continue;
        };
        let mucosa = |node: &u32| tissue.solver().node_kind(*node) == resecta::solver::NodeKind::Mucosa;
        if spring.nodes.iter().all(mucosa) {
            spring.stiffness_mn_per_m *= 10.0;
        }
    }
}

/// Pulls on one node for half a second: how far it goes, mm.
fn pull(scarred: bool) -> Result<f32> {
    let case = generate::generate(&generate::GlandSpec {
        volume_ml: 30.0,
        median_lobe_mm: 0.0,
        seed: 1,
    })?;
    let lattice = Lattice::build(
        &case,
        &LatticeOptions {
            alpha_deg: 12.0,
            ..default()
        },
    )?;
    let material = Material::default();
    let solver = resecta::solver::Tissue::new(&TissueMesh::from_lattice(&lattice, material.shear), &material)?;

    let mut app = App::new();
    app.add_plugins((MinimalPlugins, TissuePlugin::default()))
        .insert_resource(Time::<Fixed>::from_hz(60.0))
        .insert_resource(TimeUpdateStrategy::FixedTimesteps(1));
    if scarred {
        app.add_systems(FixedUpdate, scar);
    }
    let tissue = app.world_mut().spawn(Tissue::new(solver)).id();
    // The first update sets the clocks, the second makes the parts.
    app.update();
    app.update();
    let node = app
        .world()
        .get::<Tissue>(tissue)
        .and_then(|tissue| tissue.node_entity(100))
        .ok_or("no node 100")?;
    let mut pulled = app.world_mut().get_mut::<TissueNode>(node).ok_or("node 100 lives")?;
    let start = pulled.position;
    pulled.load = Vec3::new(0.0, 0.0, 20_000.0);
    for _ in 0..30 {
        app.update();
    }
    Ok(app
        .world()
        .get::<TissueNode>(node)
        .ok_or("node 100 lives")?
        .position
        .distance(start))
}

fn scar_tissue_moves_less() -> Result {
    let (soft, scarred) = (pull(false)?, pull(true)?);
    assert!(scarred < 0.8 * soft, "{scarred} mm against {soft} mm");
    assert_eq!(pull(true)?.to_bits(), scarred.to_bits());
    println!("{soft:.3} mm, {scarred:.3} mm where it is scarred: passed");
    Ok(())
}

fn main() -> Result {
    scar_tissue_moves_less()
}
