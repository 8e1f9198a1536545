//! The volume that a cutting loop sweeps over while it moves from one pose to the next.

use glam::DVec3;

/// Where the loop is: a plane and, in it, the middle of the loop's open side and the way to its deepest point.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LoopPose {
    /// Middle of the open side, mm.
    pub centre: DVec3,
    /// Unit normal of the loop's plane.
    pub travel: DVec3,
    /// Unit direction from `centre` to the deepest point of the wire; at right angles to `travel`.
    pub down: DVec3,
}

impl LoopPose {
    fn between(&self, other: &LoopPose, share: f64) -> LoopPose {
        let travel = self.travel.lerp(other.travel, share).normalize_or(self.travel);
        let down = self.down.lerp(other.down, share).reject_from(travel);
        LoopPose {
            centre: self.centre.lerp(other.centre, share),
            travel,
            down: down.normalize_or(self.down),
        }
    }
}

/// A loop on its way from one pose to another. The wire is a half circle of that width, stretched to that depth.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LoopSweep {
    /// Pose at the start of the step.
    pub from: LoopPose,
    /// Pose at the end of the step.
    pub to: LoopPose,
    /// Width of the open side, mm.
    pub width_mm: f64,
    /// From the open side to the deepest point, mm.
    pub depth_mm: f64,
}

impl LoopSweep {
    /// Whether the area inside the wire passes over the point.
    ///
    /// The point is passed when it changes sides of the loop's plane; the instant is found by bisection to 1/4096 of the
    /// step, and the point must then lie inside the wire. Successive sweeps share a pose, so they leave no gap.
    pub fn contains(&self, point: DVec3) -> bool {
        let side_of = |pose: &LoopPose| (point - pose.centre).dot(pose.travel);
        let start = side_of(&self.from);
        // Most points are on one side at both ends.
        if start * side_of(&self.to) > 0.0 || !start.is_finite() {
            return false;
        }
        let side = |share: f64| side_of(&self.from.between(&self.to, share));
        let (mut low, mut high) = (0.0, 1.0);
        for _ in 0..12 {
            let middle = 0.5 * (low + high);
            if start * side(middle) > 0.0 {
                low = middle;
            } else {
                high = middle;
            }
        }
        let pose = self.from.between(&self.to, 0.5 * (low + high));
        let offset = point - pose.centre;
        let depth = offset.dot(pose.down) / self.depth_mm;
        let lateral = offset.dot(pose.travel.cross(pose.down)) / (0.5 * self.width_mm);
        depth >= 0.0 && depth * depth + lateral * lateral <= 1.0
    }

    /// A ball that holds the whole sweep: centre and radius, mm.
    pub fn bounding_ball(&self) -> (DVec3, f64) {
        let reach = self.depth_mm.max(0.5 * self.width_mm);
        let middle = 0.5 * (self.from.centre + self.to.centre);
        (middle, 0.5 * self.from.centre.distance(self.to.centre) + reach)
    }

    /// Whether every number of the sweep is finite and the loop has a size.
    pub fn is_finite(&self) -> bool {
        let pose = |pose: &LoopPose| pose.centre.is_finite() && pose.travel.is_finite() && pose.down.is_finite();
        pose(&self.from) && pose(&self.to) && self.width_mm > 0.0 && self.depth_mm > 0.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn pose(z: f64) -> LoopPose {
        LoopPose {
            centre: DVec3::new(0.0, 0.0, z),
            travel: DVec3::NEG_Z,
            down: DVec3::Y,
        }
    }

    /// Counts points of a fine grid inside a chain of sweeps.
    fn swept_volume(poses: &[LoopPose], spacing: f64) -> f64 {
        let steps = |from: f64, to: f64| (((to - from) / spacing) as i32, from);
        let ((nx, x0), (ny, y0), (nz, z0)) = (steps(-4.0, 4.0), steps(-1.0, 6.0), steps(-2.0, 30.0));
        let mut count = 0;
        for (i, j, k) in (0..nx).flat_map(|i| (0..ny).flat_map(move |j| (0..nz).map(move |k| (i, j, k)))) {
            let centre = |n: i32, start: f64| start + (f64::from(n) + 0.5) * spacing;
            let point = DVec3::new(centre(i, x0), centre(j, y0), centre(k, z0));
            let inside = poses.windows(2).any(|pair| {
                let sweep = LoopSweep {
                    from: pair[0],
                    to: pair[1],
                    width_mm: 6.5,
                    depth_mm: 4.5,
                };
                sweep.contains(point)
            });
            count += i32::from(inside);
        }
        f64::from(count) * spacing.powi(3)
    }

    #[test]
    fn a_straight_pull_sweeps_half_an_ellipse_times_its_length() {
        let poses: Vec<LoopPose> = (0..=5).map(|step| pose(25.0 - 5.0 * f64::from(step))).collect();
        let exact = std::f64::consts::PI * 3.25 * 4.5 / 2.0 * 25.0;
        let volume = swept_volume(&poses, 0.25);
        assert!((volume / exact - 1.0).abs() < 0.01, "{volume} against {exact}");
    }

    #[test]
    fn the_volume_swept_does_not_depend_on_how_the_pull_is_divided() {
        let fine: Vec<LoopPose> = (0..=50).map(|step| pose(25.0 - 0.5 * f64::from(step))).collect();
        assert_eq!(swept_volume(&fine, 0.5), swept_volume(&[pose(25.0), pose(0.0)], 0.5));
    }

    #[test]
    fn a_loop_at_rest_sweeps_nothing() {
        assert_eq!(swept_volume(&[pose(10.1), pose(10.1)], 0.5), 0.0);
    }
}
