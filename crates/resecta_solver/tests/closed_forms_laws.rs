//! Laws that hold in any scene: the balance of energy, what a removed spring takes with it, both momenta, and that neither
//! the place nor the numbering of a scene matters.

mod common;

use common::networks::{chain, cube, tissue, uniform};
use common::{block_mesh, tube_lattice};
use glam::{DQuat, DVec3, Vec3};
use resecta_solver::{Material, Network, NodeKind, ShearResistance, Tissue, TissueMesh};

const EPSILON: f64 = f32::EPSILON as f64;

fn elastic(tissue: &Tissue, spring: u32) -> f64 {
    let state = tissue.spring(spring);
    let [a, b] = state.nodes.map(|node| tissue.position(node).as_dvec3());
    let elongation = a.distance(b) - f64::from(state.rest_length);
    0.5 * f64::from(state.stiffness) * elongation * elongation
}

/// A cube of springs that spins and shakes.
fn thrown() -> Network {
    let mut network = cube(4, 0.01, 2_000.0, 0.0);
    let mut uniform = uniform();
    for (place, velocity) in network.positions.iter().zip(&mut network.velocities) {
        let shaken = DVec3::new(uniform(), uniform(), uniform()) - 0.5;
        *velocity = DVec3::new(20.0, 5.0, -10.0) + DVec3::new(10.0, -25.0, 15.0).cross(*place) + shaken * 40.0;
    }
    network
}

#[test]
fn energy_changes_by_the_work_of_loads_less_what_drag_takes() {
    // What is left over is the error of the step, and falls with its square.
    let mut network = chain(6, 2.0, 0.01, 3_000.0, 0.1);
    for node in 1..6 {
        network.loads[node] = DVec3::new(20.0, 60.0, -10.0);
        network.velocities[node] = DVec3::new(0.0, 0.0, 30.0 * node as f64);
    }
    let left_over = |steps: u32| {
        let time = 0.04;
        let step_s = time / f64::from(steps);
        let mut tissue = tissue(&network);
        let power = |tissue: &Tissue| -> f64 {
            (1..6)
                .map(|node| f64::from(tissue.damping_g_per_s(node)) * tissue.velocity(node).as_dvec3().length_squared())
                .sum()
        };
        let (energy, mut taken) = (tissue.energy().total(), 0.0);
        for _ in 0..steps {
            let before = power(&tissue);
            let report = tissue.advance_steps(step_s, 1).expect("within the bound");
            assert_eq!(report.substeps, 1, "no step is divided");
            taken += 0.5 * step_s * (before + power(&tissue));
        }
        let worked: f64 = (1..6)
            .map(|node| network.loads[node].dot(tissue.precise_position(node as u32) - network.positions[node]))
            .sum();
        let gained = tissue.energy().total() - energy;
        assert!(taken > 0.1 * worked && gained > 0.1 * worked, "all three matter");
        ((gained - worked + taken) / worked).abs()
    };
    let (coarse, fine) = (left_over(50), left_over(100));
    let order = (coarse / fine).log2();
    assert!((1.8..2.2).contains(&order), "order {order}: {coarse}, then {fine}");
    assert!(fine < 1e-2, "{fine} of the work");
}

#[test]
fn removing_a_spring_takes_its_own_energy_and_nothing_else() {
    let mut uniform = uniform();
    let mut network = cube(4, 0.01, 2_000.0, 0.0);
    for place in &mut network.positions {
        *place += 0.4 * (DVec3::new(uniform(), uniform(), uniform()) - 0.5);
    }
    let mut tissue = tissue(&network);
    for spring in (0..tissue.spring_count() as u32).step_by(7) {
        let (before, own) = (tissue.energy().elastic, elastic(&tissue, spring));
        assert!(own > 0.0);
        tissue.set_spring_stiffness(spring, 0.0).expect("a stiffness of none");
        let taken = before - tissue.energy().elastic;
        assert!(
            (taken - own).abs() < 1e-12 * before,
            "spring {spring}: {taken} of {own} nJ"
        );
    }
}

