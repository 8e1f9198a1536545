//! How far the loop is from the capsule and from the external sphincter, in numbers and colours.

use bevy_egui::egui::{Align2, Color32, Painter, Rect, vec2};
use resecta_instrument::ResectoscopeGeometry;
use resecta_scenario::{ActiveExercise, LoopClearance};

use super::{super::overlay::shadowed, super::palette, Held, ground, skill::Parts};

/// Distance to the capsule below which to stop, mm: half the depth of a loop, as on the debriefing's map.
const STOP_MM: f32 = 2.0;
/// Distance below which the next stroke may reach it, mm: the depth of a loop.
const NEAR_MM: f32 = 4.5;
/// Height of the verumontanum above the sphincter where a case does not give both, mm (an adult's usual 10 to 15).
const VERUMONTANUM_MM: f32 = 10.0;

/// How near something is that must not be cut.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Danger {
    /// Far enough.
    Free,
    /// The next stroke may reach it.
    Near,
    /// Not further.
    Stop,
}

impl Danger {
    /// Of a distance to the capsule, mm; negative beyond it.
    pub fn of_capsule(distance_mm: f32) -> Self {
        match distance_mm {
            d if d < STOP_MM => Danger::Stop,
            d if d < NEAR_MM => Danger::Near,
            _ => Danger::Free,
        }
    }

    /// Of a height above the sphincter, mm, where the verumontanum, the end of every resection, is so high above it.
    pub fn of_sphincter(height_mm: f32, verumontanum_mm: f32) -> Self {
        match height_mm {
            h if h < 0.5 * verumontanum_mm => Danger::Stop,
            h if h < verumontanum_mm => Danger::Near,
            _ => Danger::Free,
        }
    }

    /// Its colour.
    pub fn colour(self) -> Color32 {
        match self {
            Danger::Free => palette::GOOD,
            Danger::Near => palette::CAREFUL,
            Danger::Stop => palette::BAD,
        }
    }

    /// The same as a word, for those who do not tell the colours apart.
    fn word(self) -> &'static str {
        match self {
            Danger::Free => "",
            Danger::Near => "near",
            Danger::Stop => "stop",
        }
    }
}

/// What the distance to the capsule is called.
const CAPSULE: &str = "Loop to capsule";
/// Less than this is told as nothing, mm.
const LEAST_TOLD_MM: f32 = 0.05;
/// And where the loop is beyond it.
const OUTSIDE: &str = "Loop outside capsule";

/// Height of the verumontanum above the sphincter, mm.
fn verumontanum_mm(active: &ActiveExercise) -> f32 {
    let marks = &active.case.landmarks;
    let height = (marks.verumontanum.zip(marks.external_sphincter)).map(|(upper, lower)| (upper.z - lower.z) as f32);
    height.filter(|height| *height > 0.0).unwrap_or(VERUMONTANUM_MM)
}

/// Whether a height is so far past the gland, in the bladder, that no stroke reaches the capsule from there.
fn is_past_gland(active: &ActiveExercise, height_mm: f32) -> bool {
    let heights = active.walls.heights_mm();
    heights.is_some_and(|(_, last)| f64::from(height_mm - NEAR_MM) > last)
}

/// Draws the distances. A loop that is drawn in harms nothing.
pub fn show(
    painter: &Painter,
    area: Rect,
    active: &ActiveExercise,
    held: &Held,
    clearance: &LoopClearance,
    parts: &Parts,
) {
    if parts.distances <= 0.0 {
        return;
    }
    let is_drawn_in = ResectoscopeGeometry::is_drawn_in(held.state.stroke_mm);
    let unless_in = |danger| if is_drawn_in { Danger::Free } else { danger };
    let capsule_mm = clearance
        .capsule_mm
        .filter(|_| !is_past_gland(active, held.height_mm()));
    let capsule = capsule_mm.map(|mm| {
        let words = if mm <= -LEAST_TOLD_MM { OUTSIDE } else { CAPSULE };
        (words, mm.abs(), unless_in(Danger::of_capsule(mm)))
    });
    let end = verumontanum_mm(active);
    let sphincter = clearance.sphincter_mm.map(|mm| {
        let words = if mm < 0.0 { "below sphincter" } else { "to sphincter" };
        (words, mm.abs(), unless_in(Danger::of_sphincter(mm, end)))
    });
    let rows: Vec<_> = [capsule, sphincter]
        .into_iter()
        .flatten()
        .filter(|(_, _, danger)| !parts.only_near || *danger > Danger::Free)
        .collect();
    if rows.is_empty() {
        return;
    }
    let scale = area.height() / 92.0;
    let height = area.height() * rows.len() as f32 / 2.0;
    let area = Rect::from_min_max(area.left_bottom() - vec2(0.0, height), area.right_bottom());
    ground(painter, area, parts.distances);
    for (row, (words, mm, danger)) in rows.into_iter().enumerate() {
        let corner = area.left_top() + vec2(10.0, 5.0 + 45.0 * row as f32) * scale;
        let colour = if is_drawn_in { palette::TEXT } else { danger.colour() };
        let colour = colour.gamma_multiply(parts.distances);
        let weak = palette::WEAK.gamma_multiply(parts.distances);
        shadowed(painter, corner, Align2::LEFT_TOP, words, 12.5 * scale, weak);
        let number = format!("{mm:.1} mm");
        let below = corner + vec2(0.0, 14.0) * scale;
        shadowed(painter, below, Align2::LEFT_TOP, &number, 22.0 * scale, colour);
        let end = corner + vec2(132.0, 20.0) * scale;
        shadowed(painter, end, Align2::RIGHT_TOP, danger.word(), 15.0 * scale, colour);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn danger_grows_on_the_way_to_what_must_not_be_cut() {
        let to_capsule = (-100..100).rev().map(|n| Danger::of_capsule(n as f32 / 10.0));
        let to_sphincter = (-50..200).rev().map(|n| Danger::of_sphincter(n as f32 / 10.0, 12.0));
        for way in [to_capsule.collect::<Vec<_>>(), to_sphincter.collect()] {
            assert!(way.is_sorted());
            assert_eq!((way.first(), way.last()), (Some(&Danger::Free), Some(&Danger::Stop)));
            assert!(way.contains(&Danger::Near));
        }
    }
}
