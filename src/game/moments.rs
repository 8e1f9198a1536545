//! Pictures of the endoscope's view at key moments of a run, for the debriefing: the first cut, the one nearest to the capsule,
//! the worst bleeding. Where tissue lies before the lens then, the picture waits for it to come free.

use bevy::{
    asset::RenderAssetUsages,
    prelude::*,
    render::{
        render_resource::{Extent3d, TextureDimension},
        view::screenshot::{Screenshot, ScreenshotCaptured},
    },
    window::PrimaryWindow,
};
use bevy_egui::{EguiTextureHandle, EguiUserTextures, egui::TextureId};
use resecta_scenario::{ActiveExercise, Metrics};
use resecta_tissue::{Tissue, TissueResected};

use super::flow::{GameFlow, Phase};
use crate::{
    key_pictures::BLEEDING_ML_PER_S,
    view::{EndoscopeCamera, PICTURE_WAITS_S, Veil},
};

/// Side of a kept picture, pixels, at most.
const SIDE: usize = 360;
/// Simulated time between two pictures, s: reading the window back takes a part of a frame.
const APART_S: f64 = 1.5;
// What waits for a clear lens has its picture before the next one is noticed.
const _: () = assert!(PICTURE_WAITS_S < APART_S);
/// A cut this near to the capsule is worth a picture, mm: the next stroke may reach it. How much nearer than before it must come for
/// another, mm.
const NEAR_MM: f64 = 4.5;
const NEARER_MM: f64 = 0.3;
/// How many times worse than before it must be for another.
const WORSE: f64 = 1.3;

pub fn plugin(app: &mut App) {
    app.init_resource::<Moments>().add_systems(Update, watch);
}

/// Something worth a picture.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Moment {
    /// The first cut.
    FirstCut,
    /// The cut nearest to the capsule.
    NearestCut,
    /// The most blood lost in a second.
    WorstBleeding,
}

impl Moment {
    const ALL: [Moment; 3] = [Moment::FirstCut, Moment::NearestCut, Moment::WorstBleeding];
}

/// A picture of a moment.
#[derive(Debug, Clone)]
pub struct Kept {
    /// What it shows.
    pub words: String,
    /// Simulated time, s.
    pub time_s: f64,
    /// The picture, for egui.
    pub texture: TextureId,
    /// The picture.
    pub image: Handle<Image>,
}

/// The moments of the run in play.
#[derive(Resource, Debug, Default)]
pub struct Moments {
    kept: [Option<Kept>; 3],
    /// What was noticed, in words and when, and has no picture yet.
    waiting: Option<(Moment, String, f64)>,
    last_s: Option<f64>,
    nearest_mm: Option<f64>,
    worst_ml_per_s: f64,
    /// Blood lost and time at the beginning of the second that is looked at.
    second: [f64; 2],
}

impl Moments {
    /// The pictures that there are, in the order of [`Moment`].
    pub fn kept(&self) -> impl Iterator<Item = &Kept> {
        self.kept.iter().flatten()
    }
}

