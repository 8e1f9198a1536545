//! Plane geometry of closed contours: area, inside or outside, crossings, the roundest place inside.
//!
//! A contour is a slice of corners in mm, in either sense, the last joined to the first. Edge `n` runs from corner `n` to
//! its successor. With `+x` to the patient's left and `+y` posterior, a positive area is counter-clockwise in (x, y).

use std::cmp::Ordering;
use std::collections::BinaryHeap;

use glam::DVec2;

/// The edges of a contour, in order.
pub fn edges(contour: &[DVec2]) -> impl ExactSizeIterator<Item = [DVec2; 2]> + '_ {
    (0..contour.len()).map(|corner| [contour[corner], contour[(corner + 1) % contour.len()]])
}

/// Enclosed area in mm², positive when counter-clockwise (shoelace formula, taken from the first corner).
pub fn signed_area(contour: &[DVec2]) -> f64 {
    let origin = contour.first().copied().unwrap_or_default();
    0.5 * edges(contour)
        .map(|[a, b]| (a - origin).perp_dot(b - origin))
        .sum::<f64>()
}

/// Centre of the enclosed area, mm; the mean corner where the area vanishes.
pub fn centroid(contour: &[DVec2]) -> DVec2 {
    let origin = contour.first().copied().unwrap_or_default();
    let (mut six_areas, mut moment) = (0.0, DVec2::ZERO);
    for [a, b] in edges(contour) {
        let (a, b) = (a - origin, b - origin);
        six_areas += 3.0 * a.perp_dot(b);
        moment += (a + b) * a.perp_dot(b);
    }
    if six_areas.abs() > f64::MIN_POSITIVE {
        origin + moment / six_areas
    } else {
        contour.iter().sum::<DVec2>() / contour.len().max(1) as f64
    }
}

/// Length of the contour, mm, with its closing edge.
pub fn perimeter(contour: &[DVec2]) -> f64 {
    edges(contour).map(|[a, b]| a.distance(b)).sum()
}

/// Smallest box that holds the corners: its lowest and highest point, mm.
pub fn bounds(contour: &[DVec2]) -> [DVec2; 2] {
    contour
        .iter()
        .fold([DVec2::INFINITY, DVec2::NEG_INFINITY], |[low, high], &corner| {
            [low.min(corner), high.max(corner)]
        })
}

/// Whether a point lies inside, by the even-odd rule.
pub fn contains(contour: &[DVec2], point: DVec2) -> bool {
    edges(contour).fold(false, |inside, [a, b]| {
        let crosses = (a.y > point.y) != (b.y > point.y) && point.x < a.x + (b.x - a.x) * (point.y - a.y) / (b.y - a.y);
        inside != crosses
    })
}

/// The same contour, counter-clockwise.
pub fn ensure_ccw(mut contour: Vec<DVec2>) -> Vec<DVec2> {
    if signed_area(&contour) < 0.0 {
        contour.reverse();
    }
    contour
}

/// Distance from a point to the contour, mm: positive inside, negative outside.
pub fn clearance(contour: &[DVec2], point: DVec2) -> f64 {
    let distance = edges(contour)
        .map(|[a, b]| distance_to_segment(point, a, b))
        .fold(f64::INFINITY, f64::min);
    if contains(contour, point) { distance } else { -distance }
}

fn distance_to_segment(point: DVec2, a: DVec2, b: DVec2) -> f64 {
    let edge = b - a;
    let length_squared = edge.length_squared();
    let along = if length_squared > 0.0 {
        ((point - a).dot(edge) / length_squared).clamp(0.0, 1.0)
    } else {
        0.0
    };
    point.distance(a + edge * along)
}

/// Distance in mm at which a ray (unit direction) first meets the contour.
pub fn ray(contour: &[DVec2], origin: DVec2, direction: DVec2) -> Option<f64> {
    edges(contour)
        .filter_map(|[a, b]| {
            let edge = b - a;
            let determinant = direction.perp_dot(edge);
            let along_ray = (a - origin).perp_dot(edge) / determinant;
            let along_edge = (a - origin).perp_dot(direction) / determinant;
            (determinant != 0.0 && along_ray >= 0.0 && (0.0..=1.0).contains(&along_edge)).then_some(along_ray)
        })
        .min_by(f64::total_cmp)
}

