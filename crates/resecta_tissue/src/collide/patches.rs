//! The triangles of a skin in patches: what lies together is found together.

use bevy::{platform::collections::HashMap, prelude::*};
use resecta_solver::with_widest_registers;

use crate::skin::{Skin, SkinVersion};

/// Most triangles with nodes at their corners that are put into one patch: twice as many or half as many cost a step more.
const PATCH: usize = 8;

/// Triangles of a patch that have bounds in common.
const RUN: usize = 16;

/// Triangles that lie together.
///
/// Those with a node at a corner are a few a pentahedron, and pentahedra that appeared together share a patch. The others
/// are a hundred a pentahedron, in a patch of their own: its vertices come in few chunks, which is what makes their places
/// cheap.
#[derive(Debug, Default)]
pub struct Patch {
    /// The slots of the triangles.
    slots: Vec<u32>,
    /// The triangles, divided.
    pub runs: Vec<Run>,
    /// The nodes that carry any corner.
    carriers: Vec<u32>,
    /// The pentahedra that the triangles belong to.
    pentahedra: Vec<u32>,
    /// Whether the bounds are out of date, and those of its runs.
    is_stale: bool,
    has_stale_runs: bool,
    /// Whether triangles are other ones than when it was last looked at, or its corners may lie elsewhere at rest.
    is_changed: bool,
    has_moved_at_rest: bool,
}

/// Some triangles of a patch that lie closer together.
#[derive(Debug, Default)]
pub struct Run {
    /// The slots of the triangles and their corners.
    pub triangles: Vec<(u32, [u32; 3])>,
    /// The corners other than nodes.
    pub chunks: Vec<ChunkPart>,
    /// The corners that are nodes.
    nodes: Vec<u32>,
    /// The bounds, low and high.
    pub bounds: (Vec3, Vec3),
}

/// Some vertices of a chunk.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct ChunkPart {
    pub chunk: u32,
    /// A bit a vertex.
    pub used: u8,
}

impl ChunkPart {
    fn uses(self, number: usize) -> bool {
        self.used >> number & 1 == 1
    }
}

/// A triangle and the patch it is in.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Known {
    patch: u32,
    vertices: [u32; 3],
}

/// Which patch is for the triangles of a pentahedron, those with and those without a node at a corner.
type Key = (u32, bool);

/// All patches of a skin.
#[derive(Debug, Default)]
pub struct Patches {
    all: Vec<Patch>,
    /// Patches without a triangle.
    free: Vec<u32>,
    of: HashMap<Key, u32>,
    /// What was in each slot of the surface at the last update; none where the slot was free.
    slots: Vec<Option<Known>>,
    /// Which patches nodes carry corners of, and which have corners in a chunk: a step moves and changes few of a gland's.
    at_nodes: Holders,
    at_chunks: Holders,
    /// Patches to be looked at, those with other corners at rest, and those whose bounds are out of date; each once in a list.
    changed: Vec<u32>,
    moved_at_rest: Vec<u32>,
    stale: Vec<u32>,
}

/// The patches that hold each of something numbered; one that holds it in several of its runs is there as often.
#[derive(Debug, Default)]
struct Holders(Vec<Vec<u32>>);

impl Holders {
    fn of(&self, number: u32) -> &[u32] {
        self.0.get(number as usize).map_or(&[], Vec::as_slice)
    }

    /// Those of all that have this number or a higher one.
    fn from(&self, number: usize) -> impl Iterator<Item = u32> {
        self.0.iter().skip(number).flatten().copied()
    }

    fn add(&mut self, number: u32, patch: u32) {
        if self.0.len() <= number as usize {
            self.0.resize_with(number as usize + 1, Vec::new);
        }
        self.0[number as usize].push(patch);
    }

    fn remove(&mut self, number: u32, patch: u32) {
        let Some(holders) = self.0.get_mut(number as usize) else {
            return;
        };
        if let Some(place) = holders.iter().position(|&holder| holder == patch) {
            holders.swap_remove(place);
        }
    }
}

impl Patches {
    /// A patch.
    pub fn get(&self, patch: u32) -> &Patch {
        &self.all[patch as usize]
    }

    /// The patch that the triangle in a slot is in.
    #[cfg(test)]
    pub fn patch_of(&self, slot: u32) -> Option<u32> {
        self.slots[slot as usize].map(|known| known.patch)
    }

