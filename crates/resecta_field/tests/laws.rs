//! Laws of the field: closed, conserving, sparse, deterministic, whatever is cut in whatever shape.

mod common;

use common::{
    Random, assert_closed, assert_sound, block, block_field, chip_is_closed, current, deformed, enclosed, tube,
    tube_field,
};
use glam::{DVec3, Vec3};
use resecta_anatomy::wedge;
use resecta_field::{Cut, Field, FieldError, LoopStroke, SurfaceKind, Tool};
use resecta_solver::LoopPose;

/// A stroke of a few steps through a place on the tube, in any pose, some of them turning.
fn random_stroke(random: &mut Random) -> Vec<Tool> {
    let angle = random.between(0.0, std::f64::consts::TAU);
    let place =
        DVec3::new(angle.cos(), angle.sin(), 0.0) * random.between(3.0, 13.0) + DVec3::Z * random.between(0.0, 24.0);
    let (travel, turn) = (random.direction(), 0.1 * random.direction());
    let down = random.direction().reject_from_normalized(travel).normalize();
    let (steps, length) = (1 + (random.next() * 4.0) as i32, random.between(0.2, 1.6));
    let pose = |n: i32| {
        let travel = (travel + turn * f64::from(n)).normalize();
        LoopPose {
            centre: deformed(place) + travel * length * f64::from(n),
            travel,
            down: down.reject_from_normalized(travel).normalize(),
        }
    };
    // Every other current vaporises a kerf, and what is thin beside it.
    let kerf_mm = (0.6 * angle.sin()).max(0.0);
    let stroke = LoopStroke::new(pose(0), 6.5, 4.5);
    let mut stroke = stroke.with_kerf(kerf_mm).with_thin(2.0 * kerf_mm);
    (1..=steps).map(|n| stroke.step_to(pose(n))).collect()
}

#[test]
fn two_hundred_random_strokes_leave_a_sound_field() {
    let lattice = tube(24.0, 24.0, 15.0);
    let mut field = tube_field(&lattice, 0.7);
    let positions = current(&lattice.positions, deformed);
    assert_closed(field.surface().triangles(), "uncut");
    let nothing_holds = field.holds(|_| false);
    let mut random = Random(11);
    let mut volume = field.volume_mm3();
    let mut chips = 0.0;
    let mut freed = 0.0;
    for stroke in 0..200 {
        let what = format!("stroke {stroke}");
        field.begin_chip();
        let fills: Vec<f64> = (0..field.pentahedron_count() as u32).map(|n| field.fill(n)).collect();
        let (mut reported, mut pentahedra) = (0.0, Vec::new());
        for tool in random_stroke(&mut random) {
            let cut = field.cut(&tool, &positions).expect("a good tool");
            assert!(cut.removed.iter().all(|&(_, lost)| lost > 0.0), "{what}");
            reported += cut.removed_mm3;
            pentahedra.extend(cut.removed.iter().map(|&(pentahedron, _)| pentahedron));
        }
        for (pentahedron, fill) in (0..).zip(fills) {
            assert!(
                field.fill(pentahedron) <= fill,
                "{what}: pentahedron {pentahedron} grew"
            );
        }
        let lost = volume - field.volume_mm3();
        assert!(
            (lost - reported).abs() < 1e-9 * field.initial_volume_mm3(),
            "{what}: {lost} against {reported}"
        );
        assert_sound(&field, &what);
        // What holds shortens searches and changes no answer.
        let is_held = |pentahedron: u32| pentahedron.is_multiple_of(97);
        let mut parts = field.loose_pieces(&pentahedra, f64::INFINITY, &nothing_holds);
        parts.retain(|part| part.rest_volume_mm3 <= 200.0 && !part.pentahedra.iter().any(|&n| is_held(n)));
        assert_eq!(
            field.loose_pieces(&pentahedra, 200.0, &field.holds(is_held)),
            parts,
            "{what}"
        );
        for piece in field.loose_pieces(&pentahedra, 200.0, &nothing_holds) {
            let cut = field.empty(&piece.pentahedra).expect("pentahedra of the field");
            assert!(cut.removed_mm3 >= piece.rest_volume_mm3 * (1.0 - 1e-12), "{what}");
            assert!(
                piece
                    .pentahedra
                    .iter()
                    .all(|&pentahedron| field.fill(pentahedron) == 0.0),
                "{what}"
            );
            reported += cut.removed_mm3;
            freed += piece.rest_volume_mm3;
            assert_sound(&field, &what);
        }
        if let Some(chip) = field.take_chip(&positions).expect("good positions") {
            chip_is_closed(&chip);
            let whole = chip.rest_volume_mm3 + chip.vaporised_mm3;
            assert!(chip.rest_volume_mm3 >= 0.0 && chip.vaporised_mm3 >= 0.0, "{what}");
            chips += whole;
            assert!((whole - reported).abs() < 1e-9 * field.initial_volume_mm3(), "{what}");
        }
        volume = field.volume_mm3();
    }
    let sum = chips + field.volume_mm3();
    println!(
        "{chips:.1} mm³ in chips, {freed:.1} of it came loose, {:.1} left",
        field.volume_mm3()
    );
    assert!(
        (sum / field.initial_volume_mm3() - 1.0).abs() < 1e-9,
        "chips and rest make {sum}"
    );
}

