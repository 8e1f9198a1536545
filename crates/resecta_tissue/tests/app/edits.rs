//! Any system reads and edits the parts.

use bevy::prelude::*;
use resecta_tissue::{PutAsideReason, PutAsideSubject, prelude::*};

use crate::scenes::{app, bits, checked, messages, small_block};

fn scene() -> (App, Entity) {
    let mut app = app();
    let tissue = app.world_mut().spawn((Tissue::new(small_block()), checked())).id();
    app.update();
    (app, tissue)
}

fn node_of(app: &App, tissue: Entity, index: u32) -> Entity {
    app.world().get::<Tissue>(tissue).unwrap().node_entity(index).unwrap()
}

#[test]
fn every_part_has_an_entity_that_shows_its_state() {
    let (mut app, tissue) = scene();
    let world = app.world_mut();
    let (mut nodes, mut springs, mut pentahedra) = (
        world.query::<(Entity, &TissueNode)>(),
        world.query::<&Spring>(),
        world.query::<&Pentahedron>(),
    );
    let tissue = world.get::<Tissue>(tissue).unwrap();
    let solver = tissue.solver();
    assert_eq!(nodes.iter(world).count(), solver.node_count());
    assert_eq!(springs.iter(world).count(), solver.spring_count());
    assert_eq!(pentahedra.iter(world).count(), solver.pentahedron_count());
    for (entity, node) in nodes.iter(world) {
        assert_eq!(tissue.node_entity(node.index), Some(entity));
        assert_eq!(node.position, solver.position(node.index));
    }
}

#[test]
fn a_load_on_a_node_moves_it_and_its_neighbours() {
    let (mut app, tissue) = scene();
    let top = small_block().node_count() as u32 - 61; // in the middle of the top
    let entity = node_of(&app, tissue, top);
    app.world_mut().get_mut::<TissueNode>(entity).unwrap().load = Vec3::new(0.0, 0.0, 20_000.0);
    for _ in 0..30 {
        app.update();
    }
    let rest = small_block();
    let moved = |index: u32| {
        let node = app.world().get::<TissueNode>(node_of(&app, tissue, index)).unwrap();
        node.position - rest.position(index)
    };
    assert!(moved(top).z > 0.1, "{}", moved(top));
    for neighbour in [top - 1, top + 1, top - 11, top + 11] {
        assert!(moved(neighbour).z > 0.01 && moved(neighbour).z < moved(top).z);
    }
}

#[test]
fn a_moved_node_and_a_changed_spring_reach_the_solver() {
    let (mut app, tissue) = scene();
    let node = node_of(&app, tissue, 700);
    let spring = app.world().get::<Tissue>(tissue).unwrap().spring_entity(5).unwrap();
    let world = app.world_mut();
    world.get_mut::<TissueNode>(node).unwrap().position += Vec3::Z;
    world.get_mut::<TissueNode>(node).unwrap().mass_g = 1.0;
    world.get_mut::<Spring>(spring).unwrap().stiffness_mn_per_m = 3.0;
    world.get_mut::<Spring>(spring).unwrap().rest_length_mm = 1.5;
    app.update();
    let solver = app.world().get::<Tissue>(tissue).unwrap().solver();
    assert!(solver.position(700).z - solver.rest_position(700).z > 0.01);
    assert_eq!(solver.mass_g(700), 1.0);
    assert_eq!((solver.spring(5).stiffness, solver.spring(5).rest_length), (3.0, 1.5));
    assert_eq!(app.world().resource::<TissueDiagnostics>().edits, 2);
}

#[test]
fn edits_reach_the_solver_wherever_in_their_table_the_parts_lie() {
    let (mut app, tissue) = scene();
    let count = app.world().get::<Tissue>(tissue).unwrap().solver().spring_count() as u32;
    // Alone, two together, the first and the last; those of the round before are not edits any more.
    for edited in [
        vec![0],
        vec![63, 64],
        vec![count - 1],
        (0..count).step_by(37).collect(),
        (0..count).collect(),
    ] {
        for &index in &edited {
            let spring = app.world().get::<Tissue>(tissue).unwrap().spring_entity(index).unwrap();
            let mut spring = app.world_mut().get_mut::<Spring>(spring).unwrap();
            spring.stiffness_mn_per_m += 1.0;
        }
        let stiffness = |app: &App| -> Vec<f32> {
            let solver = app.world().get::<Tissue>(tissue).unwrap().solver();
            (0..count).map(|index| solver.spring(index).stiffness).collect()
        };
        let mut wanted = stiffness(&app);
        edited.iter().for_each(|&index| wanted[index as usize] += 1.0);
        app.update();
        assert_eq!(app.world().resource::<TissueDiagnostics>().edits, edited.len());
        assert_eq!(stiffness(&app), wanted);
    }
}

#[test]
fn writing_back_is_not_taken_for_an_edit() {
    let (mut app, _) = scene();
    app.update();
    assert_eq!(app.world().resource::<TissueDiagnostics>().edits, 0);
}

#[test]
fn despawning_a_pentahedron_is_a_resection_of_exactly_its_volume() {
    let (mut app, tissue) = scene();
    let world = app.world_mut();
    let solver = world.get::<Tissue>(tissue).unwrap().solver();
    let last = solver.pentahedron_count() as u32 - 1;
    let (volume, initial) = (solver.rest_volume_mm3(last), solver.initial_volume_mm3());
    let entity = world.get::<Tissue>(tissue).unwrap().pentahedron_entity(last).unwrap();
    world.despawn(entity);
    app.update();
    let told: Vec<TissueResected> = messages(&app);
    assert_eq!(told.len(), 1);
    assert_eq!(
        (told[0].tool, told[0].pentahedra.as_slice(), told[0].volume_mm3),
        (None, &[last][..], volume)
    );
    let solver = app.world().get::<Tissue>(tissue).unwrap().solver();
    assert_eq!(solver.removed_volume_mm3(), volume);
    assert!(!solver.is_pentahedron_alive(last));
    assert_eq!(solver.initial_volume_mm3(), initial);
    // Told once: the entities that the resection took with it are no resections of their own.
    app.update();
    assert!(messages::<TissueResected>(&app).is_empty());
}

