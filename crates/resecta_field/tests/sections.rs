//! Sections hold what the field keeps, and nothing else.

mod common;

use common::{Random, block, block_field, current};
use glam::{DVec3, Vec3};
use resecta_field::{Field, Plane, Tool};

/// Area of the section of a plane through everything, mm².
fn area(field: &Field, plane: &Plane, positions: &[Vec3]) -> f64 {
    let mut area = 0.0;
    for pentahedron in 0..field.pentahedron_count() as u32 {
        field.section(
            pentahedron,
            plane,
            |node| positions[node as usize],
            |[a, b, c]| {
                area += 0.5 * f64::from((b - a).cross(c - a).length());
                for point in [a, b, c] {
                    assert!(plane.beyond_mm(point).abs() < 1e-4);
                }
            },
        );
    }
    area
}

/// A block of 12 mm with a ball of 4 mm radius cut out of its middle.
fn hollow() -> (Field, Vec<Vec3>) {
    let (rest, _) = block([6; 3], 2.0);
    let positions = current(&rest, |place| place);
    let mut field = block_field([6; 3], 2.0, 0.5);
    let ball = Tool::Sphere {
        centre: DVec3::splat(6.1),
        radius_mm: 4.0,
    };
    field.cut(&ball, &positions).expect("a good tool");
    (field, positions)
}

#[test]
fn a_plane_through_a_ball_that_was_cut_out_shows_a_round_hole() {
    let (field, positions) = hollow();
    for offset_mm in [1.1f32, 4.3, 6.0, 8.7, 11.5] {
        let plane = Plane {
            normal: Vec3::X,
            offset_mm,
        };
        let beside = f64::from(offset_mm) - 6.1;
        let hole = std::f64::consts::PI * (16.0 - beside * beside).max(0.0);
        let measured = area(&field, &plane, &positions);
        assert!(
            (measured - (144.0 - hole)).abs() < 0.02 * 144.0,
            "{measured} at {offset_mm}"
        );
    }
}

#[test]
fn sections_add_up_to_the_volume_that_is_kept() {
    let (field, positions) = hollow();
    // Stretched and sheared: volume grows by the determinant.
    let shear = |place: Vec3| Vec3::new(1.2 * place.x + 0.3 * place.y, place.y, place.z - 0.2 * place.x);
    let positions: Vec<Vec3> = positions.into_iter().map(shear).collect();
    let mut random = Random(3);
    for _ in 0..3 {
        let normal = random.direction().as_vec3();
        let reach = positions.iter().map(|place| normal.dot(*place));
        let (low, high) = reach.fold((f32::MAX, f32::MIN), |(low, high), at| (low.min(at), high.max(at)));
        let count = 200;
        let thickness = (high - low) / count as f32;
        let sum: f64 = (0..count)
            .map(|n| {
                let offset_mm = low + thickness * (n as f32 + 0.5);
                area(&field, &Plane { normal, offset_mm }, &positions) * f64::from(thickness)
            })
            .sum();
        let kept = 1.2 * field.volume_mm3();
        assert!((sum / kept - 1.0).abs() < 3e-3, "{sum} against {kept}");
    }
}

#[test]
fn a_pentahedron_that_does_not_exist_has_no_section() {
    let (field, positions) = hollow();
    let plane = Plane {
        normal: Vec3::Z,
        offset_mm: 6.0,
    };
    let position = |node: u32| positions[node as usize];
    field.section(u32::MAX, &plane, position, |_| panic!("there is none"));
}
