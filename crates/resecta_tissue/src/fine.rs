//! Cuts finer than the elements: the field beside a tissue's solver, its surface where the tissue is, and strokes.

use std::collections::{BTreeSet, VecDeque};

use bevy::{math::DVec3, prelude::*};
use resecta_anatomy::wedge;
use resecta_field::{CHUNK, Chip, ChipMaking, Field, FieldError, Holds, LoopStroke, Surface, SurfaceKind, Tool};
use resecta_solver::{LoopSweep, NodeKind, with_widest_registers};

use crate::change_log::{ChangeLog, ChangesSince};

/// Pieces that hang by nothing come free up to this volume, mm³; a larger one is a part of the organ.
const LARGEST_PIECE_MM3: f64 = 3000.0;

/// A pentahedron of which less than this share is left is a shred: turned inside out, it tears off. What is left of it
/// weighs little and holds little, so that springs do not bring it back; in a patient the water takes such shreds along.
/// Our choice.
const SHRED_SHARE: f64 = 0.25;

/// A shred of which less than this share is left is a thread: it tears off when it is stretched to more than
/// [`TORN_THREAD_STRETCH`] times its length at rest. Where thicker ones did, too, the floor of a trench had notches as large as
/// pentahedra. Our choice.
const THREAD_SHARE: f64 = 0.1;
const TORN_THREAD_STRETCH: f32 = 1.5;

/// Pentahedra of a chip's surface that are made in a step: more while nothing is cut, so that the chip of a stroke of 30 mm comes
/// within a tenth of a second of its end; few while the next one is being cut, so that no step of that takes longer for it.
const MADE_A_STEP: usize = 512;
const MADE_BESIDE_A_CUT: usize = 128;

/// A touch of a wire under coagulating current coagulates tissue within this distance of it, mm, to this depth below, mm.
/// Our choice: monopolar coagulation whitens some millimetre of tissue.
const COAGULATED_AROUND_MM: f64 = 0.5;
const COAGULATED_DEEP_MM: f64 = 1.0;

/// The finer boundary of a tissue.
pub(crate) struct Fine {
    field: Field,
    /// What surrounds the organ holds the tissue.
    holds: Holds,
    /// Where the nodes are, in one piece for the field.
    nodes: Vec<Vec3>,
    /// Where the vertices of the surface are, as far as they were brought there.
    places: Vec<Vec3>,
    /// The vertices' normals when all were last brought to where the tissue is.
    normals: Vec<Vec3>,
    /// Tells one state of motion and surface from another, and what state it is.
    instant: u32,
    state: Option<(u64, u64)>,
    /// The instant of each chunk's places, and of all others'.
    brought: Vec<u32>,
    followed: u32,
    changes: ChangeLog,
    /// Pentahedra of which less than [`SHRED_SHARE`] is left.
    shreds: BTreeSet<u32>,
    strokes: Vec<Stroke>,
    /// Whether a chip is under way, and whether the present step has added to it.
    chip: Option<ChipUnderWay>,
    /// Chips that are whole and wait for their surface, and the tools that cut them.
    making: VecDeque<(Option<Entity>, ChipMaking)>,
}

/// A loop under current on its way.
struct Stroke {
    tool: Entity,
    way: LoopStroke,
}

struct ChipUnderWay {
    tool: Option<Entity>,
    grew: bool,
}

/// What a cut took.
#[derive(Default)]
pub(crate) struct Taken {
    /// Share of its rest volume that each pentahedron which lost something has left.
    pub left: Vec<(u32, f64)>,
    /// Area of the capsule that went, mm² at rest.
    pub capsule_mm2: f64,
}

