//! The transverse slice at the loop, with the instrument in it, and the row of slices along the gland, the present one lit.
//!
//! Sections are pictures, made anew where the tissue or the loop's height changed, one every [`REFRESH_S`]: the slice at the loop
//! every second time, between them one of the row in turn. Contours and the instrument are drawn over them in every frame.

use std::f32::consts::TAU;

use bevy::prelude::*;
use bevy_egui::{
    EguiContexts,
    egui::{self, Align2, Color32, Painter, Rect, Shape, Stroke, StrokeKind, TextureHandle, TextureOptions, vec2},
};
use resecta_anatomy::Zone;
use resecta_instrument::{InstrumentState, Resectoscope};
use resecta_scenario::{ActiveExercise, CutMap, LoopClearance};
use resecta_tissue::Tissue;

use super::{
    super::{overlay::shadowed, palette},
    Held, Shown, contours,
    distances::Danger,
    ground,
    places::Places,
    section::{self, Frame},
};

/// Time between two pictures, s.
const REFRESH_S: f32 = 0.1;
/// Slices in the row.
const ROW: usize = 8;
/// Sides of the pictures, pixels.
const LARGE: usize = 320;
/// As above.
const SMALL: usize = 88;
/// Change of height that asks for a new picture, mm.
const MOVED_MM: f32 = 0.1;

pub fn plugin(app: &mut App) {
    app.init_resource::<Slices>();
}

/// The pictures and what is drawn over them.
#[derive(Resource, Default)]
pub struct Slices {
    /// The gland that they are of.
    gland: Option<Entity>,
    frame: Option<Frame>,
    /// At the loop.
    current: Slice,
    /// Along the gland, from the apex up.
    row: Vec<Slice>,
    /// Time until the next picture, s.
    still_s: f32,
    /// The next: where it is even the slice at the loop, else that of the row with half the number.
    turn: usize,
    /// For which removed volume the shares hold, mm³.
    shares_of_mm3: Option<f64>,
}

/// One slice.
#[derive(Default)]
struct Slice {
    height_mm: f32,
    picture: Option<TextureHandle>,
    /// What the picture was made of.
    state: Option<State>,
    capsule: Vec<Vec2>,
    transition_zone: Vec<Vec2>,
    /// Share of its adenoma that is gone; none without adenoma.
    removed: Option<f64>,
}

/// Versions of the motion and of a fine surface, living pentahedra.
type State = (u64, Option<u64>, usize);

fn state_of(tissue: &Tissue) -> State {
    let solver = tissue.solver();
    let surface = tissue.field().map(|field| field.surface().version());
    (solver.motion_version(), surface, solver.living_pentahedra())
}

impl Slice {
    fn at(active: &ActiveExercise, height_mm: f32) -> Self {
        let mut slice = Self::default();
        slice.move_to(active, height_mm);
        slice
    }

    fn move_to(&mut self, active: &ActiveExercise, height_mm: f32) {
        let contour = |of: fn(&resecta_anatomy::Slice) -> Option<&[bevy::math::DVec2]>| {
            contours::at_height(&active.case, f64::from(height_mm), of)
        };
        self.height_mm = height_mm;
        self.capsule = contour(|slice| Some(&slice.capsule));
        self.transition_zone = contour(|slice| slice.transition_zone.as_deref());
        self.state = None;
    }

    /// Makes the picture anew where the tissue has changed.
    fn draw(&mut self, context: &egui::Context, active: &ActiveExercise, tissue: &Tissue, frame: Frame, side: usize) {
        let state = state_of(tissue);
        if self.state == Some(state) {
            return;
        }
        self.state = Some(state);
        let image = section::draw(tissue, active.dyed(), self.height_mm, frame, side);
        match &mut self.picture {
            Some(picture) => picture.set(image, TextureOptions::LINEAR),
            None => self.picture = Some(context.load_texture("slice", image, TextureOptions::LINEAR)),
        }
    }
}

/// Heights of the row's slices: the middles of equal parts of the gland, mm.
fn heights((low, high): (f64, f64)) -> [f64; ROW] {
    std::array::from_fn(|n| low + (high - low) * (n as f64 + 0.5) / ROW as f64)
}