    /// Whether every patch is either free, once, or has triangles that know it, and says of itself what the skin does.
    #[cfg(test)]
    pub fn are_consistent(&self, skin: &Skin) -> bool {
        let count = |holders: &[u32], number| holders.iter().filter(|holder| **holder == number).count();
        let are_held = (0u32..).zip(&self.all).all(|(number, patch)| {
            let is_home = |slot: &u32| self.patch_of(*slot) == Some(number);
            count(&self.free, number) == usize::from(patch.slots.is_empty())
                && patch.slots.iter().all(is_home)
                && (patch.carriers.iter()).all(|&node| count(self.at_nodes.of(node), number) == 1)
                && patch.carriers == carriers_of(&patch.runs, skin)
        });
        let chunks = self
            .all
            .iter()
            .flat_map(|patch| &patch.runs)
            .map(|run| run.chunks.len());
        let carriers = self.all.iter().map(|patch| patch.carriers.len());
        are_held
            && self.at_chunks.from(0).count() == chunks.sum::<usize>()
            && self.at_nodes.from(0).count() == carriers.sum::<usize>()
    }

    /// Takes triangles that went out of their patches and puts those that appeared into some.
    pub fn update(&mut self, skin: &Skin, before: Option<SkinVersion>) {
        self.slots.resize(skin.slot_count().max(self.slots.len()), None);
        match before.and_then(|before| skin.changes_since(before)) {
            Some(changes) => {
                self.update_slots(skin, changes.triangles());
                // A chunk that is gone has lost its vertices, and the triangles at them.
                for patch in self.at_chunks.from(skin.chunk_count()) {
                    mark(&mut self.all[patch as usize].is_changed, patch, &mut self.changed);
                }
                // As many triangles as a cut changes lie beside what it changes.
                let changed = changes.chunks().flat_map(|chunk| self.at_chunks.of(chunk));
                for &patch in changed {
                    let is_marked = &mut self.all[patch as usize].has_moved_at_rest;
                    mark(is_marked, patch, &mut self.moved_at_rest);
                }
            }
            None => {
                self.update_slots(skin, 0..self.slots.len() as u32);
                // The same triangles, perhaps, but their corners may have been put elsewhere.
                let used = (0..).zip(&mut self.all).filter(|(_, patch)| !patch.slots.is_empty());
                for (number, patch) in used.filter(|_| skin.is_fine()) {
                    mark(&mut patch.is_changed, number, &mut self.changed);
                }
            }
        }
        let (mut changed, mut moved) = (
            std::mem::take(&mut self.changed),
            std::mem::take(&mut self.moved_at_rest),
        );
        changed.sort_unstable();
        moved.sort_unstable();
        for &number in &changed {
            self.divide(skin, number);
        }
        for number in changed.iter().copied().chain(moved.drain(..)) {
            let Patch {
                is_changed,
                has_moved_at_rest,
                ..
            } = &mut self.all[number as usize];
            // Among both lists only once.
            if std::mem::take(is_changed) | std::mem::take(has_moved_at_rest) {
                self.look_up(skin, number);
            }
        }
        changed.clear();
        (self.changed, self.moved_at_rest) = (changed, moved);
    }

    fn update_slots(&mut self, skin: &Skin, slots: impl Iterator<Item = u32>) {
        let mut appeared: Vec<(Key, u32, [u32; 3])> = Vec::new();
        for slot in slots {
            let vertices = skin.triangle(slot);
            let Some(known) = self.slots.get_mut(slot as usize) else {
                continue;
            };
            if vertices == known.map(|known| known.vertices) {
                continue;
            }
            // Gone, or another one in its place.
            if let Some(Known { patch, .. }) = known.take() {
                mark(&mut self.all[patch as usize].is_changed, patch, &mut self.changed);
            }
            if let Some(vertices) = vertices {
                let has_node = vertices.iter().any(|&vertex| skin.is_node(vertex));
                appeared.push(((skin.pentahedron(slot, vertices), has_node), slot, vertices));
            }
        }
        for &patch in &self.changed {
            let slots = &mut self.all[patch as usize].slots;
            slots.retain(|&slot| self.slots[slot as usize].is_some());
        }
        appeared.sort_unstable();
        appeared.dedup();
        // The patch begun last for triangles with nodes.
        let mut begun: Option<u32> = None;
        for triangles in appeared.chunk_by(|a, b| a.0 == b.0) {
            let key @ (pentahedron, has_node) = triangles[0].0;
            let has_room = |patch: &u32, room: usize| !has_node || self.all[*patch as usize].slots.len() < room;
            let patch = match self.of.get(&key).copied().filter(|patch| has_room(patch, 2 * PATCH)) {
                Some(patch) => patch,
                None => {
                    let begun_one = begun.filter(|patch| has_node && has_room(patch, PATCH));
                    let patch = begun_one.unwrap_or_else(|| self.begin());
                    if has_node {
                        begun = Some(patch);
                    }
                    if let Some(former) = self.of.insert(key, patch) {
                        self.all[former as usize]
                            .pentahedra
                            .retain(|&other| other != pentahedron);
                    }
                    self.all[patch as usize].pentahedra.push(pentahedron);
                    patch
                }
            };
            mark(&mut self.all[patch as usize].is_changed, patch, &mut self.changed);
            for &(_, slot, vertices) in triangles {
                self.slots[slot as usize] = Some(Known { patch, vertices });
                self.all[patch as usize].slots.push(slot);
            }
        }
    }

