//! The bounding volume hierarchy over the exposed triangles of a tissue.

use bevy::prelude::*;
use parry3d::{
    bounding_volume::{Aabb, BoundingVolume},
    partitioning::{Bvh, BvhWorkspace},
};

use super::{
    closest::{ClosestPoints, point_triangle},
    contacts::Found,
    sweep::Axis,
};
use crate::skin::{Skin, SkinVersion};

/// How far behind a surface a part is still found and the tissue moved past it, mm. Deeper inside, the way out is
/// anybody's guess and the part is left alone.
pub const DEPTH_LIMIT_MM: f32 = 3.0;

/// The hierarchy and what it was built from. It is never rebuilt: triangles that appear are inserted, those that go are
/// removed, and all others are refitted in place.
///
/// A leaf is a *patch* of up to [`PATCH`] triangles that appeared together, and so lie together: a gland has thousands of
/// triangles to refit every step, and a tool is near a few dozen.
#[derive(Component, Default)]
pub struct Collider {
    bvh: Bvh,
    workspace: BvhWorkspace,
    patches: Vec<Vec<Known>>,
    /// Patches without a triangle.
    free: Vec<u32>,
    /// The patch of the triangle in each slot of the surface at the last update; none where the slot is free.
    patch_of: Vec<Option<u32>>,
    topology: Option<SkinVersion>,
    /// The version of the motion that the bounds are of.
    motion: Option<u64>,
    /// The contacts found last.
    found: Vec<Found>,
}

/// A triangle of a patch.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Known {
    slot: u32,
    vertices: [u32; 3],
}

/// Most triangles in a patch: twice as many or half as many cost a step more.
const PATCH: usize = 8;

/// A triangle of the surface with its corners where they are now.
#[derive(Debug, Clone, Copy)]
pub struct Face {
    pub slot: u32,
    pub vertices: [u32; 3],
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
    /// Brings the hierarchy up to date with the tissue; costs nothing where all of it sleeps.
    pub fn update(&mut self, skin: &Skin) {
        if self.topology != Some(skin.version()) {
            self.topology = Some(skin.version());
            self.update_patches(skin);
        } else if self.motion == Some(skin.motion_version()) {
            return;
        }
        self.motion = Some(skin.motion_version());
        for (patch, known) in (0u32..).zip(&self.patches) {
            let bounds = known.iter().map(|known| bounds(&corners(skin, known.vertices)));
            if let Some(bounds) = bounds.reduce(|one, other| one.merged(&other)) {
                self.bvh.insert_or_update_partially(bounds, patch, 0.0);
            }
        }
        self.bvh.refit(&mut self.workspace);
    }

    /// Takes triangles that went out of their patches, and puts those that appeared into new ones.
    fn update_patches(&mut self, skin: &Skin) {
        self.patch_of.resize(skin.slot_count().max(self.patch_of.len()), None);
        let mut appeared = Vec::new();
        for (slot, patch) in (0u32..).zip(&mut self.patch_of) {
            let triangle = skin.triangle(slot);
            if let Some(number) = *patch {
                let known = &mut self.patches[number as usize];
                if known
                    .iter()
                    .any(|known| known.slot == slot && triangle == Some(known.vertices))
                {
                    continue;
                }
                // Gone, or another one in its place.
                known.retain(|known| known.slot != slot);
                if known.is_empty() {
                    self.bvh.remove(number);
                    self.free.push(number);
                }
                *patch = None;
            }
            appeared.extend(triangle.map(|vertices| Known { slot, vertices }));
        }
        for known in appeared.chunks(PATCH) {
            let number = self.free.pop().unwrap_or_else(|| {
                self.patches.push(Vec::new());
                self.patches.len() as u32 - 1
            });
            for known in known {
                self.patch_of[known.slot as usize] = Some(number);
            }
            self.patches[number as usize].extend_from_slice(known);
        }
    }

    /// Whether nothing was cut since the last update.
    pub fn is_current(&self, skin: &Skin) -> bool {
        self.topology == Some(skin.version())
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
    pub fn near_axis(&self, skin: &Skin, axis: &Axis, range: f32, found: &mut Vec<Face>) {
        let near = |mins: Vec3, maxs: Vec3| {
            let (centre, half) = (0.5 * (mins + maxs), 0.5 * (maxs - mins));
            // The distance from the axis to the box is at least that to its centre less half its diagonal.
            let reach = range + half.length();
            axis.at(axis.share_nearest(centre)).distance_squared(centre) <= reach * reach
        };
        found.clear();
        let patches = self.bvh.leaves(|node| near(node.mins(), node.maxs()));
        found.extend(patches.flat_map(|patch| self.faces(skin, patch)).filter(|face| {
            let bounds = bounds(&face.corners);
            near(bounds.mins, bounds.maxs)
        }));
        found.sort_unstable_by_key(|face| face.slot);
    }

    /// Whether a point lies inside the tissue, and the face that is nearest to it; none if no face is within the depth
    /// limit.
    ///
    /// Where several faces share the nearest point (an edge, a corner), the one that faces the point most squarely says
    /// which side it is on.
    pub fn nearest_face(&self, skin: &Skin, point: Vec3) -> Option<Nearest> {
        let reach = Vec3::splat(DEPTH_LIMIT_MM);
        let around = Aabb::new(point - reach, point + reach);
        let patches = self.bvh.intersect_aabb(&around);
        let faces = patches.flat_map(|patch| self.faces(skin, patch));
        let mut faces: Vec<Face> = faces.filter(|face| bounds(&face.corners).intersects(&around)).collect();
        faces.sort_unstable_by_key(|face| face.slot);
        const TIE_MM: f32 = 1e-4;
        let mut candidates: Vec<(Face, ClosestPoints)> = Vec::new();
        let mut distance = DEPTH_LIMIT_MM;
        for face in faces {
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

    /// The triangles of a patch.
    fn faces(&self, skin: &Skin, patch: u32) -> impl Iterator<Item = Face> {
        self.patches[patch as usize]
            .iter()
            .map(|&Known { slot, vertices }| Face {
                slot,
                vertices,
                corners: corners(skin, vertices),
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

fn corners(skin: &Skin, vertices: [u32; 3]) -> [Vec3; 3] {
    vertices.map(|vertex| skin.place(vertex))
}

fn bounds([a, b, c]: &[Vec3; 3]) -> Aabb {
    Aabb::new(a.min(*b).min(*c), a.max(*b).max(*c))
}
