//! The small map: the gland's outline from the side and from the front, with sheath, tip and landmarks.

use bevy::math::Vec3;
use bevy_egui::egui::{Align2, Painter, Pos2, Rect, Shape, Stroke, pos2, vec2};
use resecta_anatomy::Slice;
use resecta_scenario::ActiveExercise;

use super::{super::overlay::shadowed, super::palette, Held, ground};

/// Room above and below the gland, mm: bladder neck and sphincter are in it.
const AROUND_MM: f32 = 9.0;

/// A direction to look in.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Look {
    /// From the patient's left: anterior at the left of the picture.
    Side,
    /// From the front: the patient's left at the right of the picture.
    Front,
}

impl Look {
    /// The horizontal coordinate of a point, mm.
    fn across(self, point: Vec3) -> f32 {
        match self {
            Look::Side => point.y,
            Look::Front => point.x,
        }
    }

    /// The gland's outline, mm: up one edge and down the other.
    fn outline(self, slices: &[Slice]) -> Vec<[f32; 2]> {
        let edge = |slice: &Slice, pick: fn(f32, f32) -> f32, none: f32| {
            let corners = slice
                .capsule
                .iter()
                .map(|corner| self.across(corner.extend(slice.z).as_vec3()));
            [corners.fold(none, pick), slice.z as f32]
        };
        let up = slices.iter().map(|slice| edge(slice, f32::min, f32::INFINITY));
        let down = slices
            .iter()
            .rev()
            .map(|slice| edge(slice, f32::max, f32::NEG_INFINITY));
        up.chain(down).filter(|point| point[0].is_finite()).collect()
    }
}

/// Draws both.
pub fn show(painter: &Painter, area: Rect, active: &ActiveExercise, held: &Held, opacity: f32) {
    ground(painter, area, opacity);
    let half = vec2(0.5 * area.width(), area.height());
    for (look, words, corner) in [
        (Look::Side, "side", area.left_top()),
        (Look::Front, "front", area.left_top() + vec2(half.x, 0.0)),
    ] {
        one(
            painter,
            Rect::from_min_size(corner, half),
            look,
            words,
            active,
            held,
            opacity,
        );
    }
}

fn one(painter: &Painter, area: Rect, look: Look, words: &str, active: &ActiveExercise, held: &Held, opacity: f32) {
    let outline = look.outline(&active.case.slices);
    let (Some(first), Some(last)) = (active.case.slices.first(), active.case.slices.last()) else {
        return;
    };
    let (low, high) = (first.z as f32 - AROUND_MM, last.z as f32 + AROUND_MM);
    let sides = outline.iter().map(|point| point[0]);
    let (left, right) = sides.fold((f32::INFINITY, f32::NEG_INFINITY), |(left, right), x| {
        (left.min(x), right.max(x))
    });
    let room = area.shrink2(vec2(6.0, 12.0));
    let scale = (room.width() / (right - left).max(1.0)).min(room.height() / (high - low).max(1.0));
    let at = |point: [f32; 2]| -> Pos2 {
        pos2(
            room.center().x + (point[0] - 0.5 * (left + right)) * scale,
            room.center().y - (point[1] - 0.5 * (low + high)) * scale,
        )
    };
    let place = |point: Vec3| at([look.across(point), point.z]);
    let painter = painter.with_clip_rect(area.intersect(painter.clip_rect()));
    let fade = |colour: bevy_egui::egui::Color32| colour.gamma_multiply(opacity);
    let line: Vec<Pos2> = outline.into_iter().map(at).collect();
    painter.add(Shape::closed_line(line, Stroke::new(1.5, fade(palette::ADENOMA))));
    let marks = &active.case.landmarks;
    let marks = [marks.bladder_neck, marks.verumontanum, marks.external_sphincter];
    for mark in marks.into_iter().flatten() {
        painter.circle_filled(place(mark.as_vec3()), 2.5, fade(palette::FOCUS));
    }
    let sheath = held.scope.sheath_pose(held.state);
    let tip = Vec3::from(sheath.translation);
    let outer = sheath * (Vec3::Z * held.scope.geometry.sheath_length_mm);
    let width = (held.scope.geometry.sheath_diameter_mm * scale).max(2.0);
    painter.line_segment([place(outer), place(tip)], Stroke::new(width, fade(palette::WEAK)));
    let the_loop = held.scope.loop_pose(held.state).centre;
    painter.line_segment([place(tip), place(the_loop)], Stroke::new(1.5, fade(held.colour())));
    let wire: Vec<Pos2> = held.wire().into_iter().map(place).collect();
    painter.add(Shape::line(wire, Stroke::new(2.0, fade(held.colour()))));
    painter.circle_filled(place(tip), 3.0, fade(palette::ACCENT));
    shadowed(
        &painter,
        area.center_top() + vec2(0.0, 2.0),
        Align2::CENTER_TOP,
        words,
        11.0,
        fade(palette::WEAK),
    );
}

#[cfg(test)]
mod tests {
    use bevy::math::DVec2;

    use super::*;

    #[test]
    fn the_outline_goes_up_one_edge_and_down_the_other() {
        let slice = |z: f64, half: f64| Slice {
            z,
            capsule: [(-half, -1.0), (half, -1.0), (half, 3.0), (-half, 3.0)]
                .map(|(x, y)| DVec2::new(x, y))
                .to_vec(),
            urethra: None,
            transition_zone: None,
        };
        let slices = [slice(0.0, 5.0), slice(10.0, 8.0)];
        let front = [[-5.0, 0.0], [-8.0, 10.0], [8.0, 10.0], [5.0, 0.0]];
        assert_eq!(Look::Front.outline(&slices), front);
        let side = [[-1.0, 0.0], [-1.0, 10.0], [3.0, 10.0], [3.0, 0.0]];
        assert_eq!(Look::Side.outline(&slices), side);
        assert!(Look::Side.outline(&[]).is_empty());
    }
}
