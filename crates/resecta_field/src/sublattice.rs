//! The lattice inside a pentahedron: points, sub-prisms and which sub-prism lies across which face.
//!
//! The triangle is cut into `r²` similar triangles, the axis into `s` layers. The tables are the same for all
//! pentahedra, so there is one set of them. A sub-prism's corners stand in the order and sense of [`wedge`], so the
//! tables of faces and edges there hold for sub-prisms too, and a sub-prism's face on the boundary of its pentahedron
//! has the number of the pentahedron's face that it lies on.

use std::collections::HashMap;

use resecta_anatomy::wedge;

/// Faces of a prism: two triangles, then three quadrilaterals.
pub const FACES: usize = 5;

/// Most divisions of an edge: a pentahedron then has 18,513 points.
pub const MAX_DIVISIONS: usize = 32;

/// The corners of a face in outward cyclic order.
pub fn face_corners(face: usize) -> &'static [usize] {
    match face {
        0 | 1 => &wedge::TRIANGLES[face],
        _ => &wedge::QUADS[face - 2],
    }
}

/// A face of a sub-prism on the boundary of its pentahedron.
#[derive(Debug, Clone, Copy)]
pub struct BoundaryCell {
    /// Face of the pentahedron, and of the sub-prism.
    pub face: usize,
    pub prism: usize,
    /// Where on the face. Quadrilateral: steps from the face's corner 0 towards corner 3 and towards corner 1.
    /// Triangle: sums over the cell's corners of the steps towards the face's corners 0 and 1.
    at: [usize; 2],
    /// Number of the cell's first triangle among the fine triangles of the pentahedron's boundary; a quadrilateral has
    /// two.
    pub triangle: usize,
}

/// What lies across a sub-prism's face.
#[derive(Debug, Clone, Copy)]
pub enum Across {
    /// Another sub-prism of the pentahedron.
    Prism(usize),
    /// The boundary of the pentahedron: index into [`Sublattice::boundary`].
    Boundary(usize),
}

#[derive(Debug, Clone)]
pub struct Sublattice {
    /// Divisions of the triangles' edges.
    pub r: usize,
    /// Divisions along the axis.
    pub s: usize,
    /// Steps `(i, j, k)` of every point: `a = i / r`, `b = j / r`, `t = k / s`.
    pub steps: Vec<[usize; 3]>,
    /// Local coordinates of every point.
    pub places: Vec<[f64; 3]>,
    /// The points at the six corners of the pentahedron.
    pub corners: [u32; 6],
    /// Corner points of every sub-prism.
    pub prisms: Vec<[u32; 6]>,
    /// The points on every face.
    pub face_points: [Vec<u32>; FACES],
    pub across: Vec<[Across; FACES]>,
    pub boundary: Vec<BoundaryCell>,
    /// Cells of every face, as indices into `boundary`, by `at`, the second running fastest.
    by_place: [Vec<u32>; FACES],
    /// Fine triangles on the boundary of a pentahedron.
    pub boundary_triangles: usize,
}

impl Sublattice {
    pub fn new(r: usize, s: usize) -> Self {
        let row = |j: usize| j * (r + 1) - j * j.saturating_sub(1) / 2;
        let triangle_points = row(r) + 1;
        let index = |i: usize, j: usize, k: usize| (k * triangle_points + row(j) + i) as u32;
        let mut steps = Vec::new();
        let mut prisms = Vec::new();
        for k in 0..=s {
            for j in 0..=r {
                steps.extend((0..=r - j).map(|i| [i, j, k]));
            }
        }
        for k in 0..s {
            for (i, j) in (0..r).flat_map(|j| (0..r - j).map(move |i| (i, j))) {
                let prism = |corners: [(usize, usize); 3]| {
                    std::array::from_fn(|c| index(corners[c % 3].0, corners[c % 3].1, k + c / 3))
                };
                prisms.push(prism([(i, j), (i + 1, j), (i, j + 1)]));
                if i + j + 2 <= r {
                    prisms.push(prism([(i + 1, j), (i + 1, j + 1), (i, j + 1)]));
                }
            }
        }
        let places = (steps.iter())
            .map(|&[i, j, k]| [i as f64 / r as f64, j as f64 / r as f64, k as f64 / s as f64])
            .collect();
        let mut sub = Self {
            r,
            s,
            steps,
            places,
            corners: std::array::from_fn(|corner| {
                let [i, j] = [[0, 0], [r, 0], [0, r]][corner % 3];
                index(i, j, corner / 3 * s)
            }),
            prisms,
            face_points: Default::default(),
            across: Vec::new(),
            boundary: Vec::new(),
            by_place: std::array::from_fn(|face| {
                let size = if face < 2 { (3 * r + 1) * (3 * r + 1) } else { r * s };
                vec![0; size]
            }),
            boundary_triangles: 0,
        };
        sub.join();
        sub.face_points = std::array::from_fn(|face| sub.on_face(face));
        sub
    }

