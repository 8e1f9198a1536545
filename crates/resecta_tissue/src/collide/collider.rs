//! The bounding volume hierarchy over the exposed triangles of a tissue.

use bevy::prelude::*;
use parry3d::{
    bounding_volume::Aabb,
    partitioning::{Bvh, BvhWorkspace},
};

use super::{
    closest::{ClosestPoints, point_triangle},
    contacts::Found,
    sweep::Axis,
};

/// How far behind a surface a part is still found and the tissue moved past it, mm. Deeper inside, the way out is
/// anybody's guess and the part is left alone.
pub const DEPTH_LIMIT_MM: f32 = 3.0;

/// The hierarchy and what it was built from. It is never rebuilt: triangles that appear are inserted, those that go are
/// removed, and all others are refitted in place.
#[derive(Component, Default)]
pub struct Collider {
    bvh: Bvh,
    workspace: BvhWorkspace,
    /// The triangle in each slot of the surface at the last refit; none where the slot is free.
    triangles: Vec<Option<[u32; 3]>>,
    topology: Option<u64>,
    /// The contacts found last.
    found: Vec<Found>,
}

/// A triangle of the surface with its corners where they are now.
#[derive(Debug, Clone, Copy)]
pub struct Face {
    pub slot: u32,
    pub nodes: [u32; 3],
    pub corners: [Vec3; 3],
}

impl Face {
    /// The unit normal out of the tissue; zero for a triangle without area.
    pub fn normal(&self) -> Vec3 {
        let [a, b, c] = self.corners;
        (b - a).cross(c - a).normalize_or_zero()
    }
}

impl Collider {
    /// Brings the hierarchy up to date with the tissue.
    pub fn update(&mut self, tissue: &resecta_solver::Tissue) {
        let surface = tissue.surface();
        if self.topology != Some(surface.version()) {
            self.topology = Some(surface.version());
            let slots = surface.slot_count();
            self.triangles.resize(slots.max(self.triangles.len()), None);
            for slot in 0..self.triangles.len() as u32 {
                let triangle = surface.triangle(slot);
                let known = std::mem::replace(&mut self.triangles[slot as usize], triangle);
                if known.is_some() && triangle.is_none() {
                    self.bvh.remove(slot);
                } else if let (None, Some(nodes)) = (known, triangle) {
                    self.bvh.insert(bounds(&corners(tissue, nodes)), slot);
                }
            }
        }
        for (slot, nodes) in self.triangles.iter().enumerate() {
            if let Some(nodes) = nodes {
                self.bvh
                    .insert_or_update_partially(bounds(&corners(tissue, *nodes)), slot as u32, 0.0);
            }
        }
        self.bvh.refit(&mut self.workspace);
    }

    /// Whether nothing was cut since the last update.
    pub fn is_current(&self, tissue: &resecta_solver::Tissue) -> bool {
        self.topology == Some(tissue.surface().version())
    }

    /// The contacts found last.
    pub fn found(&self) -> &[Found] {
        &self.found
    }

    /// Lends the list of contacts, so that its memory is used again.
    pub fn take_found(&mut self) -> Vec<Found> {
        std::mem::take(&mut self.found)
    }

    /// Keeps the contacts found.
    pub fn put_found(&mut self, found: Vec<Found>) {
        self.found = found;
    }

    /// The bounds of the whole surface; none without one.
    pub fn bounds(&self) -> Option<(Vec3, Vec3)> {
        (!self.bvh.is_empty()).then(|| {
            let bounds = self.bvh.root_aabb();
            (bounds.mins, bounds.maxs)
        })
    }

    /// Puts the faces that may lie within `range` of an axis into `found`, by ascending slot.
    pub fn near_axis(&self, tissue: &resecta_solver::Tissue, axis: &Axis, range: f32, found: &mut Vec<Face>) {
        let near = |mins: Vec3, maxs: Vec3| {
            let (centre, half) = (0.5 * (mins + maxs), 0.5 * (maxs - mins));
            // The distance from the axis to the box is at least that to its centre less half its diagonal.
            let reach = range + half.length();
            axis.at(axis.share_nearest(centre)).distance_squared(centre) <= reach * reach
        };
        found.clear();
        found.extend(
            self.bvh
                .leaves(|node| near(node.mins(), node.maxs()))
                .filter_map(|slot| self.face(tissue, slot)),
        );
        found.sort_unstable_by_key(|face| face.slot);
    }

    /// Whether a point lies inside the tissue, and the face that is nearest to it; none if no face is within the depth
    /// limit.
    ///
    /// Where several faces share the nearest point (an edge, a corner), the one that faces the point most squarely says
    /// which side it is on.
    pub fn nearest_face(&self, tissue: &resecta_solver::Tissue, point: Vec3) -> Option<Nearest> {
        let reach = Vec3::splat(DEPTH_LIMIT_MM);
        let around = Aabb::new(point - reach, point + reach);
        let mut slots: Vec<u32> = self.bvh.intersect_aabb(&around).collect();
        slots.sort_unstable();
        const TIE_MM: f32 = 1e-4;
        let mut candidates: Vec<(Face, ClosestPoints)> = Vec::new();
        let mut distance = DEPTH_LIMIT_MM;
        for face in slots.into_iter().filter_map(|slot| self.face(tissue, slot)) {
            // No point of a face is further from one corner than its longer edge there: most are too far at a glance.
            let [a, b, c] = face.corners;
            let size = a.distance_squared(b).max(a.distance_squared(c)).sqrt();
            if a.distance(point) - size > distance + TIE_MM {
                continue;
            }
            let closest = point_triangle(point, face.corners);
            if closest.distance() <= distance + TIE_MM {
                distance = distance.min(closest.distance());
                candidates.push((face, closest));
            }
        }
        let mut best: Option<(f32, Nearest)> = None;
        for (face, closest) in candidates {
            if closest.distance() > distance + TIE_MM {
                continue;
            }
            let side = face.normal().dot((point - closest.on_triangle).normalize_or_zero());
            if best.as_ref().is_none_or(|(squarest, _)| side.abs() > *squarest) {
                best = Some((
                    side.abs(),
                    Nearest {
                        face,
                        closest,
                        inside: side < 0.0,
                    },
                ));
            }
        }
        best.map(|(_, nearest)| nearest)
    }

    fn face(&self, tissue: &resecta_solver::Tissue, slot: u32) -> Option<Face> {
        let nodes = (*self.triangles.get(slot as usize)?)?;
        Some(Face {
            slot,
            nodes,
            corners: corners(tissue, nodes),
        })
    }
}

/// The face nearest to a point.
#[derive(Debug, Clone, Copy)]
pub struct Nearest {
    pub face: Face,
    pub closest: ClosestPoints,
    /// Whether the point lies inside the tissue.
    pub inside: bool,
}

fn corners(tissue: &resecta_solver::Tissue, nodes: [u32; 3]) -> [Vec3; 3] {
    nodes.map(|node| tissue.position(node))
}

fn bounds([a, b, c]: &[Vec3; 3]) -> Aabb {
    Aabb::new(a.min(*b).min(*c), a.max(*b).max(*c))
}