/// Two edges that meet, and where.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Meeting {
    /// The edge of the first contour.
    pub first: usize,
    /// The edge of the second contour (of the same one, for [`self_crossing`]).
    pub second: usize,
    /// A common point, mm.
    pub point: DVec2,
}

/// The first place where a contour crosses, touches or doubles back on itself.
pub fn self_crossing(contour: &[DVec2]) -> Option<Meeting> {
    let count = contour.len();
    let tagged: Vec<Edge> = edges(contour)
        .enumerate()
        .map(|(index, ends)| Edge {
            ends,
            index,
            second: false,
        })
        .collect();
    sweep(tagged, |one, other| {
        let [a, b] = one.ends;
        let [c, d] = other.ends;
        if (one.index + 1) % count == other.index {
            doubles_back(a, b, d).then_some(b)
        } else if (other.index + 1) % count == one.index {
            doubles_back(c, d, b).then_some(d)
        } else {
            meeting_point(a, b, c, d)
        }
    })
}

/// The first place where two contours cross or touch.
pub fn first_meeting(first: &[DVec2], second: &[DVec2]) -> Option<Meeting> {
    let tagged = |contour: &[DVec2], second| -> Vec<Edge> {
        edges(contour)
            .enumerate()
            .map(|(index, ends)| Edge { ends, index, second })
            .collect()
    };
    let mut all = tagged(first, false);
    all.extend(tagged(second, true));
    sweep(all, |one, other| {
        if one.second == other.second {
            return None;
        }
        meeting_point(one.ends[0], one.ends[1], other.ends[0], other.ends[1])
    })
}

struct Edge {
    ends: [DVec2; 2],
    index: usize,
    second: bool,
}

/// Tries every pair of edges whose boxes overlap, by rising x; the smallest pair of indices that `meet` accepts wins.
fn sweep(mut all: Vec<Edge>, meet: impl Fn(&Edge, &Edge) -> Option<DVec2>) -> Option<Meeting> {
    let low = |edge: &Edge| edge.ends[0].min(edge.ends[1]);
    let high = |edge: &Edge| edge.ends[0].max(edge.ends[1]);
    all.sort_by(|one, other| low(one).x.total_cmp(&low(other).x));
    let mut found: Option<Meeting> = None;
    for (place, one) in all.iter().enumerate() {
        for other in all[place + 1..].iter().take_while(|other| low(other).x <= high(one).x) {
            if low(one).y > high(other).y || low(other).y > high(one).y {
                continue;
            }
            let Some(point) = meet(one, other) else { continue };
            // For two contours the first one's edge comes first; within one contour, the smaller index.
            let (one, other) = if (other.second, other.index) < (one.second, one.index) {
                (other, one)
            } else {
                (one, other)
            };
            let meeting = Meeting {
                first: one.index,
                second: other.index,
                point,
            };
            if found.is_none_or(|best| (meeting.first, meeting.second) < (best.first, best.second)) {
                found = Some(meeting);
            }
        }
    }
    found
}

/// Whether the path a, b, c turns back over its own first edge.
fn doubles_back(a: DVec2, b: DVec2, c: DVec2) -> bool {
    (b - a).perp_dot(c - b) == 0.0 && (b - a).dot(c - b) < 0.0
}

