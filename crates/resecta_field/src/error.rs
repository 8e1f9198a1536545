//! What is refused, by name.

/// Why a mesh, a tool or positions cannot be used.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum FieldError {
    /// The mesh has no pentahedra.
    #[error("the mesh has no pentahedra")]
    Empty,
    /// The spacing wanted is not a length.
    #[error("the spacing is {0} mm; it must be finite and above 0")]
    Spacing(f64),
    /// The spacing is so small beside the mesh's edges that an element would hold too many points.
    #[error("the spacing asks for {divisions} divisions of an edge; there may be {limit}")]
    TooFine {
        /// Divisions that the longest edge would need.
        divisions: f64,
        /// Most divisions there may be.
        limit: usize,
    },
    /// A pentahedron names a node that does not exist.
    #[error("pentahedron {pentahedron} names node {node}, but there are only {count}")]
    NoSuchNode {
        /// Index of the pentahedron.
        pentahedron: usize,
        /// The index found.
        node: u32,
        /// Number of nodes.
        count: usize,
    },
    /// An index names no pentahedron.
    #[error("there is no pentahedron {index}; there are {count}")]
    NoSuchPentahedron {
        /// The index given.
        index: u32,
        /// Number of pentahedra.
        count: usize,
    },
    /// A node's place is NaN or infinite.
    #[error("node {0} has no finite position")]
    Position(usize),
    /// A list of positions is not one a node.
    #[error("{given} positions were given for {expected} nodes")]
    PositionCount {
        /// Positions given.
        given: usize,
        /// Nodes of the mesh.
        expected: usize,
    },
    /// A pentahedron is flat or inverted at rest.
    #[error("pentahedron {index} has a rest volume of {volume_mm3} mm³; it must be above 0")]
    Inverted {
        /// Which one.
        index: usize,
        /// Its signed volume.
        volume_mm3: f64,
    },
    /// A pentahedron names a node twice.
    #[error("pentahedron {0} names a node twice")]
    Repeated(usize),
    /// Three or more pentahedra meet in one face, or two from the same side.
    #[error("pentahedron {0} shares a face with more than one other, or overlaps its neighbour")]
    NotManifold(usize),
    /// A row of pentahedra, triangle to triangle, comes back to itself turned, so that two sides of a triangle cannot be
    /// told apart.
    #[error("pentahedron {0} stands in a row that comes back to itself turned")]
    Wound(usize),
    /// A number of a tool is out of range.
    #[error("{field} of the {tool} is {value}, expected {expected}")]
    Tool {
        /// Which tool.
        tool: &'static str,
        /// Name of the number.
        field: &'static str,
        /// Its value; of a vector the first component that is wrong.
        value: f64,
        /// What was expected.
        expected: &'static str,
    },
}
