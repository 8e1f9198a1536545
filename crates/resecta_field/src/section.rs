//! Sections: what a plane shows of what is kept, for whoever draws an organ cut open.
//!
//! A prism of the sub-lattice is three tetrahedra; in each, place and value are linear. A plane meets a tetrahedron in a
//! triangle or a quadrilateral, and what of it has a positive value is kept.

use glam::{Vec3, Vec4};

use crate::field::Field;

/// The tetrahedra of a prism, as its corners.
const TETRAHEDRA: [[usize; 4]; 3] = [[0, 1, 2, 5], [0, 1, 5, 4], [0, 4, 5, 3]];

/// The plane of the points `x` with `normal · x = offset_mm`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Plane {
    /// Of unit length.
    pub normal: Vec3,
    /// Distance of the plane from the origin along the normal, mm.
    pub offset_mm: f32,
}

impl Plane {
    /// How far a point lies beyond the plane, along the normal, mm.
    pub fn beyond_mm(&self, point: Vec3) -> f32 {
        self.normal.dot(point) - self.offset_mm
    }

    /// The plane's section through a whole pentahedron with its corners at these places, as triangles in either sense.
    pub fn through_whole(&self, corners: [Vec3; 6], found: &mut impl FnMut([Vec3; 3])) {
        through_prism(corners.map(|corner| self.corner(corner.extend(1.0))), found);
    }

    fn corner(&self, point: Vec4) -> Corner {
        (point, self.beyond_mm(point.truncate()))
    }
}

/// The place (xyz) and value (w) of a corner, and how far it lies beyond the plane, mm.
type Corner = (Vec4, f32);

/// What a corner says of its prism's section: it lies beyond the plane, it does not, it is kept.
const AHEAD: u8 = 1;
const BEHIND: u8 = 2;
const KEPT: u8 = 4;

fn sign((place, beyond): &Corner) -> u8 {
    let side = if *beyond > 0.0 { AHEAD } else { BEHIND };
    if place.w > 0.0 { side | KEPT } else { side }
}

/// Of a prism, what is kept of the section.
fn through_prism(corners: [Corner; 6], found: &mut impl FnMut([Vec3; 3])) {
    let ahead = corners.iter().filter(|(_, beyond)| *beyond > 0.0).count();
    // Most prisms of a pentahedron lie on one side.
    if ahead == 0 || ahead == corners.len() {
        return;
    }
    for tetrahedron in TETRAHEDRA {
        through_tetrahedron(tetrahedron.map(|corner| corners[corner]), found);
    }
}

/// Of a tetrahedron, what is kept of the section.
fn through_tetrahedron(mut corners: [Corner; 4], found: &mut impl FnMut([Vec3; 3])) {
    // Those beyond the plane first, each side in its order: the sort is stable, and so short a one allocates nothing.
    corners.sort_by_key(|(_, beyond)| *beyond <= 0.0);
    let ahead = corners.iter().filter(|(_, beyond)| *beyond > 0.0).count();
    let on_edge = |from: usize, to: usize| {
        let ((a, beyond_a), (b, beyond_b)) = (corners[from], corners[to]);
        a.lerp(b, beyond_a / (beyond_a - beyond_b))
    };
    match ahead {
        1 => keep(&[1, 2, 3].map(|other| on_edge(0, other)), found),
        3 => keep(&[0, 1, 2].map(|other| on_edge(3, other)), found),
        2 => keep(&[on_edge(0, 2), on_edge(0, 3), on_edge(1, 3), on_edge(1, 2)], found),
        _ => (),
    }
}

/// What of a convex polygon of up to four corners has positive values (w), as a fan of triangles.
fn keep(polygon: &[Vec4], found: &mut impl FnMut([Vec3; 3])) {
    // The corner that all triangles of the fan share, and the one before the next.
    let (mut first, mut last) = (None, None);
    let mut add = |corner: Vec3| match (first, last) {
        (None, _) => first = Some(corner),
        (Some(first), Some(before)) => {
            found([first, before, corner]);
            last = Some(corner);
        }
        (Some(_), None) => last = Some(corner),
    };
    for (n, &from) in polygon.iter().enumerate() {
        let to = polygon[(n + 1) % polygon.len()];
        if from.w > 0.0 {
            add(from.truncate());
        }
        if (from.w > 0.0) != (to.w > 0.0) {
            add(from.lerp(to, from.w / (from.w - to.w)).truncate());
        }
    }
}

impl Field {
    /// The section of a plane through what is kept of a pentahedron, every node being at its `position`, mm: triangles in
    /// either sense. None for a pentahedron that does not exist.
    pub fn section(
        &self,
        pentahedron: u32,
        plane: &Plane,
        position: impl Fn(u32) -> Vec3,
        mut found: impl FnMut([Vec3; 3]),
    ) {
        let Some(nodes) = self.mesh.pentahedra.get(pentahedron as usize) else {
            return;
        };
        if !self.is_touched(pentahedron) {
            plane.through_whole(nodes.map(position), &mut found);
            return;
        }
        // What is emptied may have given its points back.
        if self.points.of(pentahedron).is_empty() {
            return;
        }
        let carrier = self.mesh.carrier(pentahedron, position);
        let (sub, points) = (self.mesh.sub(pentahedron), self.points.of(pentahedron));
        let values = points.iter().map(|&point| self.points.values[point as usize]);
        // Some six prisms share a point.
        let points: Vec<Corner> = (0..points.len())
            .zip(values)
            .map(|(point, value)| plane.corner(carrier.at_one(sub.near_place(point)).extend(value)))
            .collect();
        // Few prisms are met, and what a corner says of that fits into a byte.
        let signs: Vec<u8> = points.iter().map(sign).collect();
        for prism in sub.prisms() {
            let all = prism.iter().fold(0, |all, &point| all | signs[point as usize]);
            if all == AHEAD | BEHIND | KEPT {
                through_prism(prism.map(|point| points[point as usize]), &mut found);
            }
        }
    }
}
