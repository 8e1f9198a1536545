//! Which vertex of the skin each vertex of the mesh is.
//!
//! A mesh holds the vertices that a triangle uses, without gaps between triangles; the skin has slots, most of them inside
//! the tissue or free. A cut changes some hundred of a hundred thousand triangles, and only those are numbered anew.

use crate::{change_log::ChangesSince, skin::Skin};

const NONE: u32 = u32::MAX;

/// The vertices and triangles of a mesh.
#[derive(Default)]
pub(crate) struct Numbering {
    /// The vertex of the skin by number; `NONE` for a number that is free.
    vertices: Vec<u32>,
    /// How many corners of triangles each number is.
    uses: Vec<u32>,
    free: Vec<u32>,
    /// The number of each vertex of the skin, or `NONE`.
    numbers: Vec<u32>,
    /// The triangles, as numbers.
    triangles: Vec<[u32; 3]>,
    /// The slot of each triangle, and the place among the triangles of each slot's, or `NONE`.
    slots: Vec<u32>,
    places: Vec<u32>,
}

impl Numbering {
    /// Vertices of the skin by number; none for a number that no triangle uses.
    pub fn vertices(&self) -> impl Iterator<Item = Option<u32>> {
        self.vertices.iter().map(|&vertex| (vertex != NONE).then_some(vertex))
    }

    /// The vertex of the skin that a number is; none for one that no triangle uses.
    pub fn vertex(&self, number: u32) -> Option<u32> {
        let vertex = self.vertices.get(number as usize).copied();
        vertex.filter(|&vertex| vertex != NONE)
    }

    /// How many numbers there are, free ones included.
    pub fn len(&self) -> usize {
        self.vertices.len()
    }

    /// The triangles as numbers, outward by the right-hand rule.
    pub fn triangles(&self) -> &[[u32; 3]] {
        &self.triangles
    }

    /// Numbers all triangles of a skin.
    pub fn of_all(skin: &Skin) -> Self {
        let mut numbering = Self::default();
        numbering.make_room(skin);
        for slot in 0..skin.slot_count() as u32 {
            if let Some(triangle) = skin.triangle(slot) {
                numbering.add(slot, triangle);
            }
        }
        numbering
    }

    /// Follows a change of the skin. Gives the numbers of the vertices that are new or other than before, rising.
    pub fn follow(&mut self, skin: &Skin, changes: &ChangesSince) -> Vec<u32> {
        self.make_room(skin);
        // A slot may be told of more than once: all go before any comes.
        for slot in changes.triangles() {
            self.remove(slot);
        }
        let mut other = Vec::new();
        for slot in changes.triangles() {
            if self.places.get(slot as usize).is_some_and(|&place| place != NONE) {
                continue;
            }
            if let Some(triangle) = skin.triangle(slot) {
                other.extend(self.add(slot, triangle));
            }
        }
        let of_chunks = changes.chunks().flat_map(|chunk| skin.vertices_of(chunk));
        let numbers = |vertex: u32| self.numbers.get(vertex as usize).copied();
        other.extend(of_chunks.chain(changes.nodes()).filter_map(numbers));
        other.retain(|&number| number != NONE);
        other.sort_unstable();
        other.dedup();
        other
    }

    fn make_room(&mut self, skin: &Skin) {
        let (vertices, slots) = (skin.vertex_count(), skin.slot_count());
        // Never fewer: what the skin gave back is still to be taken out.
        self.numbers.resize(vertices.max(self.numbers.len()), NONE);
        self.places.resize(slots.max(self.places.len()), NONE);
    }

    /// Adds the triangle of a slot that has none, and gives its numbers.
    fn add(&mut self, slot: u32, triangle: [u32; 3]) -> [u32; 3] {
        let numbered = triangle.map(|vertex| {
            let number = &mut self.numbers[vertex as usize];
            if *number == NONE {
                *number = self.free.pop().unwrap_or_else(|| {
                    self.vertices.push(NONE);
                    self.uses.push(0);
                    self.vertices.len() as u32 - 1
                });
                self.vertices[*number as usize] = vertex;
            }
            self.uses[*number as usize] += 1;
            *number
        });
        self.places[slot as usize] = self.triangles.len() as u32;
        self.triangles.push(numbered);
        self.slots.push(slot);
        numbered
    }

    /// Takes out the triangle of a slot, if it has one. The last triangle goes to its place.
    fn remove(&mut self, slot: u32) {
        let place = match self.places.get_mut(slot as usize) {
            Some(place) if *place != NONE => std::mem::replace(place, NONE) as usize,
            _ => return,
        };
        let numbered = self.triangles.swap_remove(place);
        self.slots.swap_remove(place);
        if let Some(&moved) = self.slots.get(place) {
            self.places[moved as usize] = place as u32;
        }
        for number in numbered {
            let uses = &mut self.uses[number as usize];
            *uses -= 1;
            if *uses == 0 {
                let vertex = std::mem::replace(&mut self.vertices[number as usize], NONE);
                self.numbers[vertex as usize] = NONE;
                self.free.push(number);
            }
        }
    }
}