#[test]
fn a_block_that_is_cut_through_and_through_stays_closed() {
    // Quadrilaterals exposed beside triangles, edges with several fans, cells that end in nothing.
    let mut field = block_field([3, 3, 3], 2.0, 0.6);
    let (rest, _) = block([3, 3, 3], 2.0);
    let positions = current(&rest, |place| place);
    let mut random = Random(5);
    for n in 0..150 {
        let centre = DVec3::new(
            random.between(-0.5, 6.5),
            random.between(-0.5, 6.5),
            random.between(-0.5, 6.5),
        );
        let radius_mm = random.between(0.2, 1.3);
        field
            .cut(&Tool::Sphere { centre, radius_mm }, &positions)
            .expect("a good tool");
        assert_sound(&field, &format!("ball {n}"));
    }
}

#[test]
fn pentahedra_that_share_only_an_edge_or_a_node_stay_closed() {
    // Two wedges that touch along an edge, and a third at one node.
    let wedge = |corners: [DVec3; 3]| corners.into_iter().chain(corners.map(|corner| corner + 2.0 * DVec3::Z));
    let at = |x: f64, y: f64| DVec3::new(x, y, 0.0);
    let mut rest: Vec<DVec3> = wedge([at(0.0, 0.0), at(0.0, 2.0), at(2.0, 0.0)]).collect();
    rest.extend(
        [at(0.0, -2.0), at(-2.0, 0.0)]
            .into_iter()
            .flat_map(|place| [place, place + 2.0 * DVec3::Z]),
    );
    let base = rest.len() as u32;
    rest.extend([DVec3::new(-3.0, -1.0, 4.0), DVec3::new(-1.0, -3.0, 4.0)]);
    rest.extend([
        DVec3::new(-3.0, -1.0, 3.0),
        DVec3::new(-1.0, -3.0, 3.0),
        DVec3::new(0.0, 0.0, 4.0),
    ]);
    let pentahedra = [
        [0, 1, 2, 3, 4, 5],
        [0, 6, 8, 3, 7, 9],
        [3, base + 3, base + 2, base + 4, base + 1, base],
    ];
    let mut field = Field::new(&rest, &pentahedra, 0.4, |_, _| SurfaceKind::Other).expect("three wedges");
    let positions = current(&rest, |place| place);
    assert_sound(&field, "uncut");
    let mut random = Random(3);
    for n in 0..60 {
        let centre = DVec3::new(
            random.between(-1.5, 1.5),
            random.between(-1.5, 1.5),
            random.between(-0.5, 4.0),
        );
        let radius_mm = random.between(0.2, 0.7);
        field
            .cut(&Tool::Sphere { centre, radius_mm }, &positions)
            .expect("a good tool");
        assert_sound(&field, &format!("ball {n}"));
    }
}

