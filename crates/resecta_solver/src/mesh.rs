//! What a tissue is built from: nodes, pentahedra, springs, and which springs each pentahedron stands behind.

use std::collections::HashMap;

use glam::DVec3;
use resecta_anatomy::{DIAGONAL_STEPS, Lattice, LatticeShape, Zone, wedge};

use crate::ShearResistance;

/// A pentahedron's part in a spring.
///
/// Stiffness is assembled from the pentahedra: a spring of length l has `modulus · Σ fraction · volume / l²` over the
/// pentahedra around it, which for a straight cell is modulus times tributary area over length. What a pentahedron gave
/// leaves with it, and a spring that no pentahedron stands behind any more is removed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Share {
    /// Index of the pentahedron.
    pub pentahedron: u32,
    /// Index of the spring.
    pub spring: u32,
    /// Share of the pentahedron's volume that works through this spring; 0 or more.
    pub fraction: f32,
}

/// The shape and the connections of a tissue at rest.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct TissueMesh {
    /// Rest position of every node, mm.
    pub positions: Vec<DVec3>,
    /// Node indices of every pentahedron, in the order of [`resecta_anatomy::wedge`].
    pub pentahedra: Vec<[u32; 6]>,
    /// Zone of every pentahedron.
    pub zones: Vec<Zone>,
    /// The two nodes of every spring. Springs whose nodes both rise by one from each to the next are computed fastest.
    pub springs: Vec<[u32; 2]>,
    /// Which pentahedra stand behind which springs.
    pub shares: Vec<Share>,
    /// Nodes on the wall of the lumen: the mucosa.
    pub lumen: Vec<u32>,
    /// Nodes on the capsule, held elastically by what surrounds the organ.
    pub capsule: Vec<u32>,
    /// Nodes that are held as the capsule is and are none of it: see [`end_capsule_at`](Self::end_capsule_at).
    pub covered: Vec<u32>,
}

/// Why a mesh cannot be a tissue.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum MeshError {
    /// There is nothing to simulate.
    #[error("the mesh has no {0}")]
    Empty(&'static str),
    /// More of something than 32-bit indices can name.
    #[error("the mesh has {count} {what}, more than the {limit} that can be numbered")]
    TooMany {
        /// What there is too much of.
        what: &'static str,
        /// How many there are.
        count: usize,
        /// How many there may be.
        limit: usize,
    },
    /// An index names no element.
    #[error("{what} {index} names {target} {value}, but there are only {count}")]
    NoSuch {
        /// The list that holds the index.
        what: &'static str,
        /// Position in that list.
        index: usize,
        /// What the index should name.
        target: &'static str,
        /// The index found.
        value: u32,
        /// How many there are.
        count: usize,
    },
    /// A rest position is NaN or infinite.
    #[error("node {0} has no finite rest position")]
    NotFinite(usize),
    /// The list of zones does not fit the pentahedra.
    #[error("{pentahedra} pentahedra have {zones} zones; there must be one each")]
    ZoneCount {
        /// Number of pentahedra.
        pentahedra: usize,
        /// Number of zones.
        zones: usize,
    },
    /// A pentahedron is flat or inverted at rest.
    #[error("pentahedron {index} has a rest volume of {volume_mm3} mm³; it must be above 0")]
    Inverted {
        /// Which one.
        index: usize,
        /// Its signed volume.
        volume_mm3: f64,
    },
    /// A spring joins a node to itself or two nodes in one place.
    #[error("spring {0} has no length")]
    NoLength(usize),
    /// A number that the mesh and the material give is beyond what can be computed with.
    #[error("{field} of {what} {index} comes to {value}, expected {expected}")]
    Range {
        /// Name of the number.
        field: &'static str,
        /// `node`, `spring` or `pentahedron`.
        what: &'static str,
        /// Which one.
        index: usize,
        /// What it comes to.
        value: f32,
        /// What was expected.
        expected: &'static str,
    },
    /// A share is negative or not a number.
    #[error("share {index} has the fraction {fraction}; it must be finite, 0 or more")]
    Fraction {
        /// Position in the list of shares.
        index: usize,
        /// The fraction found.
        fraction: f32,
    },
    /// A spring has no pentahedron behind it.
    #[error("spring {0} has no pentahedron behind it")]
    NothingBehind(usize),
    /// A node belongs to no pentahedron.
    #[error("node {0} belongs to no pentahedron")]
    Orphan(usize),
    /// Three or more pentahedra meet in one face, or two from the same side.
    #[error("pentahedron {0} shares a face with more than one other, or overlaps its neighbour")]
    NotManifold(usize),
    /// The material has a value out of its range.
    #[error("material: {field} is {value}, expected {expected}")]
    Material {
        /// Name of the field.
        field: &'static str,
        /// Its value.
        value: f64,
        /// What it should have been.
        expected: &'static str,
    },
}

