//! The part of a chip's surface that a body can be made of.
//!
//! A chip is taken with the nodes where they are. What hangs by a thread when the loop comes may be drawn out to many times its
//! length, and then sticks out of the chip as a needle. Of tissue that is free such needles would spring back; they are left
//! out of the body's shape, and so is what they leave unconnected far from the largest part. Its mass stays what the tissue lost.

use std::{collections::BTreeMap, sync::Arc};

use bevy::math::{DMat3, DVec3, Vec3};
use resecta_tissue::Chip;

/// Edges longer than this are drawn out, mm: surfaces have vertices every half millimetre, elements are 2 to 3 mm large.
const DRAWN_OUT_MM: f32 = 2.5;
/// Parts are of the same chip up to this distance from the largest, besides its own extent, mm.
const APART_MM: f32 = 3.0;

/// The same chip without triangles that are drawn out; itself where there are none, or nothing else.
pub fn sound(chip: &Arc<Chip>) -> Arc<Chip> {
    let place = |vertex: u32| chip.vertices.get(vertex as usize).copied();
    let is_sound = |triangle: &[u32; 3]| {
        let [Some(a), Some(b), Some(c)] = triangle.map(place) else {
            return false;
        };
        // A place that is not finite is far from everything.
        [a.distance(b), b.distance(c), c.distance(a)]
            .iter()
            .all(|&edge| edge <= DRAWN_OUT_MM)
    };
    let triangles: Vec<[u32; 3]> = chip
        .triangles
        .iter()
        .filter(|triangle| is_sound(triangle))
        .copied()
        .collect();
    let triangles = together(triangles, &chip.vertices);
    if triangles.len() == chip.triangles.len() || triangles.is_empty() {
        return chip.clone();
    }

    const UNUSED: u32 = u32::MAX;
    let mut number = vec![UNUSED; chip.vertices.len()];
    let mut left = Chip {
        vertices: Vec::new(),
        normals: Vec::new(),
        kinds: Vec::new(),
        triangles: Vec::with_capacity(triangles.len()),
        rest_volume_mm3: chip.rest_volume_mm3,
        vaporised_mm3: chip.vaporised_mm3,
        thin_mm3: chip.thin_mm3,
        centre: chip.centre,
        inertia: chip.inertia,
        thickness_mm: chip.thickness_mm,
    };
    for triangle in triangles {
        let corners = triangle.map(|vertex| {
            let index = vertex as usize;
            if number[index] == UNUSED {
                number[index] = left.vertices.len() as u32;
                left.vertices.push(chip.vertices[index]);
                left.normals.push(chip.normals[index]);
                left.kinds.push(chip.kinds[index]);
            }
            number[index]
        });
        left.triangles.push(corners);
    }
    left.shrink_to_fit();
    (left.centre, left.inertia) = of_shell(&left, chip);
    Arc::new(left)
}

/// The triangles of the largest part, and of the parts that lie by it.
fn together(triangles: Vec<[u32; 3]>, vertices: &[Vec3]) -> Vec<[u32; 3]> {
    // The first vertex of each vertex's part.
    let mut first: Vec<u32> = (0..vertices.len() as u32).collect();
    fn root(first: &mut [u32], mut vertex: u32) -> u32 {
        while first[vertex as usize] != vertex {
            first[vertex as usize] = first[first[vertex as usize] as usize];
            vertex = first[vertex as usize];
        }
        vertex
    }
    for &[a, b, c] in &triangles {
        for other in [b, c] {
            let (from, to) = (root(&mut first, a), root(&mut first, other));
            first[from.max(to) as usize] = from.min(to);
        }
    }
    // Area and box of each part.
    let mut parts: BTreeMap<u32, (f32, Vec3, Vec3)> = BTreeMap::new();
    for &triangle in &triangles {
        let [a, b, c] = triangle.map(|vertex| vertices[vertex as usize]);
        let part = parts
            .entry(root(&mut first, triangle[0]))
            .or_insert((0.0, Vec3::INFINITY, Vec3::NEG_INFINITY));
        part.0 += 0.5 * (b - a).cross(c - a).length();
        (part.1, part.2) = (part.1.min(a).min(b).min(c), part.2.max(a).max(b).max(c));
    }
    let largest = parts.values().copied().max_by(|a, b| a.0.total_cmp(&b.0));
    let Some((_, low, high)) = largest else {
        return triangles;
    };
    let (low, high) = (low - APART_MM, high + APART_MM);
    let is_by = |part: u32| {
        let (_, from, to) = parts[&part];
        from.cmple(high).all() && to.cmpge(low).all()
    };
    (triangles.into_iter())
        .filter(|triangle| is_by(root(&mut first, triangle[0])))
        .collect()
}

