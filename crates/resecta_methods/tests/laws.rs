//! What must hold whatever the numbers: gradients, stability, energy, momentum, linear equations, lattices.

mod common;

use common::{advance, chain};
use glam::DVec3;
use resecta_methods::{
    conjugate::{ConjugateGradients, Operator},
    lattice::Annulus,
    measure::distances,
    method::{Choice, Method, StepError},
    methods::{bdf2::Bdf2, implicit_euler::ImplicitEuler, leapfrog::Leapfrog, midpoint::Midpoint},
    spectrum::{radius_per_s, slowest_rad_per_s, stability_bound_s},
    stiffness::Stiffness,
    system::{State, System, Work},
};
use resecta_solver::Tissue;

const SMALL: Annulus = Annulus {
    counts: [7, 5, 4],
    diagonals: true,
    pre_tension: 0.0,
    stiffness_ratio: 1.0,
    damping_rate: 40.0,
    pull_un: 5e4,
    notch: false,
};

/// Directions and sizes without pattern, within one.
fn scatter(count: usize) -> Vec<DVec3> {
    let wave = |n: usize, by: f64| (n as f64 * by).sin();
    (1..=count)
        .map(|n| DVec3::new(wave(n, 12.9), wave(n, 78.2), wave(n, 37.7)))
        .collect()
}

/// Elastic and kinetic energy less the work of loads, nJ.
fn energy(system: &System, state: &State) -> f64 {
    system.potential(&state.positions, &mut Work::default()) + system.kinetic(&state.velocities)
}

/// The small annulus, bent out of shape so that springs are stretched and compressed.
fn bent() -> (System, State) {
    let (system, mut state) = SMALL.scene();
    let mut moves = scatter(system.node_count());
    system.hold(&mut moves);
    state
        .positions
        .iter_mut()
        .zip(moves)
        .for_each(|(place, step)| *place += step * 0.3);
    (system, state)
}

#[test]
fn forces_are_the_slope_of_the_potential() {
    let (system, state) = bent();
    let mut forces = vec![DVec3::ZERO; system.node_count()];
    system.forces(&state.positions, &mut forces, &mut Work::default());
    let mut along = scatter(system.node_count());
    system.hold(&mut along);
    let at = |t: f64| {
        let places: Vec<DVec3> = state
            .positions
            .iter()
            .zip(&along)
            .map(|(place, step)| *place + *step * t)
            .collect();
        system.potential(&places, &mut Work::default())
    };
    let slope = (at(1e-5) - at(-1e-5)) / 2e-5;
    let expected: f64 = -forces
        .iter()
        .zip(&along)
        .map(|(force, step)| force.dot(*step))
        .sum::<f64>();
    assert!((slope / expected - 1.0).abs() < 1e-6, "{slope} against {expected}");
}

#[test]
fn the_stiffness_is_the_slope_of_the_forces_where_springs_are_stretched() {
    let (system, mut state) = SMALL.scene();
    state.positions.iter_mut().for_each(|place| *place *= 1.2);
    let mut along = scatter(system.node_count());
    system.hold(&mut along);
    let at = |t: f64| {
        let places: Vec<DVec3> = state
            .positions
            .iter()
            .zip(&along)
            .map(|(place, step)| *place + *step * t)
            .collect();
        let mut forces = vec![DVec3::ZERO; system.node_count()];
        system.forces(&places, &mut forces, &mut Work::default());
        forces
    };
    let mut stiffness = Stiffness::default();
    stiffness.linearise(&system, &state.positions, &mut Work::default());
    let mut product = vec![DVec3::ZERO; system.node_count()];
    stiffness.product(&system, &along, &mut product, &mut Work::default());
    let size = product.iter().map(|value| value.length()).fold(0.0, f64::max);
    for ((after, before), product) in at(1e-5).iter().zip(at(-1e-5)).zip(&product) {
        assert!(((*after - before) / 2e-5 + *product).length() < 1e-5 * size);
    }
}