    /// Finds what lies across every face.
    fn join(&mut self) {
        let key = |prism: &[u32; 6], face: usize| {
            let mut points: Vec<u32> = face_corners(face).iter().map(|&corner| prism[corner]).collect();
            points.sort_unstable();
            points
        };
        let mut at: HashMap<Vec<u32>, Vec<(usize, usize)>> = HashMap::new();
        for (index, prism) in self.prisms.iter().enumerate() {
            for face in 0..FACES {
                at.entry(key(prism, face)).or_default().push((index, face));
            }
        }
        for index in 0..self.prisms.len() {
            let prism = self.prisms[index];
            let across = std::array::from_fn(|face| {
                let other = at[&key(&prism, face)].iter().find(|other| other.0 != index);
                match other {
                    Some(&(other, _)) => Across::Prism(other),
                    None => Across::Boundary(self.add_boundary(index, face)),
                }
            });
            self.across.push(across);
        }
    }

    fn add_boundary(&mut self, prism: usize, face: usize) -> usize {
        let corners = face_corners(face);
        let points = corners.iter().map(|&corner| self.prisms[prism][corner] as usize);
        let at = if face < 2 {
            let towards = |corner: usize| points.clone().map(|point| self.towards(point, corner % 3)).sum();
            [towards(corners[0]), towards(corners[1])]
        } else {
            let u = points.clone().map(|point| self.towards(point, corners[3] % 3)).min();
            let v = points.clone().map(|point| self.steps[point][2]).min();
            [u.unwrap_or(0), v.unwrap_or(0)]
        };
        let place = self.place_of(face, at);
        self.by_place[face][place] = self.boundary.len() as u32;
        self.boundary.push(BoundaryCell {
            face,
            prism,
            at,
            triangle: self.boundary_triangles,
        });
        self.boundary_triangles += if face < 2 { 1 } else { 2 };
        self.boundary.len() - 1
    }

    fn on_face(&self, face: usize) -> Vec<u32> {
        let end = face * self.s;
        let is_on = |&point: &u32| match face {
            0 | 1 => self.steps[point as usize][2] == end,
            // Face 2 + n joins the corners n and n + 1.
            _ => self.towards(point as usize, face % 3) == 0,
        };
        (0..self.steps.len() as u32).filter(is_on).collect()
    }

    /// Steps of a point towards corner 0, 1 or 2 of the triangle, out of `r`.
    pub fn towards(&self, point: usize, corner: usize) -> usize {
        let [i, j, _] = self.steps[point];
        [self.r - i - j, i, j][corner]
    }

    /// The cell of a neighbour's face that is this cell. `turn`: corner `m` of this pentahedron's face is corner
    /// `turn - m` (modulo their number) of the neighbour's.
    pub fn facing(&self, cell: &BoundaryCell, face: usize, turn: usize) -> &BoundaryCell {
        let [u, v] = cell.at;
        let at = if cell.face < 2 {
            let sums = [u, v, 3 * self.r - u - v];
            // The neighbour's corner n is this face's corner turn - n.
            [sums[turn % 3], sums[(turn + 2) % 3]]
        } else {
            match turn % 4 {
                0 => [v, u],
                1 => [u, self.s - 1 - v],
                2 => [self.s - 1 - v, self.r - 1 - u],
                _ => [self.r - 1 - u, v],
            }
        };
        &self.boundary[self.by_place[face][self.place_of(face, at)] as usize]
    }

    fn place_of(&self, face: usize, [u, v]: [usize; 2]) -> usize {
        u * if face < 2 { 3 * self.r + 1 } else { self.s } + v
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn counts_are_those_of_the_division() {
        let sub = Sublattice::new(4, 3);
        assert_eq!(sub.steps.len(), 15 * 4);
        assert_eq!(sub.prisms.len(), 16 * 3);
        assert_eq!(sub.boundary.len(), 2 * 16 + 3 * 4 * 3);
        assert_eq!(sub.boundary_triangles, 2 * 16 + 2 * 3 * 4 * 3);
    }

    #[test]
    fn faces_on_the_boundary_have_the_number_of_the_pentahedrons_face() {
        let sub = Sublattice::new(3, 2);
        for cell in &sub.boundary {
            let on_face = |corner: &usize| sub.face_points[cell.face].contains(&sub.prisms[cell.prism][*corner]);
            assert!(face_corners(cell.face).iter().all(on_face), "{cell:?}");
        }
    }
}