/// A point that the closed segments ab and cd share.
fn meeting_point(a: DVec2, b: DVec2, c: DVec2, d: DVec2) -> Option<DVec2> {
    let side = |p: DVec2, q: DVec2, r: DVec2| {
        let turn = (q - p).perp_dot(r - p);
        if turn == 0.0 { 0.0 } else { turn.signum() }
    };
    let between = |p: DVec2, q: DVec2, r: DVec2| {
        let [low, high] = [p.min(q), p.max(q)];
        low.cmple(r).all() && r.cmple(high).all()
    };
    let (c_side, d_side) = (side(a, b, c), side(a, b, d));
    let (a_side, b_side) = (side(c, d, a), side(c, d, b));
    if c_side * d_side < 0.0 && a_side * b_side < 0.0 {
        let along = (c - a).perp_dot(d - c) / (b - a).perp_dot(d - c);
        return Some(a + (b - a) * along);
    }
    [
        (c_side, a, b, c),
        (d_side, a, b, d),
        (a_side, c, d, a),
        (b_side, c, d, b),
    ]
    .into_iter()
    .find(|&(side, p, q, r)| side == 0.0 && between(p, q, r))
    .map(|(_, _, _, r)| r)
}

/// A circle that lies inside a contour.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Inscribed {
    /// Centre, mm.
    pub centre: DVec2,
    /// Radius, mm; not positive when no room was found.
    pub radius_mm: f64,
}

/// The largest circle inside a contour, to about 1 % of the contour's width (the "pole of inaccessibility", found by
/// halving the most promising square; at most some thousand squares are looked at).
pub fn inscribed(contour: &[DVec2]) -> Inscribed {
    const MAX_SQUARES: usize = 2000;
    let [low, high] = bounds(contour);
    let size = high - low;
    let precision = 0.01 * size.min_element();
    let square = |centre: DVec2, half: f64| {
        let radius_mm = clearance(contour, centre);
        Square {
            centre,
            half,
            radius_mm,
            bound: radius_mm + half * std::f64::consts::SQRT_2,
        }
    };
    let centre = centroid(contour);
    let mut best = Inscribed {
        centre,
        radius_mm: clearance(contour, centre),
    };
    let mut heap = BinaryHeap::from([square((low + high) / 2.0, 0.5 * size.max_element())]);
    for _ in 0..MAX_SQUARES {
        let Some(candidate) = heap.pop() else { break };
        if candidate.radius_mm > best.radius_mm {
            best = Inscribed {
                centre: candidate.centre,
                radius_mm: candidate.radius_mm,
            };
        }
        if candidate.bound - best.radius_mm <= precision {
            break;
        }
        let half = 0.5 * candidate.half;
        for (x, y) in [(-half, -half), (half, -half), (-half, half), (half, half)] {
            heap.push(square(candidate.centre + DVec2::new(x, y), half));
        }
    }
    best
}

/// A square of the search in [`inscribed`]; the heap yields the one whose best point could be best.
struct Square {
    centre: DVec2,
    half: f64,
    radius_mm: f64,
    bound: f64,
}

impl Ord for Square {
    fn cmp(&self, other: &Self) -> Ordering {
        self.bound
            .total_cmp(&other.bound)
            .then(other.centre.x.total_cmp(&self.centre.x))
            .then(other.centre.y.total_cmp(&self.centre.y))
    }
}

impl PartialOrd for Square {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl PartialEq for Square {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other) == Ordering::Equal
    }
}

impl Eq for Square {}

#[cfg(test)]
mod tests {
    use super::*;

    fn polygon(corners: &[(f64, f64)]) -> Vec<DVec2> {
        corners.iter().map(|&(x, y)| DVec2::new(x, y)).collect()
    }

    fn circle(radius: f64, corners: usize) -> Vec<DVec2> {
        (0..corners)
            .map(|corner| radius * DVec2::from_angle(std::f64::consts::TAU * corner as f64 / corners as f64))
            .collect()
    }

    #[test]
    fn reversing_a_contour_changes_the_sign_of_its_area_and_nothing_else() {
        let contour = polygon(&[(1.0, 1.0), (5.0, 0.0), (6.0, 4.0), (2.0, 7.0)]);
        let reversed: Vec<DVec2> = contour.iter().rev().copied().collect();
        assert!((signed_area(&contour) + signed_area(&reversed)).abs() < 1e-12);
        assert!(centroid(&contour).distance(centroid(&reversed)) < 1e-12);
        assert!((perimeter(&contour) - perimeter(&reversed)).abs() < 1e-12);
        assert!(signed_area(&ensure_ccw(reversed)) > 0.0);
    }

