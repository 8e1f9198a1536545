//! Laws: what a cut removes and where its wall lies, against the exact solid.

mod common;

use common::{assert_sound, block, current};
use glam::{DVec2, DVec3, Vec3};
use resecta_field::{Field, LoopStroke, SurfaceKind, Tool};
use resecta_solver::LoopPose;

const WIDTH: f64 = 6.5;
const DEPTH: f64 = 4.5;
/// A stroke's length, mm: where faces meet in an edge it is rounded, so what is all edges loses more.
const LENGTH: f64 = 15.0;

/// An exact solid: how to cut it, its volume, and the distance of a point from its boundary.
struct Solid {
    name: &'static str,
    tools: Vec<Tool>,
    volume: f64,
    distance: Box<dyn Fn(DVec3) -> f64>,
}

/// Axes of a tool that lies askew: along, down, across.
fn askew() -> [DVec3; 3] {
    let along = DVec3::new(0.13, 0.18, 0.9).normalize();
    let down = DVec3::new(-0.3, 1.0, 0.1).reject_from_normalized(along).normalize();
    [along, down, along.cross(down)]
}

/// Distance from the boundary of a half ellipse moved straight over a length.
fn swept_distance(from: DVec3, length: f64, half: DVec2) -> impl Fn(DVec3) -> f64 {
    let outline: Vec<DVec2> = (0..=1500)
        .map(|n| DVec2::from_angle(std::f64::consts::PI * f64::from(n) / 1500.0) * half)
        .collect();
    move |point| {
        let local = DVec3::from(askew().map(|axis| axis.dot(point - from)));
        let flat = DVec2::new(local.z, local.y);
        let to_arc = outline
            .iter()
            .map(|corner| corner.distance(flat))
            .fold(f64::INFINITY, f64::min);
        let to_side = if flat.x.abs() < half.x {
            flat.y.abs()
        } else {
            f64::INFINITY
        };
        let inside = flat.y > 0.0 && (flat / half).length() < 1.0;
        let flat = if inside {
            -to_arc.min(to_side)
        } else {
            to_arc.min(to_side)
        };
        let ends = (-local.x).max(local.x - length);
        if flat > 0.0 && ends > 0.0 {
            flat.hypot(ends)
        } else {
            flat.max(ends).abs()
        }
    }
}

fn solids() -> Vec<Solid> {
    let centre = DVec3::new(7.13, 6.77, 9.31);
    let [along, down, _] = askew();
    let from = DVec3::new(5.6, 3.3, 2.9);
    let pose = |way: f64| LoopPose {
        centre: from + along * way,
        travel: along,
        down,
    };
    let steps = |count: i32| {
        let mut stroke = LoopStroke::new(pose(0.0), WIDTH, DEPTH);
        (1..=count)
            .map(|n| stroke.step_to(pose(LENGTH * f64::from(n) / f64::from(count))))
            .collect::<Vec<_>>()
    };
    let swept = std::f64::consts::PI * WIDTH * DEPTH / 4.0 * LENGTH;
    let loop_distance = || Box::new(swept_distance(from, LENGTH, DVec2::new(0.5 * WIDTH, DEPTH)));
    vec![
        Solid {
            name: "sphere",
            tools: vec![Tool::Sphere { centre, radius_mm: 4.0 }],
            volume: 4.0 / 3.0 * std::f64::consts::PI * 64.0,
            distance: Box::new(move |point| (point.distance(centre) - 4.0).abs()),
        },
        Solid {
            name: "half cylinder",
            tools: vec![Tool::HalfCylinder {
                from,
                to: from + along * LENGTH,
                down,
                radius_mm: 3.5,
            }],
            volume: std::f64::consts::PI * 3.5 * 3.5 / 2.0 * LENGTH,
            distance: Box::new(swept_distance(from, LENGTH, DVec2::splat(3.5))),
        },
        Solid {
            name: "loop, 1 step",
            tools: steps(1),
            volume: swept,
            distance: loop_distance(),
        },
        Solid {
            name: "loop, 7 steps",
            tools: steps(7),
            volume: swept,
            distance: loop_distance(),
        },
        Solid {
            name: "loop, 200 steps",
            tools: steps(200),
            volume: swept,
            distance: loop_distance(),
        },
    ]
}

struct Measured {
    /// Relative error of the volume, with what went as slivers left out.
    volume: f64,
    with_slivers: f64,
    removed: f64,
    mean: f64,
    largest: f64,
}

fn measure(solid: &Solid, spacing: f64, stretch: f64) -> Measured {
    let (rest, pentahedra) = block([7, 7, 11], 2.0);
    let mut field = Field::new(&rest, &pentahedra, spacing, |_, _| SurfaceKind::Other).expect("a block");
    let positions = current(&rest, |place| place * DVec3::new(stretch, 1.0, 1.0));
    let (mut removed, mut slivers) = (0.0, 0.0);
    for tool in &solid.tools {
        let cut = field.cut(tool, &positions).expect("a good tool");
        removed += cut.removed_mm3;
        slivers += cut.slivers_mm3;
    }
    assert_sound(&field, solid.name);
    let mut places: Vec<Vec3> = Vec::new();
    field
        .move_vertices(&positions, &mut places)
        .expect("as many positions as nodes");
    let surface = field.surface();
    let mut used: Vec<u32> = surface.triangles().flatten().collect();
    used.sort_unstable();
    used.dedup();
    let distances: Vec<f64> = (used.into_iter())
        .filter(|&vertex| surface.kinds()[vertex as usize] == SurfaceKind::Cut)
        .map(|vertex| (solid.distance)(places[vertex as usize].as_dvec3()))
        .collect();
    let exact = solid.volume / stretch;
    Measured {
        volume: (removed - slivers) / exact - 1.0,
        with_slivers: removed / exact - 1.0,
        removed,
        mean: distances.iter().sum::<f64>() / distances.len() as f64,
        largest: distances.iter().copied().fold(0.0, f64::max),
    }
}

