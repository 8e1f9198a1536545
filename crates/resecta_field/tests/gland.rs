//! A gland-like tube cut from end to end: what holds at the end, and what it costs (printed: run with `--nocapture`).

mod common;

use std::time::{Duration, Instant};

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

/// Times of a kind of call.
#[derive(Default)]
struct Times(Vec<Duration>);

impl Times {
    fn take<T>(&mut self, call: impl FnOnce() -> T) -> T {
        let start = Instant::now();
        let result = call();
        self.0.push(start.elapsed());
        result
    }
}

impl std::fmt::Display for Times {
    /// Median, 99th percentile and largest, ms.
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        let mut times = self.0.clone();
        times.sort_unstable();
        let at = |share: f64| times[(share * (times.len() - 1) as f64).round() as usize].as_secs_f64() * 1e3;
        write!(f, "{:.2}/{:.2}/{:.2} ms", at(0.5), at(0.99), at(1.0))
    }
}

/// Pulls the loop over the whole length of the tube.
fn pull(field: &mut Field, positions: &[Vec3], angle: f64, radius: f64, length: f64, times: &mut Times) -> f64 {
    let mut removed = 0.0;
    let mut z = length + 1.0;
    let mut stroke = LoopStroke::new(pose(angle, radius, z), 6.5, 4.5);
    field.begin_chip();
    while z > -1.0 {
        z -= STEP_MM;
        let tool = stroke.step_to(pose(angle, radius, z));
        removed += times
            .take(|| field.cut(&tool, positions))
            .expect("a good tool")
            .removed_mm3;
    }
    removed
}

#[test]
fn a_gland_is_cut_from_end_to_end() {
    let lattice = tube(39.0, 35.0, 8.0);
    let mut field = tube_field(&lattice, 0.5);
    let positions = current(&lattice.positions, |place| place);
    println!("{} nodes, {} pentahedra", positions.len(), lattice.pentahedra.len(),);
    let mut chips = 0.0;
    let begin = Instant::now();
    for (round, radius) in [4.0, 7.0, 10.0, 13.0].into_iter().enumerate() {
        let (mut steps, mut taking) = (Times::default(), Times::default());
        // As many pulls as leave no ridge between them.
        let pulls = (std::f64::consts::TAU * (radius + 2.0) / 4.0).ceil() as i32;
        for n in 0..pulls {
            let angle = std::f64::consts::TAU * f64::from(n) / f64::from(pulls);
            let removed = pull(&mut field, &positions, angle, radius, 35.0, &mut steps);
            if false {
                field.begin_chip();
            }
            if let Some(chip) = taking.take(|| field.take_chip(&positions)).expect("good positions") {
                assert!((chip.rest_volume_mm3 - removed).abs() < 1e-6);
                chips += chip.rest_volume_mm3;
            }
        }
        let (mut places, mut normals) = (Vec::new(), Vec::new());
        let start = Instant::now();
        field.move_vertices(&positions, &mut places).expect("as many as nodes");
        let first = start.elapsed();
        let start = Instant::now();
        field.move_vertices(&positions, &mut places).expect("as many as nodes");
        let moved = start.elapsed();
        field.move_normals(&positions, &mut normals).expect("as many as nodes");
        let start = Instant::now();
        field.move_normals(&positions, &mut normals).expect("as many as nodes");
        println!(
            "round {round}: a step {steps}; a chip {taking}; {:.1} MB; {} slots move in {:.3} ms (first {:.3}), \
             normals {:.3} ms; {} triangles",
            field.bytes() as f64 / 1e6,
            places.len(),
            moved.as_secs_f64() * 1e3,
            first.as_secs_f64() * 1e3,
            start.elapsed().as_secs_f64() * 1e3,
            field.surface().triangles().count(),
        );
    }
    println!("in all {:.2} s", begin.elapsed().as_secs_f64());
    assert_sound(&field, "gland");
    let sum = chips + field.volume_mm3();
    assert!(
        (sum / field.initial_volume_mm3() - 1.0).abs() < 1e-9,
        "chips and rest make {sum}"
    );
}

/// Canoes of 20 mm x 5 mm x 3 mm from the lining of a gland, at 50 mm/s and 60 Hz: steps and chips (printed).
#[test]
fn usual_chips_are_taken_at_once() {
    let lattice = tube(39.0, 35.0, 8.0);
    let mut field = tube_field(&lattice, 0.5);
    let positions = current(&lattice.positions, |place| place);
    for lining in [4.0, 7.0] {
        let (mut steps, mut taking, mut triangles) = (Times::default(), Times::default(), 0);
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
                steps.take(|| field.cut(&tool, &positions)).expect("a good tool");
            }
            let chip = taking
                .take(|| field.take_chip(&positions))
                .expect("good positions")
                .expect("a chip");
            common::chip_is_closed(&chip);
            triangles += chip.triangles.len() / 12;
        }
        println!("canoes from {lining} mm: a step {steps}; a chip {taking}, of {triangles} triangles");
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
        pull(&mut field, &positions, angle, 4.0, 24.0, &mut Times::default());
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