    /// An empty patch.
    fn begin(&mut self) -> u32 {
        self.free.pop().unwrap_or_else(|| {
            self.all.push(Patch::default());
            self.all.len() as u32 - 1
        })
    }

    /// Divides a patch with other triangles into runs.
    fn divide(&mut self, skin: &Skin, number: u32) {
        let mut patch = std::mem::take(&mut self.all[number as usize]);
        for part in patch.runs.iter().flat_map(|run| &run.chunks) {
            self.at_chunks.remove(part.chunk, number);
        }
        let slots = patch.slots.iter();
        let mut triangles: Vec<(u32, [u32; 3])> = slots
            .filter_map(|&slot| Some((slot, self.slots[slot as usize]?.vertices)))
            .collect();
        if triangles.len() > RUN {
            sort_by_place(&mut triangles, |vertex| skin.rest_place(vertex));
        }
        // A cut changes patches step by step: what a run holds is written into the lists that it has.
        patch.runs.resize_with(triangles.len().div_ceil(RUN), Run::default);
        for (run, triangles) in patch.runs.iter_mut().zip(triangles.chunks(RUN)) {
            run.triangles.clear();
            run.triangles.extend_from_slice(triangles);
            run.chunks.clear();
            run.nodes.clear();
            for &vertex in triangles.iter().flat_map(|(_, vertices)| vertices) {
                match skin.chunk(vertex) {
                    Some((chunk, number)) => {
                        // A run has its vertices in a few chunks.
                        let used = 1 << number;
                        match run.chunks.iter_mut().find(|known| known.chunk == chunk) {
                            Some(known) => known.used |= used,
                            None => run.chunks.push(ChunkPart { chunk, used }),
                        }
                    }
                    None => run.nodes.push(vertex),
                }
            }
            run.chunks.sort_unstable();
            run.nodes.sort_unstable();
            run.nodes.dedup();
        }
        for part in patch.runs.iter().flat_map(|run| &run.chunks) {
            self.at_chunks.add(part.chunk, number);
        }
        self.all[number as usize] = patch;
    }

    /// Looks up what carries a patch's corners, which hangs on where the corners lie at rest.
    fn look_up(&mut self, skin: &Skin, number: u32) {
        let mut patch = std::mem::take(&mut self.all[number as usize]);
        mark(&mut patch.is_stale, number, &mut self.stale);
        let carriers = carriers_of(&patch.runs, skin);
        if carriers != patch.carriers {
            for &node in &patch.carriers {
                self.at_nodes.remove(node, number);
            }
            for &node in &carriers {
                self.at_nodes.add(node, number);
            }
            patch.carriers = carriers;
        }
        if patch.slots.is_empty() {
            for &pentahedron in &patch.pentahedra {
                for has_node in [false, true] {
                    if self.of.get(&(pentahedron, has_node)) == Some(&number) {
                        self.of.remove(&(pentahedron, has_node));
                    }
                }
            }
            patch.pentahedra.clear();
        }
        self.all[number as usize] = patch;
    }

    /// Puts the bounds of what some nodes carry out of date.
    pub fn have_moved(&mut self, nodes: &[u32]) {
        for &patch in nodes.iter().flat_map(|&node| self.at_nodes.of(node)) {
            mark(&mut self.all[patch as usize].is_stale, patch, &mut self.stale);
        }
    }

