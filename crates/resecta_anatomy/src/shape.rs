//! How the nodes and cells of a lattice are numbered.
//!
//! `index(i, j, k) = (k * slices + i) * angles + j`: the angle runs fastest, the layer slowest. A neighbour along the axis
//! or along the wall then stands at a constant distance in memory over a whole layer or over the whole lattice, and one
//! around the section over a ring but for its last node. A solver can walk the springs of a family in long runs of
//! contiguous memory.

/// Step `[slices, angles, layers]` from a node to its neighbour around the section, along the axis and along the wall:
/// the three families of springs of the papers (at most six neighbours a node).
pub const AXIS_STEPS: [[i32; 3]; 3] = [[0, 1, 0], [1, 0, 0], [0, 0, 1]];

/// Steps to the neighbours across the faces of the cells: both diagonals of each of the three families of faces. With
/// [`AXIS_STEPS`] they give an inner node 18 neighbours, and the lattice resistance to shear.
pub const DIAGONAL_STEPS: [[i32; 3]; 6] = [[0, 1, 1], [0, -1, 1], [1, 1, 0], [1, -1, 0], [1, 0, 1], [-1, 0, 1]];

/// Numbers of slices, angles and layers of a lattice, and what follows from them.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct LatticeShape {
    /// Sections along the axis, by rising z; at least 2.
    pub slices: u32,
    /// Rays around a section, cyclic, from `+x` (3 o'clock) towards `+y` (6 o'clock); at least 3.
    pub angles: u32,
    /// Layers from the urethra (0) to the capsule; at least 2.
    pub layers: u32,
}

impl LatticeShape {
    /// Number of nodes.
    pub const fn node_count(self) -> usize {
        self.slices as usize * self.angles as usize * self.layers as usize
    }

    /// Number of cells, each of eight nodes and two pentahedra.
    pub const fn cell_count(self) -> usize {
        (self.slices as usize - 1) * self.angles as usize * (self.layers as usize - 1)
    }

    /// Number of pentahedra.
    pub const fn pentahedron_count(self) -> usize {
        2 * self.cell_count()
    }

    /// Number of springs to axis neighbours, as in the papers: around the section, along the axis, along the wall.
    pub const fn axis_pair_count(self) -> usize {
        let (slices, angles, layers) = (self.slices as usize, self.angles as usize, self.layers as usize);
        angles * (slices * layers + (slices - 1) * layers + slices * (layers - 1))
    }

    /// Index of the node on slice `i`, ray `j` (any, it is taken modulo the angles) and layer `k`.
    pub const fn index(self, i: u32, j: u32, k: u32) -> u32 {
        (k * self.slices + i) * self.angles + j % self.angles
    }

    /// Slice, ray and layer `[i, j, k]` of a node.
    pub const fn coordinates(self, node: u32) -> [u32; 3] {
        let row = node / self.angles;
        [row % self.slices, node % self.angles, row / self.slices]
    }

    /// Index of the cell between slices `i`, `i + 1`, rays `j`, `j + 1` and layers `k`, `k + 1`. Its pentahedra are
    /// `2 * cell` and `2 * cell + 1`.
    pub const fn cell_index(self, i: u32, j: u32, k: u32) -> u32 {
        (k * (self.slices - 1) + i) * self.angles + j % self.angles
    }

    /// Slice, ray and layer `[i, j, k]` of a cell's lowest corner.
    pub const fn cell_coordinates(self, cell: u32) -> [u32; 3] {
        let row = cell / self.angles;
        [row % (self.slices - 1), cell % self.angles, row / (self.slices - 1)]
    }

    /// The two pentahedra of a cell, as node indices in the order of [`crate::wedge`].
    ///
    /// The section's quadrilateral is cut by its diagonal from `(j, k)` to `(j + 1, k + 1)`: the first pentahedron lies on
    /// the side of ray `j + 1`, the second on the side of ray `j`.
    pub fn cell_pentahedra(self, i: u32, j: u32, k: u32) -> [[u32; 6]; 2] {
        let corner = |i, j, k| self.index(i, j, k);
        let prism = |[a, b, c]: [[u32; 2]; 3]| {
            [
                corner(i, a[0], a[1]),
                corner(i, b[0], b[1]),
                corner(i, c[0], c[1]),
                corner(i + 1, a[0], a[1]),
                corner(i + 1, b[0], b[1]),
                corner(i + 1, c[0], c[1]),
            ]
        };
        [
            prism([[j, k], [j + 1, k], [j + 1, k + 1]]),
            prism([[j, k], [j + 1, k + 1], [j, k + 1]]),
        ]
    }