/// Share of the volume that works along each family of axis springs where they are alone: all of it.
const AXIS_ALONE: f32 = 1.0;
/// The same beside diagonals. With [`DIAGONAL`] the stiffness is isotropic, Poisson's ratio 1/4, and the modulus as
/// given, exactly for cubic cells: axis and diagonal springs of a cube of edge a then all have 0.4 E a.
const AXIS_BESIDE_DIAGONALS: f32 = 0.4;
/// Share of the volume that works along each family of face diagonals.
const DIAGONAL: f32 = 0.8;

/// A node this near to a height is on it, mm.
const ON_HEIGHT_MM: f64 = 1e-3;

impl TissueMesh {
    /// The tissue of a lattice: the springs of the papers, with face diagonals where `shear` asks for them.
    pub fn from_lattice(lattice: &Lattice, shear: ShearResistance) -> TissueMesh {
        let shape = lattice.shape;
        let mut springs: Vec<[u32; 2]> = shape.axis_pairs().collect();
        let diagonals = shear == ShearResistance::Diagonals;
        if diagonals {
            springs.extend(DIAGONAL_STEPS.into_iter().flat_map(|step| shape.pairs(step)));
        }
        let by_nodes: HashMap<[u32; 2], u32> = springs.iter().map(|&pair| sorted(pair)).zip(0..).collect();
        let mut shares = Vec::new();
        let mut add = |pentahedron: u32, pair: [u32; 2], fraction: f32| {
            if let Some(&spring) = by_nodes.get(&sorted(pair)) {
                shares.push(Share {
                    pentahedron,
                    spring,
                    fraction,
                });
            }
        };
        let axis = if diagonals { AXIS_BESIDE_DIAGONALS } else { AXIS_ALONE };
        for pentahedron in 0..shape.pentahedron_count() as u32 {
            let corners = CellSide::of(shape, pentahedron);
            for (pair, fraction) in corners.axis_springs() {
                add(pentahedron, pair, axis * fraction);
            }
            if diagonals {
                for (pair, fraction) in corners.diagonal_springs() {
                    add(pentahedron, pair, DIAGONAL * fraction);
                }
            }
        }
        let layer = |k: u32| (0..shape.slices).flat_map(move |i| (0..shape.angles).map(move |j| shape.index(i, j, k)));
        TissueMesh {
            positions: lattice.positions.clone(),
            pentahedra: lattice.pentahedra.clone(),
            zones: lattice.zones.clone(),
            springs,
            shares,
            lumen: layer(0).collect(),
            capsule: layer(shape.layers - 1).collect(),
            covered: Vec::new(),
        }
    }

    /// Ends the capsule at a height, mm. What of an organ lies beyond the bladder neck has none: the bladder's wall covers it, and
    /// holds it as well.
    pub fn end_capsule_at(&mut self, z_mm: f64) {
        let positions = &self.positions;
        let is_beyond = |node: &mut u32| {
            let place = positions.get(*node as usize);
            place.is_some_and(|place| place.z > z_mm + ON_HEIGHT_MM)
        };
        self.covered.extend(self.capsule.extract_if(.., is_beyond));
    }

