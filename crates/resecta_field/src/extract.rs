//! The surface of what is kept inside touched pentahedra: a dual method ("surface nets") on the sub-prisms.
//!
//! Around every sub-lattice edge between a kept point `k` and a removed one `m` stands the polygon of the vertices of
//! the sub-prisms around it, counter-clockwise about the direction from `k` to `m`. Its sides join prisms that share a
//! face; a face has as many such edges in one sense as in the other, so every side has its opposite. Values only fall:
//! the polygon comes when `m` is removed and stays until `k` is.
//!
//! An edge on the exposed surface has a fan of prisms between two exposed fine triangles. Its polygon begins and ends
//! in the rim vertices of these two, and the triangle of `k` and both rims closes it on the exposed surface. Where the
//! pentahedra at an edge form several fans, each is closed by itself: the two triangles belong together through the
//! tissue between them, never across a gap. What else is kept of an exposed fine triangle is the triangle itself, or,
//! of one with two kept corners, those two and its rim.

use resecta_anatomy::wedge;

use crate::crossings::{Gathered, Sample, fine_triangles};
use crate::mesh::Mesh;
use crate::points::Points;
use crate::sublattice::{Across, FACES, Sublattice};
use crate::surface::{NONE, Piece, Surface};

/// More sub-prisms than ever stand around an edge.
const MOST_AROUND: usize = 100_000;

const EDGES: usize = wedge::EDGES.len();

/// By two corners: the number of their edge, and the face whose outward cycle runs from the first to the second.
struct Corners {
    edge: [[u8; 6]; 6],
    left: [[u8; 6]; 6],
}

const CORNERS: Corners = {
    let mut corners = Corners {
        edge: [[0; 6]; 6],
        left: [[0; 6]; 6],
    };
    let mut n = 0;
    while n < EDGES {
        let [a, b] = wedge::EDGES[n];
        corners.edge[a][b] = n as u8;
        corners.edge[b][a] = n as u8;
        n += 1;
    }
    let mut face = 0;
    while face < FACES {
        let count = if face < 2 { 3 } else { 4 };
        let mut n = 0;
        while n < count {
            let (a, b) = if face < 2 {
                (wedge::TRIANGLES[face][n], wedge::TRIANGLES[face][(n + 1) % 3])
            } else {
                (wedge::QUADS[face - 2][n], wedge::QUADS[face - 2][(n + 1) % 4])
            };
            corners.left[a][b] = face as u8;
            n += 1;
        }
        face += 1;
    }
    corners
};

/// A sub-prism.
#[derive(Clone, Copy)]
struct At<'a> {
    pentahedron: u32,
    /// Index of its cell.
    cell: usize,
    sub: &'a Sublattice,
    points: &'a [u32],
    piece: &'a Piece,
    prism: usize,
}

impl At<'_> {
    /// The corner of the prism that is this point, as a point of the pentahedron.
    fn local(&self, point: u32) -> u32 {
        let corners = self.sub.prism(self.prism);
        let mut points = [0; 6];
        for (point, corner) in points.iter_mut().zip(corners) {
            *point = self.points[corner as usize];
        }
        corners[find(&points, point)]
    }
}

/// Where a number stands, without branches: which corner it is cannot be foretold.
#[inline(always)]
fn find(numbers: &[u32; 6], number: u32) -> usize {
    let mut at = 0;
    for (n, &other) in numbers.iter().enumerate() {
        at = if other == number { n } else { at };
    }
    at
}

/// What has been extracted of some pentahedra, and room for it that is used again.
#[derive(Debug, Clone, Default)]
pub struct Walks {
    /// By cell: where the bits of its prisms begin; `NONE` of cells that are not extracted.
    begin: Vec<u32>,
    /// A bit for every edge of a prism whose polygon is done.
    done: Vec<u16>,
    /// Triangles, the pentahedra whose pieces they belong to, and the kept points that they hang on (see `Surface::add`).
    pub found: Vec<(u32, u32, [u32; 3])>,
    /// Room for a pentahedron's points and for the two halves of a polygon.
    kept: Vec<bool>,
    turned: Vec<bool>,
    ahead: Vec<u32>,
    behind: Vec<u32>,
}

