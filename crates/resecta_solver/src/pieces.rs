//! Pieces: what a cut leaves hanging by nothing.
//!
//! A piece that shares no face with the rest is held by no tissue: at most an edge or a corner joins it. It comes free with
//! the cut, as a chip does, rather than fly about under the forces that the cut left on its nodes.

use std::collections::VecDeque;

use crate::tissue::Tissue;

/// More pentahedra are no piece that comes free, but a part of the organ.
const LARGEST: usize = 200;

/// What is known of a pentahedron.
#[derive(Clone, Copy, PartialEq)]
enum State {
    Unknown,
    Removed,
    /// Met by the search under way.
    Met,
    /// Part of something larger than a piece.
    Held,
}

impl Tissue {
    /// The pentahedra that come free if those given are removed, rising: pieces of at most 200 and less than half of what
    /// is left, that share no face with the rest.
    pub fn pieces_cut_free(&self, removed: &[u32]) -> Vec<u32> {
        let mut state = vec![State::Unknown; self.pentahedron_count()];
        let mut left = self.living.pentahedra;
        for &pentahedron in removed.iter().filter(|&&removed| self.is_pentahedron_alive(removed)) {
            if std::mem::replace(&mut state[pentahedron as usize], State::Removed) == State::Unknown {
                left -= 1;
            }
        }
        let mut free = Vec::new();
        for &pentahedron in removed.iter().filter(|&&removed| self.is_pentahedron_alive(removed)) {
            for start in self.surface.neighbours(pentahedron, &self.pentahedra.alive) {
                if state[start as usize] != State::Unknown {
                    continue;
                }
                let (piece, is_free) = self.piece_around(start, &mut state);
                if is_free && 2 * piece.len() < left {
                    left -= piece.len();
                    piece.iter().for_each(|&member| state[member as usize] = State::Removed);
                    free.extend(piece);
                } else {
                    piece.iter().for_each(|&member| state[member as usize] = State::Held);
                }
            }
        }
        free.sort_unstable();
        free
    }

    /// Follows shared faces from a pentahedron until there are no more, or enough to know that it is held. Tells what was
    /// met, and whether that is a piece by itself.
    fn piece_around(&self, start: u32, state: &mut [State]) -> (Vec<u32>, bool) {
        let mut piece = vec![start];
        let mut next = VecDeque::from([start]);
        state[start as usize] = State::Met;
        while let Some(pentahedron) = next.pop_front() {
            for neighbour in self.surface.neighbours(pentahedron, &self.pentahedra.alive) {
                match state[neighbour as usize] {
                    State::Removed | State::Met => {}
                    State::Held => return (piece, false),
                    State::Unknown if piece.len() == LARGEST => return (piece, false),
                    State::Unknown => {
                        state[neighbour as usize] = State::Met;
                        piece.push(neighbour);
                        next.push_back(neighbour);
                    }
                }
            }
        }
        (piece, true)
    }
}
