//! How much of a pentahedron is kept.
//!
//! Every sub-prism is three tetrahedra. The value is linear in a tetrahedron, and the share of it that is positive exact.
//! The diagonals go through the lowest value on each quadrilateral: what tools take is round or has edges outwards, and
//! so the least of it is lost between the points. Shares are taken of the prisms' volumes at rest, scaled so that a
//! pentahedron's prisms sum to [`wedge::volume`].
//!
//! [`wedge::volume`]: resecta_anatomy::wedge::volume

use glam::{DMat4, DVec3};

use crate::mesh::Mesh;
use crate::points::Points;

/// What is counted at least of a pentahedron of which not all is removed: rounding shall not empty it.
const LEAST_SHARE: f64 = 1e-9;

/// The three tetrahedra of a prism whose corners have these keys.
///
/// All go through the corner with the smallest key: to the triangle that it is not in, and to the two halves of the
/// quadrilateral that it is not in. On the other two quadrilaterals the diagonals then begin at it.
pub fn tetrahedra<K: PartialOrd + Copy>(keys: [K; 6]) -> [[usize; 4]; 3] {
    let smaller = |a: usize, b: usize| if keys[b] < keys[a] { b } else { a };
    let top = (1..6).fold(0, smaller);
    let opposite = 3 - top / 3 * 3;
    let (q, w) = ((top + 1) % 3, (top + 2) % 3);
    let [second, third] = if keys[smaller(q, w + 3)] < keys[smaller(w, q + 3)] {
        [[top, q, w, w + 3], [top, q, w + 3, q + 3]]
    } else {
        [[top, q, w, q + 3], [top, w, w + 3, q + 3]]
    };
    [[top, opposite, opposite + 1, opposite + 2], second, third]
}

/// Share of a tetrahedron in which the linear function with these corner values is positive.
pub fn kept_share(v: [f64; 4]) -> f64 {
    let along = |from: f64, to: f64| from / (from - to);
    // Of the corner n alone beside the three others.
    let tip = |n: usize| (1..4).map(|other| along(v[n], v[(n + other) % 4])).product::<f64>();
    let positive = v.map(|value| value > 0.0);
    let only = |sign: bool| positive.iter().position(|&positive| positive == sign).unwrap_or(0);
    match positive.iter().filter(|&&positive| positive).count() {
        0 => 0.0,
        1 => tip(only(true)),
        2 => {
            let (a, c) = (only(true), only(false));
            let b = 3 - (0..4).rev().position(|n| positive[n]).unwrap_or(0);
            let d = 3 - (0..4).rev().position(|n| !positive[n]).unwrap_or(0);
            let [ac, ad, bc, bd] = [[a, c], [a, d], [b, c], [b, d]].map(|[from, to]| along(v[from], v[to]));
            ac * ad + bc * bd * (1.0 - ad) + bc * ad * (1.0 - ac)
        }
        3 => 1.0 - tip(only(false)),
        _ => 1.0,
    }
}

/// The part of a tetrahedron in which the linear function with these corner values is positive, as tetrahedra whose
/// corners are given by their weights.
pub fn kept_parts(values: [f64; 4]) -> Vec<[[f64; 4]; 4]> {
    let mut order = [0, 1, 2, 3];
    order.sort_by(|&a, &b| values[b].total_cmp(&values[a]));
    let corner = |n: usize| std::array::from_fn(|other| f64::from(u8::from(other == order[n])));
    let cross = |from: usize, to: usize| {
        let (from, to) = (order[from], order[to]);
        let share = values[from] / (values[from] - values[to]);
        let mut weights = [0.0; 4];
        (weights[from], weights[to]) = (1.0 - share, share);
        weights
    };
    match values.iter().filter(|&&value| value > 0.0).count() {
        0 => Vec::new(),
        1 => vec![[corner(0), cross(0, 1), cross(0, 2), cross(0, 3)]],
        // The roof between the edge (0, 1) and its four crossings.
        2 => vec![
            [corner(0), cross(0, 2), cross(0, 3), corner(1)],
            [corner(1), cross(1, 2), cross(1, 3), cross(0, 3)],
            [corner(1), cross(0, 2), cross(0, 3), cross(1, 2)],
        ],
        // The frustum below the last corner.
        3 => vec![
            [corner(0), corner(1), corner(2), cross(0, 3)],
            [corner(1), corner(2), cross(0, 3), cross(1, 3)],
            [corner(2), cross(0, 3), cross(1, 3), cross(2, 3)],
        ],
        _ => vec![[corner(0), corner(1), corner(2), corner(3)]],
    }
}

/// Share of a tetrahedron that a part of it takes.
pub fn share(part: &[[f64; 4]; 4]) -> f64 {
    DMat4::from_cols_array_2d(part).determinant().abs()
}

pub fn tetrahedron_volume([a, b, c, d]: [DVec3; 4]) -> f64 {
    ((b - a).cross(c - a).dot(d - a) / 6.0).abs()
}

/// Volume of a prism whose quadrilaterals are ruled surfaces.
pub fn prism_volume([a, b, c, d, e, f]: [DVec3; 6]) -> f64 {
    let axis = (d + e + f - a - b - c) / 3.0;
    let (u, v, x, y) = (b - a, c - a, e - d, f - d);
    let areas = 2.0 * (u.cross(v) + x.cross(y)) + u.cross(y) + x.cross(v);
    (areas.dot(axis) / 12.0).abs()
}

/// Sum of the volumes of a pentahedron's prisms at rest.
pub fn prisms_mm3(mesh: &Mesh, pentahedron: u32) -> f64 {
    let shape = mesh.rest_shape(pentahedron);
    let sub = mesh.sub(pentahedron);
    let places: Vec<DVec3> = sub.places.iter().map(|&place| shape.at(place)).collect();
    (sub.prisms.iter())
        .map(|prism| prism_volume(prism.map(|corner| places[corner as usize])))
        .sum()
}

