//! Radial sampling of contours: a centre per slice, and a radius per ray.
//!
//! A contour need not be seen wholly from any point (notches, a concave posterior side), so "where the ray meets the
//! contour" may have several answers or a misleading one. The radius of a ray is therefore taken from areas: the sector
//! from half a step before to half a step after the ray holds as much area as the part of the contour's inside that lies
//! in it. Sectors add up to the contour, so no area is won or lost at any `alpha`, a notch narrower than a step is spread
//! over its step, and for a smooth contour the radius is that of the ray up to second order in `alpha`.
//!
//! Everything is kept as *squared* radii: half the step times the squared radius is the sector's area, and what is linear
//! in areas (splines along the axis, smoothing) then keeps volume.

use std::f64::consts::TAU;

use glam::DVec2;

use crate::contour::{self, centroid, clearance, signed_area};

/// Share of a contour's area over which one edge's turn from seen to hidden is rounded.
const ROUNDING: f64 = 0.002;

/// Most directions that the search for a centre tries at each step.
const MAX_DIRECTIONS: usize = 64;

/// Unit vector along ray `j` of `angles`.
pub(crate) fn direction(j: usize, angles: usize) -> DVec2 {
    DVec2::from_angle(TAU * j as f64 / angles as f64)
}

/// The edges of a contour as seen from `centre`.
fn edges_from(contour: &[DVec2], centre: DVec2) -> impl Iterator<Item = [DVec2; 2]> {
    contour::edges(contour).map(move |[p, q]| [p - centre, q - centre])
}

/// Squared radius of every ray: that of the sector which holds the contour's area around the ray.
///
/// Signed: a contour that turns back on itself (seen from `centre`) takes area off again. For a simple contour around
/// `centre` all values are positive.
pub(crate) fn squared_radii(contour: &[DVec2], centre: DVec2, angles: usize) -> Vec<f64> {
    let step = TAU / angles as f64;
    let sense = signed_area(contour).signum();
    let mut areas = vec![0.0; angles];
    for [p, q] in edges_from(contour, centre) {
        let turn = p.angle_to(q);
        // Sector `j` reaches from (j - 1/2) to (j + 1/2) steps.
        let start = p.to_angle() / step + 0.5;
        let end = start + turn / step;
        let forward = turn >= 0.0;
        let mut sector = start.floor() as i64;
        let last = end.floor() as i64;
        let mut from = p;
        loop {
            let done = sector == last;
            let to = if done {
                q
            } else {
                let border = DVec2::from_angle((sector as f64 + if forward { 0.5 } else { -0.5 }) * step);
                let (before, after) = (border.perp_dot(p), border.perp_dot(q));
                p.lerp(q, (before / (before - after)).clamp(0.0, 1.0))
            };
            areas[sector.rem_euclid(angles as i64) as usize] += from.perp_dot(to) / 2.0;
            if done {
                break;
            }
            from = to;
            sector += if forward { 1 } else { -1 };
        }
    }
    areas.iter().map(|area| 2.0 * sense * area / step).collect()
}

/// Radius of the outermost crossing of every ray with a contour that need not lie around `centre`; 0 where a ray misses it.
pub(crate) fn outermost_radii(contour: &[DVec2], centre: DVec2, angles: usize) -> Vec<f64> {
    (0..angles)
        .map(|j| {
            crossings(contour, centre, direction(j, angles))
                .into_iter()
                .fold(0.0, f64::max)
        })
        .collect()
}

/// Distances (of either sign) from `centre` along `ray` at which the line crosses the contour.
fn crossings(contour: &[DVec2], centre: DVec2, ray: DVec2) -> Vec<f64> {
    edges_from(contour, centre)
        .filter_map(|[p, q]| {
            let (before, after) = (ray.perp_dot(p), ray.perp_dot(q));
            ((before > 0.0) != (after > 0.0)).then(|| p.lerp(q, before / (before - after)).dot(ray))
        })
        .collect()
}

