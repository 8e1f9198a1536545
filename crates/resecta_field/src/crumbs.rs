//! Crumbs: bits of tissue, smaller than a pentahedron or few, that a cut has parted from all else.
//!
//! A [`crate::Piece`] is of whole pentahedra. What hangs in the water inside of a pentahedron that is held elsewhere is none, and
//! would be carried along in mid-water. Here two kept points are connected where they are corners of one sub-prism: there their
//! surfaces are joined. From pentahedron to pentahedron the way leads through the points on a face between them.

use std::rc::Rc;

use crate::cut::Cut;
use crate::field::Field;
use crate::lookup::Lookup;
use crate::sublattice::FACES;

/// A crumb has no more kept points than this (those on faces count for each pentahedron): a search that found more is in the organ, or
/// in a piece large enough to be cut. A pentahedron of 2 mm at a spacing of 0.5 mm has some 75. Our choice.
const MOST_POINTS: usize = 200;

/// Stands for no part.
const NONE: u32 = u32::MAX;

/// The parts of one pentahedron that are not connected inside of it.
struct Parts {
    /// By point: the first point of the part that it is in; `NONE` where nothing is kept.
    of: Vec<u32>,
}

impl Parts {
    /// The points of a part, rising.
    fn points(&self, part: u32) -> impl Iterator<Item = u32> + '_ {
        (0..)
            .zip(&self.of)
            .filter(move |(_, of)| **of == part)
            .map(|(point, _)| point)
    }

    /// The first points of the parts, rising.
    fn firsts(&self) -> impl Iterator<Item = u32> + '_ {
        (0..)
            .zip(&self.of)
            .filter(|(point, of)| *of == point)
            .map(|(point, _)| point)
    }
}

/// A part of a pentahedron: the pentahedron and the part's first point.
type Part = (u32, u32);

/// Searches of one call, which end where an earlier one was.
#[derive(Default)]
struct Search {
    parts: Lookup<u32, Rc<Parts>>,
    /// Parts that were met. Of crumbs, too: nobody begins there again.
    met: Lookup<Part, ()>,
}

impl Field {
    /// Takes away the crumbs that reach into some pentahedra (those that a cut took from); nothing where there are none. Indices
    /// that name no pentahedron are passed over. The cost follows the pentahedra given and those beside them.
    ///
    /// Points of a crumb that other tissue shares go too, so that it loses a little where they touch.
    pub fn brush_off(&mut self, around: &[u32]) -> Cut {
        let mut search = Search::default();
        let mut crumbs: Vec<Part> = Vec::new();
        for &pentahedron in around {
            if self.points.of(pentahedron).is_empty() {
                continue;
            }
            let parts = self.parts(&mut search, pentahedron);
            for first in parts.firsts() {
                crumbs.extend(self.crumb(&mut search, (pentahedron, first)).unwrap_or_default());
            }
        }
        if crumbs.is_empty() {
            return Cut::default();
        }
        let mut edit = self.begin_edit();
        let mut changed = Vec::new();
        for (pentahedron, first) in crumbs {
            let parts = self.parts(&mut search, pentahedron);
            for local in parts.points(first) {
                changed.extend(self.take_point(&mut edit, pentahedron, local as usize, |_| true));
            }
        }
        let changed = self.touched_and_changed(&mut edit, changed);
        self.finish(edit, changed)
    }

    /// The crumb that a part is in; none if it is in no crumb, or was met before.
    fn crumb(&self, search: &mut Search, start: Part) -> Option<Vec<Part>> {
        if search.met.insert(start, ()).is_some() {
            return None;
        }
        let (mut found, mut next, mut count) = (vec![start], 0, 0);
        let mut is_crumb = true;
        while let Some(&(pentahedron, first)) = found.get(next).filter(|_| is_crumb) {
            next += 1;
            let parts = self.parts(search, pentahedron);
            count += parts.points(first).count();
            is_crumb = count <= MOST_POINTS;
            let sub = self.mesh.sub(pentahedron);
            let points = self.points.of(pentahedron);
            for face in 0..FACES {
                let shared = sub.face_points[face]
                    .iter()
                    .filter(|&&point| parts.of[point as usize] == first);
                let mut shared = shared.map(|&point| points[point as usize]).peekable();
                let Some((other, its_face, _)) =
                    self.mesh.across(pentahedron, face).filter(|_| shared.peek().is_some())
                else {
                    continue;
                };
                let its_points = self.points.of(other);
                if its_points.is_empty() {
                    // Whole, as far as anybody knows.
                    return None;
                }
                let its_parts = self.parts(search, other);
                let shared: Vec<u32> = shared.collect();
                for &local in &self.mesh.sub(other).face_points[its_face] {
                    let part = (other, its_parts.of[local as usize]);
                    if !shared.contains(&its_points[local as usize]) || found.contains(&part) {
                        continue;
                    }
                    if search.met.insert(part, ()).is_some() {
                        // An earlier search found no crumb here, or it would have come to where this one began.
                        return None;
                    }
                    found.push(part);
                }
            }
        }
        is_crumb.then_some(found)
    }

    fn parts(&self, search: &mut Search, pentahedron: u32) -> Rc<Parts> {
        let parts = search.parts.entry(pentahedron);
        parts.or_insert_with(|| Rc::new(self.parts_of(pentahedron))).clone()
    }

    fn parts_of(&self, pentahedron: u32) -> Parts {
        let points = self.points.of(pentahedron);
        let mut of: Vec<u32> = (0..)
            .zip(points)
            .map(|(local, &point)| {
                if self.points.values[point as usize] > 0.0 {
                    local
                } else {
                    NONE
                }
            })
            .collect();
        fn first(of: &mut [u32], mut point: u32) -> u32 {
            while of[point as usize] != point {
                let next = of[of[point as usize] as usize];
                of[point as usize] = next;
                point = next;
            }
            point
        }
        for prism in self.mesh.sub(pentahedron).prisms() {
            let mut lowest = NONE;
            for corner in prism {
                if of[corner as usize] == NONE {
                    continue;
                }
                let its = first(&mut of, corner);
                if lowest != NONE && its != lowest {
                    of[its.max(lowest) as usize] = its.min(lowest);
                }
                lowest = lowest.min(its);
            }
        }
        for point in 0..of.len() as u32 {
            if of[point as usize] != NONE {
                of[point as usize] = first(&mut of, point);
            }
        }
        Parts { of }
    }
}
