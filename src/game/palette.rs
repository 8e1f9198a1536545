//! Every colour of the game's screens, in one place.
//!
//! The hues are those of Okabe and Ito (*Color Universal Design*, 2008), which people with any of the common colour
//! deficiencies tell apart; and nothing here is told by hue alone: words, letters or places say the same.

use bevy_egui::egui::Color32;
use resecta_scenario::Medal;

/// Okabe and Ito's orange.
const ORANGE: Color32 = Color32::from_rgb(230, 159, 0);
/// Sky blue.
const SKY: Color32 = Color32::from_rgb(86, 180, 233);
/// Bluish green, a little lighter than theirs: it has to be read on a dark ground.
const GREEN: Color32 = Color32::from_rgb(32, 182, 140);
/// Yellow.
const YELLOW: Color32 = Color32::from_rgb(240, 228, 66);
/// Blue.
const BLUE: Color32 = Color32::from_rgb(0, 114, 178);
/// Vermillion, a little lighter than theirs.
const VERMILLION: Color32 = Color32::from_rgb(243, 128, 60);
/// Reddish purple.
const PURPLE: Color32 = Color32::from_rgb(204, 121, 167);

/// Ground of full screens and of the panel.
pub const GROUND: Color32 = Color32::from_rgb(15, 18, 23);
/// Ground of what stands out from it.
pub const CARD: Color32 = Color32::from_rgb(27, 32, 40);
/// Ground of buttons.
pub const BUTTON: Color32 = Color32::from_rgb(42, 50, 61);
/// The same under the pointer.
pub const BUTTON_HOVERED: Color32 = Color32::from_rgb(58, 70, 85);
/// Rules and frames.
pub const LINE: Color32 = Color32::from_rgb(66, 76, 88);
/// Text.
pub const TEXT: Color32 = Color32::from_rgb(228, 232, 237);
/// Text of less weight.
pub const WEAK: Color32 = Color32::from_rgb(158, 167, 178);
/// What has the keyboard's focus.
pub const FOCUS: Color32 = YELLOW;
/// The game's own colour: titles, keys' names, progress.
pub const ACCENT: Color32 = SKY;
/// Something good.
pub const GOOD: Color32 = GREEN;
/// Something to look out for; the cutting current.
pub const CAREFUL: Color32 = ORANGE;
/// Something bad.
pub const BAD: Color32 = VERMILLION;
/// The coagulating current.
pub const COAGULATION: Color32 = SKY;
/// The dye on marked tissue, as it is seen in the views.
pub const MARK: Color32 = BLUE;
/// Adenoma in sketches.
pub const ADENOMA: Color32 = Color32::from_rgb(196, 148, 108);
/// Peripheral zone in sketches.
pub const PERIPHERAL: Color32 = Color32::from_rgb(122, 74, 68);
/// Curves of volume removed, blood, pressure and view.
pub const CURVES: [Color32; 4] = [GREEN, VERMILLION, SKY, PURPLE];

/// The colour of a medal; its name goes with it.
pub const fn medal(medal: Medal) -> Color32 {
    match medal {
        Medal::Bronze => Color32::from_rgb(205, 140, 90),
        Medal::Silver => Color32::from_rgb(200, 208, 216),
        Medal::Gold => Color32::from_rgb(240, 205, 70),
    }
}

/// From dark to light with a number from 0 to 1: for maps. Lightness alone carries it, the hue goes from blue to yellow.
pub fn ramp(share: f32) -> Color32 {
    let stops = [
        [20.0, 40.0, 80.0],
        [0.0, 114.0, 178.0],
        [86.0, 180.0, 233.0],
        [240.0, 228.0, 66.0],
    ];
    let place = share.clamp(0.0, 1.0) * (stops.len() - 1) as f32;
    let first = (place as usize).min(stops.len() - 2);
    let part = place - first as f32;
    let [red, green, blue] =
        std::array::from_fn(|n| (stops[first][n] + (stops[first + 1][n] - stops[first][n]) * part) as u8);
    Color32::from_rgb(red, green, blue)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn lightness(colour: Color32) -> f64 {
        let linear = |channel: u8| {
            let value = f64::from(channel) / 255.0;
            if value <= 0.04045 {
                value / 12.92
            } else {
                ((value + 0.055) / 1.055).powf(2.4)
            }
        };
        0.2126 * linear(colour.r()) + 0.7152 * linear(colour.g()) + 0.0722 * linear(colour.b())
    }

    /// Contrast of WCAG 2.1.
    fn contrast(a: Color32, b: Color32) -> f64 {
        let (a, b) = (lightness(a), lightness(b));
        (a.max(b) + 0.05) / (a.min(b) + 0.05)
    }

    #[test]
    fn all_text_is_readable_on_every_ground() {
        for ground in [GROUND, CARD, BUTTON] {
            for text in [TEXT, WEAK, ACCENT, GOOD, CAREFUL, BAD, FOCUS] {
                assert!(
                    contrast(text, ground) >= 4.5,
                    "{text:?} on {ground:?}: {}",
                    contrast(text, ground)
                );
            }
        }
    }

    #[test]
    fn the_ramp_gets_lighter_all_the_way() {
        let steps: Vec<f64> = (0..=20).map(|step| lightness(ramp(step as f32 / 20.0))).collect();
        assert!(steps.is_sorted_by(|a, b| a < b), "{steps:?}");
    }
}
