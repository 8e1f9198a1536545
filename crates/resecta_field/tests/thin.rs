//! What a current leaves thinner than a limit beside its wall vaporises, by its thickness, and nothing else does.

mod common;

use common::{block, current};
use glam::{DVec2, DVec3};
use resecta_field::{Chip, Field, LoopStroke, SurfaceKind};
use resecta_solver::LoopPose;

const EDGE_MM: f64 = 16.0;
const LENGTH_MM: f64 = 8.0;
/// Half the loop's width, and its depth, mm.
const LOOP_MM: DVec2 = DVec2::new(3.5, 5.0);
const KERF_MM: f64 = 0.45;
/// What is thinner vaporises, mm.
const LIMIT_MM: f64 = 0.8;
/// Of the field's points.
const SPACING_MM: f64 = 0.5;

/// What a stroke of 8 mm along z takes of a block of 16 mm, its open side at the block's upper face and its wall `left_mm` from the block's
/// side: volume lost, mm³, and the chip.
fn stroke(left_mm: f64, thin_mm: f64, kind: SurfaceKind, step_mm: f64) -> (f64, Chip) {
    let (rest, pentahedra) = block([8, 8, 8], 2.0);
    let positions = current(&rest, |place| place);
    let mut field = Field::new(&rest, &pentahedra, SPACING_MM, |_, _| kind).expect("a block is a tissue");
    let pose = |z: f64| LoopPose {
        centre: DVec3::new(EDGE_MM - left_mm - LOOP_MM.x, 0.0, z),
        travel: DVec3::Z,
        down: DVec3::Y,
    };
    let stroke = LoopStroke::new(pose(4.0), 2.0 * LOOP_MM.x, LOOP_MM.y);
    let mut stroke = stroke.with_kerf(KERF_MM).with_thin(thin_mm);
    field.begin_chip();
    let mut removed = 0.0;
    for step in 1..=(LENGTH_MM / step_mm).round() as u32 {
        let tool = stroke.step_to(pose(4.0 + step_mm * f64::from(step)));
        removed += field.cut(&tool, &positions).expect("a good tool").removed_mm3;
    }
    let chip = field.take_chip(&positions).expect("good positions").expect("a chip");
    assert!((chip.rest_volume_mm3 + chip.vaporised_mm3 - removed).abs() < 1e-9);
    (removed, chip)
}

/// Area between the loop's wall and the block's side that is thinner than a limit along the wall's normal, mm².
fn thin_mm2(left_mm: f64, thin_mm: f64) -> f64 {
    const PARTS: u32 = 20_000;
    let share = |n: u32| f64::from(n) / f64::from(PARTS) * std::f64::consts::FRAC_PI_2;
    let mut area = 0.0;
    for n in 0..PARTS {
        let (sin, cos) = share(n).sin_cos();
        let normal = DVec2::new(cos / LOOP_MM.x, sin / LOOP_MM.y).normalize();
        let side = LOOP_MM.x + left_mm;
        let way = (side - LOOP_MM.x * cos) / normal.x;
        if way >= thin_mm {
            break;
        }
        // Between this normal and the next: so far along the wall, and less far or further where the wall bends.
        let next = share(n + 1).sin_cos();
        let step = DVec2::new(LOOP_MM.x * (next.1 - cos), LOOP_MM.y * (next.0 - sin)).length();
        let next_normal = DVec2::new(next.1 / LOOP_MM.x, next.0 / LOOP_MM.y).normalize();
        area += way * step + 0.5 * way * way * normal.perp_dot(next_normal);
    }
    area
}

#[test]
fn what_is_thinner_than_the_limit_along_the_walls_normal_vaporises() {
    for (left_mm, step_mm) in [(0.2, 0.5), (0.5, 0.5), (0.5, 0.1), (0.7, 0.25)] {
        let (before, chip_before) = stroke(left_mm, 0.0, SurfaceKind::Mucosa, step_mm);
        let (after, chip) = stroke(left_mm, LIMIT_MM, SurfaceKind::Mucosa, step_mm);
        let gone = after - before;
        // The limit to a tenth of the points' spacing; at both ends up to half a spacing more goes.
        let least = LENGTH_MM * thin_mm2(left_mm, LIMIT_MM - 0.1 * SPACING_MM);
        let most = (LENGTH_MM + SPACING_MM) * thin_mm2(left_mm, LIMIT_MM + 0.1 * SPACING_MM);
        let what = format!("{left_mm} mm left, steps of {step_mm} mm: {gone} of {least} to {most} mm³");
        assert!((least..=most).contains(&gone), "{what}");
        let grown = chip.vaporised_mm3 - chip_before.vaporised_mm3;
        assert!((grown / gone - 1.0).abs() < 0.05, "{what}: {grown} vaporised");
        // Its rim to tissue that a later step takes goes with that.
        let booked = chip.thin_mm3 / gone;
        assert!((0.75..=1.0).contains(&booked), "{what}: {booked} of it booked");
    }
}

#[test]
fn what_is_thicker_stays_and_so_does_what_lies_before_the_capsule() {
    for (left_mm, kind) in [
        (1.5, SurfaceKind::Mucosa),
        (0.5, SurfaceKind::Capsule),
        (0.5, SurfaceKind::Other),
    ] {
        let before = stroke(left_mm, 0.0, kind, 0.5);
        assert_eq!(
            stroke(left_mm, LIMIT_MM, kind, 0.5),
            before,
            "{left_mm} mm left of {kind:?}"
        );
    }
}
