//! What is refused, and that it changes nothing.

mod common;

use common::{block, block_field, current};
use glam::{DVec3, Vec3};
use resecta_field::{Field, FieldError, LoopStroke, SurfaceKind, Tool};
use resecta_solver::{LoopPose, LoopSweep};

fn positions() -> Vec<Vec3> {
    current(&block([2, 2, 2], 2.0).0, |place| place)
}

#[test]
fn tools_with_a_wrong_number_are_refused_by_name() {
    let pose = LoopPose {
        centre: DVec3::ZERO,
        travel: DVec3::Z,
        down: DVec3::Y,
    };
    let sweep = LoopSweep {
        from: pose,
        to: LoopPose {
            centre: DVec3::Z,
            ..pose
        },
        width_mm: 6.5,
        depth_mm: 4.5,
    };
    let good = |sweep| Tool::Loop {
        sweep,
        run_mm: 0.0,
        kerf_mm: 0.0,
        thin_mm: 0.0,
    };
    let half_cylinder = |from, down, radius_mm| Tool::HalfCylinder {
        from,
        to: DVec3::Z,
        down,
        radius_mm,
    };
    let nan = DVec3::new(0.0, f64::NAN, 0.0);
    let cases = [
        (
            Tool::Sphere {
                centre: nan,
                radius_mm: 1.0,
            },
            "sphere",
            "centre",
        ),
        (
            Tool::Sphere {
                centre: DVec3::ZERO,
                radius_mm: f64::NAN,
            },
            "sphere",
            "radius",
        ),
        (
            Tool::Sphere {
                centre: DVec3::ZERO,
                radius_mm: f64::INFINITY,
            },
            "sphere",
            "radius",
        ),
        (
            Tool::Sphere {
                centre: DVec3::ZERO,
                radius_mm: -1.0,
            },
            "sphere",
            "radius",
        ),
        (half_cylinder(nan, DVec3::Y, 1.0), "half cylinder", "from"),
        (half_cylinder(DVec3::ZERO, nan, 1.0), "half cylinder", "down"),
        (half_cylinder(DVec3::ZERO, DVec3::Z, 1.0), "half cylinder", "down"),
        (half_cylinder(DVec3::ZERO, DVec3::Y, 0.0), "half cylinder", "radius"),
        (good(LoopSweep { width_mm: 0.0, ..sweep }), "loop", "width"),
        (
            good(LoopSweep {
                depth_mm: f64::NAN,
                ..sweep
            }),
            "loop",
            "depth",
        ),
        (
            good(LoopSweep {
                to: LoopPose { centre: nan, ..pose },
                ..sweep
            }),
            "loop",
            "centre",
        ),
        (
            good(LoopSweep {
                to: LoopPose {
                    travel: DVec3::ZERO,
                    ..pose
                },
                ..sweep
            }),
            "loop",
            "travel",
        ),
        (
            good(LoopSweep {
                from: LoopPose { down: DVec3::Z, ..pose },
                ..sweep
            }),
            "loop",
            "down",
        ),
        (
            Tool::Loop {
                sweep,
                run_mm: f64::NAN,
                kerf_mm: 0.0,
                thin_mm: 0.0,
            },
            "loop",
            "run",
        ),
        (
            Tool::Loop {
                sweep,
                run_mm: 0.0,
                kerf_mm: -0.1,
                thin_mm: 0.0,
            },
            "loop",
            "kerf",
        ),
        (
            Tool::Loop {
                sweep,
                run_mm: 0.0,
                kerf_mm: 0.0,
                thin_mm: f64::INFINITY,
            },
            "loop",
            "thin",
        ),
    ];
    for (tool, its_name, its_field) in cases {
        let mut field_under_test = block_field([2, 2, 2], 2.0, 0.5);
        match field_under_test.cut(&tool, &positions()) {
            Err(FieldError::Tool { tool, field, .. }) => assert_eq!((tool, field), (its_name, its_field)),
            other => panic!("{tool:?}: {other:?}"),
        }
        assert_eq!(field_under_test.bytes(), 0);
    }
    assert!(block_field([2, 2, 2], 2.0, 0.5).cut(&good(sweep), &positions()).is_ok());
}

