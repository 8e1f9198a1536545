//! Which view is where in the window: the endoscope, the outside, or both beside each other.

use bevy::{
    camera::{SubCameraView, Viewport, visibility::RenderLayers},
    core_pipeline::tonemapping::Tonemapping,
    post_process::msaa_writeback::MsaaWritebackPlugin,
    prelude::*,
    render::{render_resource::WgpuAdapterInfo, renderer::RenderAdapterInfo},
    window::PrimaryWindow,
};
use bevy_egui::{EguiGlobalSettings, PrimaryEguiContext};
use resecta_scenario::ActiveExercise;

use super::{
    flow::{GameFlow, Phase},
    menu::UiZoom,
    panel::PANEL_WIDTH,
};
use crate::view::{EndoscopeCamera, OutsideCamera, ViewSystems, endoscope_camera, outside_camera};

/// Smallest side of a view, physical pixels.
const SMALLEST: u32 = 16;
/// How far down the outside view's picture moves, as a share of its height, where the card of a step lies over its upper part.
const BELOW_CARD: f32 = 0.08;
/// Share of the width that the endoscope gets beside the outside view, at most.
const ENDOSCOPE_SHARE: f32 = 0.62;

/// Where the gland of the title begins, as a share of the width; its words stand at the left.
pub const TITLE_VIEW_FROM: f32 = 0.25;

pub fn plugin(app: &mut App) {
    // Without it a camera with smooth edges draws over what those before it left in the window: the endoscope's round field is lost.
    if !app.is_plugin_added::<MsaaWritebackPlugin>() {
        app.add_plugins(MsaaWritebackPlugin);
    }
    app.init_resource::<ViewLayout>()
        .add_systems(Startup, add_cameras)
        .add_systems(Update, arrange.in_set(ViewSystems::First));
}

/// Which views are shown.
#[derive(Resource, Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum ViewLayout {
    /// Both, the endoscope larger.
    #[default]
    Both,
    /// The endoscope alone.
    Endoscope,
    /// The outside view alone.
    Outside,
}

impl ViewLayout {
    /// The one that follows.
    pub fn next(self) -> Self {
        match self {
            ViewLayout::Both => ViewLayout::Endoscope,
            ViewLayout::Endoscope => ViewLayout::Outside,
            ViewLayout::Outside => ViewLayout::Both,
        }
    }

    /// Places of endoscope and outside view in an area of this size, physical pixels; none for one that is not shown.
    pub(super) fn places(self, area: UVec2) -> [Option<URect>; 2] {
        let all = URect::from_corners(UVec2::ZERO, area.max(UVec2::splat(SMALLEST)));
        match self {
            ViewLayout::Endoscope => [Some(all), None],
            ViewLayout::Outside => [None, Some(all)],
            // Side by side where the area is wide, one above the other where it is high.
            ViewLayout::Both => {
                let size = all.size();
                let is_wide = size.x as f32 > size.y as f32 * 1.1;
                let (long, short) = if is_wide { (size.x, size.y) } else { (size.y, size.x) };
                let first = short
                    .min((long as f32 * ENDOSCOPE_SHARE) as u32)
                    .clamp(SMALLEST, long.max(2 * SMALLEST) - SMALLEST);
                let corner = if is_wide {
                    (UVec2::new(first, size.y), UVec2::new(first, 0))
                } else {
                    (UVec2::new(size.x, first), UVec2::new(0, first))
                };
                [
                    Some(URect::from_corners(UVec2::ZERO, corner.0)),
                    Some(URect::from_corners(corner.1, size.max(corner.1 + SMALLEST))),
                ]
            }
        }
    }
}

pub(super) fn add_cameras(
    // None where nothing draws.
    adapter: Option<Res<RenderAdapterInfo>>,
    mut settings: ResMut<EguiGlobalSettings>,
    mut commands: Commands,
) {
    settings.auto_create_primary_context = false;
    let msaa = adapter.map_or(Msaa::Off, |adapter| smoothing(&adapter));
    commands.spawn((endoscope_camera(), msaa));
    commands.spawn((
        outside_camera(),
        Camera {
            order: 1,
            // The first camera clears the window; the outside view has a background of its own.
            clear_color: ClearColorConfig::None,
            ..default()
        },
        msaa,
    ));
    // The panel covers the whole window, draws nothing of the world, and goes on top of what the others drew: that takes
    // the same smoothing, so that all three share one texture.
    commands.spawn((
        PrimaryEguiContext,
        Camera2d,
        RenderLayers::none(),
        Camera {
            order: 2,
            clear_color: ClearColorConfig::None,
            ..default()
        },
        Tonemapping::None,
        msaa,
    ));
}

