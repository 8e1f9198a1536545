//! Probes tell how far a point is from the surface, and on which side.

use bevy::prelude::*;
use resecta_tissue::{TissueProbe, prelude::*};

use crate::scenes::{app, checked, loop_tool, small_block};

/// Distance to the surface, negative inside; and whether the point is inside.
fn ask(app: &mut App, probe: Entity, point: Vec3) -> (Option<f32>, bool) {
    app.world_mut().get_mut::<TissueProbe>(probe).unwrap().point = point;
    app.update();
    let told = app.world().get::<TissueProbe>(probe).unwrap();
    let sign = if told.inside { -1.0 } else { 1.0 };
    (told.distance_mm.map(|distance| sign * distance), told.inside)
}

fn distance(app: &mut App, probe: Entity, point: Vec3) -> Option<f32> {
    ask(app, probe, point).0
}

/// A block whose top is at z = 12, and a probe.
fn scene(settings: TissueSettings) -> (App, Entity) {
    let mut app = app();
    app.world_mut().spawn((Tissue::new(small_block()), settings));
    let probe = app.world_mut().spawn(TissueProbe::default()).id();
    (app, probe)
}

#[test]
fn a_probe_is_told_how_far_the_surface_is_and_on_which_side_it_lies() {
    for detail in [CutDetail::Elements, CutDetail::default()] {
        let (mut app, probe) = scene(TissueSettings { detail, ..checked() });
        for height in [-2.5f32, -0.5, 0.3, 2.9] {
            let told = distance(&mut app, probe, Vec3::new(0.3, 0.2, 12.0 + height));
            let told = told.expect("the surface is within 3 mm");
            assert!((told - height).abs() < 1e-3, "{told} at {height}");
        }
        assert_eq!(ask(&mut app, probe, Vec3::new(0.3, 0.2, 16.0)), (None, false));
        assert_eq!(
            ask(&mut app, probe, Vec3::new(0.0, 0.0, 6.0)),
            (None, true),
            "deep inside"
        );
        assert_eq!(ask(&mut app, probe, Vec3::NAN), (None, false));
    }
}

#[test]
fn a_probe_in_a_fresh_trench_is_outside() {
    let (mut app, probe) = scene(TissueSettings {
        detail: CutDetail::default(),
        collapse: None,
        ..checked()
    });
    let at = |y: f32| {
        Isometry3d::new(
            Vec3::new(0.0, y, 12.5),
            Quat::from_rotation_x(std::f32::consts::FRAC_PI_2),
        )
    };
    let tool = app.world_mut().spawn(loop_tool(at(4.0))).id();
    let point = Vec3::new(0.0, 0.0, 10.0);
    app.update();
    assert!(distance(&mut app, probe, point).expect("two millimetres below the top") < -1.9);
    for step in 0..10 {
        let mut tool = app.world_mut().get_mut::<TissueTool>(tool).unwrap();
        tool.cutting = true;
        tool.pose = at(4.0 - 0.8 * step as f32);
        app.update();
    }
    // The floor is 4.5 mm below the loop's open side.
    let told = distance(&mut app, probe, point).expect("the floor is within 3 mm");
    assert!((told - 2.0).abs() < 0.3, "{told}");
}

/// A kept probe is told from where it was before, a new one from all of the surface.
#[test]
fn a_probe_that_is_kept_is_told_what_one_asked_anew_is() {
    for detail in [CutDetail::Elements, CutDetail::default()] {
        let (mut app, _) = scene(TissueSettings { detail, ..checked() });
        let at = |y: f32, depth: f32| {
            Isometry3d::new(
                Vec3::new(0.0, y, 12.5 - depth),
                Quat::from_rotation_x(std::f32::consts::FRAC_PI_2),
            )
        };
        let tool = app.world_mut().spawn(loop_tool(at(6.0, 0.0))).id();
        // Some lie still, from above the block to deep in it; the others wander through its top.
        let point = |n: usize, time: f32| {
            let place = Vec3::new(
                -2.0 + 0.5 * (n % 9) as f32,
                -3.0 + 0.7 * (n / 9) as f32,
                14.0 - 0.35 * n as f32,
            );
            match n % 2 {
                0 => place,
                _ => place + Vec3::new(0.3, 0.5, 2.5) * (time + n as f32).sin(),
            }
        };
        const PROBES: usize = 36;
        let kept: Vec<Entity> = (0..PROBES)
            .map(|_| app.world_mut().spawn(TissueProbe::default()).id())
            .collect();
        let (mut changed, mut inside_before) = (0, [false; PROBES]);
        for step in 0..60 {
            let (stroke, along) = (step / 20, (step % 20) as f32);
            let mut loop_tool = app.world_mut().get_mut::<TissueTool>(tool).unwrap();
            loop_tool.cutting = along > 0.0;
            loop_tool.pose = at(6.0 - 0.8 * along, 2.0 * stroke as f32);
            if along == 0.0 {
                loop_tool.previous = None;
            }
            let anew: Vec<Entity> = (0..PROBES)
                .map(|n| {
                    let point = point(n, 0.1 * step as f32);
                    app.world_mut().get_mut::<TissueProbe>(kept[n]).unwrap().point = point;
                    app.world_mut().spawn(TissueProbe { point, ..default() }).id()
                })
                .collect();
            app.update();
            for (n, &anew) in anew.iter().enumerate() {
                let told = |probe| *app.world().get::<TissueProbe>(probe).unwrap();
                assert_eq!(told(kept[n]), told(anew), "probe {n} in step {step}");
                changed += usize::from(told(anew).inside != inside_before[n]);
                inside_before[n] = told(anew).inside;
            }
            anew.into_iter().for_each(|probe| {
                app.world_mut().despawn(probe);
            });
        }
        assert!(
            changed > 2 * PROBES,
            "{changed} changes of side are too few to tell anything"
        );
    }
}
