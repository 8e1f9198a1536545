//! A system of one's own against the components: forceps pull on a few nodes, and the tissue follows.
//!
//! `cargo run --release --example force_on_nodes`

use bevy::{prelude::*, time::TimeUpdateStrategy};
use resecta::{anatomy::generate, prelude::*, solver::Material};

/// Pulls what lies within a ball.
#[derive(Component)]
struct Forceps {
    centre: Vec3,
    radius_mm: f32,
    /// On each node, µN.
    pull: Vec3,
}

/// Loads act until they are changed: set once, when the forceps close.
fn close_forceps(forceps: Query<&Forceps, Added<Forceps>>, mut nodes: Query<&mut TissueNode>) {
    for forceps in &forceps {
        for mut node in &mut nodes {
            if node.position.distance(forceps.centre) < forceps.radius_mm {
                node.load = forceps.pull;
            }
        }
    }
}

fn main() -> Result {
    let case = generate::generate(&generate::GlandSpec {
        volume_ml: 30.0,
        median_lobe_mm: 0.0,
        seed: 1,
    })?;
    let lattice = Lattice::build(&case, &LatticeOptions::default())?;
    let material = Material::default();
    let gland = resecta::solver::Tissue::new(&TissueMesh::from_lattice(&lattice, material.shear), &material)?;
    let held = (0..gland.node_count() as u32).find(|&node| gland.node_kind(node) == resecta::solver::NodeKind::Mucosa);
    let held = held.ok_or("a gland has a urethra")?;
    let centre = gland.position(held);

    let mut app = App::new();
    app.add_plugins((MinimalPlugins, TissuePlugin::default()))
        .insert_resource(Time::<Fixed>::from_hz(60.0))
        .insert_resource(TimeUpdateStrategy::FixedTimesteps(1))
        .add_systems(FixedUpdate, close_forceps);
    let gland = app.world_mut().spawn(Tissue::new(gland)).id();
    // The first update sets the clocks, the second gives the gland's nodes their entities.
    app.update();
    app.update();
    app.world_mut().spawn(Forceps {
        centre,
        radius_mm: 4.0,
        pull: Vec3::new(0.0, 0.0, -200.0),
    });
    for step in 0..=60 {
        app.update();
        if step % 10 == 0 {
            let entity = app
                .world()
                .get::<Tissue>(gland)
                .and_then(|gland| gland.node_entity(held));
            let node = entity
                .and_then(|entity| app.world().get::<TissueNode>(entity))
                .ok_or("the node lives")?;
            println!(
                "{:5.2} s: pulled by {:.3} mm",
                f64::from(step) / 60.0,
                node.position.distance(centre)
            );
        }
    }
    Ok(())
}
