//! Hard cases for pentahedra that hold their volume: starts far out of shape, plates, a sheath and a tool, each against the
//! same lattice without. `cargo test --release --test hard_cases_volume -- --nocapture` prints the tables of
//! `docs/hard_cases.md`.

mod common;

use common::blocks::block;
use common::networks::rounding_nj;
use common::{drive_tool_through, tube_lattice, tube_lattice_around};
use glam::Vec3;
use resecta_anatomy::Lattice;
use resecta_solver::{Contact, Material, NodeKind, ShearResistance, Tissue, TissueMesh, TissuePoint};

const SHEARS: [ShearResistance; 3] = [
    ShearResistance::None,
    ShearResistance::PreTension(0.03),
    ShearResistance::Diagonals,
];

fn of_lattice(lattice: &Lattice, shear: ShearResistance, poisson_ratio: Option<f64>) -> Tissue {
    let material = Material {
        poisson_ratio,
        shear,
        ..Material::default()
    };
    Tissue::new(&TissueMesh::from_lattice(lattice, shear), &material).expect("a tube is a tissue")
}

/// What rounding of positions makes of the energy, nJ.
fn rounding(tissue: &Tissue) -> f64 {
    // Pentahedra are up to 16 times as stiff as the springs' modulus, at six corners.
    100.0 * rounding_nj(tissue)
}

