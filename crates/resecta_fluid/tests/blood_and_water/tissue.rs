//! A block that is cut where a vessel is: it opens, bleeds, is coagulated, closes.

use bevy::{prelude::*, time::TimeUpdateStrategy};
use resecta_fluid::{ClosedBy, prelude::*};
use resecta_solver::{Material, TissueMesh};
use resecta_tissue::{
    CutDetail, Kerf, LoopCutter, Tissue, TissuePlugin, TissueResected, TissueSettings, TissueTool, ToolPart,
    ToolPartKind,
};

use crate::scenes::{assert_near, block, messages, step, vessel};

/// A loop that hangs along -z of the world and moves along -y, with its open side at `z_mm`.
fn pose(y_mm: f32, z_mm: f32) -> Isometry3d {
    Isometry3d::new(
        Vec3::new(10.0, y_mm, z_mm),
        Quat::from_rotation_x(std::f32::consts::FRAC_PI_2),
    )
}

fn loop_tool(pose: Isometry3d) -> TissueTool {
    let point = |n: u32| {
        let (sin, cos) = (std::f32::consts::PI * n as f32 / 8.0).sin_cos();
        Vec3::new(3.25 * cos, -4.5 * sin, 0.0)
    };
    let part = |n| ToolPart {
        a: point(n),
        b: point(n + 1),
        radius_mm: 0.2,
        kind: ToolPartKind::Loop,
    };
    TissueTool::new((0..8).map(part).collect(), pose).with_cutter(LoopCutter {
        width_mm: 6.5,
        depth_mm: 4.5,
        kerf: Kerf::default(),
        centre: Vec3::ZERO,
        travel: Vec3::Z,
        down: Vec3::NEG_Y,
    })
}

/// A block of 20 mm that is held everywhere but at its top.
fn held_block() -> resecta_solver::Tissue {
    let free = block(10);
    let is_held = |place: Vec3| place.z == 0.0 || [place.x, place.y].iter().any(|&at| at == 0.0 || at == 20.0);
    let nodes = 0..free.node_count() as u32;
    let positions = nodes.clone().map(|node| free.rest_position(node).as_dvec3()).collect();
    let pentahedra = (0..free.pentahedron_count() as u32).map(|index| free.pentahedron_nodes(index));
    let mut mesh = TissueMesh::from_pentahedra(positions, pentahedra.collect());
    mesh.capsule = nodes.filter(|&node| is_held(free.rest_position(node))).collect();
    let material = Material {
        support_pa_per_mm: 50_000.0,
        ..Material::default()
    };
    resecta_solver::Tissue::new(&mesh, &material).expect("a block is a tissue")
}

/// The pentahedron whose centroid at rest is nearest to a place.
fn pentahedron_at(tissue: &resecta_solver::Tissue, place: Vec3) -> u32 {
    let distance = |&index: &u32| tissue.rest_centroid(index).distance(place);
    let nearest = tissue.living_pentahedron_indices();
    nearest
        .min_by(|a, b| distance(a).total_cmp(&distance(b)))
        .expect("a pentahedron")
}

struct Operation {
    app: App,
    tissue: Entity,
    tool: Entity,
}

impl Operation {
    /// Vessels in the way of the loop (0) and deep below it (1).
    fn new(detail: CutDetail) -> Operation {
        let mut app = App::new();
        app.add_plugins((MinimalPlugins, TissuePlugin::default(), FluidPlugins::default()))
            .insert_resource(Time::<Fixed>::from_hz(60.0))
            .insert_resource(TimeUpdateStrategy::FixedTimesteps(1))
            .init_resource::<Bladder>()
            .init_resource::<Irrigation>()
            .init_resource::<Circulation>()
            .init_resource::<Turbidity>();
        app.update();
        let solver = held_block();
        let of = [Vec3::new(10.0, 10.0, 18.5), Vec3::new(10.0, 10.0, 5.0)]
            .map(|place| vessel(&solver, pentahedron_at(&solver, place), VesselKind::Arterial, 0.1));
        let vessels = Vessels::new(of.to_vec()).expect("good vessels");
        let settings = TissueSettings {
            detail,
            collapse: None,
            ..default()
        };
        let tissue = app.world_mut().spawn((Tissue::new(solver), settings, vessels)).id();
        let tool = app.world_mut().spawn(loop_tool(pose(24.0, 20.5))).id();
        Operation { app, tissue, tool }
    }