#[test]
fn a_face_that_is_crossed_by_one_axis_and_along_the_other_stays_closed() {
    // The second wedge's axis lies across the first's on the face that they share.
    let at = |x: f64, y: f64, z: f64| DVec3::new(x, y, z);
    let rest = [
        [at(0.0, 0.0, 0.0), at(2.0, 2.0, 0.0), at(2.0, 0.0, 0.0)],
        [at(0.0, 0.0, 2.0), at(2.0, 2.0, 2.0), at(2.0, 0.0, 2.0)],
        [at(4.0, 0.0, 0.0), at(4.0, 2.0, 0.0), DVec3::ZERO],
    ];
    let rest = &rest.as_flattened()[..8];
    let positions = current(rest, |place| place);
    let second: [u32; 6] = [2, 6, 5, 1, 7, 4];
    for turn in 0..3 {
        for order in [[0, 1, 2, 3, 4, 5], [3, 5, 4, 0, 2, 1]] {
            let second = order.map(|corner: usize| second[corner / 3 * 3 + (corner + turn) % 3]);
            let pentahedra = [[0, 1, 2, 3, 4, 5], second];
            let mut field = Field::new(rest, &pentahedra, 0.4, |_, _| SurfaceKind::Other).expect("two wedges");
            let mut random = Random(7);
            for n in 0..30 {
                let centre = at(
                    random.between(1.0, 3.0),
                    random.between(0.0, 2.0),
                    random.between(0.0, 2.0),
                );
                let radius_mm = random.between(0.1, 0.5);
                field
                    .cut(&Tool::Sphere { centre, radius_mm }, &positions)
                    .expect("a good tool");
                assert_sound(&field, &format!("turn {turn}, ball {n}"));
            }
            // What the surface encloses shows that neighbours join where they should: balls as small as the spacing leave
            // ridges that surface and volume round differently, but not by this much.
            let mut places = Vec::new();
            field.move_vertices(&positions, &mut places).expect("as many as nodes");
            let volume = enclosed(field.surface().triangles(), &places);
            assert!(
                (volume / field.volume_mm3() - 1.0).abs() < 0.1,
                "{volume} against {}",
                field.volume_mm3()
            );
        }
    }
}

#[test]
fn edges_are_divided_by_their_own_length_and_neighbours_agree() {
    const SPACING: f64 = 0.5;
    let lattice = tube(39.0, 20.0, 8.0);
    let field = tube_field(&lattice, SPACING);
    let mut parts = std::collections::HashMap::new();
    for (pentahedron, nodes) in (0..).zip(&lattice.pentahedra) {
        let divisions = field.divisions(pentahedron).expect("a pentahedron of the tube");
        for (ends, count) in wedge::EDGES.iter().zip(divisions) {
            let [a, b] = ends.map(|end| nodes[end]);
            let length = lattice.positions[a as usize].distance(lattice.positions[b as usize]);
            assert!(
                length <= SPACING * count as f64 * (1.0 + 1e-9),
                "{length} mm in {count} parts"
            );
            // Sheets of this tube have edges of nearly one length.
            assert!(length > SPACING * (count as f64 - 1.5), "{length} mm in {count} parts");
            assert_eq!(*parts.entry([a.min(b), a.max(b)]).or_insert(count), count);
        }
    }
    assert_eq!(field.divisions(lattice.pentahedra.len() as u32), None);
}

/// Nodes and pentahedra of a ring of twelve, whose triangle turns by some thirds of a circle along it.
fn ring(thirds: usize) -> (Vec<DVec3>, Vec<[u32; 6]>) {
    const COUNT: usize = 12;
    let mut rest = Vec::new();
    for n in 0..COUNT {
        let share = n as f64 / COUNT as f64;
        let out = DVec3::new(
            (std::f64::consts::TAU * share).cos(),
            (std::f64::consts::TAU * share).sin(),
            0.0,
        );
        for corner in 0..3 {
            let angle = std::f64::consts::TAU * (corner as f64 + share * thirds as f64) / 3.0;
            rest.push(out * (5.0 + 1.5 * angle.cos()) + DVec3::Z * 1.5 * angle.sin());
        }
    }
    let pentahedra = (0..COUNT)
        .map(|n| {
            let turn = if n + 1 == COUNT { thirds } else { 0 };
            let node = |n: usize, corner: usize| (3 * (n % COUNT) + corner % 3) as u32;
            std::array::from_fn(|c| node(n + c / 3, c % 3 + turn * (c / 3)))
        })
        .collect();
    (rest, pentahedra)
}

