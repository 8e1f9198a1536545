//! Laws of generated glands: sizes, proportions and shape are those of the literature, whatever volume and seed.

use glam::{DVec2, DVec3};
use resecta_anatomy::generate::{GlandSpec, generate};
use resecta_anatomy::{Case, Lattice, LatticeOptions, Slice, contour};

const VOLUMES_ML: [f64; 8] = [15.0, 22.0, 30.0, 40.0, 60.0, 90.0, 120.0, 150.0];

fn every(check: impl Fn(&GlandSpec, &Case)) {
    for volume_ml in VOLUMES_ML {
        for (seed, median_lobe_mm) in [(0, 0.0), (1, 8.0), (2, 20.0), (3, 1.0), (u64::MAX, 11.8)] {
            let spec = GlandSpec {
                volume_ml,
                median_lobe_mm,
                seed,
            };
            check(&spec, &generate(&spec).unwrap());
        }
    }
}

fn centre(slice: &Slice) -> DVec3 {
    contour::centroid(slice.urethra.as_ref().unwrap()).extend(slice.z)
}

/// Trapezium rule over the slices, mm³.
fn volume(slices: &[Slice], area: impl Fn(&Slice) -> f64) -> f64 {
    slices
        .windows(2)
        .map(|pair| 0.5 * (area(&pair[0]) + area(&pair[1])) * (pair[1].z - pair[0].z))
        .sum()
}

#[test]
fn a_generated_gland_keeps_every_rule_and_needs_no_completion() {
    every(|spec, case| {
        assert_eq!(case.validate(), Ok(()), "{spec:?}");
        assert_eq!(&case.clone().complete().unwrap(), case);
        assert!(case.approximated.is_empty());
    });
}

#[test]
fn the_volume_is_the_one_asked_for() {
    for (volume_ml, median_lobe_mm) in [(15.0, 0.0), (30.0, 0.0), (60.0, 8.0), (90.0, 10.0), (150.0, 20.0)] {
        let case = generate(&GlandSpec {
            volume_ml,
            median_lobe_mm,
            seed: 11,
        })
        .unwrap();
        let lattice = Lattice::build(
            &case,
            &LatticeOptions {
                alpha_deg: 10.0,
                axial_points: None,
            },
        )
        .unwrap();
        let ml = lattice.capsule_volume_mm3 / 1000.0;
        assert!((ml / volume_ml - 1.0).abs() < 0.005, "{ml} of {volume_ml} ml");
    }
}

#[test]
fn sizes_lie_within_three_deviations_of_the_published_means() {
    // Volume; mean and deviation of left-right, anterior-posterior, base-apex.
    for (volume_ml, sizes) in [
        (30.0, [(46.7, 3.4), (34.6, 2.8), (38.8, 3.8)]),
        (52.5, [(53.6, 3.7), (43.9, 3.9), (46.7, 4.5)]),
        (95.0, [(61.0, 4.1), (54.5, 5.0), (57.1, 5.2)]),
    ] {
        for seed in 0..20 {
            let case = generate(&GlandSpec {
                volume_ml,
                median_lobe_mm: 0.0,
                seed,
            })
            .unwrap();
            let (low, high) = case
                .slices
                .iter()
                .fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(low, high), slice| {
                    let [least, most] = contour::bounds(&slice.capsule);
                    (low.min(least.extend(slice.z)), high.max(most.extend(slice.z)))
                });
            for (axis, (mean, deviation)) in sizes.into_iter().enumerate() {
                let size = (high - low)[axis];
                assert!(
                    (size - mean).abs() < 3.0 * deviation,
                    "{volume_ml} ml, seed {seed}, axis {axis}: {size}"
                );
            }
        }
    }
}

