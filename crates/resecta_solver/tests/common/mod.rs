//! Tissues that the tests share.
#![allow(dead_code)] // Each test file uses some of them.

pub mod blocks;
pub mod networks;

use glam::{DVec2, DVec3, Vec3};
use resecta_anatomy::{Lattice, LatticeOptions, Section};
use resecta_solver::{Contact, Material, ShearResistance, StepReport, Tissue, TissueMesh, TissuePoint};

/// A tube of 40 mm outer and 8 mm inner diameter, 30 mm long.
pub fn tube(alpha_deg: f64, shear: ShearResistance) -> Tissue {
    let lattice = tube_lattice(alpha_deg);
    let material = Material {
        shear,
        ..Material::default()
    };
    Tissue::new(&TissueMesh::from_lattice(&lattice, shear), &material).expect("a tube is a tissue")
}

pub fn tube_lattice(alpha_deg: f64) -> Lattice {
    tube_lattice_around(4.0, alpha_deg)
}

/// The same around a lumen of that radius, mm.
pub fn tube_lattice_around(lumen_mm: f64, alpha_deg: f64) -> Lattice {
    tube_lattice_of([lumen_mm, 20.0], 6, alpha_deg)
}

/// A tube of such radii of lumen and capsule, mm, along z from 0 in so many pieces of 5 mm.
pub fn tube_lattice_of([lumen_mm, capsule_mm]: [f64; 2], pieces: u32, alpha_deg: f64) -> Lattice {
    let circle = |radius: f64| -> Vec<DVec2> {
        (0..180)
            .map(|n| DVec2::from_angle(f64::from(n) * std::f64::consts::TAU / 180.0) * radius)
            .collect()
    };
    let (outer, inner) = (circle(capsule_mm), circle(lumen_mm));
    let sections: Vec<Section> = (0..=pieces)
        .map(|n| Section {
            z: 5.0 * f64::from(n),
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

/// A block of `n` cubes along each side, each of edge `edge` mm, cut into two pentahedra; nothing holds it.
pub fn block_mesh(n: [u32; 3], edge: f64) -> TissueMesh {
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
    TissueMesh::from_pentahedra(positions, pentahedra)
}

/// Drives the flat front of a tool 10 mm wide through a tube along x at 1 m/s, from 25 mm before its axis to 25 mm behind, and
/// shows what came of every step: what the front meets must not stay behind it.
pub fn drive_tool_through(tissue: &mut Tissue, step_s: f64, mut after: impl FnMut(&Tissue, StepReport)) {
    let met: Vec<[u32; 3]> = (tissue.surface().triangles().map(|(_, triangle)| triangle))
        .filter(|triangle| {
            let middle = triangle.iter().map(|&node| tissue.position(node)).sum::<Vec3>() / 3.0;
            middle.y.abs() < 5.0 && (middle.z - 15.0).abs() < 5.0
        })
        .collect();
    let mut front = -25.0f32;
    while front < 25.0 {
        let next = front + 1_000.0 * step_s as f32;
        let contacts: Vec<Contact> = met
            .iter()
            .map(|&nodes| Contact::with_plane(TissuePoint::on_triangle(nodes, [1.0 / 3.0; 3]), Vec3::X, [front, next]))
            .collect();
        let report = tissue.advance(step_s, &contacts).expect("divided if need be");
        after(tissue, report);
        front = next;
    }
}
