//! The round field: what the eye sees of the lens's picture, as a pass over the finished picture.
//!
//! Bent as by a telescope ([`BARREL`]), darker towards the rim, black outside, the mark of 12 o'clock on the rim, tissue that nearly
//! touches the lens out of focus, and the [`Veil`] of tissue at the lens. What is drawn in the window beside the endoscope's picture
//! stays as it is.
//!
//! The finished picture may have been drawn with fewer pixels than are shown ([`Fineness`]): this pass is what spreads them.

use bevy::{
    asset::embedded_asset,
    camera::MainPassResolutionOverride,
    core_pipeline::fullscreen_material::{FullscreenMaterial, FullscreenMaterialPlugin},
    ecs::query::QueryItem,
    prelude::*,
    render::{extract_component::ExtractComponent, render_resource::ShaderType, sync_component::SyncComponent},
    shader::ShaderRef,
};
use resecta_scenario::ActiveExercise;

use super::{
    ViewSystems,
    between::Drawn,
    cameras::{EndoscopeCamera, follow_lens},
    veil::Veil,
};

/// Barrel distortion: the rim lies by this share of its distance nearer to the middle than it would at the scale of the middle.
/// 10 to 15 % is common for telescopes (practice). The rim itself stays where it is, and with it the field of view.
const BARREL: f32 = 0.12;

/// With how many pixels an endoscope camera's picture is drawn, as a share of those shown, on each side: 0.1 to 1, which is
/// where it begins. What lies outside counts as the nearest within, what is no number as 1.
#[derive(Component, Reflect, Debug, Clone, Copy, PartialEq)]
#[reflect(Component, Default)]
pub struct Fineness(pub f32);

impl Default for Fineness {
    fn default() -> Self {
        Fineness(1.0)
    }
}

impl Fineness {
    /// Of a picture of so many pixels, those to draw.
    fn drawn(self, shown: UVec2) -> UVec2 {
        let share = if self.0.is_nan() { 1.0 } else { self.0.clamp(0.1, 1.0) };
        (shown.as_vec2() * share).round().as_uvec2().max(UVec2::ONE)
    }
}

pub fn plugin(app: &mut App) {
    app.register_type::<Fineness>();
    embedded_asset!(app, "round_field.wgsl");
    app.add_plugins(FullscreenMaterialPlugin::<RoundField>::default())
        .add_systems(Update, follow.after(follow_lens).in_set(ViewSystems::Follow));
}

/// What the pass knows, as its shader has it.
#[derive(Component, ShaderType, Debug, Clone, Copy, Default, PartialEq)]
pub struct RoundField {
    /// Corner and size of the camera's part of the target, pixels.
    area: Vec4,
    /// With how many of its pixels, from its corner on, the picture is drawn.
    drawn: Vec2,
    /// Where the lens is, mm.
    place: Vec3,
    /// Of the field, pixels.
    radius: f32,
    /// Directions of the picture, long enough to reach the rim 1 mm ahead.
    right: Vec3,
    /// By which 12 o'clock is turned counter-clockwise, radians.
    roll: f32,
    up: Vec3,
    /// As in [`Veil`]: in the middle, and around it.
    veil: f32,
    ahead: Vec3,
    /// As [`BARREL`].
    barrel: f32,
    veils: Vec4,
    /// Where those around it are, as a share of the field's radius.
    beside: f32,
}

impl FullscreenMaterial for RoundField {
    fn fragment_shader() -> ShaderRef {
        "embedded://resecta/view/round_field.wgsl".into()
    }
}

impl SyncComponent for RoundField {
    type Target = (RoundField, MainPassResolutionOverride);
}

impl ExtractComponent for RoundField {
    type QueryData = (&'static RoundField, &'static Camera);
    type QueryFilter = ();
    type Out = (RoundField, MainPassResolutionOverride);

    fn extract_component((field, camera): QueryItem<Self::QueryData>) -> Option<Self::Out> {
        // A window that shrank in this frame has fewer pixels than the field knows of.
        let drawn = field.drawn.as_uvec2().min(camera.physical_viewport_size()?);
        // Before the camera has an area there is nothing to draw in it.
        (drawn.min_element() >= 1).then_some((*field, MainPassResolutionOverride(drawn)))
    }
}