impl Fine {
    /// The boundary of a tissue as it is: pentahedra that it has lost are gone in the field, too.
    pub fn new(solver: &resecta_solver::Tissue, spacing_mm: f32) -> Result<Self, FieldError> {
        let rest: Vec<_> = (0..solver.node_count() as u32)
            .map(|node| solver.rest_position(node).as_dvec3())
            .collect();
        let pentahedra: Vec<_> = (0..solver.pentahedron_count() as u32)
            .map(|pentahedron| solver.pentahedron_nodes(pentahedron))
            .collect();
        let kind = |pentahedron: u32, face: usize| {
            let corners = solver.pentahedron_nodes(pentahedron);
            let all = |kind: NodeKind| {
                let of = |corner: &usize| solver.node_kind(corners[*corner]) == kind;
                match face {
                    0 | 1 => wedge::TRIANGLES[face].iter().all(of),
                    _ => wedge::QUADS[face - 2].iter().all(of),
                }
            };
            if all(NodeKind::Mucosa) {
                SurfaceKind::Mucosa
            } else if all(NodeKind::Capsule) {
                SurfaceKind::Capsule
            } else {
                SurfaceKind::Other
            }
        };
        let mut field = Field::new(&rest, &pentahedra, f64::from(spacing_mm), kind)?;
        let gone: Vec<u32> = (0..solver.pentahedron_count() as u32)
            .filter(|&pentahedron| !solver.is_pentahedron_alive(pentahedron))
            .collect();
        if !gone.is_empty() {
            field.empty(&gone)?;
        }
        let holds = field.holds(|pentahedron| solver.is_held(pentahedron));
        Ok(Self {
            field,
            holds,
            nodes: Vec::new(),
            places: Vec::new(),
            normals: Vec::new(),
            instant: 0,
            state: None,
            brought: Vec::new(),
            followed: 0,
            changes: ChangeLog::default(),
            shreds: BTreeSet::new(),
            strokes: Vec::new(),
            chip: None,
            making: VecDeque::new(),
        })
    }

    /// What is kept of every pentahedron.
    pub fn field(&self) -> &Field {
        &self.field
    }

    /// The surface; where its vertices are is told by [`Fine::place`].
    pub fn surface(&self) -> &Surface {
        self.field.surface()
    }

    /// Where a vertex is, mm: a node as of the last [`Fine::bring`] or [`Fine::follow`], another one if that brought its chunk
    /// there.
    pub fn place(&self, vertex: u32) -> Vec3 {
        self.places[vertex as usize]
    }

    /// The vertices' unit normals, by slot, as [`Fine::follow`] left them.
    pub fn normals(&self) -> &[Vec3] {
        &self.normals
    }

