//! The visible mesh between two steps.

use std::time::Duration;

use bevy::{prelude::*, time::TimeUpdateStrategy};
use resecta_tissue::{DrawnBetweenSteps, prelude::*};

use crate::{
    mesh::{mesh, positions},
    scenes::{STEP_S, app, checked, small_block},
};

/// Where the mesh of a tissue that is drawn where steps leave it was, step by step.
#[derive(Resource, Default)]
struct Steps(Vec<Vec<Vec3>>);

#[derive(Resource)]
struct Twin(Entity);

fn note(twin: Res<Twin>, handles: Query<&Mesh3d>, meshes: Res<Assets<Mesh>>, mut steps: ResMut<Steps>) {
    let mesh = handles.get(twin.0).ok().and_then(|handle| meshes.get(&handle.0));
    steps.0.extend(mesh.map(positions));
}

/// Two blocks alike, the first drawn between steps, and frames of a share of a step.
fn scene(frame: f32) -> (App, [Entity; 2]) {
    let mut app = app();
    app.init_resource::<Assets<Mesh>>().init_resource::<Steps>();
    let first = (Tissue::new(small_block()), checked(), DrawnBetweenSteps::default());
    let first = app.world_mut().spawn(first).id();
    let twin = app.world_mut().spawn((Tissue::new(small_block()), checked())).id();
    app.insert_resource(Twin(twin));
    app.add_systems(FixedPostUpdate, note.in_set(TissueSystems::Last));
    app.update();
    for tissue in [first, twin] {
        let node = app.world().get::<Tissue>(tissue).unwrap().node_entity(780).unwrap();
        app.world_mut().get_mut::<TissueNode>(node).unwrap().load = Vec3::new(0.0, 0.0, 50_000.0);
    }
    app.insert_resource(TimeUpdateStrategy::ManualDuration(Duration::from_secs_f32(
        STEP_S * frame,
    )));
    (app, [first, twin])
}

fn assert_near(drawn: &[Vec3], expected: impl Iterator<Item = Vec3>, what: &str) {
    for (drawn, expected) in drawn.iter().zip(expected) {
        assert!(drawn.distance(expected) < 1e-4, "{what}: {drawn} for {expected}");
    }
}

#[test]
fn a_frame_shows_the_tissue_as_far_between_the_last_two_steps_as_time_is() {
    for frame in [0.37, 1.0, 2.6] {
        let (mut app, [first, _]) = scene(frame);
        let mut moved = 0.0f32;
        for number in 0..12 {
            app.update();
            let share = app.world().resource::<Time<Fixed>>().overstep_fraction();
            let steps = &app.world().resource::<Steps>().0;
            let [.., before, now] = &steps[..] else { continue };
            let expected = before.iter().zip(now).map(|(before, now)| before.lerp(*now, share));
            assert_near(&positions(mesh(&app, first)), expected, &format!("frame {number}"));
            moved = before
                .iter()
                .zip(now)
                .map(|(a, b)| a.distance(*b))
                .fold(moved, f32::max);
        }
        assert!(moved > 0.01, "the block was to move, by {moved} mm");
    }
}

#[test]
fn what_a_cut_made_is_drawn_where_it_is() {
    let (mut app, [first, twin]) = scene(0.7);
    for _ in 0..4 {
        app.update();
    }
    for tissue in [first, twin] {
        let pentahedron = app.world().get::<Tissue>(tissue).unwrap().pentahedron_entity(500);
        app.world_mut().despawn(pentahedron.unwrap());
    }
    for number in 0..6 {
        app.update();
        let [.., before, now] = &app.world().resource::<Steps>().0[..] else {
            panic!("steps were made")
        };
        let drawn = positions(mesh(&app, first));
        assert_eq!(drawn.len(), now.len());
        // Between where it was and where it is, or, where it was not, there.
        for (vertex, place) in drawn.iter().enumerate() {
            let far = before.get(vertex).map_or(0.0, |before| before.distance(now[vertex]));
            assert!(
                place.distance(now[vertex]) < far + 1e-4,
                "vertex {vertex} in frame {number}"
            );
        }
    }
}

#[test]
fn tissue_at_rest_is_drawn_where_it_rests() {
    let (mut app, [first, twin]) = scene(0.37);
    for tissue in [first, twin] {
        let node = app.world().get::<Tissue>(tissue).unwrap().node_entity(780).unwrap();
        app.world_mut().get_mut::<TissueNode>(node).unwrap().load = Vec3::ZERO;
    }
    let mut still = 0;
    for _ in 0..2000 {
        app.update();
        let drawn = positions(mesh(&app, first));
        still = if drawn == positions(mesh(&app, twin)) {
            still + 1
        } else {
            0
        };
        if still > 5 {
            return;
        }
    }
    panic!("it never came to rest");
}
