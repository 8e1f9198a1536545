//! Cuts finer than the elements.

use bevy::prelude::*;
use resecta_tissue::{CuttingRule, PutAsideReason, prelude::*};

use crate::{
    mesh::{assert_closed, mesh, volume},
    scenes::{app, checked, loop_tool, messages, small_block},
};

fn settings() -> TissueSettings {
    TissueSettings {
        detail: CutDetail::Field { spacing_mm: 0.5 },
        collapse: None,
        ..checked()
    }
}

/// What a stroke left behind, and all that was told.
struct Theatre {
    app: App,
    tissue: Entity,
    tool: Entity,
    resected: Vec<TissueResected>,
    chips: Vec<TissueChip>,
}

impl Theatre {
    /// A block and a loop above it that hangs along -z.
    fn new(settings: TissueSettings) -> Self {
        let mut app = app();
        app.init_resource::<Assets<Mesh>>();
        let tissue = app.world_mut().spawn((Tissue::new(small_block()), settings)).id();
        let tool = app.world_mut().spawn(loop_tool(pose(12.0))).id();
        app.update();
        Self {
            app,
            tissue,
            tool,
            resected: Vec::new(),
            chips: Vec::new(),
        }
    }

    /// Draws the loop along the block at 50 mm/s with the current on, and away.
    fn stroke(&mut self) {
        for step in 0..40 {
            let mut tool = self.app.world_mut().get_mut::<TissueTool>(self.tool).unwrap();
            tool.cutting = true;
            tool.pose = pose(12.0 - 50.0 / 60.0 * step as f32);
            self.step();
        }
    }

    fn step(&mut self) {
        self.app.update();
        self.resected.extend(messages::<TissueResected>(&self.app));
        self.chips.extend(messages::<TissueChip>(&self.app));
    }

    fn solver(&self) -> &resecta_solver::Tissue {
        self.app.world().get::<Tissue>(self.tissue).unwrap().solver()
    }

    fn removed(&self) -> f64 {
        self.resected.iter().map(|resected| resected.volume_mm3).sum()
    }
}

/// The loop over the block, half a millimetre above its top.
fn pose(y: f32) -> Isometry3d {
    Isometry3d::new(
        Vec3::new(0.1, y, 12.5),
        Quat::from_rotation_x(std::f32::consts::FRAC_PI_2),
    )
}

#[test]
fn a_stroke_takes_what_the_loop_sweeps_to_one_in_a_hundred() {
    let mut theatre = Theatre::new(settings());
    theatre.stroke();
    let (width, depth, above) = (6.5f64, 4.5f64, 0.5f64);
    let steps = 1000;
    let section: f64 = (0..steps)
        .map(|n| {
            let at = above + (depth - above) * (f64::from(n) + 0.5) / f64::from(steps);
            width * (1.0 - (at / depth).powi(2)).sqrt() * (depth - above) / f64::from(steps)
        })
        .sum();
    let exact = section * 20.0;
    let removed = theatre.removed();
    // The wire presses on the block before it is drawn through it, so that the tissue is not quite at rest.
    assert!((removed / exact - 1.0).abs() < 0.015, "{removed} against {exact} mm³");
}

#[test]
fn a_chip_is_told_though_its_tool_is_gone() {
    let mut theatre = Theatre::new(settings());
    for y in [12.0, 11.2, 10.4, 9.6, 8.8, 8.0] {
        let mut tool = theatre.app.world_mut().get_mut::<TissueTool>(theatre.tool).unwrap();
        tool.cutting = true;
        tool.pose = pose(y);
        theatre.step();
    }
    assert!(
        theatre.removed() > 0.0 && theatre.chips.is_empty(),
        "the stroke goes on"
    );
    theatre.app.world_mut().despawn(theatre.tool);
    theatre.step();
    theatre.step();
    let [chip] = &theatre.chips[..] else {
        panic!("{} chips", theatre.chips.len())
    };
    assert_eq!(chip.tool, Some(theatre.tool));
}