    #[test]
    fn the_centroid_moves_with_the_contour_however_far() {
        let contour = polygon(&[(0.0, 0.0), (4.0, 0.0), (4.0, 2.0), (0.0, 2.0)]);
        let shift = DVec2::new(9000.0, -7000.0);
        let moved: Vec<DVec2> = contour.iter().map(|&corner| corner + shift).collect();
        assert!(centroid(&contour).distance(DVec2::new(2.0, 1.0)) < 1e-12);
        assert!(centroid(&moved).distance(shift + DVec2::new(2.0, 1.0)) < 1e-8);
    }

    #[test]
    fn clearance_in_a_circle_is_radius_less_distance() {
        let contour = circle(10.0, 720);
        for (x, expected) in [(0.0, 10.0), (7.0, 3.0), (-9.5, 0.5), (13.0, -3.0)] {
            assert!((clearance(&contour, DVec2::new(x, 0.0)) - expected).abs() < 1e-3, "{x}");
        }
    }

    #[test]
    fn a_ray_stops_at_the_first_wall() {
        let notched = polygon(&[
            (0.0, 0.0),
            (10.0, 0.0),
            (10.0, 10.0),
            (6.0, 10.0),
            (5.0, 2.0),
            (4.0, 10.0),
            (0.0, 10.0),
        ]);
        let distance = ray(&notched, DVec2::new(1.0, 6.0), DVec2::X).unwrap();
        assert!((distance - 3.5).abs() < 1e-12, "{distance}");
        assert_eq!(ray(&notched, DVec2::new(11.0, 5.0), DVec2::X), None);
    }

    #[test]
    fn a_figure_of_eight_crosses_itself_and_a_notch_does_not() {
        let eight = polygon(&[(0.0, 0.0), (4.0, 4.0), (4.0, 0.0), (0.0, 4.0)]);
        let meeting = self_crossing(&eight).unwrap();
        assert_eq!((meeting.first, meeting.second), (0, 2));
        assert!(meeting.point.distance(DVec2::new(2.0, 2.0)) < 1e-12);
        let notch = polygon(&[(0.0, 0.0), (4.0, 0.0), (4.0, 4.0), (2.0, 0.1), (0.0, 4.0)]);
        assert_eq!(self_crossing(&notch), None);
    }

    #[test]
    fn touching_and_doubling_back_count_as_crossing() {
        let touching = polygon(&[(0.0, 0.0), (4.0, 0.0), (4.0, 4.0), (2.0, 0.0), (0.0, 4.0)]);
        assert!(self_crossing(&touching).is_some());
        let spike = polygon(&[(0.0, 0.0), (4.0, 0.0), (6.0, 0.0), (4.0, 0.0), (4.0, 4.0)]);
        assert!(self_crossing(&spike).is_some());
    }

    #[test]
    fn nested_circles_do_not_meet_and_shifted_ones_do() {
        let (large, small) = (circle(10.0, 60), circle(3.0, 40));
        assert_eq!(first_meeting(&large, &small), None);
        let shifted: Vec<DVec2> = small.iter().map(|&corner| corner + DVec2::new(8.0, 0.0)).collect();
        assert!(first_meeting(&large, &shifted).is_some());
    }

    #[test]
    fn the_largest_circle_in_a_rectangle_is_half_its_width() {
        let rectangle = polygon(&[(0.0, 0.0), (30.0, 0.0), (30.0, 10.0), (0.0, 10.0)]);
        let found = inscribed(&rectangle);
        assert!((found.radius_mm - 5.0).abs() < 0.11, "{found:?}");
    }

    #[test]
    fn the_largest_circle_of_a_crescent_lies_inside_it() {
        let mut crescent: Vec<DVec2> = circle(10.0, 40)[..21].to_vec();
        crescent.extend(
            circle(7.0, 40)[..21]
                .iter()
                .rev()
                .map(|&corner| corner - DVec2::new(0.0, 1.0)),
        );
        let found = inscribed(&crescent);
        assert!(found.radius_mm > 1.0 && contains(&crescent, found.centre), "{found:?}");
    }
}
