//! Laws that every lattice keeps, on organs made by formula.

use std::collections::BTreeMap;
use std::f64::consts::{PI, TAU};

use glam::{DVec2, DVec3};
use proptest::prelude::*;
use resecta_anatomy::{Boundary, Lattice, LatticeError, LatticeOptions, Section, Zone, wedge};

type Contours = Vec<(f64, Vec<DVec2>, Vec<DVec2>)>;

fn options(alpha_deg: f64) -> LatticeOptions {
    LatticeOptions {
        alpha_deg,
        ..LatticeOptions::default()
    }
}

fn ring(centre: DVec2, corners: usize, radius: impl Fn(f64) -> f64) -> Vec<DVec2> {
    (0..corners)
        .map(|corner| TAU * corner as f64 / corners as f64)
        .map(|angle| centre + DVec2::from_angle(angle) * radius(angle))
        .collect()
}

fn build(contours: &Contours, options: &LatticeOptions) -> Result<Lattice, LatticeError> {
    let sections: Vec<Section> = (contours.iter())
        .map(|(z, outer, inner)| Section { z: *z, outer, inner })
        .collect();
    Lattice::from_sections(&sections, options)
}

fn shell(radius: impl Fn(f64) -> f64, lumen: f64, heights: &[f64]) -> Contours {
    (heights.iter())
        .map(|&z| {
            (
                z,
                ring(DVec2::ZERO, 3600, |_| radius(z)),
                ring(DVec2::ZERO, 3600, |_| lumen),
            )
        })
        .collect()
}

/// Even heights from -20 to 20 mm.
fn heights(count: usize) -> Vec<f64> {
    (0..count)
        .map(|i| -20.0 + 40.0 * i as f64 / (count - 1) as f64)
        .collect()
}

fn smallest_volume(lattice: &Lattice) -> f64 {
    (lattice.pentahedra.iter())
        .map(|nodes| wedge::volume(nodes, |node| lattice.positions[node as usize]))
        .fold(f64::INFINITY, f64::min)
}

/// Faces of one pentahedron only: the exposed surface.
fn surface(lattice: &Lattice) -> Vec<[u32; 3]> {
    let mut faces = BTreeMap::new();
    for triangle in lattice.pentahedra.iter().flat_map(wedge::boundary) {
        let mut key = triangle;
        key.sort_unstable();
        if faces.remove(&key).is_none() {
            faces.insert(key, triangle);
        }
    }
    faces.into_values().collect()
}

#[test]
fn a_cylinder_shell_keeps_its_volume_at_every_angle() {
    let exact = PI * (20.0f64.powi(2) - 3.0f64.powi(2)) * 40.0;
    for alpha in [4.0, 8.0, 11.0, 30.0, 120.0] {
        let lattice = build(&shell(|_| 20.0, 3.0, &heights(5)), &options(alpha)).unwrap();
        let error = lattice.volume_mm3() / exact - 1.0;
        assert!(error.abs() < 1e-5, "{alpha} degrees: {error}");
        assert!((lattice.contour_volume_mm3 / exact - 1.0).abs() < 1e-5);
    }
}

#[test]
fn the_volume_of_a_rounded_shell_converges_with_order_two() {
    let radius = |z: f64| (25.0f64.powi(2) - z * z).sqrt();
    let error = |alpha| {
        let lattice = build(&shell(radius, 3.0, &heights(41)), &options(alpha)).unwrap();
        (lattice.volume_mm3() / lattice.contour_volume_mm3 - 1.0).abs()
    };
    let (coarse, fine) = (error(16.0), error(4.0));
    let order = (coarse / fine).log2() / 2.0;
    assert!((1.8..2.2).contains(&order), "errors {coarse}, {fine}: order {order}");
}

#[test]
fn the_capsule_is_met_with_order_two() {
    // Distance between the middles of the lattice's outer edges and an ellipse around an eccentric lumen.
    let lumen = DVec2::new(4.0, -3.0);
    let outer: Vec<DVec2> = ring(DVec2::ZERO, 7200, |_| 1.0)
        .iter()
        .map(|p| *p * DVec2::new(24.0, 17.0))
        .collect();
    let contours: Contours = (heights(4).into_iter())
        .map(|z| (z, outer.clone(), ring(lumen, 720, |_| 2.5)))
        .collect();
    let error = |alpha| {
        let lattice = build(&contours, &options(alpha)).unwrap();
        let shape = lattice.shape;
        (0..shape.angles)
            .map(|j| {
                let at = |j| lattice.positions[shape.index(0, j, shape.layers - 1) as usize].truncate();
                let middle: DVec2 = (at(j) + at(j + 1)) / 2.0;
                outer.iter().map(|p| p.distance(middle)).fold(f64::INFINITY, f64::min)
            })
            .fold(0.0, f64::max)
    };
    let (coarse, fine) = (error(16.0), error(4.0));
    let order = (coarse / fine).log2() / 2.0;
    assert!((1.7..2.3).contains(&order), "errors {coarse}, {fine}: order {order}");
}

