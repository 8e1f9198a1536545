//! Hard cases of what is done to a tissue: NaN, infinity, the wrong sign and times, contacts and radii that cannot be are
//! refused by name, and leave everything as it was.

mod common;

use common::networks::{cube, tissue};
use common::{block_mesh, tube};
use glam::{DVec3, Vec3};
use resecta_solver::{
    Contact, EditError, LoopPose, LoopSweep, Material, Pusher, ShearResistance, StepError, Tissue, TissuePoint,
};

const NO_NUMBERS: [f32; 3] = [f32::NAN, f32::INFINITY, f32::NEG_INFINITY];

/// Everything that shows of the motion of a tissue.
fn state(tissue: &Tissue) -> Vec<[Vec3; 3]> {
    (0..tissue.node_count() as u32)
        .map(|node| [tissue.position(node), tissue.velocity(node), tissue.load(node)])
        .collect()
}

#[test]
fn an_edit_with_a_value_that_cannot_be_is_refused_by_name_and_changes_nothing() {
    let mut tissue = tube(18.0, ShearResistance::Diagonals);
    let before = (
        state(&tissue),
        tissue.spring(7),
        tissue.mass_g(7),
        tissue.damping_g_per_s(7),
    );
    for value in NO_NUMBERS.into_iter().chain([-1.0]) {
        let mut refused = vec![
            ("mass", tissue.set_mass(7, value)),
            ("damping", tissue.set_damping(7, value)),
            ("stiffness", tissue.set_spring_stiffness(7, value)),
            ("rest_length", tissue.set_spring_rest_length(7, value)),
        ];
        if !value.is_finite() {
            for vector in
                [Vec3::X, Vec3::Y, Vec3::Z].map(|axis| Vec3::select(axis.cmpgt(Vec3::ZERO), axis * value, axis))
            {
                refused.push(("position", tissue.set_position(7, vector)));
                refused.push(("velocity", tissue.set_velocity(7, vector)));
                refused.push(("load", tissue.set_load(7, vector)));
            }
        }
        for (name, result) in refused {
            match result {
                Err(EditError::Value { field, index: 7, .. }) => assert_eq!(field, name),
                other => panic!("{name} {value}: {other:?}"),
            }
        }
    }
    let after = (
        state(&tissue),
        tissue.spring(7),
        tissue.mass_g(7),
        tissue.damping_g_per_s(7),
    );
    assert_eq!(after, before);
    assert_eq!(tissue.validate(), Ok(()));
}

#[test]
fn an_edit_of_what_is_not_there_is_refused_by_name() {
    let mut tissue = Tissue::new(&block_mesh([2, 2, 2], 1.0), &Material::default()).expect("a block is a tissue");
    let gone = tissue.resect(&[0, 1], None);
    let (node, spring) = (gone.nodes[0], gone.springs[0]);
    for node in [node, 27, u32::MAX] {
        for result in [
            tissue.set_position(node, Vec3::ZERO),
            tissue.set_velocity(node, Vec3::ZERO),
            tissue.set_load(node, Vec3::ZERO),
            tissue.set_mass(node, 1.0),
            tissue.set_damping(node, 1.0),
        ] {
            assert_eq!(
                result,
                Err(EditError::NoSuch {
                    what: "node",
                    index: node
                })
            );
        }
    }
    for spring in [spring, u32::MAX] {
        let refused = Err(EditError::NoSuch {
            what: "spring",
            index: spring,
        });
        assert_eq!(tissue.set_spring_stiffness(spring, 1.0), refused);
        assert_eq!(tissue.set_spring_rest_length(spring, 1.0), refused);
    }
    assert_eq!(tissue.validate(), Ok(()));
}

#[test]
fn a_time_that_cannot_be_is_refused_by_name_and_nothing_moves() {
    let mut tissue = tissue(&cube(3, 0.01, 1_000.0, 0.1));
    tissue.set_load(4, Vec3::X * 100.0).expect("a finite load");
    let before = state(&tissue);
    for time in [0.0, -0.0, -1.0, f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
        assert!(
            matches!(tissue.advance(time, &[]), Err(StepError::Duration(_))),
            "{time}"
        );
        assert!(
            matches!(tissue.advance_steps(time, 3), Err(StepError::Duration(_))),
            "{time}"
        );
    }
    for time in [1e6, 1e300] {
        assert!(
            matches!(tissue.advance(time, &[]), Err(StepError::TooManySubsteps { .. })),
            "{time}"
        );
    }
    assert_eq!(state(&tissue), before);
    // Times too short for single precision are times all the same: next to nothing moves.
    for time in [1e-30, 1e-60, 1e-300] {
        let report = tissue.advance(time, &[]).expect("a time above 0");
        assert_eq!((report.put_aside, tissue.validate()), (vec![], Ok(())), "{time}");
    }
}

fn with_point(point: TissuePoint) -> Contact {
    Contact::new(point, plane(Vec3::X, [-100.0; 2]))
}

fn with_pusher(pusher: Pusher) -> Contact {
    Contact::new(TissuePoint::on_triangle([0, 1, 20], [0.2, 0.3, 0.5]), pusher)
}

fn plane(normal: Vec3, offset_mm: [f32; 2]) -> Pusher {
    Pusher::HalfSpace { normal, offset_mm }
}

fn capsule(end: Vec3, radius_mm: f32) -> Pusher {
    Pusher::Capsule {
        from: [end, Vec3::new(900.0, 0.0, 0.0)],
        to: [Vec3::new(800.0, 0.0, 0.0), Vec3::new(900.0, 0.0, 0.0)],
        radius_mm,
    }
}

