//! The instrument's body: sheath, beak, telescope and the loop that slides; and the ghost of another run's.

use bevy::{
    camera::visibility::{NoFrustumCulling, RenderLayers},
    prelude::*,
};
use resecta_instrument::{InstrumentState, Resectoscope, ResectoscopeGeometry};

use super::{
    ENDOSCOPE_LAYER, OUTSIDE_LAYER, ViewSystems,
    between::Drawn,
    both_layers,
    material::{Cover, Look, ViewMaterial},
    palette, shapes,
};

/// How much longer than the loop's stroke its arms are, mm, so that their ends never come out of the sheath.
const ARM_SPARE_MM: f32 = 10.0;

/// The arms cover what lies so little before them, per cent of the way (`ViewMaterial::nearer_percent`): some tenths of a mm. Tissue
/// pressed aside by them meets them in large triangles, which would show as teeth.
const ARMS_NEARER: u32 = 30;

/// The same for the beak in the lens's picture: what lies less than half as far away still covers it. Tissue that the sheath stretches
/// cuts through the beak in large triangles, for nothing collides with it.
const BEAK_NEARER: u32 = 100;

pub fn plugin(app: &mut App) {
    app.add_systems(Update, add_bodies.in_set(ViewSystems::Dress))
        .add_systems(Update, place_ghosts.in_set(ViewSystems::Place))
        .add_systems(Update, move_loops.in_set(ViewSystems::Follow));
}

/// The instrument of another run: seen through, and touching nothing. The endoscope shows its loop alone, for its sheath may be
/// around the lens.
#[derive(Component, Debug, Clone, PartialEq)]
#[require(Transform, Visibility)]
pub struct Ghost {
    /// Where it enters, and its size.
    pub scope: Resectoscope,
    /// Where it is.
    pub state: InstrumentState,
}

/// How much of a ghost is seen.
const GHOST_SHARE: f32 = 0.38;

/// The loop with its arms: what moves with the stroke.
#[derive(Component)]
struct SlidingLoop {
    instrument: Entity,
    /// The wire's material in each view.
    wire: [Handle<ViewMaterial>; 2],
}

/// An instrument that has its body.
#[derive(Component)]
struct HasBody;

fn add_bodies(
    instruments: Query<
        (Entity, Option<&Resectoscope>, Option<&Ghost>),
        (Without<HasBody>, Or<(With<Resectoscope>, With<Ghost>)>),
    >,
    mut meshes: ResMut<Assets<Mesh>>,
    mut materials: ResMut<Assets<ViewMaterial>>,
    mut commands: Commands,
) {
    for (instrument, scope, ghost) in &instruments {
        let Some(scope) = scope.or(ghost.map(|ghost| &ghost.scope)) else {
            continue;
        };
        let is_ghost = ghost.is_some();
        let geometry = &scope.geometry;
        // Seen by the lens, and from outside.
        let mut material = |colour: LinearRgba, gloss, sharpness, nearer_percent: [u32; 2]| {
            let look = Look {
                colour: if is_ghost {
                    palette::GHOST.with_alpha(GHOST_SHARE)
                } else {
                    colour
                },
                gloss,
                sharpness,
                glow: if is_ghost { 0.35 } else { 0.0 },
                ..default()
            };
            let [inside, outside] = nearer_percent;
            [(look.clone().under_lamp(), inside), (look, outside)].map(|(look, nearer_percent)| {
                materials.add(ViewMaterial {
                    cover: if is_ghost { Cover::Among } else { Cover::Opaque },
                    nearer_percent,
                    ..look.into()
                })
            })
        };
        let steel = material(palette::STEEL, 0.8, 40.0, [0, 0]);
        let black = material(palette::BEAK, 0.35, 25.0, [BEAK_NEARER, 0]);
        let insulation = material(palette::INSULATION, 0.3, 20.0, [ARMS_NEARER, 0]);
        let wire = material(palette::STEEL, 1.0, 30.0, [0, 0]);

        commands
            .entity(instrument)
            .insert((HasBody, Visibility::default()))
            .with_children(|body| {
                let mut part = |mesh: Mesh, [inside, outside]: &[Handle<ViewMaterial>; 2]| {
                    let mesh = meshes.add(mesh);
                    for (material, layer) in [(inside, ENDOSCOPE_LAYER), (outside, OUTSIDE_LAYER)] {
                        if is_ghost && layer == ENDOSCOPE_LAYER {
                            continue;
                        }
                        body.spawn((
                            Mesh3d(mesh.clone()),
                            MeshMaterial3d(material.clone()),
                            RenderLayers::layer(layer),
                            NoFrustumCulling,
                        ));
                    }
                };
                part(sheath(geometry), &steel);
                part(shapes::beak(geometry), &black);
                part(telescope(geometry), &black);
                body.spawn((
                    SlidingLoop {
                        instrument,
                        wire: wire.clone(),
                    },
                    Transform::default(),
                    Visibility::default(),
                    both_layers(),
                ))
                .with_children(|sliding| {
                    let mut part = |mesh: Mesh, [inside, outside]: &[Handle<ViewMaterial>; 2]| {
                        let mesh = meshes.add(mesh);
                        for (material, layer) in [(inside, ENDOSCOPE_LAYER), (outside, OUTSIDE_LAYER)] {
                            sliding.spawn((
                                Mesh3d(mesh.clone()),
                                MeshMaterial3d(material.clone()),
                                RenderLayers::layer(layer),
                                NoFrustumCulling,
                            ));
                        }
                    };
                    part(
                        shapes::tube(&geometry.loop_wire(0.0), geometry.wire_diameter_mm / 2.0),
                        &wire,
                    );
                    let length = scope.limits.stroke_mm.max + ARM_SPARE_MM;
                    for [top, _] in geometry.arms(0.0) {
                        let arm = [top, top + Vec3::Z * length];
                        part(shapes::tube(&arm, geometry.arm_diameter_mm / 2.0), &insulation);
                    }
                });
            });
    }
}

