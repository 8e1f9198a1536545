//! The map of what was cut: the gland unrolled, the bladder above, and left and right as whoever operates sees them.

use bevy_egui::egui::{self, Align2, Color32, FontId, Pos2, Rect, RichText, Sense, Stroke, StrokeKind, Ui};
use resecta_anatomy::Zone;
use resecta_scenario::{ActiveExercise, CutCell, CutMap};

use super::super::{menu, palette};

/// Distance to the capsule below which a cell is warned of, mm: half the depth of a loop.
const NEAR_CAPSULE_MM: f64 = 2.0;
/// Less than this in a cell is not shown, mm³: what a touch of the loop shaves off.
const SHOWN_MM3: f64 = 0.5;

/// Ground of a cell with something marked in it: no colour of a depth.
const MARKED: Color32 = Color32::from_rgb(112, 74, 140);

/// Ground of a cell whose tissue is mostly of this zone.
fn zone_ground(zone: Zone) -> Color32 {
    match zone {
        Zone::MiddleLobe => Color32::from_rgb(92, 70, 50),
        Zone::LateralLobe => Color32::from_rgb(62, 48, 36),
        Zone::Peripheral => Color32::from_rgb(44, 26, 26),
        Zone::Other => palette::CARD,
    }
}

/// Shows the page.
pub fn show(ui: &mut Ui, active: &ActiveExercise, map: &CutMap) {
    let deepest = (map.cells.iter().filter_map(|cell| cell.depth_mm)).fold(5.0, f64::max);
    let width = ui.available_width();
    ui.horizontal_top(|ui| {
        let size = egui::vec2(width * 0.70, ui.available_height() - 14.0);
        let hovered = draw(ui, active, map, deepest, size);
        ui.add_space(14.0);
        let is_asked = active.exercise.asks_for_tissue();
        ui.vertical(|ui| side(ui, map, deepest, hovered, is_asked));
    });
}

/// Draws the map; returns the cell under the pointer.
fn draw(ui: &mut Ui, active: &ActiveExercise, map: &CutMap, deepest: f64, size: egui::Vec2) -> Option<(usize, usize)> {
    let (response, painter) = ui.allocate_painter(size, Sense::hover());
    let area = Rect::from_min_max(
        response.rect.min + egui::vec2(118.0, 4.0),
        response.rect.max - egui::vec2(6.0, 34.0),
    );
    painter.rect_filled(area, 0.0, Color32::from_rgb(9, 11, 14));
    let step = egui::vec2(area.width() / map.columns as f32, area.height() / map.rows as f32);
    // 12 o'clock at both edges, so that 6, where most is cut, is in the middle; the bladder above. Hours therefore fall from left
    // to right: 3 o'clock, the patient's left, is on the right as through the lens.
    let corner = |row: usize, column: usize| -> Pos2 {
        let (across, down) = (map.columns - 1 - column, map.rows - 1 - row);
        area.min + egui::vec2(across as f32 * step.x, down as f32 * step.y)
    };
    let cell_area = |row, column| Rect::from_min_size(corner(row, column), step);
    for row in 0..map.rows {
        for column in 0..map.columns {
            let Some(cell) = map.cell(row, column) else { continue };
            if cell.whole_mm3 <= 0.0 {
                continue;
            }
            let ground = if cell.marked_mm3 > 0.0 && active.exercise.asks_for_tissue() {
                MARKED
            } else {
                cell.zone().map_or(palette::CARD, zone_ground)
            };
            let here = cell_area(row, column);
            painter.rect_filled(here.shrink(0.5), 1.0, ground);
            if cell.removed_mm3 < SHOWN_MM3 {
                continue;
            }
            let colour = palette::ramp((cell.depth_mm.unwrap_or(0.0) / deepest) as f32);
            painter.rect_filled(here.shrink(0.5), 1.0, colour);
            sign(&painter, here, cell);
        }
    }
    axes(&painter, area, active, map);
    let place = response.hover_pos().filter(|place| area.contains(*place))?;
    let across = ((place.x - area.left()) / step.x) as usize;
    let row = map.rows - 1 - (((place.y - area.top()) / step.y) as usize).min(map.rows - 1);
    let column = map.columns - 1 - across.min(map.columns - 1);
    let stroke = Stroke::new(2.0, palette::FOCUS);
    painter.rect_stroke(cell_area(row, column), 1.0, stroke, StrokeKind::Outside);
    Some((row, column))
}

