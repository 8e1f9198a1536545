//! The signed distance to what a half ellipse sweeps over, and strokes of a loop divided into steps.
//!
//! A point is swept when the loop's plane passes it while it is inside the wire. With the pose between two others as in
//! [`LoopSweep`], the plane's normal not normalised, the plane passes a point at the root of a quadratic: the instant
//! is exact. In the plane of that instant the distance to the ellipse is taken to first order (`q (q - 1) / |∇q²/2|`,
//! whose zero set is the ellipse); the distances to the planes at both ends bound it along the way. All is continuous,
//! and the zero set is the boundary of the swept solid. Outside of an edge between two faces the larger of their
//! distances is taken, not the distance to the edge: between points, values that are linear on either side keep the
//! edge sharper.
//!
//! Where one step of a stroke ends and the next begins, the solid's end faces are no boundary of what the stroke
//! sweeps. The values beside them would say so all the same, and move the wall next to them inwards by up to a spacing:
//! a ridge a step. So a step under way also gives points shortly behind its start that are gone already the distance
//! that they have to the stroke as a whole, as if the step had begun where the stroke did.
//!
//! The current vaporises a kerf, the outermost layer of what the loop takes. A third distance is that to the rest, which becomes the
//! chip: the same with the ellipse drawn in by the kerf. The open side and the end faces have no wire, and no kerf.

use glam::{DVec2, DVec3, Vec2, Vec3};
use resecta_solver::{LoopPose, LoopSweep};

use crate::lanes;
use crate::sublattice::{LANES, Lanes};
use crate::tool::{Bounds, Tool};

/// How far beside a place the wall's distance is taken again for its slope, mm: ten thousand times the resolution of single precision,
/// and little beside the wire's radius.
const DIFFERENCE_MM: f32 = 0.01;

/// A half ellipse on its way.
#[derive(Debug, Clone)]
pub struct Swept {
    from: LoopPose,
    to: LoopPose,
    /// Half the width, and the depth.
    size: DVec2,
    /// How far the stroke had come, and how far behind the step it is looked back at.
    run: f32,
    reach: f32,
    /// How far the chip's surface lies inside of the ellipse.
    kerf: f32,
    thin: f32,
    /// Places are given relative to this: the centre at the start.
    pub origin: DVec3,
    /// From centre to centre, and the part of it that is along the first plane's normal.
    moved: Vec3,
    forward: f32,
    /// The third axis at the start.
    across: Vec3,
    is_straight: bool,
    /// How far sideways a profile strays from the middle one, and how far its axes turn.
    sway: f32,
    turn: f32,
}

impl Swept {
    pub fn new(sweep: &LoopSweep, [run, reach, kerf, thin]: [f64; 4]) -> Self {
        let unit = |pose: LoopPose| {
            let travel = pose.travel.normalize();
            LoopPose {
                travel,
                down: pose.down.reject_from_normalized(travel).normalize(),
                ..pose
            }
        };
        let size = DVec2::new(0.5 * sweep.width_mm, sweep.depth_mm);
        Self::between(unit(sweep.from), unit(sweep.to), size, [run, reach, kerf, thin])
    }

    pub fn straight(from: DVec3, to: DVec3, travel: DVec3, down: DVec3, radius: f64) -> Self {
        let pose = |centre| LoopPose { centre, travel, down };
        Self::between(pose(from), pose(to), DVec2::splat(radius), [0.0; 4])
    }

    fn between(from: LoopPose, to: LoopPose, size: DVec2, [run, reach, kerf, thin]: [f64; 4]) -> Self {
        let moved = to.centre - from.centre;
        let sideways = moved.reject_from_normalized(from.travel).length();
        let turn = from.travel.distance(to.travel).max(from.down.distance(to.down));
        Self {
            from,
            to,
            size,
            run: run as f32,
            reach: reach as f32,
            kerf: kerf as f32,
            thin: thin as f32,
            origin: from.centre,
            moved: moved.as_vec3(),
            forward: moved.dot(from.travel) as f32,
            across: from.travel.cross(from.down).as_vec3(),
            is_straight: from.travel == to.travel && from.down == to.down,
            sway: (0.5 * sideways) as f32,
            turn: (2.0 * turn) as f32,
        }
    }

    /// How thick a layer of what goes vaporises, mm.
    pub fn kerf_mm(&self) -> f32 {
        self.kerf
    }

    /// See `Prepared::thin_mm`.
    pub fn thin_mm(&self) -> f32 {
        self.thin
    }