/// Share of a prism in which the value is not positive.
fn removed_share(place: [DVec3; 6], values: [f32; 6]) -> f64 {
    let (mut removed, mut sum) = (0.0, 0.0);
    for tetrahedron in tetrahedra(values) {
        let volume = tetrahedron_volume(tetrahedron.map(|corner| place[corner]));
        removed += volume * (1.0 - kept_share(tetrahedron.map(|corner| f64::from(values[corner]))));
        sum += volume;
    }
    if sum > 0.0 { removed / sum } else { 1.0 }
}

/// Sets the cell's kept volume from the values. Sub-prisms of which no point has at least the mark `changed` are as
/// they were.
pub fn measure(mesh: &Mesh, points: &mut Points, pentahedron: u32, changed: u32) {
    let Some(index) = points.index(pentahedron) else {
        return;
    };
    let (cell, values, marks) = points.cell_and_values(index);
    let local: Vec<(f32, bool)> = (cell.points.iter())
        .map(|&point| (values[point as usize], marks[point as usize] >= changed))
        .collect();
    if local.iter().all(|&(value, _)| value > 0.0) {
        return;
    }
    if local.iter().all(|&(value, _)| value <= 0.0) {
        cell.kept_mm3 = 0.0;
        return;
    }
    let shape = mesh.rest_shape(pentahedron);
    let sub = mesh.sub(pentahedron);
    for (prism, removed) in sub.prisms.iter().zip(&mut cell.removed_mm3) {
        let corners = prism.map(|corner| local[corner as usize]);
        let is_whole = corners.iter().all(|&(value, _)| value > 0.0);
        if is_whole || !corners.iter().any(|&(_, is_changed)| is_changed) {
            continue;
        }
        let place = prism.map(|corner| shape.at(sub.places[corner as usize]));
        let values = corners.map(|(value, _)| value);
        let share = if values.iter().all(|&value| value <= 0.0) {
            1.0
        } else {
            removed_share(place, values)
        };
        *removed = (share * prism_volume(place)) as f32;
    }
    let removed: f64 = cell.removed_mm3.iter().map(|&removed| f64::from(removed)).sum();
    let rest = mesh.rest_volumes[pentahedron as usize];
    let kept = rest * (1.0 - removed / cell.prisms_mm3);
    // Values only fall, so what rounding would give back is not given; and where a point is kept, so is something.
    cell.kept_mm3 = kept.clamp((LEAST_SHARE * rest).min(cell.kept_mm3), cell.kept_mm3);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_tetrahedra_fill_the_prism_for_every_order_of_its_corners() {
        let corners: [DVec3; 6] = std::array::from_fn(|n| {
            let (x, y) = [(0.0, 0.0), (1.0, 0.0), (0.0, 1.0)][n % 3];
            DVec3::new(x, y, (n / 3) as f64 * 2.0)
        });
        let mut points: [u32; 6] = std::array::from_fn(|n| n as u32);
        for swaps in 0..720 {
            // Orders by the factorial number system.
            let mut rest = swaps;
            points.sort_unstable();
            for place in 0..6 {
                points.swap(place, place + rest % (6 - place));
                rest /= 6 - place;
            }
            let sum: f64 = (tetrahedra(points).iter())
                .map(|tetrahedron| tetrahedron_volume(tetrahedron.map(|corner| corners[corner])))
                .sum();
            assert!((sum - 1.0).abs() < 1e-12, "{points:?}: {sum}");
        }
    }

    #[test]
    fn a_prism_has_the_volume_of_its_tetrahedra_where_its_faces_are_flat() {
        let corners: [DVec3; 6] = std::array::from_fn(|n| {
            let (x, y) = [(0.3, 0.0), (1.0, 0.4), (0.0, 1.2)][n % 3];
            DVec3::new(x, y, (n / 3) as f64 * (2.0 + 0.3 * x - 0.1 * y))
        });
        let sum: f64 = (tetrahedra([0, 1, 2, 3, 4, 5]).iter())
            .map(|tetrahedron| tetrahedron_volume(tetrahedron.map(|corner| corners[corner])))
            .sum();
        assert!((sum - prism_volume(corners)).abs() < 1e-12, "{sum}");
    }

    #[test]
    fn a_plane_leaves_the_share_it_should() {
        // In the unit tetrahedron x + y + z < c holds c³.
        for c in [0.1, 0.5, 0.9] {
            assert!((kept_share([c, c - 1.0, c - 1.0, c - 1.0]) - c.powi(3)).abs() < 1e-12);
            assert!((kept_share([-c, 1.0 - c, 1.0 - c, 1.0 - c]) - 1.0 + c.powi(3)).abs() < 1e-12);
        }
        // x + y < c leaves 3 c² - 2 c³.
        for c in [0.1, 0.5, 0.9] {
            let share = kept_share([c, c - 1.0, c - 1.0, c]);
            assert!((share - 3.0 * c * c + 2.0 * c.powi(3)).abs() < 1e-12, "{share}");
        }
    }

    #[test]
    fn the_parts_have_the_share() {
        for n in 1..15 {
            let values = std::array::from_fn(|corner| {
                let size = 0.1 + 0.37 * ((n * 7 + corner * 3) % 5) as f64;
                if n >> corner & 1 == 1 { size } else { -size }
            });
            let sum: f64 = kept_parts(values).iter().map(share).sum();
            assert!((sum - kept_share(values)).abs() < 1e-12, "{values:?}: {sum}");
        }
    }
}
