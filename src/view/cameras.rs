//! The two cameras: one at the lens, one around the gland.

use bevy::{
    camera::{Projection, visibility::RenderLayers},
    core_pipeline::{prepass::DepthPrepass, tonemapping::Tonemapping},
    prelude::*,
};
use resecta_scenario::ActiveExercise;

use super::{
    ENDOSCOPE_LAYER, OUTSIDE_LAYER, ViewSystems,
    between::Drawn,
    blood::Water,
    gland::sagittal,
    palette,
    round_field::{Fineness, RoundField},
    veil::Veil,
};

/// Nearest distance that is drawn, mm. Tissue may nearly touch the lens.
const NEAR_MM: f32 = 0.05;
/// What is seen where there is nothing lies so far away, mm.
const FAR_MM: f32 = 40.0;
/// Vertical angle of the outside view, degrees.
const OUTSIDE_DEG: f32 = 32.0;
/// Room around gland and bladder in the outside view, as a share of their size.
const MARGIN: f32 = 0.62;
/// How far the middle of the outside view lies above the middle of the gland, mm: the bladder is looked at, the urethra not.
const ABOVE_MM: f32 = 12.0;

pub fn plugin(app: &mut App) {
    app.register_type::<EndoscopeCamera>()
        .register_type::<OutsideCamera>()
        .add_systems(Update, (follow_lens, go_round).in_set(ViewSystems::Follow));
}

/// A camera that looks through the lens of the exercise's instrument: the largest circle of its picture is the lens's
/// field of view.
#[derive(Component, Reflect, Debug, Default, Clone, Copy)]
#[reflect(Component, Default)]
pub struct EndoscopeCamera;

/// A camera that looks at the gland from outside.
#[derive(Component, Reflect, Debug, Clone, Copy, PartialEq)]
#[reflect(Component, Default)]
pub struct OutsideCamera {
    /// Direction from the gland to the camera, degrees around the gland's axis: 0 the patient's left, growing towards
    /// anterior.
    pub round_deg: f32,
    /// The same along the axis: positive is towards the bladder, -85 to 85.
    pub along_deg: f32,
    /// Distance as a share of the one that shows all, 0.2 to 2.
    pub distance: f32,
    /// How far what is looked at lies to the right and above the middle of the gland as the camera sees it, mm, -80 to 80.
    pub aside_mm: Vec2,
}

impl Default for OutsideCamera {
    /// From the patient's left, slightly from the front and from below: the bladder is to the right.
    fn default() -> Self {
        OutsideCamera {
            round_deg: 14.0,
            along_deg: -12.0,
            distance: 1.0,
            aside_mm: Vec2::ZERO,
        }
    }
}

impl OutsideCamera {
    /// Turns by degrees, within the limits.
    pub fn turn(&mut self, round_deg: f32, along_deg: f32) {
        self.round_deg = (self.round_deg + round_deg).rem_euclid(360.0);
        self.along_deg = (self.along_deg + along_deg).clamp(-85.0, 85.0);
    }

    /// Goes nearer (factor below 1) or farther, within the limits.
    pub fn approach(&mut self, factor: f32) {
        self.distance = (self.distance * factor).clamp(0.2, 2.0);
    }

    /// Looks at something else, by mm to the right and up, within the limits.
    pub fn move_aside(&mut self, by_mm: Vec2) {
        self.aside_mm = (self.aside_mm + by_mm).clamp(Vec2::splat(-80.0), Vec2::splat(80.0));
    }

    /// Unit direction from the gland to the camera.
    fn direction(&self) -> Vec3 {
        let (round_sin, round_cos) = self.round_deg.to_radians().sin_cos();
        let (along_sin, along_cos) = self.along_deg.to_radians().sin_cos();
        Vec3::new(round_cos * along_cos, -round_sin * along_cos, along_sin)
    }
}

