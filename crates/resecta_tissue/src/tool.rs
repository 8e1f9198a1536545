//! What touches tissue: a kinematic tool made of capsules, with or without a cutting loop.

use bevy::prelude::*;

/// A rigid tool that pushes tissue aside and may cut it. Whoever drives it writes [`pose`](Self::pose) (and, when parts
/// move against each other, [`parts`](Self::parts)) before [`TissueSystems::First`](crate::TissueSystems::First); the
/// plugin moves the tool from where the last step left it to there during the step.
///
/// A tool with a pose or a part that is not finite is left out of the step and reported as
/// [`TissuePutAside`](crate::TissuePutAside).
#[derive(Component, Reflect, Debug, Clone, Default)]
#[reflect(Component)]
#[require(ToolLoad)]
pub struct TissueTool {
    /// The capsules that tissue touches, in the tool's own frame.
    pub parts: Vec<ToolPart>,
    /// The cutting loop, in the tool's own frame; none for a tool that only pushes.
    pub cutter: Option<LoopCutter>,
    /// Where the tool is at the end of the coming step (mm, world).
    pub pose: Isometry3d,
    /// Whether the cutting current flows: the loop then resects what it reaches and does not push.
    pub cutting: bool,
    /// Whether the coagulating current flows: tissue that the loop touches is coagulated, where it is cut finer than its
    /// elements. The cutting current goes first.
    pub coagulating: bool,
    /// Where the last step left the tool. The plugin keeps it; set it to `None` to put the tool elsewhere without
    /// sweeping the way in between.
    pub previous: Option<ToolPlacement>,
}

impl TissueTool {
    /// A tool at a pose, without a loop.
    pub fn new(parts: Vec<ToolPart>, pose: Isometry3d) -> Self {
        Self {
            parts,
            pose,
            ..default()
        }
    }

    /// The same tool with a loop.
    pub fn with_cutter(mut self, cutter: LoopCutter) -> Self {
        self.cutter = Some(cutter);
        self
    }

    /// Where the tool is at the end of the coming step.
    pub fn placement(&self) -> ToolPlacement {
        ToolPlacement {
            pose: self.pose,
            parts: self.parts.clone(),
            cutter: self.cutter,
        }
    }

    /// Where the step starts: the previous placement. Parts that it lacks start where they are in the tool now.
    pub fn step_start(&self) -> ToolPlacement {
        let Some(previous) = &self.previous else {
            return self.placement();
        };
        let new = self.parts.iter().skip(previous.parts.len());
        ToolPlacement {
            parts: previous.parts.iter().chain(new).copied().collect(),
            ..previous.clone()
        }
    }

    /// Whether every number of the tool is finite and no radius or size is negative.
    pub fn is_valid(&self) -> bool {
        let pose = |pose: &Isometry3d| pose.translation.is_finite() && pose.rotation.is_finite();
        pose(&self.pose)
            && self.parts.iter().all(ToolPart::is_valid)
            && self.cutter.as_ref().is_none_or(LoopCutter::is_valid)
            && self.previous.as_ref().is_none_or(|previous| {
                pose(&previous.pose)
                    && previous.parts.iter().all(ToolPart::is_valid)
                    && previous.cutter.as_ref().is_none_or(LoopCutter::is_valid)
            })
    }
}

/// With what tissue pressed on a tool in the last step, mean over the step. The plugin writes it.
#[derive(Component, Reflect, Debug, Clone, Copy, Default, PartialEq)]
#[reflect(Component, Default)]
pub struct ToolLoad {
    /// Force of the tissue on the tool, N, in the world.
    pub force_n: Vec3,
    /// Moment of that force about the world's origin, N mm.
    pub moment_n_mm: Vec3,
}

impl ToolLoad {
    /// Adds what a force of the tool on the tissue at a place (µN, mm) does to the tool.
    pub(crate) fn add(&mut self, on_tissue_un: Vec3, place: Vec3) {
        let force_n = on_tissue_un * -1e-6;
        self.force_n += force_n;
        self.moment_n_mm += place.cross(force_n);
    }