    /// See `Prepared::distances`.
    #[inline(always)]
    pub fn distances(&self, places: &[Lanes; 3]) -> [Lanes; 3] {
        let [before, after] = self.heights(places);
        let [profile, inner] = self.profiles(places, &before, &after);
        let (run, reach) = (self.run, self.run.min(self.reach));
        let mut result = [[0.0; LANES]; 3];
        for l in 0..LANES {
            let (start, end) = (before[l].abs(), after[l].abs());
            let height = start.min(end);
            let is_looked_back_at = (start < end) & (height < reach);
            let passes = before[l] * after[l] <= 0.0;
            let of = |profile: f32| {
                let inside = profile.max(-(start + run).min(end));
                let outside = profile.max(height);
                let behind = profile.max(height - run).max(-end).min(outside);
                let gone = if is_looked_back_at { behind } else { outside };
                if passes { [inside; 2] } else { [outside, gone] }
            };
            [result[0][l], result[1][l]] = of(profile[l]);
            [_, result[2][l]] = of(inner[l]);
        }
        result
    }

    /// See `Prepared::wall`.
    pub fn wall(&self, place: Vec3) -> Option<(f32, Vec3)> {
        // The place, and one beside it along each axis: the slope by differences.
        let beside = [Vec3::ZERO, Vec3::X, Vec3::Y, Vec3::Z].map(|axis| place + axis * DIFFERENCE_MM);
        let places = [0, 1, 2].map(|n| std::array::from_fn(|lane| beside[lane.min(3)][n]));
        let [before, after] = self.heights(&places);
        if before[0] * after[0] > 0.0 {
            return None;
        }
        let [profile, _] = self.profiles(&places, &before, &after);
        let slope = Vec3::from_slice(&profile[1..4]) - profile[0];
        Some((profile[0], slope.try_normalize()?))
    }

    /// See [`half_ellipses`]: in the planes that pass the places, or in the nearer plane of the ends.
    /// `before`, `after`: heights over the planes at both ends.
    #[inline(always)]
    fn profiles(&self, places: &[Lanes; 3], before: &Lanes, after: &Lanes) -> [Lanes; 2] {
        if !self.is_straight {
            return self.turning_profiles(places, before, after);
        }
        let scale = if self.forward == 0.0 { 0.0 } else { 1.0 / self.forward };
        // The plane passes a place when it has come as far; beyond the ends the nearer one counts.
        let instants = lanes::map(before, |before| (before * scale).clamp(0.0, 1.0));
        let offset = lanes::add_one_scaled(places, -self.moved, &instants);
        let down = self.from.down.as_vec3();
        let (x, y) = (lanes::dot_one(&offset, self.across), lanes::dot_one(&offset, down));
        half_ellipses(&x, &y, self.size.as_vec2(), self.kerf)
    }

    /// Heights over the planes at both ends.
    #[inline(always)]
    fn heights(&self, places: &[Lanes; 3]) -> [Lanes; 2] {
        let travel = self.to.travel.as_vec3();
        let end = self.moved.dot(travel);
        let after = lanes::map(&lanes::dot_one(places, travel), |along| along - end);
        [lanes::dot_one(places, self.from.travel.as_vec3()), after]
    }

    /// What no place within `radius` of these is nearer to the step than; of no matter where it is below 0.
    pub fn floors(&self, places: &[Lanes; 3], radius: &Lanes) -> Lanes {
        let [before, after] = self.heights(places);
        let size = self.size.as_vec2();
        // The first-order distance from an ellipse is at least the way to it in the frame in which it is round.
        let (least, inverse) = (size.min_element(), 1.0 / size);
        let [x, y] = [self.across, self.from.down.as_vec3()].map(|axis| lanes::dot_one(places, axis));
        let [mx, my] = [self.across, self.from.down.as_vec3()].map(|axis| axis.dot(self.moved));
        let squares = lanes::dot(places, places);
        let length = self.moved.length();
        let mut floors = [0.0; LANES];
        for l in 0..LANES {
            // The middle line between the poses, and half of what they differ.
            let (u, v) = ((x[l] - 0.5 * mx) * inverse.x, (y[l] - 0.5 * my).max(0.0) * inverse.y);
            let profile = ((u * u + v * v).sqrt() - 1.0) * least;
            let turned = self.turn * (squares[l].sqrt() + radius[l] + length);
            let profile = profile.max(0.5 * my - y[l]) - self.sway - turned;
            let height = if before[l] * after[l] > 0.0 {
                before[l].abs().min(after[l].abs())
            } else {
                0.0
            };
            floors[l] = profile.max(height) - radius[l];
        }
        floors
    }