#[test]
fn a_contact_with_a_number_that_is_none_is_left_out_and_counted() {
    type Put = fn(f32) -> Contact;
    let at = |weights| TissuePoint::on_triangle([0, 1, 20], weights);
    let fields: [Put; 12] = [
        |value| with_point(TissuePoint::on_triangle([0, 1, 20], [value, 0.3, 0.5])),
        |value| with_point(TissuePoint::on_triangle([0, 1, 20], [0.2, value, 0.5])),
        |value| {
            let weights = [0.2, 0.3, 0.5, 0.0, 0.0, value];
            with_point(TissuePoint::in_pentahedron([0, 1, 20, 2, 3, 4], weights))
        },
        |value| with_pusher(plane(Vec3::new(value, 0.0, 0.0), [-100.0; 2])),
        |value| with_pusher(plane(Vec3::new(1.0, value, 0.0), [-100.0; 2])),
        |value| with_pusher(plane(Vec3::new(1.0, 0.0, value), [-100.0; 2])),
        |value| with_pusher(plane(Vec3::X, [value, -100.0])),
        |value| with_pusher(plane(Vec3::X, [-100.0, value])),
        |value| with_pusher(capsule(Vec3::new(0.0, value, 0.0), 1.0)),
        |value| with_pusher(capsule(Vec3::ZERO, value)),
        |value| Contact {
            inward: Some(Vec3::splat(value)),
            ..with_pusher(capsule(Vec3::ZERO, 1.0))
        },
        |value| Contact {
            overlap_mm: value,
            ..with_pusher(capsule(Vec3::ZERO, 1.0))
        },
    ];
    let plain = Contact::new(at([0.2, 0.3, 0.5]), plane(Vec3::X, [-100.0; 2]));
    let mut contacts = vec![plain];
    for value in NO_NUMBERS {
        contacts.extend(fields.iter().map(|field| field(value)));
    }
    contacts.push(Contact {
        point: TissuePoint::on_triangle([0, 1, u32::MAX], [0.2, 0.3, 0.5]),
        ..plain
    });
    let start = tube(18.0, ShearResistance::Diagonals);
    let (mut touched, mut alone) = (start.clone(), start);
    let report = touched.advance(0.01, &contacts).expect("a plain advance");
    alone.advance(0.01, &[plain]).expect("a plain advance");
    assert_eq!(
        (report.contacts_refused, report.put_aside),
        (contacts.len() - 1, vec![])
    );
    assert_eq!(state(&touched), state(&alone));
}

#[test]
fn a_radius_or_a_sweep_that_cannot_be_finds_nothing() {
    let tissue = tube(18.0, ShearResistance::Diagonals);
    for radius in [f64::NAN, f64::NEG_INFINITY, -1.0, 0.0] {
        assert!(tissue.pentahedra_near(40, radius).is_empty(), "{radius}");
    }
    let all: Vec<u32> = tissue.living_pentahedron_indices().collect();
    assert_eq!(
        tissue.pentahedra_near(40, f64::INFINITY),
        all,
        "without end is all there is"
    );
    let pose = |z: f64| LoopPose {
        centre: DVec3::new(0.0, 0.0, z),
        travel: -DVec3::Z,
        down: DVec3::X,
    };
    let good = LoopSweep {
        from: pose(25.0),
        to: pose(5.0),
        width_mm: 8.0,
        depth_mm: 8.0,
    };
    assert!(!tissue.pentahedra_swept(&good).is_empty());
    type Put = fn(&mut LoopSweep, f64);
    let fields: [Put; 7] = [
        |sweep, value| sweep.from.centre.x = value,
        |sweep, value| sweep.from.travel.y = value,
        |sweep, value| sweep.from.down.z = value,
        |sweep, value| sweep.to.centre.z = value,
        |sweep, value| sweep.to.travel.x = value,
        |sweep, value| sweep.to.down.y = value,
        |sweep, value| sweep.width_mm = -value.abs(),
    ];
    for (put, value) in fields.into_iter().flat_map(|put| NO_NUMBERS.map(|value| (put, value))) {
        let mut sweep = good;
        put(&mut sweep, value.into());
        assert!(tissue.pentahedra_swept(&sweep).is_empty(), "{sweep:?}");
    }
}

#[test]
fn a_node_driven_past_any_speed_is_put_aside_once_by_name_and_the_rest_goes_on() {
    for far in [1e10f32, 1e18, 1e30, f32::MAX] {
        for what in ["velocity", "load"] {
            let mut tissue = tube(18.0, ShearResistance::Diagonals);
            let edit = match what {
                "velocity" => tissue.set_velocity(40, Vec3::splat(far)),
                _ => tissue.set_load(40, Vec3::splat(far)),
            };
            edit.expect("a finite value");
            let report = tissue.advance(1.0 / 60.0, &[]).expect("a plain advance");
            let named: Vec<u32> = report.put_aside.iter().map(|aside| aside.node).collect();
            assert_eq!(named, [40], "{what} {far}");
            assert_eq!(tissue.validate(), Ok(()), "{what} {far}");
            let report = tissue.advance(1.0 / 60.0, &[]).expect("the rest goes on");
            assert_eq!(
                (report.put_aside, report.substeps_repeated),
                (vec![], 0),
                "{what} {far}"
            );
        }
    }
}