/// What is to be warned of in a cell, by shape besides colour: a cross where capsule went, a frame where it is near.
fn sign(painter: &egui::Painter, area: Rect, cell: &CutCell) {
    let Some(distance) = cell.capsule_mm else { return };
    let inner = area.shrink(2.0);
    if distance <= 0.0 {
        // On a dark line, so that it stands out from any depth's colour.
        for stroke in [Stroke::new(4.0, palette::GROUND), Stroke::new(2.0, palette::BAD)] {
            painter.line_segment([inner.left_top(), inner.right_bottom()], stroke);
            painter.line_segment([inner.right_top(), inner.left_bottom()], stroke);
        }
    } else if distance < NEAR_CAPSULE_MM {
        painter.rect_stroke(inner, 0.0, Stroke::new(3.5, palette::GROUND), StrokeKind::Inside);
        painter.rect_stroke(inner, 0.0, Stroke::new(2.0, palette::BAD), StrokeKind::Inside);
    }
}

/// Hours below, heights and landmarks at the left.
fn axes(painter: &egui::Painter, area: Rect, active: &ActiveExercise, map: &CutMap) {
    painter.rect_stroke(area, 0.0, Stroke::new(1.0, palette::LINE), StrokeKind::Outside);
    let text = |place, anchor, words: &str, colour| {
        painter.text(place, anchor, words, FontId::proportional(12.5), colour);
    };
    for hour in (0..=12).step_by(3) {
        let x = area.right() - area.width() * hour as f32 / 12.0;
        painter.line_segment(
            [egui::pos2(x, area.bottom()), egui::pos2(x, area.bottom() + 4.0)],
            Stroke::new(1.0, palette::WEAK),
        );
        let words = match hour {
            0 | 12 => "12 anterior",
            3 => "3 patient's left",
            6 => "6 posterior",
            _ => "9 patient's right",
        };
        let anchor = match hour {
            0 => Align2::RIGHT_TOP,
            12 => Align2::LEFT_TOP,
            _ => Align2::CENTER_TOP,
        };
        text(egui::pos2(x, area.bottom() + 5.0), anchor, words, palette::TEXT);
    }
    let landmarks = &active.case.landmarks;
    let height = map.rows as f64 * map.row_mm;
    for (place, name) in [
        (landmarks.bladder_neck, "bladder neck"),
        (landmarks.verumontanum, "verumontanum"),
    ] {
        let Some(place) = place else { continue };
        let share = (place.z - map.from_mm) / height;
        if !(0.0..=1.0).contains(&share) {
            continue;
        }
        let y = area.bottom() - area.height() * share as f32;
        let ends = [egui::pos2(area.left(), y), egui::pos2(area.right(), y)];
        painter.extend(egui::Shape::dashed_line(
            &ends,
            Stroke::new(1.5, palette::TEXT),
            7.0,
            5.0,
        ));
        text(
            egui::pos2(area.left() - 8.0, y),
            Align2::RIGHT_CENTER,
            name,
            palette::TEXT,
        );
    }
    text(
        area.left_top() - egui::vec2(8.0, 0.0),
        Align2::RIGHT_TOP,
        "bladder",
        palette::WEAK,
    );
    text(
        area.left_bottom() - egui::vec2(8.0, 0.0),
        Align2::RIGHT_BOTTOM,
        "apex",
        palette::WEAK,
    );
}