/// Which slice of the row a height is nearest to; none outside of the gland.
fn row_of((low, high): (f64, f64), z_mm: f64) -> Option<usize> {
    let part = (z_mm - low) / (high - low) * ROW as f64;
    (0.0..ROW as f64).contains(&part).then_some(part as usize)
}

/// Makes pictures while they are shown.
pub fn refresh(
    mut contexts: EguiContexts,
    shown: Res<Shown>,
    active: Option<Res<ActiveExercise>>,
    instruments: Query<(&InstrumentState, &Resectoscope)>,
    tissues: Query<&Tissue>,
    time: Res<Time<Real>>,
    mut slices: ResMut<Slices>,
) -> Result {
    let Some(active) = active.filter(|_| shown.parts.slice > 0.0) else {
        return Ok(());
    };
    let (Ok((state, scope)), Ok(tissue)) = (instruments.get(active.instrument), tissues.get(active.tissue)) else {
        return Ok(());
    };
    let Some(span) = active.walls.heights_mm() else {
        return Ok(());
    };
    if slices.gland != Some(active.tissue) {
        let (middle, half_mm) = contours::frame(&active.case);
        *slices = Slices {
            gland: Some(active.tissue),
            frame: Some(Frame { middle, half_mm }),
            row: heights(span).map(|height| Slice::at(&active, height as f32)).into(),
            ..default()
        };
    }
    slices.still_s -= time.delta_secs();
    let Some(frame) = slices.frame.filter(|_| slices.still_s <= 0.0) else {
        return Ok(());
    };
    slices.still_s = REFRESH_S;
    let context = contexts.ctx_mut()?;
    let height = Held { state, scope }.height_mm();
    let Slices {
        current,
        row,
        turn,
        shares_of_mm3,
        ..
    } = &mut *slices;
    if turn.is_multiple_of(2) {
        if (current.height_mm - height).abs() > MOVED_MM || current.capsule.is_empty() {
            current.move_to(&active, height);
        }
        current.draw(context, &active, tissue, frame, LARGE);
    }
    // Until all were drawn once, all of the row: the first moment of a run stands still anyway.
    let is_new = row.iter().any(|slice| slice.picture.is_none());
    for (n, slice) in row.iter_mut().enumerate() {
        if is_new || *turn == 2 * n + 1 {
            slice.draw(context, &active, tissue, frame, SMALL);
        }
    }
    *turn = (*turn + 1) % (2 * ROW);
    let removed = tissue.solver().removed_volume_mm3();
    // Once a round, and only where something is gone.
    if *turn == 0 && *shares_of_mm3 != Some(removed) || shares_of_mm3.is_none() {
        *shares_of_mm3 = Some(removed);
        // A little more than a part: rounding must not add a row.
        let row_mm = (span.1 - span.0) / ROW as f64 * (1.0 + 1e-9);
        let map = CutMap::of_exercise(&active, tissue.solver(), row_mm, 1);
        for (n, slice) in row.iter_mut().enumerate() {
            slice.removed = map.cell(n, 0).and_then(|cell| {
                let sum = |by_zone: [f64; Zone::COUNT]| {
                    let adenoma = Zone::ALL.into_iter().filter(|zone| zone.is_adenoma());
                    adenoma.map(|zone| by_zone[zone.index()]).sum::<f64>()
                };
                let whole = sum(cell.whole_by_zone_mm3);
                (whole > 0.0).then(|| sum(cell.removed_by_zone_mm3) / whole)
            });
        }
    }
    Ok(())
}

/// Places of the plane's points in an area of the window.
#[derive(Clone, Copy)]
struct Sheet {
    area: Rect,
    frame: Frame,
}

impl Sheet {
    fn scale(&self) -> f32 {
        self.area.width() / (2.0 * self.frame.half_mm)
    }

    fn at(&self, point: Vec2) -> egui::Pos2 {
        let from_middle = (point - self.frame.middle) * self.scale();
        self.area.center() + vec2(from_middle.x, from_middle.y)
    }