impl Walks {
    /// Begins with nothing, of these pentahedra. What was begun before must have ended.
    pub fn begin(&mut self, mesh: &Mesh, points: &Points, pentahedra: &[u32]) {
        // Of few of all cells: those of the last time were forgotten one by one, so that a cut costs what it reaches.
        self.begin.resize(points.cell_count(), NONE);
        let mut prisms = 0;
        for &pentahedron in pentahedra {
            if let Some(cell) = points.index(pentahedron) {
                self.begin[cell] = prisms as u32;
                prisms += mesh.sub(pentahedron).prism_count();
            }
        }
        self.done.clear();
        self.done.resize(prisms, 0);
        self.found.clear();
    }

    /// Ends what was begun of these pentahedra.
    fn end(&mut self, points: &Points, pentahedra: &[u32]) {
        for cell in pentahedra.iter().filter_map(|&pentahedron| points.index(pentahedron)) {
            self.begin[cell] = NONE;
        }
    }

    /// Bytes held.
    pub fn bytes(&self) -> usize {
        4 * (self.begin.capacity() + self.ahead.capacity() + self.behind.capacity())
            + 2 * self.done.capacity()
            + self.found.capacity() * size_of::<(u32, u32, [u32; 3])>()
            + self.kept.capacity()
            + self.turned.capacity()
    }
}

struct Extraction<'a, V> {
    mesh: &'a Mesh,
    points: &'a Points,
    surface: &'a Surface,
    sample: V,
    walks: &'a mut Walks,
}

impl Surface {
    /// Renews the pieces of touched pentahedra (rising). `moved`: all with a point whose value or coagulation
    /// changed, and all that were touched since; `turned`, among them: those touched since, and all with a point whose
    /// sign changed.
    pub(crate) fn update(
        &mut self,
        mesh: &Mesh,
        points: &Points,
        sample: impl Fn(u32) -> Sample + Copy,
        moved: &[u32],
        turned: &[u32],
    ) {
        self.version += 1;
        self.pieces.resize_with(points.cell_count(), Piece::default);
        self.point_slots.resize(points.values.len(), NONE);
        let mut gathered = Gathered::default();
        for &pentahedron in moved {
            self.place_vertices(mesh, points, sample, &mut gathered, pentahedron);
        }
        let mut walks = std::mem::take(&mut self.walks);
        walks.begin(mesh, points, turned);
        for &pentahedron in turned {
            self.extract(mesh, points, sample, &mut walks, pentahedron);
        }
        for &pentahedron in turned {
            self.drop_triangles(pentahedron, |kept| kept == NONE || sample(kept).is_turned);
            if let Some(cell) = points.index(pentahedron) {
                self.vertices.release(&mut self.pieces[cell].chunks);
            }
        }
        for &(pentahedron, kept, triangle) in &walks.found {
            self.add(pentahedron, kept, triangle);
        }
        walks.end(points, turned);
        self.walks = walks;
    }

    /// Finds the triangles of a pentahedron, one of those that the walks are of, whose vertices have their places.
    pub(crate) fn extract(
        &self,
        mesh: &Mesh,
        points: &Points,
        sample: impl Fn(u32) -> Sample + Copy,
        walks: &mut Walks,
        pentahedron: u32,
    ) {
        let mut extraction = Extraction {
            mesh,
            points,
            surface: self,
            sample,
            walks,
        };
        extraction.run(pentahedron);
    }
}

