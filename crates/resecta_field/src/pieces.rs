//! Pieces: parts of the tissue that nothing holds any more.
//!
//! Two pentahedra are connected where something is kept of the face between them. A pentahedron is one: two parts of it
//! that a cut has parted count as connected until one of them goes, but for crumbs (`crumbs.rs`).

use std::cmp::Reverse;
use std::collections::{BinaryHeap, VecDeque};

use crate::field::Field;
use crate::lookup::Lookup;
use crate::sublattice::FACES;

/// Pentahedra that are connected with each other and with nothing else.
#[derive(Debug, Clone, PartialEq)]
pub struct Piece {
    /// Its pentahedra, rising.
    pub pentahedra: Vec<u32>,
    /// Rest volume kept of them, mm³.
    pub rest_volume_mm3: f64,
}

/// Which pentahedra are fixed to something, and how far from them every other is.
///
/// A search for a piece that hangs by nothing goes where that distance falls: nearly every search ends at something held,
/// a few pentahedra on, where a search in all directions would look at thousands.
#[derive(Debug, Clone)]
pub struct Holds {
    /// Faces on the shortest way through the uncut tissue; 0 where held, `u32::MAX` where no way leads.
    faces_away: Vec<u32>,
}

impl Field {
    /// Where the tissue is fixed: the pentahedra for which `held` is true.
    pub fn holds(&self, held: impl Fn(u32) -> bool) -> Holds {
        let mut open: VecDeque<u32> = (0..self.pentahedron_count() as u32).filter(|&n| held(n)).collect();
        let mut faces_away = vec![u32::MAX; self.pentahedron_count()];
        open.iter().for_each(|&held| faces_away[held as usize] = 0);
        while let Some(pentahedron) = open.pop_front() {
            let away = faces_away[pentahedron as usize] + 1;
            for (other, ..) in (0..FACES).filter_map(|face| self.mesh.across(pentahedron, face)) {
                if faces_away[other as usize] == u32::MAX {
                    faces_away[other as usize] = away;
                    open.push_back(other);
                }
            }
        }
        Holds { faces_away }
    }

    /// The pieces of at most `most_mm3` among and around the given pentahedra (those that a cut took from) that hang by
    /// nothing. What is held, and all that is connected with it, is no piece. [`Field::empty`] takes a piece away. Indices
    /// that name no pentahedron are passed over, and so are those of a mesh that `holds` is not of.
    ///
    /// The cost follows what is found: a search ends at something held, or when it has found more than `most_mm3`.
    pub fn loose_pieces(&self, around: &[u32], most_mm3: f64, holds: &Holds) -> Vec<Piece> {
        let given: Vec<u32> = (around.iter().copied())
            .filter(|&pentahedron| (pentahedron as usize) < self.pentahedron_count())
            .collect();
        // Which search found a pentahedron; only looked up.
        let mut found_by: Lookup<u32, usize> = Lookup::default();
        let mut pieces = Vec::new();
        // The nearest to something held first, of equally near ones the one found first.
        let mut open = BinaryHeap::new();
        for (search, start) in self.mesh.ring(&given).into_iter().enumerate() {
            if self.kept_mm3(start) <= 0.0 || found_by.contains_key(&start) {
                continue;
            }
            found_by.insert(start, search);
            let away = |pentahedron: u32| holds.faces_away.get(pentahedron as usize).copied().unwrap_or(0);
            let mut pentahedra = vec![start];
            open.clear();
            open.push(Reverse((away(start), 0)));
            let (mut volume, mut is_loose) = (0.0, true);
            while let Some(Reverse((away_from_hold, found))) = open.pop().filter(|_| is_loose) {
                let pentahedron = pentahedra[found];
                volume += self.kept_mm3(pentahedron);
                is_loose = volume <= most_mm3 && away_from_hold > 0;
                for neighbour in self.connected(pentahedron) {
                    match found_by.get(&neighbour) {
                        // An earlier search ended before it came here: that piece is not loose, so neither is this.
                        Some(&earlier) => is_loose &= earlier == search,
                        None => {
                            found_by.insert(neighbour, search);
                            open.push(Reverse((away(neighbour), pentahedra.len())));
                            pentahedra.push(neighbour);
                        }
                    }
                }
            }
            if is_loose {
                pentahedra.sort_unstable();
                pieces.push(Piece {
                    pentahedra,
                    rest_volume_mm3: volume,
                });
            }
        }
        pieces
    }

    /// The pentahedra across those faces of which something is kept.
    fn connected(&self, pentahedron: u32) -> impl Iterator<Item = u32> + '_ {
        (0..FACES).filter_map(move |face| {
            let (other, _, _) = self.mesh.across(pentahedron, face)?;
            let points = self.points.of(pentahedron);
            let kept = |&local: &u32| self.points.values[points[local as usize] as usize] > 0.0;
            (points.is_empty() || self.mesh.sub(pentahedron).face_points[face].iter().any(kept)).then_some(other)
        })
    }
}
