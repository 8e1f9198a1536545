//! How much of a pentahedron is kept.
//!
//! Every sub-prism is three tetrahedra. The value is linear in a tetrahedron, and the share of it that is positive exact.
//! The diagonals go through the lowest value on each quadrilateral: what tools take is round or has edges outwards, and
//! so the least of it is lost between the points. Shares are taken of the prisms' volumes at rest, scaled so that a
//! pentahedron's prisms sum to [`wedge::volume`].
//!
//! [`wedge::volume`]: resecta_anatomy::wedge::volume

use glam::DVec3;

use crate::field::Edit;
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
pub fn kept_share(values: [f64; 4]) -> f64 {
    // The positive ones first.
    let mut v = [0.0; 4];
    let mut count = 0;
    let mut last = 4;
    for value in values {
        if value > 0.0 {
            v[count] = value;
            count += 1;
        } else {
            last -= 1;
            v[last] = value;
        }
    }
    let along = |from: usize, to: usize| v[from] / (v[from] - v[to]);
    match count {
        0 => 0.0,
        1 => along(0, 1) * along(0, 2) * along(0, 3),
        2 => {
            let (ac, ad, bc, bd) = (along(0, 2), along(0, 3), along(1, 2), along(1, 3));
            ac * ad + bc * bd * (1.0 - ad) + bc * ad * (1.0 - ac)
        }
        3 => 1.0 - along(3, 0) * along(3, 1) * along(3, 2),
        _ => 1.0,
    }
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
    (sub.prisms())
        .map(|prism| prism_volume(prism.map(|corner| places[corner as usize])))
        .sum()
}

/// Share of a prism in which the value is not positive.
fn removed_share(place: &[DVec3; 6], values: &[f32; 6]) -> f64 {
    let (mut removed, mut sum) = (0.0, 0.0);
    for [a, b, c, d] in tetrahedra(*values) {
        let volume = tetrahedron_volume([place[a], place[b], place[c], place[d]]);
        let kept = kept_share([values[a], values[b], values[c], values[d]].map(f64::from));
        removed += volume * (1.0 - kept);
        sum += volume;
    }
    if sum > 0.0 { removed / sum } else { 1.0 }
}

/// Rest volume of the part of a touched pentahedron in which the value is positive, mm³, by its values alone. The diagonals go through the
/// highest value: a chip is round, or has edges outwards.
pub fn positive_mm3(mesh: &Mesh, points: &Points, pentahedron: u32) -> f64 {
    let Some(cell) = points.cell(pentahedron) else {
        return 0.0;
    };
    let shape = mesh.rest_shape(pentahedron);
    let sub = mesh.sub(pentahedron);
    let mut positive = 0.0;
    for prism in sub.prisms() {
        let below = prism.map(|corner| -points.values[cell.points[corner as usize] as usize]);
        if below.iter().all(|&below| below >= 0.0) {
            continue;
        }
        let place = prism.map(|corner| shape.at(sub.places[corner as usize]));
        positive += removed_share(&place, &below) * prism_volume(place);
    }
    mesh.rest_volumes[pentahedron as usize] * positive / cell.prisms_mm3
}

/// Sets the cell's kept volume from the values. Sub-prisms of which the edit changed no point are as they were.
pub fn measure(mesh: &Mesh, points: &mut Points, pentahedron: u32, edit: &Edit) {
    let Some(index) = points.index(pentahedron) else {
        return;
    };
    let (cell, values, marks) = points.cell_and_values(index);
    let (mut local, mut kept) = (Vec::with_capacity(cell.points.len()), 0);
    for &point in &cell.points {
        let (value, mark) = (values[point as usize], marks[point as usize]);
        kept += usize::from(value > 0.0);
        local.push((value, mark));
    }
    if kept == local.len() {
        return;
    }
    if kept == 0 {
        cell.kept_mm3 = 0.0;
        return;
    }
    let shape = mesh.rest_shape(pentahedron);
    let sub = mesh.sub(pentahedron);
    for (prism, removed) in sub.prisms().zip(&mut cell.removed_mm3) {
        let (mut positive, mut mark) = (0, 0);
        let mut values = [0.0; 6];
        for (value, &corner) in values.iter_mut().zip(&prism) {
            let (its, when) = local[corner as usize];
            *value = its;
            positive += u32::from(its > 0.0);
            mark = when.max(mark);
        }
        // What was gone already stays so.
        let least = if positive == 0 { edit.turned() } else { edit.changed() };
        if mark < least || positive == 6 {
            continue;
        }
        let mut place = [DVec3::ZERO; 6];
        for (place, &corner) in place.iter_mut().zip(&prism) {
            *place = shape.at(sub.places[corner as usize]);
        }
        let share = if positive == 0 {
            1.0
        } else {
            removed_share(&place, &values)
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
}
