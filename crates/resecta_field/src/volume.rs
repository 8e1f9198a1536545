//! How much of a pentahedron is kept.
//!
//! Every sub-prism is three tetrahedra, cut along the diagonals through the smallest number on each quadrilateral, so
//! all prisms around a face cut it alike. The value is linear in a tetrahedron, and the share of it that is positive
//! exact. Shares are taken of the volumes at rest, scaled so that a pentahedron's tetrahedra sum to [`wedge::volume`].
//!
//! [`wedge::volume`]: resecta_anatomy::wedge::volume

use glam::{DMat4, DVec3};

use crate::mesh::Mesh;
use crate::points::Cell;
use crate::sublattice::Sublattice;

/// The three tetrahedra of a prism whose corners have these numbers.
///
/// All go through the corner with the smallest number: to the triangle that it is not in, and to the two halves of the
/// quadrilateral that it is not in. On the other two quadrilaterals the diagonals then begin at it.
pub fn tetrahedra(points: [u32; 6]) -> [[usize; 4]; 3] {
    let top = (0..6).min_by_key(|&corner| points[corner]).unwrap_or(0);
    let opposite = 3 - top / 3 * 3;
    let (q, w) = ((top + 1) % 3, (top + 2) % 3);
    let [second, third] = if points[q].min(points[w + 3]) < points[w].min(points[q + 3]) {
        [[top, q, w, w + 3], [top, q, w + 3, q + 3]]
    } else {
        [[top, q, w, q + 3], [top, w, w + 3, q + 3]]
    };
    [[top, opposite, opposite + 1, opposite + 2], second, third]
}

/// Share of a tetrahedron in which the linear function with these corner values is positive.
pub fn kept_share(values: [f64; 4]) -> f64 {
    let mut v = values;
    v.sort_unstable_by(|a, b| b.total_cmp(a));
    let along = |from: f64, to: f64| from / (from - to);
    match v.iter().filter(|&&value| value > 0.0).count() {
        0 => 0.0,
        1 => along(v[0], v[1]) * along(v[0], v[2]) * along(v[0], v[3]),
        2 => {
            let [ac, ad, bc, bd] = [
                along(v[0], v[2]),
                along(v[0], v[3]),
                along(v[1], v[2]),
                along(v[1], v[3]),
            ];
            ac * ad + bc * bd * (1.0 - ad) + bc * ad * (1.0 - ac)
        }
        3 => 1.0 - along(v[3], v[0]) * along(v[3], v[1]) * along(v[3], v[2]),
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

/// Sum of the volumes of a pentahedron's tetrahedra at rest.
pub fn tetrahedra_mm3(mesh: &Mesh, sub: &Sublattice, pentahedron: u32, points: &[u32]) -> f64 {
    let shape = mesh.rest_shape(pentahedron);
    let places: Vec<DVec3> = sub.places.iter().map(|&place| shape.at(place)).collect();
    (sub.prisms.iter())
        .flat_map(|prism| {
            let place = prism.map(|corner| places[corner as usize]);
            let split = tetrahedra(prism.map(|corner| points[corner as usize]));
            split.map(|tetrahedron| tetrahedron_volume(tetrahedron.map(|corner| place[corner])))
        })
        .sum()
}

/// Sets the cell's kept volume from the values.
pub fn measure(mesh: &Mesh, sub: &Sublattice, pentahedron: u32, cell: &mut Cell, values: &[f32]) {
    let local: Vec<f32> = cell.points.iter().map(|&point| values[point as usize]).collect();
    if local.iter().all(|&value| value > 0.0) {
        return;
    }
    if local.iter().all(|&value| value <= 0.0) {
        cell.kept_mm3 = 0.0;
        return;
    }
    let shape = mesh.rest_shape(pentahedron);
    let mut removed = 0.0;
    for prism in &sub.prisms {
        let value = prism.map(|corner| f64::from(local[corner as usize]));
        if value.iter().all(|&value| value > 0.0) {
            continue;
        }
        let place = prism.map(|corner| shape.at(sub.places[corner as usize]));
        for tetrahedron in tetrahedra(prism.map(|corner| cell.points[corner as usize])) {
            let share = 1.0 - kept_share(tetrahedron.map(|corner| value[corner]));
            removed += share * tetrahedron_volume(tetrahedron.map(|corner| place[corner]));
        }
    }
    let kept = mesh.rest_volumes[pentahedron as usize] * (1.0 - removed / cell.tetrahedra_mm3);
    // Values only fall, so what rounding would give back is not given.
    cell.kept_mm3 = kept.clamp(0.0, cell.kept_mm3);
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
