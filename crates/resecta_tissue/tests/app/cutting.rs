//! Loops cut, and what they remove is all that the tissue loses.

use bevy::prelude::*;
use resecta_tissue::{CuttingRule, prelude::*};

use crate::scenes::{app, checked, loop_tool, messages, small_block};

/// A loop drawn through the top of a block at 50 mm/s, with the current on: entity and all messages.
fn cut(settings: TissueSettings, current: bool) -> (App, Entity, Entity, Vec<TissueResected>) {
    let mut app = app();
    let tissue = app.world_mut().spawn((Tissue::new(small_block()), settings)).id();
    let turned = Quat::from_rotation_x(std::f32::consts::FRAC_PI_2);
    // Hangs along -z, moves along -y.
    let pose = |y: f32| Isometry3d::new(Vec3::new(0.1, y, 12.5), turned);
    let mut tool = loop_tool(pose(12.0));
    tool.cutting = current;
    let tool = app.world_mut().spawn(tool).id();
    let mut told = Vec::new();
    for step in 0..40 {
        app.world_mut().get_mut::<TissueTool>(tool).unwrap().pose = pose(12.0 - 50.0 / 60.0 * step as f32);
        app.update();
        told.extend(messages::<TissueResected>(&app));
    }
    (app, tissue, tool, told)
}

#[test]
fn a_loop_with_current_removes_what_the_messages_say() {
    for cutting in [CuttingRule::Sweep, CuttingRule::Sphere { radius_mm: 3.0 }] {
        let (mut app, tissue, tool, told) = cut(TissueSettings { cutting, ..checked() }, true);
        assert!(!told.is_empty(), "{cutting:?}");
        let initial = small_block().initial_volume_mm3();
        let removed: f64 = told.iter().map(|resected| resected.volume_mm3).sum();
        let solver = app.world().get::<Tissue>(tissue).unwrap().solver();
        let left: f64 = solver
            .living_pentahedron_indices()
            .map(|pentahedron| solver.rest_volume_mm3(pentahedron))
            .sum();
        assert!(
            (left + removed - initial).abs() < 1e-9 * initial,
            "{left} + {removed} against {initial}"
        );
        assert_eq!(removed, solver.removed_volume_mm3());
        let count = solver.living_pentahedra();
        let (nodes, springs) = (solver.living_nodes(), solver.living_springs());
        for resected in &told {
            assert_eq!((resected.tissue, resected.tool), (tissue, Some(tool)));
            assert!((resected.by_zone_mm3.iter().sum::<f64>() - resected.volume_mm3).abs() < 1e-9);
            assert!(resected.pentahedra.is_sorted());
        }
        let world = app.world_mut();
        assert_eq!(world.query::<&Pentahedron>().iter(world).count(), count);
        assert_eq!(world.query::<&Spring>().iter(world).count(), springs);
        assert_eq!(world.query::<&TissueNode>().iter(world).count(), nodes);
    }
}

#[test]
fn a_pull_takes_the_chip_that_the_loop_sweeps() {
    // The block's top is a little below the open side: the chip is the block's part of the half ellipse, 20 mm long.
    let (.., told) = cut(
        TissueSettings {
            collapse: None,
            ..checked()
        },
        true,
    );
    let removed: f64 = told.iter().map(|resected| resected.volume_mm3).sum();
    let (width, depth, above) = (6.5f64, 4.5f64, 0.5f64);
    let steps = 1000;
    let section: f64 = (0..steps)
        .map(|n| {
            let at = above + (depth - above) * (f64::from(n) + 0.5) / f64::from(steps);
            width * (1.0 - (at / depth).powi(2)).sqrt() * (depth - above) / f64::from(steps)
        })
        .sum();
    let exact = section * 20.0;
    // Whole pentahedra of 4 mm³ leave: the chip is right to about one layer of them.
    assert!((removed / exact - 1.0).abs() < 0.3, "{removed} against {exact} mm³");
}

#[test]
fn without_current_nothing_is_cut() {
    let (app, tissue, _, told) = cut(checked(), false);
    assert!(told.is_empty());
    let solver = app.world().get::<Tissue>(tissue).unwrap().solver();
    assert_eq!(solver.living_pentahedra(), solver.pentahedron_count());
}

#[test]
fn a_cut_weakens_what_is_left_and_the_components_say_so() {
    let (mut app, tissue, ..) = cut(checked(), true);
    let world = app.world_mut();
    let mut nodes = world.query::<&TissueNode>();
    let mut springs = world.query::<&Spring>();
    let solver = world.get::<Tissue>(tissue).unwrap().solver();
    for node in nodes.iter(world) {
        assert_eq!(node.mass_g, solver.mass_g(node.index));
        assert_eq!(node.position, solver.position(node.index));
    }
    for spring in springs.iter(world) {
        assert_eq!(spring.stiffness_mn_per_m, solver.spring(spring.index).stiffness);
    }
}

/// Draws the last corner of a block 20 mm away and makes a step.
fn draw_out(app: &mut App, tissue: Entity) -> Vec<TissueResected> {
    let mut tissue = app.world_mut().get_mut::<Tissue>(tissue).unwrap();
    let solver = tissue.solver_mut();
    let corner = solver.node_count() as u32 - 1;
    let place = solver.rest_position(corner) + Vec3::Z * 20.0;
    solver.set_position(corner, place).expect("a finite place");
    app.update();
    messages(app)
}

#[test]
fn what_is_drawn_out_tears_off_where_something_was_cut_and_nowhere_else() {
    let mut app = app();
    let whole = app.world_mut().spawn((Tissue::new(small_block()), checked())).id();
    app.update();
    assert_eq!(draw_out(&mut app, whole), []);

    let (mut app, tissue, ..) = cut(checked(), true);
    let [torn] = &draw_out(&mut app, tissue)[..] else {
        panic!("one message");
    };
    assert_eq!((torn.tissue, torn.tool), (tissue, None));
    let solver = app.world().get::<Tissue>(tissue).unwrap().solver();
    assert!(!torn.pentahedra.is_empty() && solver.drawn_out_pentahedra(3.0).is_empty());
}
