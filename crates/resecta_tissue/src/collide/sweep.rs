//! The way of a tool through a step.

use bevy::prelude::*;
use resecta_solver::{LoopPose, LoopSweep};

use crate::tool::{LoopCutter, TissueTool, ToolPart, ToolPartKind, ToolPlacement};

/// Longest way of a part in one pass, mm: thin parts move in finer passes, so that a part is never carried past what it
/// should push.
const PASS_RANGE_MM: (f32, f32) = (0.5, 1.0);
/// Most passes in a step: 16 mm a step of a thin part, 960 mm/s at 60 steps a second. Faster tools move further a pass.
const PASSES_MAX: u32 = 32;

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

/// The way of one part during one pass.
#[derive(Debug, Clone, Copy)]
pub struct PartSweep {
    pub kind: ToolPartKind,
    pub radius: f32,
    pub from: Axis,
    pub to: Axis,
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

    /// Whether any part of the tool pushes.
    pub fn pushes_anything(&self) -> bool {
        self.to.parts.iter().any(|part| self.pushes(part.kind))
    }

    /// The ways of all parts from `start` to `end`, shares of the step.
    pub fn parts(&self, start: f32, end: f32) -> impl Iterator<Item = PartSweep> + '_ {
        let (from, to) = (self.pose(start), self.pose(end));
        self.from
            .parts
            .iter()
            .zip(&self.to.parts)
            .map(move |(first, last)| PartSweep {
                kind: last.kind,
                radius: last.radius_mm,
                from: axis(&from, first, last, start),
                to: axis(&to, first, last, end),
            })
    }

    /// How many passes the step needs, given which parts may touch something.
    pub fn passes(&self, touches: impl Fn(&PartSweep) -> bool) -> u32 {
        let needed = self
            .parts(0.0, 1.0)
            .filter(|part| self.pushes(part.kind) && touches(part))
            .map(|part| part.from.motion(&part.to) / part.radius.clamp(PASS_RANGE_MM.0, PASS_RANGE_MM.1))
            .fold(1.0, f32::max);
        (needed.ceil() as u32).clamp(1, PASSES_MAX)
    }

    /// What the loop sweeps over in the step.
    pub fn loop_sweep(&self) -> Option<LoopSweep> {
        let to = self.to.cutter?;
        let from = self.from.cutter.unwrap_or(to);
        Some(LoopSweep {
            from: loop_pose(&self.from.pose, &from),
            to: loop_pose(&self.to.pose, &to),
            width_mm: f64::from(to.width_mm),
            depth_mm: f64::from(to.depth_mm),
        })
    }

    /// The loop's deepest point in the world at the end of the step, mm.
    pub fn loop_deepest_point(&self) -> Option<Vec3> {
        Some(self.to.pose.transform_point(self.to.cutter?.deepest_point()).into())
    }

    fn pose(&self, share: f32) -> Isometry3d {
        if share <= 0.0 {
            return self.from.pose;
        }
        if share >= 1.0 {
            return self.to.pose;
        }
        Isometry3d {
            rotation: self.from.pose.rotation.slerp(self.to.pose.rotation, share),
            translation: self.from.pose.translation.lerp(self.to.pose.translation, share),
        }
    }
}

fn axis(pose: &Isometry3d, first: &ToolPart, last: &ToolPart, share: f32) -> Axis {
    Axis {
        a: pose.transform_point(first.a.lerp(last.a, share)).into(),
        b: pose.transform_point(first.b.lerp(last.b, share)).into(),
    }
}

fn loop_pose(pose: &Isometry3d, cutter: &LoopCutter) -> LoopPose {
    LoopPose {
        centre: Vec3::from(pose.transform_point(cutter.centre)).as_dvec3(),
        travel: (pose.rotation * cutter.travel).as_dvec3().normalize(),
        down: (pose.rotation * cutter.down).as_dvec3().normalize(),
    }
}
