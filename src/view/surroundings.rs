//! What lies around the gland: the bladder above it, the urethra below it, the landmarks.

use bevy::{
    camera::visibility::{NoFrustumCulling, RenderLayers},
    prelude::*,
};
use resecta_anatomy::{BladderShape, Case};
use resecta_instrument::Resectoscope;
use resecta_scenario::ActiveExercise;

use super::{
    ENDOSCOPE_LAYER, OUTSIDE_LAYER, ViewSystems,
    gland::sagittal,
    material::{Look, Surface, ViewMaterial},
    palette, shapes,
};

/// Inner radius of the urethra below the gland, mm: the sheath's and a millimetre.
const URETHRA_MM: f32 = 5.0;
/// Length of urethra that is drawn, mm.
const URETHRA_LENGTH_MM: f32 = 45.0;

pub fn plugin(app: &mut App) {
    app.register_type::<Landmark>()
        .add_systems(Update, surround.in_set(ViewSystems::Dress));
}

/// A landmark of the exercise's case as a marker in the outside view.
#[derive(Component, Reflect, Debug, Clone, PartialEq)]
#[reflect(Component)]
pub struct Landmark {
    /// What it is.
    pub name: String,
    /// Colour of its marker, linear.
    pub colour: LinearRgba,
}

/// What was spawned around a gland.
#[derive(Component)]
struct Surroundings;

/// Spawns the surroundings of an exercise as children of its gland, so that they go with it.
fn surround(
    active: Option<Res<ActiveExercise>>,
    instruments: Query<&Resectoscope>,
    surrounded: Query<(), With<Surroundings>>,
    mut meshes: ResMut<Assets<Mesh>>,
    mut materials: ResMut<Assets<ViewMaterial>>,
    mut commands: Commands,
) {
    let Some(active) = active.filter(|active| !surrounded.contains(active.tissue)) else {
        return;
    };
    let Ok(scope) = instruments.get(active.instrument) else {
        return;
    };
    let wall = Look {
        colour: palette::WALL,
        gloss: 0.4,
        sharpness: 36.0,
        relief: 0.22,
        ..default()
    };
    let inside = materials.add(ViewMaterial::from(wall.clone().under_lamp()));
    let outside = materials.add(ViewMaterial::from(Look {
        section: sagittal(&active.case),
        brightness: 0.55,
        relief: 0.15,
        gloss: 0.1,
        ..wall
    }));
    let background = materials.add(ViewMaterial::from(Look {
        colour: palette::BACKGROUND,
        surface: Surface::Flat as u32,
        ..default()
    }));

    let mut walls = vec![urethra(scope)];
    walls.extend(bladder(&active.case));
    let markers = landmarks(&active.case);

    commands
        .entity(active.tissue)
        .insert((Surroundings, Visibility::default()))
        .with_children(|gland| {
            for (mesh, transform) in walls {
                let mesh = meshes.add(mesh);
                for (material, layer) in [(&inside, ENDOSCOPE_LAYER), (&outside, OUTSIDE_LAYER)] {
                    gland.spawn((
                        Mesh3d(mesh.clone()),
                        MeshMaterial3d(material.clone()),
                        transform,
                        RenderLayers::layer(layer),
                    ));
                }
            }
            gland.spawn((
                Mesh3d(meshes.add(Sphere::new(1500.0).mesh().uv(24, 12))),
                MeshMaterial3d(background),
                RenderLayers::layer(OUTSIDE_LAYER),
                NoFrustumCulling,
            ));
            for (landmark, mesh, place) in markers {
                let material = ViewMaterial {
                    look: Look {
                        colour: landmark.colour,
                        glow: 0.55,
                        ..default()
                    },
                    // Seen through tissue: a landmark that is hidden guides nobody.
                    nearer: 1 << 20,
                    ..default()
                };
                gland.spawn((
                    Name::new(landmark.name.clone()),
                    landmark,
                    Mesh3d(meshes.add(mesh)),
                    MeshMaterial3d(materials.add(material)),
                    Transform::from_translation(place),
                    RenderLayers::layer(OUTSIDE_LAYER),
                ));
            }
        });
}

/// The urethra from the gland's apex down along the instrument's axis.
fn urethra(scope: &Resectoscope) -> (Mesh, Transform) {
    let (pivot, axis) = (scope.pivot(), scope.axis());
    let points = 12;
    let line: Vec<Vec3> = (0..=points)
        .map(|point| pivot + axis * (6.0 - URETHRA_LENGTH_MM * point as f32 / points as f32))
        .collect();
    (shapes::tube(&line, URETHRA_MM), Transform::IDENTITY)
}

/// The bladder, open where it sits on the gland.
fn bladder(case: &Case) -> Option<(Mesh, Transform)> {
    let shape = BladderShape::of_case(case)?;
    Some((
        shapes::open_shell(shape.radius_mm as f32, shape.open_z as f32),
        Transform::from_translation(shape.centre.as_vec3()),
    ))
}

/// The landmarks with their markers.
fn landmarks(case: &Case) -> Vec<(Landmark, Mesh, Vec3)> {
    let landmark = |name: &str, colour| Landmark {
        name: name.into(),
        colour,
    };
    let ball = || Mesh::from(Sphere::new(1.1));
    let marks = &case.landmarks;
    let mut found = Vec::new();
    if let Some(place) = marks.bladder_neck {
        let neck = landmark("bladder neck", LinearRgba::rgb(0.95, 0.75, 0.10));
        found.push((neck, ball(), place.as_vec3()));
    }
    if let Some(place) = marks.verumontanum {
        let verumontanum = landmark("verumontanum", LinearRgba::rgb(0.15, 0.85, 0.30));
        found.push((verumontanum, ball(), place.as_vec3()));
    }
    if let Some(place) = marks.external_sphincter {
        let sphincter = landmark("external sphincter", LinearRgba::rgb(0.90, 0.15, 0.55));
        found.push((sphincter, shapes::ring(URETHRA_MM + 0.8, 0.7), place.as_vec3()));
    }
    for place in marks.ureteral_orifices.into_iter().flatten() {
        let orifice = landmark("ureteral orifice", LinearRgba::rgb(0.30, 0.55, 0.95));
        found.push((orifice, ball(), place.as_vec3()));
    }
    found
}
