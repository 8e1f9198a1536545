//! An organ that gives way as a whole, against the two springs that hold it.

mod common;

use std::f32::consts::TAU;

use common::tube_lattice_of;
use glam::Vec3;
use resecta_solver::{CollapseLaw, Effort, Material, Mobility, ShearResistance, Tissue, TissueMesh};

const LENGTH_MM: f32 = 40.0;
const SHIFT_N_PER_MM: f32 = 1.0;
const TURN_N_MM: f32 = 300.0;

/// A tube along z on its bed, anchored in the middle of its lower end.
fn tube() -> Tissue {
    let lattice = tube_lattice_of([8.0, 16.0], (LENGTH_MM / 5.0) as u32, 20.0);
    let mesh = TissueMesh::from_lattice(&lattice, ShearResistance::Diagonals);
    let mut tissue = Tissue::new(&mesh, &Material::default()).expect("a tube is a tissue");
    tissue.set_effort(Effort::fast(Material::default().modulus_pa));
    let mobility = Mobility {
        anchor: Vec3::ZERO,
        shift_n_per_mm: SHIFT_N_PER_MM,
        turn_n_mm: TURN_N_MM,
    };
    tissue.set_mobility(Some(mobility)).expect("plain stiffnesses");
    tissue
}

fn rest(tissue: &mut Tissue, seconds: u32) {
    for _ in 0..60 * seconds {
        tissue.advance(1.0 / 60.0, &[]).expect("a stable step");
    }
}

/// Where the middle of the tube's upper end comes to lie, and that of its lower end, by the bed, mm.
fn ends(tissue: &Tissue) -> [Vec3; 2] {
    [LENGTH_MM, 0.0].map(|z| tissue.bed_moves(Vec3::Z * z))
}

#[test]
fn a_force_shifts_the_organ_and_turns_it_about_its_anchor() {
    let mut tissue = tube();
    let force_n = 0.1;
    let nodes = tissue.node_count() as u32;
    let mut lever_mm = 0.0;
    for node in 0..nodes {
        lever_mm += tissue.rest_position(node).z / nodes as f32;
        let each = Vec3::X * (force_n * 1e6 / nodes as f32);
        tissue.set_load(node, each).expect("a living node");
    }
    rest(&mut tissue, 6);
    let [upper, lower] = ends(&tissue);
    let shift_mm = force_n / SHIFT_N_PER_MM;
    let turned_mm = force_n * lever_mm / TURN_N_MM * LENGTH_MM;
    assert!((lower.x / shift_mm - 1.0).abs() < 0.02, "{lower} for {shift_mm}");
    assert!(
        ((upper - lower).x / turned_mm - 1.0).abs() < 0.02,
        "{upper} for {turned_mm}"
    );
    assert!(
        upper.y.abs() + lower.y.abs() + lower.z.abs() < 0.01 * shift_mm,
        "{upper} {lower}"
    );

    // Let go, it comes back, to within what asleep tissue may be off.
    for node in 0..nodes {
        tissue.set_load(node, Vec3::ZERO).expect("a living node");
    }
    rest(&mut tissue, 6);
    assert!(
        ends(&tissue).iter().all(|end| end.length() < 0.05 * shift_mm),
        "{:?}",
        ends(&tissue)
    );
}

#[test]
fn an_organ_that_is_let_go_comes_back_the_more_slowly_the_stiffer_its_bed_is() {
    // The capsule is the outer surface, of 16 mm radius; along its axis the tube only shifts.
    let bed_n_per_mm = Material::default().support_pa_per_mm as f32 * 1e-6 * (TAU * 16.0 * LENGTH_MM);
    let constant_s = 0.05 * (1.0 + bed_n_per_mm / SHIFT_N_PER_MM);
    let mut tissue = tube();
    let nodes = tissue.node_count() as u32;
    let load_all = |tissue: &mut Tissue, load: Vec3| {
        for node in 0..nodes {
            tissue.set_load(node, load).expect("a living node");
        }
    };
    load_all(&mut tissue, Vec3::Z * (0.1e6 / nodes as f32));
    rest(&mut tissue, 3);
    load_all(&mut tissue, Vec3::ZERO);
    // The tube's own inertia comes first.
    let mut at = |seconds: f32| {
        for _ in 0..(seconds * 60.0).round() as u32 {
            tissue.advance(1.0 / 60.0, &[]).expect("a stable step");
        }
        tissue.bed_moves(Vec3::ZERO).z
    };
    let (first, second) = (at(0.1), at(0.2));
    let measured_s = 0.2 / (first / second).ln();
    assert!(
        (measured_s / constant_s - 1.0).abs() < 0.2,
        "{measured_s} s for {constant_s} s"
    );
}

#[test]
fn neither_water_nor_resections_move_the_organ() {
    let mut tissue = tube();
    tissue.set_water_pressure_pa(300.0).expect("a plain pressure");
    // More is taken from one side: the forces on what is left have a sum.
    let cut: Vec<u32> = (0..tissue.pentahedron_count() as u32)
        .filter(|&pentahedron| {
            let corners = tissue
                .pentahedron_nodes(pentahedron)
                .map(|node| tissue.rest_position(node));
            let middle = corners.iter().sum::<Vec3>() / 6.0;
            middle.x > 6.0 && middle.truncate().length() < 13.0 && (10.0..30.0).contains(&middle.z)
        })
        .collect();
    assert!(cut.len() > 20, "{}", cut.len());
    tissue.resect(&cut, Some(CollapseLaw::CompressionForce { share: 0.2 }));
    rest(&mut tissue, 3);
    let [upper, lower] = ends(&tissue);
    assert!(upper.length() < 0.05 && lower.length() < 0.05, "{upper} {lower}");
}

#[test]
fn stiffnesses_that_make_no_sense_are_refused() {
    let mut tissue = tube();
    let before = tissue.mobility();
    for (shift_n_per_mm, turn_n_mm) in [(0.0, 1.0), (1.0, -1.0), (f32::NAN, 1.0), (1.0, f32::INFINITY)] {
        let mobility = Mobility {
            anchor: Vec3::ZERO,
            shift_n_per_mm,
            turn_n_mm,
        };
        tissue.set_mobility(Some(mobility)).expect_err("no stiffness");
        assert_eq!(tissue.mobility(), before);
    }
}
