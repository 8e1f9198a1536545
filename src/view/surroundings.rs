//! What lies around the gland: the bladder above it, the urethra below it, the landmarks.

use bevy::{
    camera::visibility::{NoFrustumCulling, RenderLayers},
    math::DVec2,
    prelude::*,
};
use resecta_anatomy::{BladderShape, Case, Landmark, Slice};
use resecta_instrument::{InstrumentState, Resectoscope};
use resecta_scenario::ActiveExercise;
use resecta_tissue::Tissue;

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
/// Below the pivot the urethra lies as the sheath does, which takes it along; it bends over this length, mm. It is drawn anew where the
/// sheath has turned by more than this, degrees; for the lens only with less than so much of the sheath beyond the pivot, mm: from further in,
/// nothing of it is seen.
const BENT_OVER_MM: f32 = 4.0;
const TURNED_DEG: f32 = 1.0;
const NEAR_PIVOT_MM: f32 = 8.0;
/// Points of its line, for the lens and from outside.
const POINTS: [usize; 2] = [60, 18];
/// For the lens, it goes on into the gland for so long, mm, wider by so much for each: a sheath that is tilted lifts the end of the
/// gland off it, and there was nothing to be seen between the two.
const INTO_MM: f32 = 9.0;
const WIDER_INTO: f32 = 0.45;

pub fn plugin(app: &mut App) {
    app.register_type::<LandmarkMarker>().add_systems(
        Update,
        (
            surround.in_set(ViewSystems::Dress),
            (take_along, move_markers).in_set(ViewSystems::Follow),
        ),
    );
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

/// The landmark that a marker stands for.
#[derive(Component, Clone, Copy)]
struct Marks(Landmark);

/// The urethra below the gland, as one of the views has it.
#[derive(Component, Clone, Copy)]
struct Urethra {
    is_for_lens: bool,
    /// The direction of the sheath that it was drawn for.
    sheath: Vec3,
}

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

    let views = [(true, inside, ENDOSCOPE_LAYER), (false, outside, OUTSIDE_LAYER)];
    let bladder = bladder(&active.case).map(|(mesh, place)| (meshes.add(mesh), place));
    let markers = landmarks(&active.case);

    commands
        .entity(active.tissue)
        .insert((Surroundings, Visibility::default()))
        .with_children(|gland| {
            for (is_for_lens, material, layer) in views {
                let urethra = Urethra {
                    is_for_lens,
                    sheath: scope.axis(),
                };
                let dress = (MeshMaterial3d(material), RenderLayers::layer(layer));
                gland.spawn((
                    Mesh3d(meshes.add(urethra.mesh(scope, &active.case))),
                    urethra,
                    dress.clone(),
                ));
                if let Some((mesh, place)) = &bladder {
                    gland.spawn((Mesh3d(mesh.clone()), *place, dress));
                }
            }
            gland.spawn((
                Mesh3d(meshes.add(Sphere::new(1500.0).mesh().uv(24, 12))),
                MeshMaterial3d(background),
                RenderLayers::layer(OUTSIDE_LAYER),
                NoFrustumCulling,
            ));
            for (landmark, marker, mesh, place) in markers {
                let material = ViewMaterial {
                    look: Look {
                        colour: marker.colour,
                        glow: 0.55,
                        ..default()
                    },
                    // Seen through tissue: a landmark that is hidden guides nobody.
                    nearer_percent: 15,
                    ..default()
                };
                gland.spawn((
                    Name::new(marker.name.clone()),
                    marker,
                    Marks(landmark),
                    Mesh3d(meshes.add(mesh)),
                    MeshMaterial3d(materials.add(material)),
                    Transform::from_translation(place),
                    RenderLayers::layer(OUTSIDE_LAYER),
                ));
            }
        });
}

/// Draws the urethra anew where the sheath has taken it along.
fn take_along(
    active: Option<Res<ActiveExercise>>,
    instruments: Query<(&InstrumentState, &Resectoscope)>,
    mut urethras: Query<(&mut Urethra, &Mesh3d)>,
    mut meshes: ResMut<Assets<Mesh>>,
) {
    let Some(active) = active else { return };
    let Ok((state, scope)) = instruments.get(active.instrument) else {
        return;
    };
    let sheath = scope.sheath_pose(state).rotation * Vec3::NEG_Z;
    for (mut urethra, mesh) in &mut urethras {
        let is_seen = !urethra.is_for_lens || state.insertion_mm < NEAR_PIVOT_MM;
        if !is_seen || sheath.dot(urethra.sheath) >= TURNED_DEG.to_radians().cos() {
            continue;
        }
        urethra.sheath = sheath;
        if let Some(mut mesh) = meshes.get_mut(&mesh.0) {
            *mesh = urethra.mesh(scope, &active.case);
        }
    }
}