#[test]
fn a_ring_that_closes_turned_is_refused_and_one_that_does_not_is_cut() {
    let new = |thirds| {
        let (rest, pentahedra) = ring(thirds);
        Field::new(&rest, &pentahedra, 0.5, |_, _| SurfaceKind::Other)
    };
    assert!(matches!(new(1), Err(FieldError::Wound(_))), "{:?}", new(1).err());
    let mut field = new(0).expect("a ring");
    let positions = current(&ring(0).0, |place| place);
    let mut random = Random(17);
    for n in 0..40 {
        let centre = 5.0 * random.direction().with_z(0.0).normalize() + random.direction();
        let radius_mm = random.between(0.3, 1.2);
        field
            .cut(&Tool::Sphere { centre, radius_mm }, &positions)
            .expect("a good tool");
        assert_sound(&field, &format!("ball {n}"));
    }
}

#[test]
fn what_nothing_cut_holds_nothing() {
    let mut field = block_field([6, 6, 6], 2.0, 0.5);
    let (rest, pentahedra) = block([6, 6, 6], 2.0);
    let positions = current(&rest, |place| place);
    assert_eq!(field.bytes(), 0);
    assert_eq!(field.volume_mm3(), field.initial_volume_mm3());
    let far = Tool::Sphere {
        centre: DVec3::splat(-20.0),
        radius_mm: 5.0,
    };
    assert!(field.cut(&far, &positions).expect("a good tool").removed.is_empty());
    assert_eq!(field.bytes(), 0);
    let corner = Tool::Sphere {
        centre: DVec3::ZERO,
        radius_mm: 1.5,
    };
    field.cut(&corner, &positions).expect("a good tool");
    assert!(field.bytes() > 0);
    for (pentahedron, nodes) in (0..).zip(&pentahedra) {
        let nearest = nodes
            .iter()
            .map(|&node| rest[node as usize].length())
            .fold(f64::INFINITY, f64::min);
        assert!(
            !field.is_touched(pentahedron) || nearest < 4.0,
            "pentahedron {pentahedron} at {nearest} mm"
        );
    }
}

#[test]
fn the_same_strokes_give_the_same_bytes() {
    let run = || {
        let lattice = tube(20.0, 20.0, 20.0);
        let mut field = tube_field(&lattice, 0.6);
        let positions = current(&lattice.positions, deformed);
        let mut random = Random(23);
        for _ in 0..20 {
            for tool in random_stroke(&mut random) {
                field.cut(&tool, &positions).expect("a good tool");
            }
        }
        let (mut places, mut normals) = (Vec::new(), Vec::new());
        field.move_vertices(&positions, &mut places).expect("as many as nodes");
        field.move_normals(&positions, &mut normals).expect("as many as nodes");
        let bits = |all: Vec<Vec3>| all.iter().map(|v| v.to_array().map(f32::to_bits)).collect::<Vec<_>>();
        let volumes: Vec<u64> = (0..field.pentahedron_count() as u32)
            .map(|n| field.kept_mm3(n).to_bits())
            .collect();
        (
            field.surface().triangle_slots().to_vec(),
            bits(places),
            bits(normals),
            volumes,
        )
    };
    assert!(run() == run());
}

#[test]
fn the_surface_encloses_what_is_kept() {
    let (rest, _) = block([5, 5, 5], 2.0);
    let mut field = block_field([5, 5, 5], 2.0, 0.5);
    let positions = current(&rest, |place| place);
    let tool = Tool::HalfCylinder {
        from: DVec3::new(4.8, 8.1, -3.0),
        to: DVec3::new(5.3, 7.7, 14.0),
        down: DVec3::NEG_Y,
        radius_mm: 3.2,
    };
    field.cut(&tool, &positions).expect("a good tool");
    let mut places = Vec::new();
    field.move_vertices(&positions, &mut places).expect("as many as nodes");
    let volume = enclosed(field.surface().triangles(), &places);
    assert!(
        (volume / field.volume_mm3() - 1.0).abs() < 0.01,
        "{volume} against {}",
        field.volume_mm3()
    );
}

