//! How much of the capsule a pentahedron still carries.
//!
//! A quadrilateral of the sub-lattice is cut through its lowest value, as the tetrahedra behind it are (`volume.rs`): area
//! and volume are of one body. Shares are taken of the area that does not depend on the cut, half the cross product of
//! the diagonals, so that a curved capsule that nothing reached loses nothing.

use glam::DVec3;

use crate::mesh::Mesh;
use crate::points::Points;
use crate::shape::Shape;
use crate::sublattice::{FACES, Sublattice, face_corners};
use crate::surface::SurfaceKind;

/// The capsule of an uncut pentahedron, mm² at rest.
pub fn rest_mm2(mesh: &Mesh, pentahedron: u32) -> f64 {
    kept_mm2(mesh, pentahedron, |_| 1.0)
}

/// Sets the cell's kept capsule from the values; returns by how much it fell, mm² at rest.
pub fn measure(mesh: &Mesh, points: &mut Points, pentahedron: u32) -> f64 {
    let Some(index) = points.index(pentahedron) else {
        return 0.0;
    };
    let (cell, values, _) = points.cell_and_values(index);
    if cell.capsule_mm2 == 0.0 {
        return 0.0;
    }
    let before = cell.capsule_mm2;
    let now = kept_mm2(mesh, pentahedron, |local| values[cell.points[local as usize] as usize]);
    // Values only fall, so what a diagonal that turns would give back is not given.
    cell.capsule_mm2 = now.min(before);
    before - cell.capsule_mm2
}

/// Area at rest of a pentahedron's capsule on which the value, by local point, is positive, mm².
fn kept_mm2(mesh: &Mesh, pentahedron: u32, value: impl Fn(u32) -> f32) -> f64 {
    let is_capsule: [bool; FACES] = std::array::from_fn(|face| {
        mesh.is_exposed(pentahedron, face) && mesh.kind(pentahedron, face) == SurfaceKind::Capsule
    });
    if is_capsule == [false; FACES] {
        return 0.0;
    }
    let (sub, shape) = (mesh.sub(pentahedron), mesh.rest_shape(pentahedron));
    (sub.boundary.iter())
        .filter(|cell| is_capsule[cell.face()])
        .map(|cell| {
            let prism = sub.prism(cell.prism());
            let corner = |n: usize| prism[face_corners(cell.face())[n]];
            if cell.face() < 2 {
                let triangle = [0, 1, 2].map(corner);
                kept_share(triangle.map(&value)) * area(&shape, sub, triangle)
            } else {
                kept_of_quad(&shape, sub, [0, 1, 2, 3].map(corner), &value)
            }
        })
        .sum()
}

fn kept_of_quad(shape: &Shape, sub: &Sublattice, corners: [u32; 4], value: impl Fn(u32) -> f32) -> f64 {
    let [a, b, c, d] = corners.map(|corner| shape.at(sub.places[corner as usize]));
    let whole = 0.5 * (c - a).cross(d - b).length();
    let values = corners.map(&value);
    if values.iter().all(|&value| value > 0.0) {
        return whole;
    }
    let lowest = (1..4).fold(0, |low, n| if values[n] < values[low] { n } else { low });
    let at = |n: usize| (lowest + n) % 4;
    let (mut kept, mut sum) = (0.0, 0.0);
    for triangle in [[at(0), at(1), at(2)], [at(0), at(2), at(3)]] {
        let area = area(shape, sub, triangle.map(|n| corners[n]));
        kept += kept_share(triangle.map(|n| values[n])) * area;
        sum += area;
    }
    if sum > 0.0 { whole * kept / sum } else { 0.0 }
}

/// Area of a triangle of local points at rest, mm².
fn area(shape: &Shape, sub: &Sublattice, triangle: [u32; 3]) -> f64 {
    let [a, b, c]: [DVec3; 3] = triangle.map(|corner| shape.at(sub.places[corner as usize]));
    0.5 * (b - a).cross(c - a).length()
}

/// Share of a triangle in which the linear function with these corner values is positive.
fn kept_share(values: [f32; 3]) -> f64 {
    let positive = values.map(|value| value > 0.0);
    let count = positive.iter().filter(|&&positive| positive).count();
    if count == 0 || count == 3 {
        return (count / 3) as f64;
    }
    // The one that is alone on its side.
    let alone = positive.iter().position(|&its| its == (count == 1)).unwrap_or(0);
    let [from, b, c] = [0, 1, 2].map(|n| f64::from(values[(alone + n) % 3]));
    let corner = from / (from - b) * (from / (from - c));
    if count == 1 { corner } else { 1.0 - corner }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_leaves_the_share_it_should() {
        // In the unit triangle x + y < c holds c².
        for c in [0.1_f32, 0.5, 0.9] {
            let exact = f64::from(c).powi(2);
            for turn in 0..3 {
                let mut values = [c, c - 1.0, c - 1.0];
                values.rotate_left(turn);
                assert!((kept_share(values) - exact).abs() < 1e-6, "{values:?}");
                assert!(
                    (kept_share(values.map(|value| -value)) + exact - 1.0).abs() < 1e-6,
                    "{values:?}"
                );
            }
        }
        assert_eq!([kept_share([1.0; 3]), kept_share([0.0; 3])], [1.0, 0.0]);
    }
}
