//! The field: what is kept of every pentahedron, and the surface between kept and removed.

use glam::{DVec3, Vec3};
use resecta_anatomy::wedge;

use crate::FieldError;
use crate::changes::Changes;
use crate::chips::Before;
use crate::mesh::Mesh;
use crate::points::Points;
use crate::surface::{CHUNK, Piece, Surface, SurfaceKind};

/// Values are kept within this many times the longest sub-lattice edge at rest. Beyond the two ends of an edge that the
/// boundary crosses nothing reads them; the rest is for tissue that is stretched to twice its length.
const BAND: f64 = 2.0;

/// A signed distance inside the pentahedra of a tissue.
///
/// Values are of the tissue, not of space: a cut is made where the tissue is at that instant, and moves with it after.
#[derive(Debug, Clone)]
pub struct Field {
    pub(crate) mesh: Mesh,
    pub(crate) points: Points,
    pub(crate) surface: Surface,
    /// What was there when the chip now being cut was begun.
    pub(crate) before: Before,
    /// Emptied pentahedra whose points that chip still needs.
    pub(crate) emptied: Vec<u32>,
    pub(crate) band: f32,
    pub(crate) edits: u32,
    pub(crate) initial_mm3: f64,
    pub(crate) removed_mm3: f64,
}

impl Field {
    /// An uncut tissue.
    ///
    /// `rest` are the nodes' places at rest, mm; pentahedra are in the order of [`resecta_anatomy::wedge`]. Every edge is
    /// divided so that no part of it is longer than `spacing_mm` at rest, and so are those that must have as many parts:
    /// the opposite edges of quadrilaterals. `kind` tells what an exposed face is, by pentahedron and face: 0 and 1 are
    /// the triangles of [`resecta_anatomy::wedge::TRIANGLES`], 2, 3 and 4 the quadrilaterals of
    /// [`resecta_anatomy::wedge::QUADS`].
    ///
    /// # Errors
    ///
    /// A mesh without pentahedra, with indices that name nothing, places that are not finite, pentahedra that are
    /// inverted, overlap or stand in a row that comes back to itself turned; a spacing that is no length or asks for
    /// more than 32 parts of an edge.
    pub fn new(
        rest: &[DVec3],
        pentahedra: &[[u32; 6]],
        spacing_mm: f64,
        kind: impl Fn(u32, usize) -> SurfaceKind,
    ) -> Result<Self, FieldError> {
        let mesh = Mesh::new(rest, pentahedra, spacing_mm, kind)?;
        let surface = Surface::of_mesh(&mesh);
        Ok(Self {
            band: (BAND * spacing_mm) as f32,
            initial_mm3: mesh.rest_volumes.iter().sum(),
            mesh,
            points: Points::default(),
            surface,
            before: Before::default(),
            emptied: Vec::new(),
            edits: 0,
            removed_mm3: 0.0,
        })
    }

    /// Parts of a pentahedron's edges, in the order of [`resecta_anatomy::wedge::EDGES`]; none for one that does not
    /// exist.
    pub fn divisions(&self, pentahedron: u32) -> Option<[usize; 9]> {
        let order = self.mesh.orders.get(pentahedron as usize)?;
        let divisions = self.mesh.sub(pentahedron).divisions;
        let mut given = [0; 9];
        for (n, ends) in wedge::EDGES.iter().enumerate() {
            let ends = ends.map(|end| usize::from(order[end]));
            let its = (wedge::EDGES.iter()).position(|edge| ends.iter().all(|end| edge.contains(end)))?;
            given[its] = divisions.of(n);
        }
        Some(given)
    }

    /// The surface between what is kept and what is not.
    pub fn surface(&self) -> &Surface {
        &self.surface
    }

    /// The slots of the surface that were written since this was last asked, for buffers that are written in part.
    pub fn take_changes(&mut self) -> Changes {
        self.surface.take_changes()
    }

    /// Number of pentahedra.
    pub fn pentahedron_count(&self) -> usize {
        self.mesh.pentahedra.len()
    }

    /// The chunks of vertices that a touched pentahedron carries; empty for one that nothing touched.
    pub fn chunks_of(&self, pentahedron: u32) -> &[u32] {
        let piece = self
            .points
            .index(pentahedron)
            .and_then(|cell| self.surface.pieces.get(cell));
        piece.map_or(&[], |piece| &piece.chunks)
    }

    /// Whether there is tissue at a node.
    pub fn is_node_kept(&self, node: u32) -> bool {
        self.points.value_at_node(node).is_none_or(|value| value > 0.0)
    }

    /// Whether a cut or coagulation has reached a pentahedron; no for one that does not exist.
    pub fn is_touched(&self, pentahedron: u32) -> bool {
        self.points.is_touched(pentahedron)
    }

    /// Share of a pentahedron's rest volume that is kept, 0 to 1; 0 for one that does not exist.
    pub fn fill(&self, pentahedron: u32) -> f64 {
        let rest = self.mesh.rest_volumes.get(pentahedron as usize).copied();
        rest.map_or(0.0, |rest| self.kept_mm3(pentahedron) / rest)
    }

    /// Rest volume that is kept of a pentahedron, mm³; 0 for one that does not exist.
    pub fn kept_mm3(&self, pentahedron: u32) -> f64 {
        let rest = self.mesh.rest_volumes.get(pentahedron as usize).copied();
        self.points.kept_mm3(pentahedron).or(rest).unwrap_or(0.0)
    }

