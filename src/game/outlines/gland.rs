//! The gland within the outlines, in three dimensions, by egui's painter: made anew from the outlines in every frame.

use bevy::math::{DVec2, DVec3, Mat3, Vec3};
use bevy_egui::egui::{self, Color32, Rect, Shape, Stroke, Ui};
use resecta_annotate::{Outlines, Stack};

use crate::game::palette;

/// Degrees that it turns a point of the pointer's way.
const TURN_PER_POINT_DEG: f32 = 0.5;
/// Where the light comes from, in the picture: x to the right, y up, z towards whoever looks.
const LIGHT: Vec3 = Vec3::new(-0.4, 0.6, 0.7);
/// Diameter of the sphere about the gland, as a share of the picture: the gland itself never fills it.
const FILLED: f32 = 1.2;

/// From where the gland is looked at, degrees.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Turn {
    /// About its axis.
    pub about: f32,
    /// Over it.
    pub over: f32,
}

impl Default for Turn {
    /// From its left front, a little from above.
    fn default() -> Self {
        Self {
            about: 35.0,
            over: 20.0,
        }
    }
}

impl Turn {
    /// From millimetres of the case to the picture: x to the right, y up (towards the bladder), z towards whoever looks.
    fn matrix(self) -> Mat3 {
        // Looked at from the front, the patient's left is on the right.
        let from_front = Mat3::from_cols(Vec3::X, -Vec3::Z, Vec3::Y);
        let about = Mat3::from_rotation_y(-self.about.to_radians());
        Mat3::from_rotation_x(self.over.to_radians()) * about * from_front
    }
}

/// A triangle of the surface, in the picture.
struct Face {
    corners: [Vec3; 3],
    colour: Color32,
}

/// Draws the gland into a part of the screen, the outline of `image` in the game's colour, and turns it where it is dragged.
pub fn show(ui: &mut Ui, size: egui::Vec2, stack: &Stack, outlines: &Outlines, image: usize, turn: &mut Turn) {
    let (area, response) = ui.allocate_exact_size(size, egui::Sense::drag());
    let painter = ui.painter_at(area);
    painter.rect_filled(area, 8.0, palette::CARD);
    let by = response.drag_delta() * TURN_PER_POINT_DEG;
    turn.about = (turn.about + by.x) % 360.0;
    turn.over = (turn.over + by.y).clamp(-90.0, 90.0);
    let rings = rings(stack, outlines);
    let Some((middle, radius)) = bounds(&rings) else {
        return;
    };
    let scale = 0.5 * FILLED * area.height().min(area.width()) / radius;
    let matrix = turn.matrix();
    let to_picture = |place: DVec3| scale * (matrix * (place - middle).as_vec3());
    let on_screen = |place: Vec3| area.center() + egui::vec2(place.x, -place.y);

    let mut faces = faces(&rings, to_picture);
    // The nearest last.
    faces.sort_by(|one, other| depth(one).total_cmp(&depth(other)));
    let mut mesh = egui::Mesh::default();
    for face in &faces {
        let first = mesh.vertices.len() as u32;
        for corner in face.corners {
            mesh.colored_vertex(on_screen(corner), face.colour);
        }
        mesh.add_triangle(first, first + 1, first + 2);
    }
    painter.add(Shape::mesh(mesh));
    if let Some(ring) = rings.iter().find(|ring| ring.image == image) {
        let points = ring.places.iter().map(|place| on_screen(to_picture(*place)));
        painter.add(Shape::closed_line(points.collect(), Stroke::new(2.0, palette::ACCENT)));
    }
    name_sides(&painter, area, *turn);
}

/// An outline at its height.
struct Ring {
    image: usize,
    places: Vec<DVec3>,
    is_flagged: bool,
}

fn rings(stack: &Stack, outlines: &Outlines) -> Vec<Ring> {
    let ring = |(image, outline): (usize, &resecta_annotate::Outline)| {
        let z = stack.slices().get(image)?.z_mm;
        Some(Ring {
            image,
            places: outline.capsule.iter().map(|place: &DVec2| place.extend(z)).collect(),
            is_flagged: !outline.flags.is_empty(),
        })
    };
    outlines.outlined().filter_map(ring).collect()
}

/// Middle and radius of all rings, mm; none where they have no extent.
fn bounds(rings: &[Ring]) -> Option<(DVec3, f32)> {
    let all = || rings.iter().flat_map(|ring| &ring.places);
    let low = all().copied().reduce(DVec3::min)?;
    let high = all().copied().reduce(DVec3::max)?;
    let radius = 0.5 * (high - low).length() as f32;
    (radius > 0.0).then_some((0.5 * (low + high), radius))
}