#[test]
fn what_messages_chips_and_the_tissue_say_is_the_same_volume() {
    let mut theatre = Theatre::new(settings());
    theatre.stroke();
    theatre
        .app
        .world_mut()
        .get_mut::<TissueTool>(theatre.tool)
        .unwrap()
        .cutting = false;
    theatre.step();
    theatre.step();
    let (removed, initial) = (theatre.removed(), small_block().initial_volume_mm3());
    let solver = theatre.solver();
    assert_eq!(removed, solver.removed_volume_mm3());
    let held = |index: u32| solver.rest_volume_mm3(index) * solver.fill(index);
    let left: f64 = solver.living_pentahedron_indices().map(held).sum();
    assert!((left + removed - initial).abs() < 1e-9 * initial);
    for resected in &theatre.resected {
        let taken: f64 = resected.taken_mm3.iter().map(|(_, volume)| volume).sum();
        assert!((taken - resected.volume_mm3).abs() < 1e-9);
        assert!((resected.by_zone_mm3.iter().sum::<f64>() - resected.volume_mm3).abs() < 1e-9);
        assert!(resected.taken_mm3.is_sorted_by_key(|(index, _)| *index));
    }
    // One stroke, one chip.
    let [told] = &theatre.chips[..] else {
        panic!("{} chips", theatre.chips.len());
    };
    assert_eq!((told.tissue, told.tool), (theatre.tissue, Some(theatre.tool)));
    assert!((told.chip.rest_volume_mm3 - removed).abs() < 1e-6 * removed);
    assert!(!told.chip.triangles.is_empty());
    let tissue = theatre.app.world().get::<Tissue>(theatre.tissue).unwrap();
    assert_eq!(tissue.chips_to_come(), 0);
}

#[test]
fn the_mesh_is_the_closed_fine_surface() {
    let mut theatre = Theatre::new(settings());
    theatre.stroke();
    let mesh = mesh(&theatre.app, theatre.tissue);
    assert_closed(mesh);
    let off = volume(mesh) / theatre.solver().volume_mm3() - 1.0;
    assert!(off.abs() < 3e-3, "{off}");
}

#[test]
fn a_tool_in_a_trench_touches_its_fine_floor() {
    let mut theatre = Theatre::new(settings());
    theatre.stroke();
    theatre.app.world_mut().despawn(theatre.tool);
    for _ in 0..30 {
        theatre.step();
    }
    // A ball of 2 mm radius that would reach 0.3 mm below the trench's floor, at 12.5 - 4.5 mm.
    let ball = ToolPart {
        a: Vec3::ZERO,
        b: Vec3::ZERO,
        radius_mm: 2.0,
        kind: ToolPartKind::Sheath,
    };
    let at = Vec3::new(0.1, 0.0, 9.7);
    let tool = TissueTool::new(vec![ball], Isometry3d::from_translation(at));
    theatre.app.world_mut().spawn(tool);
    theatre.step();
    let contacts: Vec<TissueContact> = messages(&theatre.app);
    let lowest = contacts.iter().min_by(|a, b| a.point.z.total_cmp(&b.point.z));
    let lowest = lowest.expect("the ball touches the floor");
    assert!((lowest.point.z - 7.7).abs() < 0.2, "touched at {}", lowest.point);
    for _ in 0..30 {
        theatre.step();
    }
    // It gives way: no contact reaches deep any more, and the floor presses back.
    let contacts: Vec<TissueContact> = messages(&theatre.app);
    let deepest = contacts.iter().map(|contact| contact.depth_mm).fold(0.0, f32::max);
    let force_n: f32 = contacts.iter().map(|contact| contact.force_n).sum();
    assert!(deepest < 0.12, "{deepest} mm");
    // Hertz's ball on a plane of the block's modulus: 1.5 mN for 0.3 mm. The floor is no plane.
    assert!((0.0007..0.003).contains(&force_n), "{force_n} N");
}

#[test]
fn the_rule_of_the_papers_takes_a_ball() {
    let mut theatre = Theatre::new(TissueSettings {
        cutting: CuttingRule::Sphere { radius_mm: 3.0 },
        ..settings()
    });
    let mut tool = theatre.app.world_mut().get_mut::<TissueTool>(theatre.tool).unwrap();
    // Put there at once: the loop's deepest point is at the top of the block, above a node.
    tool.previous = None;
    tool.pose = Isometry3d::new(
        Vec3::new(0.1, 0.1, 16.4),
        Quat::from_rotation_x(std::f32::consts::FRAC_PI_2),
    );
    tool.cutting = true;
    theatre.step();
    let half_ball = 2.0 / 3.0 * std::f64::consts::PI * 27.0;
    let off = theatre.removed() / half_ball - 1.0;
    assert!(off.abs() < 0.03, "{off}");
}