/// Notices key moments and asks for their pictures.
fn watch(
    flow: Res<GameFlow>,
    active: Option<Res<ActiveExercise>>,
    metrics: Res<Metrics>,
    tissues: Query<&Tissue>,
    cameras: Query<(&Camera, &Veil), With<EndoscopeCamera>>,
    windows: Query<&Window, With<PrimaryWindow>>,
    mut resections: MessageReader<TissueResected>,
    mut textures: ResMut<EguiUserTextures>,
    mut moments: ResMut<Moments>,
    mut commands: Commands,
) {
    if flow.phase == Phase::Briefing && moments.last_s.is_some() {
        for kept in std::mem::take(&mut *moments).kept() {
            textures.remove_image(&kept.image);
        }
    }
    // In an exercise with steps their card lies over the view.
    let active = active.filter(|active| active.exercise.steps.is_empty());
    let (Phase::Playing, Some(active)) = (flow.phase, active) else {
        resections.clear();
        return;
    };
    let nearest_mm = nearest_cut(&active, &tissues, &mut resections);
    let now_s = metrics.elapsed_s();
    if let Some(moment) = moments.notice(now_s, nearest_mm, metrics.water.blood_ml) {
        let words = match moment {
            Moment::FirstCut => "First cut".to_owned(),
            Moment::NearestCut => format!("Cut {:.1} mm from the capsule", moments.nearest_mm.unwrap_or(0.0)),
            Moment::WorstBleeding => format!("Worst bleeding: {:.1} ml/s", moments.worst_ml_per_s),
        };
        moments.waiting = Some((moment, words, now_s));
    }
    let (Ok(window), Ok((camera, veil))) = (windows.single(), cameras.single()) else {
        return;
    };
    let Some((moment, words, time_s)) = moments.due(now_s, veil.is_blind()) else {
        return;
    };
    let Some(viewport) = camera.viewport.as_ref().filter(|_| camera.is_active) else {
        return;
    };
    let area = URect::from_corners(
        viewport.physical_position,
        (viewport.physical_position + viewport.physical_size).min(window.physical_size()),
    );
    commands.spawn(Screenshot::primary_window()).observe(
        move |captured: On<ScreenshotCaptured>,
              mut images: ResMut<Assets<Image>>,
              mut textures: ResMut<EguiUserTextures>,
              mut moments: ResMut<Moments>| {
            let Some(picture) = square(&captured.image, area) else {
                return;
            };
            let image = images.add(picture);
            let texture = textures.add_image(EguiTextureHandle::Strong(image.clone()));
            let kept = Kept {
                words: words.clone(),
                time_s,
                texture,
                image,
            };
            if let Some(old) = moments.kept[moment as usize].replace(kept) {
                textures.remove_image(&old.image);
            }
        },
    );
}

/// The least distance to the capsule of what was cut since the last frame, mm.
fn nearest_cut(
    active: &ActiveExercise,
    tissues: &Query<&Tissue>,
    resections: &mut MessageReader<TissueResected>,
) -> Option<f64> {
    let tissue = tissues.get(active.tissue).ok()?;
    let cut = resections.read().filter(|resection| resection.tissue == active.tissue);
    cut.flat_map(|resection| &resection.taken_mm3)
        .map(|&(pentahedron, _)| {
            active
                .walls
                .capsule_mm(tissue.solver().rest_centroid(pentahedron).as_dvec3())
        })
        .reduce(f64::min)
}

impl Moments {
    /// Which moment this is, if any.
    fn notice(&mut self, now_s: f64, nearest_mm: Option<f64>, blood_ml: f64) -> Option<Moment> {
        let [was_ml, from_s] = self.second;
        let mut bleeding = None;
        if now_s - from_s >= 1.0 {
            bleeding = Some((blood_ml - was_ml) / (now_s - from_s));
            self.second = [blood_ml, now_s];
        }
        if self.last_s.is_some_and(|last_s| now_s - last_s < APART_S) {
            return None;
        }
        let noticed = Moment::ALL.into_iter().find(|moment| match moment {
            Moment::FirstCut => self.last_s.is_none() && nearest_mm.is_some(),
            Moment::NearestCut => {
                let wanted_mm = self.nearest_mm.map_or(NEAR_MM, |before| before - NEARER_MM);
                nearest_mm.is_some_and(|nearest| nearest < wanted_mm)
            }
            Moment::WorstBleeding => {
                bleeding.is_some_and(|bleeding| bleeding > BLEEDING_ML_PER_S.max(self.worst_ml_per_s * WORSE))
            }
        })?;
        match noticed {
            Moment::FirstCut => {}
            Moment::NearestCut => self.nearest_mm = nearest_mm,
            Moment::WorstBleeding => self.worst_ml_per_s = bleeding.unwrap_or(0.0),
        }
        self.last_s = Some(now_s);
        Some(noticed)
    }

    /// What was noticed and is to have its picture now, with its words and time.
    fn due(&mut self, now_s: f64, is_blind: bool) -> Option<(Moment, String, f64)> {
        (self.waiting).take_if(|(_, _, since_s)| !is_blind || now_s - *since_s >= PICTURE_WAITS_S)
    }
}