/// Smooth edges, but not where the processor draws: there it halves the rate of pictures.
fn smoothing(adapter: &WgpuAdapterInfo) -> Msaa {
    if format!("{:?}", adapter.device_type) == "Cpu" {
        Msaa::Off
    } else {
        Msaa::Sample4
    }
}

fn arrange(
    layout: Res<ViewLayout>,
    flow: Res<GameFlow>,
    active: Option<Res<ActiveExercise>>,
    zoom: Res<UiZoom>,
    windows: Query<&Window, With<PrimaryWindow>>,
    mut endoscopes: Query<&mut Camera, (With<EndoscopeCamera>, Without<OutsideCamera>)>,
    mut outsides: Query<&mut Camera, With<OutsideCamera>>,
) {
    let Ok(window) = windows.single() else { return };
    let panel = if flow.phase.shows_exercise() {
        (PANEL_WIDTH * zoom.0 * window.scale_factor()) as u32
    } else {
        0
    };
    let size = window.physical_size();
    let area = UVec2::new(size.x.saturating_sub(panel), size.y);
    // A minimised window has no size.
    if area.cmplt(UVec2::splat(SMALLEST * 2)).any() {
        return;
    }
    let [endoscope, outside] = match flow.phase {
        Phase::Title => {
            let left = (area.x as f32 * TITLE_VIEW_FROM) as u32;
            [None, Some(URect::from_corners(UVec2::new(left, 0), area))]
        }
        // Screens of their own, that cover all.
        Phase::Choosing | Phase::Progress | Phase::Outlines | Phase::Preparing | Phase::Result => [None, None],
        Phase::Briefing | Phase::Playing | Phase::Paused => layout.places(area),
    };
    for mut camera in &mut endoscopes {
        place(&mut camera, endoscope);
    }
    let has_card = *layout == ViewLayout::Both
        && matches!(flow.phase, Phase::Playing | Phase::Paused)
        && active.is_some_and(|active| !active.exercise.steps.is_empty());
    for mut camera in &mut outsides {
        place(&mut camera, outside);
        let lowered = outside.filter(|_| has_card).map(|outside| lowered(outside.size()));
        let is_so = match (&camera.sub_camera_view, &lowered) {
            (None, None) => true,
            (Some(is), Some(wanted)) => is.offset == wanted.offset && is.size == wanted.size,
            _ => false,
        };
        if !is_so {
            camera.sub_camera_view = lowered;
        }
    }
}

/// A picture of this size, physical pixels, of which the upper part is free.
fn lowered(size: UVec2) -> SubCameraView {
    SubCameraView {
        full_size: size,
        offset: Vec2::new(0.0, -BELOW_CARD * size.y as f32),
        size,
    }
}

pub(super) fn place(camera: &mut Mut<Camera>, place: Option<URect>) {
    if camera.is_active != place.is_some() {
        camera.is_active = place.is_some();
    }
    let Some(place) = place else { return };
    let is_there = camera
        .viewport
        .as_ref()
        .is_some_and(|viewport| viewport.physical_position == place.min && viewport.physical_size == place.size());
    if !is_there {
        camera.viewport = Some(Viewport {
            physical_position: place.min,
            physical_size: place.size(),
            ..default()
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn views_lie_inside_the_area_and_never_overlap() {
        for width in (40..2600).step_by(131) {
            for height in (40..1700).step_by(97) {
                let area = UVec2::new(width, height);
                for layout in [ViewLayout::Both, ViewLayout::Endoscope, ViewLayout::Outside] {
                    let places: Vec<URect> = layout.places(area).into_iter().flatten().collect();
                    for place in &places {
                        assert!(
                            place.max.cmple(area).all() && !place.is_empty(),
                            "{layout:?} {area} {place:?}"
                        );
                    }
                    if let [first, second] = places[..] {
                        assert!(first.intersect(second).is_empty(), "{area} {first:?} {second:?}");
                    }
                }
            }
        }
    }

    #[test]
    fn three_steps_lead_back() {
        let start = ViewLayout::default();
        assert_eq!(start.next().next().next(), start);
    }
}
