//! Probes tell how far a point is from the surface, and on which side.

use bevy::prelude::*;
use resecta_tissue::{TissueProbe, prelude::*};

use crate::scenes::{app, block, checked, loop_tool, small_block};

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

#[test]
fn a_probe_that_drifts_is_told_what_one_that_comes_anew_is() {
    let (mut app, drifting) = scene(TissueSettings {
        detail: CutDetail::default(),
        collapse: None,
        ..checked()
    });
    let across = Quat::from_rotation_x(std::f32::consts::FRAC_PI_2);
    let at = |x: f32, y: f32| Isometry3d::new(Vec3::new(x, y, 12.5), across);
    let tool = app.world_mut().spawn(loop_tool(at(0.0, 4.0))).id();
    let thrown = app.world_mut().spawn(TissueProbe::default()).id();
    let (mut inside, mut passed) = ([false; 2], [0; 2]);
    for step in 0..240u32 {
        let time = step as f32 / 60.0;
        let mut tool = app.world_mut().get_mut::<TissueTool>(tool).unwrap();
        // To and fro with current, each time beside the last.
        tool.cutting = true;
        tool.pose = at(-3.0 + 1.5 * time, 5.0 * (4.0 * time).cos());
        // Down into the trenches and into what is between them, at up to 40 mm/s; and thrown up and down through the top, at up to 150.
        let [x, y] = [2.0 * (3.1 * time).sin(), 3.0 * (2.3 * time).cos()];
        let heights = [10.5 + 2.5 * (7.0 * time).sin(), 13.0 + 6.0 * (25.0 * time).sin()];
        for (n, probe) in [drifting, thrown].into_iter().enumerate() {
            let point = Vec3::new(x, y, heights[n]);
            app.world_mut().get_mut::<TissueProbe>(probe).unwrap().point = point;
        }
        let probes = [drifting, thrown].map(|probe| {
            let point = app.world().get::<TissueProbe>(probe).unwrap().point;
            (probe, app.world_mut().spawn(TissueProbe { point, ..default() }).id())
        });
        app.update();
        for (n, (probe, fresh)) in probes.into_iter().enumerate() {
            let [told, anew] = [probe, fresh].map(|probe| *app.world().get::<TissueProbe>(probe).unwrap());
            assert_eq!(told.inside, anew.inside, "step {step}, probe {n} at {}", told.point);
            assert_eq!(told.distance_mm, anew.distance_mm);
            app.world_mut().despawn(fresh);
            passed[n] += u32::from(inside[n] != told.inside);
            inside[n] = told.inside;
        }
    }
    assert!(
        passed.into_iter().all(|passed| passed > 5),
        "{passed:?} times through the surface"
    );
}

#[test]
fn a_probe_that_stays_is_told_of_a_tissue_that_comes() {
    let (mut app, probe) = scene(checked());
    let far = Vec3::new(100.0, 0.0, 6.0);
    for _ in 0..3 {
        assert_eq!(ask(&mut app, probe, far), (None, false));
    }
    let block = block([10, 10, 6], 2.0, Vec3::new(90.0, -10.0, 0.0), |place| place.z == 0.0);
    app.world_mut().spawn((Tissue::new(block), checked()));
    assert_eq!(ask(&mut app, probe, far), (None, true));
}