    /// The tissue of an organ that is no lattice: every edge of a pentahedron becomes a spring. It has no lumen and no
    /// capsule until those lists are filled.
    pub fn from_pentahedra(positions: Vec<DVec3>, pentahedra: Vec<[u32; 6]>) -> TissueMesh {
        // Two copies of a triangle's edges work along its plane, three edges across it.
        const ALONG: f32 = 1.0 / 2.0;
        const ACROSS: f32 = 1.0 / 3.0;
        let mut springs: Vec<[u32; 2]> = pentahedra
            .iter()
            .flat_map(|nodes| wedge::EDGES.map(|edge| sorted(edge.map(|corner| nodes[corner]))))
            .collect();
        // By offset, then by node: neighbours in memory then have neighbours at both ends.
        springs.sort_unstable_by_key(|&[a, b]| (b - a, a));
        springs.dedup();
        let by_nodes: HashMap<[u32; 2], u32> = springs.iter().copied().zip(0..).collect();
        let shares = (0..).zip(&pentahedra).flat_map(|(pentahedron, nodes)| {
            let by_nodes = &by_nodes;
            wedge::EDGES.into_iter().enumerate().map(move |(edge, corners)| Share {
                pentahedron,
                spring: by_nodes[&sorted(corners.map(|corner| nodes[corner]))],
                fraction: if edge < 6 { ALONG } else { ACROSS },
            })
        });
        let shares = shares.collect();
        let zones = vec![Zone::Other; pentahedra.len()];
        TissueMesh {
            positions,
            pentahedra,
            zones,
            springs,
            shares,
            ..TissueMesh::default()
        }
    }
}

/// The corners of one pentahedron of a lattice cell, by their place in the cell.
///
/// In the section, P and R are the ends of the diagonal that cuts the cell, T is the pentahedron's third corner and U the
/// corner that only its partner has. Index 0 is the lower slice, 1 the upper.
struct CellSide {
    p: [u32; 2],
    r: [u32; 2],
    t: [u32; 2],
    u: [u32; 2],
}

impl CellSide {
    fn of(shape: LatticeShape, pentahedron: u32) -> CellSide {
        let [i, j, k] = shape.cell_coordinates(pentahedron / 2);
        let corner = |dj: u32, dk: u32| [shape.index(i, j + dj, k + dk), shape.index(i + 1, j + dj, k + dk)];
        let (p, q, r, s) = (corner(0, 0), corner(1, 0), corner(1, 1), corner(0, 1));
        let (t, u) = if pentahedron.is_multiple_of(2) { (q, s) } else { (s, q) };
        CellSide { p, r, t, u }
    }

    /// Springs along the cell's edges, with shares that make each family's sum over the two pentahedra the cell's volume.
    fn axis_springs(&self) -> [([u32; 2], f32); 7] {
        let CellSide { p, r, t, .. } = *self;
        [
            ([p[0], t[0]], 0.5),
            ([p[1], t[1]], 0.5),
            ([t[0], r[0]], 0.5),
            ([t[1], r[1]], 0.5),
            (p, 0.25),
            (r, 0.25),
            (t, 0.5),
        ]
    }

    /// Springs along the diagonals of the cell's faces, likewise.
    fn diagonal_springs(&self) -> [([u32; 2], f32); 8] {
        let CellSide { p, r, t, u } = *self;
        [
            ([p[0], r[0]], 0.5),
            ([p[1], r[1]], 0.5),
            ([t[0], u[0]], 0.5),
            ([t[1], u[1]], 0.5),
            ([p[0], t[1]], 1.0),
            ([t[0], p[1]], 1.0),
            ([t[0], r[1]], 1.0),
            ([r[0], t[1]], 1.0),
        ]
    }
}

fn sorted([a, b]: [u32; 2]) -> [u32; 2] {
    [a.min(b), a.max(b)]
}
