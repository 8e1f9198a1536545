//! One image with its outline, whose landmarks are dragged.

use bevy::math::DVec2;
use bevy_egui::egui::{self, Color32, Pos2, Rect, Shape, Stroke, TextureHandle, Ui};
use resecta_annotate::{Image, Outlines};

use crate::game::palette;

/// How near to a landmark the pointer takes hold of it, points.
const REACH: f32 = 14.0;
/// Radius of a landmark's dot, points.
const DOT: f32 = 3.5;
/// What an image hardly shows.
const HIDDEN: Color32 = Color32::from_rgb(44, 40, 60);
/// Points of the wheel to an image.
const WHEEL: f32 = 30.0;

/// What the pointer holds.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Held {
    /// A landmark of the outline.
    Landmark(usize),
    /// All of it.
    Whole,
}

/// The picture of the image that was shown last.
#[derive(Default)]
pub struct Shown {
    texture: Option<(usize, TextureHandle)>,
    held: Option<Held>,
    /// The wheel's way since the last image, points.
    wheel: f32,
}

impl Shown {
    /// Shows an image and its outline within `size`, and changes the outline as it is dragged. How many images the wheel went on.
    pub fn show(
        &mut self,
        ui: &mut Ui,
        size: egui::Vec2,
        index: usize,
        image: &Image,
        outlines: &mut Outlines,
        is_open: bool,
    ) -> isize {
        let (area, response) = ui.allocate_exact_size(size, egui::Sense::click_and_drag());
        let painter = ui.painter_at(area);
        painter.rect_filled(area, 0.0, palette::CARD);
        let frame = Frame::of(image, area);
        let texture = self.texture(ui, index, image);
        let whole = Rect::from_min_max(Pos2::ZERO, egui::pos2(1.0, 1.0));
        painter.image(texture, frame.area, whole, Color32::WHITE);

        let pointer = response.hover_pos().or(response.interact_pointer_pos());
        if is_open {
            self.drag(&response, &frame, index, outlines);
        }
        let line = |capsule: &[DVec2], stroke: Stroke| {
            let points = capsule.iter().map(|place| frame.to_screen(*place)).collect();
            Shape::closed_line(points, stroke)
        };
        for neighbour in [index.checked_sub(1), Some(index + 1)].into_iter().flatten() {
            if let Some(outline) = outlines.of(neighbour) {
                let faint = palette::WEAK.gamma_multiply(0.45);
                painter.add(line(&outline.capsule, Stroke::new(1.0, faint)));
            }
        }
        if let Some(outline) = outlines.of(index) {
            let colour = match outline.flags.is_empty() {
                true => palette::GOOD,
                false => palette::CAREFUL,
            };
            painter.add(line(&outline.capsule, Stroke::new(2.0, colour)));
            let near = match self.held {
                Some(Held::Landmark(landmark)) => Some(landmark),
                Some(Held::Whole) => None,
                None => pointer.and_then(|pointer| nearest(&frame, &outline.capsule, pointer)),
            };
            for (landmark, place) in outline.capsule.iter().enumerate() {
                let is_near = near == Some(landmark);
                let radius = if is_near { 2.0 * DOT } else { DOT };
                let fill = if is_near { palette::FOCUS } else { colour };
                painter.circle(frame.to_screen(*place), radius, fill, Stroke::new(1.0, palette::GROUND));
            }
        }
        if is_open && response.secondary_clicked() {
            let clicked = response.interact_pointer_pos().map(|pointer| frame.to_image(pointer));
            let is_there = outlines
                .urethra(index)
                .zip(clicked)
                .is_some_and(|(mark, clicked)| frame.to_screen(mark).distance(frame.to_screen(clicked)) <= REACH);
            outlines.mark_urethra(index, clicked.filter(|_| !is_there));
        }
        if let Some(mark) = outlines.urethra(index) {
            let centre = frame.to_screen(mark);
            painter.circle_stroke(centre, 2.0 * DOT, Stroke::new(2.0, palette::ACCENT));
            painter.circle_filled(centre, 0.5 * DOT, palette::ACCENT);
        }
        if response.hovered() {
            self.wheel += ui.input(|input| input.smooth_scroll_delta.y);
        }
        let images = (self.wheel / WHEEL).trunc();
        self.wheel -= images * WHEEL;
        images as isize
    }