    fn tool(&mut self) -> Mut<'_, TissueTool> {
        self.app.world_mut().get_mut::<TissueTool>(self.tool).expect("the tool")
    }

    fn vessels(&self) -> &Vessels {
        self.app.world().get::<Vessels>(self.tissue).expect("the vessels")
    }

    /// Draws the cutting loop through the top of the block at 50 mm/s and away. What was told, with the number of the step.
    fn cut(&mut self) -> Vec<(u32, VesselOpened)> {
        self.cut_at(20.5)
    }

    /// The same with the loop's top at a height, mm.
    fn cut_at(&mut self, z: f32) -> Vec<(u32, VesselOpened)> {
        let mut told = Vec::new();
        self.tool().cutting = true;
        for step in 0..40u32 {
            self.tool().pose = pose(24.0 - 50.0 / 60.0 * step as f32, z);
            self.app.update();
            told.extend(messages(&self.app).into_iter().map(|opened| (step, opened)));
        }
        let mut tool = self.tool();
        tool.cutting = false;
        tool.pose = pose(-10.0, 40.0);
        tool.previous = None;
        self.app.update();
        told
    }
}

#[test]
fn a_cut_opens_the_vessel_in_its_way_and_a_current_closes_it() {
    for detail in [CutDetail::Field { spacing_mm: 0.5 }, CutDetail::Elements] {
        let mut operation = Operation::new(detail);
        let opened = operation.cut();
        assert!(
            matches!(opened[..], [(_, VesselOpened { vessel: 0, .. })]),
            "{detail:?}: {opened:?}"
        );
        let states: Vec<VesselState> = operation.vessels().iter().map(|(_, state)| state).collect();
        assert_eq!(states, [VesselState::Open, VesselState::Intact]);

        // It bleeds at its rate from the step that opened it on.
        let steps = 41 - opened[0].0;
        let lost_ml = operation.vessels().lost_by_ml(0);
        assert!(
            (0.3..1.7).contains(&(lost_ml / (0.1 * f64::from(steps) / 60.0))),
            "{lost_ml}"
        );
        for _ in 0..600 {
            operation.app.update();
        }
        let more_ml = operation.vessels().lost_by_ml(0) - lost_ml;
        assert!((0.95..1.05).contains(&(more_ml / 1.0)), "{more_ml} ml in 10 s");
        let world = operation.app.world();
        assert_near(
            world.resource::<Bladder>().totals().blood_ml,
            operation.vessels().lost_by_ml(0),
            1e-12,
        );
        assert!(world.resource::<Turbidity>().concentration() > 0.0);

        // It is at the bottom of the groove, and what it spouts goes up and out of it.
        let jet = operation.vessels().open().next().expect("it is open");
        assert!(jet.place.distance(Vec3::new(10.0, 10.0, 17.0)) < 3.0, "{}", jet.place);
        assert!(jet.direction.z > 0.8, "{}", jet.direction);

        // The loop rests on it under coagulating current.
        let place = jet.place;
        println!("{detail:?}: {place} along {}", jet.direction);
        let mut tool = operation.tool();
        // A little deeper than it cut.
        tool.pose = pose(place.y, 20.0);
        tool.coagulating = true;
        let mut steps = 0;
        let mut closed: Vec<VesselClosed> = Vec::new();
        while closed.is_empty() && steps < 120 {
            operation.app.update();
            closed = messages(&operation.app);
            steps += 1;
        }
        assert_eq!(closed.len(), 1, "{detail:?}");
        assert_eq!(
            (closed[0].vessel, closed[0].by),
            (0, ClosedBy::Coagulation(operation.tool))
        );
        assert!(
            (30..60).contains(&steps),
            "{detail:?}: half a second takes {steps} steps"
        );
        println!(
            "{detail:?}: opened in step {}, closed after {steps} steps of current, {} ml",
            opened[0].0, closed[0].lost_ml
        );
        let lost_ml = operation.vessels().lost_by_ml(0);
        operation.app.update();
        assert_eq!(operation.vessels().lost_by_ml(0), lost_ml);
        assert_eq!(operation.vessels().state(0), Some(VesselState::Coagulated));
    }
}

#[test]
fn a_touch_that_is_too_short_or_without_current_closes_nothing() {
    let mut operation = Operation::new(CutDetail::Field { spacing_mm: 0.5 });
    operation.cut();
    let place = operation.vessels().open().next().expect("it is open").place;
    for (coagulating, steps) in [(false, 60), (true, 20), (false, 5), (true, 20)] {
        let mut tool = operation.tool();
        // A little deeper than it cut.
        tool.pose = pose(place.y, 20.0);
        tool.coagulating = coagulating;
        for _ in 0..steps {
            operation.app.update();
        }
    }
    assert_eq!(operation.vessels().state(0), Some(VesselState::Open));
}