    /// See `profiles`.
    #[inline(always)]
    fn turning_profiles(&self, places: &[Lanes; 3], before: &Lanes, after: &Lanes) -> [Lanes; 2] {
        let turned = (self.to.travel - self.from.travel).as_vec3();
        let lowered = (self.to.down - self.from.down).as_vec3();
        let a = -self.moved.dot(turned);
        let turning = lanes::dot_one(places, turned);
        let mut instants = [0.0; LANES];
        for l in 0..LANES {
            // c + b x + a x² = 0; the plane is on different sides of the place at 0 and 1, so one root lies between.
            let (c, b) = (before[l], turning[l] - self.forward);
            let root = (b * b - 4.0 * a * c).max(0.0).sqrt();
            let q = -0.5 * (b + root.copysign(b));
            let roots = [c / q, q / a];
            let shares = roots.map(|x| if x.abs() <= f32::MAX { x.clamp(0.0, 1.0) } else { 0.0 });
            let off = |n: usize| {
                if roots[n].abs() <= f32::MAX {
                    (roots[n] - shares[n]).abs()
                } else {
                    f32::MAX
                }
            };
            let passed = if off(0) <= off(1) { shares[0] } else { shares[1] };
            let nearer = if before[l].abs() < after[l].abs() { 0.0 } else { 1.0 };
            instants[l] = if before[l] * after[l] <= 0.0 { passed } else { nearer };
        }
        let start = [self.from.travel, self.from.down].map(|axis| axis.as_vec3().to_array().map(|x| [x; LANES]));
        let offset = lanes::add_one_scaled(places, -self.moved, &instants);
        let travel = lanes::normalized(&lanes::add_one_scaled(&start[0], turned, &instants));
        let down = lanes::add_one_scaled(&start[1], lowered, &instants);
        let along = lanes::map(&lanes::dot(&down, &travel), |along| -along);
        let down = lanes::normalized(&lanes::add_scaled(&down, &travel, &along));
        let across = lanes::cross(&travel, &down);
        half_ellipses(
            &lanes::dot(&offset, &across),
            &lanes::dot(&offset, &down),
            self.size.as_vec2(),
            self.kerf,
        )
    }

    pub fn bounds(&self) -> Bounds {
        let axes = [self.from.travel, self.from.down, self.from.travel.cross(self.from.down)];
        let (mut low, mut high) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
        for pose in [&self.from, &self.to] {
            let side = pose.travel.cross(pose.down) * self.size.x;
            for corner in [
                side,
                -side,
                side + pose.down * self.size.y,
                -side + pose.down * self.size.y,
            ] {
                let local = DVec3::from(axes.map(|axis| axis.dot(pose.centre + corner - self.from.centre)));
                (low, high) = (low.min(local), high.max(local));
            }
        }
        // Between the two poses a turning loop bulges out of the box by less than this.
        let turn = self
            .from
            .travel
            .distance(self.to.travel)
            .max(self.from.down.distance(self.to.down));
        let bulge = self.size.length() * turn * turn;
        let middle = 0.5 * (low + high);
        Bounds {
            middle: self.from.centre + axes[0] * middle.x + axes[1] * middle.y + axes[2] * middle.z,
            axes,
            half: 0.5 * (high - low) + DVec3::splat(bulge),
        }
    }
}

/// Signed distances, to first order, to the half `y >= 0` of an ellipse with these half axes; and to that half of what lies further than
/// `kerf` inside of the ellipse.
#[inline(always)]
fn half_ellipses(x: &Lanes, y: &Lanes, size: Vec2, kerf: f32) -> [Lanes; 2] {
    let scale = 1.0 / size;
    let middle = -size.min_element();
    let mut out = [[0.0; LANES]; 2];
    for l in 0..LANES {
        let (u, v) = (x[l] * scale.x, y[l].max(0.0) * scale.y);
        let q = (u * u + v * v).sqrt();
        let (du, dv) = (u * scale.x, v * scale.y);
        let slope = (du * du + dv * dv).sqrt();
        let ellipse = q * (q - 1.0) / slope;
        let ellipse = if slope > 0.0 { ellipse } else { middle };
        out[0][l] = ellipse.max(-y[l]);
        out[1][l] = (ellipse + kerf).max(-y[l]);
    }
    out
}

/// Turns the poses of a loop under current into tools that join without gaps or ridges.
#[derive(Debug, Clone)]
pub struct LoopStroke {
    pose: LoopPose,
    size_mm: [f64; 2],
    kerf_mm: f64,
    thin_mm: f64,
    /// Way since the loop last turned back, mm; negative against the normal of its plane.
    way_mm: f64,
}

impl LoopStroke {
    /// A stroke that begins at a pose. Width of the open side and depth in mm.
    pub fn new(pose: LoopPose, width_mm: f64, depth_mm: f64) -> Self {
        Self {
            pose,
            size_mm: [width_mm, depth_mm],
            kerf_mm: 0.0,
            thin_mm: 0.0,
            way_mm: 0.0,
        }
    }

    /// The same stroke of a current that vaporises the outermost layer of what the loop takes, so thick, mm.
    pub fn with_kerf(self, kerf_mm: f64) -> Self {
        Self { kerf_mm, ..self }
    }

