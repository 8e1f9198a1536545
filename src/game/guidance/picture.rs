//! How a place is marked in the endoscope's picture: by a ring and its name where it is in the picture, by an arrow at the rim where it
//! is beyond.

use std::f32::consts::{FRAC_PI_2, TAU};

use bevy::prelude::*;
use bevy_egui::egui::{self, Align2, Color32, Painter, Stroke};
use resecta_scenario::Unseen;

use super::super::{overlay::shadowed, palette};
use crate::view::shown_at;

/// How much of its colour the mark of a place keeps that tissue or murk is before.
const HIDDEN: f32 = 0.55;
/// Radius of a ring, points, and how far from its middle the name begins.
const RING: f32 = 9.0;
const NAME_BESIDE: f32 = 14.0;
/// Height of names, points.
const NAME: f32 = 14.0;
/// Where the head of an arrow to what is outside the picture is, and where its name ends, as shares of the radius; its length, points.
const ARROW_AT: f32 = 0.97;
const ARROW_NAME_AT: f32 = 0.76;
const ARROW: f32 = 26.0;

/// How wide a ring's line is, points: what it is about, and what is done of it.
const LINE: f32 = 1.5;
const DONE: f32 = 3.5;

/// A place that is to be marked.
pub struct Mark<'a> {
    /// World, mm.
    pub place: Vec3,
    /// What hides it.
    pub unseen: Option<Unseen>,
    pub name: &'a str,
    pub colour: Color32,
    /// What part of something is done that the loop does there, 0 to 1; none where it does nothing.
    pub done: Option<f32>,
}

/// The endoscope's picture as it lies in the window.
pub struct Picture<'a> {
    painter: &'a Painter,
    camera: &'a Camera,
    eye: &'a GlobalTransform,
    /// Middle and radius of the round field, points.
    pub centre: egui::Pos2,
    pub radius: f32,
    /// A logical pixel of the window, points.
    point: f32,
}

impl<'a> Picture<'a> {
    /// The picture of a camera; none where the window shows none.
    pub fn of(painter: &'a Painter, camera: &'a Camera, eye: &'a GlobalTransform, zoom: f32) -> Option<Self> {
        let area = camera.logical_viewport_rect()?;
        let centre = egui::pos2(area.center().x, area.center().y) / zoom;
        Some(Picture {
            painter,
            camera,
            eye,
            centre,
            radius: 0.5 * area.width().min(area.height()) / zoom,
            point: 1.0 / zoom,
        })
    }

    /// Marks a place, and names it: by a ring, fainter where something hides it, and closed where the loop is at work. Tells whether it
    /// lies in the picture; where not, it is not marked.
    pub fn mark(&self, mark: &Mark) -> bool {
        if mark.unseen == Some(Unseen::OutOfField) {
            return false;
        }
        let straight = self.camera.world_to_viewport(self.eye, mark.place).ok();
        let Some(at) = straight.and_then(|straight| shown_at(self.camera, straight)) else {
            return false;
        };
        let at = egui::pos2(at.x, at.y) * self.point;
        if at.distance(self.centre) > 0.96 * self.radius {
            return false;
        }
        let colour = mark
            .colour
            .gamma_multiply(if mark.unseen.is_some() { HIDDEN } else { 1.0 });
        let arc = |share: f32| {
            let angles = (0..=24).map(move |n| share * TAU * n as f32 / 24.0 - FRAC_PI_2);
            angles
                .map(|angle| at + RING * egui::Vec2::angled(angle))
                .collect::<Vec<_>>()
        };
        let line = Stroke::new(LINE, colour);
        match mark.done {
            None => {
                self.painter.add(egui::Shape::dashed_line(&arc(1.0), line, 3.0, 2.5));
            }
            Some(share) => {
                self.painter.add(egui::Shape::line(arc(1.0), line));
                let done = Stroke::new(DONE, colour);
                self.painter.add(egui::Shape::line(arc(share.clamp(0.0, 1.0)), done));
            }
        }
        let font = egui::FontId::proportional(NAME);
        let long = self.painter.layout_no_wrap(mark.name.to_owned(), font, colour).size().x;
        let (anchor, shift) = if is_named_left(at - self.centre, NAME_BESIDE + long, self.radius) {
            (Align2::RIGHT_CENTER, -NAME_BESIDE)
        } else {
            (Align2::LEFT_CENTER, NAME_BESIDE)
        };
        shadowed(
            self.painter,
            at + egui::vec2(shift, 0.0),
            anchor,
            mark.name,
            NAME,
            colour,
        );
        true
    }

    /// Points from the rim to a place out of the picture, by the way to it from the lens, mm (right, up and back), and names it.
    pub fn point_to(&self, from_lens: Vec3, name: &str, colour: Color32) {
        // Up in the picture is down in points.
        let way = egui::vec2(from_lens.x, -from_lens.y).normalized();
        if way == egui::Vec2::ZERO {
            return;
        }
        let name = match from_lens.z > 0.0 {
            true => format!("{name}, behind: draw back"),
            false => name.to_owned(),
        };
        let head = self.centre + ARROW_AT * self.radius * way;
        let foot = head - ARROW * way;
        let aside = 0.32 * ARROW * way.rot90();
        self.painter.add(egui::Shape::convex_polygon(
            vec![head, foot + aside, foot - aside],
            colour,
            Stroke::new(1.0, palette::GROUND.gamma_multiply(0.8)),
        ));
        let font = egui::FontId::proportional(NAME);
        let size = self.painter.layout_no_wrap(name.clone(), font, colour).size();
        // So far in that it stands on nothing that is named at the rim.
        let half = 0.5 * (way.x.abs() * size.x + way.y.abs() * size.y);
        let at = self.centre + (ARROW_NAME_AT * self.radius - half) * way;
        shadowed(self.painter, at, Align2::CENTER_CENTER, &name, NAME, colour);
    }
}

/// Whether what a place is called stands to its left: towards the rim, so that the middle stays free, but where it would run out of the
/// round field. The place is counted from the middle, `long` is how far the name reaches from it, points.
fn is_named_left(from_centre: egui::Vec2, long: f32, radius: f32) -> bool {
    let half_chord = (radius * radius - from_centre.y * from_centre.y).max(0.0).sqrt();
    let is_left = from_centre.x < 0.0;
    is_left == (from_centre.x.abs() + long <= half_chord)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_name_stands_towards_the_rim_unless_it_would_run_out_of_the_picture() {
        for (x, y, is_left) in [
            (-100.0, 0.0, true),
            (100.0, 0.0, false),
            // Near the rim, and low in the picture, where it is narrow.
            (-250.0, 0.0, false),
            (250.0, 0.0, true),
            (-100.0, 270.0, false),
            (100.0, -270.0, true),
        ] {
            assert_eq!(is_named_left(egui::vec2(x, y), 80.0, 300.0), is_left, "{x} {y}");
        }
    }
}
