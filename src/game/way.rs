//! A way through the gland in words: to a vessel, to the tissue that an exercise is about.

use bevy::math::Vec3;
use resecta_instrument::InstrumentAction;

/// A way in the sheath's frame, mm (right, up and back), by its longest part: as the view has it, where the sheath is rolled.
pub fn whither(way: Vec3) -> String {
    let (size, [over, under]) = longest(
        way,
        [
            ["to the right", "to the left"],
            ["higher in the view", "lower in the view"],
            ["further back", "further ahead"],
        ],
    );
    format!("{:.0} mm {}", size.abs(), if size > 0.0 { over } else { under })
}

/// What the hands do to go that way.
pub fn action(way: Vec3) -> InstrumentAction {
    use InstrumentAction::{Advance, TipDown, TipLeft, TipRight, TipUp, Withdraw};
    let (size, [over, under]) = longest(way, [[TipRight, TipLeft], [TipUp, TipDown], [Withdraw, Advance]]);
    if size > 0.0 { over } else { under }
}

fn longest<T>(way: Vec3, words: [T; 3]) -> (f32, T) {
    let parts = way.to_array().into_iter().zip(words);
    let longest = parts.max_by(|(a, _), (b, _)| a.abs().total_cmp(&b.abs()));
    longest.expect("a way has three parts")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_longest_part_of_a_way_is_told() {
        for (way, told) in [
            (Vec3::new(0.5, -1.0, -4.2), "4 mm further ahead"),
            (Vec3::new(0.5, -1.0, 2.0), "2 mm further back"),
            (Vec3::new(-3.0, 1.0, 2.0), "3 mm to the left"),
            (Vec3::new(-3.0, -5.0, 2.0), "5 mm lower in the view"),
        ] {
            assert_eq!(whither(way), told);
        }
        assert_eq!(action(Vec3::new(0.5, -1.0, 12.0)), InstrumentAction::Withdraw);
        assert_eq!(action(Vec3::new(0.5, -9.0, 2.0)), InstrumentAction::TipDown);
    }
}
