//! Closest points of a segment and a triangle.

use bevy::math::{Vec3, Vec4, Vec4Swizzles};

/// The closest points of a segment and a triangle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ClosestPoints {
    /// Where on the segment: 0 at its start, 1 at its end.
    pub share: f32,
    /// The point of the segment, mm.
    pub on_segment: Vec3,
    /// Barycentric weights of the point of the triangle.
    pub weights: [f32; 3],
    /// The point of the triangle, mm.
    pub on_triangle: Vec3,
}

impl ClosestPoints {
    /// The distance between the two, mm.
    pub fn distance(&self) -> f32 {
        self.on_segment.distance(self.on_triangle)
    }
}

/// Closest points of the segment `a`-`b` and a triangle. Degenerate segments and triangles are fine.
#[inline(always)]
pub fn segment_triangle(a: Vec3, b: Vec3, triangle: [Vec3; 3]) -> ClosestPoints {
    if let Some(crossing) = crossing(a, b, triangle) {
        return crossing;
    }
    // Without a crossing, the closest points include an end of the segment or a point of an edge: no end where all of the triangle is
    // beside the segment, neither before it nor past it.
    let along = b - a;
    let squared = along.length_squared();
    let is_beside = |corner: &Vec3| (0.0..=squared).contains(&(*corner - a).dot(along));
    let edge = nearest_edge(a, b, triangle);
    if squared > 0.0 && triangle.iter().all(is_beside) {
        return edge;
    }
    let ends = [(a, 0.0), (b, 1.0)].map(|(end, share)| point_triangle(end, triangle).at_share(share));
    nearest_of([ends[0], ends[1], edge])
}

/// The nearest of some closest points; of equally near ones the first.
fn nearest_of<const N: usize>(all: [ClosestPoints; N]) -> ClosestPoints {
    let squared = |points: &ClosestPoints| points.on_segment.distance_squared(points.on_triangle);
    let (mut best, mut best_squared) = (all[0], squared(&all[0]));
    for points in &all[1..] {
        let squared = squared(points);
        if squared < best_squared {
            (best, best_squared) = (*points, squared);
        }
    }
    best
}

/// Vectors of the three edges of a triangle, by component; the last lane repeats the first edge.
#[derive(Clone, Copy)]
struct Edges([Vec4; 3]);

impl Edges {
    fn every(vector: Vec3) -> Edges {
        Edges(vector.to_array().map(Vec4::splat))
    }

    fn dot(self, other: Edges) -> Vec4 {
        let [x, y, z] = [0, 1, 2].map(|axis| self.0[axis] * other.0[axis]);
        x + y + z
    }

    fn minus(self, other: Edges) -> Edges {
        Edges([0, 1, 2].map(|axis| self.0[axis] - other.0[axis]))
    }

    /// As `Vec3::lerp`.
    fn lerp(self, to: Edges, share: Vec4) -> Edges {
        Edges([0, 1, 2].map(|axis| self.0[axis] * (1.0 - share) + to.0[axis] * share))
    }

    fn of(self, edge: usize) -> Vec3 {
        Vec3::from_array(self.0.map(|component| component[edge]))
    }
}

/// The closest points of the segment `a`-`b` and the edges of a triangle (Ericson, 5.1.9), of equally near ones those of the
/// first edge. All three edges are worked on at a time, without a branch.
#[inline(always)]
fn nearest_edge(a: Vec3, b: Vec3, [p, q, r]: [Vec3; 3]) -> ClosestPoints {
    const TINY: f32 = 1e-12;
    let corner = |[p, q, r]: [f32; 3]| Vec4::new(p, q, r, p);
    let from = Edges([0, 1, 2].map(|axis| corner([p[axis], q[axis], r[axis]])));
    let to = Edges(from.0.map(|component| component.yzxy()));
    let (along, edge, apart) = (Edges::every(b - a), to.minus(from), Edges::every(a).minus(from));
    let clamped = |shares: Vec4| shares.max(Vec4::ZERO).min(Vec4::ONE);
    let (d, e, f) = (Vec4::splat((b - a).length_squared()), edge.dot(edge), edge.dot(apart));
    let (c, g) = (along.dot(apart), along.dot(edge));
    let is_edge = e.cmpgt(Vec4::splat(TINY));
    let denominator = d * e - g * g;
    // Parallel segments: any share of the first will do.
    let is_aslant = denominator.cmpgt(TINY * d * e);
    let share = Vec4::select(is_aslant, clamped((g * f - c * e) / denominator), Vec4::ZERO);
    // Where the edge itself ends before, the segment is nearest to its end.
    let free = Vec4::select(is_edge, (g * share + f) / e, Vec4::NEG_ONE);
    let along_edge = clamped(free);
    let share = Vec4::select(free.cmpeq(along_edge), share, clamped((g * along_edge - c) / d));
    let is_point = d.x <= TINY;
    let share = if is_point { Vec4::ZERO } else { share };
    let along_edge = match is_point {
        true => Vec4::select(is_edge, clamped(f / e), Vec4::ZERO),
        false => along_edge,
    };
    let on_segment = Edges::every(a).lerp(Edges::every(b), share);
    let on_edge = from.lerp(to, along_edge);
    let away = on_segment.minus(on_edge);
    let squared = away.dot(away);
    let mut best = 0;
    for edge in 1..3 {
        if squared[edge] < squared[best] {
            best = edge;
        }
    }
    let mut weights = [0.0; 3];
    weights[best] = 1.0 - along_edge[best];
    weights[(best + 1) % 3] = along_edge[best];
    ClosestPoints {
        share: share[best],
        on_segment: on_segment.of(best),
        weights,
        on_triangle: on_edge.of(best),
    }
}

