//! The order of a step is settled, and the same steps give the same bits.

use bevy::{
    ecs::schedule::{LogLevel, ScheduleBuildSettings},
    prelude::*,
    time::TimeUpdateStrategy,
};
use resecta_tissue::prelude::*;

use crate::scenes::{app, bits, checked, loop_tool, messages, sheath_tool, small_block, tube, unstarted_app};

#[test]
fn no_two_systems_of_the_step_are_ambiguous() {
    let mut app = unstarted_app();
    app.edit_schedule(FixedPostUpdate, |schedule| {
        schedule.set_build_settings(ScheduleBuildSettings {
            ambiguity_detection: LogLevel::Error,
            ..default()
        });
    });
    app.init_resource::<Assets<Mesh>>();
    app.world_mut().spawn(Tissue::new(small_block()));
    app.world_mut().spawn(sheath_tool(Isometry3d::IDENTITY));
    app.update();
    app.update();
    assert!(app.world().resource::<TissueDiagnostics>().nodes > 0);
}

#[test]
fn the_same_steps_give_the_same_bits() {
    let run = || {
        let mut app = app();
        let first = app
            .world_mut()
            .spawn((Tissue::new(tube(15.0, 12.0, 20.0)), checked()))
            .id();
        let second = app.world_mut().spawn((Tissue::new(small_block()), checked())).id();
        let turned = Quat::from_rotation_x(std::f32::consts::FRAC_PI_2);
        let pose = |step: f32| Isometry3d::new(Vec3::new(0.1, 12.0 - step, 12.5), turned);
        let mut tool = loop_tool(pose(0.0));
        tool.cutting = true;
        let tool = app.world_mut().spawn(tool).id();
        app.world_mut()
            .spawn(sheath_tool(Isometry3d::from_translation(Vec3::new(0.0, 0.0, 10.0))));
        let mut told = Vec::new();
        for step in 0..20 {
            app.world_mut().get_mut::<TissueTool>(tool).unwrap().pose = pose(step as f32);
            app.update();
            told.extend(
                messages::<TissueResected>(&app)
                    .into_iter()
                    .map(|told| (told.pentahedra, told.volume_mm3)),
            );
            told.push((Vec::new(), messages::<TissueContact>(&app).len() as f64));
        }
        (bits(&app, first), bits(&app, second), told)
    };
    let first = run();
    assert!(first.2.iter().any(|(pentahedra, _)| !pentahedra.is_empty()));
    assert_eq!(run(), first);
    assert_eq!(run(), first);
}

#[test]
fn sets_run_in_order_and_first_and_last_are_free() {
    #[derive(Resource, Default)]
    struct Seen(Vec<Vec3>);
    let look = |mut seen: ResMut<Seen>, nodes: Query<&TissueNode>| {
        seen.0
            .extend(nodes.iter().find(|node| node.index == 0).map(|node| node.position));
    };
    let mut app = app();
    app.init_resource::<Seen>();
    app.add_systems(
        FixedPostUpdate,
        (look.in_set(TissueSystems::First), look.in_set(TissueSystems::Last)),
    );
    app.world_mut().spawn(Tissue::new(small_block()));
    app.update();
    let mut nodes = app.world_mut().query::<&mut TissueNode>();
    for mut node in nodes.iter_mut(app.world_mut()) {
        node.velocity = Vec3::X;
    }
    app.update();
    let seen = &app.world().resource::<Seen>().0;
    // Before the first step there are no parts; before the second they are where the first left them.
    assert_eq!(seen.len(), 3);
    assert_eq!(seen[0], seen[1]);
    assert_ne!(seen[1], seen[2]);
}

#[test]
fn the_plugin_runs_in_the_schedule_it_is_given() {
    let mut app = App::new();
    app.add_plugins((MinimalPlugins, TissuePlugin::new(PostUpdate)))
        .insert_resource(TimeUpdateStrategy::ManualDuration(std::time::Duration::from_millis(10)));
    app.world_mut().spawn(Tissue::new(small_block()));
    app.update();
    app.update();
    assert!(app.world().resource::<TissueDiagnostics>().substeps > 0);
    assert!(messages::<TissuePutAside>(&app).is_empty());
}

#[test]
fn a_tool_that_goes_while_the_clock_is_paused_touches_nothing_after() {
    let step = |milliseconds| TimeUpdateStrategy::ManualDuration(std::time::Duration::from_millis(milliseconds));
    let mut app = App::new();
    app.add_plugins((MinimalPlugins, TissuePlugin::new(PostUpdate)))
        .insert_resource(step(10));
    app.world_mut().spawn(Tissue::new(small_block()));
    let pose = Isometry3d::from_translation(Vec3::new(0.0, 0.0, 11.5));
    let tool = app.world_mut().spawn(sheath_tool(pose)).id();
    app.update();
    app.update();
    assert!(
        !messages::<TissueContact>(&app).is_empty(),
        "the sheath rests on the block"
    );
    app.insert_resource(step(0));
    app.update();
    app.world_mut().despawn(tool);
    app.insert_resource(step(10));
    for _ in 0..3 {
        app.update();
    }
    assert!(messages::<TissueContact>(&app).is_empty());
}

#[test]
fn the_public_types_are_registered_for_reflection() {
    let app = app();
    let registry = app.world().resource::<AppTypeRegistry>().read();
    for name in [
        "Tissue",
        "TissueNode",
        "Spring",
        "Pentahedron",
        "TissueSettings",
        "TissueTool",
        "TissueDiagnostics",
    ] {
        assert!(registry.get_with_short_type_path(name).is_some(), "{name}");
    }
}
