//! The exposed surface: the faces of living pentahedra behind which no other lives.
//!
//! Triangles live in slots. A cut frees the slots of faces that went and fills slots for those it exposed, so whoever
//! keeps something a triangle (a bounding volume, a normal) updates what changed and nothing else.

use std::collections::HashMap;

use resecta_anatomy::wedge;

use crate::mesh::MeshError;

/// Five faces a pentahedron: two triangles, then three quadrilaterals.
const FACES: usize = 5;

/// No slot, or no face.
const NONE: u32 = u32::MAX;

/// The exposed surface of a tissue: closed, consistently oriented, outward.
#[derive(Debug, Clone, PartialEq)]
pub struct Surface {
    /// Node indices; a free slot has `u32::MAX` thrice.
    triangles: Vec<[u32; 3]>,
    owner: Vec<u32>,
    free: Vec<u32>,
    slots: Vec<[u32; 2]>,
    /// The face on the other side, as `pentahedron * FACES + face`.
    across: Vec<u32>,
    version: u64,
}

/// What a cut did to the surface, by slot. A slot can be in both lists: freed, then filled anew.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct SurfaceChange {
    /// Slots whose triangle went.
    pub freed: Vec<u32>,
    /// Slots that hold a new triangle.
    pub filled: Vec<u32>,
}

impl Surface {
    pub(crate) fn new(pentahedra: &[[u32; 6]]) -> Result<Surface, MeshError> {
        let faces = pentahedra.len() * FACES;
        let mut surface = Surface {
            triangles: Vec::new(),
            owner: Vec::new(),
            free: Vec::new(),
            slots: vec![[NONE; 2]; faces],
            across: vec![NONE; faces],
            version: 1,
        };
        let mut open: HashMap<[u32; 4], (u32, [u32; 3])> = HashMap::with_capacity(faces);
        for (pentahedron, nodes) in pentahedra.iter().enumerate() {
            for face in 0..FACES {
                let corners = face_corners(nodes, face);
                let id = (pentahedron * FACES + face) as u32;
                let turn = sense(&corners);
                let mut key = corners;
                key.sort_unstable();
                match open.get(&key) {
                    None => {
                        open.insert(key, (id, turn));
                    }
                    // Two faces that meet show opposite senses, and no third one meets them.
                    Some(&(other, other_turn))
                        if surface.across[other as usize] == NONE && opposite(turn, other_turn) =>
                    {
                        surface.across[id as usize] = other;
                        surface.across[other as usize] = id;
                    }
                    Some(_) => return Err(MeshError::NotManifold(pentahedron)),
                }
            }
        }
        let mut change = SurfaceChange::default();
        for (pentahedron, nodes) in pentahedra.iter().enumerate() {
            for face in 0..FACES {
                if surface.across[pentahedron * FACES + face] == NONE {
                    surface.expose(pentahedron, face, nodes, &mut change);
                }
            }
        }
        Ok(surface)
    }

    /// Rises with every change of the triangles.
    pub fn version(&self) -> u64 {
        self.version
    }

    /// Slots, free ones included.
    pub fn slot_count(&self) -> usize {
        self.triangles.len()
    }

    /// The triangle in a slot, outward by the right-hand rule, if the slot is not free.
    #[inline]
    pub fn triangle(&self, slot: u32) -> Option<[u32; 3]> {
        self.triangles
            .get(slot as usize)
            .copied()
            .filter(|triangle| triangle[0] != NONE)
    }

    /// The pentahedron whose face the triangle in a slot is part of; meaningless for a free slot.
    pub fn owner(&self, slot: u32) -> u32 {
        self.owner[slot as usize]
    }

    /// Whether any face of a pentahedron is exposed.
    #[inline]
    pub fn is_exposed(&self, pentahedron: u32) -> bool {
        let first = pentahedron as usize * FACES;
        self.slots[first..first + FACES].iter().any(|slots| slots[0] != NONE)
    }