/// Legend, totals, and the cell under the pointer; marks only where the exercise asks for tissue.
fn side(ui: &mut Ui, map: &CutMap, deepest: f64, hovered: Option<(usize, usize)>, is_asked: bool) {
    ui.spacing_mut().item_spacing.y = 3.0;
    menu::caption(ui, "Depth below the urethra");
    let (area, _) = ui.allocate_exact_size(egui::vec2(ui.available_width().min(260.0), 16.0), Sense::hover());
    let parts = 40;
    for part in 0..parts {
        let share = part as f32 / parts as f32;
        let left = area.left() + area.width() * share;
        let width = area.width() / parts as f32 + 0.5;
        let piece = Rect::from_min_size(egui::pos2(left, area.top()), egui::vec2(width, area.height()));
        ui.painter().rect_filled(piece, 0.0, palette::ramp(share));
    }
    ui.horizontal(|ui| {
        ui.label(RichText::new("0").size(12.5).color(palette::WEAK));
        ui.add_space(area.width() - 60.0);
        ui.label(
            RichText::new(format!("{deepest:.0} mm"))
                .size(12.5)
                .color(palette::WEAK),
        );
    });
    for (words, cell) in [
        (
            "capsule less than 2 mm away",
            CutCell {
                capsule_mm: Some(1.0),
                ..CutCell::default()
            },
        ),
        (
            "capsule cut",
            CutCell {
                capsule_mm: Some(0.0),
                ..CutCell::default()
            },
        ),
    ] {
        ui.horizontal(|ui| {
            let (area, _) = ui.allocate_exact_size(egui::vec2(18.0, 18.0), Sense::hover());
            ui.painter().rect_filled(area, 1.0, palette::ramp(0.5));
            sign(ui.painter(), area, &cell);
            ui.label(words);
        });
    }
    let marked = is_asked.then_some(("marked, still there", MARKED));
    for (words, colour) in marked.into_iter().chain([
        ("mostly middle lobe", zone_ground(Zone::MiddleLobe)),
        ("mostly lateral lobe", zone_ground(Zone::LateralLobe)),
        ("mostly peripheral zone", zone_ground(Zone::Peripheral)),
    ]) {
        ui.horizontal(|ui| {
            let (area, _) = ui.allocate_exact_size(egui::vec2(18.0, 18.0), Sense::hover());
            ui.painter().rect_filled(area, 1.0, colour);
            ui.label(words);
        });
    }
    ui.add_space(5.0);
    menu::caption(ui, "Removed");
    let by_zone = |zone: Zone| -> f64 {
        map.cells
            .iter()
            .map(|cell| cell.removed_by_zone_mm3[zone.index()])
            .sum()
    };
    let sum = |of: fn(&CutCell) -> f64| -> f64 { map.cells.iter().map(of).sum() };
    let nearest = (map.cells.iter().filter_map(|cell| cell.capsule_mm)).fold(f64::INFINITY, f64::min);
    let ml = |mm3: f64| format!("{:.2} ml", mm3 / 1000.0);
    let mut rows = vec![
        ("All", ml(map.removed_mm3())),
        ("Lateral lobes", ml(by_zone(Zone::LateralLobe))),
        ("Middle lobe", ml(by_zone(Zone::MiddleLobe))),
        ("Peripheral zone", ml(by_zone(Zone::Peripheral))),
    ];
    if is_asked {
        rows.push(("Of what was marked", ml(sum(|cell| cell.marked_removed_mm3))));
        rows.push(("Still there", ml(sum(|cell| cell.marked_mm3 - cell.marked_removed_mm3))));
    }
    rows.push((
        "Nearest to the capsule, at rest",
        if nearest.is_finite() {
            format!("{nearest:.1} mm")
        } else {
            "nothing cut".into()
        },
    ));
    grid(ui, "removed", &rows);
    ui.add_space(5.0);
    menu::caption(ui, "Under the pointer");
    let cell = hovered.and_then(|(row, column)| Some((row, column, map.cell(row, column)?)));
    let Some((row, column, cell)) = cell else {
        ui.label(RichText::new("Point at the map.").color(palette::WEAK));
        return;
    };
    let hour = column as f64 * 12.0 / map.columns as f64;
    let half_row = map.row_mm / 2.0;
    let millimetres = |value: Option<f64>| value.map_or("nothing cut".into(), |value| format!("{value:.1} mm"));
    let rows = [
        (
            "Hour",
            format!(
                "{}:{:02.0}",
                if hour < 1.0 { 12 } else { hour as u32 },
                60.0 * hour.fract()
            ),
        ),
        (
            "Above the apex",
            format!("{:.0} mm", row as f64 * map.row_mm + half_row),
        ),
        ("Removed", ml(cell.removed_mm3)),
        ("Depth", millimetres(cell.depth_mm)),
        ("To the capsule", millimetres(cell.capsule_mm)),
    ];
    grid(ui, "pointed at", &rows);
}

fn grid(ui: &mut Ui, name: &str, rows: &[(&str, String)]) {
    egui::Grid::new(name)
        .num_columns(2)
        .spacing([16.0, 3.0])
        .show(ui, |ui| {
            for (title, value) in rows {
                ui.label(RichText::new(*title).color(palette::WEAK));
                ui.label(value);
                ui.end_row();
            }
        });
}