/// The part of a contour that is seen from behind, as a share of its area: 0 where the contour is seen wholly, that is in
/// the kernel of a star-shaped contour.
///
/// Convex in `centre`, since every edge's triangle has an area linear in it; each edge's hinge is rounded over
/// [`ROUNDING`] so that the best centre is one point and moves smoothly with the contour.
fn hidden_share(contour: &[DVec2], area: f64, centre: DVec2) -> f64 {
    edges_from(contour, centre)
        .map(|[p, q]| match (-p.perp_dot(q) / area).max(0.0) {
            hidden if hidden < ROUNDING => hidden * hidden / (2.0 * ROUNDING),
            hidden => hidden - 0.5 * ROUNDING,
        })
        .sum()
}

/// The centre of the rays in one slice: strictly inside the urethra (`inner`) and, as far as that goes, a point from which
/// both contours are seen wholly.
///
/// Rule: keep a clearance from the urethra's wall of at least half the greatest that was found; there, make the hidden
/// shares of both contours as small as possible, and among equals stay near the urethra's centre of area, so that the
/// centre moves smoothly from slice to slice. The search goes along the directions of the rays with a step that is
/// halved whenever none of them helps, so that turning a case by whole steps turns its centres (up to 64 rays; finer
/// lattices search along 64 directions of their own).
///
/// `None` where the urethra has no inside.
pub(crate) fn choose_centre(outer: &[DVec2], inner: &[DVec2], angles: usize) -> Option<DVec2> {
    let directions = angles.min(MAX_DIRECTIONS);
    let (outer_area, inner_area) = (signed_area(outer), signed_area(inner));
    let radius = (inner_area.abs() / std::f64::consts::PI).sqrt();
    let centre_of_area = centroid(inner);
    let inside = if clearance(inner, centre_of_area) > 0.3 * radius {
        centre_of_area
    } else {
        let start = widest_middle(inner, centre_of_area, directions)?;
        descend(start, radius, directions, |point| -clearance(inner, point))
    };
    let room = clearance(inner, inside);
    if room.is_nan() || room <= 0.0 {
        return None;
    }
    let cost = |point: DVec2| {
        if clearance(inner, point) < 0.5 * room {
            return f64::INFINITY;
        }
        let away = (point - inside).length_squared() / (radius * radius);
        hidden_share(outer, outer_area, point) + hidden_share(inner, inner_area, point) + 0.002 * away
    };
    Some(descend(inside, radius, directions, cost))
}

/// Middle of the longest chord inside the contour among the lines through `point` along the directions.
fn widest_middle(contour: &[DVec2], point: DVec2, directions: usize) -> Option<DVec2> {
    let mut best: Option<(f64, DVec2)> = None;
    for j in 0..directions {
        let ray = direction(j, directions);
        let mut distances = crossings(contour, point, ray);
        distances.sort_by(f64::total_cmp);
        for pair in distances.chunks_exact(2) {
            let width = pair[1] - pair[0];
            if best.is_none_or(|(widest, _)| width > widest) {
                best = Some((width, point + ray * (pair[0] + pair[1]) / 2.0));
            }
        }
    }
    best.map(|(_, middle)| middle)
}

/// Walks downhill along evenly spread directions, from `start` with steps of half `size` down to a millionth of it.
fn descend(start: DVec2, size: f64, directions: usize, cost: impl Fn(DVec2) -> f64) -> DVec2 {
    let mut point = start;
    let mut lowest = cost(point);
    let mut step = 0.5 * size;
    while step > 1e-6 * size {
        let best = (0..directions)
            .map(|j| point + direction(j, directions) * step)
            .map(|candidate| (cost(candidate), candidate))
            .fold(
                (lowest, point),
                |best, other| if other.0 < best.0 { other } else { best },
            );
        // A gain in the last digits is none: without this two equal places could be exchanged for ever.
        if best.0 < lowest - 1e-12 * lowest.abs() - 1e-300 {
            (lowest, point) = best;
        } else {
            step *= 0.5;
        }
    }
    point
}