    /// What cuts changed since a version of the surface; none if that was too long ago to know.
    pub fn changes_since(&self, version: u64) -> Option<ChangesSince<'_>> {
        self.changes.since(version)
    }

    /// Notes what the last cut changed.
    fn note_changes(&mut self) {
        let changes = self.field.take_changes();
        let surface = self.field.surface();
        self.changes
            .note(surface.version(), &changes, |vertex| surface.chunk(vertex));
    }

    /// Begins another instant if the tissue has moved or was cut.
    fn look(&mut self, solver: &resecta_solver::Tissue) {
        let state = Some((solver.motion_version(), self.field.surface().version()));
        if self.state != state {
            self.state = state;
            self.instant = self.instant.wrapping_add(1);
            let vertices = self.field.surface().vertex_count();
            self.places.resize(vertices, Vec3::ZERO);
            for (node, place) in (0..solver.node_count() as u32).zip(&mut self.places) {
                *place = solver.position(node);
            }
            self.brought
                .resize(vertices.div_ceil(CHUNK), self.instant.wrapping_sub(1));
        }
    }

    /// Brings the vertices of some chunks to where the tissue is.
    pub fn bring(&mut self, solver: &resecta_solver::Tissue, chunks: impl Iterator<Item = u32>) {
        self.look(solver);
        if self.followed == self.instant {
            return;
        }
        let (nodes, carried) = self.places.split_at_mut(solver.node_count());
        let position = |node: u32| nodes[node as usize];
        with_widest_registers(
            #[inline(always)]
            || {
                for chunk in chunks {
                    let Some(brought) = self.brought.get_mut(chunk as usize) else {
                        continue;
                    };
                    if std::mem::replace(brought, self.instant) == self.instant {
                        continue;
                    }
                    let start = chunk as usize * CHUNK;
                    let slots = carried.get_mut(start..start + CHUNK);
                    if let (Some(slots), Some(places)) = (slots, self.field.chunk_places(chunk, position)) {
                        slots.copy_from_slice(&places);
                    }
                }
            },
        );
    }

    /// Brings all vertices to where the tissue is.
    pub fn follow(&mut self, solver: &resecta_solver::Tissue) {
        self.look(solver);
        if self.followed == self.instant {
            return;
        }
        self.followed = self.instant;
        self.gather_nodes(solver);
        // One place a node: nothing else is refused.
        self.field.move_vertices(&self.nodes, &mut self.places).ok();
        self.field.move_normals(&self.nodes, &mut self.normals).ok();
    }

    fn gather_nodes(&mut self, solver: &resecta_solver::Tissue) {
        self.nodes.clear();
        self.nodes
            .extend((0..solver.node_count() as u32).map(|node| solver.position(node)));
    }

    /// Begins a step: chips to which nothing was added in the last one are whole. None is taken while its loop goes on.
    pub fn begin_step(&mut self) {
        if let Some(chip) = &mut self.chip {
            chip.grew = false;
        }
    }

    /// Lets a loop go on, or begin where it was. The outermost layer of what it takes vaporises, `kerf_mm` thick, and what is thinner than
    /// `thin_mm` beside it.
    pub fn stroke(&mut self, tool: Entity, sweep: &LoopSweep, [kerf_mm, thin_mm]: [f64; 2]) -> Tool {
        let index = self.strokes.iter().position(|stroke| stroke.tool == tool);
        let index = index.unwrap_or_else(|| {
            let way = LoopStroke::new(sweep.from, sweep.width_mm, sweep.depth_mm).with_kerf(kerf_mm);
            let way = way.with_thin(thin_mm);
            self.strokes.push(Stroke { tool, way });
            self.strokes.len() - 1
        });
        self.strokes[index].way.step_to(sweep.to)
    }

    /// Ends the strokes of tools that no longer cut.
    pub fn end_strokes(&mut self, cuts: impl Fn(Entity) -> bool) {
        self.strokes.retain(|stroke| cuts(stroke.tool));
    }

    /// Takes away what is inside a volume, and pieces that then hang by nothing.
    pub fn cut(
        &mut self,
        solver: &resecta_solver::Tissue,
        by: Option<Entity>,
        tool: &Tool,
    ) -> Result<Taken, FieldError> {
        self.gather_nodes(solver);
        self.take(by, |field, nodes| field.cut(tool, nodes))
    }

    /// Takes away what is inside some volumes as if it had gone long ago: it makes no chip.
    pub fn begin(&mut self, solver: &resecta_solver::Tissue, tools: &[Tool]) -> Result<Vec<Taken>, FieldError> {
        let taken = tools.iter().map(|tool| self.cut(solver, None, tool)).collect();
        if self.chip.take().is_some() {
            self.field.end_chip(&self.nodes)?;
        }
        taken
    }

    /// Takes away whole pentahedra, and pieces that then hang by nothing.
    pub fn empty(&mut self, pentahedra: &[u32]) -> Result<Taken, FieldError> {
        self.take(None, |field, _| field.empty(pentahedra))
    }

    fn take(
        &mut self,
        by: Option<Entity>,
        cut: impl FnOnce(&mut Field, &[Vec3]) -> Result<resecta_field::Cut, FieldError>,
    ) -> Result<Taken, FieldError> {
        if self.chip.is_none() {
            self.field.begin_chip();
        }
        let cut = cut(&mut self.field, &self.nodes)?;
        let mut reached: Vec<u32> = cut.removed.iter().map(|(pentahedron, _)| *pentahedron).collect();
        let mut capsule_mm2 = cut.capsule_mm2;
        if reached.is_empty() {
            // The surface may be finer now where the tool was near, though nothing went.
            self.note_changes();
            return Ok(Taken {
                left: Vec::new(),
                capsule_mm2,
            });
        }
        let left_mm3 = self.field.initial_volume_mm3() - self.field.removed_mm3();
        let most = LARGEST_PIECE_MM3.min(0.5 * left_mm3);
        let pieces = self.field.loose_pieces(&reached, most, &self.holds);
        let loose: Vec<u32> = pieces.into_iter().flat_map(|piece| piece.pentahedra).collect();
        if !loose.is_empty() {
            let freed = self.field.empty(&loose)?;
            capsule_mm2 += freed.capsule_mm2;
            reached.extend(freed.removed.iter().map(|(pentahedron, _)| *pentahedron));
        }
        let crumbs = self.field.brush_off(&reached);
        capsule_mm2 += crumbs.capsule_mm2;
        reached.extend(crumbs.removed.iter().map(|(pentahedron, _)| *pentahedron));
        reached.sort_unstable();
        reached.dedup();
        let field = &self.field;
        let is_shred = |&pentahedron: &u32| (f64::MIN_POSITIVE..SHRED_SHARE).contains(&field.fill(pentahedron));
        self.shreds.extend(reached.iter().copied().filter(is_shred));
        self.note_changes();
        match &mut self.chip {
            Some(chip) => chip.grew = true,
            None => self.chip = Some(ChipUnderWay { tool: by, grew: true }),
        }
        let left = |pentahedron: u32| (pentahedron, self.field.fill(pentahedron));
        Ok(Taken {
            left: reached.into_iter().map(left).collect(),
            capsule_mm2,
        })
    }

    /// Takes away shreds that have torn off, and other pentahedra that have.
    pub fn tear(&mut self, solver: &resecta_solver::Tissue, mut torn: Vec<u32>) -> Result<Taken, FieldError> {
        let field = &self.field;
        self.shreds.retain(|&pentahedron| field.fill(pentahedron) > 0.0);
        let is_inside_out = |pentahedron: u32| solver.volume_of(pentahedron) <= 0.0;
        let is_torn = |pentahedron: u32| {
            field.fill(pentahedron) < THREAD_SHARE && longest_stretch(solver, pentahedron) > TORN_THREAD_STRETCH
        };
        let shreds = self.shreds.iter().copied();
        torn.extend(shreds.filter(|&n| is_inside_out(n) || is_torn(n)));
        if torn.is_empty() {
            return Ok(Taken::default());
        }
        torn.sort_unstable();
        torn.dedup();
        // They go with a chip that is under way and do not make it wait: shreds may tear off for seconds after a stroke.
        let grew = self.chip.as_ref().map(|chip| chip.grew);
        let taken = self.empty(&torn);
        if let (Some(chip), Some(grew)) = (&mut self.chip, grew) {
            chip.grew = grew;
        }
        taken
    }

    /// Coagulates the tissue around some points.
    pub fn coagulate(&mut self, solver: &resecta_solver::Tissue, points: &[DVec3]) -> Result<(), FieldError> {
        self.gather_nodes(solver);
        let (around, deep) = (COAGULATED_AROUND_MM, COAGULATED_DEEP_MM);
        self.field.coagulate(points, around, deep, &self.nodes)?;
        self.note_changes();
        Ok(())
    }

    /// The next chip that is made, and the tool that began it. A chip is whole when a step added nothing to it; its surface
    /// is then made over some steps, as long as it needs.
    pub fn take_chip(&mut self, solver: &resecta_solver::Tissue) -> Option<(Option<Entity>, Chip)> {
        if let Some(ChipUnderWay { tool, .. }) = self.chip.take_if(|chip| !chip.grew) {
            self.gather_nodes(solver);
            // Refused only for places that are not finite, which no tissue has.
            let making = self.field.end_chip(&self.nodes).ok().flatten();
            self.making.extend(making.map(|making| (tool, making)));
        }
        let is_cut = self.chip.is_some();
        let most = if is_cut { MADE_BESIDE_A_CUT } else { MADE_A_STEP };
        let (_, making) = self.making.front_mut()?;
        let chip = making.advance(&self.field, most)?;
        let (tool, _) = self.making.pop_front()?;
        Some((tool, chip))
    }

    /// Chips that were cut out and not told yet.
    pub fn chips_to_come(&self) -> usize {
        self.making.len() + usize::from(self.chip.is_some())
    }
}

