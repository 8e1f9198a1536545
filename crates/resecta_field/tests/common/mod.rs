//! Tissues and checks that the tests share.
#![allow(dead_code)] // Each test file uses some of them.

use std::collections::HashMap;

use glam::{DVec2, DVec3, Vec3};
use resecta_anatomy::{Lattice, LatticeOptions, Section};
use resecta_field::{Chip, Field, SurfaceKind};

/// Nodes and pentahedra of a block of `n` cubes along each side, each of edge `edge` mm, cut into two pentahedra.
pub fn block(n: [u32; 3], edge: f64) -> (Vec<DVec3>, Vec<[u32; 6]>) {
    let index = |x: u32, y: u32, z: u32| (z * (n[1] + 1) + y) * (n[0] + 1) + x;
    let mut positions = Vec::new();
    for z in 0..=n[2] {
        for y in 0..=n[1] {
            for x in 0..=n[0] {
                positions.push(DVec3::new(x.into(), y.into(), z.into()) * edge);
            }
        }
    }
    let mut pentahedra = Vec::new();
    for z in 0..n[2] {
        for y in 0..n[1] {
            for x in 0..n[0] {
                let c = |dx, dy, dz| index(x + dx, y + dy, z + dz);
                pentahedra.push([c(0, 0, 0), c(1, 1, 0), c(1, 0, 0), c(0, 0, 1), c(1, 1, 1), c(1, 0, 1)]);
                pentahedra.push([c(0, 0, 0), c(0, 1, 0), c(1, 1, 0), c(0, 0, 1), c(0, 1, 1), c(1, 1, 1)]);
            }
        }
    }
    (positions, pentahedra)
}

pub fn block_field(n: [u32; 3], edge: f64, spacing: f64) -> Field {
    let (rest, pentahedra) = block(n, edge);
    Field::new(&rest, &pentahedra, spacing, |_, _| SurfaceKind::Other).expect("a block is a tissue")
}

/// A tube of the given outer and 8 mm inner diameter, cut at an angle of `alpha_deg`.
pub fn tube(outer_mm: f64, length_mm: f64, alpha_deg: f64) -> Lattice {
    let circle = |radius: f64| -> Vec<DVec2> {
        (0..180)
            .map(|n| DVec2::from_angle(f64::from(n) * std::f64::consts::TAU / 180.0) * radius)
            .collect()
    };
    let (outer, inner) = (circle(0.5 * outer_mm), circle(4.0));
    let sections: Vec<Section> = (0..7)
        .map(|n| Section {
            z: length_mm / 6.0 * f64::from(n),
            outer: &outer,
            inner: &inner,
        })
        .collect();
    let options = LatticeOptions {
        alpha_deg,
        ..LatticeOptions::default()
    };
    Lattice::from_sections(&sections, &options).expect("a tube is a lattice")
}

pub fn tube_field(lattice: &Lattice, spacing: f64) -> Field {
    Field::new(&lattice.positions, &lattice.pentahedra, spacing, |_, face| {
        if face < 2 {
            SurfaceKind::Other
        } else {
            SurfaceKind::Capsule
        }
    })
    .expect("a tube is a tissue")
}

pub fn current(rest: &[DVec3], place: impl Fn(DVec3) -> DVec3) -> Vec<Vec3> {
    rest.iter().map(|&position| place(position).as_vec3()).collect()
}

/// Numbers between 0 and 1 that are always the same.
pub struct Random(pub u64);

impl Random {
    pub fn next(&mut self) -> f64 {
        self.0 = self
            .0
            .wrapping_mul(6364136223846793005)
            .wrapping_add(1442695040888963407);
        (self.0 >> 11) as f64 / (1u64 << 53) as f64
    }

    pub fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.next()
    }

    pub fn direction(&mut self) -> DVec3 {
        loop {
            let vector = DVec3::new(
                self.between(-1.0, 1.0),
                self.between(-1.0, 1.0),
                self.between(-1.0, 1.0),
            );
            if (0.1..1.0).contains(&vector.length()) {
                return vector.normalize();
            }
        }
    }
}

/// A tube twisted, bent and squeezed.
pub fn deformed(place: DVec3) -> DVec3 {
    let turn = 0.02 * place.z;
    let (sin, cos) = turn.sin_cos();
    DVec3::new(
        cos * place.x - sin * place.y + 0.01 * place.z * place.z,
        0.9 * (sin * place.x + cos * place.y),
        1.1 * place.z + 0.5 * (0.2 * place.x).sin(),
    )
}

/// Every directed edge must come as often as its opposite.
pub fn assert_closed(triangles: impl Iterator<Item = [u32; 3]>, what: &str) {
    let mut balance: HashMap<[u32; 2], i32> = HashMap::new();
    for [a, b, c] in triangles {
        assert!(a != b && b != c && c != a, "{what}: a triangle has a corner twice");
        for [from, to] in [[a, b], [b, c], [c, a]] {
            *balance.entry([from.min(to), from.max(to)]).or_default() += if from < to { 1 } else { -1 };
        }
    }
    let open = balance.values().filter(|&&balance| balance != 0).count();
    assert_eq!(open, 0, "{what}: edges without an opposite");
}

/// What must hold of a field at any time.
pub fn assert_sound(field: &Field, what: &str) {
    let surface = field.surface();
    assert_closed(surface.triangles(), what);
    for vertex in surface.triangles().flatten() {
        let (pentahedron, weights) = surface.carrier(vertex).expect("a vertex of a triangle is carried");
        assert!(weights.iter().all(|&weight| weight >= 0.0), "{what}: {weights:?}");
        assert!((weights.iter().sum::<f32>() - 1.0).abs() < 1e-5, "{what}: {weights:?}");
        assert!(
            field.fill(pentahedron) > 0.0,
            "{what}: a vertex in an empty pentahedron"
        );
    }
    let lost = field.initial_volume_mm3() - field.volume_mm3();
    let error = (lost - field.removed_mm3()).abs() / field.initial_volume_mm3();
    assert!(
        error < 1e-12,
        "{what}: {lost} mm³ are missing, {} were reported",
        field.removed_mm3()
    );
}

/// Volume that closed triangles enclose.
pub fn enclosed(triangles: impl Iterator<Item = [u32; 3]>, places: &[Vec3]) -> f64 {
    let six: f64 = triangles
        .map(|triangle| triangle.map(|vertex| places[vertex as usize].as_dvec3()))
        .map(|[a, b, c]| a.dot(b.cross(c)))
        .sum();
    six / 6.0
}

/// Wavefront OBJ with normals.
pub fn obj(places: &[Vec3], normals: &[Vec3], triangles: impl Iterator<Item = [u32; 3]>) -> String {
    use std::fmt::Write as _;
    let mut text = String::new();
    for v in places {
        let _ = writeln!(text, "v {} {} {}", v.x, v.y, v.z);
    }
    for n in normals {
        let _ = writeln!(text, "vn {} {} {}", n.x, n.y, n.z);
    }
    for [a, b, c] in triangles.map(|triangle| triangle.map(|vertex| vertex + 1)) {
        let _ = writeln!(text, "f {a}//{a} {b}//{b} {c}//{c}");
    }
    text
}

pub fn chip_is_closed(chip: &Chip) {
    assert_closed(chip.triangles.iter().copied(), "chip");
}
