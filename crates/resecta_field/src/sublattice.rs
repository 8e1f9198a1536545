//! The lattice inside a pentahedron: points, sub-prisms and which sub-prism lies across which face.
//!
//! The triangle is cut as in `triangle.rs`, the axis into layers. Pentahedra whose edges have the same numbers of parts
//! share one set of tables. A sub-prism's corners stand in the order and sense of [`wedge`], so the tables of faces and
//! edges there hold for sub-prisms too, and a sub-prism's face on the boundary of its pentahedron has the number of the
//! pentahedron's face that it lies on.
//!
//! A gland has some 300 kinds of pentahedra, and a cut reads their tables in no order. So numbers in tables take a byte or two where that is
//! enough: tables of the large gland take 25 MB for 86, more than all else that is cut with.

use std::collections::HashMap;

use resecta_anatomy::wedge;

use crate::triangle::{Part, Triangle};

/// Faces of a prism: two triangles, then three quadrilaterals.
pub const FACES: usize = 5;

/// Most parts of an edge: a pentahedron then has 18,513 points, 32,768 sub-prisms and 5,120 cells of its boundary.
pub const MAX_DIVISIONS: usize = 32;

/// Places worked on at a time.
pub const LANES: usize = 8;

pub type Lanes = [f32; LANES];

/// The corners of a face in outward cyclic order.
pub fn face_corners(face: usize) -> &'static [usize] {
    match face {
        0 | 1 => &wedge::TRIANGLES[face],
        _ => &wedge::QUADS[face - 2],
    }
}

/// Parts of a pentahedron's edges: of its triangles' sides (0, 1), (1, 2), (2, 0), falling, and of the axial edges.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Divisions {
    pub sides: [usize; 3],
    pub axis: usize,
}

impl Divisions {
    /// Of an edge, in the order of [`wedge::EDGES`].
    pub fn of(&self, edge: usize) -> usize {
        if edge < 6 { self.sides[edge % 3] } else { self.axis }
    }
}

/// The part of a pentahedron that a point lies in; faces and edges by their local numbers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Place {
    Node(u8),
    /// With the steps from the edge's first corner.
    Edge(u8, u8),
    /// With a running number, the same on both ends.
    Triangle(u8, u16),
    /// With the steps from the face's corner 0 towards corner 3 and towards corner 1.
    Quad(u8, [u8; 2]),
    Interior,
}

impl Place {
    /// The local corners that the part joins.
    pub fn corners(self) -> Vec<usize> {
        match self {
            Place::Node(corner) => vec![corner.into()],
            Place::Edge(n, _) => wedge::EDGES[usize::from(n)].to_vec(),
            Place::Triangle(face, _) | Place::Quad(face, _) => face_corners(face.into()).to_vec(),
            Place::Interior => (0..6).collect(),
        }
    }
}

/// A face of a sub-prism on the boundary of its pentahedron.
#[derive(Debug, Clone, Copy)]
pub struct BoundaryCell {
    face: u8,
    prism: u16,
    /// Where on the face. Quadrilateral: steps from the face's corner 0 towards corner 3 and towards corner 1.
    /// Triangle: its number in the section, and 0.
    at: [u16; 2],
    triangle: u16,
}

impl BoundaryCell {
    /// Face of the pentahedron, and of the sub-prism.
    pub fn face(&self) -> usize {
        self.face.into()
    }

    pub fn prism(&self) -> usize {
        self.prism.into()
    }

    /// Number of the cell's first triangle among the fine triangles of the pentahedron's boundary; a quadrilateral has
    /// two.
    pub fn triangle(&self) -> usize {
        self.triangle.into()
    }
}

/// What lies across a sub-prism's face.
#[derive(Debug, Clone, Copy)]
pub enum Across {
    /// Another sub-prism of the pentahedron.
    Prism(usize),
    /// The boundary of the pentahedron: index into [`Sublattice::boundary`].
    Boundary(usize),
}

/// In a table of what lies across: the number is that of a cell of the boundary.
const ON_BOUNDARY: u16 = 1 << 15;

#[derive(Debug, Clone)]
pub struct Sublattice {
    pub divisions: Divisions,
    /// Local coordinates of every point, see `shape.rs`.
    pub places: Vec<[f64; 3]>,
    /// The same in single precision by component, eight points at a time; what is left of the last eight repeats the last point.
    pub lanes: Vec<[Lanes; 3]>,
    /// The part of the pentahedron that every point lies in.
    pub parts: Vec<Place>,
    /// Corner points of every sub-prism: see [`Sublattice::prism`].
    prisms: Vec<[u16; 6]>,
    /// The points on every face.
    pub face_points: [Vec<u32>; FACES],
    /// What lies across every face of every sub-prism: see [`Sublattice::across`].
    across: Vec<[u16; FACES]>,
    pub boundary: Vec<BoundaryCell>,
    /// Cells of every face, as indices into `boundary`, by `at`, the second running fastest.
    by_place: [Vec<u16>; FACES],
    /// Fine triangles on the boundary of a pentahedron.
    pub boundary_triangles: usize,
    /// Points inside a triangular face.
    inside_triangle: usize,
    /// Points inside the pentahedron.
    pub interior: usize,
}

