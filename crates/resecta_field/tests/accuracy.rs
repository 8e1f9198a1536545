//! Laws: what cuts that turn or overlap remove. Single exact solids are measured by `resecta_methods`.

mod common;

use common::{assert_sound, block, current};
use glam::DVec3;
use resecta_field::{Field, LoopStroke, SurfaceKind, Tool};
use resecta_solver::LoopPose;

const WIDTH: f64 = 6.5;
const DEPTH: f64 = 4.5;

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