fn depth(face: &Face) -> f32 {
    face.corners.iter().map(|corner| corner.z).sum()
}

/// The surface from ring to ring, closed at both ends.
fn faces(rings: &[Ring], to_picture: impl Fn(DVec3) -> Vec3) -> Vec<Face> {
    let mut faces = Vec::new();
    let mut add = |corners: [DVec3; 3], is_flagged: bool| {
        let corners = corners.map(&to_picture);
        let normal = (corners[1] - corners[0])
            .cross(corners[2] - corners[0])
            .normalize_or_zero();
        // Nobody sees the inside.
        if normal.z <= 0.0 {
            return;
        }
        let light = 0.35 + 0.65 * normal.dot(LIGHT.normalize()).max(0.0);
        let ground = if is_flagged { palette::CAREFUL } else { palette::ADENOMA };
        faces.push(Face {
            corners,
            colour: shaded(ground, light),
        });
    };
    for pair in rings.windows(2) {
        let count = pair[0].places.len().min(pair[1].places.len());
        let is_flagged = pair[0].is_flagged && pair[1].is_flagged;
        for index in 0..count {
            let next = (index + 1) % count;
            let [low, high] = [&pair[0].places, &pair[1].places];
            add([low[index], low[next], high[next]], is_flagged);
            add([low[index], high[next], high[index]], is_flagged);
        }
    }
    for (ring, is_top) in [(rings.first(), false), (rings.last(), true)] {
        let Some(ring) = ring else { continue };
        let middle = ring.places.iter().sum::<DVec3>() / ring.places.len() as f64;
        for index in 0..ring.places.len() {
            let next = (index + 1) % ring.places.len();
            let (a, b) = (ring.places[index], ring.places[next]);
            add(if is_top { [middle, a, b] } else { [middle, b, a] }, ring.is_flagged);
        }
    }
    faces
}

fn shaded(colour: Color32, light: f32) -> Color32 {
    let [red, green, blue] = [colour.r(), colour.g(), colour.b()].map(|value| (f32::from(value) * light) as u8);
    Color32::from_rgb(red, green, blue)
}

/// Which way is which, at the edges of the picture.
fn name_sides(painter: &egui::Painter, area: Rect, turn: Turn) {
    let small = egui::FontId::proportional(12.5);
    let write = |place, anchor, words: &str| {
        painter.text(place, anchor, words, small.clone(), palette::WEAK);
    };
    let inner = area.shrink(8.0);
    write(inner.center_top(), egui::Align2::CENTER_TOP, "bladder");
    write(inner.center_bottom(), egui::Align2::CENTER_BOTTOM, "apex");
    let right = turn.matrix().transpose() * Vec3::X;
    let name = match right.abs() {
        side if side.x >= side.y && right.x > 0.0 => "left",
        side if side.x >= side.y => "right",
        _ if right.y > 0.0 => "back",
        _ => "front",
    };
    write(inner.right_center(), egui::Align2::RIGHT_CENTER, name);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn from_the_front_the_patients_left_is_on_the_right_and_the_bladder_above() {
        let matrix = Turn { about: 0.0, over: 0.0 }.matrix();
        assert!((matrix.determinant() - 1.0).abs() < 1e-6, "a turn mirrors nothing");
        let (left, posterior, bladder) = (matrix * Vec3::X, matrix * Vec3::Y, matrix * Vec3::Z);
        assert!(left.x > 0.99 && posterior.z < -0.99 && bladder.y > 0.99, "{matrix}");
    }

    #[test]
    fn a_closed_surface_shows_about_half_of_its_faces() {
        let ring = |image: usize| Ring {
            image,
            places: (0..32)
                .map(|corner| {
                    let angle = std::f64::consts::TAU * f64::from(corner) / 32.0;
                    (10.0 * DVec2::from_angle(angle)).extend(5.0 * image as f64)
                })
                .collect(),
            is_flagged: false,
        };
        let rings: Vec<Ring> = (0..4).map(ring).collect();
        let all = 2 * 32 * 3 + 2 * 32;
        let matrix = Turn::default().matrix();
        let seen = faces(&rings, |place| matrix * place.as_vec3()).len();
        assert!((all / 3..2 * all / 3).contains(&seen), "{seen} of {all}");
    }
}