/// How far a place is from the nearest vertex of a tissue's surface, mm.
fn off_surface_mm(app: &App, tissue: Entity, place: Vec3) -> f32 {
    let (vertices, triangles) = app.world().get::<Tissue>(tissue).unwrap().surface();
    let used = triangles.into_iter().flatten().map(|vertex| vertices[vertex as usize]);
    used.map(|vertex| vertex.distance(place)).fold(f32::INFINITY, f32::min)
}

#[test]
fn a_vessel_bleeds_from_the_surface_that_the_cut_left() {
    for detail in [CutDetail::Field { spacing_mm: 0.5 }, CutDetail::Elements] {
        let mut operation = Operation::new(detail);
        // The second stroke lowers the floor on which it bled after the first.
        for (stroke, z) in [20.5, 19.5].into_iter().enumerate() {
            operation.cut_at(z);
            let jet = operation.vessels().open().next().expect("it is open");
            let off_mm = off_surface_mm(&operation.app, operation.tissue, jet.place);
            assert!(
                off_mm < 1e-4,
                "{detail:?}, stroke {stroke}: {off_mm} mm off the surface"
            );
            let moved_mm = jet.place.distance(jet.vessel.place);
            assert!(
                moved_mm < 5.0,
                "{detail:?}, stroke {stroke}: {moved_mm} mm from where it was"
            );
        }
    }
}

#[test]
fn a_tear_bleeds_where_it_tore_whatever_was_cut_elsewhere() {
    let mut operation = Operation::new(CutDetail::Field { spacing_mm: 0.5 });
    operation.cut();
    let place = Vec3::new(2.0, 4.0, 20.0);
    let world = operation.app.world_mut();
    let solver = world.get::<Tissue>(operation.tissue).unwrap().solver();
    let torn = Vessel {
        place,
        ..vessel(solver, pentahedron_at(solver, place), VesselKind::Venous, 0.1)
    };
    let mut vessels = world.get_mut::<Vessels>(operation.tissue).unwrap();
    vessels.tear(torn).unwrap();
    operation.app.update();
    let jet = operation.vessels().open().find(|jet| jet.vessel.place == place);
    let off_mm = jet.expect("it is open").place.distance(place);
    assert!(off_mm < 1.0, "{off_mm} mm from the tear");
}

#[test]
fn a_vessel_goes_with_the_tissue() {
    // One whose pentahedron is gone, and one off the middle of a pentahedron of which a quarter is left.
    for left in [0.0, 0.25] {
        let mut app = crate::scenes::app();
        let mut tissue = block(4);
        let mut of = vessel(&tissue, 40, VesselKind::Arterial, 0.1);
        of.place += Vec3::new(0.2, -0.1, 0.3);
        of.direction = Vec3::new(0.6, 0.0, 0.8);
        let told = tissue.thin(&[(40, left)], None);
        let entity = app
            .world_mut()
            .spawn((Tissue::new(tissue), Vessels::new(vec![of]).unwrap()))
            .id();
        app.world_mut().write_message(TissueResected {
            tissue: entity,
            tool: None,
            pentahedra: told.pentahedra,
            taken_mm3: told.taken_mm3,
            volume_mm3: told.rest_volume_mm3,
            by_zone_mm3: told.by_zone_mm3,
            capsule_area_mm2: 0.0,
        });
        step(&mut app, 1000);
        let jet = |app: &App| {
            let vessels = app.world().get::<Vessels>(entity).unwrap();
            vessels
                .open()
                .map(|jet| (jet.place, jet.direction))
                .next()
                .expect("it is open")
        };
        let (place, direction) = jet(&app);
        assert!(direction.distance(of.direction) < 1e-5);
        let off_mm = off_surface_mm(&app, entity, place);
        assert!(off_mm < 1e-4, "{off_mm} mm off the surface");
        // Turned, stretched along x before, and shifted.
        let turn = Quat::from_rotation_z(1.0) * Quat::from_rotation_x(0.7);
        let moved = |place: Vec3| turn * (place * Vec3::new(1.5, 1.0, 1.0)) + Vec3::new(3.0, -2.0, 10.0);
        let mut tissue = app.world_mut().get_mut::<Tissue>(entity).unwrap();
        let solver = tissue.solver_mut();
        for node in 0..solver.node_count() as u32 {
            if solver.is_node_alive(node) {
                solver.set_position(node, moved(solver.position(node))).unwrap();
            }
        }
        step(&mut app, 1000);
        let (now, directed) = jet(&app);
        assert!(now.distance(moved(place)) < 1e-4, "{now} {}", moved(place));
        let expected = (turn * (direction * Vec3::new(1.5, 1.0, 1.0))).normalize();
        assert!(directed.distance(expected) < 1e-5, "{directed} {expected}");
    }
}