/// Moves the markers with their landmarks: one in a frame, in turn, for each looks at all nodes.
fn move_markers(
    active: Option<Res<ActiveExercise>>,
    tissues: Query<&Tissue>,
    mut markers: Query<(&Marks, &mut Transform)>,
    mut turn: Local<usize>,
) {
    let Some(active) = active else { return };
    let Ok(tissue) = tissues.get(active.tissue) else { return };
    *turn = (*turn + 1) % Landmark::ALL.len();
    if let Some((marks, mut transform)) = markers.iter_mut().nth(*turn)
        && let Some(place) = active.landmark(marks.0, tissue)
    {
        transform.translation = place;
    }
}

impl Urethra {
    fn mesh(&self, scope: &Resectoscope, case: &Case) -> Mesh {
        let (line, radii) = self.line(scope, case);
        let mut shape = shapes::Shape::default();
        shape.tube(&line, |point| radii[point]);
        shape.mesh()
    }

    /// Its middle and radius, mm, from the lumen at the gland's lower end, for the lens from so far within, down along the instrument's axis
    /// to the pivot, narrower at the sphincter there, and on as the sheath lies.
    fn line(&self, scope: &Resectoscope, case: &Case) -> (Vec<Vec3>, Vec<f32>) {
        let (pivot, axis) = (scope.pivot(), scope.axis());
        let lumen = |slice: &Slice| {
            let wall = slice.urethra.as_ref()?;
            let middle: DVec2 = wall.iter().sum::<DVec2>() / wall.len().max(1) as f64;
            Some(middle.extend(slice.z).as_vec3())
        };
        let first = case.slices.first().and_then(lumen);
        let end = first.unwrap_or(pivot + axis * JOINS_MM);
        let upwards = case.slices.get(1).and_then(lumen).map_or(axis, |next| next - end);
        let within = [1.0, 0.5].into_iter().filter(|_| self.is_for_lens).map(|share| {
            let mm = share * INTO_MM;
            (end + mm * upwards.normalize_or(axis), URETHRA_MM + WIDER_INTO * mm)
        });
        let points = if self.is_for_lens { POINTS[0] } else { POINTS[1] };
        let step_mm = URETHRA_LENGTH_MM / points as f32;
        let mut below = pivot;
        let along = (0..=points).map(|point| JOINS_MM - step_mm * point as f32);
        within
            .chain(along.map(|along| {
                let place = if along >= 0.0 {
                    // Bent to where the lumen is, over its last stretch.
                    let bent = (along / JOINS_MM).powi(2);
                    (pivot + axis * along).lerp(end, bent)
                } else {
                    let turned = (-along / BENT_OVER_MM).min(1.0);
                    below -= axis.lerp(self.sheath, turned).normalize_or(axis) * step_mm.min(-along);
                    below
                };
                let closed = (-(along / SPHINCTER_MM).powi(2)).exp();
                (place, URETHRA_MM - NARROWER_MM * closed)
            }))
            .unzip()
    }
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
fn landmarks(case: &Case) -> Vec<(Landmark, LandmarkMarker, Mesh, Vec3)> {
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
        Some((landmark, marker, mesh, place))
    };
    Landmark::ALL.into_iter().filter_map(marker).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::Trial;

    #[test]
    fn a_lens_that_is_drawn_back_lies_in_the_urethra_however_it_is_turned() {
        let mut trial = Trial::new(());
        trial.start("orientation").unwrap();
        let active = trial.active();
        let scope = trial.app.world().get::<Resectoscope>(active.instrument).unwrap();
        for (pitch_deg, yaw_deg) in [(0.0, 0.0), (-35.0, 0.0), (35.0, 0.0), (0.0, 35.0), (-25.0, -25.0)] {
            for insertion_mm in [-1.0, -5.0, -10.0, -20.0] {
                let state = InstrumentState {
                    insertion_mm,
                    pitch_deg,
                    yaw_deg,
                    ..default()
                };
                let urethra = Urethra {
                    is_for_lens: true,
                    sheath: scope.sheath_pose(&state).rotation * Vec3::NEG_Z,
                };
                let lens = Vec3::from(scope.lens_pose(&state).translation);
                let (line, radii) = urethra.line(scope, &active.case);
                let far = |(place, radius): (&Vec3, f32)| place.distance(lens) - radius;
                let within = line.iter().zip(radii).map(far).fold(f32::INFINITY, f32::min);
                assert!(within < 0.0, "{pitch_deg} {yaw_deg} {insertion_mm}: {within}");
            }
        }
    }
}
