//! The points of the sub-lattices, numbered over the whole mesh, and the values on them.
//!
//! A point belongs to the node, edge, face or interior that it lies in, so all pentahedra around name the same point
//! and neighbours always agree. Numbers are given, a node's, edge's, face's or interior's at once, when a pentahedron is
//! first touched; what nothing touched has none. They are free for others again when all pentahedra around are released.

use resecta_anatomy::wedge;

use crate::chips::Before;
use crate::field::Edit;
use crate::mesh::Mesh;
use crate::sublattice::{FACES, Place, face_corners};
use crate::surface::MOST_FREE;
use crate::{capsule, room, volume};

const NONE: u32 = u32::MAX;

/// Stands in the place of a cell that was released.
const RELEASED: u32 = u32::MAX - 1;

/// A touched pentahedron.
#[derive(Debug, Clone)]
pub struct Cell {
    /// Numbers of its points, in the order of its sub-lattice.
    pub points: Box<[u32]>,
    /// Rest volume removed of every sub-prism, mm³, before it is scaled.
    pub removed_mm3: Box<[f32]>,
    /// Sum of its sub-prisms' volumes at rest, mm³: what shares of it are taken of.
    pub prisms_mm3: f64,
    /// Rest volume still there, mm³.
    pub kept_mm3: f64,
    /// Area at rest of the capsule still there, mm².
    pub capsule_mm2: f64,
}

/// Values that an edit lowers.
pub struct Values<'a> {
    values: &'a mut [f32],
    marks: &'a mut [u32],
}

impl Values<'_> {
    /// Value and mark of a point.
    #[inline(always)]
    pub fn get(&self, point: u32) -> (f32, u32) {
        (self.values[point as usize], self.marks[point as usize])
    }

    #[inline(always)]
    pub fn look_at(&mut self, edit: &Edit, point: u32) {
        self.marks[point as usize] = edit.seen;
    }

    /// Lowers the value of a point, if it is lower, and tells a chip under way.
    #[inline(always)]
    pub fn lower(&mut self, edit: &Edit, before: &mut Before, point: u32, value: f32) {
        let old = &mut self.values[point as usize];
        if value < *old {
            before.remember_point(point, *old);
            let turns = *old > 0.0 && value <= 0.0;
            *old = value;
            let mark = if turns { edit.turned() } else { edit.changed() };
            let marked = &mut self.marks[point as usize];
            *marked = mark.max(*marked);
        }
    }
}

/// Points that are numbered together.
#[derive(Debug, Clone, Copy)]
struct Block {
    /// `NONE` without numbers.
    first: u32,
    /// Pentahedra around that are not released.
    around: u32,
}

#[derive(Debug, Clone, Default)]
pub struct Points {
    /// Signed distance to what has been cut, mm, by point; positive where tissue is kept.
    pub values: Vec<f32>,
    /// How deep inside coagulated tissue a point lies, mm, 0 outside; empty until something coagulates.
    pub coagulation: Vec<f32>,
    /// When a point was last looked at, see `Edit`.
    pub marks: Vec<u32>,
    /// Empty until something is touched.
    nodes: Vec<Block>,
    /// Points inside edges, counted from the smaller node.
    edges: Vec<Block>,
    faces: Vec<Block>,
    /// First numbers of free blocks, by their length, and how many points they have.
    free: Vec<Vec<u32>>,
    free_points: usize,
    /// Index of every pentahedron's cell; empty until something is touched.
    cell_of: Vec<u32>,
    cells: Vec<Cell>,
    free_cells: Vec<u32>,
}

impl Points {
    /// Those of some touched pentahedra, numbered anew, with other values: by their numbers here and the values that they
    /// have here. Nothing can be touched or released there. No edit may be under way.
    pub fn part(&mut self, pentahedra: &[u32], value: impl Fn(u32, f32) -> f32) -> Self {
        let mut part = Self {
            cell_of: vec![NONE; self.cell_of.len()],
            ..Self::default()
        };
        // Between edits the marks are room for the new numbers, 1 more than each: a list of its own would be as long as all
        // that was ever cut, and filling it take longer than the chip.
        self.forget_marks(pentahedra);
        for &pentahedron in pentahedra {
            let Some(index) = self.index(pentahedron) else {
                continue;
            };
            let cell = &self.cells[index];
            let number = |&point: &u32| {
                let (mark, its) = (&mut self.marks[point as usize], self.values[point as usize]);
                if *mark == 0 {
                    part.values.push(value(point, its));
                    *mark = part.values.len() as u32;
                    if !self.coagulation.is_empty() {
                        part.coagulation.push(self.coagulation[point as usize]);
                    }
                }
                *mark - 1
            };
            let points = cell.points.iter().map(number).collect();
            part.cell_of[pentahedron as usize] = part.cells.len() as u32;
            part.cells.push(Cell {
                points,
                removed_mm3: Box::default(),
                ..*cell
            });
        }
        self.forget_marks(pentahedra);
        part
    }