    /// The moment about a point, N mm.
    pub fn moment_about(&self, point: Vec3) -> Vec3 {
        self.moment_n_mm - point.cross(self.force_n)
    }
}

/// A pose of a tool together with the placement of its parts.
#[derive(Reflect, Debug, Clone, Default, PartialEq)]
pub struct ToolPlacement {
    /// Position (mm) and orientation in the world.
    pub pose: Isometry3d,
    /// The parts in the tool's frame.
    pub parts: Vec<ToolPart>,
    /// The loop in the tool's frame.
    pub cutter: Option<LoopCutter>,
}

/// A segment with a radius (capsule) of a tool.
#[derive(Reflect, Debug, Clone, Copy, PartialEq)]
pub struct ToolPart {
    /// One end of the axis, mm, in the tool's frame.
    pub a: Vec3,
    /// The other end of the axis, mm, in the tool's frame. May equal `a`: a sphere.
    pub b: Vec3,
    /// Radius of the capsule, mm, >= 0.
    pub radius_mm: f32,
    /// What the part is.
    pub kind: ToolPartKind,
}

impl ToolPart {
    fn is_valid(&self) -> bool {
        self.a.is_finite() && self.b.is_finite() && self.radius_mm.is_finite() && self.radius_mm >= 0.0
    }
}

/// What a part of a tool is, which decides whether it cuts.
#[derive(Reflect, Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, Default)]
pub enum ToolPartKind {
    /// Shaft, sheath, beak: always pushes.
    #[default]
    Sheath,
    /// Wire of the loop: pushes unless the tool is cutting.
    Loop,
}

/// The layer of tissue that a current vaporises along a loop's wire. By default none: the loop cuts as a blade does.
#[derive(Reflect, Debug, Clone, Copy, PartialEq, Default)]
pub struct Kerf {
    /// Its thickness outside of the wire's middle line, mm, 0 or more: the wall of a cut lies so far beyond that line.
    pub outside_mm: f32,
    /// Its thickness inside of the wire's middle line, mm, 0 or more: a chip's surface lies so far within that line. It counts where tissue
    /// is cut finer than its elements ([`CutDetail::Field`](crate::CutDetail)).
    pub inside_mm: f32,
    /// Tissue thinner than this that is left beside the wall of a cut vaporises with it, mm, 0 or more. It counts where tissue is cut finer
    /// than its elements, up to twice the spacing there.
    pub thin_mm: f32,
}

impl Kerf {
    fn is_valid(&self) -> bool {
        [self.outside_mm, self.inside_mm, self.thin_mm]
            .iter()
            .all(|mm| mm.is_finite() && *mm >= 0.0)
    }
}

/// The half-circle cutting loop of a resectoscope.
#[derive(Reflect, Debug, Clone, Copy, PartialEq)]
pub struct LoopCutter {
    /// Width of the loop from wire to wire, along the wire's middle line, mm (6 to 7 in practice).
    pub width_mm: f32,
    /// Depth of the loop from its open side to the deepest point, mm (4 to 5 in practice).
    pub depth_mm: f32,
    /// What the current vaporises around the wire.
    pub kerf: Kerf,
    /// Middle of the open side, mm, in the tool's frame.
    pub centre: Vec3,
    /// Unit normal of the loop's plane, in the tool's frame.
    pub travel: Vec3,
    /// Unit direction from the open side to the deepest point, in the tool's frame.
    pub down: Vec3,
}

impl LoopCutter {
    fn is_valid(&self) -> bool {
        self.width_mm.is_finite()
            && self.width_mm > 0.0
            && self.depth_mm.is_finite()
            && self.depth_mm > 0.0
            && self.kerf.is_valid()
            && self.centre.is_finite()
            && self.travel.is_normalized()
            && self.down.is_normalized()
    }

    /// The loop's deepest point in the tool's frame, mm.
    pub fn deepest_point(&self) -> Vec3 {
        self.centre + self.down * self.depth_mm
    }
}