#[test]
fn the_exposed_surface_is_closed_and_encloses_the_sum_of_the_pentahedra() {
    let lattice = build(&shell(|z| 20.0 - 0.01 * z * z, 3.0, &heights(7)), &options(10.0)).unwrap();
    let surface = surface(&lattice);
    let mut edges = BTreeMap::new();
    for &[a, b, c] in &surface {
        for [from, to] in [[a, b], [b, c], [c, a]] {
            *edges.entry((from.min(to), from.max(to))).or_insert(0) += if from < to { 1 } else { -1 };
        }
    }
    assert!(edges.values().all(|&balance| balance == 0), "an open edge");
    let place = |node: u32| lattice.positions[node as usize];
    let enclosed: f64 = (surface.iter())
        .map(|&[a, b, c]| place(a).dot(place(b).cross(place(c))) / 6.0)
        .sum();
    assert!((enclosed / lattice.volume_mm3() - 1.0).abs() < 1e-12);
}

#[test]
fn the_first_and_last_slices_are_kept() {
    let contours = shell(|z| 15.0 + 0.1 * z, 2.0, &[-3.0, 1.0, 2.5, 17.3]);
    let lattice = build(&contours, &options(8.0)).unwrap();
    let shape = lattice.shape;
    for (i, z) in [(0, -3.0), (shape.slices - 1, 17.3)] {
        let node = lattice.positions[shape.index(i, 0, shape.layers - 1) as usize];
        assert_eq!(node.z, z);
        // The ring stands outside the arc by as much as keeps its polygon's area.
        assert!((node.x / (15.0 + 0.1 * z) - 1.0).abs() < 2e-3, "{node}");
    }
}

/// A gland-like organ with `roughness` on every radius and a lumen that wanders, made from few numbers.
fn rough_organ(radii: &[f64], wander: &[f64], lumen: f64, gaps: &[f64]) -> Contours {
    let mut z = 0.0;
    (gaps.iter().enumerate())
        .map(|(slice, gap)| {
            z += gap;
            let of_slice: Vec<f64> = (0..12)
                .map(|corner| radii[(slice * 12 + corner) % radii.len()])
                .collect();
            let angle = wander[slice % wander.len()] * TAU;
            let centre = DVec2::from_angle(angle) * 4.0;
            (
                z,
                ring(DVec2::ZERO, 12, |at| of_slice[(at / TAU * 12.0).round() as usize]),
                ring(centre, 24, |_| lumen),
            )
        })
        .collect()
}