#[test]
fn the_transition_zone_has_its_published_share() {
    for (volume_ml, share) in [(30.0, 0.52), (40.0, 0.58), (70.0, 0.70), (95.0, 0.76)] {
        for median_lobe_mm in [0.0, 10.0] {
            let case = generate(&GlandSpec {
                volume_ml,
                median_lobe_mm,
                seed: 4,
            })
            .unwrap();
            let area =
                |contour: Option<&Vec<DVec2>>| contour.map_or(0.0, |contour| contour::signed_area(contour).abs());
            let zone = volume(&case.slices, |slice| area(slice.transition_zone.as_ref()));
            let whole = volume(&case.slices, |slice| area(Some(&slice.capsule)));
            assert!((zone / whole - share).abs() < 0.02, "{volume_ml} ml: {}", zone / whole);
        }
    }
}

#[test]
fn the_urethra_bends_at_the_verumontanum_by_the_published_angle() {
    every(|spec, case| {
        let neck = case.landmarks.bladder_neck.unwrap();
        let verumontanum = case.landmarks.verumontanum.unwrap();
        let line: Vec<DVec3> = case.slices.iter().map(centre).collect();
        let corner = verumontanum.z;
        let above: Vec<DVec3> = line
            .iter()
            .copied()
            .filter(|point| point.z > corner + 2.0 && point.z <= neck.z)
            .collect();
        let below: Vec<DVec3> = line.iter().copied().filter(|point| point.z < corner - 2.0).collect();
        let up = above[above.len() - 1] - above[0];
        let down = below[0] - below[below.len() - 1];
        let angle = up.angle_between(down).to_degrees();
        assert!((129.0..144.0).contains(&angle), "{spec:?}: {angle}");
        assert!(
            up.y < 0.0 && down.y < 0.0,
            "both parts lead forward from the verumontanum"
        );
        let share = (neck.z - corner) / (neck.z - line[0].z);
        assert!((share - 34.0 / 45.0).abs() < 0.01);
    });
}

#[test]
fn every_capsule_is_seen_whole_from_the_urethra() {
    every(|spec, case| {
        for (index, slice) in case.slices.iter().enumerate() {
            let centre = centre(slice).truncate();
            let turns = contour::edges(&slice.capsule).map(|[a, b]| (a - centre).perp_dot(b - centre));
            assert!(turns.into_iter().all(|turn| turn > 0.0), "{spec:?} slice {index}");
        }
    });
}

#[test]
fn the_middle_lobe_protrudes_behind_the_lumen_by_the_length_asked_for() {
    every(|spec, case| {
        let neck = case.landmarks.bladder_neck.unwrap();
        let top = case.slices[case.slices.len() - 1].z;
        assert!((top - neck.z - spec.median_lobe_mm).abs() < 1e-9);
        for slice in case.slices.iter().filter(|slice| slice.z > neck.z) {
            let [low, high] = contour::bounds(&slice.capsule);
            let middle = centre(slice).y;
            assert!(high.y - middle > 1.1 * (middle - low.y), "{spec:?} at {}", slice.z);
        }
    });
}

#[test]
fn the_same_specification_gives_the_same_text_and_another_seed_another_gland() {
    let spec = GlandSpec {
        volume_ml: 55.0,
        median_lobe_mm: 6.0,
        seed: 42,
    };
    let text = generate(&spec).unwrap().to_ron();
    assert_eq!(text, generate(&spec).unwrap().to_ron());
    let other = generate(&GlandSpec { seed: 43, ..spec }).unwrap();
    assert_ne!(generate(&spec).unwrap().slices, other.slices);
}

#[test]
fn impossible_glands_are_refused_by_name() {
    let refused = |volume_ml, median_lobe_mm| {
        generate(&GlandSpec {
            volume_ml,
            median_lobe_mm,
            seed: 1,
        })
        .unwrap_err()
        .to_string()
    };
    for volume_ml in [14.9, 151.0, -30.0, f64::NAN, f64::INFINITY] {
        assert!(refused(volume_ml, 0.0).contains("volume_ml"));
    }
    for median_lobe_mm in [-0.1, 20.1, f64::NAN] {
        assert!(refused(60.0, median_lobe_mm).contains("median_lobe_mm"));
    }
}