#[test]
fn numbers_near_the_ends_of_their_range_do_no_harm() {
    let mut field = block_field([2, 2, 2], 2.0, 0.5);
    for size in [1e-300, 1e-30, 1e30, 1e300] {
        for centre in [DVec3::ZERO, DVec3::splat(1e300)] {
            let pose = |z| LoopPose {
                centre: centre + DVec3::Z * z,
                travel: DVec3::Z,
                down: DVec3::Y,
            };
            let tools = [
                Tool::Sphere {
                    centre,
                    radius_mm: size,
                },
                LoopStroke::new(pose(0.0), size, size).step_to(pose(size)),
            ];
            for tool in tools {
                // Refused or done: never a panic, never a volume that is no number.
                let _ = field.cut(&tool, &positions());
                common::assert_sound(&field, "extreme");
            }
        }
    }
}

#[test]
fn a_loop_at_rest_takes_nothing_and_a_lost_pose_is_passed_over() {
    let pose = |z| LoopPose {
        centre: DVec3::new(2.0, 0.0, z),
        travel: DVec3::Z,
        down: DVec3::Y,
    };
    let mut field = block_field([2, 2, 2], 2.0, 0.5);
    let mut stroke = LoopStroke::new(pose(1.0), 3.0, 2.0);
    let cut = field
        .cut(&stroke.step_to(pose(1.0)), &positions())
        .expect("a loop at rest");
    assert!(cut.removed.is_empty());
    assert!(field.cut(&stroke.step_to(pose(f64::NAN)), &positions()).is_err());
    let cut = field
        .cut(&stroke.step_to(pose(3.0)), &positions())
        .expect("a good step");
    assert!(cut.removed_mm3 > 5.0, "{}", cut.removed_mm3);
}

#[test]
fn positions_must_be_one_finite_place_a_node() {
    let mut field = block_field([2, 2, 2], 2.0, 0.5);
    let tool = Tool::Sphere {
        centre: DVec3::ZERO,
        radius_mm: 1.0,
    };
    let mut places = positions();
    assert!(matches!(
        field.cut(&tool, &places[1..]),
        Err(FieldError::PositionCount {
            given: 26,
            expected: 27
        })
    ));
    assert!(field.move_vertices(&places[1..], &mut Vec::new()).is_err());
    places[3].y = f32::NAN;
    assert_eq!(field.cut(&tool, &places), Err(FieldError::Position(3)));
    assert_eq!(
        field.coagulate(&[DVec3::ZERO], 1.0, 1.0, &places),
        Err(FieldError::Position(3))
    );
    assert!(field.coagulate(&[DVec3::ZERO], f64::NAN, 1.0, &positions()).is_err());
    assert!(
        field
            .coagulate(&[DVec3::ZERO, DVec3::NAN], 1.0, 1.0, &positions())
            .is_err()
    );
    assert!(matches!(
        field.empty(&[99]),
        Err(FieldError::NoSuchPentahedron { index: 99, count: 16 })
    ));
    assert_eq!(field.fill(99), 0.0);
}

#[test]
fn meshes_that_cannot_be_are_refused() {
    let (rest, pentahedra) = block([1, 1, 1], 2.0);
    let new = |rest: &[DVec3], pentahedra: &[[u32; 6]], spacing| {
        Field::new(rest, pentahedra, spacing, |_, _| SurfaceKind::Other).map(|field| field.pentahedron_count())
    };
    assert_eq!(new(&rest, &pentahedra, 0.5), Ok(2));
    assert_eq!(new(&rest, &[], 0.5), Err(FieldError::Empty));
    for spacing in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        assert!(matches!(new(&rest, &pentahedra, spacing), Err(FieldError::Spacing(_))));
    }
    assert!(matches!(new(&rest, &pentahedra, 1e-3), Err(FieldError::TooFine { .. })));
    assert!(matches!(
        new(&rest[1..], &pentahedra, 0.5),
        Err(FieldError::NoSuchNode { node: 7, .. })
    ));
    let [a, b, c, d, e, f] = pentahedra[0];
    assert!(matches!(
        new(&rest, &[[d, e, f, a, b, c]], 0.5),
        Err(FieldError::Inverted { index: 0, .. })
    ));
    assert_eq!(new(&rest, &[[a, b, b, d, e, f]], 0.5), Err(FieldError::Repeated(0)));
    assert_eq!(
        new(&rest, &[pentahedra[0], pentahedra[0]], 0.5),
        Err(FieldError::NotManifold(1))
    );
    let mut lost = rest.clone();
    lost[2].x = f64::INFINITY;
    assert_eq!(new(&lost, &pentahedra, 0.5), Err(FieldError::Position(2)));
}
