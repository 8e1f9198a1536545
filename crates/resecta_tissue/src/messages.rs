//! What the plugin tells: contacts, resections, and what it had to put aside.

use std::sync::Arc;

use bevy::prelude::*;
use resecta_anatomy::Zone;
use resecta_field::{Chip, FieldError};
use resecta_solver::{EditError, NodeKind, StepError};

use crate::tool::ToolPartKind;

/// A part of a tool touched a tissue's surface during this step. Sent once a step for each part and pentahedron that
/// carries what was touched, where it is deepest; ordered by tissue, tool, part and pentahedron.
#[derive(Message, Debug, Clone, PartialEq)]
pub struct TissueContact {
    /// The tissue touched.
    pub tissue: Entity,
    /// The entity with the [`TissueTool`](crate::TissueTool).
    pub tool: Entity,
    /// What part of the tool touched.
    pub part: ToolPartKind,
    /// The pentahedron.
    pub pentahedron: u32,
    /// The point of the surface that was touched, mm.
    pub point: Vec3,
    /// Unit direction from the tool into the tissue.
    pub normal: Vec3,
    /// How far that point lies inside the part at the end of the step, mm, >= 0: the error of the contact.
    pub depth_mm: f32,
    /// With what the part pressed on the pentahedron, N, >= 0: mean over the step.
    pub force_n: f32,
    /// What surface was touched: the kind that most of the corners of the triangle there have.
    pub kind: NodeKind,
    /// Whether a current (cutting or coagulating) flowed through this part: only through the loop.
    pub current: bool,
}

/// Tissue went: pentahedra or parts of them, by a loop, because a system despawned entities, or because a shred that cuts
/// had left tore off.
#[derive(Message, Debug, Clone, PartialEq)]
pub struct TissueResected {
    /// The tissue they left.
    pub tissue: Entity,
    /// The tool that cut; none when a system despawned an entity or something tore off.
    pub tool: Option<Entity>,
    /// Indices of the pentahedra of which nothing is left, ascending.
    pub pentahedra: Vec<u32>,
    /// What each pentahedron lost, those that stay with less in them included: volume at rest, mm³; ascending.
    pub taken_mm3: Vec<(u32, f64)>,
    /// Their sum, mm³. Sums over messages to exactly what the tissue lost.
    pub volume_mm3: f64,
    /// The same by zone, indexed by [`Zone::index`].
    pub by_zone_mm3: [f64; Zone::COUNT],
    /// Area of the capsule that went with them, mm².
    pub capsule_area_mm2: f64,
}

/// A stroke is over, and this is what it cut out: a body of its own, for whoever lets it float away. Told some steps after the
/// stroke's end, a tenth of a second for a long one: its surface is made in parts. Only of a tissue that is cut finer than
/// its elements ([`CutDetail::Field`](crate::CutDetail)).
#[derive(Message, Debug, Clone)]
pub struct TissueChip {
    /// The tissue it came from.
    pub tissue: Entity,
    /// The tool that cut; none when a system despawned an entity or something tore off.
    pub tool: Option<Entity>,
    /// Its surface, volume and inertia. The volumes of all chips, and what vaporised of them, sum to what the tissue lost.
    pub chip: Arc<Chip>,
}

/// Something was refused or left out of a step because it made no sense, and what that was.
#[derive(Message, Debug, Clone, PartialEq)]
pub struct TissuePutAside {
    /// The tissue concerned; for a tool, the tool's entity.
    pub tissue: Entity,
    /// What was put aside.
    pub subject: PutAsideSubject,
    /// Why.
    pub reason: PutAsideReason,
}

/// What a [`TissuePutAside`] is about.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PutAsideSubject {
    /// A node, by index.
    Node(u32),
    /// A spring, by index.
    Spring(u32),
    /// A pentahedron, by index.
    Pentahedron(u32),
    /// The tool of the entity named in the message.
    Tool,
    /// The motion of the whole tissue in one step.
    Step,
}

/// Why something was put aside.
#[derive(Debug, Clone, PartialEq)]
pub enum PutAsideReason {
    /// An edited value makes no sense. The solver keeps the old one and the component shows it again.
    Edit(EditError),
    /// A part's `tissue` or `index` does not lead back to its entity. What it says is ignored.
    Identity,
    /// A pose, part or loop of a tool is not finite or has no size. The tool is left out of the step.
    Tool,
    /// A number of the node's motion was not finite: the solver holds it where it was for good.
    Motion,
    /// The solver refused the step: the tissue did not move.
    Step(StepError),
    /// That many contacts of the step could not be enforced.
    Contacts(usize),
    /// The number of the collapse law in the settings cannot be: nothing collapsed into the cut.
    Collapse,
    /// The tissue cannot be cut as finely as its settings say, and is cut by whole pentahedra; or a cut was refused.
    Field(FieldError),
}

/// The tissue's arrays contradict each other after a structural change: a defect of the program, never of input.
/// Looked for in debug builds and where [`TissueSettings::check_consistency`](crate::TissueSettings) asks for it.
#[derive(Message, Debug, Clone, PartialEq)]
pub struct TissueInconsistent {
    /// The tissue.
    pub tissue: Entity,
    /// The first inconsistency, in words.
    pub inconsistency: String,
}
