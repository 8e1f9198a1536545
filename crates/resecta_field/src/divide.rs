//! How finely the mesh is divided: every edge by its own length, and alike where neighbours must agree.
//!
//! Opposite edges of a quadrilateral have the same number of parts, so edges form sheets that are divided as one: the
//! axial edges between two sections, or one side of the triangles along a row of pentahedra. A triangle's three sides
//! are free. Inside, corners are put in an order that follows from the sheets alone, so that the two pentahedra at a
//! triangle cut it alike.

use std::cmp::Reverse;

use glam::DVec3;
use resecta_anatomy::wedge;

use crate::FieldError;
use crate::lookup::Lookup;
use crate::mesh::edge;
use crate::sublattice::{Divisions, MAX_DIVISIONS, Sublattice};

#[derive(Debug, Clone)]
pub struct Divided {
    /// Nodes of the pentahedra, in an order of [`wedge`] in which the parts of the triangles' sides fall.
    pub pentahedra: Vec<[u32; 6]>,
    /// Which of the given corners every corner is.
    pub orders: Vec<[u8; 6]>,
    /// Number of every edge, in the order of [`wedge::EDGES`].
    pub edges: Vec<[u32; 9]>,
    pub edge_count: usize,
    pub tables: Tables,
}

/// The sub-lattices of all pentahedra.
#[derive(Debug, Clone)]
pub struct Tables {
    sublattices: Vec<Sublattice>,
    of: Vec<u32>,
}

impl Tables {
    pub fn of(&self, pentahedron: u32) -> &Sublattice {
        &self.sublattices[self.of[pentahedron as usize] as usize]
    }
}

impl Divided {
    /// Divides every sheet until no part of its longest edge is longer than the spacing.
    pub fn new(rest: &[DVec3], given: &[[u32; 6]], spacing_mm: f64) -> Result<Self, FieldError> {
        if !spacing_mm.is_finite() || spacing_mm <= 0.0 {
            return Err(FieldError::Spacing(spacing_mm));
        }
        let mut numbers: Lookup<[u32; 2], u32> = Lookup::default();
        let mut lengths = Vec::new();
        let mut given_edges: Vec<[u32; 9]> = Vec::with_capacity(given.len());
        for nodes in given {
            given_edges.push(wedge::EDGES.map(|ends| {
                let [a, b] = ends.map(|end| nodes[end]);
                *numbers.entry(edge(a, b)).or_insert_with(|| {
                    lengths.push(rest[a as usize].distance(rest[b as usize]));
                    lengths.len() as u32 - 1
                })
            }));
        }
        let mut sheets = Sheets::new(lengths.len());
        for edges in &given_edges {
            for n in 0..3 {
                sheets.join(edges[n], edges[n + 3]);
                sheets.join(edges[6 + n], edges[6 + (n + 1) % 3]);
            }
        }
        let mut longest = vec![0.0_f64; lengths.len()];
        for (edge, &length) in (0..).zip(&lengths) {
            let sheet = sheets.of(edge) as usize;
            longest[sheet] = longest[sheet].max(length);
        }
        let parts = (longest.iter())
            .map(|&length| divide(length, spacing_mm))
            .collect::<Result<Vec<_>, _>>()?;
        let mut numbers_of: Lookup<[usize; 4], u32> = Lookup::default();
        let mut divided = Self {
            pentahedra: Vec::with_capacity(given.len()),
            orders: Vec::with_capacity(given.len()),
            edges: Vec::with_capacity(given.len()),
            edge_count: lengths.len(),
            tables: Tables {
                sublattices: Vec::new(),
                of: Vec::with_capacity(given.len()),
            },
        };
        for (index, (nodes, edges)) in given.iter().zip(&given_edges).enumerate() {
            let sheet = [0, 1, 2].map(|side| sheets.of(edges[side]));
            let order = order(sheet, |sheet| parts[sheet as usize]).ok_or(FieldError::Wound(index))?;
            let nodes = order.map(|corner| nodes[usize::from(corner)]);
            let edges = wedge::EDGES.map(|[a, b]| numbers[&edge(nodes[a], nodes[b])]);
            let mut of = |edge: usize| parts[sheets.of(edges[edge]) as usize];
            let divisions = Divisions {
                sides: [of(0), of(1), of(2)],
                axis: of(6),
            };
            let tables = &mut divided.tables;
            let [a, b, c] = divisions.sides;
            let table = *numbers_of.entry([a, b, c, divisions.axis]).or_insert_with(|| {
                tables.sublattices.push(Sublattice::new(divisions));
                tables.sublattices.len() as u32 - 1
            });
            tables.of.push(table);
            divided.pentahedra.push(nodes);
            divided.orders.push(order);
            divided.edges.push(edges);
        }
        Ok(divided)
    }

    /// The given face that a face is.
    pub fn given_face(&self, pentahedron: u32, face: usize) -> usize {
        let order = &self.orders[pentahedron as usize];
        if face < 2 {
            return usize::from(order[3 * face] >= 3);
        }
        let [a, b] = [face - 2, (face - 1) % 3].map(|corner| usize::from(order[corner]) % 3);
        2 + if (a + 1) % 3 == b { a } else { b }
    }
}

fn divide(length: f64, spacing_mm: f64) -> Result<usize, FieldError> {
    // A length that is a multiple of the spacing but for rounding is not divided once more.
    let divisions = (length / spacing_mm - 1e-9).ceil().max(1.0);
    if divisions > MAX_DIVISIONS as f64 {
        return Err(FieldError::TooFine {
            divisions,
            limit: MAX_DIVISIONS,
        });
    }
    Ok(divisions as usize)
}

/// The order of the corners in which the parts of the sides fall, by the sheets of the sides; none if two sides are of
/// one sheet.
fn order(sheets: [u32; 3], parts: impl Fn(u32) -> usize) -> Option<[u8; 6]> {
    let mut sides = [0, 1, 2];
    sides.sort_unstable_by_key(|&side| (Reverse(parts(sheets[side])), sheets[side]));
    if (0..3).any(|n| sheets[n] == sheets[(n + 1) % 3]) {
        return None;
    }
    // Side n joins the corners n and n + 1, and lies opposite corner n + 2.
    let opposite = sides.map(|side: usize| (side + 2) % 3);
    let section = [opposite[1], opposite[2], opposite[0]].map(|corner| corner as u8);
    let is_even = (section[0] + 1) % 3 == section[1];
    // Turning the section over takes swapping the ends.
    Some(std::array::from_fn(|n| {
        let end = if is_even { n / 3 } else { 1 - n / 3 };
        section[n % 3] + 3 * end as u8
    }))
}

/// Edges that are divided alike, named by their smallest.
struct Sheets(Vec<u32>);

impl Sheets {
    fn new(edges: usize) -> Self {
        Self((0..edges as u32).collect())
    }

    fn of(&mut self, edge: u32) -> u32 {
        let mut root = edge;
        while self.0[root as usize] != root {
            let parent = self.0[root as usize];
            self.0[root as usize] = self.0[parent as usize];
            root = parent;
        }
        root
    }

    fn join(&mut self, a: u32, b: u32) {
        let (a, b) = (self.of(a), self.of(b));
        self.0[a.max(b) as usize] = a.min(b);
    }
}
