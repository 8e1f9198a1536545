//! Which slots changed, so that a mesh's buffers are written only there.

use crate::room;

/// Slots of the surface that were written since the last time they were asked for, rising. A slot that was freed is
/// among them, of triangles also one that is no more; one that did not exist before is too.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Changes {
    /// Vertex slots: carrier, normal, kind or coagulation are other than before. Where a vertex is changes with every
    /// move of its pentahedron and is not meant here.
    pub vertices: Vec<u32>,
    /// Triangle slots.
    pub triangles: Vec<u32>,
}

/// A set of slots.
#[derive(Debug, Clone, Default)]
pub struct Marked {
    slots: Vec<u32>,
    is_marked: Vec<bool>,
}

impl Marked {
    pub fn mark(&mut self, slot: u32) {
        let index = slot as usize;
        if index >= self.is_marked.len() {
            self.is_marked.resize(index + 1, false);
        }
        if !std::mem::replace(&mut self.is_marked[index], true) {
            self.slots.push(slot);
        }
    }

    /// All slots, rising; none is marked after.
    pub fn take(&mut self) -> Vec<u32> {
        let mut slots = std::mem::take(&mut self.slots);
        for &slot in &slots {
            self.is_marked[slot as usize] = false;
        }
        slots.sort_unstable();
        slots
    }

    pub fn make_room(&mut self) {
        room::make(&mut self.is_marked);
    }

    pub fn bytes(&self) -> usize {
        4 * self.slots.capacity() + self.is_marked.capacity()
    }
}
