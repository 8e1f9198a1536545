//! A reference solution to measure the error of a step against: the same equations in double precision, by the classical
//! Runge-Kutta method of order 4, written without regard to speed and sharing no code with the step it judges.

use glam::DVec3;

use crate::tissue::Tissue;

/// Which inertia the nodes, and which stiffness the springs have in the reference solution.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Inertia {
    /// Their masses and true stiffness: shows the whole error of a step.
    Mass,
    /// What the step gives them (`bound.rs`, `soften.rs`): shows the error of the integration alone.
    AsStepped,
}

/// Positions after `duration_s` in `steps` steps from the tissue's present state, mm, a node each.
///
/// Springs, volume terms, bed, damping, loads and resection forces (coming on linearly, as over one advance of that length) act;
/// contacts do not. Removed nodes and nodes put aside stay where they are.
pub fn positions_after(tissue: &Tissue, duration_s: f64, steps: u32, inertia: Inertia) -> Vec<DVec3> {
    let mut tissue = tissue.clone();
    tissue.bound_s(); // makes the inertias those of the next advance
    tissue.collapse.approach(duration_s);
    let nodes = 0..tissue.node_count() as u32;
    let mut positions: Vec<DVec3> = nodes.clone().map(|node| tissue.position(node).as_dvec3()).collect();
    let mut velocities: Vec<DVec3> = nodes.map(|node| tissue.velocity(node).as_dvec3()).collect();
    let step = duration_s / f64::from(steps);
    let along = |base: &[DVec3], slope: &[DVec3], time: f64| -> Vec<DVec3> {
        base.iter()
            .zip(slope)
            .map(|(base, slope)| *base + *slope * time)
            .collect()
    };
    for number in 0..steps {
        let share = |part: f64| (f64::from(number) + part) / f64::from(steps);
        let a1 = accelerations(&tissue, inertia, share(0.0), &positions, &velocities);
        let v2 = along(&velocities, &a1, 0.5 * step);
        let a2 = accelerations(
            &tissue,
            inertia,
            share(0.5),
            &along(&positions, &velocities, 0.5 * step),
            &v2,
        );
        let v3 = along(&velocities, &a2, 0.5 * step);
        let a3 = accelerations(&tissue, inertia, share(0.5), &along(&positions, &v2, 0.5 * step), &v3);
        let v4 = along(&velocities, &a3, step);
        let a4 = accelerations(&tissue, inertia, share(1.0), &along(&positions, &v3, step), &v4);
        for node in 0..positions.len() {
            let velocity = velocities[node];
            positions[node] += (velocity + 2.0 * v2[node] + 2.0 * v3[node] + v4[node]) * (step / 6.0);
            velocities[node] += (a1[node] + 2.0 * a2[node] + 2.0 * a3[node] + a4[node]) * (step / 6.0);
        }
    }
    positions
}

/// Accelerations, mm/s², with resection forces a `share` (0 to 1) of the way through the advance.
fn accelerations(
    tissue: &Tissue,
    inertia: Inertia,
    share: f64,
    positions: &[DVec3],
    velocities: &[DVec3],
) -> Vec<DVec3> {
    let mut forces: Vec<DVec3> = (0..tissue.node_count() as u32)
        .map(|node| {
            let index = node as usize;
            let loads = tissue.load_in_effect(node);
            let bed = f64::from(tissue.nodes.support.at(node));
            let damping = f64::from(tissue.nodes.damping_rate.at(node)) * f64::from(tissue.nodes.mass.at(node));
            loads.as_dvec3() + bed * (tissue.rest_position(node).as_dvec3() - positions[index])
                - damping * velocities[index]
        })
        .collect();
    for (node, step) in tissue.collapse.steps() {
        forces[node as usize] += share * step.as_dvec3();
    }
    for spring in 0..tissue.spring_count() as u32 {
        let state = tissue.spring(spring);
        let [a, b] = state.nodes.map(|node| node as usize);
        let (along, length) = (positions[b] - positions[a]).normalize_and_length();
        let stiffness = match inertia {
            Inertia::Mass => state.stiffness,
            Inertia::AsStepped => tissue.springs.stepped_stiffness(spring),
        };
        let pull = along * (f64::from(stiffness) * (length - f64::from(state.rest_length)));
        forces[a] += pull;
        forces[b] -= pull;
    }
    tissue.add_volume_forces(positions, &mut forces);
    for (node, force) in (0u32..).zip(&mut forces) {
        let stepped = tissue.inertia_g(node);
        let inertia = match inertia {
            Inertia::Mass => tissue.mass_g(node),
            Inertia::AsStepped => stepped,
        };
        *force = if stepped > 0.0 {
            *force / f64::from(inertia)
        } else {
            DVec3::ZERO
        };
    }
    forces
}