#[test]
fn despawning_a_node_resects_what_it_belongs_to_and_despawning_a_spring_severs_it() {
    let (mut app, tissue) = scene();
    let world = app.world_mut();
    let state = world.get::<Tissue>(tissue).unwrap();
    let (node, spring) = (state.solver().node_count() as u32 - 1, 7);
    let around: Vec<u32> = state.solver().pentahedra_around(node).collect();
    let (node_entity, spring_entity) = (state.node_entity(node).unwrap(), state.spring_entity(spring).unwrap());
    world.despawn(node_entity);
    world.despawn(spring_entity);
    app.update();
    let solver = app.world().get::<Tissue>(tissue).unwrap().solver();
    assert!(!solver.is_node_alive(node));
    assert_eq!(messages::<TissueResected>(&app)[0].pentahedra, around);
    assert_eq!(solver.spring(spring).stiffness, 0.0);
}

#[test]
fn edits_that_are_not_finite_are_refused_reported_and_spread_nowhere() {
    let (mut app, tissue) = scene();
    let before = bits(&app, tissue);
    let node = node_of(&app, tissue, 300);
    let spring = app.world().get::<Tissue>(tissue).unwrap().spring_entity(9).unwrap();
    let stiffness = app.world().get::<Spring>(spring).unwrap().stiffness_mn_per_m;
    let world = app.world_mut();
    let mut edited = world.get_mut::<TissueNode>(node).unwrap();
    edited.position.x = f32::NAN;
    edited.velocity.y = f32::INFINITY;
    edited.load.z = f32::NAN;
    edited.mass_g = -1.0;
    world.get_mut::<Spring>(spring).unwrap().stiffness_mn_per_m = f32::NAN;
    app.update();
    let told: Vec<TissuePutAside> = messages(&app);
    assert_eq!(told.len(), 5);
    assert!(
        told.iter()
            .all(|told| told.tissue == tissue && matches!(told.reason, PutAsideReason::Edit(_)))
    );
    assert_eq!(
        told.iter()
            .filter(|told| told.subject == PutAsideSubject::Node(300))
            .count(),
        4
    );
    assert_eq!(told[4].subject, PutAsideSubject::Spring(9));
    assert_eq!(bits(&app, tissue), before);
    // The components show what the solver kept.
    let shown = app.world().get::<TissueNode>(node).unwrap();
    assert!(shown.position.is_finite() && shown.velocity.is_finite() && shown.load == Vec3::ZERO && shown.mass_g > 0.0);
    assert_eq!(app.world().get::<Spring>(spring).unwrap().stiffness_mn_per_m, stiffness);
    assert_eq!(app.world().resource::<TissueDiagnostics>().put_aside, 5);
}

#[test]
fn a_part_that_is_none_is_reported() {
    let (mut app, tissue) = scene();
    let stray = TissueNode {
        tissue,
        index: 3,
        position: Vec3::ZERO,
        velocity: Vec3::ZERO,
        load: Vec3::X,
        mass_g: 1.0,
        damping_g_per_s: 0.0,
    };
    app.world_mut().spawn(stray.clone());
    app.world_mut().spawn(TissueNode {
        tissue: Entity::PLACEHOLDER,
        ..stray
    });
    app.update();
    let told: Vec<TissuePutAside> = messages(&app);
    assert_eq!(told.len(), 2);
    assert!(told.iter().all(|told| told.reason == PutAsideReason::Identity));
}

#[test]
fn a_tissue_takes_its_parts_with_it() {
    let (mut app, tissue) = scene();
    let parts = |app: &mut App| {
        let world = app.world_mut();
        let nodes = world.query::<&TissueNode>().iter(world).count();
        let springs = world.query::<&Spring>().iter(world).count();
        nodes + springs + world.query::<&Pentahedron>().iter(world).count()
    };
    let count = parts(&mut app);
    // Replaced: old parts go, new ones come.
    app.world_mut().entity_mut(tissue).insert(Tissue::new(small_block()));
    assert_eq!(parts(&mut app), 0);
    app.update();
    assert_eq!(parts(&mut app), count);
    app.world_mut().despawn(tissue);
    assert_eq!(parts(&mut app), 0);
    app.update();
    assert!(messages::<TissueResected>(&app).is_empty());
}

#[test]
fn two_tissues_do_not_influence_each_other() {
    let alone = {
        let (mut app, tissue) = scene();
        for _ in 0..10 {
            app.update();
        }
        bits(&app, tissue)
    };
    let (mut app, tissue) = scene();
    let other = app.world_mut().spawn(Tissue::new(small_block())).id();
    app.update();
    let pushed = node_of(&app, other, 800);
    app.world_mut().get_mut::<TissueNode>(pushed).unwrap().load = Vec3::new(0.0, 0.0, 50_000.0);
    let cut = app
        .world()
        .get::<Tissue>(other)
        .unwrap()
        .pentahedron_entity(1000)
        .unwrap();
    app.world_mut().despawn(cut);
    for _ in 0..9 {
        app.update();
    }
    assert_eq!(bits(&app, tissue), alone);
    assert_ne!(bits(&app, other), alone);
}