#[test]
fn a_cut_takes_the_energy_of_what_it_removes_or_weakens_and_nothing_else() {
    let material = Material {
        support_pa_per_mm: 0.0,
        ..Material::default()
    };
    let mut tissue = Tissue::new(&block_mesh([4, 4, 4], 2.0), &material).expect("a block is a tissue");
    let mut uniform = uniform();
    let mut random = |size: f32| Vec3::from_array([0; 3].map(|_| (uniform() as f32 - 0.5) * size));
    for node in 0..tissue.node_count() as u32 {
        let place = tissue.position(node) + random(0.6);
        tissue.set_position(node, place).expect("a finite position");
        tissue.set_velocity(node, random(50.0)).expect("a finite velocity");
    }
    let own = |tissue: &Tissue| -> Vec<f64> {
        (0..tissue.spring_count() as u32)
            .map(|spring| elastic(tissue, spring))
            .collect()
    };
    let kinetic = |tissue: &Tissue, node: u32| {
        0.5 * f64::from(tissue.inertia_g(node)) * tissue.velocity(node).as_dvec3().length_squared()
    };
    for corner in [0, 60, 124] {
        let near = tissue.pentahedra_near(corner, 2.5);
        let (energy, springs) = (tissue.energy(), own(&tissue));
        let motion: Vec<f64> = (0..125).map(|node| kinetic(&tissue, node)).collect();
        let resection = tissue.resect(&near, None);
        let taken: f64 = springs
            .iter()
            .zip(own(&tissue))
            .map(|(before, after)| before - after)
            .sum();
        let stopped: f64 = resection.nodes.iter().map(|&node| motion[node as usize]).sum();
        let after = tissue.energy();
        assert!((energy.elastic - after.elastic - taken).abs() < 1e-12 * energy.elastic);
        assert!((energy.kinetic - after.kinetic - stopped).abs() < 1e-12 * energy.kinetic);
        let touched = |spring: usize| {
            let spring = spring as u32;
            resection.springs.contains(&spring) || resection.weakened.contains(&spring)
        };
        for (spring, (before, after)) in springs.iter().zip(own(&tissue)).enumerate() {
            assert!(touched(spring) || *before == after, "spring {spring} was left alone");
            assert!(after <= *before, "spring {spring} gained");
        }
    }
}

#[test]
fn without_drag_and_supports_both_momenta_are_constant() {
    let network = thrown();
    let mut tissue = tissue(&network);
    let momenta = |tissue: &Tissue| -> [DVec3; 2] {
        let of = |node: u32| tissue.velocity(node).as_dvec3() * f64::from(tissue.mass_g(node));
        let nodes = || 0..tissue.node_count() as u32;
        [
            nodes().map(of).sum(),
            nodes().map(|node| tissue.precise_position(node).cross(of(node))).sum(),
        ]
    };
    let step_s = 0.5 * tissue.bound_s();
    let before = momenta(&tissue);
    // A kick rounds each velocity by half a unit in the last place, at random; forces come in equal and opposite pairs, but
    // act where single precision has the nodes, and change a velocity by up to w h = 1 of itself in a step.
    let steps = 5_000u32;
    let sizes = (0..64).map(|node| {
        let (place, velocity) = (network.positions[node].length(), network.velocities[node].length());
        (0.01 * velocity).powi(2) * DVec3::new(1.0, place.powi(2), 0.0)
    });
    let sizes: DVec3 = sizes.sum();
    let rounding = EPSILON * f64::from(steps).sqrt();
    let report = tissue.advance_steps(step_s, steps.into()).expect("within the bound");
    assert_eq!(report.substeps, steps, "no step is divided");
    let after = momenta(&tissue);
    for (what, n) in [("linear", 0), ("angular", 1)] {
        let (change, allowed) = (
            (after[n] - before[n]).length(),
            4.0 * (1.0 + 1.0) * rounding * sizes[n].sqrt(),
        );
        assert!(change < allowed, "{what}: {change} of {allowed}");
        assert!(
            allowed < 1e-3 * before[n].length(),
            "{what}: the allowance hides nothing"
        );
    }
}

/// What a scene of `positions` and a load does, after the same time whatever its place and numbering.
fn pulled(mesh: &TissueMesh, node: u32, load: DVec3) -> Tissue {
    let mut tissue = Tissue::new(mesh, &Material::default()).expect("a block is a tissue");
    tissue.set_load(node, load.as_vec3()).expect("a finite load");
    tissue.advance(0.1, &[]).expect("a plain advance");
    tissue
}

