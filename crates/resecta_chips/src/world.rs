//! The world that chips collide in: rapier's, with their hulls, the bladder's wall and the sheath.
//!
//! Rapier finds contacts, solves them with Coulomb friction, and lets islands of touching bodies that hardly move fall asleep
//! together. It is given no gravity: what water and weight do in a step comes as one force for each body. It runs on one
//! thread, and bodies enter and leave it in the order of their numbers.

use std::fmt;

use bevy::math::Vec3;
use parry3d::{
    math::Pose,
    shape::{SharedShape, TriMeshFlags},
};
use rapier3d::prelude::{
    ColliderBuilder, MassProperties, PhysicsWorld, RigidBodyBuilder, RigidBodyHandle, RigidBodyType,
};

use crate::{
    body::Body,
    walls::{Cavity, Sheath},
};

/// What rapier scales its tolerances by, mm: a chip's size.
const LENGTH_MM: f32 = 10.0;
/// Rapier weighs in mg: when it finds the axes of an inertia it takes differences below some 1e-5 for none.
const MG_PER_G: f32 = 1000.0;
/// Wet tissue on wet tissue: slippery (ours).
const FRICTION: f32 = 0.2;

/// How a body has moved.
#[derive(Debug, Clone, Copy)]
pub struct Motion {
    /// Where it is.
    pub pose: Pose,
    /// mm/s.
    pub velocity: Vec3,
    /// rad/s.
    pub turn: Vec3,
    /// Whether it rests with all that it touches.
    pub asleep: bool,
}

/// Rapier's world.
pub struct World {
    physics: PhysicsWorld,
    sheath: Option<RigidBodyHandle>,
}

impl fmt::Debug for World {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        (formatter.debug_struct("World"))
            .field("bodies", &self.physics.bodies.len())
            .finish_non_exhaustive()
    }
}

impl World {
    /// One with the wall of a bladder.
    pub fn new(cavity: &Cavity) -> Self {
        let mut physics = PhysicsWorld {
            gravity: Vec3::ZERO,
            ..PhysicsWorld::default()
        };
        physics.integration_parameters.length_unit = LENGTH_MM;
        let (corners, triangles) = cavity.wall_triangles();
        // A wall without triangles is none; the cavity then holds chips by their middles.
        let flags = TriMeshFlags::ORIENTED | TriMeshFlags::FIX_INTERNAL_EDGES;
        if let Ok(wall) = ColliderBuilder::trimesh_with_flags(corners, triangles, flags) {
            physics.insert(RigidBodyBuilder::fixed(), wall.friction(FRICTION));
        }
        Self { physics, sheath: None }
    }

    /// Takes a chip up. `turn_rate` is how fast water stops its turning, 1/s.
    pub fn insert(&mut self, body: &Body, turn_rate: f32) -> RigidBodyHandle {
        let mass = MassProperties::with_inertia_matrix(Vec3::ZERO, MG_PER_G * body.moved_mass, MG_PER_G * body.inertia);
        let rigid = RigidBodyBuilder::dynamic()
            .pose(body.pose)
            .additional_mass_properties(mass)
            .angular_damping(turn_rate);
        let hull = ColliderBuilder::new(SharedShape(body.hull.clone()))
            .density(0.0)
            .friction(FRICTION);
        self.physics.insert(rigid, hull).0
    }

    /// Takes a chip out, and wakes what touches it.
    pub fn remove(&mut self, handle: RigidBodyHandle) {
        self.physics.remove_body(handle);
    }

    /// How a body moves; none where it is not there.
    pub fn motion(&self, handle: RigidBodyHandle) -> Option<Motion> {
        self.physics.bodies.get(handle).map(|body| Motion {
            pose: *body.position(),
            velocity: body.linvel(),
            turn: body.angvel(),
            asleep: body.is_sleeping(),
        })
    }

    /// Wakes a body, and all that rests with it.
    pub fn wake(&mut self, handle: RigidBodyHandle) {
        self.physics.wake_up(handle, true);
    }

    /// Whether a body rests.
    pub fn is_asleep(&self, handle: RigidBodyHandle) -> bool {
        self.physics.bodies.get(handle).is_some_and(|body| body.is_sleeping())
    }

    /// Gives a chip the force that brings it to a velocity in a step in which it touches nothing.
    pub fn bring_to(&mut self, chip: &Body, velocity: Vec3, seconds: f32) {
        if let Some(body) = self.physics.bodies.get_mut(chip.handle) {
            let force = (velocity - body.linvel()) * (MG_PER_G * chip.moved_mass / seconds);
            body.reset_forces(false);
            body.add_force(force, false);
        }
    }

    /// Puts a body at a place.
    pub fn put(&mut self, handle: RigidBodyHandle, place: Vec3, velocity: Vec3) {
        if let Some(body) = self.physics.bodies.get_mut(handle) {
            body.set_translation(place, false);
            body.set_linvel(velocity, false);
        }
    }

    /// Lets a body lie fast where it is, or move again.
    pub fn fasten(&mut self, handle: RigidBodyHandle, fast: bool) {
        let kind = if fast {
            RigidBodyType::Fixed
        } else {
            RigidBodyType::Dynamic
        };
        if let Some(body) = self.physics.bodies.get_mut(handle) {
            body.set_body_type(kind, true);
        }
    }

    /// Lets a body meet nothing and stay where it is.
    pub fn put_aside(&mut self, handle: RigidBodyHandle) {
        if let Some(body) = self.physics.bodies.get_mut(handle) {
            body.set_enabled(false);
        }
    }

    /// Moves the sheath as it moves in the step.
    pub fn place_sheath(&mut self, sheath: Option<&Sheath>) {
        let Some(sheath) = sheath.filter(|sheath| sheath.way.iter().all(Pose::is_finite)) else {
            if let Some(gone) = self.sheath.take() {
                self.physics.remove_body(gone);
            }
            return;
        };
        let [from, to] = sheath.way;
        let handle = *self.sheath.get_or_insert_with(|| {
            let capsule = ColliderBuilder::new(SharedShape::new(sheath.capsule)).friction(FRICTION);
            self.physics
                .insert(RigidBodyBuilder::kinematic_position_based().pose(from), capsule)
                .0
        });
        if let Some(body) = self.physics.bodies.get(handle)
            && (*body.position() != from || *body.next_position() != to)
            && let Some(body) = self.physics.bodies.get_mut(handle)
        {
            body.set_position(from, true);
            body.set_next_kinematic_position(to);
        }
    }

    /// A step.
    pub fn step(&mut self, seconds: f32) {
        self.physics.integration_parameters.dt = seconds;
        self.physics.step();
    }

    /// Whether a number of a body's motion was not finite in the last step: rapier has left it where it was.
    pub fn is_broken(&self, handle: RigidBodyHandle) -> bool {
        self.physics.quarantine().bodies().contains(&handle)
    }
}