#[test]
fn normals_follow_the_surface() {
    let lattice = tube(24.0, 24.0, 10.0);
    let mut field = tube_field(&lattice, 0.5);
    let ball = Tool::Sphere {
        centre: DVec3::new(12.0, 0.0, 12.0),
        radius_mm: 6.0,
    };
    let rest = current(&lattice.positions, |place| place);
    field.cut(&ball, &rest).expect("a good tool");
    let positions = current(&lattice.positions, deformed);
    let (mut places, mut normals) = (Vec::new(), Vec::new());
    field.move_vertices(&positions, &mut places).expect("as many as nodes");
    field.move_normals(&positions, &mut normals).expect("as many as nodes");
    let mut sums = vec![Vec3::ZERO; places.len()];
    for triangle in field.surface().triangles() {
        let [a, b, c] = triangle.map(|vertex| places[vertex as usize]);
        triangle
            .into_iter()
            .for_each(|vertex| sums[vertex as usize] += (b - a).cross(c - a));
    }
    let (mut worst, mut mean, mut count) = (1.0_f32, 0.0, 0.0);
    for (sum, normal) in sums.iter().zip(&normals).filter(|(sum, _)| sum.length() > 1e-3) {
        let cosine = sum.normalize().dot(*normal);
        (worst, mean, count) = (worst.min(cosine), mean + cosine, count + 1.0);
    }
    assert!(
        mean / count > 0.995 && worst > 0.5,
        "mean {}, worst {worst}",
        mean / count
    );
}

#[test]
fn a_chip_made_in_parts_while_the_next_is_cut_is_the_one_made_at_once() {
    let (rest, _) = block([6, 6, 6], 2.0);
    let positions = current(&rest, |place| place);
    let ball = |x: f64, radius_mm: f64| Tool::Sphere {
        centre: DVec3::new(x, 5.9, 6.3),
        radius_mm,
    };
    let mut field = block_field([6, 6, 6], 2.0, 0.5);
    field.begin_chip();
    field.cut(&ball(5.0, 3.5), &positions).expect("a good tool");
    let mut at_once = field.clone();
    let at_once = at_once.take_chip(&positions).expect("good positions").expect("a chip");

    let mut making = field.end_chip(&positions).expect("good positions").expect("a chip");
    assert!(field.end_chip(&positions).expect("good positions").is_none());
    // What the first took is given back and taken again for the second.
    field.begin_chip();
    let mut parts = 0;
    let in_parts = loop {
        parts += 1;
        if parts < 8 {
            let next = ball(5.0 + 0.7 * f64::from(parts), 3.5);
            field.cut(&next, &positions).expect("a good tool");
        }
        if let Some(chip) = making.advance(&field, 7) {
            break chip;
        }
    };
    assert!(parts > 20, "it was to be made in parts, not in {parts}");
    assert_eq!(in_parts, at_once);
    chip_is_closed(&in_parts);
}

#[test]
fn a_chip_is_the_body_that_was_cut() {
    let (rest, _) = block([6, 6, 6], 2.0);
    let positions = current(&rest, |place| place);
    let mut field = block_field([6, 6, 6], 2.0, 0.5);
    let centre = DVec3::new(6.1, 5.9, 6.3);
    field.begin_chip();
    let cut = field
        .cut(&Tool::Sphere { centre, radius_mm: 3.5 }, &positions)
        .expect("a good tool");
    let chip = field.take_chip(&positions).expect("good positions").expect("a chip");
    chip_is_closed(&chip);
    assert!((chip.rest_volume_mm3 - cut.removed_mm3).abs() < 1e-9);
    let volume = enclosed(chip.triangles.iter().copied(), &chip.vertices);
    assert!(
        (volume / chip.rest_volume_mm3 - 1.0).abs() < 0.02,
        "{volume} against {}",
        chip.rest_volume_mm3
    );
    assert!(chip.centre.distance(centre) < 0.02, "{}", chip.centre);
    let exact = 0.4 * chip.rest_volume_mm3 * 3.5 * 3.5;
    for (n, axis) in DVec3::AXES.into_iter().enumerate() {
        assert!(
            (chip.inertia.col(n)[n] / exact - 1.0).abs() < 0.02,
            "{} against {exact}",
            chip.inertia
        );
        assert!(
            (chip.inertia * axis - axis * chip.inertia.col(n)[n]).length() < 0.02 * exact,
            "{}",
            chip.inertia
        );
    }
    assert!(field.take_chip(&positions).expect("good positions").is_none());
    // A second cut that overlaps the first takes what the first left.
    field.begin_chip();
    let cut = field
        .cut(
            &Tool::Sphere {
                centre: centre + 2.0 * DVec3::X,
                radius_mm: 3.0,
            },
            &positions,
        )
        .expect("a good tool");
    let chip = field.take_chip(&positions).expect("good positions").expect("a chip");
    chip_is_closed(&chip);
    let volume = enclosed(chip.triangles.iter().copied(), &chip.vertices);
    // Its edge is as thin as a knife's, and the surface rounds it.
    assert!(
        (volume / cut.removed_mm3 - 1.0).abs() < 0.1,
        "{volume} against {}",
        cut.removed_mm3
    );
}