/// How many times its length at rest an edge of a pentahedron has, the most stretched one.
fn longest_stretch(solver: &resecta_solver::Tissue, pentahedron: u32) -> f32 {
    let nodes = solver.pentahedron_nodes(pentahedron);
    let stretches = wedge::EDGES.iter().map(|ends| {
        let [from, to] = ends.map(|corner| nodes[corner]);
        let rest = solver.rest_position(from).distance(solver.rest_position(to));
        solver.position(from).distance(solver.position(to)) / rest.max(f32::MIN_POSITIVE)
    });
    stretches.fold(0.0, f32::max)
}

#[cfg(test)]
mod tests {
    use super::*;
    use resecta_solver::{Material, TissueMesh};

    /// A row of cubes of 2 mm, two pentahedra each.
    fn row(cubes: u32) -> resecta_solver::Tissue {
        let corner = |n: u32| DVec3::new((n / 4).into(), (n / 2 % 2).into(), (n % 2).into()) * 2.0;
        let pentahedra = (0..cubes).flat_map(|cube| {
            let c = |x: u32, y: u32, z: u32| 4 * (cube + x) + 2 * y + z;
            [
                [c(0, 0, 0), c(1, 1, 0), c(1, 0, 0), c(0, 0, 1), c(1, 1, 1), c(1, 0, 1)],
                [c(0, 0, 0), c(0, 1, 0), c(1, 1, 0), c(0, 0, 1), c(0, 1, 1), c(1, 1, 1)],
            ]
        });
        let mesh = TissueMesh::from_pentahedra((0..4 * (cubes + 1)).map(corner).collect(), pentahedra.collect());
        resecta_solver::Tissue::new(&mesh, &Material::default()).expect("a row is a tissue")
    }

