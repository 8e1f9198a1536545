//! A triangle whose three sides are divided into different numbers of parts, cut into triangles.
//!
//! Rows run between the two sides with most parts, from the corner between them to the third side. With three equal
//! numbers these are the `n²` similar triangles.

/// A divided triangle. Side `n` joins the corners `n` and `n + 1`.
#[derive(Debug, Clone)]
pub struct Triangle {
    /// Weights of the corners 1 and 2, by point.
    pub places: Vec<[f64; 2]>,
    /// Where every point lies.
    pub parts: Vec<Part>,
    /// In the sense of the corners. One with an edge on side `n` has its corners `n` and `n + 1` there.
    pub triangles: Vec<[usize; 3]>,
}

/// The part of a triangle that a point lies in.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Part {
    Corner(usize),
    /// A side, and the steps from its first corner.
    Side(usize, usize),
    /// Inside, with a running number.
    Inside(usize),
}

impl Triangle {
    /// Parts of the sides, each 1 or more, falling.
    pub fn new(sides: [usize; 3]) -> Self {
        let [first, second, third] = sides;
        let mut triangle = Self {
            places: Vec::new(),
            parts: Vec::new(),
            triangles: Vec::new(),
        };
        let mut inside = 0;
        let mut above = vec![triangle.add([1.0, 0.0], Part::Corner(1))];
        let mut right_before = 0;
        for row in 1..=first {
            // Both ends are points of the two long sides; the second has fewer, so some rows share their end.
            let right = (row * second).div_ceil(first);
            let count = (row * third).div_ceil(first);
            let from = [1.0 - row as f64 / first as f64, 0.0];
            let share = right as f64 / second as f64;
            let to = [1.0 - share, share];
            let points: Vec<usize> = (0..=count)
                .map(|n| {
                    if n == count && right == right_before {
                        return above[above.len() - 1];
                    }
                    let part = if n == 0 && row == first {
                        Part::Corner(0)
                    } else if n == count && right == second {
                        Part::Corner(2)
                    } else if row == first {
                        Part::Side(2, count - n)
                    } else if n == 0 {
                        Part::Side(0, first - row)
                    } else if n == count {
                        Part::Side(1, right)
                    } else {
                        inside += 1;
                        Part::Inside(inside - 1)
                    };
                    let along = n as f64 / count as f64;
                    let place = std::array::from_fn(|c| from[c] + (to[c] - from[c]) * along);
                    triangle.add(place, part)
                })
                .collect();
            triangle.fill(&above, &points, sides);
            (above, right_before) = (points, right);
        }
        triangle
    }

    fn add(&mut self, place: [f64; 2], part: Part) -> usize {
        self.places.push(place);
        self.parts.push(part);
        self.places.len() - 1
    }

    /// Fills the strip between two rows, which may share their last point.
    fn fill(&mut self, above: &[usize], below: &[usize], sides: [usize; 3]) {
        let (a, b) = (above.len() - 1, below.len() - 1);
        let (mut p, mut q) = (0, 0);
        while p < a || q < b {
            let below_next = p == a || (q < b && (q + 1) * a <= (p + 1) * b);
            let triangle = if below_next {
                q += 1;
                [above[p], below[q], below[q - 1]]
            } else {
                p += 1;
                [above[p - 1], above[p], below[q]]
            };
            if triangle[0] != triangle[1] && triangle[1] != triangle[2] {
                self.triangles.push(self.turned(triangle, sides));
            }
        }
    }

    /// The triangle with its corners where the sides want them.
    fn turned(&self, triangle: [usize; 3], sides: [usize; 3]) -> [usize; 3] {
        let on = |point: usize, side: usize| match self.parts[point] {
            Part::Corner(corner) => (corner == side)
                .then_some(0)
                .or_else(|| (corner == (side + 1) % 3).then_some(sides[side])),
            Part::Side(its, step) => (its == side).then_some(step),
            Part::Inside(_) => None,
        };
        for side in 0..3 {
            for m in 0..3 {
                let [from, to] = [triangle[m], triangle[(m + 1) % 3]].map(|point| on(point, side));
                if let (Some(from), Some(to)) = (from, to)
                    && to == from + 1
                {
                    return std::array::from_fn(|n| triangle[(m + 3 - side + n) % 3]);
                }
            }
        }
        triangle
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn all() -> impl Iterator<Item = [usize; 3]> {
        (1..=9).flat_map(|a| (1..=a).flat_map(move |b| (1..=b).map(move |c| [a, b, c])))
    }

    #[test]
    fn every_triangle_is_filled_once_in_its_sense() {
        for sides in all() {
            let triangle = Triangle::new(sides);
            let mut sum = 0.0;
            for corners in &triangle.triangles {
                let [p, q, r] = corners.map(|point| triangle.places[point]);
                let doubled = (q[0] - p[0]) * (r[1] - p[1]) - (q[1] - p[1]) * (r[0] - p[0]);
                assert!(doubled > 1e-3, "{sides:?}: {doubled}");
                sum += doubled;
            }
            assert!((sum - 1.0).abs() < 1e-12, "{sides:?}: {sum}");
        }
    }

    #[test]
    fn sides_have_their_parts_and_equal_numbers_give_similar_triangles() {
        for sides in all() {
            let triangle = Triangle::new(sides);
            for (side, count) in sides.into_iter().enumerate() {
                for step in 1..count {
                    let at = triangle.parts.iter().filter(|&&part| part == Part::Side(side, step));
                    assert_eq!(at.count(), 1, "{sides:?}");
                }
            }
            let corners = (triangle.parts.iter()).filter(|part| matches!(part, Part::Corner(_)));
            assert_eq!(corners.count(), 3);
            if sides[0] == sides[2] {
                assert_eq!(triangle.triangles.len(), sides[0] * sides[0]);
            }
        }
    }
}