impl Sublattice {
    pub fn new(divisions: Divisions) -> Self {
        let section = Triangle::new(divisions.sides);
        let count = section.places.len();
        let axis = divisions.axis;
        let inside_triangle = section
            .parts
            .iter()
            .filter(|part| matches!(part, Part::Inside(_)))
            .count();
        let mut sub = Self {
            divisions,
            places: Vec::new(),
            lanes: Vec::new(),
            parts: Vec::new(),
            prisms: Vec::new(),
            face_points: Default::default(),
            across: Vec::new(),
            boundary: Vec::new(),
            by_place: std::array::from_fn(|face| {
                let cells = if face < 2 {
                    section.triangles.len()
                } else {
                    divisions.sides[face - 2] * axis
                };
                vec![0; cells]
            }),
            boundary_triangles: 0,
            inside_triangle,
            interior: inside_triangle * (axis - 1),
        };
        for layer in 0..=axis {
            for (&[a, b], &part) in section.places.iter().zip(&section.parts) {
                sub.places.push([a, b, layer as f64 / axis as f64]);
                sub.parts.push(sub.place(part, layer));
            }
        }
        for layer in 0..axis {
            for triangle in &section.triangles {
                sub.prisms.push(std::array::from_fn(|c| {
                    ((layer + c / 3) * count + triangle[c % 3]) as u16
                }));
            }
        }
        sub.lanes = sub
            .places
            .chunks(LANES)
            .map(|places| {
                std::array::from_fn(|axis| std::array::from_fn(|lane| places[lane.min(places.len() - 1)][axis] as f32))
            })
            .collect();
        sub.join(section.triangles.len());
        sub.face_points = std::array::from_fn(|face| sub.on_face(face));
        sub
    }

    /// Points inside a face.
    pub fn inside_face(&self, face: usize) -> usize {
        match face {
            0 | 1 => self.inside_triangle,
            _ => (self.divisions.sides[face - 2] - 1) * (self.divisions.axis - 1),
        }
    }

    fn place(&self, part: Part, layer: usize) -> Place {
        let axis = self.divisions.axis;
        let end = if layer == 0 {
            Some(0)
        } else {
            (layer == axis).then_some(1)
        };
        match (part, end) {
            (Part::Corner(corner), Some(end)) => Place::Node((corner + 3 * end) as u8),
            (Part::Corner(corner), None) => Place::Edge((6 + corner) as u8, layer as u8),
            (Part::Side(side, step), Some(end)) => Place::Edge((side + 3 * end) as u8, step as u8),
            (Part::Side(side, step), None) => Place::Quad((2 + side) as u8, [step as u8, layer as u8]),
            (Part::Inside(number), Some(end)) => Place::Triangle(end as u8, number as u16),
            (Part::Inside(_), None) => Place::Interior,
        }
    }

