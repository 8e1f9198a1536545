//! A way through the gland in words: to a vessel, to the tissue that an exercise is about.

use bevy::math::Vec3;

/// A way in the sheath's frame, mm (right, up and back), by its longest part.
pub fn whither(way: Vec3) -> String {
    let (size, [over, under]) = [
        (way.x, ["to the right", "to the left"]),
        (way.y, ["higher", "deeper"]),
        (way.z, ["further back", "further in"]),
    ]
    .into_iter()
    .max_by(|a, b| a.0.abs().total_cmp(&b.0.abs()))
    .unwrap_or_default();
    format!("{:.0} mm {}", size.abs(), if size > 0.0 { over } else { under })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_longest_part_of_a_way_is_told() {
        for (way, told) in [
            (Vec3::new(0.5, -1.0, -4.2), "4 mm further in"),
            (Vec3::new(0.5, -1.0, 2.0), "2 mm further back"),
            (Vec3::new(-3.0, 1.0, 2.0), "3 mm to the left"),
            (Vec3::new(-3.0, -5.0, 2.0), "5 mm deeper"),
        ] {
            assert_eq!(whither(way), told);
        }
    }
}