/// The point of a triangle that is closest to a point (Ericson, Real-Time Collision Detection, 5.1.5).
pub fn point_triangle(point: Vec3, [a, b, c]: [Vec3; 3]) -> ClosestPoints {
    let found = |weights: [f32; 3]| ClosestPoints {
        share: 0.0,
        on_segment: point,
        weights,
        on_triangle: a * weights[0] + b * weights[1] + c * weights[2],
    };
    let (ab, ac, ap) = (b - a, c - a, point - a);
    let (d1, d2) = (ab.dot(ap), ac.dot(ap));
    if d1 <= 0.0 && d2 <= 0.0 {
        return found([1.0, 0.0, 0.0]);
    }
    let bp = point - b;
    let (d3, d4) = (ab.dot(bp), ac.dot(bp));
    if d3 >= 0.0 && d4 <= d3 {
        return found([0.0, 1.0, 0.0]);
    }
    let vc = d1 * d4 - d3 * d2;
    if vc <= 0.0 && d1 >= 0.0 && d3 <= 0.0 {
        let v = d1 / (d1 - d3);
        return found([1.0 - v, v, 0.0]);
    }
    let cp = point - c;
    let (d5, d6) = (ab.dot(cp), ac.dot(cp));
    if d6 >= 0.0 && d5 <= d6 {
        return found([0.0, 0.0, 1.0]);
    }
    let vb = d5 * d2 - d1 * d6;
    if vb <= 0.0 && d2 >= 0.0 && d6 <= 0.0 {
        let w = d2 / (d2 - d6);
        return found([1.0 - w, 0.0, w]);
    }
    let va = d3 * d6 - d5 * d4;
    if va <= 0.0 && d4 - d3 >= 0.0 && d5 - d6 >= 0.0 {
        let w = (d4 - d3) / ((d4 - d3) + (d5 - d6));
        return found([0.0, 1.0 - w, w]);
    }
    let sum = va + vb + vc;
    if sum <= 0.0 {
        return found([1.0, 0.0, 0.0]);
    }
    found([va / sum, vb / sum, vc / sum])
}

impl ClosestPoints {
    fn at_share(mut self, share: f32) -> Self {
        self.share = share;
        self
    }
}

/// Where the segment passes through the inside of the triangle.
#[inline(always)]
fn crossing(a: Vec3, b: Vec3, triangle: [Vec3; 3]) -> Option<ClosestPoints> {
    let [p, q, r] = triangle;
    let normal = (q - p).cross(r - p);
    let (start, end) = (normal.dot(a - p), normal.dot(b - p));
    if start * end > 0.0 || start == end {
        return None;
    }
    let share = start / (start - end);
    let point = a.lerp(b, share);
    let squared = normal.length_squared();
    let weight = |u: Vec3, v: Vec3| normal.dot((u - point).cross(v - point)) / squared;
    let weights = [weight(q, r), weight(r, p), weight(p, q)];
    weights.iter().all(|weight| *weight >= 0.0).then_some(ClosestPoints {
        share,
        on_segment: point,
        weights,
        on_triangle: point,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn vector() -> impl Strategy<Value = Vec3> {
        (-5.0..5.0f32, -5.0..5.0f32, -5.0..5.0f32).prop_map(|(x, y, z)| Vec3::new(x, y, z))
    }

    proptest! {
        #[test]
        fn no_pair_of_points_is_closer(a in vector(), b in vector(), p in vector(), q in vector(), r in vector()) {
            let found = segment_triangle(a, b, [p, q, r]);
            prop_assert!((found.weights.iter().sum::<f32>() - 1.0).abs() < 1e-4);
            prop_assert!(found.weights.iter().all(|weight| *weight >= -1e-5));
            let on_triangle = p * found.weights[0] + q * found.weights[1] + r * found.weights[2];
            prop_assert!(on_triangle.distance(found.on_triangle) < 1e-3);
            prop_assert!(a.lerp(b, found.share).distance(found.on_segment) < 1e-4);
            for i in 0..=20 {
                for j in 0..=20 {
                    for k in 0..=20 - j {
                        let (u, v) = (j as f32 / 20.0, k as f32 / 20.0);
                        let other = p * (1.0 - u - v) + q * u + r * v;
                        let distance = a.lerp(b, i as f32 / 20.0).distance(other);
                        prop_assert!(found.distance() <= distance + 1e-3);
                    }
                }
            }
        }
    }

    #[test]
    fn a_point_and_a_line_in_place_of_segment_and_triangle_are_fine() {
        let found = segment_triangle(Vec3::Y, Vec3::Y, [Vec3::ZERO, Vec3::X, Vec3::X]);
        assert_eq!(found.distance(), 1.0);
    }
}
