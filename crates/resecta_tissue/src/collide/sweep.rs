//! The way of a tool through a step.

use bevy::prelude::*;
use resecta_solver::{LoopPose, LoopSweep};

use crate::tool::{Kerf, LoopCutter, TissueTool, ToolPart, ToolPartKind, ToolPlacement};

/// A tool's way from the start to the end of a step.
#[derive(Debug, Clone)]
pub struct ToolMotion {
    pub entity: Entity,
    pub cutting: bool,
    pub coagulating: bool,
    from: ToolPlacement,
    to: ToolPlacement,
}

/// The axis of a part in the world.
#[derive(Debug, Clone, Copy)]
pub struct Axis {
    pub a: Vec3,
    pub b: Vec3,
}

impl Axis {
    /// The point at a share of the axis.
    pub fn at(&self, share: f32) -> Vec3 {
        self.a.lerp(self.b, share)
    }

    /// Where along the axis it is nearest to a point, as a share.
    pub fn share_nearest(&self, point: Vec3) -> f32 {
        let squared = self.a.distance_squared(self.b);
        if squared > 0.0 {
            ((point - self.a).dot(self.b - self.a) / squared).clamp(0.0, 1.0)
        } else {
            0.0
        }
    }

    /// How far the axis moves to become another, mm: no point of it moves further.
    pub fn motion(&self, to: &Axis) -> f32 {
        self.a.distance(to.a).max(self.b.distance(to.b))
    }
}

/// The way of one part through a step.
#[derive(Debug, Clone, Copy)]
pub struct PartSweep {
    pub kind: ToolPartKind,
    pub radius: f32,
    pub from: Axis,
    pub to: Axis,
}

impl PartSweep {
    /// How far it moves, mm.
    pub fn motion(&self) -> f32 {
        self.from.motion(&self.to)
    }
}

impl ToolMotion {
    pub fn new(entity: Entity, tool: &TissueTool) -> Self {
        Self {
            entity,
            cutting: tool.cutting && tool.cutter.is_some(),
            coagulating: tool.coagulating,
            from: tool.step_start(),
            to: tool.placement(),
        }
    }

    /// Whether a current flows through a part of that kind.
    pub fn current(&self, kind: ToolPartKind) -> bool {
        kind == ToolPartKind::Loop && (self.cutting || self.coagulating)
    }

    /// Whether its loop coagulates what it touches.
    pub fn coagulates(&self) -> bool {
        self.coagulating && !self.cutting
    }

    /// Whether a part of that kind pushes: a loop that cuts does not.
    pub fn pushes(&self, kind: ToolPartKind) -> bool {
        kind == ToolPartKind::Sheath || !self.cutting
    }

    /// The ways of all parts through the step.
    pub fn parts(&self) -> impl Iterator<Item = PartSweep> + '_ {
        self.from
            .parts
            .iter()
            .zip(&self.to.parts)
            .map(|(first, last)| PartSweep {
                kind: last.kind,
                radius: last.radius_mm,
                from: axis(&self.from.pose, first),
                to: axis(&self.to.pose, last),
            })
    }

    /// What the loop takes on its way through the step: what it sweeps over, and what vaporises beyond that.
    pub fn loop_sweep(&self) -> Option<LoopSweep> {
        let to = self.to.cutter?;
        let from = self.from.cutter.unwrap_or(to);
        Some(LoopSweep {
            from: loop_pose(&self.from.pose, &from),
            to: loop_pose(&self.to.pose, &to),
            width_mm: f64::from(to.width_mm + 2.0 * to.kerf.outside_mm),
            depth_mm: f64::from(to.depth_mm + to.kerf.outside_mm),
        })
    }

    /// How thick the outermost layer of what the loop takes is that vaporises, and how thin what vaporises beside it, mm.
    pub fn kerf_and_thin_mm(&self) -> [f64; 2] {
        let kerf = self.to.cutter.map_or(Kerf::default(), |cutter| cutter.kerf);
        [kerf.outside_mm + kerf.inside_mm, kerf.thin_mm].map(f64::from)
    }

    /// The loop's deepest point in the world at the end of the step, mm.
    pub fn loop_deepest_point(&self) -> Option<Vec3> {
        Some(self.to.pose.transform_point(self.to.cutter?.deepest_point()).into())
    }
}

fn axis(pose: &Isometry3d, part: &ToolPart) -> Axis {
    Axis {
        a: pose.transform_point(part.a).into(),
        b: pose.transform_point(part.b).into(),
    }
}

fn loop_pose(pose: &Isometry3d, cutter: &LoopCutter) -> LoopPose {
    LoopPose {
        centre: Vec3::from(pose.transform_point(cutter.centre)).as_dvec3(),
        travel: (pose.rotation * cutter.travel).as_dvec3().normalize(),
        down: (pose.rotation * cutter.down).as_dvec3().normalize(),
    }
}