fn turned(contours: &Contours, angle: f64) -> Contours {
    let turn = DVec2::from_angle(angle);
    let all = |contour: &[DVec2]| contour.iter().map(|p| turn.rotate(*p)).collect();
    contours
        .iter()
        .map(|(z, outer, inner)| (*z, all(outer), all(inner)))
        .collect()
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn no_pentahedron_is_inverted_and_the_volume_is_kept(
        radii in proptest::collection::vec(9.0..28.0f64, 30..80),
        wander in proptest::collection::vec(0.0..1.0f64, 1..9),
        lumen in 0.5..3.5f64,
        gaps in proptest::collection::vec(0.5..7.0f64, 4..12),
        alpha in 5.0..16.0f64,
    ) {
        let lattice = build(&rough_organ(&radii, &wander, lumen, &gaps), &options(alpha)).unwrap();
        prop_assert!(smallest_volume(&lattice) > 0.0);
        prop_assert!(lattice.quality().min > 0.0);
        prop_assert!(lattice.zones.iter().all(|&zone| zone == Zone::Other));
        prop_assert!(lattice.positions.iter().all(|place| place.is_finite()));
    }

    #[test]
    fn the_sense_of_a_contour_and_its_first_corner_do_not_matter(
        radii in proptest::collection::vec(9.0..28.0f64, 30..80),
        lumen in 0.5..3.5f64,
        shift in 0..12usize,
    ) {
        let contours = rough_organ(&radii, &[0.1, 0.3], lumen, &[3.0; 5]);
        let mut other = contours.clone();
        for (_, outer, inner) in &mut other {
            outer.reverse();
            outer.rotate_left(shift);
            inner.reverse();
        }
        let (one, two) = (build(&contours, &options(8.0)).unwrap(), build(&other, &options(8.0)).unwrap());
        prop_assert_eq!(one.shape, two.shape);
        let apart = one.positions.iter().zip(&two.positions).map(|(a, b)| a.distance(*b)).fold(0.0, f64::max);
        prop_assert!(apart < 1e-9, "{}", apart);
    }

    #[test]
    fn turning_the_organ_by_whole_steps_turns_its_lattice(
        radii in proptest::collection::vec(9.0..28.0f64, 30..80),
        lumen in 0.5..3.5f64,
        steps in 1..45u32,
    ) {
        let contours = rough_organ(&radii, &[0.12, 0.31, 0.7], lumen, &[3.0; 5]);
        let angle = f64::from(steps) * TAU / 45.0;
        let one = build(&contours, &options(8.0)).unwrap();
        let two = build(&turned(&contours, angle), &options(8.0)).unwrap();
        prop_assert_eq!(one.shape, two.shape);
        let turn = DVec2::from_angle(angle);
        for (node, place) in one.positions.iter().enumerate() {
            let [i, j, k] = one.shape.coordinates(node as u32);
            let other = two.positions[two.shape.index(i, j + steps, k) as usize];
            let expected: DVec3 = turn.rotate(place.truncate()).extend(place.z);
            prop_assert!(other.distance(expected) < 1e-6, "node {}: {} instead of {}", node, other, expected);
        }
    }
}

#[test]
fn options_and_slices_that_cannot_be_are_named() {
    let contours = shell(|_| 20.0, 3.0, &heights(5));
    for alpha in [0.0, -8.0, f64::NAN, 121.0, f64::INFINITY] {
        let error = build(&contours, &options(alpha)).unwrap_err();
        assert!(matches!(error, LatticeError::Alpha { .. }), "{alpha}: {error}");
    }
    for alpha in [1e-300, 1e-6, 0.05] {
        let error = build(&contours, &options(alpha)).unwrap_err();
        assert!(matches!(error, LatticeError::TooFine { .. }), "{alpha}: {error}");
    }
    let one_point = LatticeOptions {
        axial_points: Some(1),
        ..LatticeOptions::default()
    };
    assert_eq!(
        build(&contours, &one_point),
        Err(LatticeError::AxialPoints { value: 1 })
    );
    let one_slice = contours[..1].to_vec();
    assert_eq!(
        build(&one_slice, &options(8.0)),
        Err(LatticeError::TooFewSlices { count: 1 })
    );

    let mut repeated = contours.clone();
    repeated[3].0 = repeated[2].0;
    assert!(matches!(
        build(&repeated, &options(8.0)),
        Err(LatticeError::Height { slice: 3, .. })
    ));
    let mut no_number = contours.clone();
    no_number[1].1[17].x = f64::NAN;
    let error = build(&no_number, &options(8.0)).unwrap_err();
    assert!(
        matches!(
            error,
            LatticeError::Contour {
                slice: 1,
                boundary: Boundary::Outer,
                ..
            }
        ),
        "{error}"
    );
    let mut outside = contours;
    for corner in &mut outside[4].2 {
        corner.x += 50.0;
    }
    let error = build(&outside, &options(8.0)).unwrap_err();
    assert!(
        matches!(
            error,
            LatticeError::NotAround {
                slice: 4,
                boundary: Boundary::Outer,
                ..
            }
        ),
        "{error}"
    );
}

#[test]
fn the_number_of_axial_points_can_be_given() {
    let wanted = LatticeOptions {
        axial_points: Some(17),
        ..LatticeOptions::default()
    };
    let lattice = build(&shell(|_| 20.0, 3.0, &heights(5)), &wanted).unwrap();
    assert_eq!(lattice.shape.slices, 17);
    assert_eq!(lattice.shape.node_count(), lattice.positions.len());
    assert_eq!(lattice.shape.pentahedron_count(), lattice.pentahedra.len());
}
