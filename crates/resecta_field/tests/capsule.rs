//! Laws of the capsule's area: a perforation is told at once, and how large it is.

mod common;

use common::{Random, block, current, tube, tube_field};
use glam::{DVec3, Vec3};
use resecta_anatomy::wedge;
use resecta_field::{Field, SurfaceKind, Tool};

const SIDE_MM: f64 = 12.0;

/// A block of which the side where this component is largest is the capsule.
fn block_with_capsule(axis: usize, spacing: f64) -> (Field, Vec<Vec3>) {
    let (rest, pentahedra) = block([6, 6, 6], 2.0);
    let field = Field::new(&rest, &pentahedra, spacing, |pentahedron, face| {
        let corners: &[usize] = if face < 2 {
            &wedge::TRIANGLES[face]
        } else {
            &wedge::QUADS[face - 2]
        };
        let nodes = &pentahedra[pentahedron as usize];
        let is_there = |&corner: &usize| rest[nodes[corner] as usize][axis] == SIDE_MM;
        if corners.iter().all(is_there) {
            SurfaceKind::Capsule
        } else {
            SurfaceKind::Other
        }
    });
    let stretched = current(&rest, |place| place * DVec3::new(1.2, 1.0, 1.0));
    (field.expect("a block is a tissue"), stretched)
}

/// The component that all of the capsule has: the block's last corner is on it.
fn capsule_at(positions: &[Vec3], axis: usize) -> f64 {
    f64::from(positions[positions.len() - 1][axis])
}

/// Triangles (2) and quadrilaterals (0, 1) of the lattice as the capsule, in a block stretched along the first axis.
#[test]
fn a_plane_takes_the_exact_area_of_the_capsule() {
    for axis in 0..3 {
        let (mut field, positions) = block_with_capsule(axis, 0.5);
        // The flat side of a half cylinder wider than the block, across the capsule and askew.
        let along = DVec3::AXES[axis];
        let across = DVec3::AXES[(axis + 1) % 3];
        let down = (across + 0.3 * DVec3::AXES[(axis + 2) % 3]).normalize();
        let stretch = DVec3::new(1.2, 1.0, 1.0);
        let middle = DVec3::splat(0.5 * SIDE_MM) * stretch;
        let tool = Tool::HalfCylinder {
            from: middle - 40.0 * along,
            to: middle + 40.0 * along,
            down,
            radius_mm: 60.0,
        };
        // Through the middle: half of it.
        let exact = 0.5 * SIDE_MM * SIDE_MM;
        let cut = field.cut(&tool, &positions).expect("a good tool");
        assert!(
            (cut.capsule_mm2 / exact - 1.0).abs() < 1e-3,
            "{axis}: {}",
            cut.capsule_mm2
        );
        // What is gone is not told again.
        let again = field.cut(&tool, &positions).expect("a good tool");
        assert_eq!(again.capsule_mm2, 0.0);
    }
}

#[test]
fn a_hole_in_the_capsule_has_its_exact_area_to_second_order() {
    for axis in 0..3 {
        let errors = [1.0, 0.5, 0.25].map(|spacing| {
            let (mut field, positions) = block_with_capsule(axis, spacing);
            let height = 1.3;
            let mut centre = DVec3::new(7.3, 6.1, 5.9);
            centre[axis] = capsule_at(&positions, axis) - height;
            let cut = field
                .cut(&Tool::Sphere { centre, radius_mm: 4.0 }, &positions)
                .expect("a good tool");
            // At rest the circle is narrower where the stretch lies in the capsule.
            let exact = std::f64::consts::PI * (16.0 - height * height) / if axis == 0 { 1.0 } else { 1.2 };
            cut.capsule_mm2 / exact - 1.0
        });
        println!("axis {axis}: errors {errors:.5?}");
        assert!(errors[1].abs() < 0.01, "{errors:?}");
        for pair in errors.windows(2) {
            assert!(pair[0].abs() > 3.0 * pair[1].abs(), "{errors:?}");
        }
    }
}

#[test]
fn a_cut_that_stays_inside_takes_no_capsule() {
    for axis in 0..3 {
        let (mut field, positions) = block_with_capsule(axis, 0.5);
        // Half a millimetre below the capsule, in pentahedra that carry it, and out through the side opposite.
        let mut top = DVec3::new(7.2, 6.0, 6.0);
        top[axis] = capsule_at(&positions, axis) - 4.5;
        for centre in [top, top - 6.0 * DVec3::AXES[axis]] {
            let cut = field
                .cut(&Tool::Sphere { centre, radius_mm: 4.0 }, &positions)
                .expect("a good tool");
            assert!(cut.removed_mm3 > 50.0);
            assert_eq!(cut.capsule_mm2, 0.0);
        }
    }
}

#[test]
fn all_cuts_together_take_the_capsule() {
    let lattice = tube(20.0, 14.0, 20.0);
    let mut field = tube_field(&lattice, 0.8);
    // Every free face along the tube is capsule there: a face has four nodes, and no second pentahedron.
    let mut faces = std::collections::HashMap::new();
    for nodes in &lattice.pentahedra {
        for corners in wedge::QUADS {
            let face = corners.map(|corner| nodes[corner]);
            let mut key = face;
            key.sort_unstable();
            faces.entry(key).or_insert_with(Vec::new).push(face);
        }
    }
    let capsule: f64 = (faces.values().filter(|both| both.len() == 1))
        .map(|both| both[0].map(|node| lattice.positions[node as usize]))
        .map(|[a, b, c, d]| 0.5 * (c - a).cross(d - b).length())
        .sum();
    let positions = current(&lattice.positions, |place| place);
    let mut random = Random(29);
    let mut taken = 0.0;
    for _ in 0..60 {
        let angle = random.between(0.0, std::f64::consts::TAU);
        let centre = DVec3::new(angle.cos(), angle.sin(), 0.0) * random.between(3.0, 11.0);
        let tool = Tool::Sphere {
            centre: centre + DVec3::Z * random.between(0.0, 14.0),
            radius_mm: random.between(0.5, 3.0),
        };
        let cut = field.cut(&tool, &positions).expect("a good tool");
        assert!(cut.capsule_mm2 >= 0.0);
        taken += cut.capsule_mm2;
    }
    assert!(taken > 0.1 * capsule && taken < capsule, "{taken} of {capsule}");
    let all: Vec<u32> = (0..field.pentahedron_count() as u32).collect();
    taken += field.empty(&all).expect("pentahedra of the field").capsule_mm2;
    assert!((taken / capsule - 1.0).abs() < 1e-9, "{taken} of {capsule}");
}