/// How far from the middle a straight picture has what a telescope shows so far from it; the field's radius is 1.
fn straight(shown: f32) -> f32 {
    shown * (1.0 - BARREL + BARREL * shown * shown)
}

/// Where a telescope shows what a straight picture has at a place, both from the middle.
fn shown(place: Vec2) -> Vec2 {
    let far = place.length();
    // Newton's method on a cubic that rises everywhere, from where it is too large.
    let root = (0..6).fold(far.max(1.0), |root, _| {
        root - (straight(root) - far) / (1.0 - BARREL + 3.0 * BARREL * root * root)
    });
    place.normalize_or_zero() * root
}

/// Where an endoscope camera's picture shows what its projection has at a point of its viewport, both in logical pixels of the
/// window: what points at a place of the world must point there.
pub fn shown_at(camera: &Camera, at: Vec2) -> Option<Vec2> {
    let area = camera.logical_viewport_rect()?;
    let radius = 0.5 * area.size().min_element();
    (radius > 0.0).then(|| area.center() + radius * shown((at - area.center()) / radius))
}

fn follow(
    active: Option<Res<ActiveExercise>>,
    instruments: Query<Drawn>,
    mut cameras: Query<(&Camera, &Transform, &Veil, &Fineness, &mut RoundField), With<EndoscopeCamera>>,
) {
    let Some(instrument) = active.and_then(|active| instruments.get(active.instrument).ok()) else {
        return;
    };
    let (scope, state) = instrument.get();
    let half = (scope.geometry.field_of_view_deg.to_radians() / 2.0).tan();
    for (camera, lens, veil, fineness, mut field) in &mut cameras {
        let Some(area) = camera.physical_viewport_rect() else {
            continue;
        };
        let drawn = fineness.drawn(area.size()).as_vec2();
        let area = area.as_rect();
        field.set_if_neq(RoundField {
            area: Vec4::from((area.min, area.size())),
            drawn,
            place: lens.translation,
            radius: 0.5 * area.size().min_element(),
            right: lens.right() * half,
            roll: state.roll_deg.to_radians(),
            up: lens.up() * half,
            veil: veil.middle,
            ahead: lens.forward().into(),
            barrel: BARREL,
            veils: veil.around.into(),
            beside: Veil::beside() / half,
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_shown_is_found_again() {
        for far in 0..60 {
            for round in 0..12 {
                let place = Vec2::from_angle(0.5 * round as f32) * (0.025 * far as f32);
                let back = place.normalize_or_zero() * straight(place.length());
                assert!(shown(back).distance(place) < 1e-5, "{place}");
                assert!(
                    (straight(shown(place).length()) - place.length()).abs() < 1e-5,
                    "{place}"
                );
            }
        }
    }

    #[test]
    fn what_is_drawn_is_no_more_than_what_is_shown_and_never_nothing() {
        let shown = UVec2::new(801, 720);
        assert_eq!(Fineness::default().drawn(shown), shown);
        assert_eq!(Fineness(0.5).drawn(shown), UVec2::new(401, 360));
        for (share, least) in [(7.0, shown), (f32::NAN, shown), (-1.0, UVec2::new(80, 72))] {
            assert_eq!(Fineness(share).drawn(shown), least, "{share}");
        }
        assert_eq!(Fineness(0.1).drawn(UVec2::ONE), UVec2::ONE);
    }

    #[test]
    fn straight_lines_bow_outwards_and_the_rim_stays() {
        for round in 0..12 {
            let rim = Vec2::from_angle(0.5 * round as f32);
            assert!(shown(rim).distance(rim) < 1e-6);
        }
        // The scale of the middle would bring the rim further out.
        let scale = shown(Vec2::X * 1e-3).x / 1e-3;
        assert!((1.0 - 1.0 / scale - BARREL).abs() < 1e-4, "{scale}");
        assert!((0.10..=0.15).contains(&BARREL));
        // An upright line right of the middle: its ends at the rim stay, all between bows away from the middle.
        let line = |y: f32| shown(Vec2::new(0.5, y));
        let end = line(0.75f32.sqrt());
        assert!((end.x - 0.5).abs() < 1e-5);
        let mut before = line(0.0).x;
        assert!(before > 0.54);
        for step in 1..=8 {
            let now = line(0.1 * step as f32).x;
            assert!(now < before && now > 0.5, "{step}");
            before = now;
        }
    }
}