/// Everything that an endoscope camera needs but a target and a place in the order of cameras.
pub fn endoscope_camera() -> impl Bundle {
    (
        EndoscopeCamera,
        Veil::default(),
        RoundField::default(),
        Fineness::default(),
        Camera3d::default(),
        Projection::Perspective(PerspectiveProjection {
            near: NEAR_MM,
            far: 500.0,
            ..default()
        }),
        Tonemapping::None,
        // Folds of tissue lie behind each other: only the nearest is worth lighting.
        DepthPrepass,
        RenderLayers::layer(ENDOSCOPE_LAYER),
        Transform::default(),
        Visibility::default(),
    )
}

/// Everything that an outside camera needs but a target and a place in the order of cameras.
pub fn outside_camera() -> impl Bundle {
    (
        OutsideCamera::default(),
        Camera3d::default(),
        Projection::Perspective(PerspectiveProjection {
            fov: OUTSIDE_DEG.to_radians(),
            near: 5.0,
            far: 2000.0,
            ..default()
        }),
        Tonemapping::None,
        RenderLayers::layer(OUTSIDE_LAYER),
        Transform::default(),
    )
}

/// Background of the endoscope's picture; the outside view brings its own.
pub(super) fn endoscope_background() -> Color {
    palette::DEEP.into()
}

pub(super) fn follow_lens(
    active: Option<Res<ActiveExercise>>,
    instruments: Query<Drawn>,
    water: Res<Water>,
    mut cameras: Query<(&mut Camera, &mut Projection, &mut Transform), With<EndoscopeCamera>>,
) {
    let Some(instrument) = active.and_then(|active| instruments.get(active.instrument).ok()) else {
        return;
    };
    let (scope, state) = instrument.get();
    let half = (scope.geometry.field_of_view_deg.to_radians() / 2.0).tan();
    for (mut camera, mut projection, mut transform) in &mut cameras {
        let background = water.beyond(palette::DEEP, FAR_MM);
        camera.clear_color = ClearColorConfig::Custom(background.into());
        *transform = Transform::from_isometry(scope.lens_pose(state));
        let aspect = aspect(&camera);
        if let Projection::Perspective(perspective) = &mut *projection {
            // The projection's angle is the vertical one; in a picture higher than wide the circle touches the sides.
            perspective.fov = 2.0 * (half / aspect.min(1.0)).atan();
        }
    }
}

fn go_round(active: Option<Res<ActiveExercise>>, mut cameras: Query<(&Camera, &OutsideCamera, &mut Transform)>) {
    let Some(active) = active else { return };
    let Some((centre, radius)) = extent(&active) else {
        return;
    };
    for (camera, outside, mut transform) in &mut cameras {
        let half = (OUTSIDE_DEG.to_radians() / 2.0).tan() * aspect(camera).min(1.0);
        let distance = radius * (1.0 + MARGIN) / half * outside.distance;
        // Posterior (+y) is down. Beside the axis this never degenerates: the camera stays 5 degrees off it.
        let up = if outside.direction().y.abs() > 0.95 {
            Vec3::Z
        } else {
            Vec3::NEG_Y
        };
        let there = Transform::from_translation(centre + outside.direction() * distance).looking_at(centre, up);
        let aside = there.right() * outside.aside_mm.x + there.up() * outside.aside_mm.y;
        *transform = there.with_translation(there.translation + aside);
    }
}

fn aspect(camera: &Camera) -> f32 {
    camera
        .logical_viewport_size()
        .filter(|size| size.y > 0.0)
        .map_or(4.0 / 3.0, |size| size.x / size.y)
}

/// Middle and half height of what the outside view shows: the gland, from its apex to above the bladder neck.
fn extent(active: &ActiveExercise) -> Option<(Vec3, f32)> {
    let slices = &active.case.slices;
    let (low, high) = (slices.first()?.z as f32, slices.last()?.z as f32);
    let middle = slices[slices.len() / 2].capsule.iter();
    let (mut front, mut back) = (f32::INFINITY, f32::NEG_INFINITY);
    for point in middle {
        (front, back) = (front.min(point.y as f32), back.max(point.y as f32));
    }
    let centre = Vec3::new(
        sagittal(&active.case).x,
        (front + back) / 2.0,
        (low + high) / 2.0 + ABOVE_MM,
    );
    Some((centre, ((high - low).max(back - front)) / 2.0))
}