    /// The exposed triangles of a pentahedron with their slots.
    pub fn triangles_of(&self, pentahedron: u32) -> impl Iterator<Item = (u32, [u32; 3])> + '_ {
        let first = pentahedron as usize * FACES;
        let slots = self.slots[first..first + FACES].as_flattened().iter().copied();
        slots.filter_map(|slot| Some((slot, self.triangle(slot)?)))
    }

    /// Every slot in use and its triangle, by rising slot.
    pub fn triangles(&self) -> impl Iterator<Item = (u32, [u32; 3])> + '_ {
        (0u32..)
            .zip(&self.triangles)
            .filter(|(_, triangle)| triangle[0] != NONE)
            .map(|(slot, triangle)| (slot, *triangle))
    }

    /// The living pentahedra that share a face with this one.
    pub(crate) fn neighbours<'a>(&'a self, pentahedron: u32, alive: &'a [bool]) -> impl Iterator<Item = u32> + 'a {
        let first = pentahedron as usize * FACES;
        self.across[first..first + FACES]
            .iter()
            .filter(|&&face| face != NONE)
            .map(|&face| face / FACES as u32)
            .filter(|&other| alive[other as usize])
    }

    /// The faces of a pentahedron, outward, each with the pentahedron on its other side, living or not.
    pub(crate) fn faces<'a>(
        &'a self,
        pentahedron: u32,
        nodes: &'a [u32; 6],
    ) -> impl Iterator<Item = ([Option<[u32; 3]>; 2], Option<u32>)> + 'a {
        let first = pentahedron as usize * FACES;
        (0..FACES).map(move |face| {
            let across = self.across[first + face];
            let other = (across != NONE).then_some(across / FACES as u32);
            (face_triangles(nodes, face), other)
        })
    }

    /// Takes a pentahedron out, which `alive` must no longer list.
    pub(crate) fn remove(&mut self, pentahedron: u32, nodes: &[[u32; 6]], alive: &[bool], change: &mut SurfaceChange) {
        self.version += 1;
        for face in 0..FACES {
            let id = pentahedron as usize * FACES + face;
            let other = self.across[id];
            if other != NONE && alive[other as usize / FACES] {
                let (other, other_face) = (other as usize / FACES, other as usize % FACES);
                self.expose(other, other_face, &nodes[other], change);
            } else {
                self.hide(id, change);
            }
        }
    }

    fn expose(&mut self, pentahedron: usize, face: usize, nodes: &[u32; 6], change: &mut SurfaceChange) {
        for (part, triangle) in face_triangles(nodes, face).into_iter().flatten().enumerate() {
            let slot = match self.free.pop() {
                Some(slot) => slot,
                None => {
                    self.triangles.push([NONE; 3]);
                    self.owner.push(NONE);
                    self.triangles.len() as u32 - 1
                }
            };
            self.triangles[slot as usize] = triangle;
            self.owner[slot as usize] = pentahedron as u32;
            self.slots[pentahedron * FACES + face][part] = slot;
            change.filled.push(slot);
        }
    }

    fn hide(&mut self, face: usize, change: &mut SurfaceChange) {
        for slot in std::mem::replace(&mut self.slots[face], [NONE; 2]) {
            if slot != NONE {
                self.triangles[slot as usize] = [NONE; 3];
                self.free.push(slot);
                change.freed.push(slot);
            }
        }
    }

    /// The faces that must be exposed, as triangles, worked out anew from the pentahedra; for the consistency check.
    pub(crate) fn expected(&self, nodes: &[[u32; 6]], alive: &[bool]) -> Vec<[u32; 3]> {
        let mut triangles = Vec::new();
        for (pentahedron, nodes) in nodes.iter().enumerate().filter(|&(pentahedron, _)| alive[pentahedron]) {
            for face in 0..FACES {
                let other = self.across[pentahedron * FACES + face];
                if other == NONE || !alive[other as usize / FACES] {
                    triangles.extend(face_triangles(nodes, face).into_iter().flatten());
                }
            }
        }
        triangles
    }
}

impl SurfaceChange {
    /// Whether nothing changed.
    pub fn is_empty(&self) -> bool {
        self.freed.is_empty() && self.filled.is_empty()
    }
}

/// The corners of a face in cyclic order, outward; a triangle's fourth is [`NONE`].
fn face_corners(nodes: &[u32; 6], face: usize) -> [u32; 4] {
    match face {
        0 | 1 => {
            let [a, b, c] = wedge::TRIANGLES[face].map(|corner| nodes[corner]);
            [a, b, c, NONE]
        }
        _ => wedge::QUADS[face - 2].map(|corner| nodes[corner]),
    }
}

fn face_triangles(nodes: &[u32; 6], face: usize) -> [Option<[u32; 3]>; 2] {
    match face_corners(nodes, face) {
        [a, b, c, NONE] => [Some([a, b, c]), None],
        quad => wedge::split_quad(quad).map(Some),
    }
}

/// The smallest corner of a face with its neighbours before and after: tells the two senses of a face apart.
fn sense(corners: &[u32; 4]) -> [u32; 3] {
    let count = if corners[3] == NONE { 3 } else { 4 };
    let smallest = (0..count).min_by_key(|&corner| corners[corner]).unwrap_or(0);
    let at = |offset: usize| corners[(smallest + offset) % count];
    [at(count - 1), at(0), at(1)]
}

fn opposite([before, at, after]: [u32; 3], [other_before, other_at, other_after]: [u32; 3]) -> bool {
    at == other_at && before == other_after && after == other_before
}
