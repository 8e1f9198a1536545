//! The engines, each with the settings that trade time for error, behind one face: a frame at a time.

use std::fmt;

use glam::DVec3;
use rapier_soft::{
    math::Vector,
    prelude::{PhysicsWorld, SoftBodyBuilder, SoftBodyCellModel, SoftBodyHandle, SoftBodyMaterial, SoftBodySolver},
};
use resecta_methods::{
    method::{Choice, Method},
    system::{State, System, Work},
};
use resecta_solver::{Network, Tissue};

use crate::scene::{DAMPING_RATE, MODULUS_PA, POISSON_RATIO, PULL, SIDE_MM};

/// Length of a frame, s.
pub const FRAME_S: f64 = 1.0 / 60.0;

/// An engine with its settings.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Engine {
    /// Our solver, which divides a frame as it sees fit.
    Ours,
    /// Our solver in so many times as many steps.
    OursTimes(u32),
    /// The springs of ours in double precision, by the classical Runge-Kutta method, in half the steps that are stable for
    /// ours.
    Springs,
    /// rapier's soft body.
    Rapier(Rapier),
}

/// Settings of rapier; what is not here is as it comes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rapier {
    /// What solves the elasticity.
    pub solver: SoftBodySolver,
    /// Steps a frame.
    pub steps: usize,
    /// `num_solver_iterations`: substeps of a step.
    pub substeps: usize,
    /// `num_internal_pgs_iterations`: sweeps over the constraints of a substep.
    pub sweeps: usize,
    /// `max_linear_iterations` of the conjugate gradients that solve a substep of FEM.
    pub gradients: usize,
}

impl fmt::Display for Engine {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match self {
            Engine::Ours => write!(f, "ours, as it comes"),
            Engine::OursTimes(by) => write!(f, "ours, {by} x the steps"),
            Engine::Springs => write!(f, "springs in double precision"),
            Engine::Rapier(settings) => {
                let Rapier {
                    solver,
                    steps,
                    substeps,
                    sweeps,
                    gradients,
                } = settings;
                match solver {
                    SoftBodySolver::Constraints => {
                        write!(f, "rapier, constraints, {steps} x {substeps}, sweeps: {sweeps}")
                    }
                    SoftBodySolver::Fem => write!(f, "rapier, FEM, {steps} x {substeps}, gradients: {gradients}"),
                }
            }
        }
    }
}

/// A scene in an engine.
pub enum Run {
    Ours(Box<Tissue>),
    OursTimes(Box<Tissue>, u64),
    Springs(Box<(System, State)>, Box<dyn Method>, usize),
    Rapier(Box<PhysicsWorld>, SoftBodyHandle, usize),
}

impl Engine {
    pub fn begin(self, network: &Network, cells: usize) -> Run {
        let tissue = || Tissue::from_network(network).expect("the block is a network");
        match self {
            Engine::Ours => Run::Ours(Box::new(tissue())),
            Engine::OursTimes(by) => {
                let tissue = tissue();
                let substeps = tissue
                    .clone()
                    .advance(FRAME_S, &[])
                    .expect("a frame can be divided")
                    .substeps;
                Run::OursTimes(Box::new(tissue), u64::from(substeps * by))
            }
            Engine::Springs => {
                let scene = System::new(network).expect("the block is a network");
                let steps = (2.0 * FRAME_S / tissue().bound_s()).ceil() as usize;
                let method = Choice::Rk4.build(&scene.0, FRAME_S / steps as f64);
                Run::Springs(Box::new(scene), method, steps)
            }
            Engine::Rapier(settings) => {
                let mut world = PhysicsWorld::new();
                // Lengths are in mm, masses in g.
                world.gravity = Vector::X * PULL as f32;
                let parameters = &mut world.integration_parameters;
                parameters.length_unit = 1000.0;
                parameters.dt = (FRAME_S / settings.steps as f64) as f32;
                parameters.num_solver_iterations = settings.substeps;
                parameters.num_internal_pgs_iterations = settings.sweeps;
                parameters.soft_bodies.fem.max_linear_iterations = settings.gradients;
                let half = Vector::splat(0.5 * SIDE_MM as f32);
                let pinned = (0u32..).zip(&network.fixed).filter(|(_, fixed)| **fixed);
                let body = SoftBodyBuilder::cuboid(half, half, cells + 1, cells + 1, cells + 1)
                    .cell_model(SoftBodyCellModel::Corotational)
                    .material(SoftBodyMaterial {
                        young_modulus: MODULUS_PA as f32,
                        poisson_ratio: POISSON_RATIO as f32,
                        // As ours, the block is damped by the medium alone.
                        elastic_damping_ratio: 0.0,
                        ..SoftBodyMaterial::default()
                    })
                    .masses(network.masses.iter().map(|mass| *mass as f32).collect())
                    .linear_damping(DAMPING_RATE as f32)
                    .pinned_particles(pinned.map(|(node, _)| node))
                    .solver(settings.solver)
                    .no_surface_collider()
                    .can_sleep(false);
                let handle = world.insert_soft_body(body);
                Run::Rapier(Box::new(world), handle, settings.steps)
            }
        }
    }
}

impl Run {
    /// Moves on by a frame.
    pub fn frame(&mut self) {
        match self {
            Run::Ours(tissue) => {
                tissue.advance(FRAME_S, &[]).expect("a frame can be divided");
            }
            Run::OursTimes(tissue, steps) => {
                let step_s = FRAME_S / *steps as f64;
                tissue.advance_steps(step_s, *steps).expect("a step below the bound");
            }
            Run::Springs(scene, method, steps) => {
                let (system, state) = &mut **scene;
                for _ in 0..*steps {
                    let made = method.step(system, state, &mut Work::default());
                    made.expect("half the stable step");
                }
            }
            Run::Rapier(world, _, steps) => (0..*steps).for_each(|_| world.step()),
        }
    }

    /// Where the nodes are, mm.
    pub fn positions(&self) -> Vec<DVec3> {
        match self {
            Run::Ours(tissue) | Run::OursTimes(tissue, _) => (0..tissue.node_count() as u32)
                .map(|node| tissue.precise_position(node))
                .collect(),
            Run::Springs(scene, ..) => scene.1.positions.clone(),
            Run::Rapier(world, handle, _) => world.soft_bodies[*handle]
                .particle_positions()
                .map(|place| DVec3::from_array(place.to_array().map(f64::from)))
                .collect(),
        }
    }
}
