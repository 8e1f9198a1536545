//! Exact solids to be cut from a block: a sphere, a half cylinder and strokes of the loop.

use std::f64::consts::PI;

use glam::{DVec2, DVec3};
use resecta_field::{LoopStroke, Tool};
use resecta_solver::LoopPose;

/// Cubes along each side of the block; every one is two pentahedra.
const CUBES: [u32; 3] = [7, 7, 11];
/// Edge of a cube, mm.
pub const CUBE_MM: f64 = 2.0;
/// The loop, mm.
const WIDTH: f64 = 6.5;
const DEPTH: f64 = 4.5;
/// Length of half cylinder and stroke, mm: where faces meet in an edge it is rounded, so what is all edges loses more.
const LENGTH: f64 = 15.0;
/// Corners of the polygon that stands for a half ellipse.
const CORNERS: i32 = 1500;

/// A solid that lies inside the block, also when that is stretched by 20 % along x.
pub struct Solid {
    /// For tables and charts.
    pub name: &'static str,
    /// Takes it away, one after the other.
    pub tools: Vec<Tool>,
    /// Its exact volume, mm³.
    pub volume_mm3: f64,
    distance: Box<dyn Fn(DVec3) -> f64>,
}

impl Solid {
    /// Distance of a place from its boundary, mm; negative inside.
    pub fn distance(&self, place: DVec3) -> f64 {
        (self.distance)(place)
    }

    /// A ball.
    pub fn sphere() -> Self {
        const RADIUS: f64 = 4.0;
        let centre = DVec3::new(7.13, 6.77, 9.31);
        Self {
            name: "sphere",
            tools: vec![Tool::Sphere {
                centre,
                radius_mm: RADIUS,
            }],
            volume_mm3: 4.0 / 3.0 * PI * RADIUS.powi(3),
            distance: Box::new(move |place| place.distance(centre) - RADIUS),
        }
    }

    /// Half a cylinder, askew.
    pub fn half_cylinder() -> Self {
        const RADIUS: f64 = 3.5;
        let [along, down, _] = askew();
        Self {
            name: "half cylinder",
            tools: vec![Tool::HalfCylinder {
                from: FROM,
                to: FROM + along * LENGTH,
                down,
                radius_mm: RADIUS,
            }],
            volume_mm3: 0.5 * PI * RADIUS * RADIUS * LENGTH,
            distance: Box::new(swept_distance(DVec2::splat(RADIUS))),
        }
    }

    /// A straight stroke of the loop, askew, in so many steps.
    pub fn stroke(name: &'static str, steps: u32) -> Self {
        let [travel, down, _] = askew();
        let pose = |way: f64| LoopPose {
            centre: FROM + travel * way,
            travel,
            down,
        };
        let mut stroke = LoopStroke::new(pose(0.0), WIDTH, DEPTH);
        Self {
            name,
            tools: (1..=steps)
                .map(|n| stroke.step_to(pose(LENGTH * f64::from(n) / f64::from(steps))))
                .collect(),
            volume_mm3: 0.25 * PI * WIDTH * DEPTH * LENGTH,
            distance: Box::new(swept_distance(DVec2::new(0.5 * WIDTH, DEPTH))),
        }
    }
}

/// Where half cylinder and stroke begin.
const FROM: DVec3 = DVec3::new(5.6, 3.3, 2.9);

/// Axes of a tool that lies askew: along, down, across.
fn askew() -> [DVec3; 3] {
    let along = DVec3::new(0.13, 0.18, 0.9).normalize();
    let down = DVec3::new(-0.3, 1.0, 0.1).reject_from_normalized(along).normalize();
    [along, down, along.cross(down)]
}

/// Signed distance from the boundary of a half ellipse moved along.
fn swept_distance(half: DVec2) -> impl Fn(DVec3) -> f64 {
    let outline: Vec<DVec2> = (0..=CORNERS)
        .map(|n| DVec2::from_angle(PI * f64::from(n) / f64::from(CORNERS)) * half)
        .collect();
    move |place| {
        let local = DVec3::from(askew().map(|axis| axis.dot(place - FROM)));
        let flat = DVec2::new(local.z, local.y);
        let to_arc = outline
            .iter()
            .map(|corner| corner.distance(flat))
            .fold(f64::INFINITY, f64::min);
        let to_side = if flat.x.abs() < half.x {
            flat.y.abs()
        } else {
            f64::INFINITY
        };
        let nearest = to_arc.min(to_side);
        let is_inside = flat.y > 0.0 && (flat / half).length() < 1.0;
        let section = if is_inside { -nearest } else { nearest };
        let ends = (-local.x).max(local.x - LENGTH);
        if section > 0.0 && ends > 0.0 {
            section.hypot(ends)
        } else {
            section.max(ends)
        }
    }
}

/// Nodes, mm, and pentahedra of the block.
pub fn block() -> (Vec<DVec3>, Vec<[u32; 6]>) {
    let [nx, ny, nz] = CUBES;
    let index = |x: u32, y: u32, z: u32| (z * (ny + 1) + y) * (nx + 1) + x;
    let grid =
        |[nx, ny, nz]: [u32; 3]| (0..nz).flat_map(move |z| (0..ny).flat_map(move |y| (0..nx).map(move |x| [x, y, z])));
    let nodes = grid(CUBES.map(|count| count + 1))
        .map(|at| DVec3::from(at.map(f64::from)) * CUBE_MM)
        .collect();
    let pentahedra = grid([nx, ny, nz]).flat_map(|[x, y, z]| {
        let half = |b: [u32; 2], c: [u32; 2]| {
            let corner = |[dx, dy]: [u32; 2], dz: u32| index(x + dx, y + dy, z + dz);
            std::array::from_fn(|n| corner([[0, 0], b, c][n % 3], n as u32 / 3))
        };
        [half([1, 1], [1, 0]), half([0, 1], [1, 1])]
    });
    (nodes, pentahedra.collect())
}
