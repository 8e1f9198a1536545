//! A picture of an exercise: its gland cut across and cut along, zones in their colours, the marked part dyed where it is in
//! play. Drawn from a coarse lattice of the case, by egui's painter.

use bevy_egui::egui::{self, Align2, Color32, FontId, Pos2, Rect, Shape, Stroke, Ui};
use resecta_anatomy::{Lattice, LatticeOptions, Zone};
use resecta_scenario::{LoadedExercise, MarkedRegion};

use super::palette;

/// Least angle between the rays of the lattice that is drawn, degrees. From here on it is the exercise's own, so that volumes are
/// those of play; a finer one would take longer to build than there is between two frames.
const FINEST_DEG: f64 = 10.0;

/// A sketch and the numbers beside it. Empty for a case that gives no lattice.
#[derive(Debug, Clone, Default)]
pub struct Sketch {
    /// Across, at the height where most is marked: x to the right (patient's left), y down (posterior), mm.
    across: Vec<Cell>,
    /// Along, in the patient's middle: z to the right (towards the bladder), y down, mm.
    along: Vec<Cell>,
    /// Landmarks in `along`.
    landmarks: Vec<(Pos2, &'static str)>,
    /// Volume of the gland without its lumen, ml.
    pub volume_ml: f64,
    /// Volume of its adenoma, ml.
    pub adenoma_ml: f64,
    /// Volume of the marked part, ml.
    pub marked_ml: f64,
    /// Length, width and height (front to back), mm.
    pub size_mm: [f64; 3],
}

#[derive(Debug, Clone)]
struct Cell {
    corners: Vec<Pos2>,
    colour: Color32,
}

impl Sketch {
    /// Sketches the case of an exercise.
    pub fn of(loaded: &LoadedExercise) -> Self {
        let options = LatticeOptions {
            alpha_deg: loaded.exercise.alpha_deg.max(FINEST_DEG),
            ..Default::default()
        };
        let Ok(lattice) = Lattice::build(&loaded.case, &options) else {
            return Self::default();
        };
        let landmarks = &loaded.case.landmarks;
        let marked = MarkedRegion::of_lattice(&loaded.exercise.marked, &lattice, landmarks);
        // As in play: where a region ends that is not dyed is for the player to see.
        let dyed = loaded.exercise.marked.dyed;
        let shape = lattice.shape;
        let at = |i, j, k| lattice.positions[shape.index(i, j, k) as usize];
        let colour = |i, j, k| {
            let first = 2 * shape.cell_index(i, j, k);
            if dyed && (marked.contains(first) || marked.contains(first + 1)) {
                palette::MARK
            } else if lattice.zones[first as usize].is_adenoma() {
                palette::ADENOMA
            } else {
                palette::PERIPHERAL
            }
        };
        let cells = || (0..shape.angles).flat_map(|j| (0..shape.layers - 1).map(move |k| (j, k)));
        let marked_in = |i: u32| -> f64 {
            let sum = |(j, k)| {
                let first = 2 * shape.cell_index(i, j, k);
                marked.volume_mm3(first) + marked.volume_mm3(first + 1)
            };
            cells().map(sum).sum()
        };
        let slice = (0..shape.slices - 1)
            .max_by(|&a, &b| marked_in(a).total_cmp(&marked_in(b)))
            .unwrap_or(0);
        let across = cells().map(|(j, k)| Cell {
            corners: [(j, k), (j + 1, k), (j + 1, k + 1), (j, k + 1)]
                .map(|(j, k)| {
                    let place = at(slice, j, k);
                    egui::pos2(place.x as f32, place.y as f32)
                })
                .to_vec(),
            colour: colour(slice, j, k),
        });
        // The rays at 6 and 12 o'clock.
        let rays = [shape.angles / 4, 3 * shape.angles / 4];
        let along = rays.into_iter().flat_map(|j| {
            let along_ray = move |i| (0..shape.layers - 1).map(move |k| (i, j, k));
            (0..shape.slices - 1).flat_map(along_ray)
        });
        let along = along.map(|(i, j, k)| Cell {
            corners: [(i, k), (i + 1, k), (i + 1, k + 1), (i, k + 1)]
                .map(|(i, k)| {
                    let place = at(i, j, k);
                    egui::pos2(place.z as f32, place.y as f32)
                })
                .to_vec(),
            colour: colour(i, j, k),
        });
        let volume_of = |wanted: fn(Zone) -> bool| -> f64 {
            let position = |node: u32| lattice.positions[node as usize];
            (lattice.pentahedra.iter().zip(&lattice.zones))
                .filter(|(_, zone)| wanted(**zone))
                .map(|(nodes, _)| resecta_anatomy::wedge::volume(nodes, position))
                .sum::<f64>()
                / 1000.0
        };
        let extent = |of: fn(&bevy::math::DVec3) -> f64| {
            let values = lattice.positions.iter().map(of);
            let (low, high) = values.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), value| {
                (low.min(value), high.max(value))
            });
            high - low
        };
        let named = [
            (landmarks.bladder_neck, "bladder neck"),
            (landmarks.verumontanum, "verumontanum"),
        ];
        Self {
            across: across.collect(),
            along: along.collect(),
            landmarks: named
                .into_iter()
                .filter_map(|(place, name)| Some((egui::pos2(place?.z as f32, place?.y as f32), name)))
                .collect(),
            volume_ml: volume_of(|_| true),
            adenoma_ml: volume_of(Zone::is_adenoma),
            marked_ml: marked.total_mm3() / 1000.0,
            size_mm: [
                extent(|place| place.z),
                extent(|place| place.x),
                extent(|place| place.y),
            ],
        }
    }

    /// Draws both sections side by side in this size, points.
    pub fn show(&self, ui: &mut Ui, size: egui::Vec2) {
        let (response, painter) = ui.allocate_painter(size, egui::Sense::hover());
        let area = response.rect;
        painter.rect_filled(area, 8.0, Color32::from_rgb(9, 11, 14));
        let (left, right) = area.shrink(10.0).split_left_right_at_fraction(0.42);
        draw(&painter, left, &self.across, &[]);
        draw(&painter, right, &self.along, &self.landmarks);
        let text = |place: Pos2, anchor, words: &str| {
            painter.text(place, anchor, words, FontId::proportional(11.0), palette::WEAK);
        };
        text(left.center_top(), Align2::CENTER_TOP, "anterior");
        text(left.center_bottom(), Align2::CENTER_BOTTOM, "posterior");
        text(right.left_center(), Align2::LEFT_CENTER, "apex");
        text(right.right_center(), Align2::RIGHT_CENTER, "bladder");
    }
}

