//! Blood in the endoscope's view: clouded water, a lens that a jet has hit, and the drops on open vessels.

use bevy::{camera::visibility::RenderLayers, prelude::*};
use resecta_fluid::{RedOut, Turbidity, VesselKind, Vessels};
use resecta_scenario::ActiveExercise;

use super::{
    ENDOSCOPE_LAYER, ViewSystems,
    material::{Look, ViewMaterial},
    palette,
};

/// Radius of the drop on a bleeding vein, mm, and of that on an artery for each mm of its width.
const OOZE_MM: f32 = 0.9;
const DROP_PER_MM: f32 = 0.8;

pub fn plugin(app: &mut App) {
    app.init_resource::<Water>()
        .add_systems(Update, (cloud, draw_vessels).in_set(ViewSystems::Follow));
}

/// What the water is like, as the materials know it.
#[derive(Resource, Debug, Default, Clone, Copy, PartialEq)]
pub(super) struct Water {
    /// How much light is lost on the way, for each mm.
    extinction: f32,
    /// Share of the lens that blood covers.
    covered: f32,
}

impl Water {
    /// How a colour far away is seen.
    pub fn beyond(&self, colour: LinearRgba, distance_mm: f32) -> LinearRgba {
        let clear = (-self.extinction * distance_mm).exp();
        palette::MURK.mix(&colour, clear)
    }

    fn is_about(&self, other: &Self) -> bool {
        (self.extinction - other.extinction).abs() <= 0.02 * other.extinction.max(1e-4)
            && (self.covered - other.covered).abs() < 0.01
    }
}

/// Tells all materials under the lamp what the water is like.
fn cloud(
    active: Option<Res<ActiveExercise>>,
    turbidity: Option<Res<Turbidity>>,
    red_outs: Query<&RedOut>,
    mut known: ResMut<Water>,
    mut told: Local<usize>,
    mut materials: ResMut<Assets<ViewMaterial>>,
) {
    let red_out = active.and_then(|active| red_outs.get(active.instrument).ok());
    let water = Water {
        extinction: turbidity.map_or(0.0, |turbidity| {
            (turbidity.settings.extinction_per_mm * turbidity.concentration()) as f32
        }),
        covered: red_out.map_or(0.0, |red_out| red_out.covered as f32),
    };
    // New materials know nothing yet.
    if water.is_about(&known) && *told == materials.len() {
        return;
    }
    (*known, *told) = (water, materials.len());
    for (_, material) in materials.iter_mut() {
        if material.look.reach_mm > 0.0 {
            material.look.extinction = water.extinction;
            material.look.covered = water.covered;
        }
    }
}

/// What shows an open vessel.
#[derive(Component)]
struct ShownVessel;

/// The mesh and the material of open vessels.
struct Shapes {
    drop: Handle<Mesh>,
    blood: Handle<ViewMaterial>,
}

/// Puts a drop on every open vessel; what leaves it is in `jets.rs`.
fn draw_vessels(
    vessels: Query<&Vessels>,
    mut shown: Query<(&mut Transform, &mut Visibility), With<ShownVessel>>,
    mut shapes: Local<Option<Shapes>>,
    mut meshes: ResMut<Assets<Mesh>>,
    mut materials: ResMut<Assets<ViewMaterial>>,
    mut commands: Commands,
) {
    let mut free = shown.iter_mut();
    for vessel in vessels.iter().flat_map(Vessels::open) {
        let shapes = shapes.get_or_insert_with(|| Shapes {
            drop: meshes.add(Sphere::new(1.0)),
            blood: materials.add(ViewMaterial::from(
                Look {
                    colour: palette::BLOOD,
                    gloss: 0.7,
                    sharpness: 30.0,
                    relief: 0.15,
                    ..default()
                }
                .under_lamp(),
            )),
        });
        let wide = match vessel.vessel.kind {
            VesselKind::Arterial => DROP_PER_MM * vessel.vessel.diameter_mm,
            VesselKind::Venous => OOZE_MM * vessel.share as f32,
        };
        let scale = Vec3::new(1.0, 0.35, 1.0) * wide;
        let transform = Transform {
            translation: vessel.place,
            rotation: Quat::from_rotation_arc(Vec3::Y, vessel.direction.normalize_or(Vec3::Y)),
            scale: scale.max(Vec3::splat(1e-3)),
        };
        match free.next() {
            Some((mut place, mut visibility)) => {
                *place = transform;
                visibility.set_if_neq(Visibility::Inherited);
            }
            None => {
                commands.spawn((
                    ShownVessel,
                    Mesh3d(shapes.drop.clone()),
                    MeshMaterial3d(shapes.blood.clone()),
                    RenderLayers::layer(ENDOSCOPE_LAYER),
                    transform,
                ));
            }
        }
    }
    for (_, mut visibility) in free {
        visibility.set_if_neq(Visibility::Hidden);
    }
}
