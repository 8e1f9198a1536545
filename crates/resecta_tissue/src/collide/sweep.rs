//! The way of a tool through a step.

use std::ops::Range;

use bevy::prelude::*;
use resecta_solver::{LoopPose, LoopSweep};

use crate::tool::{LoopCutter, TissueTool, ToolPart, ToolPartKind, ToolPlacement};

/// Longest way of a part in one pass, mm: thin parts move in finer passes, so that a part is never carried past what it
/// should push. A thick one among them is looked at in every second pass or so.
const PASS_RANGE_MM: (f32, f32) = (0.5, 1.0);
/// Most passes in a step: 16 mm a step of a thin part, 960 mm/s at 60 steps a second. Faster tools move further a pass.
const PASSES_MAX: u32 = 32;

/// One of the equal passes of a step.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Pass {
    pub number: u32,
    pub of: u32,
}

impl Pass {
    /// All of a step that has so many.
    pub fn all(of: u32) -> impl Iterator<Item = Pass> {
        (0..of).map(move |number| Pass { number, of })
    }
}

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

impl PartSweep {
    /// How far it moves, mm.
    pub fn motion(&self) -> f32 {
        self.from.motion(&self.to)
    }

    /// Its way over the longest that it may go in a pass.
    fn ranges(&self) -> f32 {
        self.motion() / self.radius.clamp(PASS_RANGE_MM.0, PASS_RANGE_MM.1)
    }

    /// How many passes its way needs.
    fn passes(&self) -> u32 {
        (self.ranges().ceil() as u32).clamp(1, PASSES_MAX)
    }

    /// How many of so many passes of its way are together no longer than it may go in one; at least 1.
    fn passes_together(&self, passes: u32) -> u32 {
        ((passes as f32 / self.ranges()) as u32).clamp(1, passes)
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

    /// Whether any part of the tool pushes.
    pub fn pushes_anything(&self) -> bool {
        self.to.parts.iter().any(|part| self.pushes(part.kind))
    }

    /// The ways of all parts through the step.
    pub fn parts(&self) -> impl Iterator<Item = PartSweep> + '_ {
        (0..self.to.parts.len()).filter_map(|number| self.part(number, 0.0, 1.0))
    }

    /// The ways of all parts from a pass on, with their numbers and the passes that each is for: of a part that moves less than it may
    /// in a pass, several. None of a part that an earlier pass was for.
    pub fn parts_from(&self, pass: Pass) -> impl Iterator<Item = (u32, Range<u32>, PartSweep)> + '_ {
        let share = move |number: u32| number as f32 / pass.of as f32;
        (0u32..).zip(self.parts()).filter_map(move |(number, whole)| {
            let together = whole.passes_together(pass.of);
            if !pass.number.is_multiple_of(together) {
                return None;
            }
            let passes = pass.number..(pass.number + together).min(pass.of);
            let part = self.part(number as usize, share(passes.start), share(passes.end))?;
            Some((number, passes, part))
        })
    }

    /// The way of a part from `start` to `end`, shares of the step.
    fn part(&self, number: usize, start: f32, end: f32) -> Option<PartSweep> {
        let (first, last) = (self.from.parts.get(number)?, self.to.parts.get(number)?);
        Some(PartSweep {
            kind: last.kind,
            radius: last.radius_mm,
            from: axis(&self.pose(start), first, last, start),
            to: axis(&self.pose(end), first, last, end),
        })
    }

    /// How many passes the step needs, given which parts may touch something.
    pub fn passes(&self, touches: impl Fn(&PartSweep) -> bool) -> u32 {
        let parts = self.parts().filter(|part| self.pushes(part.kind) && touches(part));
        parts.map(|part| part.passes()).fold(1, u32::max)
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

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// A shaft of 4 mm and a wire of 0.2 mm beyond its end, moved and turned about the shaft's other end.
    fn moved(by_mm: f32, turned_rad: f32) -> ToolMotion {
        let part = |a: f32, b: f32, radius_mm: f32, kind| ToolPart {
            a: Vec3::Z * a,
            b: Vec3::Z * b,
            radius_mm,
            kind,
        };
        let parts = vec![
            part(0.0, 30.0, 4.0, ToolPartKind::Sheath),
            part(30.0, 45.0, 0.2, ToolPartKind::Loop),
        ];
        let mut tool = TissueTool::new(parts, Isometry3d::IDENTITY);
        tool.previous = Some(tool.placement());
        tool.pose = Isometry3d::new(Vec3::Z * by_mm, Quat::from_rotation_x(turned_rad));
        ToolMotion::new(Entity::PLACEHOLDER, &tool)
    }

    proptest! {
        #[test]
        fn each_part_goes_its_way_once_in_stretches_no_longer_than_it_may(by_mm in 0.0..15.0f32, turned_rad in 0.0..0.1f32) {
            let motion = moved(by_mm, turned_rad);
            let of = motion.passes(|_| true);
            for (number, whole) in (0..).zip(motion.parts()) {
                let from: Vec<_> = Pass::all(of).flat_map(|pass| motion.parts_from(pass)).collect();
                let stretches = from.iter().filter(|(part, ..)| *part == number);
                let (mut next, mut at) = (0, whole.from);
                for (_, passes, part) in stretches {
                    prop_assert_eq!(passes.start, next);
                    prop_assert!(at.motion(&part.from) < 1e-4);
                    // Moved while it turns by an angle, a part goes at most half the angle faster at first than in the mean.
                    let most = 1.001 + 0.5 * turned_rad;
                    prop_assert!(part.ranges() < most || of == PASSES_MAX, "{part:?}");
                    (next, at) = (passes.end, part.to);
                }
                prop_assert_eq!(next, of);
                prop_assert!(at.motion(&whole.to) < 1e-4);
            }
        }
    }

    #[test]
    fn a_thick_part_is_looked_at_in_every_second_pass_of_a_thin_one() {
        let motion = moved(1.9, 0.0);
        assert_eq!(motion.passes(|_| true), 4);
        let looked_at: Vec<u32> = Pass::all(4)
            .flat_map(|pass| motion.parts_from(pass))
            .map(|(number, ..)| number)
            .collect();
        assert_eq!(looked_at, [0, 1, 1, 0, 1, 1]);
    }
}