    /// Picture and contours of a slice.
    fn show(&self, painter: &Painter, slice: &Slice, opacity: f32) {
        if let Some(picture) = &slice.picture {
            let all = Rect::from_min_max(egui::pos2(0.0, 0.0), egui::pos2(1.0, 1.0));
            painter.image(picture.id(), self.area, all, Color32::WHITE.gamma_multiply(opacity));
        }
        let width = (self.area.width() / 110.0).clamp(0.8, 2.0);
        for (contour, colour) in [
            (&slice.transition_zone, palette::FOCUS),
            (&slice.capsule, palette::TEXT),
        ] {
            let points = contour.iter().map(|&point| self.at(point)).collect();
            let stroke = Stroke::new(width, colour.gamma_multiply(opacity));
            painter.add(Shape::closed_line(points, stroke));
        }
    }
}

/// Draws slice and row.
pub fn show(
    painter: &Painter,
    places: &Places,
    slices: &Slices,
    active: &ActiveExercise,
    held: &Held,
    clearance: &LoopClearance,
    opacity: f32,
) {
    let Some(frame) = slices.frame else { return };
    ground(painter, places.slice, opacity);
    let side = places.slice.width();
    let area = Rect::from_min_size(places.slice.left_top(), vec2(side, side)).shrink(10.0 * places.scale);
    let sheet = Sheet { area, frame };
    sheet.show(painter, &slices.current, opacity);
    clock(painter, area, places.scale, opacity);
    instrument(painter, &sheet, held, clearance, opacity);
    let words = places.slice.center_bottom() - vec2(0.0, 4.0);
    let text = above_verumontanum(active, held.height_mm());
    let colour = palette::TEXT.gamma_multiply(opacity);
    shadowed(
        painter,
        words,
        Align2::CENTER_BOTTOM,
        &text,
        12.0 * places.scale,
        colour,
    );
    row(painter, places, slices, active, held.height_mm(), frame, opacity);
}

/// Where the slice lies, in words.
fn above_verumontanum(active: &ActiveExercise, z_mm: f32) -> String {
    let marks = &active.case.landmarks;
    match (marks.verumontanum, marks.bladder_neck) {
        (Some(verumontanum), _) => {
            let above = z_mm - verumontanum.z as f32;
            let side = if above < 0.0 { "below" } else { "above" };
            format!("{:.0} mm {side} verumontanum", above.abs())
        }
        (None, Some(neck)) => format!("{:.0} mm below the neck", neck.z as f32 - z_mm),
        (None, None) => format!("height {z_mm:.0} mm"),
    }
}

/// Hour marks round the slice: 12 o'clock up.
fn clock(painter: &Painter, area: Rect, scale: f32, opacity: f32) {
    let (centre, radius) = (area.center(), 0.5 * area.width());
    let weak = palette::WEAK.gamma_multiply(opacity);
    for hour in 1..=12 {
        let turn = egui::Vec2::angled(TAU * (hour as f32 / 12.0 - 0.25));
        if hour % 3 == 0 {
            let place = centre + (radius + 1.0) * turn;
            let text = palette::TEXT.gamma_multiply(opacity);
            shadowed(
                painter,
                place,
                Align2::CENTER_CENTER,
                &hour.to_string(),
                12.0 * scale,
                text,
            );
        } else {
            let ends = [centre + (radius - 3.0) * turn, centre + (radius + 3.0) * turn];
            painter.line_segment(ends, Stroke::new(1.2, weak));
        }
    }
}