#[test]
fn a_spacing_that_cannot_be_is_told_once_and_whole_elements_are_cut() {
    let mut theatre = Theatre::new(TissueSettings {
        detail: CutDetail::Field { spacing_mm: f32::NAN },
        ..settings()
    });
    let refused = |theatre: &Theatre| {
        let told = messages::<TissuePutAside>(&theatre.app);
        told.iter()
            .filter(|told| matches!(told.reason, PutAsideReason::Field(_)))
            .count()
    };
    assert_eq!(refused(&theatre), 1);
    theatre.step();
    assert_eq!(refused(&theatre), 0);
    theatre.stroke();
    assert!(theatre.removed() > 100.0);
    assert!(theatre.chips.is_empty());
    let solver = theatre.solver();
    assert!(
        solver
            .living_pentahedron_indices()
            .all(|index| solver.fill(index) == 1.0)
    );
}

#[test]
fn a_hole_in_the_capsule_is_told_by_its_area() {
    // The block stands on its capsule; a loop is put through its bottom.
    let mut theatre = Theatre::new(settings());
    let through = |y: f32| {
        Isometry3d::new(
            Vec3::new(0.1, y, 3.0),
            Quat::from_rotation_x(std::f32::consts::FRAC_PI_2),
        )
    };
    for step in 0..12 {
        let mut tool = theatre.app.world_mut().get_mut::<TissueTool>(theatre.tool).unwrap();
        if step == 0 {
            tool.previous = None;
        }
        tool.cutting = true;
        tool.pose = through(4.0 - 50.0 / 60.0 * step as f32);
        theatre.step();
    }
    let told: f64 = theatre.resected.iter().map(|resected| resected.capsule_area_mm2).sum();
    // The loop's width 3 mm below its open side, over the way that it went.
    let width = 6.5 * (1.0f64 - (3.0f64 / 4.5).powi(2)).sqrt();
    let exact = width * 11.0 * 50.0 / 60.0;
    assert!((told / exact - 1.0).abs() < 0.03, "{told} against {exact} mm²");
}

#[test]
fn coagulating_marks_what_the_loop_touches_and_takes_nothing() {
    let mut theatre = Theatre::new(settings());
    let mut tool = theatre.app.world_mut().get_mut::<TissueTool>(theatre.tool).unwrap();
    tool.previous = None;
    // The loop's deepest point lies on the block's top.
    tool.pose = Isometry3d::new(
        Vec3::new(0.1, 0.1, 16.4),
        Quat::from_rotation_x(std::f32::consts::FRAC_PI_2),
    );
    tool.coagulating = true;
    for _ in 0..5 {
        theatre.step();
    }
    assert!(theatre.resected.is_empty());
    assert_eq!(theatre.solver().removed_volume_mm3(), 0.0);
    let tissue = theatre.app.world().get::<Tissue>(theatre.tissue).unwrap();
    let surface = tissue.field().expect("the scene has a loop").surface();
    let marked = (0u32..)
        .zip(surface.coagulation_mm())
        .filter(|(_, depth)| **depth > 0.0);
    let places = marked.map(|(vertex, _)| surface.rest_places()[vertex as usize]);
    let (mut count, touched) = (0, Vec3::new(0.1, 0.1, 12.0));
    for place in places {
        count += 1;
        // A wire touches what lies within 0.4 mm of its middle line: 1.6 mm to either side of its deepest point.
        assert!(place.distance(touched) < 3.4, "{place} is coagulated");
    }
    assert!(count > 3, "{count} vertices are coagulated");
    assert_closed(mesh(&theatre.app, theatre.tissue));
}

#[test]
fn a_despawned_pentahedron_goes_from_the_field_too() {
    let mut theatre = Theatre::new(settings());
    let entity = theatre
        .app
        .world()
        .get::<Tissue>(theatre.tissue)
        .unwrap()
        .pentahedron_entity(500);
    theatre.app.world_mut().despawn(entity.unwrap());
    theatre.step();
    assert!(!theatre.solver().is_pentahedron_alive(500));
    let whole = theatre.solver().rest_volume_mm3(500);
    let removed = theatre.removed();
    // Points that it shares with its neighbours go with it.
    assert!((1.0..1.6).contains(&(removed / whole)), "{removed} of {whole}");
    let mesh = mesh(&theatre.app, theatre.tissue);
    assert_closed(mesh);
    theatre.step();
    assert_eq!(theatre.chips.len(), 1);
}
