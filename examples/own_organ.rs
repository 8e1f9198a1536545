//! An organ that is no prostate: a closed, hollow gallbladder is made from contours and cut open.
//!
//! A lattice is a tube with open ends, so the organ is built as a general mesh: its contours are joined to a closed
//! surface, and every triangle of that becomes a column of pentahedra through the wall.
//!
//! `cargo run --release --example own_organ`

use std::f64::consts::TAU;

use bevy::{
    math::{DVec2, DVec3},
    prelude::*,
    time::TimeUpdateStrategy,
};
use resecta::{prelude::*, solver::Material};

const WALL_MM: f64 = 2.4;
const LAYERS: u32 = 2;

/// Contours from neck to fundus: height and corners, all with the same number of corners, counter-clockwise.
fn contours() -> Vec<(f64, Vec<DVec2>)> {
    let profile = [
        (2.0, 5.0),
        (8.0, 8.0),
        (16.0, 9.0),
        (26.0, 11.5),
        (36.0, 13.5),
        (45.0, 13.0),
        (52.0, 9.5),
        (56.0, 5.5),
    ];
    let corner = |n: u32, radius: f64| {
        // Flattened where it lies against the liver.
        let direction = DVec2::from_angle(TAU * f64::from(n) / 28.0);
        direction
            * radius
            * if direction.y > 0.0 {
                1.0 - 0.2 * direction.y
            } else {
                1.0
            }
    };
    profile
        .map(|(z, radius)| (z, (0..28).map(|n| corner(n, radius)).collect()))
        .to_vec()
}

/// Joins contours to a closed surface with a pole at either end: points, and triangles outward.
fn close(contours: &[(f64, Vec<DVec2>)]) -> (Vec<DVec3>, Vec<[u32; 3]>) {
    let (rings, corners) = (contours.len() as u32, contours[0].1.len() as u32);
    let mut points: Vec<DVec3> = contours
        .iter()
        .flat_map(|(z, contour)| contour.iter().map(move |point| point.extend(*z)))
        .collect();
    let middle = |(z, contour): &(f64, Vec<DVec2>), by: f64| {
        (contour.iter().sum::<DVec2>() / contour.len() as f64).extend(z + by)
    };
    points.push(middle(&contours[0], -2.0));
    points.push(middle(&contours[contours.len() - 1], 2.0));
    let (low, high) = (rings * corners, rings * corners + 1);
    let at = |ring: u32, corner: u32| ring * corners + corner % corners;
    let mut triangles = Vec::new();
    for n in 0..corners {
        triangles.push([low, at(0, n + 1), at(0, n)]);
        for ring in 0..rings - 1 {
            triangles.push([at(ring, n), at(ring, n + 1), at(ring + 1, n + 1)]);
            triangles.push([at(ring, n), at(ring + 1, n + 1), at(ring + 1, n)]);
        }
        triangles.push([high, at(rings - 1, n), at(rings - 1, n + 1)]);
    }
    (points, triangles)
}

/// Makes a wall of pentahedra inside a closed surface: the mesh, with the lumen and the outer wall marked.
fn wall(points: &[DVec3], triangles: &[[u32; 3]]) -> TissueMesh {
    let mut normals = vec![DVec3::ZERO; points.len()];
    for triangle in triangles {
        let [a, b, c] = triangle.map(|corner| points[corner as usize]);
        for corner in triangle {
            normals[*corner as usize] += (b - a).cross(c - a);
        }
    }
    let count = points.len() as u32;
    let shell = |layer: u32| {
        let depth = WALL_MM * (1.0 - f64::from(layer) / f64::from(LAYERS));
        points
            .iter()
            .zip(&normals)
            .map(move |(point, normal)| *point - normal.normalize() * depth)
    };
    let positions = (0..=LAYERS).flat_map(shell).collect();
    let pentahedra = (0..LAYERS).flat_map(|layer| {
        triangles.iter().map(move |&[a, b, c]| {
            // The first triangle of a pentahedron faces away from the second: towards the lumen.
            let (inner, outer) = (layer * count, (layer + 1) * count);
            [inner + a, inner + c, inner + b, outer + a, outer + c, outer + b]
        })
    });
    let mut mesh = TissueMesh::from_pentahedra(positions, pentahedra.collect());
    mesh.lumen = (0..count).collect();
    mesh.capsule = (LAYERS * count..(LAYERS + 1) * count).collect();
    mesh
}

fn main() -> Result {
    let (points, triangles) = close(&contours());
    let organ = resecta::solver::Tissue::new(&wall(&points, &triangles), &Material::default())?;
    println!(
        "{} nodes, wall of {:.2} ml",
        organ.node_count(),
        organ.volume_mm3() / 1000.0
    );

    let mut app = App::new();
    app.add_plugins((MinimalPlugins, TissuePlugin::default()))
        .insert_resource(Time::<Fixed>::from_hz(60.0))
        .insert_resource(TimeUpdateStrategy::FixedTimesteps(1));
    let settings = TissueSettings {
        check_consistency: true,
        ..default()
    };
    let organ = app.world_mut().spawn((Tissue::new(organ), settings)).id();
    // A loop over the front of the fundus that cuts towards the neck.
    let cutter = LoopCutter {
        width_mm: 6.5,
        depth_mm: 4.5,
        kerf: Kerf::default(),
        centre: Vec3::ZERO,
        travel: Vec3::NEG_Z,
        down: Vec3::Y,
    };
    let pose = |way_mm: f32| Isometry3d::from_translation(Vec3::new(0.0, -15.0, 48.0 - way_mm));
    let mut tool = TissueTool::new(Vec::new(), pose(0.0)).with_cutter(cutter);
    tool.cutting = true;
    let tool = app.world_mut().spawn(tool).id();

    app.update(); // sets the clocks
    let mut removed_mm3 = 0.0;
    for step in 0..60 {
        if let Some(mut tool) = app.world_mut().get_mut::<TissueTool>(tool) {
            tool.pose = pose(step as f32 * 0.4);
        }
        app.update();
        let told = app.world().resource::<Messages<TissueResected>>();
        removed_mm3 += told
            .iter_current_update_messages()
            .map(|resected| resected.volume_mm3)
            .sum::<f64>();
    }
    let solver = app.world().get::<Tissue>(organ).ok_or("the organ is there")?.solver();
    solver.validate()?;
    assert_eq!(removed_mm3, solver.removed_volume_mm3());
    println!(
        "cut {removed_mm3:.0} mm³ of its wall, {} pentahedra left",
        solver.living_pentahedra()
    );
    Ok(())
}