/// Sheath and loop in the slice, and the way from the loop to the capsule.
fn instrument(painter: &Painter, sheet: &Sheet, held: &Held, clearance: &LoopClearance, opacity: f32) {
    let painter = &painter.with_clip_rect(sheet.area.expand(8.0).intersect(painter.clip_rect()));
    let pose = held.scope.sheath_pose(held.state);
    let tip = Vec3::from(pose.translation);
    let outwards = pose.rotation * Vec3::Z;
    // The sheath crosses the slice where the loop is drawn in; else its tip is shown from before.
    let along = (held.height_mm() - tip.z) / outwards.z;
    let crosses = along.is_finite() && along >= -0.5;
    let middle = if crosses { tip + along * outwards } else { tip };
    let radius = 0.5 * held.scope.geometry.sheath_diameter_mm * sheet.scale();
    let at = sheet.at(middle.truncate());
    let weak = palette::WEAK.gamma_multiply(opacity);
    if crosses {
        painter.circle_filled(at, radius, weak.gamma_multiply(0.35));
    }
    painter.circle_stroke(at, radius, Stroke::new(1.2, weak));
    let wire = held.wire();
    if let (Some(nearest), Some(distance)) = (clearance.nearest, clearance.capsule_mm) {
        let near = |a: &&Vec3, b: &&Vec3| a.distance_squared(nearest).total_cmp(&b.distance_squared(nearest));
        if let Some(from) = wire.iter().min_by(near) {
            let ends = [sheet.at(from.truncate()), sheet.at(nearest.truncate())];
            let colour = Danger::of_capsule(distance).colour().gamma_multiply(opacity);
            painter.extend(Shape::dashed_line(&ends, Stroke::new(1.5, colour), 4.0, 3.0));
        }
    }
    let wire: Vec<_> = wire.into_iter().map(|point| sheet.at(point.truncate())).collect();
    for (width, colour) in [(4.5, palette::GROUND), (2.2, held.colour())] {
        let stroke = Stroke::new(width, colour.gamma_multiply(opacity));
        painter.add(Shape::line(wire.clone(), stroke));
    }
}

/// The slices along the gland, bladder at the top, with the share of the adenoma that is gone from each.
fn row(
    painter: &Painter,
    places: &Places,
    slices: &Slices,
    active: &ActiveExercise,
    z_mm: f32,
    frame: Frame,
    opacity: f32,
) {
    let area = places.row;
    ground(painter, area, opacity);
    let words = 15.0 * places.scale;
    let step = (area.height() - 2.0 * words) / ROW as f32;
    let lit = (active.walls.heights_mm()).and_then(|span| row_of(span, f64::from(z_mm)));
    let fade = |colour: Color32| colour.gamma_multiply(opacity);
    let small = 11.0 * places.scale;
    let top = area.center_top() + vec2(0.0, 2.0);
    shadowed(painter, top, Align2::CENTER_TOP, "bladder", small, fade(palette::WEAK));
    let bottom = area.center_bottom() - vec2(0.0, 2.0);
    // A landmark of the outside view may lie behind it.
    let behind = Rect::from_min_max(area.left_bottom() - vec2(0.0, words), area.right_bottom());
    painter.rect_filled(behind, 6.0, fade(palette::GROUND));
    shadowed(
        painter,
        bottom,
        Align2::CENTER_BOTTOM,
        "apex",
        small,
        fade(palette::WEAK),
    );
    for (n, slice) in slices.row.iter().enumerate() {
        let corner = area.left_top() + vec2(0.0, words + (ROW - 1 - n) as f32 * step);
        let cell = Rect::from_min_size(corner, vec2(area.width(), step));
        let side = step.min(area.width()) - 4.0;
        let sheet = Sheet {
            area: Rect::from_center_size(cell.center(), vec2(side, side)),
            frame,
        };
        sheet.show(painter, slice, opacity);
        if lit == Some(n) {
            let stroke = Stroke::new(2.5, fade(palette::FOCUS));
            painter.rect_stroke(cell.shrink(1.5), 4.0, stroke, StrokeKind::Inside);
        }
        // What was gone before the run began is no cut.
        if let Some(removed) = slice.removed.filter(|removed| *removed >= 0.005) {
            let text = format!("{:.0} % cut", 100.0 * removed);
            let at = cell.right_bottom() - vec2(4.0, 2.0);
            shadowed(painter, at, Align2::RIGHT_BOTTOM, &text, small, fade(palette::TEXT));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_height_of_the_gland_is_in_the_part_whose_middle_is_nearest() {
        let span = (-4.0, 36.0);
        let middles = heights(span);
        for step in 0..400 {
            let z = -4.0 + 0.1 * f64::from(step);
            let far = |n: &usize| (middles[*n] - z).abs();
            let nearest = (0..ROW).min_by(|a, b| far(a).total_cmp(&far(b))).unwrap();
            let found = row_of(span, z).unwrap();
            assert!((far(&found) - far(&nearest)).abs() < 1e-9, "{z}: {found} {nearest}");
        }
        for outside in [-4.1, 36.0, f64::NAN] {
            assert_eq!(row_of(span, outside), None);
        }
    }
}