#[test]
fn any_start_neither_blows_up_nor_gains_energy_and_nothing_stays_inside_out() {
    type Shape = (&'static str, fn(Vec3) -> Vec3);
    let shapes: [Shape; 8] = [
        ("stretched three times", |place| place * 3.0),
        ("stretched twice", |place| place * 2.0),
        ("flat", |place| Vec3::new(place.x, place.y, 15.0)),
        ("on a line", |place| Vec3::new(0.0, 0.0, place.z)),
        ("in a point", |_| Vec3::new(0.0, 0.0, 15.0)),
        ("inside out", |place| Vec3::new(-place.x, place.y, place.z)),
        ("turned within itself", |place| {
            Vec3::new(place.y, -place.x, 30.0 - place.z)
        }),
        ("at random", |place| {
            let wild = |a: Vec3| ((a.dot(place) * 12.9898).sin() * 43_758.547).rem_euclid(1.0);
            Vec3::new(wild(Vec3::X) - 0.5, wild(Vec3::Y) - 0.5, wild(Vec3::Z)) * 30.0
        }),
    ];
    let lattice = tube_lattice(18.0);
    for ((name, shape), shear) in shapes.into_iter().flat_map(|shape| SHEARS.map(|shear| (shape, shear))) {
        let mut left = Vec::new();
        for ratio in [None, Some(0.3), Some(0.45)] {
            let mut start = of_lattice(&lattice, shear, ratio);
            for node in 0..start.node_count() as u32 {
                let place = shape(start.position(node));
                start.set_position(node, place).expect("a finite position");
            }
            let first = start.energy().total();
            for step_s in [1e-3, 1.0 / 60.0, 0.2] {
                let case = format!("{name}, {shear:?}, {ratio:?}, steps of {step_s} s");
                let mut tissue = start.clone();
                for _ in 0..(0.6f64 / step_s).ceil().min(100.0) as u32 {
                    let report = tissue.advance(step_s, &[]).expect("divided if need be");
                    assert_eq!(report.put_aside, [], "{case}");
                    let energy = tissue.energy().total();
                    // A symplectic step swings about the true energy, most where a mode is near the bound.
                    assert!(
                        energy <= 1.05 * first + rounding(&tissue),
                        "{case}: {energy} of {first} nJ"
                    );
                }
                assert_eq!(tissue.validate(), Ok(()), "{case}");
                if step_s == 1.0 / 60.0 {
                    tissue.advance(2.0, &[]).expect("divided if need be");
                    left.push(tissue.inverted_pentahedra().len());
                }
            }
        }
        println!(
            "{name}, {shear:?}: left inverted of {}, without a ratio, with 0.3 and 0.45: {left:?}",
            lattice.pentahedra.len()
        );
        assert_eq!(left[1..], [0, 0], "{name}, {shear:?}");
    }
}

#[test]
fn a_sheath_that_widens_a_narrow_lumen_turns_nothing_inside_out() {
    // A narrow lumen.
    let lattice = tube_lattice_around(2.5, 12.0);
    for shear in SHEARS {
        for ratio in [None, Some(0.3), Some(0.45), Some(0.49)] {
            let mut tissue = of_lattice(&lattice, shear, ratio);
            let lumen: Vec<u32> = (0..tissue.node_count() as u32)
                .filter(|&node| tissue.node_kind(node) == NodeKind::Mucosa)
                .collect();
            let mut worst = 0;
            let (mut substeps, mut repeated) = (0, 0);
            for frame in 0..60u32 {
                let radius = |frame: u32| 2.5 + 2.0 * (frame as f32 / 30.0).min(1.0);
                let contacts: Vec<Contact> = lumen
                    .iter()
                    .map(|&node| {
                        Contact::with_plane(
                            TissuePoint::node(node),
                            tissue.rest_position(node).with_z(0.0).normalize(),
                            [radius(frame), radius(frame + 1)],
                        )
                    })
                    .collect();
                let report = tissue.advance(1.0 / 60.0, &contacts).expect("divided if need be");
                assert_eq!(report.put_aside, [], "{shear:?}, {ratio:?}");
                (substeps, repeated) = (substeps + report.substeps, repeated + report.substeps_repeated);
                worst = worst.max(tissue.inverted_pentahedra().len());
            }
            let (held, volume) = (
                tissue.inverted_pentahedra().len(),
                tissue.volume_mm3() / tissue.initial_volume_mm3(),
            );
            tissue.advance(2.0, &[]).expect("divided if need be");
            let left = tissue.inverted_pentahedra().len();
            assert_eq!(tissue.validate(), Ok(()), "{shear:?}, {ratio:?}");
            assert!(ratio.is_none() || worst == 0, "{shear:?}, {ratio:?}: {worst}");
            println!(
                "sheath, {shear:?}, {ratio:?}: {worst} at most, {held} while held (volume {volume:.3}), {left} after, of \
                 {}; {substeps} substeps and {repeated} repeated",
                tissue.pentahedron_count()
            );
        }
    }
}

#[test]
fn a_block_squeezed_to_half_between_plates_turns_nothing_inside_out() {
    for shear in SHEARS {
        for ratio in [None, Some(0.3), Some(0.45), Some(0.49)] {
            let material = Material {
                poisson_ratio: ratio,
                support_pa_per_mm: 0.0,
                shear,
                ..Material::default()
            };
            let mut tissue = Tissue::new(&block([12.0; 3], [2.0; 3], shear), &material).expect("a block is a tissue");
            let at = |tissue: &Tissue, z: f32| -> Vec<u32> {
                (0..tissue.node_count() as u32)
                    .filter(|&node| (tissue.rest_position(node).z - z).abs() < 1e-3)
                    .collect()
            };
            let (bottom, top) = (at(&tissue, 0.0), at(&tissue, 12.0));
            let mut worst = 0;
            for frame in 0..60u32 {
                let gap = |frame: u32| 12.0 - 6.0 * (frame as f32 / 30.0).min(1.0);
                let plate = |nodes: &[u32], normal: Vec3, start: f32, end: f32| -> Vec<Contact> {
                    let on = |&node: &u32| Contact::with_plane(TissuePoint::node(node), normal, [start, end]);
                    nodes.iter().map(on).collect()
                };
                let mut contacts = plate(&bottom, Vec3::Z, 0.0, 0.0);
                contacts.extend(plate(&top, -Vec3::Z, -gap(frame), -gap(frame + 1)));
                let report = tissue.advance(1.0 / 60.0, &contacts).expect("divided if need be");
                assert_eq!(report.put_aside, [], "{shear:?}, {ratio:?}");
                worst = worst.max(tissue.inverted_pentahedra().len());
            }
            let (held, volume) = (
                tissue.inverted_pentahedra().len(),
                tissue.volume_mm3() / tissue.initial_volume_mm3(),
            );
            tissue.advance(2.0, &[]).expect("divided if need be");
            let left = tissue.inverted_pentahedra().len();
            assert!(ratio.is_none() || worst == 0, "{shear:?}, {ratio:?}: {worst}");
            println!(
                "plates, {shear:?}, {ratio:?}: {worst} at most, {held} while held (volume {volume:.3}), {left} after, of {}",
                tissue.pentahedron_count()
            );
        }
    }
}

#[test]
fn a_tool_driven_through_leaves_tissue_that_comes_back() {
    for (shear, ratio) in SHEARS
        .into_iter()
        .flat_map(|shear| [None, Some(0.45)].map(|ratio| (shear, ratio)))
    {
        let case = format!("tool, {shear:?}, {ratio:?}");
        let step_s = 1.0 / 60.0;
        let mut tissue = of_lattice(&tube_lattice(12.0), shear, ratio);
        let rest = tissue.volume_mm3();
        let mut worst = 0;
        drive_tool_through(&mut tissue, step_s, |tissue, report| {
            assert_eq!((report.put_aside, report.contacts_refused), (vec![], 0), "{case}");
            worst = worst.max(tissue.inverted_pentahedra().len());
        });
        let pressed = tissue.energy().total();
        for _ in 0..180 {
            let report = tissue.advance(step_s, &[]).expect("divided if need be");
            assert_eq!(report.put_aside, [], "{case}");
        }
        assert_eq!(tissue.validate(), Ok(()), "{case}");
        let left = tissue.inverted_pentahedra().len();
        assert!(ratio.is_none() || worst < 30, "{case}: {worst}");
        println!(
            "{case}: {worst} at most, {left} after, of {}",
            tissue.pentahedron_count()
        );
        let energy = tissue.energy().total();
        assert!(energy < 0.1 * pressed, "{case}: {energy} of {pressed} nJ");
        if shear != ShearResistance::None {
            assert_eq!(left, 0, "{case}");
            let off = (tissue.volume_mm3() / rest - 1.0).abs();
            assert!(off < 1e-6, "{case}: the volume is off by {off}");
        }
    }
}
