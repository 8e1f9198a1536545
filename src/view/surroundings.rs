//! What lies around the gland: the bladder above it, the urethra below it, the landmarks.

use bevy::{
    camera::visibility::{NoFrustumCulling, RenderLayers},
    math::DVec2,
    prelude::*,
};
use resecta_anatomy::{BladderShape, Case, Landmark, Slice};
use resecta_instrument::Resectoscope;
use resecta_scenario::ActiveExercise;

use super::{
    ENDOSCOPE_LAYER, OUTSIDE_LAYER, ViewSystems,
    gland::sagittal,
    material::{Anatomy, Look, Surface, ViewMaterial},
    palette, shapes,
};

/// Inner radius of the urethra below the gland, mm: the sheath's and a millimetre.
const URETHRA_MM: f32 = 5.0;
/// The lamp reaches so far here, mm: a camera that looks into the bladder is more sensitive.
const WALL_REACH_MM: f32 = 30.0;
/// How much narrower it is at the sphincter, where the instrument's pivot is, and over which length, mm.
const NARROWER_MM: f32 = 0.7;
const SPHINCTER_MM: f32 = 3.0;
/// Where it joins the gland, mm from the pivot.
const JOINS_MM: f32 = 5.0;
/// Length of urethra that is drawn, mm.
const URETHRA_LENGTH_MM: f32 = 45.0;
/// For the lens, it goes on into the gland for so long, mm, wider by so much for each: a sheath that is tilted lifts the end of the
/// gland off it, and there was nothing to be seen between the two.
const INTO_MM: f32 = 9.0;
const WIDER_INTO: f32 = 0.45;

pub fn plugin(app: &mut App) {
    app.register_type::<LandmarkMarker>()
        .add_systems(Update, surround.in_set(ViewSystems::Dress));
}

/// A landmark of the exercise's case as a marker in the outside view.
#[derive(Component, Reflect, Debug, Clone, PartialEq)]
#[reflect(Component)]
pub struct LandmarkMarker {
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
        surface: Surface::Wall as u32,
        gloss: 0.4,
        sharpness: 36.0,
        relief: 0.22,
        ..default()
    };
    let inside = Look {
        reach_mm: WALL_REACH_MM,
        ..wall.clone().under_lamp()
    };
    let outside = Look {
        // Seen from so far, vessels and folds would cost more than they show.
        surface: Surface::Solid as u32,
        section: sagittal(&active.case),
        brightness: 0.55,
        relief: 0.15,
        gloss: 0.1,
        ..wall
    };
    let anatomy = Anatomy::of_case(&active.case);
    let [inside, outside] = [inside, outside].map(|look| {
        materials.add(ViewMaterial {
            look,
            anatomy: anatomy.clone(),
            ..default()
        })
    });
    let background = materials.add(ViewMaterial::from(Look {
        colour: palette::BACKGROUND,
        surface: Surface::Flat as u32,
        ..default()
    }));

    let mut walls = vec![(
        [INTO_MM, 0.0].map(|into_mm| urethra(scope, &active.case, into_mm)),
        Transform::IDENTITY,
    )];
    walls.extend(bladder(&active.case).map(|(mesh, place)| ([mesh.clone(), mesh], place)));
    let markers = landmarks(&active.case);

    commands
        .entity(active.tissue)
        .insert((Surroundings, Visibility::default()))
        .with_children(|gland| {
            for (of_views, transform) in walls {
                let views = [(&inside, ENDOSCOPE_LAYER), (&outside, OUTSIDE_LAYER)];
                for (mesh, (material, layer)) in of_views.into_iter().zip(views) {
                    gland.spawn((
                        Mesh3d(meshes.add(mesh)),
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
                    nearer_percent: 15,
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

/// The urethra, from the lumen at the gland's lower end, or from so far within, down along the instrument's axis, narrower at the
/// sphincter.
fn urethra(scope: &Resectoscope, case: &Case, into_mm: f32) -> Mesh {
    let (pivot, axis) = (scope.pivot(), scope.axis());
    let lumen = |slice: &Slice| {
        let wall = slice.urethra.as_ref()?;
        let middle: DVec2 = wall.iter().sum::<DVec2>() / wall.len().max(1) as f64;
        Some(middle.extend(slice.z).as_vec3())
    };
    let first = case.slices.first().and_then(lumen);
    let end = first.unwrap_or(pivot + axis * JOINS_MM);
    let upwards = case.slices.get(1).and_then(lumen).map_or(axis, |next| next - end);
    let within = [1.0, 0.5].into_iter().filter(|_| into_mm > 0.0).map(|share| {
        let mm = share * into_mm;
        (end + mm * upwards.normalize_or(axis), URETHRA_MM + WIDER_INTO * mm)
    });
    let points = 60;
    let (line, radii): (Vec<Vec3>, Vec<f32>) = within
        .chain((0..=points).map(|point| {
            let along = JOINS_MM - URETHRA_LENGTH_MM * point as f32 / points as f32;
            // Bent to where the lumen is, over its last stretch.
            let bent = (along / JOINS_MM).clamp(0.0, 1.0).powi(2);
            let place = (pivot + axis * along).lerp(end, bent);
            let closed = (-(along / SPHINCTER_MM).powi(2)).exp();
            (place, URETHRA_MM - NARROWER_MM * closed)
        }))
        .unzip();
    let mut shape = shapes::Shape::default();
    shape.tube(&line, |point| radii[point]);
    shape.mesh()
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
fn landmarks(case: &Case) -> Vec<(LandmarkMarker, Mesh, Vec3)> {
    let marker = |landmark: Landmark| {
        let place = landmark.place(case)?.as_vec3();
        let ball = || Mesh::from(Sphere::new(1.1));
        let (colour, mesh) = match landmark {
            Landmark::BladderNeck => ([0.95, 0.75, 0.10], ball()),
            Landmark::Verumontanum => ([0.15, 0.85, 0.30], ball()),
            Landmark::ExternalSphincter => ([0.90, 0.15, 0.55], shapes::ring(URETHRA_MM + 0.8, 0.7)),
            Landmark::LeftOrifice | Landmark::RightOrifice => ([0.30, 0.55, 0.95], ball()),
        };
        let name = match landmark {
            // Short: they stand beside each other at the edge of the view.
            Landmark::LeftOrifice => "left orifice",
            Landmark::RightOrifice => "right orifice",
            _ => landmark.name(),
        };
        let marker = LandmarkMarker {
            name: name.into(),
            colour: LinearRgba::from_f32_array_no_alpha(colour),
        };
        Some((marker, mesh, place))
    };
    Landmark::ALL.into_iter().filter_map(marker).collect()
}
