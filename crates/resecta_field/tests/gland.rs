//! A gland-like tube cut from end to end: what holds at the end. What it costs is measured by `resecta_methods`.

mod common;

use common::{assert_sound, current, obj, tube, tube_field};
use glam::{DVec3, Vec3};
use resecta_field::{Field, LoopStroke};
use resecta_solver::LoopPose;

/// A pull of the loop along the tube, 0.83 mm a step: 50 mm/s at 60 Hz.
const STEP_MM: f64 = 5.0 / 6.0;

fn pose(angle: f64, radius: f64, z: f64) -> LoopPose {
    let out = DVec3::new(angle.cos(), angle.sin(), 0.0);
    LoopPose {
        centre: out * radius + DVec3::Z * z,
        travel: DVec3::NEG_Z,
        down: out,
    }
}

/// Pulls the loop over the whole length of the tube.
fn pull(field: &mut Field, positions: &[Vec3], angle: f64, radius: f64, length: f64) -> f64 {
    let mut removed = 0.0;
    let mut z = length + 1.0;
    let mut stroke = LoopStroke::new(pose(angle, radius, z), 6.5, 4.5);
    field.begin_chip();
    while z > -1.0 {
        z -= STEP_MM;
        let tool = stroke.step_to(pose(angle, radius, z));
        removed += field.cut(&tool, positions).expect("a good tool").removed_mm3;
    }
    removed
}

#[test]
fn a_gland_is_cut_from_end_to_end() {
    let lattice = tube(39.0, 35.0, 8.0);
    let mut field = tube_field(&lattice, 0.5);
    let positions = current(&lattice.positions, |place| place);
    let mut chips = 0.0;
    for radius in [4.0, 7.0, 10.0, 13.0] {
        // As many pulls as leave no ridge between them.
        let pulls = (std::f64::consts::TAU * (radius + 2.0) / 4.0).ceil() as i32;
        for n in 0..pulls {
            let angle = std::f64::consts::TAU * f64::from(n) / f64::from(pulls);
            let removed = pull(&mut field, &positions, angle, radius, 35.0);
            if let Some(chip) = field.take_chip(&positions).expect("good positions") {
                assert!((chip.rest_volume_mm3 - removed).abs() < 1e-6);
                chips += chip.rest_volume_mm3;
            }
        }
    }
    assert_sound(&field, "gland");
    let sum = chips + field.volume_mm3();
    assert!(
        (sum / field.initial_volume_mm3() - 1.0).abs() < 1e-9,
        "chips and rest make {sum}"
    );
}

/// A list that is full is copied when it grows: once much was cut, that would take longer than the step of a stroke.
#[test]
fn no_list_moves_within_a_stroke() {
    let lattice = tube(39.0, 35.0, 8.0);
    let mut field = tube_field(&lattice, 0.5);
    let positions = current(&lattice.positions, |place| place);
    let lists = |field: &Field| {
        let surface = field.surface();
        [
            surface.triangle_slots().as_ptr().cast::<u8>(),
            surface.rest_places().as_ptr().cast(),
            surface.kinds().as_ptr().cast(),
            surface.coagulation_mm().as_ptr().cast(),
        ]
    };
    let mut grown = 0;
    for radius in [4.0, 7.0, 10.0] {
        for n in 0..8 {
            let angle = std::f64::consts::TAU * f64::from(n) / 8.0;
            let before = lists(&field);
            pull(&mut field, &positions, angle, radius, 35.0);
            // The first strokes of all take as much as there is.
            assert!(
                radius == 4.0 || lists(&field) == before,
                "a list moved in stroke {n} at {radius} mm"
            );
            field.take_chip(&positions).expect("good positions");
            grown += usize::from(lists(&field) != before);
        }
    }
    assert!(grown > 3, "lists are to grow, between strokes");
}

/// Canoes of 20 mm x 5 mm x 3 mm from the lining of a gland, at 50 mm/s and 60 Hz.
#[test]
fn usual_chips_are_closed() {
    let lattice = tube(39.0, 35.0, 8.0);
    let mut field = tube_field(&lattice, 0.5);
    let positions = current(&lattice.positions, |place| place);
    for lining in [4.0, 7.0] {
        for n in 0..12 {
            let angle = std::f64::consts::TAU * f64::from(n) / 12.0;
            // The loop dips in along an arc and is 3 mm deep in the middle.
            let at = |z: f64| pose(angle, lining - 1.5 - 0.03 * (z - 17.5).powi(2), z);
            let mut z = 27.5;
            let mut stroke = LoopStroke::new(at(z), 5.0, 4.5);
            field.begin_chip();
            while z > 7.5 {
                z -= STEP_MM;
                let tool = stroke.step_to(at(z));
                field.cut(&tool, &positions).expect("a good tool");
            }
            let chip = field.take_chip(&positions).expect("good positions").expect("a chip");
            let faces = chip
                .triangles
                .iter()
                .map(|face| face.map(|vertex| chip.vertices[vertex as usize].as_dvec3() - chip.centre));
            let (volume, area) = faces.fold((0.0, 0.0), |(volume, area), [a, b, c]| {
                (
                    volume + a.dot(b.cross(c)) / 6.0,
                    area + 0.5 * (b - a).cross(c - a).length(),
                )
            });
            assert!(
                (chip.thickness_mm / (2.0 * volume / area) - 1.0).abs() < 1e-4,
                "{}",
                chip.thickness_mm
            );
            common::chip_is_closed(&chip);
        }
    }
}

/// Writes a trench of two pulls, and its chip, for someone to look at.
#[test]
fn a_trench_can_be_looked_at() {
    let lattice = tube(30.0, 30.0, 10.0);
    let mut field = tube_field(&lattice, 0.5);
    let bend = |place: DVec3| place + DVec3::new(0.006 * place.z * place.z, 0.0, 0.0);
    let positions = current(&lattice.positions, bend);
    for angle in [0.2, 0.75] {
        pull(&mut field, &positions, angle, 4.0, 24.0);
    }
    let chip = field.take_chip(&positions).expect("good positions").expect("a chip");
    assert_sound(&field, "trench");
    let (mut places, mut normals) = (Vec::new(), Vec::new());
    field.move_vertices(&positions, &mut places).expect("as many as nodes");
    field.move_normals(&positions, &mut normals).expect("as many as nodes");
    let folder = std::env::temp_dir();
    for (name, text) in [
        (
            "resecta_trench.obj",
            obj(&places, &normals, field.surface().triangles()),
        ),
        (
            "resecta_chip.obj",
            obj(&chip.vertices, &chip.normals, chip.triangles.iter().copied()),
        ),
    ] {
        let path = folder.join(name);
        std::fs::write(&path, text).expect("the temporary folder can be written to");
        println!("wrote {}", path.display());
    }
}