    /// The same stroke of a current that vaporises tissue thinner than this beside the wall that it leaves, too, mm.
    pub fn with_thin(self, thin_mm: f64) -> Self {
        Self { thin_mm, ..self }
    }

    /// What the loop sweeps over on its way to the next pose. A pose that is not finite is not gone to: cutting with
    /// what comes back is refused, and the stroke goes on from where it was.
    pub fn step_to(&mut self, pose: LoopPose) -> Tool {
        let [width_mm, depth_mm] = self.size_mm;
        let sweep = LoopSweep {
            from: self.pose,
            to: pose,
            width_mm,
            depth_mm,
        };
        let step = (pose.centre - self.pose.centre).dot(self.pose.travel);
        // A loop that turns back begins a new stroke: where it turned is an end face.
        let before = if step * self.way_mm >= 0.0 { self.way_mm } else { 0.0 };
        if sweep.is_finite() && step.is_finite() {
            self.pose = pose;
            self.way_mm = before + step;
        }
        Tool::Loop {
            sweep,
            run_mm: before.abs(),
            kerf_mm: self.kerf_mm,
            thin_mm: self.thin_mm,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn pose(centre: DVec3, tilt: f64) -> LoopPose {
        LoopPose {
            centre,
            travel: DVec3::new(tilt.sin(), 0.0, tilt.cos()),
            down: DVec3::Y,
        }
    }

    fn turning() -> LoopSweep {
        LoopSweep {
            from: pose(DVec3::ZERO, 0.0),
            to: pose(DVec3::new(0.4, 0.3, 1.5), 0.15),
            width_mm: 6.5,
            depth_mm: 4.5,
        }
    }

    fn distance(swept: &Swept, point: DVec3) -> f64 {
        let places = (point - swept.origin).as_vec3().to_array().map(|x| [x; LANES]);
        f64::from(swept.distances(&places)[0][3])
    }

    /// Points of a grid around the sweep.
    fn grid() -> impl Iterator<Item = DVec3> {
        let side = |n: usize| (0..n).map(move |i| i as f64 / n as f64);
        side(41).flat_map(move |x| {
            side(37).flat_map(move |y| side(29).map(move |z| DVec3::new(9.0 * x - 4.4, 8.0 * y - 2.0, 5.0 * z - 1.7)))
        })
    }

    #[test]
    fn the_sign_is_that_of_the_swept_solid() {
        let sweep = turning();
        let swept = Swept::new(&sweep, [0.0; 4]);
        for point in grid() {
            let distance = distance(&swept, point);
            if distance.abs() > 2e-3 {
                assert_eq!(distance < 0.0, sweep.contains(point), "{point}: {distance}");
            }
        }
    }

    #[test]
    fn no_place_in_a_ball_is_nearer_than_the_balls_floor() {
        for swept in [
            Swept::new(&turning(), [0.0; 4]),
            Swept::straight(DVec3::ZERO, DVec3::new(0.3, 0.2, 2.0), DVec3::Z, DVec3::Y, 2.0),
        ] {
            let mut left_out = 0;
            for (n, point) in grid().enumerate().step_by(7) {
                let radius = 0.5 + (n % 5) as f64;
                let places = (point - swept.origin).as_vec3().to_array().map(|x| [x; LANES]);
                let floor = f64::from(swept.floors(&places, &[radius as f32; LANES])[0]);
                left_out += u32::from(floor > 0.5);
                let turn = DVec3::new((n as f64).sin(), (1.7 * n as f64).cos(), (0.3 * n as f64).sin());
                for offset in [turn, -turn, turn.any_orthogonal_vector()] {
                    let other = point + offset.normalize() * radius;
                    let nearest = distance(&swept, point).min(distance(&swept, other));
                    assert!(floor <= nearest.max(0.0) + 1e-3, "{point} {other}: {floor} > {nearest}");
                }
            }
            assert!(left_out > 100, "{left_out}");
        }
    }

    #[test]
    fn the_distance_is_continuous() {
        let swept = Swept::new(&turning(), [0.0; 4]);
        for point in grid() {
            for step in DVec3::AXES {
                let change = distance(&swept, point + 1e-4 * step) - distance(&swept, point);
                assert!(change.abs() < 2e-4, "{point}: {change}");
            }
        }
    }

    #[test]
    fn a_stroke_that_turns_back_begins_anew() {
        let mut stroke = LoopStroke::new(pose(DVec3::ZERO, 0.0), 6.5, 4.5);
        let runs = [1.0, 2.0, 3.0, 2.0].map(|z| match stroke.step_to(pose(DVec3::Z * z, 0.0)) {
            Tool::Loop { run_mm, .. } => run_mm,
            _ => f64::NAN,
        });
        assert_eq!(runs, [0.0, 1.0, 2.0, 0.0]);
    }
}
