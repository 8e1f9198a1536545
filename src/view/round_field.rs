//! The round field: what the eye sees of the lens's picture, as a pass over the finished picture.
//!
//! Darker towards the rim, black outside, the mark of 12 o'clock on the rim, and the [`Veil`] of tissue at the lens. What is
//! drawn in the window beside the endoscope's picture stays as it is.

use bevy::{
    asset::embedded_asset,
    core_pipeline::fullscreen_material::{FullscreenMaterial, FullscreenMaterialPlugin},
    prelude::*,
    render::{extract_component::ExtractComponent, render_resource::ShaderType},
    shader::ShaderRef,
};
use resecta_instrument::{InstrumentState, Resectoscope};
use resecta_scenario::ActiveExercise;

use super::{
    ViewSystems,
    cameras::{EndoscopeCamera, follow_lens},
    veil::Veil,
};

pub fn plugin(app: &mut App) {
    embedded_asset!(app, "round_field.wgsl");
    app.add_plugins(FullscreenMaterialPlugin::<RoundField>::default())
        .add_systems(Update, follow.after(follow_lens).in_set(ViewSystems::Follow));
}

/// What the pass knows, as its shader has it.
#[derive(Component, ExtractComponent, ShaderType, Debug, Clone, Copy, Default, PartialEq)]
pub struct RoundField {
    /// Corner and size of the camera's part of the target, pixels.
    area: Vec4,
    /// Where the lens is, mm.
    place: Vec3,
    /// Of the field, pixels.
    radius: f32,
    /// Directions of the picture, long enough to reach the rim 1 mm ahead.
    right: Vec3,
    /// By which 12 o'clock is turned counter-clockwise, radians.
    roll: f32,
    up: Vec3,
    /// As in [`Veil`].
    veil: f32,
    ahead: Vec3,
    side: Vec2,
}

impl FullscreenMaterial for RoundField {
    fn fragment_shader() -> ShaderRef {
        "embedded://resecta/view/round_field.wgsl".into()
    }
}

fn follow(
    active: Option<Res<ActiveExercise>>,
    instruments: Query<(&Resectoscope, &InstrumentState)>,
    mut cameras: Query<(&Camera, &Transform, &Veil, &mut RoundField), With<EndoscopeCamera>>,
) {
    let Some((scope, state)) = active.and_then(|active| instruments.get(active.instrument).ok()) else {
        return;
    };
    let half = (scope.geometry.field_of_view_deg.to_radians() / 2.0).tan();
    for (camera, lens, veil, mut field) in &mut cameras {
        let Some(area) = camera.physical_viewport_rect().map(|area| area.as_rect()) else {
            continue;
        };
        field.set_if_neq(RoundField {
            area: Vec4::from((area.min, area.size())),
            place: lens.translation,
            radius: 0.5 * area.size().min_element(),
            right: lens.right() * half,
            roll: state.roll_deg.to_radians(),
            up: lens.up() * half,
            veil: veil.share,
            ahead: lens.forward().into(),
            side: veil.side,
        });
    }
}