#[test]
fn a_piece_that_nothing_holds_is_found_and_freed() {
    let (rest, _) = block([8, 3, 3], 2.0);
    let positions = current(&rest, |place| place);
    let mut field = block_field([8, 3, 3], 2.0, 0.5);
    // Two slots through the whole block leave a slice of 4 mm between them.
    let slot = |x: f64| Tool::HalfCylinder {
        from: DVec3::new(x, -8.0, 3.0),
        to: DVec3::new(x, 14.0, 3.0),
        down: DVec3::X,
        radius_mm: 4.6,
    };
    let first = field.cut(&slot(0.4), &positions).expect("a good tool");
    let around: Vec<u32> = first.removed.iter().map(|&(pentahedron, _)| pentahedron).collect();
    let nothing = field.holds(|_| false);
    let pieces = field.loose_pieces(&around, 200.0, &nothing);
    assert!(pieces.iter().all(|piece| piece.rest_volume_mm3 < 100.0));
    let held = field.loose_pieces(&around, 200.0, &field.holds(|_| true));
    assert!(held.is_empty());
    let second = field.cut(&slot(8.2), &positions).expect("a good tool");
    let around: Vec<u32> = second.removed.iter().map(|&(pentahedron, _)| pentahedron).collect();
    let pieces = field.loose_pieces(&around, 500.0, &nothing);
    assert!(!pieces.is_empty());
    field.begin_chip();
    let mut freed = 0.0;
    for piece in &pieces {
        freed += field
            .empty(&piece.pentahedra)
            .expect("pentahedra of the field")
            .removed_mm3;
        assert_sound(&field, "freed");
    }
    let chip = field.take_chip(&positions).expect("good positions").expect("a chip");
    chip_is_closed(&chip);
    assert!((chip.rest_volume_mm3 - freed).abs() < 1e-9);
    let volume = enclosed(chip.triangles.iter().copied(), &chip.vertices);
    assert!((volume / freed - 1.0).abs() < 0.05, "{volume} against {freed}");
}

/// Triangles and volume at rest, mm³, of every body that the surface bounds; of a hollow inside of tissue the volume is
/// negative.
fn bodies(field: &Field) -> Vec<(usize, f64)> {
    fn first(of: &mut [u32], mut vertex: u32) -> u32 {
        while of[vertex as usize] != vertex {
            of[vertex as usize] = of[of[vertex as usize] as usize];
            vertex = of[vertex as usize];
        }
        vertex
    }
    let surface = field.surface();
    let mut of: Vec<u32> = (0..surface.vertex_count() as u32).collect();
    for [a, b, c] in surface.triangles() {
        for other in [b, c] {
            let (one, other) = (first(&mut of, a), first(&mut of, other));
            of[one as usize] = other;
        }
    }
    let mut bodies = vec![(0, 0.0); of.len()];
    for triangle in surface.triangles() {
        let body = &mut bodies[first(&mut of, triangle[0]) as usize];
        body.0 += 1;
        body.1 += enclosed([triangle].into_iter(), surface.rest_places());
    }
    bodies.retain(|&(triangles, _)| triangles > 0);
    bodies
}

