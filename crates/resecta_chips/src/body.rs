//! A chip as a rigid body: what it weighs, how it turns, its convex hull.

use std::sync::Arc;

use bevy::math::{DVec3, Isometry3d, Mat3, Vec3};
use parry3d::{math::Pose, shape::ConvexPolyhedron};
use rapier3d::dynamics::RigidBodyHandle;
use resecta_tissue::Chip;

use crate::{
    drag::{Float, Water},
    pool::HeldReason,
};

/// Directions in which a chip's outermost points make its hull.
const HULL_DIRECTIONS: usize = 24;
/// Least inertia as a share of mass times diameter squared: a flake turns no faster than a sixth of a sphere.
const LEAST_INERTIA: f32 = 1.0 / 60.0;

/// A chip that floats.
#[derive(Debug, Clone)]
pub struct Body {
    /// Its number: they count up, and decide every order.
    pub id: u64,
    /// Mass at rest, g.
    pub mass_g: f64,
    /// What it is to the water.
    pub float: Float,
    /// Its hull about its centre.
    pub hull: Arc<ConvexPolyhedron>,
    /// Largest distance of the hull from the centre, mm.
    pub reach: f32,
    /// Least distance of the hull's faces from the centre, mm: half its thickness.
    pub core: f32,
    /// Where it is.
    pub pose: Pose,
    /// mm/s.
    pub velocity: Vec3,
    /// rad/s.
    pub turn: Vec3,
    /// Mass that moves, its own and the water's, g.
    pub moved_mass: f32,
    /// Inertia about the centre, body axes, g mm².
    pub inertia: Mat3,
    /// Whether it rests and is not moved.
    pub asleep: bool,
    /// Why it is kept where it is, if it is.
    pub held: Option<HeldReason>,
    /// Whether it lies fast, held or asleep, and nothing moves it.
    pub(crate) fast: bool,
    /// How long it has hardly moved, or lain fast, s.
    pub(crate) still_s: f32,
    /// Where it came to lie last, and how long a stream leaves it there, s.
    pub(crate) lay_at: Vec3,
    pub(crate) patience_s: f32,
    /// Velocity that tissue lent it in this step, mm/s: it is not kept.
    pub(crate) lent: Vec3,
    /// Distance from its centre to the nearest tissue when it last moved, mm; `None` beyond 3 mm.
    pub(crate) tissue_mm: Option<f32>,
    /// What rapier knows it by.
    pub(crate) handle: RigidBodyHandle,
}

impl Body {
    /// A body of a chip; none where that has no surface or is not finite.
    pub fn new(id: u64, chip: &Chip, density_g_per_mm3: f64, water: &Water) -> Option<Self> {
        let centre = chip.centre.as_vec3();
        if !centre.is_finite() || chip.triangles.is_empty() {
            return None;
        }
        let mass_g = chip.rest_volume_mm3 * density_g_per_mm3;
        let float = Float {
            mass: mass_g as f32,
            volume: chip.rest_volume_mm3 as f32,
        };
        let diameter = float.diameter();
        let hull = hull(&chip.vertices, chip.centre, diameter)?;
        let reach = (hull.points().iter()).map(|point| point.length()).fold(0.0, f32::max);
        let core = (directions())
            .map(|direction| support(hull.points(), direction).dot(direction))
            .fold(f32::INFINITY, f32::min)
            .max(0.0);

        let least = LEAST_INERTIA * float.mass * diameter * diameter;
        let inertia = (chip.inertia * density_g_per_mm3).as_mat3();
        let is_sound = inertia.is_finite() && (0..3).all(|axis| inertia.col(axis)[axis] >= 0.0);
        let inertia = if is_sound { inertia } else { Mat3::ZERO } + Mat3::IDENTITY * least;
        let moved_mass = water.moved_mass(&float);
        let body = Self {
            id,
            mass_g,
            float,
            hull: Arc::new(hull),
            reach,
            core,
            pose: Pose::from_translation(centre),
            velocity: Vec3::ZERO,
            turn: Vec3::ZERO,
            moved_mass,
            inertia,
            asleep: false,
            held: None,
            fast: false,
            still_s: 0.0,
            lay_at: Vec3::INFINITY,
            patience_s: 0.0,
            lent: Vec3::ZERO,
            tissue_mm: None,
            handle: RigidBodyHandle::invalid(),
        };
        (moved_mass.recip().is_finite() && inertia.inverse().is_finite()).then_some(body)
    }

    /// Centre, mm.
    pub fn place(&self) -> Vec3 {
        self.pose.translation
    }

    /// Its pose as Bevy knows it; the chip's own frame has its origin at the centre.
    pub fn isometry(&self) -> Isometry3d {
        Isometry3d::new(self.pose.translation, self.pose.rotation)
    }

    /// Whether it moves.
    pub fn moves(&self) -> bool {
        !self.asleep && self.held.is_none()
    }

    /// The hull's corners, mm.
    pub fn corners(&self) -> impl Iterator<Item = Vec3> {
        self.hull.points().iter().map(|&point| self.pose * point)
    }

    /// The fastest that a point of it moves, mm/s.
    pub fn speed(&self) -> f32 {
        self.velocity.length() + self.turn.length() * self.reach
    }
}

/// The convex hull of a chip about its centre, or of a cube of its size where it is too flat for one.
fn hull(vertices: &[Vec3], centre: DVec3, diameter: f32) -> Option<ConvexPolyhedron> {
    let local: Vec<Vec3> = (vertices.iter())
        .map(|vertex| (vertex.as_dvec3() - centre).as_vec3())
        .filter(|vertex| vertex.is_finite())
        .collect();
    let mut corners: Vec<Vec3> = Vec::new();
    for direction in directions() {
        let outermost = support(&local, direction);
        if !corners.contains(&outermost) {
            corners.push(outermost);
        }
    }
    ConvexPolyhedron::from_convex_hull(&corners).or_else(|| {
        // Of the sphere's volume.
        let half = 0.4 * diameter;
        let cube: Vec<Vec3> = (0..8u32)
            .map(|corner| {
                let side = |bit: u32| if corner & bit == 0 { half } else { -half };
                Vec3::new(side(1), side(2), side(4))
            })
            .collect();
        ConvexPolyhedron::from_convex_hull(&cube)
    })
}

fn support(points: &[Vec3], direction: Vec3) -> Vec3 {
    let mut outermost = (f32::NEG_INFINITY, Vec3::ZERO);
    for &point in points {
        let along = point.dot(direction);
        if along > outermost.0 {
            outermost = (along, point);
        }
    }
    outermost.1
}

/// Evenly spread over the sphere: a spiral by the golden angle.
fn directions() -> impl Iterator<Item = Vec3> {
    let golden = std::f32::consts::PI * (3.0 - 5.0f32.sqrt());
    (0..HULL_DIRECTIONS).map(move |index| {
        let z = 1.0 - (2 * index + 1) as f32 / HULL_DIRECTIONS as f32;
        let (sin, cos) = (golden * index as f32).sin_cos();
        let across = (1.0 - z * z).sqrt();
        Vec3::new(across * cos, across * sin, z)
    })
}