#[test]
fn a_cut_removes_the_exact_solid_to_second_order() {
    println!("solid, stretch, spacing: volume error %, with slivers %, mean distance, largest distance (mm)");
    for stretch in [1.0, 1.2] {
        let mut one_step: Option<f64> = None;
        for solid in solids() {
            let rows = [1.0, 0.5, 0.25].map(|spacing| measure(&solid, spacing, stretch));
            for (row, spacing) in rows.iter().zip([1.0, 0.5, 0.25]) {
                println!(
                    "{:16} {stretch:.1} {spacing:4.2}: {:7.3} {:7.3} {:7.4} {:7.4}",
                    solid.name,
                    100.0 * row.volume,
                    100.0 * row.with_slivers,
                    row.mean,
                    row.largest
                );
            }
            let ratios = [rows[0].volume / rows[1].volume, rows[1].volume / rows[2].volume];
            println!("{:16} ratios {:.2} {:.2}", "", ratios[0], ratios[1]);
            assert!(rows[1].with_slivers.abs() < 0.01, "{}", solid.name);
            assert!(rows[1].mean < 0.1 && rows[1].largest < 0.5, "{}", solid.name);
            if solid.tools.len() == 1 {
                assert!(ratios.iter().all(|ratio| (3.0..5.0).contains(ratio)), "{}", solid.name);
            }
            // However it is divided, a stroke removes the same.
            match one_step {
                Some(removed) if solid.name.starts_with("loop") => {
                    assert!((rows[1].removed / removed - 1.0).abs() < 0.005, "{}", solid.name);
                }
                _ => one_step = (solid.name == "loop, 1 step").then_some(rows[1].removed),
            }
        }
    }
}

/// On an arc, tilting as it goes: what a loop on a pivoting instrument does.
#[test]
fn a_turning_stroke_removes_the_same_however_it_is_divided() {
    let (rest, pentahedra) = block([7, 7, 11], 2.0);
    let positions = current(&rest, |place| place);
    let pose = |share: f64| {
        let (sin, cos) = (0.75 * share).sin_cos();
        LoopPose {
            centre: DVec3::new(7.2, 23.1 - 20.0 * cos, 3.3 + 20.0 * sin),
            travel: DVec3::new(0.0, sin, cos),
            down: DVec3::new(0.3 * share, cos, -sin),
        }
    };
    let removed = [8, 20, 90, 600].map(|steps: i32| {
        let mut field = Field::new(&rest, &pentahedra, 0.5, |_, _| SurfaceKind::Other).expect("a block");
        let mut stroke = LoopStroke::new(pose(0.0), WIDTH, DEPTH);
        for n in 1..=steps {
            let tool = stroke.step_to(pose(f64::from(n) / f64::from(steps)));
            field.cut(&tool, &positions).expect("a good tool");
        }
        assert_sound(&field, "turning");
        field.removed_mm3()
    });
    // The deeper side of an arc is longer or shorter than its middle by the share of the half ellipse's centroid.
    let exact = std::f64::consts::PI * WIDTH * DEPTH / 4.0 * 0.75 * (20.0 - 4.0 * DEPTH / (3.0 * std::f64::consts::PI));
    println!("a turning stroke in 8, 20, 90, 600 steps: {removed:.3?} mm³, exact {exact:.3}");
    for volume in removed {
        assert!((volume / exact - 1.0).abs() < 0.01, "{removed:?} against {exact}");
    }
}

/// Where two cuts meet they leave a ridge; it is rounded the other way than a tool's own edges.
#[test]
fn two_cuts_that_overlap_remove_their_union() {
    let (rest, pentahedra) = block([8, 8, 8], 2.0);
    let positions = current(&rest, |place| place);
    let (radius, apart) = (4.0_f64, 4.0);
    let lens = std::f64::consts::PI * (4.0 * radius + apart) * (2.0 * radius - apart).powi(2) / 12.0;
    let exact = 8.0 / 3.0 * std::f64::consts::PI * radius.powi(3) - lens;
    for along in [DVec3::X, DVec3::new(0.3, 0.5, 0.7).normalize()] {
        let mut field = Field::new(&rest, &pentahedra, 0.5, |_, _| SurfaceKind::Other).expect("a block");
        for side in [-0.5, 0.5] {
            let centre = DVec3::new(8.1, 7.9, 8.2) + along * apart * side;
            let ball = Tool::Sphere {
                centre,
                radius_mm: radius,
            };
            field.cut(&ball, &positions).expect("a good tool");
        }
        assert_sound(&field, "two balls");
        let error = field.removed_mm3() / exact - 1.0;
        println!("two balls along {along:.2}: volume error {:.3} %", 100.0 * error);
        assert!(error.abs() < 0.01, "{error}");
    }
}