    fn drag(&mut self, response: &egui::Response, frame: &Frame, index: usize, outlines: &mut Outlines) {
        let began = response.drag_started();
        if began {
            // Where it was pressed, not where it was first seen to move.
            let pressed = response.ctx.input(|input| input.pointer.press_origin());
            self.held = pressed.zip(outlines.of(index)).and_then(|(pressed, outline)| {
                let inside = resecta_anatomy::contour::contains(&outline.capsule, frame.to_image(pressed));
                nearest(frame, &outline.capsule, pressed)
                    .map(Held::Landmark)
                    .or(inside.then_some(Held::Whole))
            });
        }
        if !response.dragged() {
            self.held = None;
            return;
        }
        let Some(pointer) = response.interact_pointer_pos() else {
            return;
        };
        match self.held {
            Some(Held::Landmark(landmark)) => outlines.drag(index, landmark, frame.to_image(pointer), !began),
            Some(Held::Whole) => {
                let by = frame.to_image(pointer) - frame.to_image(pointer - response.drag_delta());
                outlines.shift(index, by, !began);
            }
            None => {}
        }
    }

    fn texture(&mut self, ui: &Ui, index: usize, image: &Image) -> egui::TextureId {
        match &self.texture {
            Some((shown, texture)) if *shown == index => texture.id(),
            _ => {
                let pixels = (0..image.width() * image.height()).map(|pixel| {
                    let (x, y) = (pixel % image.width(), pixel / image.width());
                    match image.is_shown(x, y) {
                        true => Color32::from_gray((255.0 * image.grey()[pixel]).round() as u8),
                        false => HIDDEN,
                    }
                });
                let picture = egui::ColorImage::new([image.width(), image.height()], pixels.collect());
                let texture = ui
                    .ctx()
                    .load_texture("ultrasound", picture, egui::TextureOptions::LINEAR);
                let id = texture.id();
                self.texture = Some((index, texture));
                id
            }
        }
    }
}

/// The landmark within reach of the pointer.
fn nearest(frame: &Frame, capsule: &[DVec2], pointer: Pos2) -> Option<usize> {
    let away = |landmark: &usize| frame.to_screen(capsule[*landmark]).distance(pointer);
    (0..capsule.len())
        .filter(|landmark| away(landmark) <= REACH)
        .min_by(|one, other| away(one).total_cmp(&away(other)))
}

/// Where an image lies on the screen: as large as fits, in its true proportions.
struct Frame {
    area: Rect,
    /// Outer edge of the first pixel, mm.
    low: DVec2,
    /// Points a millimetre.
    scale: f64,
}

impl Frame {
    fn of(image: &Image, area: Rect) -> Self {
        let spacing = DVec2::from_array(image.spacing_mm());
        let extent = spacing * DVec2::new(image.width() as f64, image.height() as f64);
        let scale = (f64::from(area.width()) / extent.x).min(f64::from(area.height()) / extent.y);
        let size = scale * extent;
        Self {
            area: Rect::from_center_size(area.center(), egui::vec2(size.x as f32, size.y as f32)),
            low: DVec2::from_array(image.origin_mm()) - 0.5 * spacing,
            scale,
        }
    }

    fn to_screen(&self, place: DVec2) -> Pos2 {
        let by = self.scale * (place - self.low);
        self.area.min + egui::vec2(by.x as f32, by.y as f32)
    }

    fn to_image(&self, place: Pos2) -> DVec2 {
        let by = place - self.area.min;
        self.low + DVec2::new(f64::from(by.x), f64::from(by.y)) / self.scale
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn places_go_to_the_screen_and_back_and_pixels_keep_their_proportions() {
        let grey = (0..40 * 20).map(|pixel| (pixel % 5) as f32 / 5.0).collect();
        let image = Image::new([40, 20], [0.5, 1.0], [-10.0, 3.0], grey).unwrap();
        let frame = Frame::of(
            &image,
            Rect::from_min_size(egui::pos2(100.0, 50.0), egui::vec2(600.0, 300.0)),
        );
        // 20 x 20 mm: the height decides.
        assert_eq!(frame.area.size(), egui::vec2(300.0, 300.0));
        assert_eq!(frame.area.center(), egui::pos2(400.0, 200.0));
        let place = DVec2::new(-3.0, 7.25);
        assert!((frame.to_image(frame.to_screen(place)) - place).length() < 1e-4);
        // The middle of the first pixel lies half a pixel inside.
        let first = frame.to_screen(DVec2::new(-10.0, 3.0)) - frame.area.min;
        assert!((first - egui::vec2(0.25 * 15.0, 0.5 * 15.0)).length() < 1e-3);
    }
}