    /// Gives the patches whose bounds are out of date others, of where `place` puts the nodes, and calls back with each:
    /// its number and bounds, none where it has no triangle left.
    ///
    /// A vertex is a mean of the nodes that carry it, so the box around those holds it: they are a few, where vertices are hundreds. What a
    /// query comes near asks for more ([`Patches::refresh_runs`]).
    pub fn refresh(&mut self, place: impl Fn(u32) -> Vec3, mut report: impl FnMut(u32, Option<(Vec3, Vec3)>)) {
        self.stale.sort_unstable();
        for number in self.stale.drain(..) {
            let patch = &mut self.all[number as usize];
            patch.is_stale = false;
            if patch.slots.is_empty() {
                self.free.push(number);
                report(number, None);
                continue;
            }
            patch.has_stale_runs = true;
            report(number, Some(bounds_of(patch.carriers.iter().map(|&node| place(node)))));
        }
    }

    /// Brings the bounds of the runs of some patches up to date, of where `place` puts the nodes.
    pub fn refresh_runs(&mut self, skin: &Skin, numbers: &[u32], place: impl Fn(u32) -> Vec3) {
        with_widest_registers(
            #[inline(always)]
            || {
                for &number in numbers {
                    let patch = &mut self.all[number as usize];
                    if std::mem::take(&mut patch.has_stale_runs) {
                        (patch.runs.iter_mut()).for_each(|run| run.bounds = run.bounds_at(skin, &place));
                    }
                }
            },
        );
    }
}

impl Run {
    /// The bounds of its corners where `place` puts the nodes.
    #[inline(always)]
    fn bounds_at(&self, skin: &Skin, place: impl Fn(u32) -> Vec3) -> (Vec3, Vec3) {
        let in_chunks = self.chunks.iter().flat_map(
            #[inline(always)]
            |part| {
                let places = skin.chunk_places(part.chunk, &place).unwrap_or_default();
                let used = places.into_iter().enumerate();
                used.filter(|(number, _)| part.uses(*number)).map(|(_, place)| place)
            },
        );
        bounds_of(self.nodes.iter().map(|&node| place(node)).chain(in_chunks))
    }
}

/// The box around some places, low and high.
#[inline(always)]
fn bounds_of(places: impl Iterator<Item = Vec3>) -> (Vec3, Vec3) {
    places.fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |(low, high), place| {
        (low.min(place), high.max(place))
    })
}

/// The nodes that carry a corner of some runs, by rising index.
fn carriers_of(runs: &[Run], skin: &Skin) -> Vec<u32> {
    let chunks = runs.iter().flat_map(|run| &run.chunks);
    let mut homes: Vec<u32> = chunks.filter_map(|part| skin.chunk_home(part.chunk)).collect();
    homes.sort_unstable();
    homes.dedup();
    let at_homes = homes.iter().flat_map(|&home| skin.solver().pentahedron_nodes(home));
    let nodes = runs.iter().flat_map(|run| &run.nodes).copied();
    let mut carriers: Vec<u32> = nodes.chain(at_homes).collect();
    carriers.sort_unstable();
    carriers.dedup();
    carriers
}

/// Puts a patch on a list unless its mark says that it is there.
fn mark(is_marked: &mut bool, patch: u32, list: &mut Vec<u32>) {
    if !std::mem::replace(is_marked, true) {
        list.push(patch);
    }
}

/// Puts triangles into an order that keeps close what lies close together: by octants of their middles, from the largest
/// octants to the smallest.
fn sort_by_place(triangles: &mut [(u32, [u32; 3])], place: impl Fn(u32) -> Vec3) {
    /// Halvings of the longest side.
    const HALVINGS: u32 = 5;
    let middle = |vertices: &[u32; 3]| vertices.map(&place).iter().sum::<Vec3>() / 3.0;
    let middles = triangles.iter().map(|(_, vertices)| middle(vertices));
    let (low, high) = middles.fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |(low, high), place| {
        (low.min(place), high.max(place))
    });
    let size = (high - low).max_element().max(f32::MIN_POSITIVE);
    let scale = ((1 << HALVINGS) - 1) as f32 / size;
    triangles.sort_by_cached_key(|(slot, vertices)| {
        let halves = ((middle(vertices) - low) * scale).as_uvec3().to_array();
        let octants = (0..HALVINGS).rev().map(|bit| halves.map(|half| half >> bit & 1));
        let number = octants.flatten().fold(0u32, |number, half| number << 1 | half);
        (number, *slot)
    });
}
