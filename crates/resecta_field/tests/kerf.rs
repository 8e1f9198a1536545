//! What a current vaporises along its wire is a layer of what goes, and nothing of what comes off without a current.

mod common;

use common::{block, block_field, chip_is_closed, current, enclosed};
use glam::DVec3;
use resecta_field::{LoopStroke, Tool};
use resecta_solver::LoopPose;

/// Area of half an ellipse, mm².
fn half_ellipse_mm2(width_mm: f64, depth_mm: f64) -> f64 {
    0.25 * std::f64::consts::PI * width_mm * depth_mm
}

/// A stroke of 8 mm along z through the middle of a block of 16 mm, in steps, the loop's open side at the block's upper face.
fn straight_stroke(step_mm: f64, kerf_mm: f64) -> Vec<Tool> {
    let pose = |z: f64| LoopPose {
        centre: DVec3::new(8.05, 0.0, z),
        travel: DVec3::Z,
        down: DVec3::Y,
    };
    let mut stroke = LoopStroke::new(pose(4.0), 7.0, 5.0).with_kerf(kerf_mm);
    let steps = (8.0 / step_mm).round() as u32;
    (1..=steps)
        .map(|step| stroke.step_to(pose(4.0 + step_mm * f64::from(step))))
        .collect()
}

#[test]
fn a_kerf_is_a_layer_of_what_goes_along_the_wire_however_short_the_steps() {
    let (rest, _) = block([8, 8, 8], 2.0);
    let positions = current(&rest, |place| place);
    for (step_mm, spacing_mm) in [(1.0, 0.5), (0.25, 0.5), (0.08, 0.5), (0.5, 0.25)] {
        let mut field = block_field([8, 8, 8], 2.0, spacing_mm);
        field.begin_chip();
        let mut removed = 0.0;
        for tool in straight_stroke(step_mm, 0.45) {
            removed += field.cut(&tool, &positions).expect("a good tool").removed_mm3;
        }
        let chip = field.take_chip(&positions).expect("good positions").expect("a chip");
        chip_is_closed(&chip);
        let what = format!("steps of {step_mm} mm, points {spacing_mm} mm apart");
        // As without a kerf, the wall is where the loop was.
        let outer = 8.0 * half_ellipse_mm2(7.0, 5.0);
        assert!((removed / outer - 1.0).abs() < 0.02, "{what}: {removed} of {outer}");
        // To first order in the kerf the layer within is an ellipse, too.
        let inner = 8.0 * half_ellipse_mm2(7.0 - 0.9, 5.0 - 0.45);
        let kept = chip.rest_volume_mm3;
        assert!((kept / inner - 1.0).abs() < 0.03, "{what}: {kept} of {inner}");
        assert!((kept + chip.vaporised_mm3 - removed).abs() < 1e-9, "{what}");
        let enclosed = enclosed(chip.triangles.iter().copied(), &chip.vertices);
        assert!((enclosed / kept - 1.0).abs() < 0.03, "{what}: {enclosed} of {kept}");
    }
}

#[test]
fn a_piece_that_comes_off_beside_a_kerf_stays_whole() {
    let (rest, _) = block([8, 8, 8], 2.0);
    let positions = current(&rest, |place| place);
    let chip = |taken: &[u32], kerf_mm: f64| {
        let mut field = block_field([8, 8, 8], 2.0, 0.5);
        field.begin_chip();
        let mut piece_mm3 = 0.0;
        for tool in straight_stroke(0.5, kerf_mm) {
            field.cut(&tool, &positions).expect("a good tool");
        }
        if !taken.is_empty() {
            piece_mm3 = field.empty(taken).expect("pentahedra of the field").removed_mm3;
        }
        let chip = field.take_chip(&positions).expect("good positions").expect("a chip");
        (chip.rest_volume_mm3, piece_mm3)
    };
    // Below the stroke: of some of these it took a part.
    let below: Vec<u32> = {
        let field = block_field([8, 8, 8], 2.0, 0.5);
        let (places, pentahedra) = block([8, 8, 8], 2.0);
        let middle = |nodes: &[u32; 6]| nodes.iter().map(|&node| places[node as usize]).sum::<DVec3>() / 6.0;
        (0..field.pentahedron_count() as u32)
            .filter(|&n| {
                let middle = middle(&pentahedra[n as usize]);
                (4.0..10.0).contains(&middle.y) && (6.0..10.0).contains(&middle.x) && (6.0..10.0).contains(&middle.z)
            })
            .collect()
    };
    let (stroke, _) = chip(&[], 0.45);
    let (with_piece, piece) = chip(&below, 0.45);
    assert!(piece > 50.0);
    assert!(
        ((with_piece - stroke) / piece - 1.0).abs() < 0.05,
        "of {piece} mm³ the chip got {}",
        with_piece - stroke
    );
}
