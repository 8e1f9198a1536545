//! Pieces: parts of the tissue that nothing holds any more.
//!
//! Two pentahedra are connected where something is kept of the face between them. A pentahedron is one: two parts of it
//! that a cut has parted count as connected until one of them goes.

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

impl Field {
    /// The pieces of at most `most_mm3` among and around the given pentahedra (those that a cut took from) that hang by
    /// nothing. A pentahedron for which `held` is true is fixed to something, and so is all that is connected with it.
    /// [`Field::empty`] takes a piece away. Indices that name no pentahedron are passed over.
    ///
    /// The cost follows what is found: a search ends when it has found more than `most_mm3`.
    pub fn loose_pieces(&self, around: &[u32], most_mm3: f64, held: impl Fn(u32) -> bool) -> Vec<Piece> {
        let given: Vec<u32> = (around.iter().copied())
            .filter(|&pentahedron| (pentahedron as usize) < self.pentahedron_count())
            .collect();
        // Which search found a pentahedron; only looked up.
        let mut found_by: Lookup<u32, usize> = Lookup::default();
        let mut pieces = Vec::new();
        for (search, start) in self.mesh.ring(&given).into_iter().enumerate() {
            if self.kept_mm3(start) <= 0.0 || found_by.contains_key(&start) {
                continue;
            }
            found_by.insert(start, search);
            let mut pentahedra = vec![start];
            let (mut volume, mut next, mut is_loose) = (0.0, 0, true);
            while is_loose && next < pentahedra.len() {
                let pentahedron = pentahedra[next];
                next += 1;
                volume += self.kept_mm3(pentahedron);
                is_loose = volume <= most_mm3 && !held(pentahedron);
                for neighbour in self.connected(pentahedron) {
                    match found_by.get(&neighbour) {
                        // An earlier search ended before it came here: that piece is not loose, so neither is this.
                        Some(&earlier) => is_loose &= earlier == search,
                        None => {
                            found_by.insert(neighbour, search);
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