#[test]
fn crumbs_are_brushed_off_and_nothing_else_is() {
    let lattice = tube(24.0, 24.0, 15.0);
    let mut field = tube_field(&lattice, 0.4);
    let positions = current(&lattice.positions, deformed);
    let is_crumb = |&(triangles, volume): &(usize, f64)| triangles < 60 && volume > 0.0;
    let mut random = Random(5);
    let (mut crumbs, mut brushed_mm3) = (0, 0.0);
    for stroke in 0..150 {
        let mut reached = Vec::new();
        for tool in random_stroke(&mut random) {
            let cut = field.cut(&tool, &positions).expect("a good tool");
            reached.extend(cut.removed.iter().map(|&(pentahedron, _)| pentahedron));
        }
        let found: Vec<_> = bodies(&field).into_iter().filter(is_crumb).collect();
        let cut = field.brush_off(&reached);
        assert_sound(&field, &format!("stroke {stroke}"));
        assert_eq!(bodies(&field).into_iter().find(is_crumb), None, "stroke {stroke}");
        assert_eq!(field.brush_off(&reached), Cut::default(), "stroke {stroke}: twice");
        if found.is_empty() {
            // A larger one may have gone; none holds more than its 200 points.
            assert!(cut.removed_mm3 < 200.0 * 0.4f64.powi(3), "stroke {stroke}: {cut:?}");
        }
        crumbs += found.len();
        brushed_mm3 += cut.removed_mm3;
    }
    println!("{crumbs} crumbs, {brushed_mm3:.3} mm³");
    assert!(crumbs >= 5, "the strokes are to leave some: {crumbs}");
    assert!(brushed_mm3 < 1e-3 * field.removed_mm3(), "{brushed_mm3} mm³");

    // A clean wall has none, nor has what no cut reached.
    let (rest, _) = block([8, 3, 3], 2.0);
    let mut field = block_field([8, 3, 3], 2.0, 0.5);
    assert_eq!(field.brush_off(&[0, 1, 2, u32::MAX]), Cut::default());
    let slot = Tool::HalfCylinder {
        from: DVec3::new(0.4, -8.0, 3.0),
        to: DVec3::new(0.4, 14.0, 3.0),
        down: DVec3::X,
        radius_mm: 4.6,
    };
    let cut = field.cut(&slot, &current(&rest, |place| place)).expect("a good tool");
    let reached: Vec<u32> = cut.removed.iter().map(|&(pentahedron, _)| pentahedron).collect();
    assert!(!reached.is_empty());
    assert_eq!(field.brush_off(&reached), Cut::default());
}

#[test]
fn coagulation_is_read_back_on_what_is_cut_later() {
    let (rest, _) = block([6, 6, 6], 2.0);
    let positions = current(&rest, |place| place);
    let mut field = block_field([6, 6, 6], 2.0, 0.5);
    let middle = DVec3::new(6.0, 6.0, 12.0);
    let changed = field.coagulate(&[middle], 1.0, 2.0, &positions).expect("a good ball");
    assert!(!changed.is_empty());
    assert_sound(&field, "coagulated");
    assert_eq!(field.volume_mm3(), field.initial_volume_mm3());
    let ball = Tool::Sphere {
        centre: middle,
        radius_mm: 2.0,
    };
    field.cut(&ball, &positions).expect("a good tool");
    assert_sound(&field, "cut");
    let mut places = Vec::new();
    field.move_vertices(&positions, &mut places).expect("as many as nodes");
    for vertex in field.surface().triangles().flatten() {
        let depth = field.surface().coagulation_mm()[vertex as usize];
        let exact = (3.0 - places[vertex as usize].as_dvec3().distance(middle)).max(0.0) as f32;
        assert!((depth - exact).abs() < 0.15, "{depth} against {exact}");
    }
}

#[test]
fn balls_coagulate_together_as_one_after_the_other() {
    let (rest, _) = block([6, 6, 6], 2.0);
    let positions = current(&rest, |place| place);
    let centres: Vec<DVec3> = (0..5)
        .map(|n| DVec3::new(3.0 + 1.3 * f64::from(n), 6.2, 11.8))
        .collect();
    let coagulated = |balls: &[&[DVec3]]| {
        let mut field = block_field([6, 6, 6], 2.0, 0.5);
        for centres in balls {
            field.coagulate(centres, 1.0, 2.0, &positions).expect("good balls");
        }
        assert_sound(&field, "coagulated");
        let slot = Tool::Sphere {
            centre: DVec3::new(6.0, 6.0, 12.0),
            radius_mm: 3.0,
        };
        field.cut(&slot, &positions).expect("a good tool");
        let mut places = Vec::new();
        field.move_vertices(&positions, &mut places).expect("as many as nodes");
        let depth = |vertex: u32| field.surface().coagulation_mm()[vertex as usize].to_bits();
        let place = |vertex: u32| places[vertex as usize].to_array().map(f32::to_bits);
        let mut found: Vec<_> = field
            .surface()
            .triangles()
            .flatten()
            .map(|vertex| (place(vertex), depth(vertex)))
            .collect();
        found.sort_unstable();
        found
    };
    let one_by_one: Vec<&[DVec3]> = centres.chunks(1).collect();
    let together = coagulated(&[&centres]);
    assert!(together.iter().any(|(_, depth)| *depth > 0));
    assert!(together == coagulated(&one_by_one));
}
