//! The visible mesh.

use std::collections::BTreeMap;

use bevy::{
    camera::{primitives::Aabb, visibility::NoAutoAabb},
    mesh::{Indices, VertexAttributeValues},
    prelude::*,
};
use resecta_tissue::prelude::*;

use crate::scenes::{app, checked, small_block};

fn scene(settings: TissueSettings) -> (App, Entity) {
    let mut app = app();
    app.init_resource::<Assets<Mesh>>();
    let tissue = app.world_mut().spawn((Tissue::new(small_block()), settings)).id();
    app.update();
    (app, tissue)
}

pub fn mesh(app: &App, tissue: Entity) -> &Mesh {
    let handle = app.world().get::<Mesh3d>(tissue).expect("a mesh");
    app.world()
        .resource::<Assets<Mesh>>()
        .get(&handle.0)
        .expect("its asset")
}

pub fn indices(mesh: &Mesh) -> Vec<u32> {
    match mesh.indices() {
        Some(Indices::U32(indices)) => indices.clone(),
        _ => panic!("32-bit indices"),
    }
}

pub fn positions(mesh: &Mesh) -> Vec<Vec3> {
    match mesh.attribute(Mesh::ATTRIBUTE_POSITION) {
        Some(VertexAttributeValues::Float32x3(positions)) => positions.iter().copied().map(Vec3::from).collect(),
        _ => panic!("positions"),
    }
}

/// Closed and consistently oriented: each edge is there as often in one direction as in the other.
pub fn assert_closed(mesh: &Mesh) {
    let mut edges = BTreeMap::new();
    for triangle in indices(mesh).chunks_exact(3) {
        for (a, b) in [(0, 1), (1, 2), (2, 0)] {
            let (a, b) = (triangle[a], triangle[b]);
            *edges.entry((a.min(b), a.max(b))).or_insert(0) += if a < b { 1 } else { -1 };
        }
    }
    assert!(edges.values().all(|sum| *sum == 0));
}

pub fn volume(mesh: &Mesh) -> f64 {
    let positions = positions(mesh);
    let at = |index: u32| positions[index as usize].as_dvec3();
    indices(mesh)
        .chunks_exact(3)
        .map(|t| at(t[0]).dot(at(t[1]).cross(at(t[2]))) / 6.0)
        .sum()
}

#[test]
fn the_mesh_is_the_closed_surface_of_the_tissue_before_and_after_a_cut() {
    let (mut app, tissue) = scene(checked());
    assert_closed(mesh(&app, tissue));
    for pentahedron in [500, 501, 900, 1100] {
        let entity = app
            .world()
            .get::<Tissue>(tissue)
            .unwrap()
            .pentahedron_entity(pentahedron)
            .unwrap();
        app.world_mut().despawn(entity);
        app.update();
        let mesh = mesh(&app, tissue);
        assert_closed(mesh);
        let solver = app.world().get::<Tissue>(tissue).unwrap().solver();
        assert!((volume(mesh) / solver.volume_mm3() - 1.0).abs() < 1e-4);
    }
}

#[test]
fn the_mesh_moves_in_place_unless_something_was_cut() {
    let (mut app, tissue) = scene(checked());
    let before = (indices(mesh(&app, tissue)), positions(mesh(&app, tissue)));
    let node = app.world().get::<Tissue>(tissue).unwrap().node_entity(780).unwrap();
    app.world_mut().get_mut::<TissueNode>(node).unwrap().load = Vec3::new(0.0, 0.0, 50_000.0);
    for _ in 0..5 {
        app.update();
    }
    let diagnostics = app.world().resource::<TissueDiagnostics>();
    assert_eq!((diagnostics.meshes_rebuilt, diagnostics.meshes_moved), (1, 5));
    assert_eq!(indices(mesh(&app, tissue)), before.0);
    assert_ne!(positions(mesh(&app, tissue)), before.1);
    let entity = app
        .world()
        .get::<Tissue>(tissue)
        .unwrap()
        .pentahedron_entity(0)
        .unwrap();
    app.world_mut().despawn(entity);
    app.update();
    assert_eq!(app.world().resource::<TissueDiagnostics>().meshes_rebuilt, 2);
    assert_ne!(indices(mesh(&app, tissue)), before.0);
}

#[test]
fn texture_coordinates_are_places_at_rest_however_the_tissue_moves() {
    let (mut app, tissue) = scene(checked());
    let at_rest = positions(mesh(&app, tissue));
    let node = app.world().get::<Tissue>(tissue).unwrap().node_entity(780).unwrap();
    app.world_mut().get_mut::<TissueNode>(node).unwrap().load = Vec3::new(0.0, 0.0, 50_000.0);
    for _ in 0..5 {
        app.update();
    }
    let pairs =
        [Mesh::ATTRIBUTE_UV_0, Mesh::ATTRIBUTE_UV_1].map(|attribute| match mesh(&app, tissue).attribute(attribute) {
            Some(VertexAttributeValues::Float32x2(pairs)) => pairs.clone(),
            other => panic!("{other:?}"),
        });
    assert_ne!(positions(mesh(&app, tissue)), at_rest);
    for ((&[x, y], &[z, coagulation]), place) in pairs[0].iter().zip(&pairs[1]).zip(at_rest) {
        assert_eq!((Vec3::new(x, y, z), coagulation), (place, 0.0));
    }
}

#[test]
fn the_bound_holds_every_vertex_and_is_the_plugins_own() {
    let (app, tissue) = scene(checked());
    assert!(app.world().get::<NoAutoAabb>(tissue).is_some());
    let bound = app.world().get::<Aabb>(tissue).unwrap();
    for position in positions(mesh(&app, tissue)) {
        assert!(
            (position - Vec3::from(bound.center))
                .abs()
                .cmple(Vec3::from(bound.half_extents) + 1e-4)
                .all()
        );
    }
}

#[test]
fn a_tint_colours_its_nodes() {
    let (mut app, tissue) = scene(checked());
    let red = LinearRgba::rgb(1.0, 0.0, 0.0);
    app.world_mut().entity_mut(tissue).insert(TissueTint {
        nodes: BTreeMap::from([(0, red)]),
    });
    app.update();
    let Some(VertexAttributeValues::Float32x4(colours)) = mesh(&app, tissue).attribute(Mesh::ATTRIBUTE_COLOR) else {
        panic!("colours");
    };
    assert_eq!(
        colours.iter().filter(|colour| **colour == red.to_f32_array()).count(),
        1
    );
    app.world_mut().entity_mut(tissue).insert(TissueTint::default());
    app.update();
    let Some(VertexAttributeValues::Float32x4(colours)) = mesh(&app, tissue).attribute(Mesh::ATTRIBUTE_COLOR) else {
        panic!("colours");
    };
    assert!(colours.iter().all(|colour| *colour != red.to_f32_array()));
}

#[test]
fn no_mesh_is_made_where_none_is_wanted_or_none_can_be_held() {
    let (app, tissue) = scene(TissueSettings {
        visible_mesh: false,
        ..checked()
    });
    assert!(app.world().get::<Mesh3d>(tissue).is_none());
    assert_eq!(
        app.world().resource::<TissueDiagnostics>().rebuild_mesh,
        std::time::Duration::ZERO
    );
    let mut app = crate::scenes::app();
    let tissue = app.world_mut().spawn(Tissue::new(small_block())).id();
    app.update();
    assert!(app.world().get::<Mesh3d>(tissue).is_none());
}