    fn forget_marks(&mut self, pentahedra: &[u32]) {
        for &pentahedron in pentahedra {
            if let Some(index) = self.index(pentahedron) {
                let points = &self.cells[index].points;
                points.iter().for_each(|&point| self.marks[point as usize] = 0);
            }
        }
    }

    /// Index of a touched pentahedron's cell.
    pub fn index(&self, pentahedron: u32) -> Option<usize> {
        let index = *self.cell_of.get(pentahedron as usize)?;
        (index < RELEASED).then_some(index as usize)
    }

    /// None if untouched or released.
    pub fn cell(&self, pentahedron: u32) -> Option<&Cell> {
        Some(&self.cells[self.index(pentahedron)?])
    }

    /// A cell by its index, and the values and marks of all points.
    pub fn cell_and_values(&mut self, index: usize) -> (&mut Cell, &[f32], &[u32]) {
        (&mut self.cells[index], &self.values, &self.marks)
    }

    /// Cells, free ones included.
    pub fn cell_count(&self) -> usize {
        self.cells.len()
    }

    /// Whether a pentahedron has, or had, points.
    pub fn is_touched(&self, pentahedron: u32) -> bool {
        self.cell_of
            .get(pentahedron as usize)
            .is_some_and(|&index| index != NONE)
    }

    /// Rest volume kept of a touched pentahedron, mm³.
    pub fn kept_mm3(&self, pentahedron: u32) -> Option<f64> {
        self.is_touched(pentahedron)
            .then(|| self.cell(pentahedron).map_or(0.0, |cell| cell.kept_mm3))
    }

    /// Signed distance of a node to what has been cut, mm; `None` if nothing around it is touched, or all of it is gone.
    pub fn value_at_node(&self, node: u32) -> Option<f32> {
        let block = self.nodes.get(node as usize)?;
        (block.first != NONE && block.around > 0).then(|| self.values[block.first as usize])
    }

    /// Numbers of the points of a pentahedron; empty if it has none.
    pub fn of(&self, pentahedron: u32) -> &[u32] {
        self.cell(pentahedron).map_or(&[], |cell| &cell.points)
    }

    /// The same, and the values of all points to be lowered.
    pub fn of_and_values(&mut self, pentahedron: u32) -> (&[u32], Values<'_>) {
        let ids: &[u32] = match self.index(pentahedron) {
            Some(index) => &self.cells[index].points,
            None => &[],
        };
        let values = Values {
            values: &mut self.values,
            marks: &mut self.marks,
        };
        (ids, values)
    }