#[test]
fn conjugate_gradients_solve_what_elimination_solves() {
    let (system, state) = bent();
    let (work, count) = (&mut Work::default(), system.node_count());
    let mut stiffness = Stiffness::default();
    stiffness.linearise(&system, &state.positions, work);
    let (diagonal, square) = (system.masses.clone(), 1e-6);
    let operator = Operator {
        system: &system,
        stiffness: &stiffness,
        diagonal: &diagonal,
        square,
    };
    let mut right = scatter(count);
    system.hold(&mut right);
    let mut solution = Vec::new();
    assert!(ConjugateGradients::default().solve(operator, &right, &mut solution, 1e-12, work));
    // The same matrix, column by column; fixed nodes have the diagonal alone.
    let size = 3 * count;
    let mut columns = Vec::new();
    for unknown in 0..size {
        let mut unit = vec![DVec3::ZERO; count];
        unit[unknown / 3][unknown % 3] = 1.0;
        let mut movements = unit.clone();
        system.hold(&mut movements);
        let mut product = vec![DVec3::ZERO; count];
        stiffness.product(&system, &movements, &mut product, work);
        let column = (0..count).flat_map(|node| (product[node] * square + unit[node] * diagonal[node]).to_array());
        columns.push(column.collect::<Vec<f64>>());
    }
    let mut matrix: Vec<Vec<f64>> = (0..size)
        .map(|row| {
            columns
                .iter()
                .map(|column| column[row])
                .chain([right[row / 3][row % 3]])
                .collect()
        })
        .collect();
    // Positive definite: elimination needs no pivots.
    for pivot in 0..size {
        let line = matrix[pivot].clone();
        for row in matrix.iter_mut().skip(pivot + 1) {
            let factor = row[pivot] / line[pivot];
            row.iter_mut()
                .zip(&line)
                .for_each(|(value, other)| *value -= factor * other);
        }
    }
    let mut dense = vec![0.0; size];
    for row in (0..size).rev() {
        let known: f64 = (row + 1..size).map(|column| matrix[row][column] * dense[column]).sum();
        dense[row] = (matrix[row][size] - known) / matrix[row][row];
    }
    let largest = dense.iter().fold(0.0_f64, |most, value| most.max(value.abs()));
    for (unknown, value) in dense.iter().enumerate() {
        assert!((solution[unknown / 3][unknown % 3] - value).abs() < 1e-9 * largest);
    }
}

#[test]
fn leapfrog_holds_below_the_bound_and_diverges_beyond_it() {
    let undamped = Annulus {
        damping_rate: 0.0,
        pull_un: 100.0,
        ..SMALL
    };
    let (system, start) = undamped.scene();
    let bound_s = stability_bound_s(&system, &start.positions);
    let after = |share: f64| {
        let (mut state, mut work) = (start.clone(), Work::default());
        let mut method = Leapfrog::new(&system, share * bound_s);
        (0..5000)
            .try_for_each(|_| method.step(&system, &mut state, &mut work))
            .map(|()| state)
    };
    let state = after(0.99).expect("below the bound");
    assert!(distances(&state.positions, &start.positions)[1] < 1.0);
    let beyond = after(1.15).map(|state| distances(&state.positions, &start.positions)[1]);
    assert!(beyond.is_err() || beyond.is_ok_and(|largest| largest > 1.0));
}

#[test]
fn implicit_methods_hold_at_a_hundred_times_the_explicit_bound() {
    let (system, start) = SMALL.scene();
    let step_s = 100.0 * stability_bound_s(&system, &start.positions);
    for choice in [Choice::ImplicitEuler, Choice::Bdf2, Choice::Midpoint] {
        let mut state = start.clone();
        advance(choice.build(&system, step_s).as_mut(), &system, &mut state, 100);
        let [_, largest] = distances(&state.positions, &start.positions);
        assert!(largest < 10.0, "{choice:?} moved a node by {largest} mm");
    }
}

#[test]
fn an_explicit_method_far_beyond_the_bound_says_that_it_diverged() {
    let (system, start) = SMALL.scene();
    let step_s = 10.0 * stability_bound_s(&system, &start.positions);
    for choice in [Choice::Leapfrog, Choice::SymplecticEuler, Choice::Rk4] {
        let (mut state, mut work) = (start.clone(), Work::default());
        let mut method = choice.build(&system, step_s);
        let failed = (0..2000).find_map(|_| method.step(&system, &mut state, &mut work).err());
        assert_eq!(failed, Some(StepError::Diverged), "{choice:?}");
    }
}

#[test]
fn implicit_euler_never_gains_energy() {
    let undriven = Annulus { pull_un: 0.0, ..SMALL };
    for damping_rate in [0.0, 40.0] {
        let (system, mut state) = Annulus {
            damping_rate,
            ..undriven
        }
        .scene();
        state.velocities = scatter(system.node_count())
            .into_iter()
            .map(|velocity| velocity * 100.0)
            .collect();
        system.hold(&mut state.velocities);
        let bound_s = stability_bound_s(&system, &state.positions);
        for factor in [0.5, 20.0] {
            let first = energy(&system, &state);
            let (mut state, mut before) = (state.clone(), first);
            let mut method = ImplicitEuler::new(factor * bound_s, 1e-9);
            for _ in 0..50 {
                advance(&mut method, &system, &mut state, 1);
                let now = energy(&system, &state);
                assert!(now <= before + 1e-12 * first, "{before} nJ became {now} nJ");
                before = now;
            }
        }
    }
}