    /// Finds what lies across every face. `section`: triangles of a layer.
    fn join(&mut self, section: usize) {
        let key = |prism: &[u16; 6], face: usize| {
            let mut points: Vec<u16> = face_corners(face).iter().map(|&corner| prism[corner]).collect();
            points.sort_unstable();
            points
        };
        let mut at: HashMap<Vec<u16>, Vec<(usize, usize)>> = HashMap::new();
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
                    Some(&(other, _)) => other as u16,
                    None => ON_BOUNDARY | self.add_boundary(index, face, section) as u16,
                }
            });
            self.across.push(across);
        }
    }

    fn add_boundary(&mut self, prism: usize, face: usize, section: usize) -> usize {
        let at = if face < 2 {
            [prism % section, 0]
        } else {
            let first = self.prisms[prism][face_corners(face)[0]];
            let steps = self.on_side(first as usize, face - 2).unwrap_or(0);
            [steps, prism / section]
        };
        let place = self.place_of(face, at);
        self.by_place[face][place] = self.boundary.len() as u16;
        self.boundary.push(BoundaryCell {
            face: face as u8,
            prism: prism as u16,
            at: at.map(|steps| steps as u16),
            triangle: self.boundary_triangles as u16,
        });
        self.boundary_triangles += if face < 2 { 1 } else { 2 };
        self.boundary.len() - 1
    }

    /// Steps of a point along a side of the triangle, if it lies on the face over it.
    fn on_side(&self, point: usize, side: usize) -> Option<usize> {
        let corner = |corner: usize| {
            if corner == side {
                Some(0)
            } else {
                (corner == (side + 1) % 3).then_some(self.divisions.sides[side])
            }
        };
        match self.parts[point] {
            Place::Node(node) => corner(usize::from(node) % 3),
            Place::Edge(n, _) if n >= 6 => corner(usize::from(n) - 6),
            Place::Edge(n, step) => (usize::from(n) % 3 == side).then_some(step.into()),
            Place::Quad(face, [step, _]) => (usize::from(face) == side + 2).then_some(step.into()),
            Place::Triangle(..) | Place::Interior => None,
        }
    }

    fn on_face(&self, face: usize) -> Vec<u32> {
        let is_on = |&point: &u32| match face {
            0 | 1 => self.places[point as usize][2] == face as f64,
            _ => self.on_side(point as usize, face - 2).is_some(),
        };
        (0..self.places.len() as u32).filter(is_on).collect()
    }

    /// Local coordinates of a point in single precision.
    #[inline]
    pub fn near_place(&self, point: usize) -> [f32; 3] {
        self.places[point].map(|component| component as f32)
    }

    /// Number of sub-prisms.
    pub fn prism_count(&self) -> usize {
        self.prisms.len()
    }

    /// Corner points of a sub-prism.
    #[inline]
    pub fn prism(&self, number: usize) -> [u32; 6] {
        self.prisms[number].map(u32::from)
    }

    /// Corner points of every sub-prism.
    pub fn prisms(&self) -> impl Iterator<Item = [u32; 6]> + '_ {
        self.prisms.iter().map(|prism| prism.map(u32::from))
    }

    /// What lies across a face of a sub-prism.
    #[inline]
    pub fn across(&self, prism: usize, face: usize) -> Across {
        let number = self.across[prism][face];
        if number & ON_BOUNDARY == 0 {
            Across::Prism(number.into())
        } else {
            Across::Boundary((number & !ON_BOUNDARY).into())
        }
    }

    /// The cell of this pentahedron's face that is a cell of its neighbour's. `turn`: corner `m` of the neighbour's face
    /// is corner `turn - m` (modulo their number) of this one's.
    pub fn facing(&self, cell: &BoundaryCell, face: usize, turn: usize) -> &BoundaryCell {
        let [u, v] = cell.at.map(usize::from);
        let at = if face < 2 {
            [u, v]
        } else {
            let (r, s) = (self.divisions.sides[face - 2], self.divisions.axis);
            match turn % 4 {
                0 => [v, u],
                1 => [u, s - 1 - v],
                2 => [r - 1 - v, s - 1 - u],
                _ => [r - 1 - u, v],
            }
        };
        &self.boundary[self.by_place[face][self.place_of(face, at)] as usize]
    }

    fn place_of(&self, face: usize, [u, v]: [usize; 2]) -> usize {
        if face < 2 { u } else { u * self.divisions.axis + v }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sublattice(sides: [usize; 3], axis: usize) -> Sublattice {
        Sublattice::new(Divisions { sides, axis })
    }

    #[test]
    fn counts_are_those_of_the_division() {
        let sub = sublattice([4, 4, 4], 3);
        assert_eq!(sub.places.len(), 15 * 4);
        assert_eq!(sub.prism_count(), 16 * 3);
        assert_eq!(sub.boundary.len(), 2 * 16 + 3 * 4 * 3);
        assert_eq!(sub.boundary_triangles, 2 * 16 + 2 * 3 * 4 * 3);
    }

    #[test]
    fn faces_on_the_boundary_have_the_number_of_the_pentahedrons_face() {
        for (sides, axis) in [
            ([3, 3, 3], 2),
            ([5, 3, 2], 3),
            ([7, 7, 4], 1),
            ([2, 1, 1], 4),
            ([1, 1, 1], 1),
        ] {
            let sub = sublattice(sides, axis);
            for cell in &sub.boundary {
                let on_face = |corner: &usize| sub.face_points[cell.face()].contains(&sub.prism(cell.prism())[*corner]);
                assert!(face_corners(cell.face()).iter().all(on_face), "{sides:?} {cell:?}");
            }
            let cells: usize = sides.iter().map(|side| side * axis).sum();
            let quads = sub.boundary.iter().filter(|cell| cell.face() >= 2).count();
            assert_eq!(quads, cells, "{sides:?}");
        }
    }
}