    /// A row with a hole near its first end that leaves the corners of the first cube's far end, and one of the
    /// pentahedra there of which no more than a share is left.
    fn row_with_hole(radius_mm: f64, share: f64) -> (resecta_solver::Tissue, Fine, u32) {
        let solver = row(6);
        let mut fine = Fine::new(&solver, 0.4).expect("a row can be cut");
        let ball = Tool::Sphere {
            centre: DVec3::new(-0.6, 1.0, 1.0),
            radius_mm,
        };
        fine.cut(&solver, None, &ball).expect("a plain ball");
        let little = |&pentahedron: &u32| (f64::MIN_POSITIVE..share).contains(&fine.field().fill(pentahedron));
        let left = (0..2).find(little).expect("little is left of one");
        (solver, fine, left)
    }

    fn move_nodes(solver: &mut resecta_solver::Tissue, nodes: std::ops::Range<u32>, way: Vec3) {
        for node in nodes {
            let place = solver.position(node) + way;
            solver.set_position(node, place).expect("a finite place");
        }
    }

    fn torn(solver: &resecta_solver::Tissue, fine: &mut Fine) -> Option<Taken> {
        let torn = fine.tear(solver, Vec::new()).expect("pentahedra of the field");
        (!torn.left.is_empty()).then_some(torn)
    }

    #[test]
    fn a_shred_tears_off_when_it_is_inside_out_and_nothing_that_is_whole_or_upright_does() {
        let (mut solver, mut fine, shred) = row_with_hole(2.0, SHRED_SHARE);
        assert!(torn(&solver, &mut fine).is_none(), "it stands upright");

        // The near end goes through the far end of the second cube: all of both is inside out.
        move_nodes(&mut solver, 0..4, Vec3::X * 6.0);
        assert!(solver.volume_of(shred) < 0.0);
        let before = fine.field().volume_mm3();
        let kept = fine.field().kept_mm3(shred);
        let other = fine.field().fill(1 - shred);
        let taken = torn(&solver, &mut fine).expect("a shred tears off");
        assert_eq!(fine.field().fill(shred), 0.0);
        assert!(taken.left.contains(&(shred, 0.0)));
        assert!(before - fine.field().volume_mm3() >= kept);
        assert!(other > SHRED_SHARE, "the scene is to hold a larger one, too");
        // But for the points that it shared with the shred.
        assert!(fine.field().fill(1 - shred) > 0.98 * other, "it stays");
        assert!((2..10).all(|pentahedron| fine.field().fill(pentahedron) == 1.0));
        assert!(torn(&solver, &mut fine).is_none(), "once");
    }

    #[test]
    fn what_tears_off_goes_with_the_chip_under_way_and_does_not_make_it_wait() {
        let (mut solver, mut fine, shred) = row_with_hole(2.0, SHRED_SHARE);
        assert!(fine.take_chip(&solver).is_none(), "it grew in this step");
        fine.begin_step();
        let kept = fine.field().kept_mm3(shred);
        let removed = fine.field().removed_mm3();
        move_nodes(&mut solver, 0..4, Vec3::X * 6.0);
        torn(&solver, &mut fine).expect("a shred tears off");
        let (_, chip) = fine.take_chip(&solver).expect("nothing was cut in this step");
        assert!(chip.rest_volume_mm3 >= removed + kept - 1e-9);
    }

    #[test]
    fn a_thread_tears_off_when_it_is_stretched_to_one_and_a_half_times_its_length() {
        let (mut solver, mut fine, thread) = row_with_hole(2.3, THREAD_SHARE);
        assert!(fine.field().fill(1 - thread) > THREAD_SHARE);
        move_nodes(&mut solver, 0..4, Vec3::X * -0.4);
        assert!(torn(&solver, &mut fine).is_none());
        move_nodes(&mut solver, 0..4, Vec3::X * -0.8);
        assert!(torn(&solver, &mut fine).is_some());
        assert_eq!(fine.field().fill(thread), 0.0);
        assert!(fine.field().fill(1 - thread) > 0.0);
    }
}