#[test]
fn momentum_stays_without_fixed_nodes_and_damping() {
    let mut network = chain(6, 0.01, 3.0, 1.5);
    network.fixed.fill(false);
    network.velocities = scatter(network.positions.len())
        .into_iter()
        .map(|velocity| velocity * 5.0)
        .collect();
    let (system, start) = System::new(&network).expect("a sound network");
    let momentum = |state: &State| -> DVec3 {
        system
            .masses
            .iter()
            .zip(&state.velocities)
            .map(|(mass, velocity)| *velocity * *mass)
            .sum()
    };
    let step_s = 0.2 * stability_bound_s(&system, &start.positions);
    let methods: [Box<dyn Method>; 8] = [
        Choice::Leapfrog.build(&system, step_s),
        Choice::SymplecticEuler.build(&system, step_s),
        Choice::Rk4.build(&system, step_s),
        Choice::Chebyshev.build(&system, step_s),
        Choice::XpbdOnce.build(&system, step_s),
        // Only what is solved is conserved. Vertex block descent, which ends its sweeps unsolved, conserves none.
        Box::new(ImplicitEuler::new(step_s, 1e-11)),
        Box::new(Bdf2::new(step_s, 1e-11)),
        Box::new(Midpoint::new(step_s, 1e-11)),
    ];
    for mut method in methods {
        let mut state = start.clone();
        advance(method.as_mut(), &system, &mut state, 200);
        let drift = (momentum(&state) - momentum(&start)).length() / momentum(&start).length();
        assert!(drift < 1e-8, "{}: {drift}", method.name());
    }
}

#[test]
fn chebyshev_holds_overdamped_motion_at_many_times_the_bound() {
    let viscous = Annulus {
        damping_rate: 1e5,
        ..SMALL
    };
    let (system, start) = viscous.scene();
    let step_s = 50.0 / radius_per_s(&system);
    let (mut far, mut close) = (start.clone(), start.clone());
    advance(
        Choice::Chebyshev.build(&system, step_s).as_mut(),
        &system,
        &mut far,
        400,
    );
    advance(
        Choice::Rk4.build(&system, 0.02 * step_s).as_mut(),
        &system,
        &mut close,
        20_000,
    );
    let [error, _] = distances(&far.positions, &close.positions);
    let [moved, _] = distances(&close.positions, &start.positions);
    assert!(error < 1e-2 * moved, "{error} mm of {moved} mm");
}

#[test]
fn the_slowest_mode_of_a_chain_is_known() {
    let (system, start) = System::new(&chain(9, 0.01, 4.0, 1.0)).expect("a sound network");
    // Across the chain there is no stiffness at all.
    assert!(slowest_rad_per_s(&system, &start.positions) < 1.0);
    let mut tense = chain(9, 0.01, 4.0, 1.0);
    tense.rest_lengths.fill(0.0);
    let (system, start) = System::new(&tense).expect("a sound network");
    let w = 2.0 * (4.0_f64 / 0.01).sqrt() * (std::f64::consts::PI / 20.0).sin();
    assert!((slowest_rad_per_s(&system, &start.positions) / w - 1.0).abs() < 0.01);
}

#[test]
fn an_annulus_without_pull_rests_and_a_notch_takes_nodes() {
    for (diagonals, pre_tension) in [(true, 0.0), (false, 0.05), (true, 0.03)] {
        let still = Annulus {
            pull_un: 0.0,
            diagonals,
            pre_tension,
            ..SMALL
        };
        let (system, start) = still.scene();
        let mut forces = vec![DVec3::ZERO; system.node_count()];
        system.forces(&start.positions, &mut forces, &mut Work::default());
        assert!(forces.iter().all(|force| force.length() < 1e-6));
    }
    let whole = SMALL.network();
    let cut = Annulus { notch: true, ..SMALL }.network();
    assert!(cut.positions.len() < whole.positions.len() && cut.springs.len() < whole.springs.len());
    let load = |network: &resecta_solver::Network| network.loads.iter().sum::<DVec3>().length();
    assert!((load(&cut) / load(&whole) - 1.0).abs() < 1e-12);
    assert_eq!(cut.check(), Ok(()));
}

#[test]
fn leapfrog_here_and_the_product_make_the_same_motion() {
    let (network, (system, mut state)) = (SMALL.network(), SMALL.scene());
    let start = state.positions.clone();
    let step_s = 0.5 * stability_bound_s(&system, &state.positions);
    advance(&mut Leapfrog::new(&system, step_s), &system, &mut state, 200);
    let mut tissue = Tissue::from_network(&network).expect("a sound network");
    let report = tissue.advance_steps(step_s, 200).expect("a plain step");
    assert_eq!(report.substeps, 200);
    let product: Vec<DVec3> = (0..network.positions.len() as u32)
        .map(|node| tissue.precise_position(node))
        .collect();
    let [moved, _] = distances(&state.positions, &start);
    let [apart, _] = distances(&product, &state.positions);
    assert!(apart < 1e-4 * moved, "{apart} mm of {moved} mm");
}