    /// The values of all points, to be lowered.
    pub fn values_mut(&mut self) -> Values<'_> {
        Values {
            values: &mut self.values,
            marks: &mut self.marks,
        }
    }

    /// Gives a pentahedron that has none points, new ones with the value `band`. Nothing happens if it has them or was
    /// released.
    pub fn touch(&mut self, mesh: &Mesh, pentahedron: u32, band: f32) {
        if self.cell_of.is_empty() {
            self.begin(mesh);
        }
        if self.cell_of[pentahedron as usize] != NONE {
            return;
        }
        let points = self.number(mesh, pentahedron, band);
        let cell = Cell {
            prisms_mm3: volume::prisms_mm3(mesh, pentahedron),
            points,
            removed_mm3: vec![0.0; mesh.sub(pentahedron).prism_count()].into(),
            kept_mm3: mesh.rest_volumes[pentahedron as usize],
            capsule_mm2: capsule::rest_mm2(mesh, pentahedron),
        };
        self.cell_of[pentahedron as usize] = match self.free_cells.pop() {
            Some(index) => {
                self.cells[index as usize] = cell;
                index
            }
            None => {
                self.cells.push(cell);
                self.cells.len() as u32 - 1
            }
        };
    }

    /// Gives back the points of a pentahedron of which nothing is left, those that no other has or may get. It is never
    /// touched again.
    pub fn release(&mut self, mesh: &Mesh, pentahedron: u32) {
        let Some(index) = self.index(pentahedron) else {
            return;
        };
        let sub = mesh.sub(pentahedron);
        let interior = (self.cells[index].points.iter().zip(&sub.parts)).find(|(_, part)| **part == Place::Interior);
        let interior = interior.map_or(NONE, |(&first, _)| first);
        let n = pentahedron as usize;
        let leave = |block: &mut Block| {
            block.around -= 1;
            if block.around == 0 { block.first } else { NONE }
        };
        let mut freed = vec![(interior, sub.interior)];
        freed.extend(mesh.pentahedra[n].map(|node| (leave(&mut self.nodes[node as usize]), 1)));
        for (local, &edge) in mesh.edges[n].iter().enumerate() {
            freed.push((leave(&mut self.edges[edge as usize]), sub.divisions.of(local) - 1));
        }
        for (face, &number) in mesh.faces[n].iter().enumerate() {
            freed.push((leave(&mut self.faces[number as usize]), sub.inside_face(face)));
        }
        for (first, count) in freed {
            if first == NONE || count == 0 {
                continue;
            }
            if self.free.len() <= count {
                self.free.resize(count + 1, Vec::new());
            }
            self.free[count].push(first);
            self.free_points += count;
        }
        let empty = Cell {
            points: Box::default(),
            removed_mm3: Box::default(),
            prisms_mm3: 1.0,
            kept_mm3: 0.0,
            capsule_mm2: 0.0,
        };
        self.cells[index] = empty;
        self.free_cells.push(index as u32);
        self.cell_of[n] = RELEASED;
    }

    /// Gives back free points at the end, where those are most of all.
    pub fn trim(&mut self) {
        let half = self.values.len() / 2;
        if self.free_points <= MOST_FREE.max(half) {
            return;
        }
        let mut blocks: Vec<(usize, usize)> = (self.free.iter().enumerate())
            .flat_map(|(count, firsts)| firsts.iter().map(move |&first| (first as usize, count)))
            .collect();
        blocks.sort_unstable();
        let mut end = self.values.len();
        for &(first, count) in blocks.iter().rev() {
            if first + count < end {
                break;
            }
            end = first;
        }
        if end > half {
            return;
        }
        self.free_points -= self.values.len() - end;
        for firsts in &mut self.free {
            firsts.retain(|&first| (first as usize) < end);
        }
        room::cut_off(&mut self.values, end);
        room::cut_off(&mut self.coagulation, end);
        room::cut_off(&mut self.marks, end);
    }

    pub fn make_room(&mut self) {
        room::make(&mut self.values);
        room::make(&mut self.coagulation);
        room::make(&mut self.marks);
        room::make(&mut self.cells);
    }

    /// Point inside an edge of a pentahedron, by its steps from the edge's first corner; none if nothing touched the
    /// edge.
    pub fn inside_edge(&self, mesh: &Mesh, pentahedron: u32, local: usize, step: usize) -> Option<u32> {
        let block = self.edges.get(mesh.edges[pentahedron as usize][local] as usize)?;
        (block.first != NONE).then(|| block.first + along(mesh, pentahedron, local, step))
    }

    fn begin(&mut self, mesh: &Mesh) {
        let block = Block { first: NONE, around: 0 };
        self.cell_of = vec![NONE; mesh.pentahedra.len()];
        self.nodes = vec![block; mesh.rest.len()];
        self.edges = vec![block; mesh.edge_count];
        self.faces = vec![block; mesh.face_count];
        let count = |blocks: &mut Vec<Block>, number: &u32| blocks[*number as usize].around += 1;
        for n in 0..mesh.pentahedra.len() {
            mesh.pentahedra[n].iter().for_each(|node| count(&mut self.nodes, node));
            mesh.edges[n].iter().for_each(|edge| count(&mut self.edges, edge));
            mesh.faces[n].iter().for_each(|face| count(&mut self.faces, face));
        }
    }

    fn number(&mut self, mesh: &Mesh, pentahedron: u32, band: f32) -> Box<[u32]> {
        let n = pentahedron as usize;
        let sub = mesh.sub(pentahedron);
        let Self {
            values,
            coagulation,
            marks,
            nodes,
            edges,
            faces,
            free,
            free_points,
            ..
        } = self;
        let mut new = |count: usize| -> u32 {
            if let Some(first) = free.get_mut(count).and_then(Vec::pop) {
                *free_points -= count;
                let range = first as usize..first as usize + count;
                values[range.clone()].fill(band);
                marks[range.clone()].fill(0);
                if !coagulation.is_empty() {
                    coagulation[range].fill(0.0);
                }
                return first;
            }
            let first = values.len() as u32;
            values.resize(values.len() + count, band);
            marks.resize(values.len(), 0);
            if !coagulation.is_empty() {
                coagulation.resize(values.len(), 0.0);
            }
            first
        };
        let mut first = |block: &mut Block, count: usize| {
            if block.first == NONE {
                block.first = new(count);
            }
            block.first
        };
        let corners = mesh.pentahedra[n].map(|node| first(&mut nodes[node as usize], 1));
        let edges: [u32; 9] = std::array::from_fn(|local| {
            let number = mesh.edges[n][local] as usize;
            first(&mut edges[number], sub.divisions.of(local) - 1)
        });
        let faces: [u32; FACES] = std::array::from_fn(|face| {
            let number = mesh.faces[n][face] as usize;
            first(&mut faces[number], sub.inside_face(face))
        });
        let mut interior = new(sub.interior);
        (sub.parts.iter())
            .map(|&part| match part {
                Place::Node(corner) => corners[usize::from(corner)],
                Place::Edge(local, step) => {
                    let local = usize::from(local);
                    edges[local] + along(mesh, pentahedron, local, step.into())
                }
                Place::Triangle(face, number) => faces[usize::from(face)] + u32::from(number),
                Place::Quad(face, at) => {
                    let (face, at) = (usize::from(face), at.map(usize::from));
                    let nodes = std::array::from_fn(|n| mesh.pentahedra[pentahedron as usize][face_corners(face)[n]]);
                    faces[face] + in_quad(nodes, at, [sub.divisions.sides[face - 2], sub.divisions.axis])
                }
                Place::Interior => {
                    interior += 1;
                    interior - 1
                }
            })
            .collect()
    }

    /// Bytes held.
    pub fn bytes(&self) -> usize {
        let cells = (self.cells.iter())
            .map(|cell| 4 * (cell.points.len() + cell.removed_mm3.len()))
            .sum::<usize>();
        let free: usize = self.free.iter().map(|free| 4 * free.capacity()).sum();
        cells
            + free
            + 4 * (self.values.capacity() + self.coagulation.capacity() + self.marks.capacity())
            + 4 * (self.cell_of.capacity() + self.free_cells.capacity())
            + size_of::<Block>() * (self.nodes.capacity() + self.edges.capacity() + self.faces.capacity())
            + self.cells.capacity() * size_of::<Cell>()
    }
}