/// Draws cells as large as fit, the right way up.
fn draw(painter: &egui::Painter, area: Rect, cells: &[Cell], landmarks: &[(Pos2, &str)]) {
    let area = area.shrink2(egui::vec2(44.0, 16.0));
    let mut bounds = Rect::NOTHING;
    for corner in cells.iter().flat_map(|cell| &cell.corners) {
        bounds.extend_with(*corner);
    }
    if !bounds.is_positive() {
        return;
    }
    let scale = (area.width() / bounds.width()).min(area.height() / bounds.height());
    let place = |point: Pos2| area.center() + (point - bounds.center()) * scale;
    for cell in cells {
        let corners = cell.corners.iter().map(|&corner| place(corner)).collect();
        // The frame in the cell's own colour closes the hair between two cells.
        painter.add(Shape::convex_polygon(
            corners,
            cell.colour,
            Stroke::new(0.8, cell.colour),
        ));
    }
    for &(point, name) in landmarks {
        let point = place(point);
        painter.circle(point, 3.5, palette::FOCUS, Stroke::new(1.0, Color32::BLACK));
        let below = point + egui::vec2(0.0, 6.0);
        let galley = painter.layout_no_wrap(name.to_owned(), FontId::proportional(11.5), palette::TEXT);
        let text = Align2::CENTER_TOP.anchor_size(below, galley.size());
        painter.rect_filled(text.expand(2.0), 3.0, Color32::from_black_alpha(170));
        painter.galley(text.min, galley, palette::TEXT);
    }
}