    /// Rest volume that is kept, mm³.
    pub fn volume_mm3(&self) -> f64 {
        (0..self.mesh.pentahedra.len() as u32)
            .map(|pentahedron| self.kept_mm3(pentahedron))
            .sum()
    }

    /// Rest volume of the uncut tissue, mm³.
    pub fn initial_volume_mm3(&self) -> f64 {
        self.initial_mm3
    }

    /// Sum of all that was ever reported as removed, mm³ at rest.
    pub fn removed_mm3(&self) -> f64 {
        self.removed_mm3
    }

    /// Bytes that cuts and coagulation have made the field hold: values, numbers of points, finer pieces of the
    /// surface. 0 until the first.
    pub fn bytes(&self) -> usize {
        self.points.bytes() + self.surface.bytes() + self.before.bytes()
    }

    /// Moves the surface's vertices to where the nodes are: one place a vertex slot, mm.
    ///
    /// # Errors
    ///
    /// Positions that are not one a node. They are not asked to be finite: a vertex is where its pentahedron is.
    pub fn move_vertices(&self, positions: &[Vec3], out: &mut Vec<Vec3>) -> Result<(), FieldError> {
        self.check_count(positions)?;
        self.surface.vertices.places(&self.mesh, positions, out);
        Ok(())
    }

    /// The vertices' normals for these positions of the nodes: unit vectors, one a vertex slot, zero for a free slot.
    ///
    /// # Errors
    ///
    /// Positions that are not one a node.
    pub fn move_normals(&self, positions: &[Vec3], out: &mut Vec<Vec3>) -> Result<(), FieldError> {
        self.check_count(positions)?;
        self.surface.vertices.normals(&self.mesh, positions, out);
        Ok(())
    }

    /// Where the vertices of a chunk are ([`Surface::chunk`]) with every node at its `position`, mm; none for a chunk
    /// without vertices. Meaningless in free slots.
    #[inline(always)]
    pub fn chunk_places(&self, chunk: u32, position: impl Fn(u32) -> Vec3) -> Option<[Vec3; CHUNK]> {
        self.surface.vertices.owner(chunk)?;
        Some((self.surface.vertices).chunk_places(&self.mesh, chunk as usize, position))
    }

    /// Where the vertices of a chunk are by component, and which of its slots hold one, a bit each.
    #[inline(always)]
    pub fn chunk_lanes(&self, chunk: u32, position: impl Fn(u32) -> Vec3) -> Option<([[f32; CHUNK]; 3], u8)> {
        self.surface.vertices.owner(chunk)?;
        let vertices = &self.surface.vertices;
        Some((
            vertices.chunk_lanes(&self.mesh, chunk as usize, position),
            vertices.used(chunk),
        ))
    }

    fn check_count(&self, positions: &[Vec3]) -> Result<(), FieldError> {
        if positions.len() == self.mesh.rest.len() {
            return Ok(());
        }
        Err(FieldError::PositionCount {
            given: positions.len(),
            expected: self.mesh.rest.len(),
        })
    }

    /// Gives back what emptied pentahedra held, unless a chip under way needs it.
    pub(crate) fn release_emptied(&mut self) {
        if self.before.is_under_way() || self.emptied.is_empty() {
            return;
        }
        for pentahedron in self.emptied.drain(..) {
            if let Some(cell) = self.points.index(pentahedron) {
                self.surface.pieces[cell] = Piece::default();
                self.points.release(&self.mesh, pentahedron);
            }
        }
    }

    /// Gives back what is not needed and makes room for what comes: not in the steps of a stroke, which are to be quick.
    pub(crate) fn tidy(&mut self) {
        self.points.trim();
        self.points.make_room();
        let points = self.points.values.len();
        self.surface.trim(points);
        self.surface.make_room();
        self.before.trim(points);
        self.before.make_room();
    }

    /// Begins an edit: points that it looks at are marked with its number.
    pub(crate) fn begin_edit(&mut self) -> Edit {
        if self.edits >= u32::MAX / Edit::MARKS - 1 {
            self.points.marks.fill(0);
            self.edits = 0;
        }
        self.edits += 1;
        Edit {
            seen: Edit::MARKS * self.edits,
            fresh: Vec::new(),
        }
    }

    pub(crate) fn touch(&mut self, edit: &mut Edit, pentahedron: u32) {
        if !self.points.is_touched(pentahedron) {
            self.points.touch(&self.mesh, pentahedron, self.band);
            edit.fresh.push(pentahedron);
        }
    }

    /// Those of the pentahedra that have a point with at least this mark.
    pub(crate) fn marked(&self, mark: u32, pentahedra: &[u32]) -> Vec<u32> {
        let marks = &self.points.marks;
        (pentahedra.iter().copied())
            .filter(|&pentahedron| (self.points.of(pentahedron).iter()).any(|&point| marks[point as usize] >= mark))
            .collect()
    }
}

/// An edit under way.
pub(crate) struct Edit {
    /// The mark of points looked at.
    pub seen: u32,
    /// Pentahedra that it touched first.
    pub fresh: Vec<u32>,
}

impl Edit {
    /// Marks of an edit.
    const MARKS: u32 = 3;

    /// The mark of points changed.
    pub fn changed(&self) -> u32 {
        self.seen + 1
    }

    /// The mark of points whose sign changed.
    pub fn turned(&self) -> u32 {
        self.seen + 2
    }
}