    /// All pentahedra, in the order of their indices.
    pub fn pentahedra(self) -> Vec<[u32; 6]> {
        let mut pentahedra = Vec::with_capacity(self.pentahedron_count());
        for k in 0..self.layers - 1 {
            for i in 0..self.slices - 1 {
                for j in 0..self.angles {
                    pentahedra.extend(self.cell_pentahedra(i, j, k));
                }
            }
        }
        pentahedra
    }

    /// Every pair of nodes one `step` (`[slices, angles, layers]`, see [`AXIS_STEPS`]) apart, the layer outermost, then the
    /// slice, then the angle. Between two pairs that follow each other, both nodes rise by one, except where a ring closes
    /// or the family skips a slice.
    pub fn pairs(self, step: [i32; 3]) -> impl Iterator<Item = [u32; 2]> {
        let [di, dj, dk] = step;
        let (first_slices, first_layers) = (inside(di, self.slices), inside(dk, self.layers));
        first_layers.flat_map(move |k| {
            first_slices.clone().flat_map(move |i| {
                (0..self.angles).map(move |j| {
                    let j_other = (i64::from(j) + i64::from(dj)).rem_euclid(i64::from(self.angles)) as u32;
                    [
                        self.index(i, j, k),
                        self.index(i.wrapping_add_signed(di), j_other, k.wrapping_add_signed(dk)),
                    ]
                })
            })
        })
    }

    /// The springs of the papers, family by family in the order of [`AXIS_STEPS`].
    pub fn axis_pairs(self) -> impl Iterator<Item = [u32; 2]> {
        AXIS_STEPS.into_iter().flat_map(move |step| self.pairs(step))
    }

    /// The diagonals of all cell faces, family by family in the order of [`DIAGONAL_STEPS`].
    pub fn diagonal_pairs(self) -> impl Iterator<Item = [u32; 2]> {
        DIAGONAL_STEPS.into_iter().flat_map(move |step| self.pairs(step))
    }
}

/// The numbers below `count` that stay in `0..count` after `step`.
fn inside(step: i32, count: u32) -> std::ops::Range<u32> {
    let magnitude = step.unsigned_abs();
    if step < 0 {
        magnitude.min(count)..count
    } else {
        0..count.saturating_sub(magnitude)
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use super::*;

    const SHAPE: LatticeShape = LatticeShape {
        slices: 4,
        angles: 5,
        layers: 3,
    };

    #[test]
    fn indices_and_coordinates_are_inverse() {
        for node in 0..SHAPE.node_count() as u32 {
            let [i, j, k] = SHAPE.coordinates(node);
            assert_eq!(SHAPE.index(i, j, k), node);
        }
        for cell in 0..SHAPE.cell_count() as u32 {
            let [i, j, k] = SHAPE.cell_coordinates(cell);
            assert_eq!(SHAPE.cell_index(i, j, k), cell);
            let pentahedra = SHAPE.pentahedra();
            let both = [pentahedra[2 * cell as usize], pentahedra[2 * cell as usize + 1]];
            assert_eq!(SHAPE.cell_pentahedra(i, j, k), both);
        }
    }

    #[test]
    fn no_pair_of_neighbours_comes_twice() {
        for angles in [3, 4, 5] {
            let shape = LatticeShape { angles, ..SHAPE };
            let pairs: Vec<[u32; 2]> = shape.axis_pairs().chain(shape.diagonal_pairs()).collect();
            let distinct: BTreeSet<[u32; 2]> = pairs.iter().map(|&[a, b]| [a.min(b), a.max(b)]).collect();
            assert_eq!(distinct.len(), pairs.len(), "{angles} angles");
        }
    }

    #[test]
    fn inner_nodes_have_six_axis_neighbours_and_eighteen_in_all() {
        let degree = |pairs: &[[u32; 2]]| {
            pairs
                .iter()
                .flatten()
                .filter(|&&node| node == SHAPE.index(1, 0, 1))
                .count()
        };
        let axis: Vec<[u32; 2]> = SHAPE.axis_pairs().collect();
        let diagonal: Vec<[u32; 2]> = SHAPE.diagonal_pairs().collect();
        assert_eq!(axis.len(), SHAPE.axis_pair_count());
        assert_eq!(degree(&axis), 6);
        assert_eq!(degree(&axis) + degree(&diagonal), 18);
    }

    #[test]
    fn springs_along_the_axis_and_the_wall_run_at_constant_offset() {
        for [a, b] in SHAPE.pairs(AXIS_STEPS[1]) {
            assert_eq!(b - a, SHAPE.angles);
        }
        for (place, [a, b]) in SHAPE.pairs(AXIS_STEPS[2]).enumerate() {
            assert_eq!([a, b], [place as u32, place as u32 + SHAPE.slices * SHAPE.angles]);
        }
    }
}
