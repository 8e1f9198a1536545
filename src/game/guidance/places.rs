//! Where each part is: at the edges of the views, off the middle of the round field.

use bevy_egui::egui::{Pos2, Rect, pos2, vec2};

/// Space to the edges of a view and between parts, points.
const GAP: f32 = 8.0;
/// Side of the slice, points.
const SLICE: f32 = 196.0;
/// Size of the distances, points.
const DISTANCES: [f32; 2] = [150.0, 92.0];
/// Width of the row of slices, points.
const ROW: f32 = 62.0;
/// Height of the row with its words, points.
const ROW_HEIGHT: f32 = 500.0;
/// Size of the map, points.
const MAP: [f32; 2] = [178.0, 150.0];
/// A view of at least this size shows all as large as that, points.
const ROOM: [f32; 2] = [366.0, 640.0];

/// Where each part is, points.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Places {
    /// The slice at the loop.
    pub slice: Rect,
    /// The distances.
    pub distances: Rect,
    /// The row of slices, bladder at the top.
    pub row: Rect,
    /// The map; none where the outside view shows the same.
    pub map: Option<Rect>,
    /// Size of letters against the usual one.
    pub scale: f32,
}

impl Places {
    /// Over these views, points: over the outside view where there is one, so that the endoscope's stays free. None without
    /// views.
    pub fn of(endoscope: Option<Rect>, outside: Option<Rect>) -> Option<Self> {
        let area = outside.or(endoscope)?.shrink(GAP);
        let scale = (area.width() / ROOM[0]).min(area.height() / ROOM[1]).clamp(0.4, 1.0);
        let at = |corner: Pos2, size: [f32; 2], anchor: [f32; 2]| {
            let size = vec2(size[0], size[1]) * scale;
            Rect::from_min_size(corner - vec2(anchor[0] * size.x, anchor[1] * size.y), size)
        };
        let slice = at(area.left_bottom(), [SLICE, SLICE + 18.0], [0.0, 1.0]);
        // Beside a round field there is room above the slice and none at its side.
        let is_alone = endoscope.is_none() || outside.is_none();
        let distances = if is_alone {
            at(slice.left_top() - vec2(0.0, GAP), DISTANCES, [0.0, 1.0])
        } else {
            at(pos2(area.right(), area.bottom()), DISTANCES, [1.0, 1.0])
        };
        let row = at(area.right_top(), [ROW, ROW_HEIGHT], [1.0, 0.0]);
        let map = (outside.is_none()).then(|| at(area.right_bottom(), MAP, [1.0, 1.0]));
        Some(Self {
            slice,
            distances,
            row,
            map,
            scale,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Endoscope and outside view as the game has them at 1280 by 720 beside its panel: both, one, the other. At 2560 by 1440
    /// they are as large in points.
    fn views() -> [(Option<Rect>, Option<Rect>); 3] {
        let area = |from: f32, to: f32| Some(Rect::from_min_max(pos2(from, 0.0), pos2(to, 720.0)));
        [
            (area(0.0, 613.0), area(613.0, 990.0)),
            (area(0.0, 990.0), None),
            (None, area(0.0, 990.0)),
        ]
    }

    #[test]
    fn parts_lie_inside_the_view_and_beside_each_other() {
        for (endoscope, outside) in views() {
            let places = Places::of(endoscope, outside).unwrap();
            let view = outside.or(endoscope).unwrap();
            let mut parts = vec![places.slice, places.distances, places.row];
            parts.extend(places.map);
            for (n, part) in parts.iter().enumerate() {
                assert!(view.contains_rect(*part), "{part:?} in {view:?}");
                for other in &parts[n + 1..] {
                    assert!(!part.intersects(*other), "{part:?} {other:?}");
                }
            }
        }
        assert_eq!(Places::of(None, None), None);
    }

    #[test]
    fn the_middle_of_the_round_field_is_free() {
        for (endoscope, outside) in views() {
            let Some(view) = endoscope else { continue };
            let places = Places::of(endoscope, outside).unwrap();
            let radius = 0.5 * view.width().min(view.height());
            for part in [Some(places.slice), Some(places.distances), Some(places.row), places.map] {
                let Some(part) = part else { continue };
                let nearest = part.clamp(view.center());
                let share = nearest.distance(view.center()) / radius;
                assert!(share > 0.75, "{part:?} reaches {share} of the radius");
            }
        }
    }
}