/// Centre of a surface, and its inertia as if all mass lay evenly on it: it is open where needles were, and encloses nothing.
fn of_shell(left: &Chip, whole: &Chip) -> (DVec3, DMat3) {
    let mut patches = Vec::with_capacity(left.triangles.len());
    for triangle in &left.triangles {
        let [a, b, c] = triangle.map(|vertex| left.vertices[vertex as usize].as_dvec3());
        patches.push(((a + b + c) / 3.0, 0.5 * (b - a).cross(c - a).length()));
    }
    let area: f64 = patches.iter().map(|(_, area)| area).sum();
    if !(area > 0.0 && area.is_finite()) {
        return (whole.centre, whole.inertia);
    }
    let centre = patches.iter().map(|(place, area)| *place * *area).sum::<DVec3>() / area;
    let inertia = patches.iter().fold(DMat3::ZERO, |sum, (place, patch)| {
        let arm = *place - centre;
        let outer = DMat3::from_cols(arm * arm.x, arm * arm.y, arm * arm.z);
        sum + (DMat3::IDENTITY * arm.length_squared() - outer) * (patch / area * left.rest_volume_mm3)
    });
    (centre, inertia)
}

#[cfg(test)]
mod tests {
    use resecta_tissue::SurfaceKind;

    use super::*;

    fn chip(vertices: Vec<Vec3>, triangles: Vec<[u32; 3]>) -> Arc<Chip> {
        Arc::new(Chip {
            normals: vec![Vec3::Z; vertices.len()],
            kinds: vec![SurfaceKind::Cut; vertices.len()],
            vertices,
            triangles,
            rest_volume_mm3: 5.0,
            vaporised_mm3: 0.0,
            thin_mm3: 0.0,
            centre: DVec3::new(9.0, 9.0, 9.0),
            inertia: DMat3::IDENTITY,
            thickness_mm: 1.0,
        })
    }

    #[test]
    fn needles_are_left_out_and_mass_stays() {
        let square = [Vec3::ZERO, Vec3::X, Vec3::new(1.0, 1.0, 0.0), Vec3::Y];
        let whole = chip(square.to_vec(), vec![[0, 1, 2], [0, 2, 3]]);
        assert!(Arc::ptr_eq(&sound(&whole), &whole));

        let mut vertices = vec![Vec3::new(0.0, 0.0, 60.0)];
        vertices.extend(square);
        let drawn_out = chip(vertices, vec![[1, 2, 3], [0, 1, 2], [1, 3, 4]]);
        let left = sound(&drawn_out);
        assert_eq!(left.vertices, square);
        assert_eq!(left.triangles, [[0, 1, 2], [0, 2, 3]]);
        assert_eq!(left.rest_volume_mm3, 5.0);
        assert!((left.centre - DVec3::new(0.5, 0.5, 0.0)).length() < 1e-6);
        assert!(left.inertia.z_axis.z > left.inertia.x_axis.x && left.inertia.x_axis.x > 0.0);
    }

    #[test]
    fn what_lies_far_from_the_largest_part_is_left_out() {
        let part = |at: f32, size: f32| [Vec3::ZERO, Vec3::X * size, Vec3::Y * size].map(|place| place + Vec3::Z * at);
        let vertices: Vec<Vec3> = [part(40.0, 0.5), part(0.0, 1.5), part(2.0, 0.5)].concat();
        let left = sound(&chip(vertices.clone(), vec![[0, 1, 2], [3, 4, 5], [6, 7, 8]]));
        assert_eq!(left.vertices, vertices[3..]);
    }

    #[test]
    fn what_is_all_needles_stays_as_it_is() {
        let needle = chip(vec![Vec3::ZERO, Vec3::X * 9.0, Vec3::Y * 9.0], vec![[0, 1, 2]]);
        assert!(Arc::ptr_eq(&sound(&needle), &needle));
    }
}