fn place_ghosts(mut ghosts: Query<(&Ghost, &mut Transform)>) {
    for (ghost, mut transform) in &mut ghosts {
        transform.set_if_neq(Transform::from_isometry(ghost.scope.sheath_pose(&ghost.state)));
    }
}

/// Slides the loops and lets the wire glow under current.
fn move_loops(
    instruments: Query<Drawn>,
    ghosts: Query<&Ghost>,
    mut loops: Query<(&SlidingLoop, &mut Transform)>,
    mut materials: ResMut<Assets<ViewMaterial>>,
) {
    for (sliding, mut transform) in &mut loops {
        let ghost = ghosts.get(sliding.instrument).ok().map(|ghost| &ghost.state);
        let instrument = instruments.get(sliding.instrument);
        let Some(state) = ghost.or(instrument.as_ref().ok().map(|instrument| instrument.get().1)) else {
            continue;
        };
        transform.translation = Vec3::NEG_Z * state.stroke_mm;
        let (off, off_glow) = match ghost {
            Some(_) => (palette::GHOST.with_alpha(GHOST_SHARE), 0.35),
            None => (palette::STEEL, 0.0),
        };
        let (colour, glow) = match state {
            InstrumentState { cut: true, .. } => (palette::CUTTING, 0.9),
            InstrumentState { coagulate: true, .. } => (palette::COAGULATING, 0.6),
            _ => (off, off_glow),
        };
        for wire in &sliding.wire {
            let is_same = materials
                .get(wire)
                .is_some_and(|material| material.look.glow == glow && material.look.colour == colour);
            if is_same {
                continue;
            }
            if let Some(mut material) = materials.get_mut(wire) {
                material.look.colour = colour;
                material.look.glow = glow;
            }
        }
    }
}

/// The sheath, its tip rounded like the capsule that tissue touches.
fn sheath(geometry: &ResectoscopeGeometry) -> Mesh {
    let radius = geometry.sheath_diameter_mm / 2.0;
    let mut profile = vec![Vec2::new(radius * 0.80, 0.9)];
    profile
        .extend([(0.86, 0.25), (0.92, 0.35), (0.97, 0.8), (1.0, 1.6)].map(|(share, z)| Vec2::new(radius * share, z)));
    profile.push(Vec2::new(radius, geometry.sheath_length_mm));
    shapes::turned(&profile)
}

/// The telescope's end: a disc of glass seen from outside.
fn telescope(geometry: &ResectoscopeGeometry) -> Mesh {
    let radius = geometry.telescope_diameter_mm / 2.0;
    let centre = Vec3::Y * geometry.telescope_offset_mm;
    shapes::tube(&[centre + Vec3::Z * 0.6, centre + Vec3::Z * 20.0], radius)
}