/// The largest square in the middle of an area of a picture, made small. None for a format of other than four bytes a pixel.
fn square(image: &Image, area: URect) -> Option<Image> {
    let data = image.data.as_ref()?;
    let size = image.size();
    let area = area.intersect(URect::from_corners(UVec2::ZERO, size));
    let side = area.width().min(area.height()) as usize;
    if side == 0 || data.len() != 4 * size.x as usize * size.y as usize {
        return None;
    }
    let corner = (area.center() - UVec2::splat(side as u32 / 2)).max(area.min);
    // Every pixel is the mean of a block.
    let block = side.div_ceil(SIDE);
    let small = side / block;
    let mut pixels = Vec::with_capacity(4 * small * small);
    for y in 0..small {
        for x in 0..small {
            let mut sum = [0u32; 4];
            for (dy, dx) in (0..block).flat_map(|dy| (0..block).map(move |dx| (dy, dx))) {
                let (column, row) = (corner.x as usize + x * block + dx, corner.y as usize + y * block + dy);
                let place = 4 * (row * size.x as usize + column);
                for (sum, byte) in sum.iter_mut().zip(&data[place..place + 4]) {
                    *sum += u32::from(*byte);
                }
            }
            pixels.extend(sum.map(|sum| (sum / (block * block) as u32) as u8));
        }
    }
    let size = Extent3d {
        width: small as u32,
        height: small as u32,
        depth_or_array_layers: 1,
    };
    let format = image.texture_descriptor.format;
    Some(Image::new(
        size,
        TextureDimension::D2,
        pixels,
        format,
        RenderAssetUsages::default(),
    ))
}

#[cfg(test)]
mod tests {
    use bevy::render::render_resource::TextureFormat;

    use super::*;

    #[test]
    fn moments_come_one_at_a_time_and_only_when_they_are_worse() {
        let mut moments = Moments::default();
        assert_eq!(moments.notice(0.5, None, 0.0), None);
        assert_eq!(moments.notice(1.0, Some(9.0), 0.0), Some(Moment::FirstCut));
        assert_eq!(moments.notice(1.5, Some(3.0), 0.0), None);
        assert_eq!(moments.notice(2.6, Some(8.0), 0.0), None, "not near");
        assert_eq!(moments.notice(3.0, Some(4.0), 0.0), Some(Moment::NearestCut));
        assert_eq!(moments.notice(5.0, Some(3.8), 0.0), None);
        assert_eq!(moments.notice(7.0, Some(2.9), 0.0), Some(Moment::NearestCut));
        assert_eq!(moments.notice(9.0, None, 1.0), Some(Moment::WorstBleeding));
        assert_eq!(moments.notice(11.0, None, 2.1), None);
        assert_eq!(moments.notice(13.0, None, 4.1), Some(Moment::WorstBleeding));
    }

    #[test]
    fn a_picture_waits_for_a_clear_lens_but_not_for_long() {
        let mut moments = Moments::default();
        let noticed = |time_s| (Moment::FirstCut, "First cut".to_owned(), time_s);
        assert_eq!(moments.due(1.0, false), None);
        moments.waiting = Some(noticed(1.0));
        assert_eq!(moments.due(1.0, true), None);
        assert_eq!(moments.due(1.5, false), Some(noticed(1.0)));
        assert_eq!(moments.due(1.6, false), None);
        moments.waiting = Some(noticed(5.0));
        assert_eq!(moments.due(5.0 + 0.9 * PICTURE_WAITS_S, true), None);
        assert_eq!(moments.due(5.0 + PICTURE_WAITS_S, true), Some(noticed(5.0)));
    }

    #[test]
    fn the_middle_of_the_area_is_kept_small() {
        let size = Extent3d {
            width: 1000,
            height: 800,
            depth_or_array_layers: 1,
        };
        let white_from = 300;
        let pixels = (0..800).flat_map(|_| (0..1000).flat_map(|x| [if x < white_from { 0 } else { 255 }; 4]));
        let image = Image::new(
            size,
            TextureDimension::D2,
            pixels.collect(),
            TextureFormat::Rgba8UnormSrgb,
            RenderAssetUsages::default(),
        );
        let picture = square(&image, URect::new(0, 0, 600, 800)).unwrap();
        let side = picture.width() as usize;
        assert!(side <= SIDE && side > SIDE / 2 && picture.height() as usize == side);
        let data = picture.data.as_ref().unwrap();
        assert_eq!(data[0], 0);
        assert_eq!(data[4 * (side - 1)], 255);
        assert!(square(&image, URect::new(1200, 0, 1300, 100)).is_none());
    }
}
