//! Vertex block descent: backward Euler's minimum sought node by node. Order 1; what the sweeps leave unsolved is an error
//! that vanishes with the step.
//!
//! Source: Chen et al. 2024, equations (1), (6) and (9), nodes in the order of the network, from the positions that inertia
//! alone leads to. The Hessian of a compressed spring is clamped as in [`crate::system::Tensor`].

use glam::{DMat3, DVec3};

use super::sound;
use crate::{
    method::{Method, StepError},
    system::{State, System, Work},
};

/// Vertex block descent.
#[derive(Debug, Clone)]
pub struct Vbd {
    step_s: f64,
    iterations: u32,
    /// Where the springs of a node begin in `around`; one entry more than nodes.
    starts: Vec<usize>,
    /// Springs around each node.
    around: Vec<u32>,
    start: Vec<DVec3>,
    inertial: Vec<DVec3>,
}

impl Vbd {
    /// For steps of `step_s`, s, above 0, with one sweep over the nodes an iteration, 1 or more.
    pub fn new(system: &System, step_s: f64, iterations: u32) -> Vbd {
        let mut around = vec![Vec::new(); system.node_count()];
        for (index, spring) in (0_u32..).zip(&system.springs) {
            for end in spring.ends {
                around[end as usize].push(index);
            }
        }
        let mut starts = vec![0];
        starts.extend(around.iter().scan(0, |sum, list| {
            *sum += list.len();
            Some(*sum)
        }));
        Vbd {
            step_s,
            iterations,
            starts,
            around: around.concat(),
            start: Vec::new(),
            inertial: Vec::new(),
        }
    }

    /// The Newton step of one node with all others held, mm.
    fn descent(&self, system: &System, positions: &[DVec3], node: usize) -> DVec3 {
        let h = self.step_s;
        let place = positions[node];
        let (inertia, drag) = (system.masses[node] / (h * h), system.damping[node] / h);
        let mut force =
            system.loads[node] - (place - self.inertial[node]) * inertia - (place - self.start[node]) * drag;
        let mut hessian = DMat3::from_diagonal(DVec3::splat(inertia + drag));
        for &index in &self.around[self.starts[node]..self.starts[node + 1]] {
            let spring = &system.springs[index as usize];
            let other = spring.ends[usize::from(spring.ends[0] as usize == node)] as usize;
            let between = positions[other] - place;
            force += spring.pull(between);
            hessian += spring.tensor(between).matrix();
        }
        hessian.inverse() * force
    }
}

impl Method for Vbd {
    fn name(&self) -> &'static str {
        match self.iterations {
            2 => "VBD, 2 sweeps",
            10 => "VBD, 10 sweeps",
            _ => "VBD",
        }
    }

    fn order(&self) -> u32 {
        1
    }

    fn step(&mut self, system: &System, state: &mut State, work: &mut Work) -> Result<(), StepError> {
        self.start.clone_from(&state.positions);
        for (place, velocity) in state.positions.iter_mut().zip(&state.velocities) {
            *place += *velocity * self.step_s;
        }
        self.inertial.clone_from(&state.positions);
        for _ in 0..self.iterations {
            work.sweeps += 1;
            work.spring_visits += self.around.len() as u64;
            for node in 0..system.node_count() {
                if system.inverse_masses[node] > 0.0 {
                    let step = self.descent(system, &state.positions, node);
                    state.positions[node] += step;
                }
            }
        }
        for (node, velocity) in state.velocities.iter_mut().enumerate() {
            *velocity = (state.positions[node] - self.start[node]) / self.step_s;
        }
        sound(state)
    }
}
