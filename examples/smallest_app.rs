//! The smallest app: a gland in a window, or `--headless` for two seconds without one.
//!
//! `cargo run --release --example smallest_app -- --headless`

use bevy::{prelude::*, time::TimeUpdateStrategy};
use resecta::{anatomy::generate, prelude::*, solver::Material};

fn main() {
    let mut app = App::new();
    if std::env::args().any(|argument| argument == "--headless") {
        app.add_plugins(MinimalPlugins)
            .insert_resource(TimeUpdateStrategy::FixedTimesteps(1));
    } else {
        app.add_plugins(DefaultPlugins);
    }
    app.add_plugins(TissuePlugin::default())
        .insert_resource(Time::<Fixed>::from_hz(60.0))
        .add_systems(Startup, (spawn_gland, spawn_view))
        .add_systems(FixedLast, stop_after_two_seconds);
    app.run();
}

fn spawn_gland(mut commands: Commands) -> Result {
    let case = generate::generate(&generate::GlandSpec {
        volume_ml: 30.0,
        median_lobe_mm: 0.0,
        seed: 1,
    })?;
    let lattice = Lattice::build(&case, &LatticeOptions::default())?;
    let material = Material::default();
    let mesh = TissueMesh::from_lattice(&lattice, material.shear);
    let gland = resecta::solver::Tissue::new(&mesh, &material)?;
    info!("{} nodes, {:.1} ml", gland.node_count(), gland.volume_mm3() / 1000.0);
    commands.spawn(Tissue::new(gland));
    Ok(())
}

/// The tissue brings its mesh; material, light and camera are the app's.
fn spawn_view(
    mut commands: Commands,
    gland: Query<Entity, With<Tissue>>,
    materials: Option<ResMut<Assets<StandardMaterial>>>,
) {
    let Some(mut materials) = materials else { return };
    for gland in &gland {
        commands
            .entity(gland)
            .insert(MeshMaterial3d(materials.add(StandardMaterial::default())));
    }
    commands.spawn((
        DirectionalLight::default(),
        Transform::from_xyz(60.0, -80.0, 60.0).looking_at(Vec3::ZERO, Vec3::Z),
    ));
    commands.spawn((
        Camera3d::default(),
        Transform::from_xyz(60.0, -90.0, 40.0).looking_at(Vec3::ZERO, Vec3::Z),
    ));
}

fn stop_after_two_seconds(mut steps: Local<u32>, meshes: Option<Res<Assets<Mesh>>>, mut exit: MessageWriter<AppExit>) {
    *steps += 1;
    if meshes.is_none() && *steps == 120 {
        println!("120 steps without a window");
        exit.write(AppExit::Success);
    }
}
