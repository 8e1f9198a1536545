//! Regions that adjoin share nothing and leave nothing out.

use std::f64::consts::TAU;

use bevy::math::{DVec2, DVec3};
use proptest::prelude::*;
use resecta_anatomy::{Landmarks, Lattice, LatticeOptions, Section, Zone};
use resecta_scenario::{ClockRange, HeightRange, Marked, MarkedRegion, Range};

/// A tube about a bent line: no clock hour, height or depth is the same everywhere.
fn tube() -> Lattice {
    let circle = |centre: DVec2, radius: f64| -> Vec<DVec2> {
        (0..48)
            .map(|corner| centre + radius * DVec2::from_angle(TAU * f64::from(corner) / 48.0))
            .collect()
    };
    let contours: Vec<_> = (0..6)
        .map(|slice| {
            let z = 5.0 * f64::from(slice);
            (
                z,
                circle(DVec2::ZERO, 16.0),
                circle(DVec2::new(1.0, -2.0 + 0.1 * z), 3.0),
            )
        })
        .collect();
    let sections: Vec<Section> = contours
        .iter()
        .map(|(z, outer, inner)| Section { z: *z, outer, inner })
        .collect();
    Lattice::from_sections(
        &sections,
        &LatticeOptions {
            alpha_deg: 10.0,
            axial_points: None,
        },
    )
    .unwrap()
}

fn landmarks() -> Landmarks {
    Landmarks {
        bladder_neck: Some(DVec3::new(0.0, 0.0, 22.0)),
        verumontanum: Some(DVec3::new(0.0, 0.0, 4.0)),
        ..Landmarks::default()
    }
}

const ALL: Marked = Marked {
    zones: Vec::new(),
    clock: None,
    height: None,
    depth_mm: None,
    dyed: true,
};

/// The parts of a partition must hold every pentahedron of the whole once.
fn assert_partition(lattice: &Lattice, parts: impl IntoIterator<Item = Marked>) {
    let region = |marked: Marked| {
        MarkedRegion::of_lattice(
            &Marked {
                zones: vec![Zone::Other],
                ..marked
            },
            lattice,
            &landmarks(),
        )
    };
    let whole = region(ALL);
    let parts: Vec<MarkedRegion> = parts.into_iter().map(region).collect();
    for pentahedron in 0..lattice.pentahedra.len() as u32 {
        let holders = parts.iter().filter(|part| part.contains(pentahedron)).count();
        assert_eq!(holders, 1, "pentahedron {pentahedron} is in {holders} parts");
    }
    let sum: f64 = parts.iter().map(MarkedRegion::total_mm3).sum();
    assert!((sum - whole.total_mm3()).abs() < 1e-9 * whole.total_mm3());
    assert!((sum - lattice.volume_mm3()).abs() < 1e-9 * sum);
}

#[test]
fn a_clock_range_turned_anywhere_and_its_complement_are_the_whole() {
    let lattice = tube();
    for from in [0.0, 0.5, 2.0, 5.0, 7.25, 11.0, 12.0] {
        for width in [0.25, 2.0, 6.0, 11.5] {
            let to = (from + width) % 12.0;
            let parts = [ClockRange { from, to }, ClockRange { from: to, to: from }];
            assert_partition(
                &lattice,
                parts.map(|clock| Marked {
                    clock: Some(clock),
                    ..ALL
                }),
            );
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]

    #[test]
    fn three_hours_cut_the_clock_into_three(mut hours in prop::array::uniform3(0.0..12.0f64)) {
        hours.sort_by(f64::total_cmp);
        prop_assume!(hours[0] < hours[1] && hours[1] < hours[2]);
        let parts = [0, 1, 2].map(|part| ClockRange { from: hours[part], to: hours[(part + 1) % 3] });
        assert_partition(&tube(), parts.map(|clock| Marked { clock: Some(clock), ..ALL }));
    }

    #[test]
    fn heights_and_depths_that_meet_share_nothing(at in 0.5..20.0f64) {
        let lattice = tube();
        let heights = [
            HeightRange::AboveVerumontanum { from_mm: -100.0, to_mm: at },
            HeightRange::AboveVerumontanum { from_mm: at, to_mm: 100.0 },
        ];
        assert_partition(&lattice, heights.map(|height| Marked { height: Some(height), ..ALL }));
        let below = [
            HeightRange::BelowBladderNeck { from_mm: -100.0, to_mm: at },
            HeightRange::BelowBladderNeck { from_mm: at, to_mm: 100.0 },
        ];
        assert_partition(&lattice, below.map(|height| Marked { height: Some(height), ..ALL }));
        let depths = [Range { from: 0.0, to: at }, Range { from: at, to: 100.0 }];
        assert_partition(&lattice, depths.map(|depth| Marked { depth_mm: Some(depth), ..ALL }));
    }
}

#[test]
fn both_ways_to_say_a_height_agree() {
    // The neck stands 18 mm above the verumontanum.
    let region = |height| {
        let marked = Marked {
            zones: vec![Zone::Other],
            height: Some(height),
            ..ALL
        };
        MarkedRegion::of_lattice(&marked, &tube(), &landmarks())
    };
    let below = region(HeightRange::BelowBladderNeck {
        from_mm: 3.01,
        to_mm: 12.01,
    });
    let above = region(HeightRange::AboveVerumontanum {
        from_mm: 5.99,
        to_mm: 14.99,
    });
    assert!(below.total_mm3() > 0.0);
    assert_eq!(below, above);
}

#[test]
fn six_oclock_lies_behind_the_urethra_and_three_on_the_patients_left() {
    let lattice = tube();
    let side = |from, to| {
        let clock = Some(ClockRange { from, to });
        let marked = Marked {
            zones: vec![Zone::Other],
            clock,
            ..ALL
        };
        let region = MarkedRegion::of_lattice(&marked, &lattice, &landmarks());
        let nodes: Vec<u32> = region
            .pentahedra()
            .flat_map(|index| lattice.pentahedra[index as usize])
            .collect();
        nodes
            .iter()
            .map(|&node| lattice.positions[node as usize])
            .sum::<DVec3>()
            / nodes.len() as f64
    };
    let (behind, left) = (side(5.0, 7.0), side(2.0, 4.0));
    assert!(behind.y > 5.0 && behind.x.abs() < 2.0, "{behind}");
    assert!(left.x > 5.0 && left.y.abs() < 2.0, "{left}");
}
