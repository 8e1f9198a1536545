//! How well two outlines agree: overlap and distance.

use glam::DVec2;
use resecta_anatomy::contour;

/// Distance between the lines along which areas are measured, mm.
const LINE_MM: f64 = 0.2;
/// Distance between the places of an outline whose distances are taken, mm.
const PLACE_MM: f64 = 0.5;

/// Areas of two outlines and of what they share, mm².
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Overlap {
    /// Area of the first.
    pub first_mm2: f64,
    /// Area of the second.
    pub second_mm2: f64,
    /// Area inside both.
    pub common_mm2: f64,
}

impl Overlap {
    /// Of two outlines; an empty one has no area.
    pub fn of(first: &[DVec2], second: &[DVec2]) -> Overlap {
        let mut overlap = Overlap::default();
        let (low, high) = [first, second]
            .into_iter()
            .flatten()
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high): (f64, f64), corner| {
                (low.min(corner.y), high.max(corner.y))
            });
        if low > high {
            return overlap;
        }
        let lines = ((high - low) / LINE_MM).ceil() as usize;
        for line in 0..lines {
            let y = low + (line as f64 + 0.5) * LINE_MM;
            let (a, b) = (crossings(first, y), crossings(second, y));
            overlap.first_mm2 += LINE_MM * a.chunks_exact(2).map(|span| span[1] - span[0]).sum::<f64>();
            overlap.second_mm2 += LINE_MM * b.chunks_exact(2).map(|span| span[1] - span[0]).sum::<f64>();
            for one in a.chunks_exact(2) {
                for other in b.chunks_exact(2) {
                    overlap.common_mm2 += LINE_MM * (one[1].min(other[1]) - one[0].max(other[0])).max(0.0);
                }
            }
        }
        overlap
    }

    /// Dice's coefficient: twice the common area by the sum of both; 1 where both are empty.
    pub fn dice(&self) -> f64 {
        let sum = self.first_mm2 + self.second_mm2;
        if sum > 0.0 { 2.0 * self.common_mm2 / sum } else { 1.0 }
    }
}

impl std::ops::AddAssign for Overlap {
    fn add_assign(&mut self, other: Overlap) {
        self.first_mm2 += other.first_mm2;
        self.second_mm2 += other.second_mm2;
        self.common_mm2 += other.common_mm2;
    }
}

/// Where an outline crosses a horizontal line, by rising x: pairs of entry and exit.
fn crossings(outline: &[DVec2], y: f64) -> Vec<f64> {
    let mut found: Vec<f64> = contour::edges(outline)
        .filter(|[a, b]| (a.y > y) != (b.y > y))
        .map(|[a, b]| a.x + (b.x - a.x) * (y - a.y) / (b.y - a.y))
        .collect();
    found.sort_by(f64::total_cmp);
    found
}

/// Distances between two outlines at places along both, mm, unsorted: from each to the other.
pub fn distances_mm(first: &[DVec2], second: &[DVec2]) -> Vec<f64> {
    let mut distances = Vec::new();
    for (from, to) in [(first, second), (second, first)] {
        for [a, b] in contour::edges(from) {
            let steps = (a.distance(b) / PLACE_MM).ceil().max(1.0) as usize;
            for step in 0..steps {
                let place = a.lerp(b, (step as f64 + 0.5) / steps as f64);
                distances.push(contour::clearance(to, place).abs());
            }
        }
    }
    distances
}

/// Mean of [`distances_mm`].
pub fn mean_distance_mm(first: &[DVec2], second: &[DVec2]) -> f64 {
    let distances = distances_mm(first, second);
    distances.iter().sum::<f64>() / distances.len().max(1) as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    fn square(x: f64, y: f64, side: f64) -> Vec<DVec2> {
        [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)]
            .map(|(u, v)| DVec2::new(x + u * side, y + v * side))
            .to_vec()
    }

    #[test]
    fn overlap_of_shifted_squares_is_exact() {
        let overlap = Overlap::of(&square(0.0, 0.0, 10.0), &square(5.0, 0.0, 10.0));
        assert!((overlap.first_mm2 - 100.0).abs() < 1e-6 && (overlap.common_mm2 - 50.0).abs() < 1e-6);
        assert!((overlap.dice() - 0.5).abs() < 1e-9);
        assert_eq!(Overlap::of(&square(0.0, 0.0, 1.0), &square(9.0, 9.0, 1.0)).dice(), 0.0);
    }

    #[test]
    fn distance_is_symmetric_and_that_of_the_offset() {
        let (inner, outer) = (square(1.0, 1.0, 8.0), square(0.0, 0.0, 10.0));
        let distance = mean_distance_mm(&inner, &outer);
        assert!((distance - mean_distance_mm(&outer, &inner)).abs() < 1e-12);
        assert!((1.0..1.1).contains(&distance), "{distance}");
    }
}
