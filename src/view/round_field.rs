//! The round field: a black mask with a soft edge in front of the endoscope's camera, and the mark of 12 o'clock on its rim.

use std::f32::consts::TAU;

use bevy::{
    camera::visibility::{NoFrustumCulling, RenderLayers},
    prelude::*,
};
use resecta_instrument::Resectoscope;
use resecta_scenario::ActiveExercise;

use super::{
    ENDOSCOPE_LAYER, ViewSystems,
    between::Drawn,
    cameras::{EndoscopeCamera, NEAR_MM},
    material::{Look, Surface, ViewMaterial},
    shapes::Shape,
};

/// Distance of the mask from the lens, mm: just behind the nearest that is drawn.
const DISTANCE_MM: f32 = NEAR_MM * 1.2;
/// Points around the circle.
const POINTS: usize = 180;
/// Radius, as a share of the field's, and darkness of the mask's rings. Lenses darken towards the edge.
const RINGS: [(f32, f32); 6] = [
    (0.55, 0.0),
    (0.80, 0.12),
    (0.94, 0.38),
    (0.985, 0.75),
    (1.0, 1.0),
    (8.0, 1.0),
];

pub fn plugin(app: &mut App) {
    app.add_systems(Update, add_mask.in_set(ViewSystems::Dress))
        .add_systems(Update, turn_mark.in_set(ViewSystems::Follow));
}

/// The mark that shows where 12 o'clock is, however the instrument is rolled.
#[derive(Component)]
struct ClockMark;

fn add_mask(
    active: Option<Res<ActiveExercise>>,
    instruments: Query<&Resectoscope>,
    cameras: Query<(Entity, Option<&Children>), With<EndoscopeCamera>>,
    mut meshes: ResMut<Assets<Mesh>>,
    mut materials: ResMut<Assets<ViewMaterial>>,
    mut commands: Commands,
) {
    let Some(scope) = active.and_then(|active| instruments.get(active.instrument).ok()) else {
        return;
    };
    let radius = DISTANCE_MM * (scope.geometry.field_of_view_deg.to_radians() / 2.0).tan();
    for (camera, _) in cameras.iter().filter(|(_, children)| children.is_none()) {
        let material = materials.add(ViewMaterial {
            look: Look {
                surface: Surface::Flat as u32,
                ..default()
            },
            overlay: true,
            ..default()
        });
        let part = |mesh: Handle<Mesh>, distance: f32| {
            (
                Mesh3d(mesh),
                MeshMaterial3d(material.clone()),
                Transform::from_xyz(0.0, 0.0, -distance),
                RenderLayers::layer(ENDOSCOPE_LAYER),
                NoFrustumCulling,
            )
        };
        commands.entity(camera).with_children(|camera| {
            camera.spawn(part(meshes.add(mask(radius)), DISTANCE_MM));
            // Scaled down by as much as it is nearer, so that it fits the mask's rim.
            let nearer = 0.95;
            camera.spawn((ClockMark, part(meshes.add(mark(radius * nearer)), DISTANCE_MM * nearer)));
        });
    }
}

fn turn_mark(
    active: Option<Res<ActiveExercise>>,
    instruments: Query<Drawn>,
    mut marks: Query<&mut Transform, With<ClockMark>>,
) {
    let Some(instrument) = active.and_then(|active| instruments.get(active.instrument).ok()) else {
        return;
    };
    let (_, state) = instrument.get();
    for mut mark in &mut marks {
        mark.rotation = Quat::from_rotation_z(state.roll_deg.to_radians());
    }
}

fn mask(radius: f32) -> Mesh {
    let mut shape = Shape::default();
    let mut before: Option<Vec<u32>> = None;
    for (share, darkness) in RINGS {
        let ring: Vec<u32> = (0..POINTS)
            .map(|point| {
                let (sin, cos) = (TAU * point as f32 / POINTS as f32).sin_cos();
                let place = Vec3::new(cos, sin, 0.0) * radius * share;
                shape.coloured_vertex(place, [0.0, 0.0, 0.0, darkness])
            })
            .collect();
        if let Some(before) = before {
            shape.join(&before, &ring);
        }
        before = Some(ring);
    }
    shape.mesh()
}

/// A small notch that points inwards from the top of the rim.
fn mark(radius: f32) -> Mesh {
    let mut shape = Shape::default();
    let corners = [(-0.035, 1.01), (0.035, 1.01), (0.0, 0.945)].map(|(x, y)| {
        let place = Vec3::new(x, y, 0.0) * radius;
        shape.coloured_vertex(place, [0.0, 0.0, 0.0, 1.0])
    });
    shape.triangle(corners);
    shape.mesh()
}