/// Index of a point inside an edge, counted from the smaller node, by its steps from the edge's first corner.
fn along(mesh: &Mesh, pentahedron: u32, local: usize, step: usize) -> u32 {
    let [a, b] = wedge::EDGES[local].map(|end| mesh.pentahedra[pentahedron as usize][end]);
    let divisions = mesh.sub(pentahedron).divisions.of(local);
    (if a < b { step } else { divisions - step }) as u32 - 1
}

/// Index of a point inside a quadrilateral face: steps from its smallest node, first towards the smaller of the two
/// nodes beside it. `at`, `parts`: steps and parts towards the face's corner 3 and towards its corner 1.
fn in_quad(nodes: [u32; 4], at: [usize; 2], parts: [usize; 2]) -> u32 {
    let smallest = (0..4).min_by_key(|&corner| nodes[corner]).unwrap_or(0);
    let [u, v] = at;
    let [r, s] = parts;
    let from_u = if smallest == 0 || smallest == 1 { u } else { r - u };
    let from_v = if smallest == 0 || smallest == 3 { v } else { s - v };
    // Corners 0 and 1, 2 and 3 are joined along v.
    let beside_along_v = nodes[smallest ^ 1];
    let beside_along_u = nodes[3 - smallest];
    let (x, y, length) = if beside_along_u < beside_along_v {
        (from_u, from_v, r)
    } else {
        (from_v, from_u, s)
    };
    ((y - 1) * (length - 1) + x - 1) as u32
}