#[test]
fn a_scene_turned_by_any_angle_and_moved_gives_the_turned_and_moved_answer() {
    let mesh = block_mesh([3, 3, 3], 2.0);
    let load = DVec3::new(500.0, 200.0, -300.0);
    let plain = pulled(&mesh, 5, load);
    let mut uniform = uniform();
    for _ in 0..6 {
        let axis = DVec3::new(uniform() - 0.5, uniform() - 0.5, uniform() - 0.5).normalize();
        let turn = DQuat::from_axis_angle(axis, 6.0 * uniform());
        let way = 10.0 * DVec3::new(uniform(), uniform(), uniform());
        let turned = TissueMesh {
            positions: mesh.positions.iter().map(|place| turn * *place + way).collect(),
            ..mesh.clone()
        };
        let turned = pulled(&turned, 5, turn * load);
        for node in 0..64 {
            // Every spring between a node and the furthest is off by the rounding of its length, before and after.
            let off = turned.precise_position(node) - (turn * plain.precise_position(node) + way);
            assert!(off.length() < 2.0 * 9.0 * 20.0 * EPSILON, "node {node}: {off}");
        }
    }
}

#[test]
fn a_renumbered_scene_gives_the_renumbered_answer() {
    let mesh = block_mesh([3, 3, 3], 2.0);
    let (load, count) = (DVec3::new(500.0, 200.0, -300.0), 64);
    let plain = pulled(&mesh, 5, load);
    // Steps prime to the count visit every number once.
    for (factor, shift) in [(63, 63), (27, 11), (5, 40)] {
        let renumbered = |node: u32| (node * factor + shift) % count;
        let mut positions = vec![DVec3::ZERO; count as usize];
        for (node, place) in (0..).zip(&mesh.positions) {
            positions[renumbered(node) as usize] = *place;
        }
        let mut pentahedra: Vec<[u32; 6]> = mesh.pentahedra.iter().map(|nodes| nodes.map(renumbered)).collect();
        pentahedra.reverse();
        let other = pulled(&TissueMesh::from_pentahedra(positions, pentahedra), renumbered(5), load);
        assert_eq!(other.spring_count(), plain.spring_count());
        for node in 0..count {
            let off = other.precise_position(renumbered(node)) - plain.precise_position(node);
            assert!(off.length() < 2.0 * 9.0 * 8.0 * EPSILON, "node {node}: {off}");
        }
    }
}

#[test]
fn what_covers_an_organ_beyond_its_capsule_holds_it_as_the_capsule_does() {
    let lattice = tube_lattice(20.0);
    let whole = TissueMesh::from_lattice(&lattice, ShearResistance::Diagonals);
    let mut ended = whole.clone();
    ended.end_capsule_at(15.0);
    let [whole, ended] = [&whole, &ended].map(|mesh| Tissue::new(mesh, &Material::default()).unwrap());

    let (mut held, mut of_capsule) = (0, 0);
    for node in 0..whole.node_count() as u32 {
        assert_eq!(whole.support(node), ended.support(node));
        let was_capsule = whole.node_kind(node) == NodeKind::Capsule;
        let is_capsule = ended.node_kind(node) == NodeKind::Capsule;
        assert_eq!(is_capsule, was_capsule && whole.rest_position(node).z <= 15.001);
        (held, of_capsule) = (held + u32::from(was_capsule), of_capsule + u32::from(is_capsule));
    }
    assert!(of_capsule > 0 && of_capsule < held);

    let area = |tissue: &Tissue| -> f64 {
        let pentahedra = 0..tissue.pentahedron_count() as u32;
        pentahedra.map(|index| f64::from(tissue.capsule_area_mm2(index))).sum()
    };
    // It ends with the last ring of faces below that height, less than one of them short of half the tube.
    let share = area(&ended) / area(&whole);
    let ring = 1.0 / f64::from(lattice.shape.slices - 1);
    assert!(share <= 0.5 + 1e-6 && share > 0.5 - ring, "{share}");
    for index in 0..whole.pentahedron_count() as u32 {
        assert_eq!(whole.is_held(index), ended.is_held(index));
        assert!([0.0, whole.capsule_area_mm2(index)].contains(&ended.capsule_area_mm2(index)));
    }
}