impl<'a, V: Fn(u32) -> Sample + Copy> Extraction<'a, V> {
    fn at(&self, pentahedron: u32, prism: usize) -> Option<At<'a>> {
        let cell = self.points.index(pentahedron)?;
        Some(At {
            pentahedron,
            cell,
            sub: self.mesh.sub(pentahedron),
            points: self.points.of(pentahedron),
            piece: &self.surface.pieces[cell],
            prism,
        })
    }

    fn run(&mut self, pentahedron: u32) {
        let Some(first) = self.at(pentahedron, 0) else {
            return;
        };
        let (mut kept, mut turned) = (
            std::mem::take(&mut self.walks.kept),
            std::mem::take(&mut self.walks.turned),
        );
        kept.clear();
        turned.clear();
        for &point in first.points {
            let sample = (self.sample)(point);
            kept.push(sample.value > 0.0);
            turned.push(sample.is_turned && sample.value <= 0.0);
        }
        for (prism, corners) in first.sub.prisms().enumerate() {
            let is_new = corners.iter().fold(false, |any, &corner| any | turned[corner as usize]);
            if first.piece.duals[prism] == NONE || !is_new {
                continue;
            }
            for (edge, &[a, b]) in wedge::EDGES.iter().enumerate() {
                let (a, b) = (corners[a] as usize, corners[b] as usize);
                let (k, m) = if kept[a] { (a, b) } else { (b, a) };
                let done = self.walks.done[self.walks.begin[first.cell] as usize + prism] >> edge & 1 == 1;
                if kept[k] && turned[m] && !done {
                    self.around(At { prism, ..first }, [first.points[k], first.points[m]]);
                }
            }
        }
        if !first.piece.rims.is_empty() {
            self.exposed(first, &kept);
        }
        (self.walks.kept, self.walks.turned) = (kept, turned);
    }

    /// The polygon around an edge from a kept point to a removed one.
    fn around(&mut self, start: At<'a>, edge: [u32; 2]) {
        let [k, m] = edge;
        let (mut ahead, mut behind) = (
            std::mem::take(&mut self.walks.ahead),
            std::mem::take(&mut self.walks.behind),
        );
        ahead.clear();
        behind.clear();
        let mut owner = u32::MAX;
        let end = self.walk(start, edge, &mut ahead, &mut owner);
        let mut rims = None;
        if let Some((at, face)) = end {
            let last = self.rim(&at, face, edge);
            // The fan is open: its other half lies the other way.
            let first = match self.walk(start, [m, k], &mut behind, &mut owner) {
                Some((at, face)) => self.rim(&at, face, edge),
                None => last,
            };
            rims = Some([first, last]);
        }
        if self.walks.begin[self.points.index(owner).unwrap_or(start.cell)] != NONE {
            // Backwards up to the start, which both halves have.
            let polygon = (rims.iter().map(|rims| rims[0]))
                .chain(behind.iter().skip(1).rev().copied())
                .chain(ahead.iter().copied())
                .chain(rims.iter().map(|rims| rims[1]));
            let mut polygon = polygon.peekable();
            let first = polygon.next().unwrap_or(NONE);
            while let (Some(a), Some(&b)) = (polygon.next(), polygon.peek()) {
                self.walks.found.push((owner, k, [first, a, b]));
            }
            if let Some([first, last]) = rims
                && let slot = self.surface.point_slots[k as usize]
                && slot != NONE
            {
                self.walks.found.push((owner, k, [slot, first, last]));
            }
        }
        (self.walks.ahead, self.walks.behind) = (ahead, behind);
    }

    /// Goes from prism to prism counter-clockwise about an edge, until back at the start or at an exposed face, which
    /// is returned. Their vertices go to `polygon`, the smallest pentahedron to `owner`.
    fn walk(
        &mut self,
        start: At<'a>,
        [from, to]: [u32; 2],
        polygon: &mut Vec<u32>,
        owner: &mut u32,
    ) -> Option<(At<'a>, usize)> {
        let mut at = start;
        // The edge's ends as points of the pentahedron that the walk is in.
        let [mut local_from, mut local_to] = [at.local(from), at.local(to)];
        for _ in 0..MOST_AROUND {
            let corners = at.sub.prism(at.prism);
            let corner = |local: u32| find(&corners, local);
            let (a, b) = (corner(local_from), corner(local_to));
            polygon.push(at.piece.duals[at.prism]);
            *owner = at.pentahedron.min(*owner);
            let begin = self.walks.begin[at.cell];
            if begin != NONE {
                self.walks.done[begin as usize + at.prism] |= 1 << CORNERS.edge[a][b];
            }
            let face = usize::from(CORNERS.left[a][b]);
            let Some(next) = self.across(&at, face) else {
                return Some((at, face));
            };
            if next.pentahedron != at.pentahedron {
                (local_from, local_to) = (next.local(from), next.local(to));
            }
            at = next;
            if at.prism == start.prism && at.pentahedron == start.pentahedron {
                break;
            }
        }
        None
    }

    fn across(&self, at: &At<'a>, face: usize) -> Option<At<'a>> {
        match at.sub.across(at.prism, face) {
            Across::Prism(prism) => Some(At { prism, ..*at }),
            Across::Boundary(cell) => {
                let (pentahedron, its_face, turn) = self.mesh.across(at.pentahedron, face)?;
                let facing = self
                    .mesh
                    .sub(pentahedron)
                    .facing(&at.sub.boundary[cell], its_face, turn);
                self.at(pentahedron, facing.prism())
            }
        }
    }

    /// The rim vertex of the fine triangle of an exposed face that an edge belongs to.
    fn rim(&self, at: &At, face: usize, edge: [u32; 2]) -> u32 {
        let Across::Boundary(cell) = at.sub.across(at.prism, face) else {
            return NONE;
        };
        let cell = &at.sub.boundary[cell];
        let (triangles, _) = fine_triangles(at.sub, cell, at.points);
        let has = |point: u32| triangles[0].iter().any(|&corner| at.points[corner as usize] == point);
        let half = usize::from(!(has(edge[0]) && has(edge[1])));
        at.piece.rims[cell.triangle() + half]
    }

    /// What is kept of the exposed fine triangles themselves, and the diagonals between them.
    fn exposed(&mut self, at: At<'a>, kept: &[bool]) {
        let slot = |corner: u32| {
            let slot = self.surface.point_slots[at.points[corner as usize] as usize];
            (slot != NONE).then_some(slot)
        };
        for cell in &at.sub.boundary {
            if !self.mesh.is_exposed(at.pentahedron, cell.face()) {
                continue;
            }
            let (triangles, count) = fine_triangles(at.sub, cell, at.points);
            for (n, triangle) in triangles[..count].iter().enumerate() {
                let is_kept = triangle.map(|corner| kept[corner as usize]);
                if is_kept == [true; 3] {
                    if let [Some(a), Some(b), Some(c)] = triangle.map(slot) {
                        self.walks.found.push((at.pentahedron, NONE, [a, b, c]));
                    }
                    continue;
                }
                let rim = at.piece.rims[cell.triangle() + n];
                for side in 0..3 {
                    let next = (side + 1) % 3;
                    if is_kept[side]
                        && is_kept[next]
                        && let (Some(a), Some(b)) = (slot(triangle[side]), slot(triangle[next]))
                    {
                        self.walks.found.push((at.pentahedron, NONE, [a, b, rim]));
                    }
                }
            }
            if count == 2 {
                let [from, to] = [triangles[0][0], triangles[0][2]];
                let [from_kept, to_kept] = [from, to].map(|corner| kept[corner as usize]);
                if from_kept != to_kept {
                    // The second half runs from `from` to `to`, the first back.
                    let k = if from_kept { from } else { to };
                    let [behind, ahead] = if from_kept { [0, 1] } else { [1, 0] };
                    let [behind, ahead] = [behind, ahead].map(|half| at.piece.rims[cell.triangle() + half]);
                    let dual = at.piece.duals[cell.prism()];
                    self.walks.found.push((at.pentahedron, NONE, [behind, dual, ahead]));
                    if let Some(k) = slot(k) {
                        self.walks.found.push((at.pentahedron, NONE, [k, behind, ahead]));
                    }
                }
            }
        }
    }
}
